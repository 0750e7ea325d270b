#include "controller/control/computed_torque.h"

#include <algorithm>
#include <utility>

#include "controller/common/errors.h"

namespace dexcheck {

void FactorJacobian(const RedundancyWeight& weight, const ModelTerms& robot, const GraspTerms& grasp,
                    Pseudoinverse* J_B_pinv) {
  switch (weight.kind) {
    case RedundancyWeight::Kind::kIdentity:
      return J_B_pinv->Factor(grasp.J_B(), grasp.moving_entries());
    case RedundancyWeight::Kind::kDiagonal:
      return J_B_pinv->FactorDiagonal(grasp.J_B(), weight.w, grasp.moving_entries());
    case RedundancyWeight::Kind::kMass:
      return J_B_pinv->FactorWeighted(grasp.J_B(), robot.M());
  }
}

ComputedTorque::ComputedTorque(const RobotModel& model, int num_contacts, RedundancyWeight weight)
    : weight_(std::move(weight)),
      actuation_(model),
      J_B_pinv_("J_B'", Eigen::Index{3} * num_contacts, model.num_velocities()),
      // One contact is too few for SetDemand, not for SetMotion.
      G_pinv_("G", std::min(6, 3 * num_contacts), Eigen::Index{3} * num_contacts) {
  const Eigen::Index n = model.num_velocities();
  const Eigen::Index k = Eigen::Index{3} * num_contacts;
  if (weight_.kind == RedundancyWeight::Kind::kDiagonal) {
    Require(weight_.w.size() == n, "length of w", "must be that of xi", weight_.w.size());
  }
  for (VectorXd* vector : {&xi_c_, &xi_dot_d_, &tau_0_, &tau_, &work_}) vector->setZero(n);
  for (VectorXd* of_contacts : {&f_c_, &rates_}) of_contacts->setZero(k);
}

void ComputedTorque::SetDemand(const ModelTerms& robot, const GraspTerms& grasp, const Vector6d& V_Bo_dot,
                               const Eigen::Ref<const VectorXd>& sigma_prime) {
  SetMotion(robot, grasp, V_Bo_dot, sigma_prime);
  G_pinv_.Factor(grasp.G());
  // F_o = M_hat V_dot + C_hat V + N_o
  F_o_ = grasp.body().M_hat * V_Bo_dot + grasp.body().C_hat * grasp.V_Bo() + grasp.body().N_o;
}

void ComputedTorque::SetMotion(const ModelTerms& robot, const GraspTerms& grasp, const Vector6d& V_Bo_dot,
                               const Eigen::Ref<const VectorXd>& sigma_prime) {
  Require(robot.size() == xi_c_.size(), "entries of xi", "must be those of the law's model", robot.size());
  Require(sigma_prime.size() == xi_c_.size(), "length of sigma'", "must be that of xi", sigma_prime.size());
  Require(grasp.num_forces() == f_c_.size(), "number of contact forces", "must be as constructed",
          grasp.num_forces());
  FactorJacobian(weight_, robot, grasp, &J_B_pinv_);

  // xi_c = J^+ G^T V + N xi = xi - J^+ (J xi - G^T V)
  J_B_pinv_.Apply(grasp.slip(), work_);
  xi_c_ = robot.velocity() - work_;

  // xi_dot_d = J^+ (G_dot^T V + G^T V_dot - J_dot xi_c) + N sigma'
  rates_.noalias() = grasp.G().transpose() * V_Bo_dot;
  rates_.noalias() += grasp.G_dot().transpose() * grasp.V_Bo();
  rates_.noalias() -= grasp.J_B_dot() * xi_c_;
  J_B_pinv_.Apply(rates_, xi_dot_d_);
  work_ = sigma_prime;
  J_B_pinv_.Project(work_);
  xi_dot_d_ += work_;
  CalcFreeTorque(robot);
}

void ComputedTorque::SetFreeMotion(const ModelTerms& robot, const Eigen::Ref<const VectorXd>& sigma_prime) {
  Require(robot.size() == xi_c_.size(), "entries of xi", "must be those of the law's model", robot.size());
  Require(sigma_prime.size() == xi_c_.size(), "length of sigma'", "must be that of xi", sigma_prime.size());
  xi_c_ = robot.velocity();
  xi_dot_d_ = sigma_prime;
  CalcFreeTorque(robot);
}

void ComputedTorque::SetForces(const GraspTerms& grasp, const Vector6d& F_o,
                               const Eigen::Ref<const VectorXd>& force,
                               const Eigen::Ref<const VectorXd>& xi_dot_d) {
  Require(force.size() == tau_0_.size() && xi_dot_d.size() == tau_0_.size(), "length of force",
          "must be that of xi", force.size());
  G_pinv_.Factor(grasp.G());
  F_o_ = F_o;
  xi_dot_d_ = xi_dot_d;
  actuation_.CalcTorque(force, tau_0_);
}

void ComputedTorque::CalcFreeTorque(const ModelTerms& robot) {
  // E_bar' tau_0 = M_bar' xi_dot_d + C_bar' xi_c + F_bar'
  tau_0_ = robot.gravity() + robot.friction();
  tau_0_.noalias() += robot.M() * xi_dot_d_;
  tau_0_.noalias() += robot.C() * xi_c_;
  actuation_.CalcTorque(tau_0_, tau_0_);
}

void ComputedTorque::CalcInternalForce(const Eigen::Ref<const VectorXd>& f_c, Eigen::Ref<VectorXd> F_N) {
  G_pinv_.Apply(F_o_, f_c_);
  F_N = f_c - f_c_;
}

const VectorXd& ComputedTorque::CalcTorque(const GraspTerms& grasp, const Eigen::Ref<const VectorXd>& F_N) {
  Require(F_N.size() == f_c_.size(), "length of F_N", "must be that of f_c", F_N.size());
  // f_c = G^+ F_o + F_N
  G_pinv_.Apply(F_o_, f_c_);
  f_c_ += F_N;
  return AddContactTorque(grasp);
}

const VectorXd& ComputedTorque::CalcTorqueWithForces(const GraspTerms& grasp,
                                                     const Eigen::Ref<const VectorXd>& f_c) {
  Require(f_c.size() == f_c_.size(), "length of f_c", "must be as constructed", f_c.size());
  f_c_ = f_c;
  return AddContactTorque(grasp);
}

const VectorXd& ComputedTorque::AddContactTorque(const GraspTerms& grasp) {
  // tau' = tau_0 + E_bar'^-1 J_B'^T f_c
  work_.noalias() = grasp.J_B().transpose() * f_c_;
  actuation_.CalcTorque(work_, work_);
  tau_ = tau_0_ + work_;
  return tau_;
}

PostureTask::PostureTask(const RobotModel& model)
    : q_posture(VectorXd::Zero(model.num_joints())),
      stiffness(VectorXd::Zero(model.num_joints())),
      damping(VectorXd::Zero(model.num_velocities())),
      xi_reference(VectorXd::Zero(model.num_velocities())),
      acceleration(VectorXd::Zero(model.num_velocities())) {}

void PostureTask::CalcAcceleration(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& xi,
                                   Eigen::Ref<VectorXd> sigma_prime) const {
  const Eigen::Index joints = q_posture.size();
  Require(q.size() >= joints, "length of q'", "must include the joints", q.size());
  Require(stiffness.size() == joints, "length of stiffness", "must be that of q_posture", stiffness.size());
  Require(damping.size() == xi.size(), "length of damping", "must be that of xi", damping.size());
  Require(xi_reference.size() == xi.size(), "length of xi_reference", "must be that of xi",
          xi_reference.size());
  Require(acceleration.size() == xi.size(), "length of acceleration", "must be that of xi",
          acceleration.size());
  Require(sigma_prime.size() == xi.size(), "length of sigma'", "must be that of xi", sigma_prime.size());
  sigma_prime = acceleration + damping.cwiseProduct(xi_reference - xi);
  sigma_prime.tail(joints) += stiffness.cwiseProduct(q_posture - q.tail(joints));
}

}  // namespace dexcheck
