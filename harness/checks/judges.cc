#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "controller/common/text.h"
#include "controller/contact/contact_geometry.h"
#include "harness/base/worst.h"
#include "harness/checks/check_table.h"
#include "harness/checks/step_record.h"

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
      moved = Worst(moved, std::abs(q - start_[i]));
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

Evaluation EvaluateMeasurement(const StepAnalysis& step) {
  constexpr double kOther = std::numeric_limits<double>::infinity();
  const Reading &measured = step.step->measured, &declared = step.declared->measured;
  const MeasuredState &a = measured.state, &b = declared.state;
  double apart = measured.touch.fingertips == declared.touch.fingertips ? 0.0 : kOther;
  apart = Worst(apart, std::abs(measured.touch.support_force - declared.touch.support_force));
  apart = Worst(apart, MaxAbs(a.q - b.q), MaxAbs(a.xi - b.xi), MaxAbs(a.X_Bo.matrix() - b.X_Bo.matrix()),
                MaxAbs(a.V_Bo - b.V_Bo));
  for (size_t i = 0; i < b.kappa.size(); ++i) {
    const ContactCoordinates &x = a.kappa[i], &y = b.kappa[i];
    apart = Worst(apart, MaxAbs(x.CalcVector() - y.CalcVector()), std::abs(a.overlap[i] - b.overlap[i]));
    if (x.alpha_f.chart != y.alpha_f.chart || x.alpha_o.chart != y.alpha_o.chart)
      apart = Worst(apart, kOther);
  }
  return CheckValue{apart};
}

Evaluation EvaluateMotors(const StepAnalysis& step) {
  const double largest = Worst(MaxAbs(step.step->command.tau), std::numeric_limits<double>::min());
  return CheckValue{MaxAbs(step.step->response.motor_torques - step.declared->tau) / largest};
}

Evaluation EvaluateRolling(const StepAnalysis& step) {
  if (step.step->response.wheels.size() != 2) return std::nullopt;
  const Vector2d beyond = step.wheels.mismatch.cwiseAbs() - step.wheels.slip;
  const int wheel = IsWorse(beyond[1], beyond[0]) ? 1 : 0;
  return CheckValue{Worst(0.0, beyond[wheel]), -1, step.wheels.slip[wheel],
                    std::abs(step.wheels.mismatch[wheel])};
}

Evaluation EvaluateContactDistance(const StepAnalysis& step) {
  if (step.contacts.touching == 0 || !step.setup->start().bonds.empty()) return std::nullopt;
  CheckValue worst{0.0, 0};
  for (int i = 0; i < step.grasp().num_contacts(); ++i) {
    const double apart = std::abs(step.contacts.mismatch[i]);
    if (IsWorse(apart, worst.value)) worst = {apart, i};
  }
  return worst;
}

std::string DescribeFoot(const StepAnalyzer& now, int part) {
  const Setup& setup = *now.analysis().setup;
  return part < 0 ? "" : "foot " + Quote(setup.model().frame(setup.feet()[static_cast<size_t>(part)]).name);
}

Evaluation EvaluateRim(const StepAnalysis& step) {
  if (!step.step->command.handling.holding) return std::nullopt;
  const Vector3d& pole = *step.setup->scenario().grasp.hemisphere;
  CheckValue farthest;
  for (int i = 0; i < step.grasp().num_contacts(); ++i) {
    const SurfacePoint& alpha_f = step.step->reading.state.kappa[static_cast<size_t>(i)].alpha_f;
    const Vector3d p = step.grasp().tip(i).Evaluate(alpha_f).p;
    const double past = -CalcRimDistance(p.norm(), pole, p);
    if (IsWorse(past, farthest.value)) farthest = {past, i};
  }
  return farthest;
}

std::string DescribeFingertip(const StepAnalyzer& now, int part) {
  const int frame = now.analysis().grasp().fingertips()[static_cast<size_t>(part)];
  return "fingertip " + Quote(now.analysis().setup->model().frame(frame).name);
}

Evaluation EvaluateJointLimit(const StepAnalysis& step) {
  const RobotModel& model = step.setup->model();
  CheckValue farthest;
  for (int i = 0; i < model.num_joints(); ++i) {
    const Joint& joint = model.joint(i);
    if (joint.type == JointType::kBall) continue;  // its position is a quaternion
    const double q = step.step->reading.state.q[model.position_index(i)];
    const double over = Worst(q - joint.upper, joint.lower - q);
    if (IsWorse(over, farthest.value)) farthest = {over, i};
  }
  return farthest;
}

std::string DescribeJoint(const StepAnalyzer& now, int part) {
  return "joint " + Quote(now.analysis().setup->model().joint(part).name);
}

std::string DescribeEntry(const StepAnalyzer& now, int part) { return now.whole()->DescribeEntry(part); }

std::string DescribeConstraint(const StepAnalyzer& now, int part) {
  return now.constraint_law()->DescribeRow(part);
}

std::string DescribeCollision(const StepAnalyzer& now, int /*part*/) {
  const mjModel& m = now.analysis().setup->engine();
  const auto name_of = [&](int geom) {
    const int body = m.geom_bodyid[geom];
    return body > 0 ? NameOf(m, mjOBJ_BODY, body) : NameOf(m, mjOBJ_GEOM, geom);
  };
  const Collision& collision = now.analysis().step->response.collision;
  return name_of(collision.geom1) + " and " + name_of(collision.geom2);
}

std::unique_ptr<StatefulJudge> MakeIdleJointsJudge(const Setup& setup) {
  return std::make_unique<IdleJointsJudge>(setup);
}

// The check `kappa`.

namespace {

/// Returns the displacement of a body from one pose to the next as a body twist times time, in the middle of
/// the way; exact to the second order of the angle.
Vector6d CalcDisplacement(const Pose& from, const Pose& to) {
  const Pose X = from.inverse(Eigen::Isometry) * to;
  const Matrix3d& R = X.linear();
  const Vector3d angle = 0.5 * Vector3d(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  Vector6d moved;
  moved << X.translation() - 0.5 * angle.cross(X.translation()), angle;
  return moved;
}

class KappaJudge final : public StatefulJudge {
 public:
  explicit KappaJudge(const Setup& setup)
      : kappa_(setup.fingertips().size()), next_kappa_(kappa_), last_(kappa_.size()) {}

  Evaluation Evaluate(const StepAnalysis& step) override {
    if (step.contacts.begins_holding) has_kappa_ = false;
    Evaluation value;
    if (step.step->command.handling.holding) value = CheckValue{Integrate(step)};
    if (step.slip.is_window_end) {
      kappa_.swap(next_kappa_);
      next_kappa_ = step.step->reading.state.kappa;
    }
    return value;
  }
  void Reset() override { has_kappa_ = false; }

 private:
  /// A contact one step ago.
  struct LastContact {
    ContactCoordinates kappa;
    ContactGeometry geometry;
    Pose X_of = Pose::Identity();  // of the fingertip to the object
  };

  double Integrate(const StepAnalysis& step) {
    const MeasuredState& state = step.step->reading.state;
    const Surface& object = step.grasp().surface();
    double apart = 0.0;
    for (size_t i = 0; i < kappa_.size(); ++i) {
      const Vector5d change = CalcChange(step, i);
      if (!has_kappa_) {
        kappa_[i] = next_kappa_[i] = state.kappa[i];
        continue;
      }
      const Surface& tip = step.grasp().tip(static_cast<int>(i));
      for (std::vector<ContactCoordinates>* integrated : {&kappa_, &next_kappa_}) {
        ContactCoordinates& kappa = (*integrated)[i];
        FollowCharts(tip, object, state.kappa[i], &kappa);
        kappa = NormalizeContact(tip, object, Displace(kappa, change));
      }
      const ContactDrift drift = CalcContactDrift(tip, object, kappa_[i], state.kappa[i]);
      // psi at the fingertip's radius
      const double radius = tip.Evaluate(state.kappa[i].alpha_f).p.norm();
      apart = Worst(apart, Worst(drift.object, drift.fingertip, drift.psi * radius));
    }
    has_kappa_ = true;
    return apart;
  }

  /// Returns the change of kappa by (40) since the last step, by the motion of fingertip and object.
  Vector5d CalcChange(const StepAnalysis& step, size_t finger) {
    const GraspTerms& grasp = step.grasp();
    const MeasuredState& state = step.step->reading.state;
    const ContactGeometry& contact = grasp.contacts()[finger].geometry;
    const Pose X_0f = step.terms().CalcLinkPose(-1).inverse(Eigen::Isometry) *
                      step.terms().CalcFramePose(grasp.fingertips()[finger]);
    const Pose X_of = state.X_Bo.inverse(Eigen::Isometry) * step.step->reading.X_W0 * X_0f;
    const LastContact last = std::exchange(last_[finger], {state.kappa[finger], contact, X_of});
    if (!has_kappa_) return Vector5d::Zero();
    const Vector6d moved = CalcDisplacement(last.X_of, X_of);
    const auto change = [&](const ContactGeometry& at) {
      return CalcKappaDot(at, CalcRelativeTwist(at, moved, Vector6d::Zero()));
    };
    // One end of the step alone would leave an error of the order of dt, as large as the creep of contacts.
    const SurfacePoint& alpha_f = state.kappa[finger].alpha_f;
    const SurfacePoint& alpha_o = state.kappa[finger].alpha_o;
    if (last.kappa.alpha_f.chart == alpha_f.chart && last.kappa.alpha_o.chart == alpha_o.chart)
      return 0.5 * (change(contact) + change(last.geometry));
    const Surface& tip = grasp.tip(static_cast<int>(finger));
    const ContactCoordinates began =
        ChangeCharts(tip, grasp.surface(), last.kappa, alpha_f.chart, alpha_o.chart);
    return 0.5 * (change(contact) +
                  change(CalcContactGeometry(tip, grasp.surface(), began, state.overlap[finger])));
  }

  /// kappa integrated by (40) since the window's beginning, and since the next one's.
  std::vector<ContactCoordinates> kappa_, next_kappa_;
  std::vector<LastContact> last_;
  bool has_kappa_ = false;
};

}  // namespace

std::unique_ptr<StatefulJudge> MakeKappaJudge(const Setup& setup) {
  return std::make_unique<KappaJudge>(setup);
}

}  // namespace dexcheck
