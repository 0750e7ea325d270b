#include "harness/checks/law_inputs.h"

#include <algorithm>
#include <utility>

namespace dexcheck {
namespace {

void NoFeedForward(LawInputs* in) { in->now.desired.X_d_ddot.setZero(); }
void NoVelocity(LawInputs* in) { in->spec->velocity_factor.setZero(); }
void NoPosition(LawInputs* in) { in->spec->position_factor.setZero(); }
void NoRate(LawInputs* in) { in->spec->rate_factor = 0.0; }
void NoFeedback(LawInputs* in) {
  NoVelocity(in);
  NoPosition(in);
}
void NoDemand(LawInputs* in) {
  NoFeedForward(in);
  NoFeedback(in);
  NoRate(in);
}
void NoPosture(LawInputs* in) {
  for (VectorXd* vector :
       {&in->spec->posture.acceleration, &in->spec->posture.damping, &in->spec->posture.stiffness})
    vector->setZero();
}
void NoCoriolis(LawInputs* in) {
  in->terms.C_xi.setZero();
  in->C.setZero();
}
void NoGravity(LawInputs* in) { in->terms.gravity.setZero(); }
void NoFriction(LawInputs* in) { in->terms.friction.setZero(); }
void NoObject(LawInputs* in) {
  in->terms.M_hat.setZero();
  in->terms.C_hat_V.setZero();
  in->terms.N_o.setZero();
}
void DoubleMass(LawInputs* in) { in->M *= 2.0; }

constexpr unsigned Bits(int first, int last) { return (1U << (last + 1)) - (1U << first); }
constexpr unsigned kFeedForward = 1U | 1U << 10, kVelocity = 2U | 1U << 11, kPosition = 4U | 1U << 12,
                   kRate = 8U | 1U << 13, kInertia = Bits(0, 6), kObjectInertia = Bits(10, 13),
                   kObject = Bits(10, 15);

constexpr LawPartName kObjectParts[] = {
    {"(M_bar' J^+ G^T + J^T G^+ M_hat) P^-1 X_d_ddot", "feed-forward acceleration", kFeedForward,
     NoFeedForward},
    {"(M_bar' J^+ G^T + J^T G^+ M_hat) P^-1 K_v E_dot", "velocity feedback K_v", kVelocity, NoVelocity},
    {"(M_bar' J^+ G^T + J^T G^+ M_hat) P^-1 K_p E", "position feedback K_p", kPosition, NoPosition},
    {"(M_bar' J^+ G^T + J^T G^+ M_hat) d/dt(P^-1) X_o_dot", "rate of P^-1", kRate, NoRate, false, true},
    {"M_bar' J^+ G_dot^T V_o", "G_dot", 1U << 4, [](LawInputs* in) { in->terms.G_dot_T_V.setZero(); }, false,
     true},
    {"M_bar' J^+ J_dot xi_c", "J_dot", 1U << 5,
     [](LawInputs* in) {
       in->terms.J_dot_xi.setZero();
       in->J_dot.setZero();
     },
     false, true},
    {"M_bar' N sigma'", "null-space acceleration sigma'", 1U << 6, NoPosture},
    {"C_bar' xi_c", "Coriolis forces C_bar'", 1U << 7, NoCoriolis},
    {"F_bar' (gravity)", "gravity", 1U << 8, NoGravity},
    {"F_bar' (friction)", "friction term", 1U << 9, NoFriction},
    {"J^T G^+ M_hat V_o_dot", "object's inertia M_o", kObjectInertia,
     [](LawInputs* in) { in->terms.M_hat.setZero(); }, false, true},
    {"J^T G^+ C_hat V_o", "object's C_o", 1U << 14, [](LawInputs* in) { in->terms.C_hat_V.setZero(); }},
    {"J^T G^+ N_o", "object's gravity N_o", 1U << 15, [](LawInputs* in) { in->terms.N_o.setZero(); }},
    {"J^T F_N", "internal force F_N", 1U << 16, [](LawInputs* in) { in->F_N.setZero(); }},
    {"M_bar' xi_dot_d", "mass matrix M_bar'", kInertia, DoubleMass, true, true},
    {"M_bar' J^+ (...)", "acceleration without the null space", kInertia & ~(1U << 6), DoubleMass, true, true,
     NoPosture},
    {"(M_bar' J^+ G^T + J^T G^+ M_hat) V_o_dot", "demanded acceleration V_o_dot",
     kFeedForward | kVelocity | kPosition | kRate, NoDemand, false, true},
    {"(M_bar' J^+ G^T + J^T G^+ M_hat) P^-1 (K_v E_dot + K_p E)", "feedback of both gains",
     kVelocity | kPosition, NoFeedback},
    {"F_bar'", "gravity and friction F_bar'", Bits(8, 9),
     [](LawInputs* in) {
       NoGravity(in);
       NoFriction(in);
     }},
    {"J^T G^+ F_o", "object's wrench G^+ F_o", kObject, NoObject, false, true},
    {"J^T f_c", "contact forces J_B'^T f_c", kObject | 1U << 16,
     [](LawInputs* in) {
       NoObject(in);
       in->F_N.setZero();
     },
     false, true},
    {"tau'", "all torques", Bits(0, 16), nullptr},
};

constexpr LawPartName kJointParts[] = {
    {"M_bar' q_d_ddot", "feed-forward acceleration", 1U,
     [](LawInputs* in) { in->now.joints.q_ddot.setZero(); }},
    {"K_v e_dot", "velocity feedback", 2U, [](LawInputs* in) { in->velocity_error.setZero(); }},
    {"K_p e", "position feedback", 4U, [](LawInputs* in) { in->now.position_error.setZero(); }},
    {"C_bar' q_dot", "Coriolis forces", 8U, NoCoriolis},
    {"F_bar' (gravity)", "gravity", 16U, NoGravity},
    {"F_bar' (friction)", "friction term", 32U, NoFriction},
    {"coulomb tanh(q_d_dot / coulomb_velocity)", "compensation of Coulomb friction", 64U,
     [](LawInputs* in) { in->coulomb.setZero(); }},
    {"viscous q_d_dot", "compensation of viscous friction", 128U,
     [](LawInputs* in) { in->viscous.setZero(); }},
    {"K_v e_dot + K_p e", "feedback of both gains", 6U,
     [](LawInputs* in) {
       in->velocity_error.setZero();
       in->now.position_error.setZero();
     }},
    {"M_bar' (q_d_ddot + K_v e_dot + K_p e)", "mass matrix M_bar'", 7U, DoubleMass, true, true},
    {"F_bar'", "gravity and friction", 48U,
     [](LawInputs* in) {
       NoGravity(in);
       NoFriction(in);
     }},
    {"tau_f", "compensation of friction", 192U,
     [](LawInputs* in) {
       in->coulomb.setZero();
       in->viscous.setZero();
     }},
    {"tau'", "all torques", 255U, nullptr}};

}  // namespace

std::span<const LawPartName> ListLawParts() { return kObjectParts; }
std::span<const LawPartName> ListJointLawParts() { return kJointParts; }

void LawHistory::Keep(LawSnapshot snapshot) {
  ++differing_;
  for (size_t k = 1; k <= std::min(remembered_, kMemory); ++k)
    snapshot.before.push_back(ring_[(remembered_ - k) % kMemory]);
  snapshot.error_sum = error_sum_;
  if (remembered_ == 0) snapshot.error_sum.setZero(snapshot.inputs.now.position_error.size());
  if (snapshots_.size() == kMost) {
    stride_ *= 2;
    for (size_t i = kFirst + 1; i < snapshots_.size(); ++i)
      snapshots_.erase(snapshots_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  snapshots_.push_back(std::move(snapshot));
}

void LawHistory::Remember(const LawStep& state, double step_time) {
  if (ring_.empty()) ring_.resize(kMemory, state);
  const bool follows = remembered_ > 0 && std::abs(state.time - ring_[(remembered_ - 1) % kMemory].time -
                                                   step_time) < 0.5 * step_time;
  if (!follows) {
    remembered_ = 0;
    error_sum_.setZero(state.position_error.size());
  }
  ring_[remembered_++ % kMemory] = state;
  error_sum_ += step_time * state.position_error;
}

void LawHistory::Forget() {
  snapshots_.clear();
  differing_ = 0;
  stride_ = 1;
}

}  // namespace dexcheck
