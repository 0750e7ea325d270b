#include "harness/checks/step_model_check.h"

#include <numeric>

#include "controller/object/object_dynamics.h"

namespace dexcheck {
namespace {

/// The engine's terms for a grasp, or of a robot that holds nothing, whose frames are all of interest.
EngineTerms MakeTerms(const Adapter& adapter, std::span<const int> fingertips) {
  return fingertips.empty() ? EngineTerms(adapter, Coordinates::kReduced) : EngineTerms(adapter, fingertips);
}

}  // namespace

StepModelCheck::StepModelCheck(const Adapter& adapter, std::span<const int> fingertips,
                               OrientationFeedback orientation)
    : TermComparison(adapter),
      has_coordinates_(orientation == OrientationFeedback::kAngles),
      has_object_(adapter.model().object().has_value()),
      engine_(MakeTerms(adapter, fingertips)) {
  context_.engine = &engine_;
  if (fingertips.empty()) {
    if (has_object_) engine_.RequireObject();
    std::vector<int> all(adapter.model().frames().size());
    std::iota(all.begin(), all.end(), 0);
    SetFrames(all, /*contacts=*/false);
    const int n = engine_.size();
    frame_jacobians_.assign(all.size(), {Matrix6Xd::Zero(6, n), Matrix6Xd::Zero(6, n)});
  } else {
    SetFrames(fingertips, /*contacts=*/true);
  }
  J_B_dot_xi_.setZero(3 * static_cast<Eigen::Index>(fingertips.size()));
  context_.xi.setZero(engine_.size());
  std::vector<TermGroup> left_out;
  if (!has_coordinates_) left_out.push_back(TermGroup::kObjectCoordinates);
  if (!has_object_) left_out.push_back(TermGroup::kObject);
  if (fingertips.empty()) left_out.push_back(TermGroup::kContact);
  Ask(kAskedByRun, left_out);
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
    const auto index = static_cast<int>(i);
    if (frame_jacobians_.empty()) {
      context_.jacobians[i] = {&grasp.J_f(index), &grasp.J_f_dot(index)};
      continue;
    }
    auto& [J, J_dot] = frame_jacobians_[i];
    robot.CalcFrameJacobian(context_.frames[i], J, J_dot);
    context_.jacobians[i] = {&J, &J_dot};
  }
  if (with_contacts_) ReadContacts(grasp, state, X_W0);
  if (has_object_) ReadObject(grasp);
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
