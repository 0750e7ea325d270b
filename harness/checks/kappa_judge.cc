// The check `kappa`.

#include <algorithm>
#include <utility>

#include "controller/contact/contact_geometry.h"
#include "harness/checks/judges.h"
#include "harness/checks/step_record.h"

namespace dexcheck {
namespace {

/// What moves a body from one pose to the next, in the middle of the way, as a body twist times the time it
/// takes; to the second order of the angle.
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
    if (step.begins_holding) has_kappa_ = false;
    Evaluation value;
    if (step.step->command.handling.holding) value = CheckValue{Integrate(step)};
    if (step.is_window_end) {
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
    const Surface& object = step.grasp->surface();
    double apart = 0.0;
    for (size_t i = 0; i < kappa_.size(); ++i) {
      const Vector5d change = CalcChange(step, i);
      if (!has_kappa_) {
        kappa_[i] = next_kappa_[i] = state.kappa[i];
        continue;
      }
      const Surface& tip = step.grasp->tip(static_cast<int>(i));
      for (std::vector<ContactCoordinates>* integrated : {&kappa_, &next_kappa_}) {
        ContactCoordinates& kappa = (*integrated)[i];
        FollowCharts(tip, object, state.kappa[i], &kappa);
        kappa = NormalizeContact(tip, object, Displace(kappa, change));
      }
      const ContactDrift drift = CalcContactDrift(tip, object, kappa_[i], state.kappa[i]);
      // psi at the fingertip's radius
      const double radius = tip.Evaluate(state.kappa[i].alpha_f).p.norm();
      apart = std::max(apart, std::max({drift.object, drift.fingertip, drift.psi * radius}));
    }
    has_kappa_ = true;
    return apart;
  }

  /// By (40), from how fingertip and object have moved since the last step, in the charts of now.
  Vector5d CalcChange(const StepAnalysis& step, size_t finger) {
    const GraspTerms& grasp = *step.grasp;
    const MeasuredState& state = step.step->reading.state;
    const ContactGeometry& contact = grasp.contacts()[finger].geometry;
    const Pose X_0f = step.robot->CalcLinkPose(-1).inverse(Eigen::Isometry) *
                      step.robot->CalcFramePose(grasp.fingertips()[finger]);
    const Pose X_of = state.X_Bo.inverse(Eigen::Isometry) * step.step->reading.X_W0 * X_0f;
    const LastContact last = std::exchange(last_[finger], {state.kappa[finger], contact, X_of});
    if (!has_kappa_) return Vector5d::Zero();
    const Vector6d moved = CalcDisplacement(last.X_of, X_of);
    const auto change = [&](const ContactGeometry& at) {
      return CalcKappaDot(at, CalcRelativeTwist(at, moved, Vector6d::Zero()));
    };
    // By one end of the step alone the error would be of the order of dt, as large as what contacts creep.
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

  /// Integrated from (40) since the window's beginning, and since the next one's.
  std::vector<ContactCoordinates> kappa_, next_kappa_;
  std::vector<LastContact> last_;
  bool has_kappa_ = false;
};

}  // namespace

std::unique_ptr<StatefulJudge> MakeKappaJudge(const Setup& setup) {
  return std::make_unique<KappaJudge>(setup);
}

}  // namespace dexcheck
