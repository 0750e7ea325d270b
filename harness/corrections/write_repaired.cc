#include "harness/corrections/write_repaired.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/corrections/corrections.h"
#include "harness/descriptions/urdf_file.h"
#include "harness/engine/mjcf_file.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using XmlElement = tinyxml2::XMLElement;

/// Corrects the first cause, and looks again. @param agrees set to whether nothing is left.
/// @param changes set to whether anything was corrected.
PrintedRobot RepairRobot(PrintedRobot robot, const PrintedRobot& reference, bool* agrees, bool* changes) {
  *agrees = *changes = false;
  for (int round = 0; round < 2 * robot.size(); ++round) {
    const FileCorrections found = FindCorrections(robot, reference);
    *agrees = found.agrees;
    if (found.of_second) break;
    const auto is_reading = [](const CorrectionItem& one) {
      return one.fault.kind >= CorrectionKind::kClassicRows;
    };
    const auto has_patch = [](const CorrectionItem& one) { return !one.patches.empty(); };
    // The patches beside another reading of the file are of the robot that was so read.
    if (std::ranges::any_of(found.items, is_reading)) break;
    const auto item = std::ranges::find_if(found.items, has_patch);
    if (item == found.items.end()) break;
    *changes = true;
    for (const LinkPatch& patch : item->patches) robot.link(patch.link) = patch.right;
  }
  return robot;
}

/// Prints twelve digits, which hide the rounding of what was computed.
/// @param size the largest number of its vector.
std::string Format(double value, double size = 0.0) {
  constexpr int kDigits = 12;
  constexpr double kRounding = 1e-12;
  return FormatNumber(std::abs(value) < kRounding * std::max(size, 1e-3) ? 0.0 : value, kDigits);
}

bool IsTurned(const PrintedOrigin& x, const PrintedOrigin& y) {
  return x.r != y.r || x.form != y.form || x.sequence != y.sequence;
}
bool IsOther(const PrintedOrigin& x, const PrintedOrigin& y) { return x.t != y.t || IsTurned(x, y); }
bool IsOther(const std::optional<PrintedInertial>& x, const std::optional<PrintedInertial>& y) {
  if (!x || !y) return x.has_value() != y.has_value();
  return x->mass.value != y->mass.value || x->I != y->I || IsOther(x->origin, y->origin);
}

/// The inertia along the link's axes: xx yy zz xy xz yz.
Vector6d CalcInertia(const PrintedInertial& body) {
  const Matrix3d R = body.origin.CalcRotation();
  return ToEntries(R * ToTensor(body.I) * R.transpose());
}

/// The places where a format states numbers of a joint: an attribute of its element, or of a child as
/// "limit/lower"; in a parameter file a key of an entry of "rows" or "joints". None where it has none.
struct JointKeys {
  const char* name;
  const char* types[5];  ///< By JointKind.
  const char* axis;
  const char* anchor;
  const char* scalars[kNumJointScalars];  ///< By JointScalar.
  const char* between = " ";              ///< Numbers of a list,
  const char* list = "{}";                ///< which stand in this.
};
constexpr JointKeys kUrdfKeys = {"name",
                                 {"fixed", "revolute", "prismatic", nullptr, nullptr},
                                 "axis/xyz",
                                 nullptr,
                                 {"dynamics/damping", "dynamics/friction", nullptr, "limit/effort",
                                  "limit/velocity", nullptr, nullptr, nullptr}};
constexpr JointKeys kMjcfKeys = {
    "name",
    {nullptr, "hinge", "slide", "ball", nullptr},
    "axis",
    "pos",
    {"damping", "frictionloss", "armature", nullptr, nullptr, "stiffness", nullptr, nullptr}};
constexpr JointKeys kTableKeys = {
    nullptr,
    {},
    "rows/axis",
    nullptr,
    {"joints/damping", "joints/dry_friction", "joints/armature", nullptr, nullptr, nullptr, nullptr, nullptr},
    ", ",
    "[{}]"};

/// Writes what differs of the links of a robot into a file of one format.
class RepairWriter {
 public:
  RepairWriter(const DescriptionFile& file, const JointKeys& keys, const PrintedRobot& before,
               const PrintedRobot& after)
      : before_(before), after_(after), file_(file.path().filename().string()), keys_(keys) {}

 protected:
  ~RepairWriter() = default;
  /// Sets what a path of JointKeys names of the joint that moves a link.
  virtual void SetOfJoint(const PrintedLink& link, const std::string& path, const std::string& value) = 0;
  virtual void WriteRange(const PrintedLink& link, double lower, double upper) = 0;
  virtual void WriteMimic(const PrintedLink& link, const std::optional<PrintedMimic>& /*mimic*/) {
    RefuseIf(true, link, "its coupling");
  }
  template <typename Vector>
  [[nodiscard]] std::string JoinVector(const Vector& values) const {
    std::string text;
    const double size = values.cwiseAbs().maxCoeff();
    for (const double value : values) text += (text.empty() ? "" : keys_.between) + Format(value, size);
    return fmt::format(fmt::runtime(keys_.list), text);
  }

  [[noreturn]] void Refuse(const std::string& why) const {
    throw InputError(file_ + ": cannot be repaired: " + why);
  }
  void RefuseIf(bool is_changed, const PrintedLink& link, const char* what) const {
    if (is_changed) Refuse(fmt::format("joint {}: {} must be written by hand", link.joint.name, what));
  }

  /// All of a joint but its origin.
  void WriteJoint(int i) {
    const PrintedLink& given = before_.link(i);
    const PrintedJoint& before = given.joint;
    const PrintedJoint& after = after_.link(i).joint;
    const auto set = [&](bool is_other, const char* path, const char* what, const auto& format) {
      if (!is_other) return;
      RefuseIf(path == nullptr, given, what);
      SetOfJoint(given, path, format());
    };
    set(after.kind != before.kind, keys_.types[static_cast<size_t>(after.kind)] == nullptr ? nullptr : "type",
        "its type", [&] { return std::string(keys_.types[static_cast<size_t>(after.kind)]); });
    set(after.axis != before.axis, keys_.axis, "its axis", [&] { return JoinVector(after.axis); });
    set(after.anchor != before.anchor, keys_.anchor, "a point of its axis",
        [&] { return JoinVector(after.anchor); });
    const auto find = [](const std::optional<std::array<PrintedScalar, 2>>& range) {
      return range ? std::optional(std::pair((*range)[0].value, (*range)[1].value)) : std::nullopt;
    };
    if (const auto range = find(after.range); range != find(before.range)) {
      RefuseIf(!range, given, "a range that is too much");
      WriteRange(after_.link(i), range->first, range->second);
    }
    for (size_t k = 0; k < kNumJointScalars; ++k) {
      const double was = before.scalars[k] ? before.scalars[k]->value : 0.0;
      const double is = after.scalars[k] ? after.scalars[k]->value : 0.0;
      set(was != is, keys_.scalars[k], NameSite(ToSite(static_cast<JointScalar>(k))),
          [&] { return Format(is); });
    }
    const auto state = [](const std::optional<PrintedMimic>& m) {
      return m ? std::optional(std::tuple(m->leader, m->multiplier.value, m->offset.value)) : std::nullopt;
    };
    if (state(before.mimic) != state(after.mimic)) WriteMimic(given, after.mimic);
    set(after.name != before.name, keys_.name, "its name", [&] { return after.name; });
  }

  const PrintedRobot& before_;
  const PrintedRobot& after_;

 private:
  std::string file_;
  const JointKeys& keys_;
};

/// Sets an attribute of an element, or of the child that the path names, which is made where it is missing.
void SetAttribute(XmlElement* element, std::string_view path, const std::string& text) {
  for (size_t slash = path.find('/'); slash != std::string_view::npos; slash = path.find('/')) {
    const std::string name(path.substr(0, slash));
    XmlElement* const child = element->FirstChildElement(name.c_str());
    element = child != nullptr ? child : element->InsertNewChildElement(name.c_str());
    path.remove_prefix(slash + 1);
  }
  element->SetAttribute(std::string(path).c_str(), text.c_str());
}

class UrdfRepair final : private RepairWriter {
 public:
  UrdfRepair(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after)
      : RepairWriter(file, kUrdfKeys, before, after), urdf_(file.text(), file.path().string()) {}

  std::string Write() {
    for (const UrdfLink& link : urdf_.links()) {
      const auto at = std::ranges::find(before_.links, link.name, &PrintedLink::name);
      const auto i = static_cast<int>(at - before_.links.begin());
      const PrintedLink& after = after_.link(i);
      if (link.parent_joint >= 0) {
        element_ = urdf_.joint(link.parent_joint).element;
        WriteJoint(i);
        WriteOrigin(at->origin, after.origin, "", element_);
      }
      if (IsOther(at->inertial, after.inertial)) WriteBody(*at, after, link.element);
    }
    return urdf_.Print();
  }

 private:
  void SetOfJoint(const PrintedLink& /*link*/, const std::string& path, const std::string& value) override {
    SetAttribute(element_, path, value);
  }
  void WriteRange(const PrintedLink& /*link*/, double lower, double upper) override {
    SetAttribute(element_, "limit/lower", Format(lower));
    SetAttribute(element_, "limit/upper", Format(upper));
  }
  void WriteMimic(const PrintedLink& /*link*/, const std::optional<PrintedMimic>& mimic) override {
    if (!mimic) return element_->DeleteChild(element_->FirstChildElement("mimic"));
    SetAttribute(element_, "mimic/joint", mimic->leader);
    SetAttribute(element_, "mimic/multiplier", Format(mimic->multiplier.value));
    SetAttribute(element_, "mimic/offset", Format(mimic->offset.value));
  }

  void WriteOrigin(const PrintedOrigin& before, const PrintedOrigin& after, const std::string& above,
                   XmlElement* element) const {
    if (after.t != before.t) SetAttribute(element, above + "origin/xyz", JoinVector(after.t));
    if (after.r == before.r && after.form == before.form) return;
    const Vector3d angles = after.form == RotationForm::kRollPitchYaw
                                ? Vector3d(after.r.head<3>())
                                : SolveRollPitchYaw(after.CalcRotation())[0];
    SetAttribute(element, above + "origin/rpy", JoinVector(angles));
  }

  void WriteBody(const PrintedLink& before, const PrintedLink& after, XmlElement* element) const {
    if (!after.inertial) return element->DeleteChild(element->FirstChildElement("inertial"));
    const PrintedInertial& body = *after.inertial;
    WriteOrigin(before.inertial.value_or(PrintedInertial{}).origin, body.origin, "inertial/", element);
    SetAttribute(element, "inertial/mass/value", Format(body.mass.value));
    constexpr const char* kEntries[] = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};
    for (int k = 0; k < 6; ++k)
      SetAttribute(element, std::string("inertial/inertia/") + kEntries[k], Format(body.I[k]));
  }

  UrdfFile urdf_;
  XmlElement* element_ = nullptr;  // of the joint that is written
};

class MjcfRepair final : private RepairWriter {
 public:
  MjcfRepair(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after)
      : RepairWriter(file, kMjcfKeys, before, after), mjcf_(file.document()) {
    for (const XmlElement* compiler : ListChildren(mjcf_.root(), "compiler")) {
      if (compiler->Attribute("angle") != nullptr)
        in_degrees_ = ReadAttribute(*compiler, "angle") != "radian";
    }
  }

  std::string Write(const std::filesystem::path& folder) {
    for (XmlElement* world : ListChildren(mjcf_.root(), "worldbody")) {
      for (XmlElement* body : ListChildren(world, "body")) WriteBody(body);
    }
    for (XmlElement* world : ListChildren(mjcf_.root(), "worldbody")) WriteFrames(world);
    if (after_.gravity && after_.gravity != before_.gravity)
      SetAttribute(mjcf_.root(), "option/gravity", JoinVector(*after_.gravity));
    return mjcf_.PrintFor(folder);
  }

 private:
  void SetOfJoint(const PrintedLink& /*link*/, const std::string& path, const std::string& value) override {
    SetAttribute(element_, path, value);
  }
  void WriteRange(const PrintedLink& link, double lower, double upper) override {
    const double unit = link.joint.kind == JointKind::kHinge && in_degrees_ ? RadToDeg(1.0) : 1.0;
    SetAttribute(element_, "range", JoinVector(Vector2d(lower * unit, upper * unit)));
    SetAttribute(element_, "limited", "true");
  }

  /// Links are in the order of bodies and, of one body, of joints.
  void WriteBody(XmlElement* body) {
    std::vector<XmlElement*> joints;
    for (XmlElement* child : ListChildren(body)) {
      const std::string_view kind = child->Name();
      if (kind == "joint" || kind == "freejoint") joints.push_back(child);
    }
    if (joints.empty()) joints.push_back(nullptr);
    for (XmlElement* const joint : joints) {
      if (++link_ >= before_.size()) Refuse("its bodies are made by the engine's compiler");
      const PrintedLink& before = before_.link(link_);
      const PrintedLink& after = after_.link(link_);
      const bool has_reference = joint != nullptr && joint->Attribute("ref") != nullptr;
      RefuseIf((joint != joints[0] || has_reference) && IsOther(before.origin, after.origin), before,
               "the place of its body");
      WriteOrigin(before.origin, after.origin, body);
      element_ = joint;
      if (joint != nullptr) WriteJoint(link_);
      if (IsOther(before.inertial, after.inertial)) WriteInertial(after, body);
    }
    for (XmlElement* child : ListChildren(body, "body")) WriteBody(child);
  }

  /// Writes the sites of a body and of all bodies on it.
  void WriteFrames(XmlElement* body) {
    for (XmlElement* site : ListChildren(body, "site")) {
      const std::string name = ReadAttribute(*site, "name");
      const auto is_it = [&](const PrintedLink& link) { return link.is_frame && link.name == name; };
      const auto frame = std::ranges::find_if(before_.links, is_it);
      if (frame != before_.links.end())
        WriteOrigin(frame->origin, after_.link(static_cast<int>(frame - before_.links.begin())).origin, site);
    }
    for (XmlElement* child : ListChildren(body, "body")) WriteFrames(child);
  }

  void WriteOrigin(const PrintedOrigin& before, const PrintedOrigin& after, XmlElement* element) const {
    if (before.t != after.t) SetAttribute(element, "pos", JoinVector(after.t));
    if (!IsTurned(before, after)) return;
    DropRotation(element);
    SetAttribute(element, "quat", JoinVector(ToQuaternion(after.CalcRotation())));
  }

  static void DropRotation(XmlElement* element) {
    for (const char* name : {"quat", "euler", "axisangle", "xyaxes", "zaxis"}) element->DeleteAttribute(name);
  }

  void WriteInertial(const PrintedLink& link, XmlElement* body) const {
    if (!link.inertial) Refuse("body " + link.name + ": its inertial must be written by hand");
    SetAttribute(body, "inertial/mass", Format(link.inertial->mass.value));
    SetAttribute(body, "inertial/pos", JoinVector(link.inertial->origin.t));
    SetAttribute(body, "inertial/fullinertia", JoinVector(CalcInertia(*link.inertial)));
    DropRotation(body->FirstChildElement("inertial"));
    body->FirstChildElement("inertial")->DeleteAttribute("diaginertia");
  }

  const MjcfFile& mjcf_;
  bool in_degrees_ = true;
  int link_ = 0;
  XmlElement* element_ = nullptr;  // of the joint that is written
};

/// Assignments to keys of a parameter file.
class TableRepair final : private RepairWriter {
 public:
  TableRepair(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after)
      : RepairWriter(file, kTableKeys, before, after),
        source_(file.path().string()),
        text_(file.text()),
        root_(toml::parse(text_)) {}

  std::string Write() {
    for (int i = 1; i < before_.size(); ++i) {
      const PrintedLink& before = before_.link(i);
      const PrintedLink& after = after_.link(i);
      if (IsOther(before.origin, after.origin)) {
        before.is_frame ? WriteFrame(before, after.origin) : WriteRow(before, after.origin);
      }
      if (IsOther(before.inertial, after.inertial)) WriteBody(before, after);
      WriteJoint(i);
    }
    if (before_.link(0).inertial && IsOther(before_.link(0).inertial, after_.link(0).inertial))
      Refuse("the base's numbers must be written by hand");
    return ApplyOverrides(text_, source_, assignments_);
  }

 private:
  /// A table of the file and the path that leads to it: "chain.0.rows.3".
  struct Entry {
    const toml::table* table;
    std::string path;
    bool states_convention;  ///< Of its chain's rows.
  };

  /// The row, or the entry below `key`, of a joint or link of that name.
  [[nodiscard]] Entry Find(const std::string& key, const std::string& name) const {
    const toml::array* const chains = root_["chain"].as_array();
    for (size_t i = 0; chains != nullptr && i < chains->size(); ++i) {
      const toml::table& chain = *chains->get(i)->as_table();
      const std::string prefix = chain["prefix"].value_or(std::string());
      if (!name.starts_with(prefix)) continue;
      const std::string own = name.substr(prefix.size());
      const std::string begin = fmt::format("chain.{}.{}.", i, key);
      const bool states = chain.contains("convention");
      if (const toml::array* const rows = chain[key].as_array()) {
        for (size_t k = 0; k < rows->size(); ++k) {
          const toml::table* const row = rows->get(k)->as_table();
          if ((*row)["joint"].value_or(std::string()) == own) return {row, begin + std::to_string(k), states};
        }
      } else if (const toml::table* const entry = chain[key][own].as_table()) {
        return {entry, begin + own, states};
      }
    }
    Refuse(fmt::format("{} is not among the {} of its chain", name, key));
  }

  void Set(const Entry& entry, const char* key, const std::string& value) {
    assignments_.push_back(entry.path + "." + key + "=" + value);
  }
  void Remove(const Entry& entry, const char* key) {
    if (entry.table->contains(key)) assignments_.push_back(entry.path + "." + key + "-=");
  }
  void SetOfJoint(const PrintedLink& link, const std::string& path, const std::string& value) override {
    const size_t slash = path.find('/');
    Set(Find(path.substr(0, slash), link.joint.name), path.substr(slash + 1).c_str(), value);
  }
  void WriteRange(const PrintedLink& link, double lower, double upper) override {
    const Entry entry = Find("joints", link.joint.name);
    Remove(entry, "range_deg");
    Set(entry, "range", JoinVector(Vector2d(lower, upper)));
  }

  void WriteRow(const PrintedLink& link, PrintedOrigin origin) {
    const Entry row = Find("rows", link.joint.name);
    if (link.origin.form == RotationForm::kMdh) FindRow(link.origin.X_before, &origin);
    RefuseIf(origin.form != link.origin.form || row.states_convention, link, "its row");
    if (origin.form == RotationForm::kMdh) {
      Remove(row, "alpha_deg");
      Remove(row, "q_deg");
      Set(row, "alpha", Format(origin.r[0]));
      Set(row, "q", Format(origin.r[1]));
      Set(row, "a", Format(origin.t[0]));
      Set(row, "d", Format(origin.t[2]));
      return;
    }
    SetPose(row, link.origin, origin);
  }

  /// Writes an entry of the file's "frame", or of a chain's "frames".
  void WriteFrame(const PrintedLink& frame, const PrintedOrigin& origin) {
    const auto set = [&](const toml::array* entries, const std::string& begin, const std::string& prefix) {
      for (size_t k = 0; entries != nullptr && k < entries->size(); ++k) {
        const toml::table& entry = *entries->get(k)->as_table();
        if (prefix + entry["name"].value_or(std::string()) != frame.name) continue;
        SetPose({&entry, begin + std::to_string(k), false}, frame.origin, origin);
        return true;
      }
      return false;
    };
    if (set(root_["frame"].as_array(), "frame.", "")) return;
    const toml::array* const chains = root_["chain"].as_array();
    for (size_t i = 0; chains != nullptr && i < chains->size(); ++i) {
      const toml::table& chain = *chains->get(i)->as_table();
      if (set(chain["frames"].as_array(), fmt::format("chain.{}.frames.", i),
              chain["prefix"].value_or(std::string())))
        return;
    }
    Refuse("frame " + frame.name + " must be written by hand");
  }

  void SetPose(const Entry& entry, const PrintedOrigin& before, const PrintedOrigin& origin) {
    if (before.t != origin.t) Set(entry, "xyz", JoinVector(origin.t));
    if (!IsTurned(before, origin)) return;
    Remove(entry, "rpy_deg");
    Set(entry, "rpy", JoinVector(Vector3d(origin.r.head<3>())));
  }

  /// Gives a pose the form of a row of modified parameters behind X_before, if it has one.
  static void FindRow(const Pose& X_before, PrintedOrigin* origin) {
    constexpr double kSame = 1e-9;
    const Pose X = X_before.inverse() * origin->CalcPose();
    const Matrix3d R = X.linear();  // Rot(x, alpha) Rot(z, q)
    const double alpha = std::atan2(-R(1, 2), R(2, 2));
    const double d = Vector3d(0.0, -std::sin(alpha), std::cos(alpha)).dot(X.translation());
    PrintedOrigin row;
    row.form = RotationForm::kMdh;
    row.X_before = X_before;
    row.r.head<2>() << alpha, std::atan2(-R(0, 1), R(0, 0));
    row.t << X.translation().x(), 0.0, d;
    if (row.CalcPose().isApprox(origin->CalcPose(), kSame)) *origin = row;
  }

  void WriteBody(const PrintedLink& before, const PrintedLink& after) {
    const Entry entry = Find("links", before.name);
    RefuseIf(!entry.table->contains("mass") || !after.inertial, before, "its link");
    Set(entry, "mass", Format(after.inertial->mass.value));
    Set(entry, "com", JoinVector(after.inertial->origin.t));
    Set(entry, "inertia", JoinVector(CalcInertia(*after.inertial)));
  }

  std::string source_, text_;
  toml::table root_;
  std::vector<std::string> assignments_;
};

}  // namespace

RepairedFile WriteRepaired(const DescriptionFile& file, const UrdfOptions& urdf, const PrintedRobot& printed,
                           const PrintedRobot& reference, const std::filesystem::path& folder) {
  if (file.format() == RobotFormat::kBodies)
    throw InputError(file.path().string() + ": cannot be repaired: it is a table of bodies");
  RepairedFile repaired;
  bool changes = false;
  const PrintedRobot after = RepairRobot(printed, reference, &repaired.agrees, &changes);
  if (!changes)
    throw InputError(file.path().filename().string() +
                     ": cannot be repaired: its causes must be corrected by hand");
  repaired.text = file.format() == RobotFormat::kToml ? TableRepair(file, printed, after).Write()
                                                      : WriteXml(file, urdf, printed, after, folder);
  return repaired;
}

std::string WriteXml(const DescriptionFile& file, const UrdfOptions& urdf, const PrintedRobot& before,
                     const PrintedRobot& after, const std::filesystem::path& folder) {
  if (file.format() == RobotFormat::kUrdf) return UrdfRepair(file, before, after).Write();
  // Its document is changed.
  const DescriptionFile copy(file.path(), file.text(), urdf);
  return MjcfRepair(copy, before, after).Write(folder);
}

}  // namespace dexcheck
