#include "controller/handling/handling_controller.h"

#include "controller/control/grasp_terms.h"

namespace dexcheck {
namespace {

std::vector<size_t> ListMembers(ContactSet set, size_t count) {
  std::vector<size_t> members;
  for (size_t i = 0; i < count; ++i) {
    if (Contains(set, i)) members.push_back(i);
  }
  return members;
}

std::vector<int> Pick(std::span<const int> fingertips, const std::vector<size_t>& members) {
  std::vector<int> picked;
  picked.reserve(members.size());
  for (const size_t i : members) picked.push_back(fingertips[i]);
  return picked;
}

}  // namespace

PartialGrasp::PartialGrasp(const RobotModel& model, std::span<const int> fingertips,
                           const MassProperties& object, const Surface& surface, ContactSet set)
    : members_(ListMembers(set, fingertips.size())),
      terms_(model, Pick(fingertips, members_), object, surface),
      kappa_(members_.size()),
      overlap_(members_.size()) {}

void PartialGrasp::SetState(const ModelTerms& robot, const MeasuredState& state) {
  for (size_t i = 0; i < members_.size(); ++i) {
    kappa_[i] = state.kappa.at(members_[i]);
    overlap_[i] = state.overlap.at(members_[i]);
  }
  terms_.SetOverlaps(overlap_);
  terms_.SetPose(robot, state.X_Bo, state.V_Bo, kappa_);
}

void PartialGrasp::Scatter(const Eigen::Ref<const VectorXd>& part, Eigen::Ref<VectorXd> whole) const {
  whole.setZero();
  for (size_t i = 0; i < members_.size(); ++i) {
    whole.segment<3>(3 * static_cast<Eigen::Index>(members_[i])) =
        part.segment<3>(3 * static_cast<Eigen::Index>(i));
  }
}

HandlingController::HandlingController(const RobotModel& model, std::span<const int> fingertips,
                                       const MassProperties& object, const Surface& surface,
                                       const GraspControllerOptions& options)
    : model_(&model),
      fingertips_(fingertips.begin(), fingertips.end()),
      object_(object),
      surface_(&surface),
      options_(options),
      force_(static_cast<int>(fingertips.size()), options) {
  f_c_.setZero(3 * static_cast<Eigen::Index>(fingertips.size()));
  xi_dot_d_.setZero(model.num_velocities());
  const ContactSet all = AllContacts(static_cast<int>(fingertips_.size()));
  FindLaw(all, false);
  FindLaw(all, true);
}

HandlingController::Law& HandlingController::FindLaw(ContactSet set, bool by_inertia) {
  std::unique_ptr<Law>& law = laws_[{set, by_inertia}];
  if (!law) {
    RedundancyWeight weight = options_.weight;
    if (by_inertia) weight.kind = RedundancyWeight::Kind::kMass;
    law = std::make_unique<Law>(*model_, fingertips_, object_, *surface_, weight, set);
    law->f_c.setZero(law->grasp.terms().num_forces());
  }
  return *law;
}

const VectorXd& HandlingController::CalcTorque(const GraspModel& terms, const MeasuredState& state,
                                               const HandlingDemand& demand,
                                               const Eigen::Ref<const VectorXd>& sigma_prime) {
  force_seconds_ = 0.0;
  V_Bo_dot_.setZero();
  const ContactSet all = AllContacts(static_cast<int>(fingertips_.size()));
  if (demand.contacts == 0) {
    f_c_.setZero();
    ComputedTorque& law = FindLaw(all, false).torque;
    law.SetFreeMotion(terms.robot(), sigma_prime);
    xi_dot_d_ = law.xi_dot_d();
    return law.tau_0();
  }
  Law& law = FindLaw(demand.contacts, demand.by_inertia);
  if (demand.contacts != all) law.grasp.SetState(terms.robot(), state);
  const GraspTerms& grasp = demand.contacts == all ? terms.grasp() : law.grasp.terms();
  if (demand.carried) {
    V_Bo_dot_ =
        CalcTrackingAcceleration(options_.gains, OrientationFeedback::kRotation, grasp, demand.desired);
  }
  law.torque.SetMotion(terms.robot(), grasp, V_Bo_dot_, sigma_prime);
  xi_dot_d_ = law.torque.xi_dot_d();

  for (size_t i = 0; i < law.grasp.members().size(); ++i) {
    law.f_c.segment<3>(3 * static_cast<Eigen::Index>(i)) =
        (1.0 - demand.grip) * demand.touch_force.at(law.grasp.members()[i]) * Vector3d::UnitZ();
  }
  if (demand.grip > 0.0) {
    Require(demand.contacts == all, "grip", "must be zero without all contacts", demand.grip);
    const ObjectBodyTerms& body = grasp.body();
    const Vector6d F_o =
        demand.scale * (body.M_hat * V_Bo_dot_ + body.C_hat * grasp.V_Bo()) + demand.weight * body.N_o;
    law.f_c += demand.grip * force_.Solve(grasp, F_o, demand.f_min);
    force_seconds_ = force_.seconds();
  }
  law.grasp.Scatter(law.f_c, f_c_);
  return law.torque.CalcTorqueWithForces(grasp, law.f_c);
}

}  // namespace dexcheck
