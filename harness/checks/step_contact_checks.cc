// Contacts of fingertips and wheels: what touches, slips, rolls, sinks in and passes a rim.

#include <algorithm>
#include <cmath>
#include <utility>

#include "controller/common/text.h"
#include "controller/contact/fingertip_rim.h"
#include "controller/contact/rolling.h"
#include "harness/checks/contact_compliance.h"
#include "harness/checks/contact_drift.h"
#include "harness/checks/step_checks.h"

namespace dexcheck {
namespace {

/// The largest of them as a length, m: psi at the fingertip's radius.
double CalcLength(const ContactDrift& drift, double radius) {
  return std::max({drift.object, drift.fingertip, drift.psi * radius});
}

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

}  // namespace

void StepChecks::CompareContacts(const StepRecord& step) {
  const bool holding = step.command.handling.holding;
  const std::vector<PlantContact>& contacts = step.response.contacts;
  int lost = 0;
  double penetration = 0.0;
  for (size_t i = 0; i < contacts.size(); ++i) {
    const Matrix3d R_B_cf = step.reading.state.X_Bo.linear() *
                            ModelAtTrueState(step).grasp().contacts()[i].geometry.g_o_cf.linear();
    findings_.f_c.segment<3>(3 * static_cast<Eigen::Index>(i)) = R_B_cf.transpose() * contacts[i].force;
    if (!contacts[i].touching) ++lost;
    if (holding && !contacts[i].touching && findings_.fingertip_slip[i].touching) ++findings_.contacts_lost;
    penetration = std::max(penetration, -contacts[i].distance);
  }
  Add(StepCheck::kContactsLost, holding ? lost : 0);
  Add(StepCheck::kPenetration, penetration);
}

void StepChecks::ForgetSlip() {
  std::fill(findings_.fingertip_slip.begin(), findings_.fingertip_slip.end(), SlipState{});
  has_kappa_ = false;
}

void StepChecks::MoveWindows(const MeasuredState& state) {
  const long half = std::max(1L, std::lround(0.5 * kSlipWindow / time_step_));
  if (steps_ == 0 || steps_ % half != 0) return;
  for (std::vector<SlipState>* slips : {&findings_.fingertip_slip, &findings_.wheel_slip}) {
    for (SlipState& slip : *slips) {
      slip.window = slip.next_window;
      slip.next_window = slip.distance - slip.creep;
    }
  }
  kappa_ = next_kappa_;
  next_kappa_ = state.kappa;
}

void StepChecks::ReadSlip(const StepRecord& step) {
  const bool holding = step.command.handling.holding;
  const MeasuredState& state = step.reading.state;
  const PlantResponse& response = step.response;
  CalcContactBias(*setup_, step, &contact_bias_);
  double slipped = 0.0;
  double rate = 0.0;
  double cone_use = 0.0;
  const auto update = [&](SlipState* slip, const BodyContact& contact, const Matrix3d& R) {
    slip->touching = contact.touching;
    slip->cone_use = contact.cone_use;
    slip->cone_margin = contact.cone_margin;
    slip->velocity = R.transpose() * contact.slip;
    slip->distance += time_step_ * slip->velocity;
    slipped = std::max(slipped, (slip->distance - slip->creep - slip->window).norm());
    cone_use = std::max(cone_use, contact.cone_use);
  };
  for (size_t i = 0; i < response.fingertips.size(); ++i) {
    SlipState& slip = findings_.fingertip_slip[i];
    const Matrix3d& R_o_cf = ModelAtTrueState(step).grasp().contacts()[i].geometry.g_o_cf.linear();
    const Vector3d creep =
        time_step_ * R_o_cf.leftCols<2>() * contact_bias_.segment<2>(3 * static_cast<Eigen::Index>(i));
    slip.creep += time_step_ * creep;
    update(&slip, response.fingertips[i], state.X_Bo.linear());
    rate = std::max(rate, (slip.velocity - creep).norm());
    if (slip.touching && holding) {
      findings_.least_cone_margin = std::min(findings_.least_cone_margin, slip.cone_margin);
    }
  }
  if (!setup_->start().bonds.empty()) {
    for (const PlantContact& bond : response.contacts) slipped = std::max(slipped, bond.distance);
  }
  if (holding) {
    Add(StepCheck::kFingertipSlip, slipped);
    if (!is_excluded_) Add(StepCheck::kFingertipSlipRate, rate);
    Add(StepCheck::kConeUse, cone_use);
  }
  slipped = 0.0;
  rate = 0.0;
  cone_use = 0.0;
  const double phi = setup_->model().num_base_positions() == 3 ? state.q[2] : 0.0;
  const Matrix3d R_B0 = Eigen::AngleAxisd(phi, Vector3d::UnitZ()).toRotationMatrix();
  for (size_t i = 0; i < response.wheels.size(); ++i) {
    update(&findings_.wheel_slip[i], response.wheels[i], R_B0);
    rate = std::max(rate, findings_.wheel_slip[i].velocity.norm());
  }
  Add(StepCheck::kWheelSlip, slipped);
  Add(StepCheck::kWheelSlipRate, rate);
  Add(StepCheck::kTractionUse, cone_use);
}

void StepChecks::CheckRims(const StepRecord& step) {
  const GraspTerms& grasp = ModelAtTrueState(step).grasp();
  const Vector3d& pole = *setup_->scenario().grasp.hemisphere;
  CheckRecord& rim = check(StepCheck::kFingertipRim);
  double beyond = 0.0;
  for (size_t i = 0; i < grasp.fingertips().size(); ++i) {
    const Vector3d p = grasp.tip(static_cast<int>(i)).Evaluate(step.reading.state.kappa[i].alpha_f).p;
    const double past = -CalcRimDistance(p.norm(), pole, p);
    if (past <= beyond) continue;
    beyond = past;
    if (rim.failed) continue;
    rim.part =
        "fingertip " + Quote(setup_->model().frames()[static_cast<size_t>(grasp.fingertips()[i])].name);
  }
  Add(StepCheck::kFingertipRim, beyond);
}

Vector5d StepChecks::CalcKappaChange(const StepRecord& step, size_t finger) {
  const ModelTerms& robot = ModelAtTrueState(step).robot();
  const GraspTerms& grasp = ModelAtTrueState(step).grasp();
  const MeasuredState& state = step.reading.state;
  const ContactGeometry& contact = grasp.contacts()[finger].geometry;
  const Pose X_0f =
      robot.CalcLinkPose(-1).inverse(Eigen::Isometry) * robot.CalcFramePose(grasp.fingertips()[finger]);
  const Pose X_of = state.X_Bo.inverse(Eigen::Isometry) * step.reading.X_W0 * X_0f;
  const LastContact last = std::exchange(last_contacts_[finger], {state.kappa[finger], contact, X_of});
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
  return 0.5 *
         (change(contact) + change(CalcContactGeometry(tip, grasp.surface(), began, state.overlap[finger])));
}

void StepChecks::CompareKappa(const StepRecord& step) {
  const GraspTerms& grasp = ModelAtTrueState(step).grasp();
  const MeasuredState& state = step.reading.state;
  double apart = 0.0;
  for (size_t i = 0; i < kappa_.size(); ++i) {
    const Vector5d change = CalcKappaChange(step, i);
    if (!has_kappa_) {
      kappa_[i] = next_kappa_[i] = state.kappa[i];
      continue;
    }
    const Surface& tip = grasp.tip(static_cast<int>(i));
    for (std::vector<ContactCoordinates>* integrated : {&kappa_, &next_kappa_}) {
      ContactCoordinates& kappa = (*integrated)[i];
      FollowCharts(tip, grasp.surface(), state.kappa[i], &kappa);
      kappa = NormalizeContact(tip, grasp.surface(), Displace(kappa, change));
    }
    const ContactDrift drift = CalcContactDrift(tip, grasp.surface(), kappa_[i], state.kappa[i]);
    apart = std::max(apart, CalcLength(drift, tip.Evaluate(state.kappa[i].alpha_f).p.norm()));
  }
  has_kappa_ = true;
  Add(StepCheck::kKappa, apart);
}

}  // namespace dexcheck
