#include "harness/checks/repaired_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/base/worst.h"
#include "harness/checks/file_causes.h"
#include "harness/checks/repaired_link.h"
#include "harness/corrections/read_printed.h"
#include "harness/descriptions/urdf_file.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

/// Corrects the first cause, and looks again.
PrintedRobot RepairRobot(PrintedRobot robot, const PrintedRobot& reference) {
  for (int round = 0; round < 2 * robot.size(); ++round) {
    const FileCorrections found = FindCorrections(robot, reference);
    if (found.of_second) break;
    const auto item =
        std::ranges::find_if(found.items, [](const CorrectionItem& one) { return !one.patches.empty(); });
    if (item == found.items.end()) break;
    for (const LinkPatch& patch : item->patches) robot.link(patch.link) = patch.right;
  }
  return robot;
}

using XmlElement = tinyxml2::XMLElement;

/// The child element of that name, which is made where it is missing.
XmlElement* TakeChild(XmlElement* parent, const char* name) {
  XmlElement* const child = parent->FirstChildElement(name);
  return child != nullptr ? child : parent->InsertNewChildElement(name);
}
void SetAttribute(XmlElement* element, const char* name, const std::string& text) {
  element->SetAttribute(name, text.c_str());
}

class UrdfRepair : private FileRepair {
 public:
  explicit UrdfRepair(const DescriptionFile& file)
      : FileRepair(file), urdf_(file.text(), file.path().string()) {}

  std::string Write(const PrintedRobot& before, const PrintedRobot& after) {
    for (const UrdfLink& link : urdf_.links()) {
      const auto at = std::ranges::find(before.links, link.name, &PrintedLink::name) - before.links.begin();
      const RepairedLink repaired = {before.link(static_cast<int>(at)), after.link(static_cast<int>(at))};
      if (link.parent_joint >= 0) WriteJoint(repaired, urdf_.joint(link.parent_joint).element);
      if (repaired.HasOtherBody()) WriteBody(repaired, link.element);
    }
    return urdf_.Print();
  }

 private:
  void WriteJoint(const RepairedLink& link, XmlElement* element) const {
    const PrintedJoint& joint = link.after.joint;
    if (joint.name != link.before.joint.name) SetAttribute(element, "name", joint.name);
    if (joint.kind != link.before.joint.kind) {
      RefuseIf(joint.kind == JointKind::kBall || joint.kind == JointKind::kFree, link.before, "its type");
      SetAttribute(element, "type",
                   joint.kind == JointKind::kFixed   ? "fixed"
                   : joint.kind == JointKind::kSlide ? "prismatic"
                                                     : "revolute");
    }
    WriteOrigin(link.before.origin, link.after.origin, element);
    if (joint.axis != link.before.joint.axis)
      SetAttribute(TakeChild(element, "axis"), "xyz", JoinRepaired(joint.axis, " "));
    RefuseIf(joint.anchor != link.before.joint.anchor, link.before, "a point of its axis");
    if (link.HasOtherRange()) {
      RefuseIf(!joint.range, link.before, "a range that is too much");
      XmlElement* const limit = TakeChild(element, "limit");
      SetAttribute(limit, "lower", FormatRepaired((*joint.range)[0].value));
      SetAttribute(limit, "upper", FormatRepaired((*joint.range)[1].value));
    }
    for (size_t k = 0; k < kNumJointScalars; ++k) {
      const std::optional<double> number = link.FindScalar(k);
      if (!number) continue;
      const ScalarAttribute& place = kScalarAttributes[k];
      RefuseIf(place.urdf == nullptr, link.before, NameSite(ToSite(static_cast<JointScalar>(k))));
      SetAttribute(TakeChild(element, place.urdf_element), place.urdf, FormatRepaired(*number));
    }
    if (!link.HasOtherMimic()) return;
    if (!joint.mimic) return element->DeleteChild(element->FirstChildElement("mimic"));
    XmlElement* const mimic = TakeChild(element, "mimic");
    SetAttribute(mimic, "joint", joint.mimic->leader);
    SetAttribute(mimic, "multiplier", FormatRepaired(joint.mimic->multiplier.value));
    SetAttribute(mimic, "offset", FormatRepaired(joint.mimic->offset.value));
  }

  static void WriteOrigin(const PrintedOrigin& before, const PrintedOrigin& after, XmlElement* element) {
    if (after.t != before.t) SetAttribute(TakeChild(element, "origin"), "xyz", JoinRepaired(after.t, " "));
    if (after.r == before.r && after.form == before.form) return;
    const Vector3d angles = after.form == RotationForm::kRollPitchYaw
                                ? Vector3d(after.r.head<3>())
                                : SolveRollPitchYaw(after.CalcRotation())[0];
    SetAttribute(TakeChild(element, "origin"), "rpy", JoinRepaired(angles, " "));
  }

  static void WriteBody(const RepairedLink& link, XmlElement* element) {
    if (!link.after.inertial) return element->DeleteChild(element->FirstChildElement("inertial"));
    XmlElement* const inertial = TakeChild(element, "inertial");
    const PrintedInertial& body = *link.after.inertial;
    WriteOrigin(link.before.inertial.value_or(PrintedInertial{}).origin, body.origin, inertial);
    SetAttribute(TakeChild(inertial, "mass"), "value", FormatRepaired(body.mass.value));
    constexpr const char* kEntries[] = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};
    for (int k = 0; k < 6; ++k)
      SetAttribute(TakeChild(inertial, "inertia"), kEntries[k], FormatRepaired(body.I[k]));
  }

  UrdfFile urdf_;
};

class MjcfRepair : private FileRepair {
 public:
  explicit MjcfRepair(const DescriptionFile& file) : FileRepair(file), mjcf_(file.document()) {
    for (const XmlElement* compiler : ListChildren(mjcf_.root(), "compiler")) {
      if (compiler->Attribute("angle") != nullptr)
        in_degrees_ = ReadAttribute(*compiler, "angle") != "radian";
    }
  }

  std::string Write(const PrintedRobot& before, const PrintedRobot& after,
                    const std::filesystem::path& folder) {
    for (XmlElement* world : ListChildren(mjcf_.root(), "worldbody")) {
      for (XmlElement* body : ListChildren(world, "body")) WriteBody(body, before, after);
    }
    return mjcf_.PrintFor(folder);
  }

 private:
  [[nodiscard]] double ToUnit(double angle) const { return in_degrees_ ? RadToDeg(angle) : angle; }

  /// Links are in the order of bodies and, of one body, of joints.
  void WriteBody(XmlElement* body, const PrintedRobot& before, const PrintedRobot& after) {
    std::vector<XmlElement*> joints;
    for (XmlElement* child : ListChildren(body)) {
      const std::string_view kind = child->Name();
      if (kind == "joint" || kind == "freejoint") joints.push_back(child);
    }
    for (size_t k = 0; k < Worst(joints.size(), size_t{1}); ++k) {
      ++link_;
      if (link_ >= before.size()) Refuse("its bodies are made by the engine's compiler");
      const RepairedLink link = {before.link(link_), after.link(link_)};
      const bool has_reference = !joints.empty() && joints[k]->Attribute("ref") != nullptr;
      RefuseIf((k > 0 || has_reference) && (link.IsMoved() || link.IsTurned()), link.before,
               "the place of its body");
      if (link.IsMoved()) SetAttribute(body, "pos", JoinRepaired(link.after.origin.t, " "));
      if (link.IsTurned()) {
        Turn(body);
        SetAttribute(body, "quat", JoinRepaired(ToQuaternion(link.after.origin.CalcRotation()), " "));
      }
      if (!joints.empty()) WriteJoint(link, joints[k]);
      if (link.HasOtherBody()) WriteInertial(link, body->FirstChildElement("inertial"));
    }
    for (XmlElement* child : ListChildren(body, "body")) WriteBody(child, before, after);
  }

  static void Turn(XmlElement* element) {
    for (const char* name : {"quat", "euler", "axisangle", "xyaxes", "zaxis"}) element->DeleteAttribute(name);
  }

  void WriteJoint(const RepairedLink& link, XmlElement* element) {
    const PrintedJoint& joint = link.after.joint;
    if (joint.name != link.before.joint.name) SetAttribute(element, "name", joint.name);
    if (joint.kind != link.before.joint.kind) {
      RefuseIf(joint.kind == JointKind::kFixed || joint.kind == JointKind::kFree, link.before, "its type");
      SetAttribute(element, "type",
                   joint.kind == JointKind::kSlide  ? "slide"
                   : joint.kind == JointKind::kBall ? "ball"
                                                    : "hinge");
    }
    if (joint.axis != link.before.joint.axis) SetAttribute(element, "axis", JoinRepaired(joint.axis, " "));
    if (joint.anchor != link.before.joint.anchor)
      SetAttribute(element, "pos", JoinRepaired(joint.anchor, " "));
    if (link.HasOtherRange()) {
      RefuseIf(!joint.range, link.before, "a range that is too much");
      Vector2d range((*joint.range)[0].value, (*joint.range)[1].value);
      if (joint.kind == JointKind::kHinge) range = range.unaryExpr([&](double x) { return ToUnit(x); });
      SetAttribute(element, "range", JoinRepaired(range, " "));
      SetAttribute(element, "limited", "true");
    }
    for (size_t k = 0; k < kNumJointScalars; ++k) {
      const std::optional<double> number = link.FindScalar(k);
      if (!number) continue;
      RefuseIf(kScalarAttributes[k].mjcf == nullptr, link.before,
               NameSite(ToSite(static_cast<JointScalar>(k))));
      SetAttribute(element, kScalarAttributes[k].mjcf, FormatRepaired(*number));
    }
    RefuseIf(link.HasOtherMimic(), link.before, "its coupling");
  }

  void WriteInertial(const RepairedLink& link, XmlElement* element) const {
    if (element == nullptr || !link.after.inertial)
      Refuse("body " + link.before.name + ": its inertial must be written by hand");
    Turn(element);
    element->DeleteAttribute("diaginertia");
    SetAttribute(element, "mass", FormatRepaired(link.after.inertial->mass.value));
    SetAttribute(element, "pos", JoinRepaired(link.after.inertial->origin.t, " "));
    SetAttribute(element, "fullinertia", JoinRepaired(link.CalcInertia(), " "));
  }

  const MjcfFile& mjcf_;
  bool in_degrees_ = true;
  int link_ = 0;
};

}  // namespace

std::string WriteRepaired(const DescriptionFile& file, const UrdfOptions& urdf, PrintedRobot reference,
                          const std::vector<std::string>& ignore, const std::filesystem::path& folder) {
  PrintedRobot before = ReadPrintedRobot(file);
  LeaveOutUnstated(ignore, &before);
  LeaveOutFrames(&before, &reference);
  const PrintedRobot after = RepairRobot(before, reference);
  switch (file.format()) {
    case RobotFormat::kUrdf:
      return UrdfRepair(file).Write(before, after);
    case RobotFormat::kMjcf: {
      // Its document is changed.
      const DescriptionFile copy(file.path(), file.text(), urdf);
      return MjcfRepair(copy).Write(before, after, folder);
    }
    case RobotFormat::kToml:
      return RepairTable(file, before, after);
    case RobotFormat::kBodies:
      break;
  }
  throw InputError(file.path().string() + ": cannot be repaired: it is a table of bodies");
}

}  // namespace dexcheck
