#include "harness/checks/step_model_check.h"

#include "controller/object/object_dynamics.h"

namespace dexcheck {

StepModelCheck::StepModelCheck(const Adapter& adapter, std::span<const int> fingertips,
                               OrientationFeedback orientation)
    : TermComparison(adapter),
      has_coordinates_(orientation == OrientationFeedback::kAngles),
      engine_(adapter, fingertips) {
  context_.engine = &engine_;
  SetFrames(fingertips, /*contacts=*/true);
  J_B_dot_xi_.setZero(3 * static_cast<Eigen::Index>(fingertips.size()));
  context_.xi.setZero(engine_.size());
  constexpr TermGroup kCoordinates[] = {TermGroup::kObjectCoordinates};
  Ask(kAskedByRun, has_coordinates_ ? std::span<const TermGroup>() : kCoordinates);
}

void StepModelCheck::Merge(const StepModelCheck& other) {
  for (size_t i = 0; i < records_.size(); ++i) {
    if (other.records_[i].applies) records_[i].Merge(other.records_[i]);
  }
}

void StepModelCheck::LeaveOutContacts() {
  with_contacts_ = false;
  for (size_t i = 0; i < records_.size(); ++i) records_[i].applies = !IsOfContacts(i);
}

void StepModelCheck::Compare(const ModelTerms& robot, const GraspTerms& grasp, const MeasuredState& state,
                             const Pose& X_W0, double when) {
  engine_.SetState(state.q, state.xi, state.X_Bo, state.V_Bo);
  EvaluateFrames();
  scales_.SetState(robot, state.q, state.xi);
  const ModelView view(robot);
  context_.robot = &view;
  context_.xi = state.xi;
  context_.energy = robot.CalcEnergyAndMomentum();
  for (size_t i = 0; i < context_.jacobians.size(); ++i) {
    const auto finger = static_cast<int>(i);
    context_.jacobians[i] = {&grasp.J_f(finger), &grasp.J_f_dot(finger)};
  }
  if (with_contacts_) ReadContacts(grasp, state, X_W0);
  ReadObject(grasp);
  TermComparison::Compare(when, with_contacts_);
}

void StepModelCheck::ReadContacts(const GraspTerms& grasp, const MeasuredState& state, const Pose& X_W0) {
  const Pose shift = X_W0 * engine_.BasePose().inverse(Eigen::Isometry);
  J_B_dot_xi_.noalias() = grasp.J_B_dot() * state.xi;
  context_.J_B = &grasp.J_B();
  for (size_t i = 0; i < context_.contacts.size(); ++i) {
    const auto row = 3 * static_cast<Eigen::Index>(i);
    ContactValues& model = context_.contacts[i].model;
    model.frame[ContactValues::kOverlap] = state.overlap[i];
    model.G = grasp.G().middleCols<3>(row);
    Eigen::Index k = 0;
    for (const int col : engine_.chain(context_.frames[i]))
      model.J_B.col(k++) = grasp.J_B().block<3, 1>(row, col);
    model.J_B_dot_xi = J_B_dot_xi_.segment<3>(row);
    model.G_dot_T_V = grasp.G_dot().middleCols<3>(row).transpose() * grasp.V_Bo();
    EvaluateContact(grasp.contacts()[i], shift, i, &context_);
  }
}

void StepModelCheck::ReadObject(const GraspTerms& grasp) {
  const MassProperties& body = grasp.object();
  const Vector6d& V_Bo = grasp.V_Bo();
  ObjectValues& model = context_.object_model;
  model.pose = grasp.X_Bo().matrix().topRows<3>();
  model.V_Bo = V_Bo;
  model.M_hat = grasp.body().M_hat;
  model.C_hat_V = grasp.body().C_hat * V_Bo;
  model.N_o = grasp.body().N_o;
  model.kinetic = CalcObjectKineticEnergy(body, V_Bo);
  model.potential = CalcObjectPotentialEnergy(body, grasp.gravity(), grasp.X_Bo().translation());
  if (!has_coordinates_) return EvaluateObject(body, grasp.gravity(), nullptr, &context_);
  const ObjectTerms& terms = grasp.coordinates();
  model.M_o = terms.M_o;
  model.C_o_X_o_dot = terms.C_o * grasp.X_o_dot();
  const ObjectCoordinates coordinates{grasp.X_o(), grasp.X_o_dot()};
  EvaluateObject(body, grasp.gravity(), &coordinates, &context_);
}

}  // namespace dexcheck
