#include "harness/diagnosis/body_comparison.h"

#include <algorithm>
#include <cmath>

#include "harness/engine/robot_tree.h"

namespace dexcheck {
namespace {

using Kind = ParameterKind;
using ItemKind = PlacedItem::Kind;
using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Both sides read decimal numbers; a body's are turned into the link's frame by some dozen rotations, each
// 1e-16 of the robot's size, which may be a thousand times the body's.
constexpr double kSame = 1e-11;

Vector3d MapVector(const mjtNum* v) { return {v[0], v[1], v[2]}; }

bool IsBody(ItemKind kind) { return kind == ItemKind::kCom || kind == ItemKind::kInertia; }

}  // namespace

bool IsPlaced(const Placement& placement, int link) {
  const std::vector<Joint>& joints = placement.trial().joints;
  const auto& items = placement.items();
  for (size_t i = 0; i < items.size(); ++i) {
    const PlacedItem& item = items[i];
    if (IsBody(item.kind)) continue;
    const bool frame = item.kind == ItemKind::kFramePosition || item.kind == ItemKind::kFrameRotation;
    const bool carried = frame ? item.link == link : joints[static_cast<size_t>(item.index)].parent == link;
    const bool carries = !frame && link >= 0 && placement.Carries(item.index, link);
    if ((carried || carries) && placement.Fails(static_cast<int>(i))) return false;
  }
  return true;
}

BodyComparison::BodyComparison(const RobotSpec& spec, const EngineEvidence& evidence, const mjModel& engine)
    : spec_(spec),
      evidence_(evidence),
      engine_(engine),
      model_(spec),
      adapter_(model_, engine, spec.source),
      placement_(spec, evidence, false) {}

std::vector<Repair> BodyComparison::Run() const {
  std::vector<Repair> causes;
  for (int link = spec_.base.type == BaseType::kFixed ? 0 : -1; link < model_.num_joints(); ++link)
    CompareBody(link, &causes);
  CompareJoints(&causes);
  return causes;
}

void BodyComparison::Compare(const std::vector<Parameter>& parameters, const std::vector<double>& values,
                             double scale, std::vector<Repair>* causes) const {
  Repair cause;
  for (size_t i = 0; i < parameters.size(); ++i) {
    const double value = GetValue(spec_, parameters[i]);
    const double size = scale > 0.0 ? scale : std::max(std::abs(value), std::abs(values[i]));
    if (!(std::abs(value - values[i]) > evidence_.Widen(kSame) * size)) continue;
    cause.parameters.push_back(parameters[i]);
    cause.values.push_back(values[i]);
  }
  if (!cause.parameters.empty()) causes->push_back(std::move(cause));
}

MassProperties BodyComparison::ReadBody(int link) const {
  MassProperties body;
  if (link >= 0 || adapter_.wheels().empty()) {
    const StateSample& at = evidence_.samples().front();
    const LinkInWorld& there = at.links[static_cast<size_t>(link + 1)];
    ModelTerms terms(model_);
    terms.SetState(at.q, at.xi);
    const Pose X = terms.CalcLinkPose(link).inverse();
    return {there.mass, X * there.com, X.linear() * there.inertia * X.linear().transpose()};
  }
  // A base without its wheels, where the MJCF starts it: there Sigma_0 stands at X_B0.
  const MjDataPtr data = MakeData(engine_);
  mj_kinematics(&engine_, data.get());
  const Pose X = spec_.base.X_B0.inverse();
  std::vector<int> bodies;
  for (const int b : adapter_.welded_bodies()[0]) {
    if (engine_.body_weldid[b] == adapter_.link_bodies()[0]) bodies.push_back(b);
  }
  for (const int b : bodies) {
    body.mass += engine_.body_mass[b];
    body.com += engine_.body_mass[b] * (X * MapVector(data->xipos + 3 * b));
  }
  if (body.mass > 0.0) body.com /= body.mass;
  for (const int b : bodies) {
    const Matrix3d R = X.linear() * Eigen::Map<const RowMatrix3d>(data->ximat + 9 * b);
    const Vector3d arm = X * MapVector(data->xipos + 3 * b) - body.com;
    body.inertia += R * MapVector(engine_.body_inertia + 3 * b).asDiagonal() * R.transpose();
    body.inertia += engine_.body_mass[b] * (arm.squaredNorm() * Matrix3d::Identity() - arm * arm.transpose());
  }
  return body;
}

void BodyComparison::CompareBody(int link, std::vector<Repair>* causes) const {
  const MassProperties there = ReadBody(link);
  const MassProperties& here = link < 0 ? spec_.base.body : spec_.joints[static_cast<size_t>(link)].body;
  const size_t first = causes->size();
  Compare({{Kind::kMass, link, 0}}, {there.mass}, 0.0, causes);
  if (!(there.mass > 0.0) || !(here.mass > 0.0) || !IsPlaced(placement_, link)) return;
  const double length = std::max({here.com.norm(), there.com.norm(), evidence_.length()});
  Compare({{Kind::kCom, link, 0}, {Kind::kCom, link, 1}, {Kind::kCom, link, 2}},
          {there.com.x(), there.com.y(), there.com.z()}, length, causes);
  std::vector<Parameter> entries;
  std::vector<double> values;
  const int places[6] = {0, 4, 8, 3, 6, 7};
  for (int k = 0; k < 6; ++k) {
    entries.push_back({Kind::kInertia, link, k});
    values.push_back(there.inertia.data()[places[k]]);
  }
  Compare(entries, values, std::max(here.inertia.trace(), there.inertia.trace()), causes);

  // A solid of another mass: both grow alike.
  const double alike = evidence_.Widen(1e-8);
  const bool mass = causes->size() > first && (*causes)[first].parameters.front().kind == Kind::kMass;
  if (!mass || causes->back().parameters.front().kind != Kind::kInertia) return;
  const Matrix3d expected = there.mass / here.mass * here.inertia;
  if ((there.inertia - expected).norm() > alike * expected.norm()) return;
  const Repair inertia = causes->back();
  causes->pop_back();
  Repair& whole = (*causes)[first];
  whole.parameters.insert(whole.parameters.end(), inertia.parameters.begin(), inertia.parameters.end());
  whole.values.insert(whole.values.end(), inertia.values.begin(), inertia.values.end());
}

void BodyComparison::CompareJoints(std::vector<Repair>* causes) const {
  for (int i = 0; i < model_.num_joints(); ++i) {
    const int dof = adapter_.joint_dofs()[static_cast<size_t>(i)];
    Compare({{Kind::kDamping, i, 0}}, {engine_.dof_damping[dof]}, 0.0, causes);
    Compare({{Kind::kArmature, i, 0}}, {engine_.dof_armature[dof]}, 0.0, causes);
  }
  if (adapter_.wheels().size() == 2) {
    double transverse[2];
    for (size_t k = 0; k < 2; ++k) transverse[k] = CalcWheelInertia(engine_, adapter_.wheels()[k]).transverse;
    // Wheels that differ from each other are no single number of the model.
    if (std::abs(transverse[0] - transverse[1]) <= evidence_.Widen(kSame) * std::abs(transverse[0]))
      Compare({{Kind::kWheelTransverseInertia, -1, 0}}, {transverse[0]}, 0.0, causes);
  }
  const Vector3d there = MapVector(engine_.opt.gravity);
  Compare({{Kind::kGravity, -1, 0}, {Kind::kGravity, -1, 1}, {Kind::kGravity, -1, 2}},
          {there.x(), there.y(), there.z()}, std::max(spec_.gravity.norm(), there.norm()), causes);
}

}  // namespace dexcheck
