#include "harness/checks/contact_compliance.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "harness/checks/check_table.h"
#include "harness/checks/wheel_rolling.h"

namespace dexcheck {
namespace {

// The largest theta (1 - theta).
constexpr double kStiffModes = 0.25;
// What a straight line leaves of the answers of modes is followed over this many steps, some tens of their
// time constants of about two steps, and looked for at this many fractions.
constexpr Eigen::Index kBendSteps = 64;
constexpr int kBendFractions = 8;

/// A rigid plant's contacts are not soft.
ContactSoftness FindSoftness(const Setup& setup) {
  if (setup.scenario().plant.type == PlantType::kRigid) return {};
  return FindContactSoftness(setup.adapter(), setup.start().q, setup.start().X_Bo);
}

/// |d/dt r| of the rigid plant by Euler's method, which leads contacts back to the constraints
/// (rigid_plant.h), beyond what (46) has; 0 of other plants.
double CalcLeadingBack(const PlantOptions& plant, const StepRecord& step, const GraspTerms& grasp) {
  if (plant.type != PlantType::kRigid || plant.integrator != Integrator::kSemiImplicitEuler) return 0.0;
  const double w = 0.5 / plant.time_step;
  double squared = 0.0;
  for (int i = 0; i < grasp.num_contacts(); ++i) {
    Vector3d rate = -2.0 * w * grasp.slip().segment<3>(3 * i) + 0.5 * grasp.slip_bias().segment<3>(3 * i);
    rate.z() += w * w * step.response.contacts[static_cast<size_t>(i)].distance;
    squared += rate.squaredNorm();
  }
  return std::sqrt(squared);
}

}  // namespace

void CalcContactBias(const Setup& setup, const StepRecord& step, const GraspModel& model, VectorXd* bias) {
  const GraspTerms& grasp = model.grasp();
  const PlantOptions& plant = setup.scenario().plant;
  *bias = grasp.slip_bias();
  if (plant.type == PlantType::kRigid) {
    *bias *= plant.integrator == Integrator::kSemiImplicitEuler ? 0.5 : 0.0;
    return;
  }
  const Matrix3d& R_Bo = step.reading.state.X_Bo.linear();
  const Vector6d& V_Bo = grasp.V_Bo();
  Vector3d turning = V_Bo.tail<3>().cross(V_Bo.head<3>());
  if (setup.model().base().type == BaseType::kDifferentialDrive) {
    const Vector6d V_B0 = model.robot().CalcLinkVelocity(-1);
    turning -= R_Bo.transpose() * V_B0.tail<3>().cross(V_B0.head<3>());
  }
  bias->noalias() += grasp.G().topRows<3>().transpose() * turning;
}

ContactCompliance::ContactCompliance(const PlantOptions& plant, const Fraction& normal,
                                     const Fraction& tangential)
    : time_step_(plant.time_step), normal_(normal), tangential_(tangential) {
  const double tc = FindContactTimeConstant(plant);
  b_ = 2.0 / (tc * plant.contact_impedance);
  k_ = 1.0 / (tc * tc * plant.contact_impedance);
  memory_ = std::exp(-time_step_ * normal.contact / tc);
}

void ContactCompliance::Add(const Eigen::Ref<const VectorXd>& force) {
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

ModesCompliance::ModesCompliance(const PlantOptions& plant, double normal_fraction,
                                 double tangential_fraction)
    : fraction_(std::max(normal_fraction, tangential_fraction)),
      softest_(plant, ContactCompliance::Fraction::Of(normal_fraction),
               ContactCompliance::Fraction::Of(tangential_fraction)),
      stiffest_(plant, {normal_fraction, 1.0}, {tangential_fraction, 1.0}),
      bends_(VectorXd::Zero(kBendSteps)),
      changes_(VectorXd::Zero(kBendSteps)) {
  // h of the fractions theta s, in columns: along the normal, along the tangent
  std::vector<MatrixXd> answers;
  for (int i = 0; i <= kBendFractions; ++i) {
    const double theta = static_cast<double>(i) / kBendFractions;
    ContactCompliance mode(plant, {1.0, 1.0 - theta * normal_fraction},
                           {1.0, 1.0 - theta * tangential_fraction});
    mode.Add(VectorXd::Zero(1));
    MatrixXd& h = answers.emplace_back(kBendSteps, 2);
    for (Eigen::Index k = 0; k < kBendSteps; ++k) {
      mode.Add(VectorXd::Ones(1));
      h.row(k) << mode.along_normal()[0], mode.along_tangent()[0];
    }
  }
  MatrixXd largest = MatrixXd::Zero(kBendSteps, 2);
  for (int i = 1; i < kBendFractions; ++i) {
    const double theta = static_cast<double>(i) / kBendFractions;
    const MatrixXd bend =
        theta * (answers[static_cast<size_t>(i)] - (1.0 - theta) * answers.front() - theta * answers.back());
    largest = largest.cwiseMax(bend.cwiseAbs());
  }
  bends_ = largest * Vector2d(normal_fraction, tangential_fraction);
}

void ModesCompliance::Add(const Eigen::Ref<const VectorXd>& force) {
  softest_.Add(force);
  stiffest_.Add(force);
  if (force_.size() != force.size()) force_ = force;
  change_ = force - force_;
  force_ = force;
}

double ModesCompliance::CalcSize(const std::function<double(const VectorXd&)>& norm) {
  newest_ = (newest_ + kBendSteps - 1) % kBendSteps;
  changes_[newest_] = norm(change_);
  double bent = 0.0;
  for (Eigen::Index k = 0; k < kBendSteps; ++k) bent += bends_[k] * changes_[(newest_ + k) % kBendSteps];
  // Sums of norms, where orthogonal modes would need no more than roots of sums of squares: the modes are
  // orthogonal only nearly, since normals have a stiffness and tangents have none. What they mix is of the
  // order of s besides: `curve-real` at impedance 0.9, s = 0.61, exceeded the sum by up to 1.24.
  const auto both = [&](const VectorXd& softest, const VectorXd& stiffest) {
    return norm(softest) + kStiffModes * norm(stiffest);
  };
  return (1.0 + fraction_) * (both(softest_.along_normal(), stiffest_.along_normal()) +
                              both(softest_.along_tangent(), stiffest_.along_tangent()) + bent);
}

PredictionCompliance::PredictionCompliance(const Setup& setup)
    : PredictionCompliance(setup, FindSoftness(setup)) {}

PredictionCompliance::PredictionCompliance(const Setup& setup, const ContactSoftness& softness)
    : setup_(&setup),
      mass_(setup.model().base_with_wheels().mass),
      force_(setup.scenario().plant, softness.fraction, softness.tangential_fraction),
      f_c_(setup.scenario().plant, softness.object_fraction, softness.object_tangential_fraction),
      push_(force_),
      grasp_(force_),
      tips_(setup.scenario().plant, ContactCompliance::Fraction::Of(0.0),
            ContactCompliance::Fraction::Whole()),
      tyres_(tips_),
      sideways_(VectorXd::Zero(1)) {
  for (const Joint& joint : setup.model().joints()) mass_ += joint.body.mass;
}

void PredictionCompliance::Follow(const StepRecord& step, const DeclaredStep& declared,
                                  const VectorXd& contact_bias, const VectorXd& force, const VectorXd& f_c,
                                  double uneven, const std::function<double(const VectorXd&)>& norm) {
  const GraspTerms& grasp = declared.model->grasp();
  force_.Add(force);
  f_c_.Add(f_c);
  tips_.Add(contact_bias);
  if (!step.response.wheels.empty()) {
    const VectorXd& xi = step.reading.state.xi;
    const double turn = std::abs(CalcRollingTwist(setup_->model().base(), xi)[1]);
    const double forward = std::abs(CalcRollingTwist(setup_->model().base(), xi)[0]);
    // v w of the platform, and w^2 b / 2 of each wheel about its middle
    sideways_[0] = turn * (forward + 0.5 * setup_->model().base().wheel_distance * turn);
    tyres_.Add(sideways_);
  }
  double held = force_.CalcSize(norm);
  const auto length = [](const VectorXd& f) { return f.norm(); };
  // |f|_M^-1 of a force on all masses is |f| / sqrt(m), |a|_M of their acceleration |a| sqrt(m).
  const double root = std::sqrt(mass_);
  if (!declared.is_ideal) {
    // A push changes contact forces without any torque, and what pushes sideways is held by tyres and is no
    // part of a force on xi.
    push_.Add(declared.push);
    grasp_force_.noalias() = grasp.J_B().transpose() * f_c;
    grasp_.Add(grasp_force_);
    held += grasp_.CalcSize(norm) + push_.CalcSize(length) / root;
  }
  held_ = std::max(held, force_.softest().memory() * held_);
  held_of_f_c_ = std::max(f_c_.CalcSize(length), f_c_.softest().memory() * held_of_f_c_);
  const double tips = std::max(tips_.size(), CalcLeadingBack(setup_->scenario().plant, step, grasp));
  motion_ = held_ + root * (tips + tyres_.size()) + uneven;
  contact_force_ = held_of_f_c_ + setup_->object().body.mass * (tips + motion_ / root);
  sinking_ = norm(force_.softest().rate()) / root;
}

}  // namespace dexcheck
