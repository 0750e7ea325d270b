#include "harness/corrections/write_repaired.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "controller/common/errors.h"
#include "harness/corrections/corrections.h"
#include "harness/corrections/link_frames.h"
#include "harness/corrections/printed_pair.h"
#include "harness/corrections/repair_writer.h"
#include "harness/corrections/table_repair.h"
#include "harness/descriptions/urdf_file.h"
#include "harness/engine/mjcf_file.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using XmlElement = tinyxml2::XMLElement;

/// Corrects all causes, and looks again. @param agrees set to whether nothing is left.
/// @param changes set to whether anything was corrected.
PrintedRobot RepairRobot(PrintedRobot robot, const PrintedRobot& reference, bool* agrees, bool* changes) {
  constexpr int kRounds = 10;
  const auto is_reading = [](const CorrectionItem& one) {
    return one.fault.kind >= CorrectionKind::kClassicRows;
  };
  *agrees = *changes = false;
  bool goes_on = true;
  for (int round = 0; goes_on && round < kRounds; ++round) {
    const FileCorrections found = FindCorrections(robot, reference);
    *agrees = found.agrees;
    // The patches beside another reading of the file are of the robot that was so read.
    if (found.of_second || std::ranges::any_of(found.items, is_reading)) break;
    goes_on = false;
    const PrintedRobot before = robot;
    for (const CorrectionItem& item : found.items) {
      for (const LinkPatch& patch : item.patches) {
        TakeChanges(before.link(patch.link), patch.right, &robot.link(patch.link));
        *changes = goes_on = true;
      }
    }
  }
  return robot;
}

/// Takes the reference's numbers in the place of those that a correction computed from rounded ones, where
/// both are one within the tolerance of their digits: computed numbers have more digits than are known.
void TakeDigits(const PrintedRobot& before, const PrintedRobot& reference, PrintedRobot* robot) {
  PrintedPair pair(*robot, reference);
  pair.SetFrames(ChooseFrames(pair)[0].X_ab);
  for (const int i : pair.links()) {
    PrintedLink& link = robot->link(i);
    const PrintedLink& old = before.link(i);
    const RightNode& right = pair.right(i);
    const auto is_right = [&](SiteKind kind) { return pair.CompareNode(kind, i) <= 1.0; };
    if (link.inertial && old.inertial && pair.node(i).parts == std::vector{i}) {
      PrintedInertial& body = *link.inertial;
      if (body.mass.value != old.inertial->mass.value && is_right(SiteKind::kMass))
        body.mass.value = right.body.mass;
      if (body.origin.t != old.inertial->origin.t && is_right(SiteKind::kCom)) body.origin.t = right.body.com;
      if (body.I != old.inertial->I && is_right(SiteKind::kInertia)) {
        const Matrix3d R = body.origin.CalcRotation();
        body.I = ToEntries(R.transpose() * right.body.inertia * R);
      }
    }
    if (!right.is_placed || pair.node(i).chain.size() > 1 || link.origin.form == RotationForm::kMdh) continue;
    if (link.origin.t != old.origin.t && is_right(SiteKind::kPosition)) link.origin.t = right.X.translation();
    if (link.origin.form == RotationForm::kRollPitchYaw && link.origin.r != old.origin.r &&
        is_right(SiteKind::kRotation))
      link.origin.SetRotation(right.X.linear());
  }
}

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

/// A file whose joints are elements.
class XmlRepair : protected RepairWriter {
 protected:
  using RepairWriter::RepairWriter;
  ~XmlRepair() = default;
  void SetOfJoint(const PrintedLink& /*link*/, const std::string& path, const std::string& value) override {
    SetAttribute(element_, path, value);
  }
  XmlElement* element_ = nullptr;  // of the joint that is written
};

class UrdfRepair final : private XmlRepair {
 public:
  UrdfRepair(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after)
      : XmlRepair(file, kUrdfKeys, before, after), urdf_(file.text(), file.path().string()) {}

  std::string Write() {
    for (const UrdfLink& link : urdf_.links()) {
      const int i = IndexOf(before_.links, link.name, &PrintedLink::name);
      const PrintedLink &before = before_.link(i), &after = after_.link(i);
      if (link.parent_joint >= 0) {
        element_ = urdf_.joint(link.parent_joint).element;
        WriteJoint(i);
        WriteOrigin(before.origin, after.origin, "", element_);
      }
      if (IsOther(before.inertial, after.inertial)) WriteBody(before, after, link.element);
    }
    return urdf_.Print();
  }

 private:
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
};

class MjcfRepair final : private XmlRepair {
 public:
  MjcfRepair(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after)
      : XmlRepair(file, kMjcfKeys, before, after), mjcf_(file.path(), &file.text()) {
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
      const int frame = IndexOf(before_.links, std::pair(true, ReadAttribute(*site, "name")),
                                [](const PrintedLink& link) { return std::pair(link.is_frame, link.name); });
      if (frame >= 0) WriteOrigin(before_.link(frame).origin, after_.link(frame).origin, site);
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

  MjcfFile mjcf_;  // with the words that this engine does not know
  bool in_degrees_ = true;
  int link_ = 0;
};

}  // namespace

RepairedFile WriteRepaired(const DescriptionFile& file, const PrintedRobot& printed,
                           const PrintedRobot& reference, const std::filesystem::path& folder) {
  if (file.format() == RobotFormat::kBodies)
    throw InputError(file.path().string() + ": cannot be repaired: it is a table of bodies");
  RepairedFile repaired;
  bool changes = false;
  PrintedRobot after = RepairRobot(printed, reference, &repaired.agrees, &changes);
  if (repaired.agrees) TakeDigits(printed, reference, &after);
  if (!changes)
    throw InputError(file.path().filename().string() +
                     ": cannot be repaired: its causes must be corrected by hand");
  repaired.text = WriteNumbers(file, printed, after, folder);
  return repaired;
}

std::string WriteNumbers(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after,
                         const std::filesystem::path& folder) {
  if (file.format() == RobotFormat::kToml) return WriteTable(file, before, after);
  if (file.format() == RobotFormat::kUrdf) return UrdfRepair(file, before, after).Write();
  return MjcfRepair(file, before, after).Write(folder);
}

}  // namespace dexcheck
