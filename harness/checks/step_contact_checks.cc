// Contacts of fingertips and wheels: what touches, slips, rolls and sinks in.

#include <algorithm>
#include <cmath>

#include "controller/contact/rolling.h"
#include "harness/checks/step_checks.h"

namespace dexcheck {
namespace {

/// Integrated and measured contact farther apart than this have nothing to do with each other any more, and
/// one may lie at the pole of the other's chart, m. Less than from a chart's margin to its pole, 4 mm on a
/// fingertip of 9 mm.
constexpr double kStray = 1e-3;

/// Writes the integrated contact in the charts of the measured one, which kappa_dot is in.
void FollowCharts(const Surface& tip, const Surface& object, const ContactCoordinates& measured,
                  ContactCoordinates* integrated) {
  const int tip_chart = measured.alpha_f.chart;
  const int object_chart = measured.alpha_o.chart;
  if (integrated->alpha_f.chart == tip_chart && integrated->alpha_o.chart == object_chart) return;
  const auto is_near = [](const Surface& surface, const SurfacePoint& a, const SurfacePoint& b) {
    return (surface.Evaluate(a).p - surface.Evaluate(b).p).norm() < kStray;
  };
  if (!is_near(tip, integrated->alpha_f, measured.alpha_f)) return;
  if (!is_near(object, integrated->alpha_o, measured.alpha_o)) return;
  *integrated = ChangeCharts(tip, object, *integrated, tip_chart, object_chart);
}

/// How far integrated and measured contact are apart, m: the point on the object, the point on the fingertip,
/// and psi at the fingertip's radius. The largest of them.
double CalcDrift(const Surface& tip, const Surface& object, const ContactCoordinates& integrated,
                 const ContactCoordinates& measured) {
  const auto apart = [](const Surface& surface, const SurfacePoint& a, const SurfacePoint& b) {
    return (surface.Evaluate(a).p - surface.Evaluate(b).p).norm();
  };
  const double turned = std::abs(std::remainder(integrated.psi - measured.psi, 2.0 * M_PI));
  return std::max({apart(object, integrated.alpha_o, measured.alpha_o),
                   apart(tip, integrated.alpha_f, measured.alpha_f),
                   turned * tip.Evaluate(measured.alpha_f).p.norm()});
}

}  // namespace

void StepChecks::CompareContacts(const StepRecord& step) {
  const bool holding = step.command.handling.holding;
  const std::vector<PlantContact>& contacts = step.response.contacts;
  int lost = 0;
  double penetration = 0.0;
  for (size_t i = 0; i < contacts.size(); ++i) {
    const Matrix3d R_B_cf =
        step.reading.state.X_Bo.linear() * ModelAtTruth(step).grasp().contacts()[i].geometry.g_o_cf.linear();
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
      slip.next_window = slip.distance;
    }
  }
  if (!has_kappa_) return;
  kappa_ = next_kappa_;
  next_kappa_ = state.kappa;
}

void StepChecks::ReadSlip(const StepRecord& step) {
  const bool holding = step.command.handling.holding;
  const MeasuredState& state = step.reading.state;
  const PlantResponse& response = step.response;
  double slipped = 0.0;
  double rate = 0.0;
  double cone_use = 0.0;
  const auto update = [&](SlipState* slip, const BodyContact& contact, const Matrix3d& R) {
    slip->touching = contact.touching;
    slip->cone_use = contact.cone_use;
    slip->cone_margin = contact.cone_margin;
    slip->velocity = R.transpose() * contact.slip;
    slip->distance += time_step_ * slip->velocity;
    slipped = std::max(slipped, (slip->distance - slip->window).norm());
    cone_use = std::max(cone_use, contact.cone_use);
  };
  for (size_t i = 0; i < response.fingertips.size(); ++i) {
    SlipState& slip = findings_.fingertip_slip[i];
    update(&slip, response.fingertips[i], state.X_Bo.linear());
    const Vector2d unasked =
        ModelAtTruth(step).grasp().slip_bias().segment<2>(3 * static_cast<Eigen::Index>(i));
    rate = std::max(rate, slip.velocity.norm() - time_step_ * unasked.norm());
    if (slip.touching && holding) {
      findings_.least_cone_margin = std::min(findings_.least_cone_margin, slip.cone_margin);
    }
  }
  if (!setup_->bonds().empty()) {
    for (const PlantContact& bond : response.contacts) slipped = std::max(slipped, bond.distance);
  }
  if (holding) {
    Add(StepCheck::kFingertipSlip, slipped);
    if (!is_unjudged_) Add(StepCheck::kFingertipSlipRate, rate);
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

void StepChecks::CompareKappa(const StepRecord& step) {
  const GraspTerms& grasp = ModelAtTruth(step).grasp();
  const MeasuredState& state = step.reading.state;
  double apart = 0.0;
  for (size_t i = 0; i < kappa_.size(); ++i) {
    if (!has_kappa_) {
      kappa_[i] = next_kappa_[i] = state.kappa[i];
      continue;
    }
    // The velocity at hand led from the last state to this one.
    const Vector5d change = time_step_ * grasp.contacts()[i].kappa_dot;
    const Surface& tip = grasp.tip(static_cast<int>(i));
    for (std::vector<ContactCoordinates>* integrated : {&kappa_, &next_kappa_}) {
      ContactCoordinates& kappa = (*integrated)[i];
      FollowCharts(tip, grasp.surface(), state.kappa[i], &kappa);
      kappa = NormalizeContact(tip, grasp.surface(), Displace(kappa, change));
    }
    apart = std::max(apart, CalcDrift(tip, grasp.surface(), kappa_[i], state.kappa[i]));
  }
  has_kappa_ = true;
  Add(StepCheck::kKappa, apart);
}

}  // namespace dexcheck
