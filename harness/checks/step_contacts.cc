// The part of a step's analysis that follows contacts of fingertips and wheels.

#include <algorithm>
#include <cmath>

#include "harness/base/worst.h"
#include "harness/checks/step_analysis.h"

namespace dexcheck {
namespace {

/// One more step of a contact. @param R of the body that is slipped on, in the world. @param creep_rate dt
/// J_dot qvel, m/s.
void Follow(const BodyContact& contact, const Matrix3d& R, const Vector3d& creep_rate, double time_step,
            SlipState* slip, SlipSummary* largest) {
  slip->touching = contact.touching;
  slip->cone_use = contact.cone_use;
  slip->cone_margin = contact.cone_margin;
  slip->velocity = R.transpose() * contact.slip;
  slip->distance += time_step * slip->velocity;
  slip->creep += time_step * creep_rate;
  largest->distance = Worst(largest->distance, (slip->distance - slip->creep - slip->window).norm());
  largest->rate = Worst(largest->rate, (slip->velocity - creep_rate).norm());
  largest->cone_use = Worst(largest->cone_use, contact.cone_use);
}

}  // namespace

void StepAnalyzer::FindContacts() {
  const StepRecord& step = *now_.step;
  StepFindings& findings = now_.findings;
  const std::vector<PlantContact>& contacts = step.response.contacts;
  now_.contacts.mismatch.setZero();
  for (size_t i = 0; i < contacts.size(); ++i) {
    const Matrix3d R_B_cf =
        step.reading.state.X_Bo.linear() * now_.grasp().contacts()[i].geometry.g_o_cf.linear();
    findings.f_c.segment<3>(3 * static_cast<Eigen::Index>(i)) = R_B_cf.transpose() * contacts[i].force;
    // Bonds join points, whatever the shapes.
    if (contacts[i].touching && setup_->start().bonds.empty())
      now_.contacts.mismatch[static_cast<Eigen::Index>(i)] =
          contacts[i].distance + step.reading.state.overlap[i];
    if (step.command.handling.holding && !contacts[i].touching && findings.fingertip_slip[i].touching)
      ++findings.contacts_lost;
  }
}

void StepAnalyzer::FindFeet() {
  ground_->SetState(now_.terms());
  now_.contacts.foot_gap = 0.0;
  now_.contacts.foot_mismatch = {0.0, -1};
  const std::vector<GroundContact>& feet = now_.step->response.feet;
  for (size_t i = 0; i < feet.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    now_.findings.foot_force.segment<3>(3 * k) = feet[i].force;
    if (!feet[i].touching) {
      now_.contacts.foot_gap = Worst(now_.contacts.foot_gap, ground_->gap()[k]);
      continue;
    }
    const double mismatch = std::abs(feet[i].distance - ground_->gap()[k]);
    if (IsWorse(mismatch, now_.contacts.foot_mismatch.first))
      now_.contacts.foot_mismatch = {mismatch, static_cast<int>(i)};
  }
}

double StepAnalyzer::CalcFootUse() const {
  const std::vector<GroundContact>& contacts = now_.step->response.feet;
  const auto body = [&](size_t i) { return setup_->model().frame(setup_->feet()[i]).link; };
  double largest = 0.0;
  for (size_t i = 0; i < contacts.size(); ++i) {
    double friction = 0.0, most = 0.0;
    for (size_t k = 0; k < contacts.size(); ++k) {
      if (body(k) != body(i)) continue;
      const double tangential = contacts[k].force.head<2>().norm(), speed = contacts[k].slip.norm();
      friction += speed * tangential;
      most += speed * (contacts[k].cone_margin + tangential);
    }
    if (!(most <= 0.0)) largest = Worst(largest, friction / most);
  }
  return largest;
}

void StepAnalyzer::ForgetSlip() { std::ranges::fill(now_.findings.fingertip_slip, SlipState{}); }

void StepAnalyzer::MoveWindow() {
  const long half = Worst(1L, std::lround(0.5 * kSlipWindow / time_step_));
  now_.slip.is_window_end = steps_ > 0 && steps_ % half == 0;
  if (!now_.slip.is_window_end) return;
  for (std::vector<SlipState>* slips :
       {&now_.findings.fingertip_slip, &now_.findings.wheel_slip, &now_.findings.foot_slip}) {
    for (SlipState& slip : *slips) {
      slip.window = slip.next_window;
      slip.next_window = slip.distance - slip.creep;
    }
  }
}

void StepAnalyzer::FollowSlip() {
  const StepRecord& step = *now_.step;
  const MeasuredState& state = step.reading.state;
  StepFindings& findings = now_.findings;
  now_.slip.fingertips = now_.slip.wheels = now_.slip.feet = SlipSummary{};
  for (size_t i = 0; i < step.response.feet.size(); ++i) {
    Vector3d creep_rate = time_step_ * ground_->J_dot_xi().segment<3>(3 * static_cast<Eigen::Index>(i));
    creep_rate.z() = 0.0;
    Follow(step.response.feet[i], Matrix3d::Identity(), creep_rate, time_step_, &findings.foot_slip[i],
           &now_.slip.feet);
  }
  now_.slip.feet.cone_use = CalcFootUse();
  for (size_t i = 0; i < step.response.fingertips.size(); ++i) {
    SlipState& slip = findings.fingertip_slip[i];
    const Matrix3d& R_o_cf = now_.grasp().contacts()[i].geometry.g_o_cf.linear();
    const Vector3d creep_rate =
        time_step_ * R_o_cf.leftCols<2>() * contact_bias_.segment<2>(3 * static_cast<Eigen::Index>(i));
    Follow(step.response.fingertips[i], state.X_Bo.linear(), creep_rate, time_step_, &slip,
           &now_.slip.fingertips);
    if (slip.touching && step.command.handling.holding)
      findings.least_cone_margin = std::min(findings.least_cone_margin, slip.cone_margin);
  }
  if (!setup_->start().bonds.empty()) {
    for (const PlantContact& bond : step.response.contacts)
      now_.slip.fingertips.distance = Worst(now_.slip.fingertips.distance, bond.distance);
  }
  const double phi = setup_->model().num_base_positions() == 3 ? state.q[2] : 0.0;
  const Matrix3d R_B0 = Eigen::AngleAxisd(phi, Vector3d::UnitZ()).toRotationMatrix();
  for (size_t i = 0; i < step.response.wheels.size(); ++i)
    Follow(step.response.wheels[i], R_B0, Vector3d::Zero(), time_step_, &findings.wheel_slip[i],
           &now_.slip.wheels);
}

}  // namespace dexcheck
