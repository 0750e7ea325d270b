#include "harness/checks/law_terms.h"

namespace dexcheck {
namespace {

void ReadModelContacts(const GraspTerms& grasp, const MeasuredState& state, LawTerms* terms) {
  terms->J = grasp.J_B();
  terms->J_dot_xi.noalias() = grasp.J_B_dot() * state.xi;
  terms->G = grasp.G();
  terms->G_dot_T_V.noalias() = grasp.G_dot().transpose() * grasp.V_Bo();
}

void ReadEngineContacts(const EngineProvider& engine, LawTerms* terms) {
  for (size_t i = 0; i < engine.contacts().size(); ++i) {
    const auto row = 3 * static_cast<Eigen::Index>(i);
    const ContactValues& contact = engine.contacts()[i];
    terms->J.middleRows<3>(row) = contact.J_B;
    terms->J_dot_xi.segment<3>(row) = contact.J_B_dot_xi;
    terms->G.middleCols<3>(row) = contact.G;
    terms->G_dot_T_V.segment<3>(row) = contact.G_dot_T_V;
  }
}

}  // namespace

void ReadEngineTerms(const EngineProvider& engine, const GraspModel& model, const MeasuredState& state,
                     bool contacts, LawTerms* terms) {
  terms->q = state.q;
  terms->xi = state.xi;
  terms->C = &model.robot().C();
  terms->J_dot = &model.grasp().J_B_dot();
  if (model.has_coordinates()) terms->X_o = model.grasp().X_o();

  const EngineTerms& robot = engine.terms();
  const double* entry = robot.mass().data();
  for (const MassEntry& at : robot.mass_entries()) terms->M(at.row, at.col) = *entry++;
  terms->C_xi = robot.coriolis();
  terms->gravity = robot.gravity();
  terms->friction = robot.friction();
  const ObjectValues& object = engine.object();
  terms->X_Bo.matrix().topRows<3>() = object.pose;
  terms->V_Bo = object.V_Bo;
  terms->M_hat = object.M_hat;
  terms->C_hat_V = object.C_hat_V;
  terms->N_o = object.N_o;
  if (contacts) {
    ReadEngineContacts(engine, terms);
  } else {
    ReadModelContacts(model.grasp(), state, terms);
  }
}

}  // namespace dexcheck
