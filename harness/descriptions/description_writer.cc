#include "harness/descriptions/description_writer.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/rigid_body.h"
#include "harness/engine/xml.h"

namespace dexcheck {

namespace {

// Products of a few rotations leave zeros and decimal numbers beside themselves by this much of their
// vector's size.
constexpr double kPrintedRounding = 8.0 * std::numeric_limits<double>::epsilon();

/// The shortest decimal number within rounding of `value`, which is part of something of size `scale`.
std::string FormatTidy(double value, double scale) {
  constexpr int kMaxDigits = 17;
  if (std::abs(value) <= kPrintedRounding * scale) return "0";
  for (int digits = 1; digits < kMaxDigits; ++digits) {
    const std::string text = fmt::format("{:.{}g}", value, digits);
    const double read = std::strtod(text.c_str(), nullptr);
    if (std::abs(read - value) <= kPrintedRounding * scale) return FormatNumber(read);
  }
  return FormatNumber(value);
}

template <typename Vector>
std::string FormatTidyList(const Vector& values, double scale) {
  std::string text = "[";
  for (const double value : values) text += (text.size() > 1 ? ", " : "") + FormatTidy(value, scale);
  return text + "]";
}

/// Angles as fractions of pi where they are some.
std::string FormatAngles(const Vector3d& angles) {
  const auto format = [](double angle) -> std::string {
    for (const int parts : {1, 2, 3, 4, 6}) {
      const double count = std::round(angle * parts / kPi);
      if (count == 0.0 || std::abs(angle - count * kPi / parts) > kPrintedRounding * kPi) continue;
      const std::string factor = count == 1.0 ? "" : count == -1.0 ? "-" : FormatNumber(count) + " * ";
      return "\"" + factor + "pi" + (parts == 1 ? "" : " / " + std::to_string(parts)) + "\"";
    }
    return FormatTidy(angle, kPi);
  };
  return "[" + format(angles[0]) + ", " + format(angles[1]) + ", " + format(angles[2]) + "]";
}

/// ", xyz = ..., rpy = ...": what is not zero; always xyz when `always`.
std::string FormatPose(const Pose& X, bool always, const std::string& between = ", ") {
  const Vector3d xyz = X.translation();
  const Vector3d rpy = CalcRollPitchYaw(X.linear());
  std::string text;
  // Lengths of a robot are of size 1 m; smaller ones keep their digits.
  const double length = xyz.norm();
  if (always || length > 0.0) text += between + "xyz = " + FormatTidyList(xyz, length);
  if (rpy.norm() > kPrintedRounding) text += between + "rpy = " + FormatAngles(rpy);
  return text;
}

class ParameterWriter {
 public:
  explicit ParameterWriter(const RobotDescription& robot)
      : robot_(robot), spec_(robot.spec), rows_(ListJointsInLinkFrames(robot)) {}

  std::string Write(const std::string& origin) {
    if (spec_.base.type != BaseType::kFixed && spec_.base.type != BaseType::kFloating) {
      throw InputError(spec_.source + ": base: must be fixed or floating to be written as a parameter file");
    }
    WriteHead(origin);
    for (size_t begin = 0; begin < spec_.joints.size();) {
      size_t end = begin + 1;
      while (end < spec_.joints.size() && spec_.joints[end].parent == static_cast<int>(end) - 1) ++end;
      WriteChain(begin, end);
      begin = end;
    }
    for (const Frame& frame : spec_.frames) WriteFrame(frame);
    return text_;
  }

 private:
  void WriteHead(const std::string& origin) {
    text_ += kImportMark + Abbreviate(origin) + ".\n";
    for (const std::string& note : robot_.notes) text_ += "# Note: " + Abbreviate(note) + ".\n";
    text_ += R"(#
# Each row is a joint and the link that it moves. The link's frame stands at xyz (m), rpy (rad; R = Rz(yaw)
# Ry(pitch) Rx(roll)) in its parent's frame when the joint is at zero, and turns about, or moves along, axis
# ([0, 0, 1] unless given; a ball turns about all). A link's com (m) is the centre of mass from its frame's origin; its inertia
# [Ixx, Iyy, Izz, Ixy, Ixz, Iyz] (kg m^2) is about the centre of mass, along its frame's axes. Damping is in
# N m s/rad or N s/m, armature in kg m^2 or kg, range in rad or m.

)";
    text_ += "name = " + QuoteToml(spec_.name) + "\n";
    text_ += "gravity = " + FormatNumbers(spec_.gravity);
    text_ += robot_.states_gravity ? "\n\n" : "  # not stated there\n\n";
    const bool floats = spec_.base.type == BaseType::kFloating;
    text_ += std::string("[base]\ntype = ") + (floats ? "\"floating\"" : "\"fixed\"");
    text_ += (robot_.states_base ? "\nlink = " : "  # not stated there\nlink = ") +
             QuoteToml(spec_.base.link) + "\n";
    if (floats) WriteBody(spec_.base.body);
    const std::string pose = FormatPose(spec_.base.X_B0, false);
    if (!pose.empty()) text_ += "pose = {" + pose.substr(1) + " }\n";
    text_ += "\n";
  }

  void WriteChain(size_t begin, size_t end) {
    text_ += "[[chain]]\nparent = " + QuoteToml(LinkOf(spec_, spec_.joints[begin].parent)) + "\nrows = [\n";
    for (size_t i = begin; i < end; ++i) WriteRow(spec_.joints[i], rows_[i]);
    text_ += "]\n\n[chain.joints]\n";
    for (size_t i = begin; i < end; ++i) WriteJoint(spec_.joints[i], robot_.joints[i]);
    text_ += "\n";
    for (size_t i = begin; i < end; ++i) {
      text_ += "[chain.links." + QuoteToml(spec_.joints[i].link) + "]\n";
      WriteBody(rows_[i].body);
    }
    text_ += "\n";
  }

  void WriteRow(const Joint& joint, const JointInLinkFrames& row) {
    text_ += "  { joint = " + QuoteToml(joint.name) + ", link = " + QuoteToml(joint.link);
    if (joint.type != JointType::kRevolute) text_ += ", type = \"" + std::string(NameOf(joint.type)) + "\"";
    text_ += FormatPose(row.X_PL, true);
    if (joint.type != JointType::kBall && row.axis != Vector3d::UnitZ())
      text_ += ", axis = " + FormatTidyList(row.axis, 1.0);
    text_ += " },\n";
  }

  void WriteJoint(const Joint& joint, const DescribedJoint& stated) {
    text_ += QuoteToml(joint.name) + " = { range = " + FormatNumbers(Vector2d(joint.lower, joint.upper)) +
             ", damping = " + FormatNumber(joint.damping) + ", armature = " + FormatNumber(joint.armature);
    if (joint.dry_friction != 0.0) text_ += ", dry_friction = " + FormatNumber(joint.dry_friction);
    if (joint.coupling) {
      text_ +=
          ", mimic = { joint = " + QuoteToml(spec_.joints[static_cast<size_t>(joint.coupling->leader)].name) +
          ", multiplier = " + FormatNumber(joint.coupling->multiplier) +
          ", offset = " + FormatNumber(joint.coupling->offset) + " }";
    }
    text_ += " }";
    std::string unstated;
    const auto note = [&](bool is_stated, const char* name) {
      if (!is_stated) unstated += (unstated.empty() ? "  # not stated there: " : ", ") + std::string(name);
    };
    note(stated.states_range, "range");
    note(stated.states_damping, "damping");
    note(stated.states_armature, "armature");
    text_ += unstated + "\n";
  }

  void WriteBody(const MassProperties& body) {
    text_ += "mass = " + FormatTidy(body.mass, body.mass) +
             "\ncom = " + FormatTidyList(body.com, body.com.norm()) +
             "\ninertia = " + FormatTidyList(ToEntries(body.inertia), body.inertia.trace()) + "\n";
  }

  void WriteFrame(const Frame& frame) {
    const Pose X_WF = PlaceOnAxis(robot_, frame.link).inverse() * frame.X_LF;
    text_ += "[[frame]]\nname = " + QuoteToml(frame.name) +
             "\nlink = " + QuoteToml(LinkOf(spec_, frame.link)) + FormatPose(X_WF, true, "\n") + "\n";
    if (frame.sphere_radius) text_ += "sphere_radius = " + FormatNumber(*frame.sphere_radius) + "\n";
    text_ += "\n";
  }

  const RobotDescription& robot_;
  const RobotSpec& spec_;
  std::vector<JointInLinkFrames> rows_;
  std::string text_;
};

}  // namespace

Vector3d CalcRollPitchYaw(const Matrix3d& R) {
  // At pitch = +-90 degrees the first column stands along z, and any yaw will do: zero.
  const double horizontal = std::hypot(R(0, 0), R(1, 0));
  const double yaw = horizontal > kPrintedRounding ? std::atan2(R(1, 0), R(0, 0)) : 0.0;
  // Rz(yaw)^T R = Ry(pitch) Rx(roll), whose middle row is [0, cos(roll), -sin(roll)].
  const Matrix3d rest = Eigen::AngleAxisd(-yaw, Vector3d::UnitZ()).toRotationMatrix() * R;
  return {std::atan2(-rest(1, 2), rest(1, 1)), std::atan2(-rest(2, 0), rest(0, 0)), yaw};
}

std::string WriteParameters(const RobotDescription& robot, const std::string& origin) {
  return ParameterWriter(robot).Write(origin);
}

namespace {

using tinyxml2::XMLElement;

template <typename Vector>
std::string Join(const Vector& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + FormatNumber(value);
  return text;
}

void SetRotation(const Matrix3d& R, XMLElement* element) {
  if (R == Matrix3d::Identity()) return;
  const Eigen::Quaterniond q(R);
  element->SetAttribute("quat", Join(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z())).c_str());
}

void SetPose(const Pose& X, XMLElement* element) {
  element->SetAttribute("pos", Join(Vector3d(X.translation())).c_str());
  SetRotation(X.linear(), element);
}

/// I = R diag(moments) R^T; along the body's own axes where it is diagonal there.
void AddInertial(const MassProperties& mass, XMLElement* body) {
  if (mass.mass == 0.0 && mass.inertia.isZero(0.0)) return;
  Vector3d moments = mass.inertia.diagonal();
  Matrix3d R = Matrix3d::Identity();
  if (!mass.inertia.isDiagonal(0.0)) {
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(mass.inertia);
    moments = solver.eigenvalues();
    R = solver.eigenvectors();
    if (R.determinant() < 0.0) R.col(2) *= -1.0;
  }
  XMLElement* const inertial = body->InsertNewChildElement("inertial");
  inertial->SetAttribute("pos", Join(mass.com).c_str());
  SetRotation(R, inertial);
  inertial->SetAttribute("mass", FormatNumber(mass.mass).c_str());
  inertial->SetAttribute("diaginertia", Join(moments).c_str());
}

void AddJoint(const Joint& joint, bool is_limited, XMLElement* body) {
  XMLElement* const element = body->InsertNewChildElement("joint");
  element->SetAttribute("name", joint.name.c_str());
  element->SetAttribute("type", joint.type == JointType::kPrismatic ? "slide" : "hinge");
  element->SetAttribute("axis", "0 0 1");
  element->SetAttribute("limited", is_limited ? "true" : "false");
  if (is_limited)
    element->SetAttribute("range", (FormatNumber(joint.lower) + " " + FormatNumber(joint.upper)).c_str());
  for (const auto& [name, value] : {std::pair("damping", joint.damping),
                                    {"armature", joint.armature},
                                    {"frictionloss", joint.dry_friction}}) {
    if (value != 0.0) element->SetAttribute(name, FormatNumber(value).c_str());
  }
}

}  // namespace

std::string WriteMjcf(const RobotDescription& robot, const std::string& origin) {
  const RobotSpec& spec = robot.spec;
  const bool floats = spec.base.type == BaseType::kFloating;
  if (!floats && spec.base.type != BaseType::kFixed)
    throw InputError(spec.source + ": base: must be fixed or float, and rolls");
  tinyxml2::XMLDocument document;
  document.InsertEndChild(document.NewComment((" Written by dexcheck from " + origin + ". ").c_str()));
  XMLElement* const root = document.NewElement("mujoco");
  document.InsertEndChild(root);
  root->SetAttribute("model", spec.name.c_str());
  root->InsertNewChildElement("compiler")->SetAttribute("angle", "radian");
  XMLElement* const option = root->InsertNewChildElement("option");
  option->SetAttribute("timestep", "0.001");
  option->SetAttribute("tolerance", "1e-14");  // what the solver of dry friction leaves is rounding
  option->SetAttribute("gravity", Join(spec.gravity).c_str());
  XMLElement* const base = root->InsertNewChildElement("worldbody")->InsertNewChildElement("body");
  // The world cannot be the name of a body.
  base->SetAttribute("name", spec.base.link == "world" ? "base" : spec.base.link.c_str());
  SetPose(spec.base.X_B0, base);
  if (floats) {
    base->InsertNewChildElement("freejoint");
    AddInertial(spec.base.body, base);
  }
  std::vector<XMLElement*> bodies = {base};  // of joint i - 1
  for (size_t i = 0; i < spec.joints.size(); ++i) {
    const Joint& joint = spec.joints[i];
    if (joint.type == JointType::kBall)
      throw InputError(spec.source + ": joint " + Quote(joint.name) + ": must turn or slide, is a ball");
    XMLElement* const body = bodies[static_cast<size_t>(joint.parent + 1)]->InsertNewChildElement("body");
    bodies.push_back(body);
    body->SetAttribute("name", joint.link.c_str());
    SetPose(CalcRowPose(joint), body);
    AddJoint(joint, robot.joints[i].states_range, body);
    AddInertial(joint.body, body);
  }
  for (const Frame& frame : spec.frames) {
    XMLElement* const site = bodies[static_cast<size_t>(frame.link + 1)]->InsertNewChildElement("site");
    site->SetAttribute("name", frame.name.c_str());
    SetPose(frame.X_LF, site);
  }
  return PrintXml(document);
}

}  // namespace dexcheck
