#include "harness/checks/contact_give.h"

#include <cmath>

#include "harness/checks/bounds.h"
#include "harness/checks/known_plant.h"

namespace dexcheck {
namespace {

// Contacts have several modes, of which the softest is followed: together at most this much. Measured 1.6
// with d = 0.9 and torques that change at random.
constexpr double kModes = 2.0;

/// A rigid plant's contacts are not soft.
ContactSoftness FindSoftness(const Setup& setup) {
  if (setup.scenario().plant.type == PlantType::kRigid) return {};
  return FindContactSoftness(setup.adapter(), setup.q_start(), setup.X_Bo_start());
}

}  // namespace

ContactGive::ContactGive(const PlantOptions& plant, const Share& normal, const Share& tangential)
    : time_step_(plant.time_step), normal_(normal), tangential_(tangential) {
  const double tc = FindContactTimeConstant(plant);
  b_ = 2.0 / (tc * plant.contact_impedance);
  k_ = 1.0 / (tc * tc * plant.contact_impedance);
  memory_ = std::exp(-time_step_ * normal.contact / tc);
}

void ContactGive::Add(const Eigen::Ref<const VectorXd>& force) {
  if (depth_.size() != force.size()) {
    depth_ = -normal_.force / (normal_.contact * k_) * force;
    depth_rate_ = VectorXd::Zero(force.size());
    slip_ = -tangential_.force / (tangential_.contact * b_) * force;
    normal_acceleration_ = tangent_acceleration_ = depth_rate_;
  }
  normal_acceleration_ = -normal_.contact * (b_ * depth_rate_ + k_ * depth_) - normal_.force * force;
  depth_rate_ += time_step_ * normal_acceleration_;
  depth_ += time_step_ * depth_rate_;
  tangent_acceleration_ = -tangential_.contact * b_ * slip_ - tangential_.force * force;
  slip_ += time_step_ * tangent_acceleration_;
}

PredictionGive::PredictionGive(const Setup& setup) : PredictionGive(setup, FindSoftness(setup)) {}

PredictionGive::PredictionGive(const Setup& setup, const ContactSoftness& softness)
    : setup_(&setup),
      wheels_(setup.model().base()),
      mass_(setup.model().base_with_wheels().mass),
      force_(setup.scenario().plant, ContactGive::Share::Of(softness.share),
             ContactGive::Share::Of(softness.tangential_share)),
      f_c_(setup.scenario().plant, ContactGive::Share::Of(softness.object_share),
           ContactGive::Share::Of(softness.object_tangential_share)),
      push_(force_),
      grasp_(force_),
      tips_(setup.scenario().plant, ContactGive::Share::Of(0.0), ContactGive::Share::Whole()),
      tyres_(tips_),
      sideways_(VectorXd::Zero(1)) {
  for (const Joint& joint : setup.model().joints()) mass_ += joint.body.mass;
}

void PredictionGive::Follow(const StepRecord& step, const Eigen::Ref<const VectorXd>& force,
                            const Eigen::Ref<const VectorXd>& f_c, double uneven,
                            const std::function<double(const VectorXd&)>& norm) {
  const GraspTerms& grasp = ModelAtTruth(step).grasp();
  force_.Add(force);
  f_c_.Add(f_c);
  tips_.Add(grasp.slip_bias());
  if (!step.response.wheels.empty()) {
    const VectorXd& xi = step.reading.state.xi;
    const double turn = std::abs(wheels_.CalcTurn(xi));
    const double forward = std::abs(wheels_.CalcMismatch(xi, Vector2d::Zero()).mean());
    // v w of the platform, and w^2 b / 2 of each wheel about its middle
    sideways_[0] = turn * (forward + 0.5 * setup_->model().base().wheel_distance * turn);
    tyres_.Add(sideways_);
  }
  double held = norm(force_.along_normal()) + norm(force_.along_tangent());
  // |f|_M^-1 of a force on all masses is |f| / sqrt(m), |a|_M of their acceleration |a| sqrt(m).
  const double root = std::sqrt(mass_);
  if (step.known != nullptr) {
    // A push changes contact forces without any torque, and what pushes sideways is held by tyres and is no
    // part of a force on xi.
    push_.Add(step.known->push);
    grasp_force_.noalias() = grasp.J_B().transpose() * f_c;
    grasp_.Add(grasp_force_);
    held += norm(grasp_.along_normal()) + norm(grasp_.along_tangent()) + push_.size() / root;
  }
  held_ = std::max(kModes * held, force_.memory() * held_);
  held_of_f_c_ = std::max(kModes * f_c_.size(), f_c_.memory() * held_of_f_c_);
  motion_ = held_ + root * (tips_.size() + tyres_.size()) + uneven;
  contact_force_ = held_of_f_c_ + setup_->object().body.mass * (tips_.size() + motion_ / root);
  sinking_ = norm(force_.rate()) / root;
}

}  // namespace dexcheck
