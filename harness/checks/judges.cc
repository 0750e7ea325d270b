#include "harness/checks/judges.h"

#include <algorithm>
#include <cmath>

#include "controller/common/text.h"
#include "controller/contact/contact_geometry.h"

namespace dexcheck {
namespace {

class IdleJointsJudge final : public StatefulJudge {
 public:
  explicit IdleJointsJudge(const Setup& setup) : joints_(setup.hold().idle_joints), start_(joints_.size()) {}
  Evaluation Evaluate(const StepAnalysis& step) override {
    double moved = 0.0;
    for (size_t i = 0; i < joints_.size(); ++i) {
      const double q = step.step->reading.state.q[step.setup->model().position_index(joints_[i])];
      if (!has_start_) start_[i] = q;
      moved = std::max(moved, std::abs(q - start_[i]));
    }
    has_start_ = true;
    return CheckValue{moved};
  }
  void Reset() override { has_start_ = false; }

 private:
  std::vector<int> joints_;
  std::vector<double> start_;
  bool has_start_ = false;
};

}  // namespace

Evaluation EvaluateRobotDynamics(const StepAnalysis& step) {
  if (step.mass_factor == nullptr) return std::nullopt;
  const double left = step.robot_residual_norm;
  return CheckValue{std::isnan(left) ? left : std::max(0.0, left - step.uneven_force) / step.balanced};
}

Evaluation EvaluateRolling(const StepAnalysis& step) {
  if (step.step->response.wheels.size() != 2) return std::nullopt;
  const double beyond = (step.wheel_mismatch.cwiseAbs() - step.wheel_slip).maxCoeff();
  // A wheel rolls on another radius also while its platform sinks or tilts under a force that changes.
  return CheckValue{std::max(0.0, beyond - step.sinking)};
}

Evaluation EvaluateContactDistance(const StepAnalysis& step) {
  if (step.touching == 0 || !step.setup->start().bonds.empty()) return std::nullopt;
  Eigen::Index part = 0;
  const double worst = step.contact_mismatch.cwiseAbs().maxCoeff(&part);
  return CheckValue{worst, static_cast<int>(part)};
}

std::string DescribeFoot(const StepAnalysis& step, int part) {
  return part < 0
             ? ""
             : "foot " + Quote(step.setup->model().frame(step.setup->feet()[static_cast<size_t>(part)]).name);
}

Evaluation EvaluateRim(const StepAnalysis& step) {
  if (!step.step->command.handling.holding) return std::nullopt;
  const Vector3d& pole = *step.setup->scenario().grasp.hemisphere;
  CheckValue farthest;
  for (int i = 0; i < step.grasp->num_contacts(); ++i) {
    const SurfacePoint& alpha_f = step.step->reading.state.kappa[static_cast<size_t>(i)].alpha_f;
    const Vector3d p = step.grasp->tip(i).Evaluate(alpha_f).p;
    const double past = -CalcRimDistance(p.norm(), pole, p);
    if (past > farthest.value) farthest = {past, i};
  }
  return farthest;
}

std::string DescribeFingertip(const StepAnalysis& step, int part) {
  const int frame = step.grasp->fingertips()[static_cast<size_t>(part)];
  return "fingertip " + Quote(step.setup->model().frame(frame).name);
}

Evaluation EvaluateJointLimit(const StepAnalysis& step) {
  const RobotModel& model = step.setup->model();
  CheckValue farthest;
  for (int i = 0; i < model.num_joints(); ++i) {
    const Joint& joint = model.joint(i);
    if (joint.type == JointType::kBall) continue;  // its position is a quaternion
    const double q = step.step->reading.state.q[model.position_index(i)];
    const double over = std::max(q - joint.upper, joint.lower - q);
    if (!(over <= farthest.value)) farthest = {over, i};
  }
  return farthest;
}

std::string DescribeJoint(const StepAnalysis& step, int part) {
  return "joint " + Quote(step.setup->model().joint(part).name);
}

std::string DescribeCollision(const StepAnalysis& step, int /*part*/) {
  const mjModel& m = step.setup->engine();
  const auto name_of = [&](int geom) {
    const int body = m.geom_bodyid[geom];
    return body > 0 ? NameOf(m, mjOBJ_BODY, body) : NameOf(m, mjOBJ_GEOM, geom);
  };
  const Collision& collision = step.step->response.collision;
  return name_of(collision.geom1) + " and " + name_of(collision.geom2);
}

std::unique_ptr<StatefulJudge> MakeIdleJointsJudge(const Setup& setup) {
  return std::make_unique<IdleJointsJudge>(setup);
}

}  // namespace dexcheck
