#include "tests/common/stated_urdf.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <map>
#include <sstream>
#include <stdexcept>

namespace dexcheck::testing {
namespace {

using Element = tinyxml2::XMLElement;

Vector3d ReadVector(const Element* element, const char* attribute, const Vector3d& otherwise) {
  const char* const text = element == nullptr ? nullptr : element->Attribute(attribute);
  if (text == nullptr) return otherwise;
  Vector3d v = Vector3d::Zero();
  std::istringstream(text) >> v[0] >> v[1] >> v[2];
  return v;
}

Matrix3d ToRotation(const Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy[2], Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy[1], Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy[0], Vector3d::UnitX()))
      .toRotationMatrix();
}

Pose ReadOrigin(const Element* of) {
  const Element* const origin = of->FirstChildElement("origin");
  Pose X = Pose::Identity();
  X.translation() = ReadVector(origin, "xyz", Vector3d::Zero());
  X.linear() = ToRotation(ReadVector(origin, "rpy", Vector3d::Zero()));
  return X;
}

double ReadNumber(const Element* element, const char* attribute) {
  return element == nullptr ? 0.0 : element->DoubleAttribute(attribute, 0.0);
}

Element* Child(Element* of, const char* name) {
  Element* const found = of->FirstChildElement(name);
  return found != nullptr ? found : of->InsertNewChildElement(name);
}

void WriteVector(const Vector3d& v, const char* attribute, Element* element) {
  element->SetAttribute(attribute, fmt::format("{:.17g} {:.17g} {:.17g}", v[0], v[1], v[2]).c_str());
}

void WriteNumber(double value, const char* attribute, Element* element) {
  element->SetAttribute(attribute, fmt::format("{:.17g}", value).c_str());
}

void WriteOrigin(const Pose& X, Element* of) {
  const Matrix3d R = X.linear();
  const double cos_pitch = std::hypot(R(0, 0), R(1, 0));
  const bool is_pole = cos_pitch < 1e-9;
  const Vector3d rpy(is_pole ? std::atan2(-R(1, 2), R(1, 1)) : std::atan2(R(2, 1), R(2, 2)),
                     std::atan2(-R(2, 0), cos_pitch), is_pole ? 0.0 : std::atan2(R(1, 0), R(0, 0)));
  WriteVector(X.translation(), "xyz", Child(of, "origin"));
  WriteVector(rpy, "rpy", Child(of, "origin"));
}

constexpr std::tuple<const char*, int, int> kEntries[] = {{"ixx", 0, 0}, {"ixy", 0, 1}, {"ixz", 0, 2},
                                                          {"iyy", 1, 1}, {"iyz", 1, 2}, {"izz", 2, 2}};

void ReadBody(const Element* inertial, StatedLink* link) {
  const Pose X_LC = ReadOrigin(inertial);
  Matrix3d I = Matrix3d::Zero();
  for (const auto& [name, row, column] : kEntries)
    I(row, column) = I(column, row) = ReadNumber(inertial->FirstChildElement("inertia"), name);
  link->R_LC = X_LC.linear();
  link->body = {ReadNumber(inertial->FirstChildElement("mass"), "value"), X_LC.translation(),
                link->R_LC * I * link->R_LC.transpose()};
}

void WriteBody(const StatedLink& link, Element* inertial) {
  Pose X_LC = Pose::Identity();
  X_LC.translation() = link.body.com;
  X_LC.linear() = link.R_LC;
  WriteOrigin(X_LC, inertial);
  WriteNumber(link.body.mass, "value", Child(inertial, "mass"));
  const Matrix3d I = link.R_LC.transpose() * link.body.inertia * link.R_LC;
  for (const auto& [name, row, column] : kEntries)
    WriteNumber(I(row, column), name, Child(inertial, "inertia"));
}

bool IsSame(const MassProperties& a, const MassProperties& b) {
  return a.mass == b.mass && a.com == b.com && a.inertia == b.inertia;
}

Element* Find(tinyxml2::XMLDocument* document, const char* kind, const std::string& name) {
  for (Element* e = document->RootElement()->FirstChildElement(kind); e != nullptr;
       e = e->NextSiblingElement(kind)) {
    if (e->Attribute("name", name.c_str()) != nullptr) return e;
  }
  throw std::out_of_range("the URDF has no " + std::string(kind) + " " + name);
}

}  // namespace

StatedUrdf::StatedUrdf(const std::string& text) : document_(std::make_unique<tinyxml2::XMLDocument>()) {
  if (document_->Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS)
    throw std::invalid_argument("the URDF is no XML");
  std::map<std::string, const Element*> joint_of;  // by the link that it places
  std::multimap<std::string, std::string> children;
  std::map<std::string, const Element*> links;
  const Element* const root = document_->RootElement();
  for (const Element* e = root->FirstChildElement("joint"); e != nullptr;
       e = e->NextSiblingElement("joint")) {
    const std::string child = e->FirstChildElement("child")->Attribute("link");
    joint_of[child] = e;
    children.emplace(e->FirstChildElement("parent")->Attribute("link"), child);
  }
  std::string root_link;
  for (const Element* e = root->FirstChildElement("link"); e != nullptr; e = e->NextSiblingElement("link")) {
    links[e->Attribute("name")] = e;
    if (!joint_of.contains(e->Attribute("name"))) root_link = e->Attribute("name");
  }
  const auto add = [&](const auto& self, const std::string& name, int parent) -> void {
    const int index = static_cast<int>(parts.size());
    UrdfPart& part = parts.emplace_back();
    part.link = name;
    part.parent = parent;
    const Element* const inertial = links.at(name)->FirstChildElement("inertial");
    part.has_body = inertial != nullptr;
    if (inertial != nullptr) ReadBody(inertial, &part.stated);
    if (joint_of.contains(name)) {
      const Element* const joint = joint_of[name];
      part.joint = joint->Attribute("name");
      part.moves = joint->Attribute("type", "fixed") == nullptr;
      part.slides = joint->Attribute("type", "prismatic") != nullptr;
      part.stated.X_PL = ReadOrigin(joint);
      part.stated.axis = ReadVector(joint->FirstChildElement("axis"), "xyz", Vector3d::UnitX());
      const Element* const limit = joint->FirstChildElement("limit");
      part.has_limit = joint->Attribute("type", "revolute") != nullptr && limit != nullptr;
      part.stated.lower = ReadNumber(limit, "lower");
      part.stated.upper = ReadNumber(limit, "upper");
      part.stated.damping = ReadNumber(joint->FirstChildElement("dynamics"), "damping");
      if (part.moves && parent >= 0) parts[static_cast<size_t>(parent)].stated.X_LD = part.stated.X_PL;
    }
    const auto [begin, end] = children.equal_range(name);
    for (auto child = begin; child != end; ++child) self(self, child->second, index);
  };
  add(add, root_link, -1);
  read_ = parts;
}

StatedUrdf::~StatedUrdf() = default;

void StatedUrdf::MountOn(const std::string& world, const Pose& X_WR) {
  Element* const root = document_->RootElement();
  root->InsertNewChildElement("link")->SetAttribute("name", world.c_str());
  Element* const joint = root->InsertNewChildElement("joint");
  joint->SetAttribute("name", (world + "_mount").c_str());
  joint->SetAttribute("type", "fixed");
  Child(joint, "parent")->SetAttribute("link", world.c_str());
  Child(joint, "child")->SetAttribute("link", parts[0].link.c_str());
  WriteOrigin(X_WR, joint);
}

void StatedUrdf::ExchangeJointNames(const std::string& a, const std::string& b) {
  Element* const first = Find(document_.get(), "joint", a);
  Find(document_.get(), "joint", b)->SetAttribute("name", a.c_str());
  first->SetAttribute("name", b.c_str());
}

std::string StatedUrdf::Write() {
  for (size_t i = 0; i < parts.size(); ++i) {
    const StatedLink& now = parts[i].stated;
    const StatedLink& before = read_[i].stated;
    if (parts[i].has_body && (!IsSame(now.body, before.body) || now.R_LC != before.R_LC))
      WriteBody(now, Find(document_.get(), "link", parts[i].link)->FirstChildElement("inertial"));
    if (parts[i].joint.empty()) continue;
    Element* const joint = Find(document_.get(), "joint", parts[i].joint);
    if (now.X_PL.matrix() != before.X_PL.matrix()) WriteOrigin(now.X_PL, joint);
    if (now.axis != before.axis) WriteVector(now.axis, "xyz", Child(joint, "axis"));
    if (now.lower != before.lower) WriteNumber(now.lower, "lower", Child(joint, "limit"));
    if (now.upper != before.upper) WriteNumber(now.upper, "upper", Child(joint, "limit"));
    if (now.damping != before.damping) WriteNumber(now.damping, "damping", Child(joint, "dynamics"));
  }
  tinyxml2::XMLPrinter printer;
  document_->Print(&printer);
  return printer.CStr();
}

}  // namespace dexcheck::testing
