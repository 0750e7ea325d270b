#include "harness/cli/eval_law.h"

#include <string>

#include "controller/control/grasp_controller.h"
#include "controller/object/euler_zyz.h"

namespace dexcheck::cli {
namespace {

Json CalcLaw(const ModelTerms& terms, const State& state, const Surface& surface,
             std::span<const ContactCoordinates> kappa) {
  const RobotModel& model = terms.model();
  const LawState& wanted = *state.law;
  const ContactState& contacts = *state.contacts;
  const int count = static_cast<int>(contacts.fingertips.size());
  GraspTerms grasp(model, contacts.fingertips, model.object()->body, surface);
  grasp.SetState(terms, state.object->X_o, state.object->X_o_dot, kappa);
  DesiredMotion desired;
  desired.X_d = wanted.X_d;
  desired.X_d_dot = wanted.X_d_dot;
  desired.X_d_ddot = wanted.X_d_ddot;
  const Vector6d V_o_dot = CalcTrackingAcceleration({wanted.K_v, wanted.K_p}, grasp, desired);

  ComputedTorque law(model, count);
  law.SetDemand(terms, grasp, V_o_dot, wanted.sigma_prime);
  GraspForceProblem problem(count);
  problem.G = grasp.G();
  problem.F_o = law.F_o();
  problem.mu.setConstant(contacts.friction);
  problem.f_min.setConstant(wanted.f_min);
  problem.f_max.setConstant(wanted.f_max);
  GraspForceSolver solver(count);
  const GraspForceResult& force = solver.Solve(problem);
  RequireGraspForce(force);
  VectorXd F_N(grasp.num_forces());
  law.CalcInternalForce(force.f_c, F_N);
  const VectorXd tau = law.CalcTorque(grasp, F_N);

  Pseudoinverse J_B("J_B'", grasp.num_forces(), terms.size());
  J_B.Factor(grasp.J_B());
  Pseudoinverse G("G", 6, grasp.num_forces());
  G.Factor(grasp.G());
  const MatrixXd J_B_pinv = J_B.CalcMatrix();
  const ObjectTerms& object = grasp.coordinates();
  // (56): M_bar' J_B'^+ G^T P^-1 + J_B'^T G^+ M_o
  const MatrixXd A = terms.M() * J_B_pinv * grasp.G().transpose() * object.P_inv +
                     grasp.J_B().transpose() * G.CalcMatrix() * object.M_o;
  return {{"J_B_pinv", ToRows(J_B_pinv)},
          {"N", ToRows(J_B.CalcProjector())},
          {"xi_c", ToList(law.xi_c())},
          {"V_o_dot", ToList(V_o_dot)},
          {"xi_dot_d", ToList(law.xi_dot_d())},
          {"F_o", ToList(law.F_o())},
          {"F_N", ToList(F_N)},
          {"f_c", ToList(law.f_c())},
          {"tau", ToList(tau)},
          {"A", ToRows(A)}};
}

}  // namespace

void AddLawTerms(const ModelTerms& terms, const State& state, const Surface& surface,
                 std::span<const ContactCoordinates> kappa, Json* out) {
  try {
    (*out)["law"] = CalcLaw(terms, state, surface, kappa);
  } catch (const InputError&) {
    throw;
  } catch (const Error& error) {
    throw InputError(std::string("law: ") + error.what());
  }
}

}  // namespace dexcheck::cli
