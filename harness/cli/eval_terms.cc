#include "harness/cli/eval_terms.h"

#include <string>

#include "controller/common/errors.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/platform.h"
#include "controller/object/euler_zyz.h"
#include "controller/object/object_dynamics.h"
#include "harness/cli/eval_contacts.h"
#include "harness/cli/json_matrix.h"
#include "harness/descriptions/base_convention.h"
#include "harness/engine/engine_terms.h"

namespace dexcheck::cli {
namespace {

/// What model and engine have alike.
struct Forces {
  VectorXd C_bar_xi;
  VectorXd gravity;
  VectorXd friction;
};

void AddForces(const Forces& forces, Json* out) {
  const VectorXd F_bar = forces.gravity + forces.friction;
  (*out)["C_bar_xi"] = ToList(forces.C_bar_xi);
  (*out)["gravity"] = ToList(forces.gravity);
  (*out)["friction"] = ToList(forces.friction);
  (*out)["F_bar"] = ToList(F_bar);
  (*out)["bias"] = ToList(forces.C_bar_xi + F_bar);
}

void AddEnergyAndMomentum(const EnergyAndMomentum& energy, Json* out) {
  (*out)["kinetic_energy"] = energy.kinetic;
  (*out)["potential_energy"] = energy.potential;
  (*out)["linear_momentum"] = ToList(energy.linear_momentum);
  (*out)["angular_momentum"] = ToList(energy.angular_momentum);
}

/// `describe(frame)` gives a frame's pose and Jacobian.
template <typename Describe>
void AddFrames(const RobotModel& model, const Describe& describe, Json* out) {
  Json frames = Json::object();
  Json tips = Json::array();
  for (size_t i = 0; i < model.frames().size(); ++i) {
    const Json& frame = frames[model.frames()[i].name] = describe(static_cast<int>(i));
    if (model.frames()[i].sphere_radius) tips.push_back(frame.at("pose"));
  }
  (*out)["fingertip_pose"] = tips;
  (*out)["frames"] = frames;
}

void AddReducedTerms(const ModelTerms& terms, const VectorXd& xi, Json* out) {
  (*out)["M_bar"] = ToRows(terms.M());
  (*out)["C_bar"] = ToRows(terms.C());
  AddForces({terms.C() * xi, terms.gravity(), terms.friction()}, out);
  AddEnergyAndMomentum(terms.CalcEnergyAndMomentum(), out);
  Matrix6Xd J(6, terms.size());
  Matrix6Xd J_dot(6, terms.size());
  const auto describe = [&](int frame) {
    terms.CalcFrameJacobian(frame, J, J_dot);
    return Json{{"pose", ToRows(terms.CalcFramePose(frame).matrix())},
                {"J_f", ToRows(J)},
                {"J_f_dot", ToRows(J_dot)},
                {"J_f_dot_xi", ToList(J_dot * xi)}};
  };
  AddFrames(terms.model(), describe, out);
}

/// M, C and F of (16), and for a differential drive the matrices of (2), (12), (13), (15), (17).
void AddUnreducedTerms(const RobotModel& model, const State& state, Json* out) {
  VectorXd q_dot = state.xi;
  if (model.base().type == BaseType::kDifferentialDrive) {
    const Vector2d v = state.xi.head<2>();
    const PlatformConstraint platform = CalcPlatformConstraint(model.base(), state.q.head<3>(), v);
    q_dot.resize(model.num_unreduced_base_velocities() + model.num_dofs());
    q_dot << platform.S_v * v, state.xi.tail(model.num_dofs());
    (*out)["A_v"] = ToRows(platform.A_v);
    (*out)["S_v"] = ToRows(platform.S_v);
    (*out)["S_v_dot"] = ToRows(platform.S_v_dot);
    (*out)["E_v"] = ToRows(platform.E_v);
    (*out)["S_v_T_E_v"] = ToRows(platform.S_v_T_E_v);
  }
  ModelTerms terms(model, Coordinates::kUnreduced);
  terms.SetState(state.q, q_dot);
  terms.CalcDynamics();
  (*out)["M"] = ToRows(terms.M());
  (*out)["C"] = ToRows(terms.C());
  (*out)["F"] = ToList(terms.gravity() + terms.friction());
}

/// What Pinocchio has at the same state of a floating base: [x y z, qx qy qz qw], the origin's velocity in
/// the base's axes.
void AddPinocchioTerms(const ModelTerms& terms, const State& state, Json* out) {
  BaseConvention convention;
  convention.position = BaseConvention::Position::kXyzXyzw;
  convention.linear_in_base = true;
  const BaseConversion conversion(convention);
  SideTerms converted;
  converted.M = terms.M();
  converted.gravity = terms.gravity();
  converted.bias = terms.C() * state.xi + terms.gravity();
  conversion.Apply(state.q, state.xi, &converted);
  (*out)["pinocchio"] = {{"q", ToList(conversion.ConvertPositions(state.q))},
                         {"v", ToList(conversion.ConvertVelocities(state.q, state.xi))},
                         {"M", ToRows(converted.M)},
                         {"g", ToList(converted.gravity)},
                         {"nle", ToList(converted.bias)}};
}

void AddObjectTerms(const RobotModel& model, const ObjectState& object, Json* out) {
  const ObjectTerms terms =
      CalcObjectTerms(model.object()->body, model.gravity(), object.X_o, object.X_o_dot);
  (*out)["P"] = ToRows(CalcP(object.X_o));
  (*out)["P_inv"] = ToRows(terms.P_inv);
  (*out)["P_inv_dot"] = ToRows(terms.P_inv_dot);
  (*out)["V_o"] = ToList(terms.V_Bo);
  (*out)["M_o"] = ToRows(terms.M_o);
  (*out)["C_o"] = ToRows(terms.C_o);
  (*out)["N_o"] = ToList(terms.N_o);
}

}  // namespace

void AddModelTerms(const RobotModel& model, const State& state, Json* out) {
  ModelTerms terms(model, Coordinates::kReduced);
  terms.SetState(state.q, state.xi);
  terms.CalcDynamics();
  AddReducedTerms(terms, state.xi, out);
  AddUnreducedTerms(model, state, out);
  if (model.base().type == BaseType::kFloating) AddPinocchioTerms(terms, state, out);
  try {
    if (state.object) AddObjectTerms(model, *state.object, out);
  } catch (const SingularityError& error) {
    throw InputError(std::string("object.X_o: ") + error.what());
  }
  if (state.contacts) AddContactTerms(terms, state, out);
}

Json EvaluateEngineTerms(const Adapter& adapter, const State& state) {
  EngineTerms terms(adapter, Coordinates::kReduced);
  terms.SetState(state.q, state.xi);
  Json out = Json::object();
  out["M_bar"] = ToRows(terms.M());
  AddForces({terms.coriolis(), terms.gravity(), terms.friction()}, &out);
  AddEnergyAndMomentum(terms.energy_and_momentum(), &out);
  const auto describe = [&](int frame) {
    const Pose X = terms.FramePose(frame);
    Matrix6Xd J = terms.CalcFrameJacobian(frame);
    const EngineMotion motion = terms.FrameMotion(frame);
    // From world axes to the frame's own: J_f = R^T J,  d/dt (R^T v) = R^T v_dot - omega_f x v_f
    const Matrix3d R_T = X.linear().transpose();
    J.topRows<3>() = R_T * J.topRows<3>();
    J.bottomRows<3>() = R_T * J.bottomRows<3>();
    const Vector6d V = J * state.xi;
    Vector6d bias;
    bias << R_T * motion.a - V.tail<3>().cross(V.head<3>()), R_T * motion.alpha;
    return Json{{"pose", ToRows(X.matrix())}, {"J_f", ToRows(J)}, {"J_f_dot_xi", ToList(bias)}};
  };
  AddFrames(adapter.model(), describe, &out);
  return out;
}

}  // namespace dexcheck::cli
