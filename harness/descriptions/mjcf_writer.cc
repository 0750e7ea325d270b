#include "harness/descriptions/mjcf_writer.h"

#include <Eigen/Eigenvalues>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/engine/xml.h"

namespace dexcheck {
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
    const MdhRow& row = joint.mdh;
    SetPose(joint.X_PB * CalcMdhTransform(row.alpha, row.a, row.q, row.d), body);
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
