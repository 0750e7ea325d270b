#include "harness/checks/step_model_check.h"

#include <algorithm>

#include "controller/common/linear_algebra.h"
#include "controller/object/object_dynamics.h"
#include "harness/base/worst.h"
#include "harness/checks/contact_check.h"

namespace dexcheck {
namespace {

/// Frames of the grasp; all frames for a robot that holds nothing.
std::vector<int> ListFrames(const RobotModel& model, std::span<const int> fingertips) {
  if (fingertips.empty()) return ListIndices(model.frames().size());
  return {fingertips.begin(), fingertips.end()};
}

}  // namespace

ControllerProvider::ControllerProvider(const RobotModel& model, std::vector<int> frames, bool contacts,
                                       bool has_coordinates)
    : AnalyticProvider(model, "controller", std::move(frames)) {
  has_coordinates_ = has_coordinates;
  const Eigen::Index n = xi_.size();
  if (contacts) {
    contacts_.resize(jacobians_.size());
    for (ContactValues& contact : contacts_) contact.J_B.setZero(3, n);
    J_B_dot_xi_.setZero(3 * static_cast<Eigen::Index>(contacts_.size()));
  } else {
    own_jacobians_.assign(jacobians_.size(), {Matrix6Xd::Zero(6, n), Matrix6Xd::Zero(6, n)});
  }
}

void ControllerProvider::Read(const ModelTerms& robot, const GraspTerms& grasp, const MeasuredState& state) {
  view_of_terms_.emplace(robot);
  view_ = &*view_of_terms_;
  xi_ = state.xi;
  ReadEnergy();
  for (size_t i = 0; i < jacobians_.size(); ++i) {
    const auto index = static_cast<int>(i);
    if (own_jacobians_.empty()) {
      jacobians_[i] = {&grasp.J_f(index), &grasp.J_f_dot(index)};
      continue;
    }
    auto& [J, J_dot] = own_jacobians_[i];
    robot.CalcFrameJacobian(map_.compared_frames[i], J, J_dot);
    jacobians_[i] = {&J, &J_dot};
  }
  if (!contacts_.empty()) ReadContacts(grasp, state);
  if (has_object_) ReadObject(grasp);
}

void ControllerProvider::ReadContacts(const GraspTerms& grasp, const MeasuredState& state) {
  J_B_dot_xi_.noalias() = grasp.J_B_dot() * state.xi;
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const auto row = 3 * static_cast<Eigen::Index>(i);
    ContactValues& values = contacts_[i];
    values.frame[ContactValues::kOverlap] = state.overlap[i];
    values.G = grasp.G().middleCols<3>(row);
    values.J_B = grasp.J_B().middleRows<3>(row);
    values.J_B_dot_xi = J_B_dot_xi_.segment<3>(row);
    values.G_dot_T_V = grasp.G_dot().middleCols<3>(row).transpose() * grasp.V_Bo();
  }
}

void ControllerProvider::ReadObject(const GraspTerms& grasp) {
  const MassProperties& body = grasp.object();
  const Vector6d& V_Bo = grasp.V_Bo();
  object_.pose = grasp.X_Bo().matrix().topRows<3>();
  object_.V_Bo = V_Bo;
  object_.M_hat = grasp.body().M_hat;
  object_.C_hat_V = grasp.body().C_hat * V_Bo;
  object_.N_o = grasp.body().N_o;
  object_.kinetic = CalcObjectKineticEnergy(body, V_Bo);
  object_.potential = CalcObjectPotentialEnergy(body, grasp.gravity(), grasp.X_Bo().translation());
  if (!has_coordinates_) return;
  object_.M_o = grasp.coordinates().M_o;
  object_.C_o_X_o_dot = grasp.coordinates().C_o * grasp.X_o_dot();
}

StepModelCheck::StepModelCheck(const Adapter& adapter, std::span<const int> fingertips,
                               OrientationFeedback orientation)
    : has_coordinates_(orientation == OrientationFeedback::kAngles),
      engine_(adapter, fingertips, has_coordinates_),
      controller_(adapter.model(), ListFrames(adapter.model(), fingertips), !fingertips.empty(),
                  has_coordinates_),
      comparison_(adapter.model(), kAskedByRun, {&controller_, &engine_},
                  ListFrames(adapter.model(), fingertips), fingertips.size()) {
  const std::span<CheckRecord> own = comparison_.records();
  for (size_t i = 0; i < own.size(); ++i) {
    const auto [rows, cols] = CalcShape(comparison_.entry(i), comparison_.scales());
    own[i].is_empty = rows * cols == 0;
  }
}

void StepModelCheck::RaiseBounds(double least) {
  for (CheckRecord& record : comparison_.records()) record.bound = Worst(record.bound, least);
}

void StepModelCheck::Merge(const StepModelCheck& other) {
  const std::span<CheckRecord> own = comparison_.records();
  for (size_t i = 0; i < own.size(); ++i) {
    if (other.records()[i].applies) own[i].Merge(other.records()[i]);
  }
}

void StepModelCheck::LeaveOutContacts() {
  with_contacts_ = false;
  const std::span<CheckRecord> own = comparison_.records();
  for (size_t i = 0; i < own.size(); ++i) own[i].applies = !IsOfContacts(comparison_.entry(i));
}

std::optional<ObjectCoordinates> StepModelCheck::FindCoordinates(const GraspTerms& grasp) const {
  if (!has_coordinates_ || !comparison_.model().object()) return std::nullopt;
  return ObjectCoordinates{grasp.X_o(), grasp.X_o_dot()};
}

void StepModelCheck::SetState(const GraspTerms& grasp, const MeasuredState& state,
                              const EvaluatedPositions& evaluated) {
  const std::optional<ObjectCoordinates> coordinates = FindCoordinates(grasp);
  engine_.SetState(state.q, state.xi, state.X_Bo, state.V_Bo, coordinates ? &*coordinates : nullptr,
                   evaluated);
}

void StepModelCheck::Compare(const ModelTerms& robot, const GraspTerms& grasp, const MeasuredState& state,
                             const Pose& X_W0, double when, const mjData* evaluated) {
  const bool has_object = comparison_.model().object().has_value();
  SetState(grasp, state, {evaluated, X_W0});
  controller_.Read(robot, grasp, state);
  comparison_.SetScales(robot, state.q, state.xi);
  ScaleContext& scales = comparison_.scales();
  if (has_object) {
    const Vector6d& V = controller_.object().V_Bo;
    double rate = Worst(V.head<3>().norm(), V.tail<3>().norm());
    if (has_coordinates_) rate = Worst(rate, grasp.X_o_dot().tail<3>().cwiseAbs().sum());
    scales.object =
        CalcObjectScales(grasp.object(), grasp.gravity(), engine_.object().pose.col(3).norm(), rate);
  }
  if (with_contacts_) {
    const Pose shift = X_W0 * engine_.terms().BasePose().inverse(Eigen::Isometry);
    for (size_t i = 0; i < scales.contacts.size(); ++i)
      EvaluateContact(grasp.contacts()[i], shift, i, &engine_, &(*controller_.mutable_contacts())[i],
                      &scales);
  }
  comparison_.Compare(when, with_contacts_);
}

}  // namespace dexcheck
