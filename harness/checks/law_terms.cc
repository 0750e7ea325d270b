#include "harness/checks/law_terms.h"

namespace dexcheck {

void ReadModelTerms(const GraspModel& model, const MeasuredState& state, LawTerms* terms) {
  const ModelTerms& robot = model.robot();
  const GraspTerms& grasp = model.grasp();
  terms->q = state.q;
  terms->xi = state.xi;
  terms->M = robot.M();
  terms->C = robot.C();
  terms->C_xi.noalias() = robot.C() * state.xi;
  terms->gravity = robot.gravity();
  terms->friction = robot.friction();
  terms->J = grasp.J_B();
  terms->J_dot = grasp.J_B_dot();
  terms->J_dot_xi.noalias() = grasp.J_B_dot() * state.xi;
  terms->G = grasp.G();
  terms->G_dot_T_V.noalias() = grasp.G_dot().transpose() * grasp.V_Bo();
  terms->X_Bo = grasp.X_Bo();
  terms->V_Bo = grasp.V_Bo();
  if (model.has_coordinates()) terms->X_o = grasp.X_o();
  terms->M_hat = grasp.body().M_hat;
  terms->C_hat_V = grasp.body().C_hat * grasp.V_Bo();
  terms->N_o = grasp.body().N_o;
}

void ReadEngineTerms(const TermContext& engine, const GraspModel& model, const MeasuredState& state,
                     bool contacts, LawTerms* terms) {
  ReadModelTerms(model, state, terms);
  const EngineTerms& robot = *engine.engine;
  const std::vector<MassEntry>& entries = robot.mass_entries();
  terms->M.setZero();
  for (size_t i = 0; i < entries.size(); ++i) {
    const double value = robot.mass()[static_cast<Eigen::Index>(i)];
    terms->M(entries[i].row, entries[i].col) = value;
    terms->M(entries[i].col, entries[i].row) = value;
  }
  terms->C_xi = robot.coriolis();
  terms->gravity = robot.gravity();
  terms->friction = robot.friction();
  const ObjectValues& object = engine.object_engine;
  terms->X_Bo.matrix().topRows<3>() = object.pose;
  terms->V_Bo = object.V_Bo;
  terms->M_hat = object.M_hat;
  terms->C_hat_V = object.C_hat_V;
  terms->N_o = object.N_o;
  if (!contacts) return;
  terms->J.setZero();
  for (size_t i = 0; i < engine.contacts.size(); ++i) {
    const auto row = 3 * static_cast<Eigen::Index>(i);
    const ContactValues& contact = engine.contacts[i].engine;
    Eigen::Index k = 0;
    for (const int col : robot.chain(engine.contacts[i].frame))
      terms->J.block<3, 1>(row, col) = contact.J_B.col(k++);
    terms->J_dot_xi.segment<3>(row) = contact.J_B_dot_xi;
    terms->G.middleCols<3>(row) = contact.G;
    terms->G_dot_T_V.segment<3>(row) = contact.G_dot_T_V;
  }
}

}  // namespace dexcheck
