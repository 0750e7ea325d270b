#pragma once

// Numbers of a model against another description's or the engine's, one check after the other.

#include <algorithm>
#include <string>

#include "harness/descriptions/constant_checks.h"

namespace dexcheck {

inline Location AtLink(int link) { return {Location::Kind::kLink, link, -1}; }
inline Location AtJoint(int joint) { return {Location::Kind::kJoint, joint, -1}; }

class ConstantComparison {
 protected:
  ConstantComparison(const RobotModel& model, ConstantChecks* result) : model_(model), result_(*result) {}

  /// Compares relative to the larger of the two, or to `scale` where zero is a proper value.
  void Compare(const std::string& check, const Location& where, double model, double engine,
               double scale = 0.0) {
    CheckRecord* const record = result_.Define(check);
    entry_ = check == last_check_ && where == last_location_ ? entry_ + 1 : 0;
    last_check_ = check;
    last_location_ = where;
    const double size = std::max({std::abs(model), std::abs(engine), scale});
    const double error = record->Compare(model, engine, size > 0.0 ? size : 1.0, where, -1);
    if (error > kConstantRounding) {
      result_.findings.push_back({check, DescribeWhere(where), model, engine, where, entry_});
    }
  }
  [[nodiscard]] std::string DescribeWhere(const Location& where) const {
    return Describe(where, model_, model_.num_base_velocities());
  }
  void CompareGravity(const Vector3d& other) {
    for (int k = 0; k < 3; ++k)
      Compare("gravity_vector", {}, model_.gravity()[k], other[k], model_.gravity().norm());
  }
  /// @param mass_of of the other's link, by this model's joint; -1 the base.
  template <typename MassOf>
  void CompareMasses(const MassOf& mass_of) {
    for (int link = model_.base().type == BaseType::kFixed ? 0 : -1; link < model_.num_joints(); ++link) {
      Compare("link_mass", AtLink(link), link < 0 ? model_.base_with_wheels().mass : JointOf(link).body.mass,
              mass_of(link));
    }
  }
  /// @param leader of `own`, as the other one counts joints.
  void CompareCouplings(int joint, const JointCoupling& own, int leader, const JointCoupling& other) {
    Compare(kCoupling, AtJoint(joint), leader, other.leader);
    Compare(kCoupling, AtJoint(joint), own.multiplier, other.multiplier);
    Compare(kCoupling, AtJoint(joint), own.offset, other.offset);
  }
  /// Only one of the two has it.
  void AddCoupling(int joint, double model, double engine, const std::string& effect) {
    result_.Add({kCoupling, DescribeWhere(AtJoint(joint)), model, engine, AtJoint(joint), 1, false, effect});
  }
  [[nodiscard]] const Joint& JointOf(int joint) const { return model_.joint(joint); }

  static constexpr const char* kCoupling = "joint_coupling";
  const RobotModel& model_;
  ConstantChecks& result_;

 private:
  std::string last_check_;
  Location last_location_;
  int entry_ = 0;
};

}  // namespace dexcheck
