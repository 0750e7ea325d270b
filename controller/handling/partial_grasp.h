#pragma once

// A grasp in the making: the terms of those of its fingertips that touch.

#include <span>
#include <vector>

#include "controller/control/grasp_model.h"
#include "controller/control/grasp_terms.h"

namespace dexcheck {

/// G, J_B' and their rates of some fingertips of a grasp, by the same order.
class PartialGrasp {
 public:
  /// @param fingertips of the whole grasp. @param set not empty. Else as GraspTerms.
  PartialGrasp(const RobotModel& model, std::span<const int> fingertips, const MassProperties& object,
               const Surface& surface, ContactSet set);

  /// @param state of the whole grasp. @throws as GraspTerms.
  void SetState(const ModelTerms& robot, const MeasuredState& state);

  [[nodiscard]] const GraspTerms& terms() const { return terms_; }
  /// Places in the whole grasp.
  [[nodiscard]] const std::vector<size_t>& members() const { return members_; }

  /// Forces of the part (k) to those of the whole grasp (3N), the others zero.
  void Scatter(const Eigen::Ref<const VectorXd>& part, Eigen::Ref<VectorXd> whole) const;

 private:
  std::vector<size_t> members_;
  GraspTerms terms_;
  std::vector<ContactCoordinates> kappa_;
  std::vector<double> overlap_;
};

}  // namespace dexcheck
