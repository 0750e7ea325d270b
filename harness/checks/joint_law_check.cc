#include "harness/checks/joint_law_check.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/text.h"
#include "controller/control/joint_controller.h"
#include "harness/checks/law_check.h"
#include "harness/checks/step_check_table.h"

namespace dexcheck {

JointLawCheck::JointLawCheck(const Setup& setup)
    : law_(setup.scenario().control.law),
      gains_(setup.joints()->gains),
      motion_(&setup.joints()->motion),
      time_step_(setup.scenario().plant.time_step),
      velocity_age_(setup.scenario().plant.velocity_age()),
      hold_(std::max(1L, std::lround(setup.scenario().plant.control_step / time_step_))),
      factor_(setup.model()) {
  for (const Joint& joint : setup.model().joints()) names_.push_back(joint.name);
  const int n = setup.model().num_velocities();
  for (VectorXd* vector : {&force_, &demand_, &true_demand_, &differed_, &work_}) vector->setZero(n);
}

double JointLawCheck::sampled_radius() const {
  double radius = 0.0;
  for (Eigen::Index i = 0; i < gains_.K_p.size(); ++i) {
    ObjectGains one;
    one.K_p.setConstant(gains_.K_p[i]);
    one.K_v.setConstant(gains_.K_v[i]);
    radius = std::max(radius, CalcSampledRadius(one, time_step_, hold_, velocity_age_));
  }
  return radius;
}

void JointLawCheck::CalcDemand(const VectorXd& q, const VectorXd& xi, VectorXd* xi_dot) const {
  *xi_dot = desired_.q_ddot;
  *xi_dot += gains_.K_v.cwiseProduct(desired_.q_dot - xi);
  *xi_dot += gains_.K_p.cwiseProduct(desired_.q - q);
}

void JointLawCheck::CompareTorque(const StepRecord& step, const LawTerms& terms) {
  JointDemand::EvaluateDesired(*motion_, step.time, 2.0 * velocity_age_, &desired_, &half_step_);
  const auto norm = [&] { return factor_.CalcForceNorm(force_, &work_); };
  factor_.Compute(terms.M);
  force_ = terms.C_xi + terms.gravity + terms.friction;
  const double balanced = norm();
  if (law_ == ControlLaw::kComputedTorque) {
    // M_bar' (q_d_ddot + K_v e_dot + K_p e) + C_bar' q_dot + F_bar'
    CalcDemand(terms.q, terms.xi, &demand_);
    force_.noalias() += terms.M * demand_;
  } else {
    // K e + D e_dot + g [+ M_bar' q_d_ddot + C_bar' q_d_dot + friction]
    if (law_ == ControlLaw::kPdGravity) {
      force_ = terms.gravity;
    } else {
      force_.noalias() += terms.M * desired_.q_ddot;
      force_.noalias() += *terms.C * (desired_.q_dot - terms.xi);
    }
    force_ += gains_.K.cwiseProduct(desired_.q - terms.q);
    force_ += gains_.D.cwiseProduct(desired_.q_dot - terms.xi);
  }
  // What the law sends may be much more than what it balances, and is rounded as that.
  const double scale = std::max({balanced, norm(), std::numeric_limits<double>::min()});
  force_ -= step.command.tau;
  errors_.torque = norm() / scale;
  // Less is rounding, which tells nothing.
  if (errors_.torque > kLawTorqueBound) differed_ = differed_.cwiseMax(force_.cwiseAbs());
}

const JointLawErrors& JointLawCheck::Compare(const StepRecord& step, const VectorXd& xi_dot_model,
                                             const LawTerms& terms) {
  errors_ = JointLawErrors{};
  CompareTorque(step, terms);
  if (follows_error()) FollowError(step, xi_dot_model);
  return errors_;
}

double JointLawCheck::CompareUnsent(const StepRecord& step, const LawTerms& terms) {
  CompareTorque(step, terms);
  return errors_.torque;
}

void JointLawCheck::FollowError(const StepRecord& step, const VectorXd& xi_dot_model) {
  const MeasuredState& truth = step.reading.state;
  if (!follows_) {
    q_ = truth.q;
    xi_ = truth.xi;
    follows_ = true;
  }
  errors_.error_dynamics = (q_ - truth.q).cwiseAbs().maxCoeff();
  CalcDemand(q_, xi_, &demand_);
  // What the engine's robot did beyond the rigid prediction. Where the controller is told otherwise, given
  // otherwise and the robot is pushed, all of that drives the error as well.
  demand_ += step.response.xi_dot;
  if (step.known != nullptr) {
    CalcDemand(truth.q, truth.xi, &true_demand_);
    demand_ -= true_demand_;
  } else {
    demand_ -= xi_dot_model;
  }
  // Semi-implicit, as the plant: velocities first.
  xi_ += time_step_ * demand_;
  q_ += time_step_ * xi_;
}

std::string JointLawCheck::Tell() const {
  Eigen::Index joint = 0;
  const double largest = differed_.size() > 0 ? differed_.maxCoeff(&joint) : 0.0;
  if (!(largest > 0.0)) return {};
  return "the torque of joint " + names_[static_cast<size_t>(joint)] + " is up to " +
         FormatNumber(largest, 4) + " N m off the law's";
}

}  // namespace dexcheck
