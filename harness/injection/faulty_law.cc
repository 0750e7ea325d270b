#include "harness/injection/faulty_law.h"

#include <cmath>
#include <string_view>
#include <utility>

#include "controller/common/text.h"
#include "controller/control/trajectory_controller.h"
#include "controller/object/so3.h"

namespace dexcheck {
namespace {

constexpr double kSlight = 1.001;  // factor of a part that is a thousandth too large

size_t PartNamed(std::string_view name) {
  const std::span<const LawPartName> parts = ListLawParts();
  for (size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].name == name) return i;
  }
  throw std::invalid_argument("no part of the law is called " + std::string(name));
}

/// Numbers of the parts, looked up once.
struct Parts {
  size_t feed_forward = PartNamed("feed-forward acceleration");
  size_t velocity = PartNamed("velocity feedback K_v");
  size_t position = PartNamed("position feedback K_p");
  size_t both = PartNamed("feedback of both gains");
  size_t rate = PartNamed("rate of P^-1");
  size_t demand = PartNamed("demanded acceleration V_o_dot");
  size_t G_dot = PartNamed("G_dot");
  size_t J_dot = PartNamed("J_dot");
  size_t sigma = PartNamed("null-space acceleration sigma'");
  size_t carried = PartNamed("acceleration without the null space");
  size_t M = PartNamed("mass matrix M_bar'");
  size_t C = PartNamed("Coriolis forces C_bar'");
  size_t gravity = PartNamed("gravity");
  size_t friction = PartNamed("friction");
  size_t F = PartNamed("gravity and friction F_bar'");
  size_t M_o = PartNamed("object's inertia M_o");
  size_t C_o = PartNamed("object's C_o");
  size_t N_o = PartNamed("object's gravity N_o");
  size_t F_N = PartNamed("internal force F_N");
  size_t F_o = PartNamed("object's wrench G^+ F_o");
  size_t f_c = PartNamed("contact forces J_B'^T f_c");
  size_t tau = PartNamed("all torques");
};

const Parts& AllParts() {
  static const Parts parts;
  return parts;
}

constexpr std::pair<LawFaultKind, const char*> kKinds[] = {
    {LawFaultKind::kNotProjected, "sigma' is not projected into the null space"},
    {LawFaultKind::kOtherWeight, "another weight W of the pseudoinverse"},
    {LawFaultKind::kGraspTransposed, "G^T in the place of G^+"},
    {LawFaultKind::kCoriolisTransposed, "C_bar' transposed"},
    {LawFaultKind::kNoActuationMap, "no E_bar' between forces and torques"},
    {LawFaultKind::kWheelsExchanged, "the wheels' torques exchanged"},
    {LawFaultKind::kJointsExchanged, "two joints' torques exchanged"},
    {LawFaultKind::kForceAxes, "the contact frames' x and y exchanged"},
    {LawFaultKind::kLate, "X_d of a time step before"},
    {LawFaultKind::kVelocityOfNow, "X_d_dot half a time step too late"},
    {LawFaultKind::kOneGain, "K_p of x times 1.01"},
    {LawFaultKind::kWideCone, "the friction counted on times 1.1"},
    {LawFaultKind::kLessPreload, "f_min halved"},
    {LawFaultKind::kOtherBarrier, "the barrier's weight times 1.1"},
};

GraspControllerOptions ChangeOptions(GraspControllerOptions options, LawFaultKind kind) {
  if (kind == LawFaultKind::kWideCone) options.mu *= 1.1;
  if (kind == LawFaultKind::kLessPreload) options.f_min *= 0.5;
  if (kind == LawFaultKind::kOtherBarrier) options.force.barrier_weight *= 1.1;
  return options;
}

}  // namespace

std::vector<LawFault> ListLawFaults(bool has_wheels) {
  std::vector<LawFault> faults;
  const std::span<const LawPartName> parts = ListLawParts();
  for (size_t i = 0; i < parts.size(); ++i) {
    for (const double factor : {kSlight, 0.0}) {
      const std::string how = factor == 0.0 ? " left out" : " times " + FormatNumber(factor);
      faults.push_back({parts[i].name + how, i, factor});
    }
  }
  faults.push_back({"gravity in F_bar' upside down", AllParts().gravity, -1.0});
  for (const auto& [kind, name] : kKinds) {
    const bool of_wheels = kind == LawFaultKind::kWheelsExchanged || kind == LawFaultKind::kNoActuationMap;
    if (has_wheels || !of_wheels) faults.push_back({name, SIZE_MAX, 1.0, kind});
  }
  return faults;
}

FaultyLaw::FaultyLaw(const Setup& setup, LawFault fault, std::function<bool()> is_on)
    : options_(ChangeOptions(setup.MakeControllerOptions(), fault.kind)),
      fault_(std::move(fault)),
      is_on_(is_on ? std::move(is_on) : [this] { return has_begun_; }),
      model_(setup.model(), setup.fingertips(), setup.object().body, setup.surface(), options_),
      actuation_(setup.model()),
      J_pinv_("J_B'", 3 * static_cast<Eigen::Index>(setup.fingertips().size()),
              setup.model().num_velocities()),
      G_pinv_("G", 6, 3 * static_cast<Eigen::Index>(setup.fingertips().size())),
      problem_(static_cast<int>(setup.fingertips().size())),
      solver_(static_cast<int>(setup.fingertips().size()), options_.force),
      time_step_(setup.scenario().plant.time_step),
      hold_(std::max(1L, std::lround(setup.scenario().plant.control_step / time_step_))) {
  problem_.mu.setConstant(options_.mu);
  problem_.f_min.setConstant(options_.f_min);
  problem_.f_max.setConstant(options_.f_max);
  const Eigen::Index n = setup.model().num_velocities();
  const Eigen::Index k = 3 * static_cast<Eigen::Index>(setup.fingertips().size());
  for (VectorXd* vector : {&xi_c_, &xi_dot_d_, &sigma_prime_, &force_, &work_}) vector->setZero(n);
  for (VectorXd* vector : {&f_c_, &F_N_, &rates_}) vector->setZero(k);
  exchanged_ = model_.grasp().moving_entries().back();
}

void FaultyLaw::Follow(const Trajectory& motion) {
  motion_ = &motion;
  steps_until_due_ = 0;
}

void FaultyLaw::Begin(double /*t*/, const Reading& /*reading*/) { has_begun_ = true; }

void FaultyLaw::Step(const Reading& reading, double t, Command* command) {
  TrajectoryController::BeginCommand(*motion_, t, time_step_, command);
  model_.SetState(reading.state);
  if (is_on_() && change_) FaultyTerms(&model_, reading.state).Make(*change_);
  if (steps_until_due_ > 0) {
    --steps_until_due_;
    return;
  }
  steps_until_due_ = hold_ - 1;
  CalcTorque(reading.state, t, command);
  command->force_solves = 1;
}

void FaultyLaw::CalcTorque(const MeasuredState& state, double t, Command* command) {
  is_wrong_ = is_on_() && fault_.entries.empty();
  CalcTorque(state, t, /*chooses=*/true, command);
  if (!is_on_() || fault_.entries.empty()) return;
  // The fault is in some entries alone, with the internal force of all others.
  right_ = command->tau;
  is_wrong_ = true;
  CalcTorque(state, t, /*chooses=*/false, command);
  for (const Eigen::Index entry : fault_.entries) right_[entry] = command->tau[entry];
  command->tau = right_;
}

void FaultyLaw::CalcTorque(const MeasuredState& state, double t, bool chooses, Command* command) {
  DesiredMotion desired = command->desired;
  if (Has(LawFaultKind::kLate)) {
    desired = TrajectoryController::EvaluateDesired(*motion_, t - time_step_, time_step_);
  } else if (Has(LawFaultKind::kVelocityOfNow)) {
    desired.X_d_dot = motion_->Evaluate(t).X_d_dot;
  }
  const Vector6d V_Bo_dot = factor(AllParts().demand) * CalcObjectAcceleration(desired);
  FactorJacobian();
  SetMotion(state, V_Bo_dot);
  SolveForces(V_Bo_dot, chooses);
  SendTorques(command);
  command->demand.V_Bo_dot = V_Bo_dot;
  command->demand.xi_dot = xi_dot_d_;
  command->demand.f_c = f_c_;
  command->demand.F_N = F_N_;
}

Vector6d FaultyLaw::CalcObjectAcceleration(const DesiredMotion& desired) const {
  const Parts& part = AllParts();
  const GraspTerms& grasp = model_.grasp();
  const double feed = factor(part.feed_forward);
  const double rate = factor(part.rate);
  Vector6d K_v = factor(part.both) * factor(part.velocity) * options_.gains.K_v;
  Vector6d K_p = factor(part.both) * factor(part.position) * options_.gains.K_p;
  if (Has(LawFaultKind::kOneGain)) K_p[0] *= 1.01;
  if (options_.orientation == OrientationFeedback::kAngles) {
    // V_dot = P^-1 (X_d_ddot + K_v E_dot + K_p E) + d/dt(P^-1) X_o_dot
    const Vector6d X_o_ddot = feed * desired.X_d_ddot + K_v.cwiseProduct(desired.X_d_dot - grasp.X_o_dot()) +
                              K_p.cwiseProduct(desired.X_d - grasp.X_o());
    return grasp.coordinates().P_inv * X_o_ddot + rate * (grasp.coordinates().P_inv_dot * grasp.X_o_dot());
  }
  const DesiredPose pose = CalcDesiredPose(desired);
  const Matrix3d R = grasp.X_Bo().linear();
  const Vector3d v = grasp.V_Bo().head<3>();
  const Vector3d omega = grasp.V_Bo().tail<3>();
  const Vector3d p_ddot = feed * pose.p_Bd_ddot + K_v.head<3>().cwiseProduct(pose.p_Bd_dot - R * v) +
                          K_p.head<3>().cwiseProduct(pose.p_Bd - grasp.X_Bo().translation());
  const OrientationError error = CalcOrientationError(R, omega, pose.R_Bd, pose.omega_d);
  const Vector3d e_R_ddot =
      -K_v.tail<3>().cwiseProduct(error.e_R_dot) - K_p.tail<3>().cwiseProduct(error.e_R);
  // omega_dot is affine in omega_d_dot and e_R_ddot; what is left without both are the rates' products.
  const Vector3d bias = CalcAngularAcceleration(error, pose.omega_d, Vector3d::Zero(), Vector3d::Zero());
  const Vector3d whole = CalcAngularAcceleration(error, pose.omega_d, feed * pose.omega_d_dot, e_R_ddot);
  Vector6d V_dot;
  V_dot << R.transpose() * p_ddot - rate * omega.cross(v), whole + (rate - 1.0) * bias;
  return V_dot;
}

void FaultyLaw::FactorJacobian() {
  const MatrixXd& J = model_.grasp().J_B();
  RedundancyWeight::Kind kind = options_.weight.kind;
  if (Has(LawFaultKind::kOtherWeight)) {
    kind = kind == RedundancyWeight::Kind::kMass ? RedundancyWeight::Kind::kIdentity
                                                 : RedundancyWeight::Kind::kMass;
  }
  if (kind == RedundancyWeight::Kind::kIdentity) return J_pinv_.Factor(J);
  if (kind == RedundancyWeight::Kind::kDiagonal) return J_pinv_.FactorDiagonal(J, options_.weight.w);
  J_pinv_.FactorWeighted(J, model_.robot().M());
}

void FaultyLaw::SetMotion(const MeasuredState& state, const Vector6d& V_Bo_dot) {
  const Parts& part = AllParts();
  const ModelTerms& robot = model_.robot();
  const GraspTerms& grasp = model_.grasp();
  // xi_c = xi - J^+ (J xi - G^T V)
  J_pinv_.Apply(grasp.slip(), work_);
  xi_c_ = robot.velocity() - work_;
  // xi_dot_d = J^+ (G_dot^T V + G^T V_dot - J_dot xi_c) + N sigma'
  rates_.noalias() = grasp.G().transpose() * V_Bo_dot;
  rates_.noalias() += factor(part.G_dot) * (grasp.G_dot().transpose() * grasp.V_Bo());
  rates_.noalias() -= factor(part.J_dot) * (grasp.J_B_dot() * xi_c_);
  J_pinv_.Apply(rates_, xi_dot_d_);
  xi_dot_d_ *= factor(part.carried);
  options_.posture.CalcAcceleration(state.q, state.xi, sigma_prime_);
  if (!Has(LawFaultKind::kNotProjected)) J_pinv_.Project(sigma_prime_);
  xi_dot_d_ += factor(part.sigma) * sigma_prime_;
}

void FaultyLaw::SolveForces(const Vector6d& V_Bo_dot, bool chooses) {
  const Parts& part = AllParts();
  const GraspTerms& grasp = model_.grasp();
  const ObjectBodyTerms& body = grasp.body();
  G_pinv_.Factor(grasp.G());
  // F_o = M_hat V_dot + C_hat V + N_o
  F_o_ = factor(part.F_o) * (factor(part.M_o) * (body.M_hat * V_Bo_dot) +
                             factor(part.C_o) * (body.C_hat * grasp.V_Bo()) + factor(part.N_o) * body.N_o);
  G_pinv_.Apply(F_o_, f_c_);
  if (chooses) {
    problem_.G = grasp.G();
    problem_.F_o = F_o_;
    const GraspForceResult& result = solver_.Solve(problem_);
    RequireGraspForce(result);
    // F_N = f_c - G^+ F_o
    F_N_ = result.f_c - f_c_;
  }
  if (Has(LawFaultKind::kGraspTransposed)) f_c_.noalias() = grasp.G().transpose() * F_o_;
  f_c_ += factor(part.F_N) * F_N_;
  if (!Has(LawFaultKind::kForceAxes)) return;
  for (Eigen::Index i = 0; i < f_c_.size(); i += 3) std::swap(f_c_[i], f_c_[i + 1]);
}

void FaultyLaw::SendTorques(Command* command) {
  const Parts& part = AllParts();
  const ModelTerms& robot = model_.robot();
  // E_bar' tau' = M_bar' xi_dot_d + C_bar' xi_c + F_bar' + J^T f_c
  force_ =
      factor(part.F) * (factor(part.gravity) * robot.gravity() + factor(part.friction) * robot.friction());
  force_.noalias() += factor(part.M) * (robot.M() * xi_dot_d_);
  if (Has(LawFaultKind::kCoriolisTransposed)) {
    force_.noalias() += robot.C().transpose() * xi_c_;
  } else {
    force_.noalias() += factor(part.C) * (robot.C() * xi_c_);
  }
  force_.noalias() += factor(part.f_c) * (model_.grasp().J_B().transpose() * f_c_);
  force_ *= factor(part.tau);
  if (!Has(LawFaultKind::kNoActuationMap)) actuation_.CalcTorque(force_, force_);
  if (Has(LawFaultKind::kWheelsExchanged)) std::swap(force_[0], force_[1]);
  if (Has(LawFaultKind::kJointsExchanged)) std::swap(force_[exchanged_ - 1], force_[exchanged_]);
  command->tau = force_;
}

}  // namespace dexcheck
