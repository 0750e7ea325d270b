#include "controller/handling/partial_grasp.h"

#include <stdexcept>

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

}  // namespace dexcheck
