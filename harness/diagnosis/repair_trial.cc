#include "harness/diagnosis/repair_trial.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "controller/model/rigid_body.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/robot_tree.h"

namespace dexcheck {
namespace {

using Kind = ParameterKind;

// Both sides read decimal numbers; thirteen digits are printed, and a body's are turned into the link's frame
// by some dozen rotations, each 1e-16 of the robot's size, which may be a thousand times the body's.
constexpr double kSame = 1e-11;
constexpr double kSameSolid = 1e-8;

bool IsOfBothWheels(Kind kind) {
  return kind == Kind::kWheelMass || kind == Kind::kWheelSpinInertia || kind == Kind::kWheelDamping ||
         kind == Kind::kWheelArmature || kind == Kind::kWheelRadius || kind == Kind::kWheelDistance;
}

/// Whether Sigma_0 stands where the engine's wheels have the middle of their axle; without wheels it stands
/// where it is said to.
bool IsAxleRight(const Adapter& adapter, double rounding) {
  Vector3d sum = Vector3d::Zero();
  for (const EngineWheel& wheel : adapter.wheels()) {
    sum += wheel.center;
    if (!(std::hypot(wheel.center.x(), wheel.center.z()) <= rounding)) return false;
  }
  return std::abs(sum.y()) <= rounding;
}

}  // namespace

RepairTrial::RepairTrial(RobotSpec written, const TrialSetup& setup)
    : written_(std::move(written)),
      setup_(&setup),
      model_(setup.terms.Read(written_)),
      adapter_(model_, setup.engine, setup.source),
      evidence_(adapter_, setup.options),
      placement_(written_, setup.terms, evidence_),
      constants_(CheckConstants(adapter_)) {
  for (const ConstantFinding& finding : constants_.findings) {
    const std::optional<Parameter> parameter = FindNumber(finding);
    if (parameter && Differs(finding.model, finding.engine, 0.0)) wrong_.push_back(*parameter);
  }
  for (const Repair& one : ReadBodies())
    wrong_.insert(wrong_.end(), one.parameters.begin(), one.parameters.end());
  axle_right_ = IsAxleRight(adapter_, evidence_.Widen(kSame) * evidence_.length());
}

std::optional<Parameter> RepairTrial::FindNumber(const ConstantFinding& finding) const {
  if (finding.engine_only) return std::nullopt;
  return FindParameter(written_, finding.check, finding.location.first, finding.entry);
}

bool RepairTrial::Differs(double value, double there, double scale) const {
  const double size = scale > 0.0 ? scale : std::max(std::abs(value), std::abs(there));
  return !(std::abs(value - there) <= evidence_.Widen(kSame) * size);
}

std::vector<Repair> RepairTrial::ReadConstants() const {
  constexpr double kSameConstant = 1e-12;
  ConstantChecks constants = constants_;
  if (setup_->options.tolerance > 0.0) JudgeByTolerance(setup_->options.tolerance, &constants);
  Repair read;
  std::vector<Parameter> open;  // of both wheels, as long as one has not the other's
  for (const ConstantFinding& finding : constants.findings) {
    const std::optional<Parameter> parameter = FindNumber(finding);
    if (!parameter || !std::isfinite(finding.engine)) continue;
    const auto again = std::find(read.parameters.begin(), read.parameters.end(), *parameter);
    if (again == read.parameters.end()) {
      read.Add(*parameter, finding.engine);
      if (IsOfBothWheels(parameter->kind)) open.push_back(*parameter);
      continue;
    }
    // When the two wheels disagree, something else is wrong.
    const double value = read.values[static_cast<size_t>(again - read.parameters.begin())];
    if (std::abs(value - finding.engine) > kSameConstant * std::abs(value)) {
      open.push_back(*parameter);
    } else {
      std::erase(open, *parameter);
    }
  }
  std::vector<Repair> causes = SplitByVector(read);
  std::erase_if(causes, [&](const Repair& cause) {
    return std::find(open.begin(), open.end(), cause.parameters[0]) != open.end();
  });
  return causes;
}

void RepairTrial::Compare(const Parameter& parameter, double value, double scale, Repair* read) const {
  if (Differs(GetValue(written_, parameter), value, scale)) read->Add(parameter, value);
}

MassProperties RepairTrial::FindBody(int link) const {
  if (link >= 0 || adapter_.wheels().empty()) {
    const LinkInWorld& there = evidence_.samples().front().links[static_cast<size_t>(link + 1)];
    const Pose X = placement_.PoseOf(link).inverse();
    return {there.mass, X * there.com, X.linear() * there.inertia * X.linear().transpose()};
  }
  // A base without its wheels, where the MJCF starts it: there Sigma_0 stands at X_B0.
  const mjModel& engine = setup_->engine;
  const MjDataPtr data = MakeData(engine);
  mj_kinematics(&engine, data.get());
  std::vector<MassProperties> parts;
  for (const int b : adapter_.welded_bodies()[0]) {
    if (engine.body_weldid[b] != adapter_.link_bodies()[0]) continue;
    const Pose X_Wb = MapPose(data->xmat + 9 * b, data->xpos + 3 * b);
    parts.push_back(ExpressIn(ReadEngineBody(engine, b), written_.base.X_B0.inverse() * X_Wb));
  }
  return Combine(parts);
}

void RepairTrial::ReadBody(int link, Repair* read) const {
  const MassProperties there = FindBody(link);
  const MassProperties& here = BodyOf(written_, link);
  Compare({Kind::kMass, link, 0}, there.mass, 0.0, read);
  if (!(there.mass > 0.0) || !(here.mass > 0.0) || !placement_.IsPlaced(link)) return;
  const double length = std::max({here.com.norm(), there.com.norm(), evidence_.length()});
  for (int k = 0; k < 3; ++k) Compare({Kind::kCom, link, k}, there.com[k], length, read);
  const double trace = std::max(here.inertia.trace(), there.inertia.trace());
  constexpr int kEntries[6] = {0, 4, 8, 3, 6, 7};
  for (int k = 0; k < 6; ++k)
    Compare({Kind::kInertia, link, k}, there.inertia.data()[kEntries[k]], trace, read);
}

std::vector<Repair> RepairTrial::ReadBodies() const {
  Repair read;
  for (int link = written_.base.type == BaseType::kFixed ? 0 : -1; link < model_.num_joints(); ++link)
    ReadBody(link, &read);
  const mjModel& engine = setup_->engine;
  for (int i = 0; i < model_.num_joints(); ++i) {
    const int dof = adapter_.joint_dofs()[static_cast<size_t>(i)];
    Compare({Kind::kDamping, i, 0}, engine.dof_damping[dof], 0.0, &read);
    Compare({Kind::kArmature, i, 0}, engine.dof_armature[dof], 0.0, &read);
  }
  if (adapter_.wheels().size() == 2) {
    double transverse[2];
    for (size_t k = 0; k < 2; ++k) transverse[k] = CalcWheelInertia(engine, adapter_.wheels()[k]).transverse;
    // Wheels that differ from each other are no single number of the model.
    if (!Differs(transverse[1], transverse[0], transverse[0]))
      Compare({Kind::kWheelTransverseInertia, -1, 0}, transverse[0], 0.0, &read);
  }
  const Vector3d there = MapVector(engine.opt.gravity);
  const double size = std::max(written_.gravity.norm(), there.norm());
  for (int k = 0; k < 3; ++k) Compare({Kind::kGravity, -1, k}, there[k], size, &read);
  std::vector<Repair> causes = SplitByVector(read);
  MergeScaledBodies(written_, evidence_.Widen(kSameSolid), &causes);
  return causes;
}

bool RepairTrial::IsLinkRight(int link) const {
  if (!placement_.IsPlaced(link)) return false;
  for (size_t i = 0; i < placement_.items().size(); ++i) {
    if (placement_.items()[i].link == link && placement_.Fails(static_cast<int>(i))) return false;
  }
  return true;
}

bool RepairTrial::IsNumberRight(const Parameter& parameter) const {
  const bool is_of_body = parameter.kind == Kind::kCom || parameter.kind == Kind::kInertia;
  if (parameter.index < 0 && !axle_right_ && (IsGeometric(parameter.kind) || is_of_body)) return false;
  if (IsGeometric(parameter.kind)) return IsLinkRight(CarrierOf(written_, parameter));
  const bool differs = std::find(wrong_.begin(), wrong_.end(), parameter) != wrong_.end();
  return !differs && (!is_of_body || placement_.IsPlaced(parameter.index));
}

bool RepairTrial::IsRepairedBy(const Repair& cause) const {
  if (cause.joint >= 0 && !IsLinkRight(cause.joint)) return false;
  if (cause.other >= 0 && !IsLinkRight(cause.other)) return false;
  return std::all_of(cause.parameters.begin(), cause.parameters.end(),
                     [&](const Parameter& parameter) { return IsNumberRight(parameter); });
}

}  // namespace dexcheck
