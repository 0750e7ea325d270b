#include "harness/descriptions/urdf_file.h"

#include <fmt/format.h>
#include <urdf_model/pose.h>
#include <urdf_model/utils.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "controller/common/text.h"
#include "harness/base/files.h"
#include "harness/descriptions/description_writer.h"
#include "harness/engine/xml.h"

namespace dexcheck {

namespace {

constexpr const char* kRunXacro = ": write the URDF with the program xacro first";

/// Text in the place of a number; braces are an expression that xacro has not expanded.
std::string QuoteValue(const std::string& value) {
  return Quote(value) + (value.find('{') == std::string::npos ? "" : kRunXacro);
}

// Far more than robots have; it also keeps what follows within seconds and megabytes.
constexpr size_t kMaxLinks = 2000;

using Element = tinyxml2::XMLElement;

/// The file of a mesh; empty when it is in none of the packages.
std::filesystem::path FindMesh(const std::string& name, const std::filesystem::path& folder,
                               const std::vector<std::filesystem::path>& packages) {
  std::vector<std::filesystem::path> candidates;
  constexpr std::string_view kPackage = "package://";
  constexpr std::string_view kFile = "file://";
  if (name.starts_with(kPackage)) {
    const std::filesystem::path path = name.substr(kPackage.size());
    const std::filesystem::path package = path.begin() == path.end() ? path : *path.begin();
    for (const std::filesystem::path& root : packages) {
      candidates.push_back(root / path);
      if (MakeAbsolute(root).lexically_normal().filename() == package) {
        candidates.push_back(root / path.lexically_relative(package));
      }
    }
  } else {
    candidates.push_back(folder / (name.starts_with(kFile) ? name.substr(kFile.size()) : name));
  }
  for (const std::filesystem::path& path : candidates) {
    if (!Exists(path) || IsFolder(path)) continue;
    NoteInput(path);
    return path;
  }
  return {};
}

}  // namespace

UrdfFile::UrdfFile(std::string_view text, std::string source)
    : source_(std::move(source)), document_(std::make_unique<tinyxml2::XMLDocument>()) {
  ParseXml(text, source_, document_.get());
  robot_ = document_->RootElement();
  if (robot_ == nullptr || std::string_view(robot_->Name()) != "robot") {
    Fail(robot_ == nullptr ? 1 : robot_->GetLineNum(),
         "must have the root element <robot>, got " +
             (robot_ == nullptr ? std::string("none") : Quote("<" + std::string(robot_->Name()) + ">")));
  }
  for (Element* child : ListChildren(robot_)) {
    const std::string_view kind = child->Name();
    if (kind.starts_with("xacro:")) {
      Fail(child->GetLineNum(), "is a template, got " + Quote("<" + std::string(kind) + ">") + kRunXacro);
    }
    if (kind == "link") AddLink(child);
    if (kind == "joint") AddJoint(child);
  }
  Connect();
  FindRoot();
  RejectCycles();
}

UrdfFile::~UrdfFile() = default;

void UrdfFile::Fail(int line, const std::string& problem) const {
  throw InputError(source_ + ":" + std::to_string(std::max(line, 1)) + ": " + problem);
}

std::string UrdfFile::Print() const { return PrintXml(*document_); }

void UrdfFile::RejectDoubles(const Element* element, const std::string& key,
                             std::initializer_list<const char*> names) const {
  for (const char* const name : names) {
    const std::vector<const Element*> found = ListChildren(element, name);
    if (found.size() > 1)
      Fail(found[1]->GetLineNum(),
           fmt::format("{}{}: stated twice, first on line {}", key, name, found[0]->GetLineNum()));
  }
}

void UrdfFile::AddLink(Element* element) {
  const int line = element->GetLineNum();
  const std::string name = ReadAttribute(*element, "name");
  if (name.empty()) Fail(line, "link: must have a name");
  const std::string key = "link " + Quote(name) + ": ";
  RejectDoubles(element, key, {"inertial"});
  for (const Element* const inertial : ListChildren(element, "inertial"))
    RejectDoubles(inertial, key + "inertial: ", {"origin", "mass", "inertia"});
  if (const UrdfLink* const other = FindIn(links_, name, &UrdfLink::name))
    Fail(line, key + "names must be unique, taken on line " + std::to_string(other->line));
  if (links_.size() == kMaxLinks)
    Fail(line, key + "a robot must have at most " + std::to_string(kMaxLinks) + " links, got more");
  links_.push_back({name, element, line, -1, {}});
}

void UrdfFile::AddJoint(Element* element) {
  UrdfJoint joint{ReadAttribute(*element, "name"), element, element->GetLineNum(),
                  ReadAttribute(*element, "type")};
  if (joint.name.empty()) joint.name = "#" + std::to_string(joints_.size());
  const std::string key = "joint " + Quote(joint.name) + ": ";
  RejectDoubles(element, key, {"parent", "child", "origin", "axis", "limit", "dynamics", "mimic"});
  if (Contains(joints_, joint.name, &UrdfJoint::name)) Fail(joint.line, key + "names must be unique");
  if (joints_.size() == kMaxLinks)
    Fail(joint.line, key + "a robot must have at most " + std::to_string(kMaxLinks) + " joints, got more");
  joints_.push_back(std::move(joint));
}

int UrdfFile::FindEnd(const UrdfJoint& joint, const char* end) const {
  const Element* const child = joint.element->FirstChildElement(end);
  const char* const name = child == nullptr ? nullptr : child->Attribute("link");
  const std::string key = "joint " + Quote(joint.name) + ": " + end + ": ";
  if (name == nullptr) Fail(joint.line, key + "missing, must name a link");
  if (const int found = IndexOf(links_, std::string_view(name), &UrdfLink::name); found >= 0) return found;
  std::vector<std::string> names;
  for (const UrdfLink& link : links_) names.push_back(link.name);
  Fail(joint.line, key + "must be a link" + SuggestInBrackets(name, names) + ", got " + Quote(name));
}

void UrdfFile::Connect() {
  if (links_.empty()) Fail(1, "must have links, got none");
  for (size_t i = 0; i < joints_.size(); ++i) {
    UrdfJoint& joint = joints_[i];
    joint.parent = FindEnd(joint, "parent");
    joint.child = FindEnd(joint, "child");
    UrdfLink& child = links_[static_cast<size_t>(joint.child)];
    if (child.parent_joint >= 0) {
      Fail(joint.line, "joint " + Quote(joint.name) + ": child: must hang on one joint only, " +
                           Quote(child.name) + " hangs on " + Quote(this->joint(child.parent_joint).name) +
                           " too: loops cannot be described by a tree");
    }
    child.parent_joint = static_cast<int>(i);
    links_[static_cast<size_t>(joint.parent)].child_joints.push_back(static_cast<int>(i));
  }
}

void UrdfFile::FindRoot() {
  for (size_t i = 0; i < links_.size(); ++i) {
    if (links_[i].parent_joint >= 0) continue;
    if (root_ >= 0) {
      Fail(links_[i].line, "link " + Quote(links_[i].name) + ": must hang on a joint, since " +
                               Quote(link(root_).name) + " is the root already");
    }
    root_ = static_cast<int>(i);
  }
}

/// Every link must hang on the root.
void UrdfFile::RejectCycles() const {
  for (size_t i = 0; i < links_.size(); ++i) {
    const UrdfLink* at = &links_[i];
    for (size_t above = 0; at->parent_joint >= 0; at = &link(joint(at->parent_joint).parent))
      if (++above > links_.size()) FailCycle(i);
  }
}

/// Follows the parents of a link that no root carries until one comes again.
void UrdfFile::FailCycle(size_t link) const {
  std::vector<size_t> path;
  while (!Contains(path, link)) {
    path.push_back(link);
    link = static_cast<size_t>(joint(links_[link].parent_joint).parent);
  }
  std::string text = links_[link].name;
  for (auto at = path.rbegin(); *at != link; ++at) text += " -> " + links_[*at].name;
  text += " -> " + links_[link].name;
  Fail(links_[link].line, "links must not be cyclic, got " + Quote(text));
}

double UrdfFile::ReadNumber(const Element& element, const std::string& key, const char* attribute) const {
  const char* const value = element.Attribute(attribute);
  const std::string name = key + element.Name() + ": " + attribute + ": ";
  if (value == nullptr) Fail(element.GetLineNum(), name + "missing");
  try {
    return urdf::strToDouble(value);
  } catch (const std::runtime_error&) {
    Fail(element.GetLineNum(), name + "must be a number, got " + QuoteValue(value));
  }
}

double UrdfFile::ReadNumber(const Element& element, const std::string& key, const char* attribute,
                            double otherwise) const {
  return element.Attribute(attribute) == nullptr ? otherwise : ReadNumber(element, key, attribute);
}

Vector3d UrdfFile::ReadVector(const Element& element, const std::string& key, const char* attribute,
                              const Vector3d& otherwise) const {
  const char* const value = element.Attribute(attribute);
  if (value == nullptr) return otherwise;
  try {
    urdf::Vector3 numbers;
    numbers.init(value);
    return {numbers.x, numbers.y, numbers.z};
  } catch (const urdf::ParseError&) {
    Fail(element.GetLineNum(),
         key + element.Name() + ": " + attribute + ": must be three numbers, got " + QuoteValue(value));
  }
}

Pose UrdfFile::ReadOrigin(const Element& element, const std::string& key, double* largest_angle) const {
  Pose X = Pose::Identity();
  const Element* const origin = element.FirstChildElement("origin");
  if (origin == nullptr) return X;
  X.translation() = ReadVector(*origin, key, "xyz", Vector3d::Zero());
  if (origin->Attribute("rpy") == nullptr) return X;
  const Vector3d rpy = ReadVector(*origin, key, "rpy", Vector3d::Zero());
  if (largest_angle != nullptr) *largest_angle = std::max(*largest_angle, rpy.cwiseAbs().maxCoeff());
  urdf::Rotation q;
  q.setFromRPY(rpy[0], rpy[1], rpy[2]);
  X.linear() = Eigen::Quaterniond(q.w, q.x, q.y, q.z).toRotationMatrix();
  return X;
}

DescribedShape UrdfFile::ReadShape(const Element& use) const {
  const Pose X_LS = ReadOrigin(use, "");
  const Element* const geometry = use.FirstChildElement("geometry");
  const Element* const solid = geometry == nullptr ? nullptr : geometry->FirstChildElement();
  if (solid == nullptr) Fail(use.GetLineNum(), "geometry: missing");
  const std::string_view kind = solid->Name();
  const auto read = [&](const char* attribute) { return ReadNumber(*solid, "", attribute); };
  if (kind == "sphere") return DescribeShape(ShapeKind::kEllipsoid, Vector3d::Constant(read("radius")), X_LS);
  if (kind == "box" && solid->Attribute("size") != nullptr)
    return DescribeShape(ShapeKind::kBox, 0.5 * ReadVector(*solid, "", "size", Vector3d::Zero()), X_LS);
  if (kind == "cylinder") {
    const double half_length = 0.5 * read("length"), r = read("radius");
    return DescribeShape(ShapeKind::kCylinder, {r, r, half_length}, X_LS);
  }
  if (kind != "mesh" || solid->Attribute("filename") == nullptr)
    Fail(solid->GetLineNum(), "geometry: must be a shape");
  ReadVector(*solid, "", "scale", Vector3d::Zero());
  return DescribeShape(ShapeKind::kMesh, Vector3d::Zero(), X_LS);
}

std::vector<DescribedShape> UrdfFile::ReadShapes(const UrdfLink& link) const {
  std::vector<DescribedShape> seen;
  std::vector<DescribedShape> touching;
  try {
    for (const auto& [use, shapes] : {std::pair("visual", &seen), std::pair("collision", &touching)}) {
      for (const Element* shape : ListChildren(link.element, use)) shapes->push_back(ReadShape(*shape));
    }
  } catch (const InputError&) {
  }
  return touching.empty() ? seen : touching;
}

std::vector<std::string> UrdfFile::ListMissingMeshes(
    const std::filesystem::path& folder, const std::vector<std::filesystem::path>& packages) const {
  std::set<std::string> seen;
  std::vector<std::string> missing;
  for (const UrdfLink& link : links_) {
    for (const char* use : {"visual", "collision"}) {
      for (const Element* shape : ListChildren(link.element, use)) {
        const Element* const geometry = shape->FirstChildElement("geometry");
        const Element* const mesh = geometry == nullptr ? nullptr : geometry->FirstChildElement("mesh");
        const char* const name = mesh == nullptr ? nullptr : mesh->Attribute("filename");
        if (name == nullptr || !seen.insert(name).second) continue;
        if (FindMesh(name, folder, packages).empty()) missing.emplace_back(name);
      }
    }
  }
  return missing;
}

namespace {

using tinyxml2::XMLElement;

void RemoveChildren(XMLElement* parent, const std::set<std::string>& names) {
  for (XMLElement* child : ListChildren(parent)) {
    if (names.contains(child->Name())) parent->DeleteChild(child);
  }
}

/// Removes the inertials of what never moves: published robots have such that the engine refuses.
void RemoveFixedInertials(const UrdfFile& file, int link) {
  RemoveChildren(file.link(link).element, {"inertial"});
  for (const int joint : file.link(link).child_joints) {
    if (file.joint(joint).type == "fixed") RemoveFixedInertials(file, file.joint(joint).child);
  }
}

/// MuJoCo lets move freely only what hangs on a link called "world".
void LetFloat(const UrdfFile& file) {
  const UrdfLink& root = file.link(file.root());
  for (const int index : root.child_joints) {
    const UrdfJoint& joint = file.joint(index);
    if (joint.type != "floating") continue;
    joint.element->FirstChildElement("parent")->SetAttribute("link", "world");
    root.element->SetAttribute("name", "world");
    return;
  }
  file.robot()->InsertNewChildElement("link")->SetAttribute("name", "world");
  XMLElement* const joint = file.robot()->InsertNewChildElement("joint");
  joint->SetAttribute("name", "dexcheck_floating_base");
  joint->SetAttribute("type", "floating");
  joint->InsertNewChildElement("parent")->SetAttribute("link", "world");
  joint->InsertNewChildElement("child")->SetAttribute("link", root.name.c_str());
}

}  // namespace

std::string WriteEngineUrdf(std::string_view text, const std::string& source, bool floats) {
  const UrdfFile file(text, source);
  XMLElement* const robot = file.robot();
  RemoveChildren(robot, {"gazebo", "transmission", "material", "mujoco", "sensor"});
  for (const UrdfLink& link : file.links()) RemoveChildren(link.element, {"visual", "collision"});
  XMLElement* const compiler = robot->GetDocument()->NewElement("mujoco")->InsertNewChildElement("compiler");
  compiler->SetAttribute("fusestatic", "false");
  compiler->SetAttribute("discardvisual", "true");
  robot->InsertFirstChild(compiler->Parent());
  floats ? LetFloat(file) : RemoveFixedInertials(file, file.root());
  return file.Print();
}

}  // namespace dexcheck
