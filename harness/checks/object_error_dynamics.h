#pragma once

// (57) integrated beside a run.

#include "harness/checks/law_reference.h"
#include "harness/checks/step_record.h"

namespace dexcheck {

struct LawErrors;

/// The object as (57) leads it from t = 0 on: by itself, driven by what the plant did beyond the prediction,
/// and driven by what is held during a step. Each steps as the plant does.
class ObjectErrorDynamics {
 public:
  /// @param velocity_age by how much velocities are older than positions, s; 0 of a plant that accelerates
  /// within a step.
  ObjectErrorDynamics(const LawSpec& spec, double time_step, double velocity_age)
      : spec_(spec), time_step_(time_step), velocity_age_(velocity_age) {}

  /// The next step. @param terms of the law. @param predicted V_o_dot of the rigid system under the torques;
  /// null where torques, readings or pushes are not those of the law: all of what the object did beyond what
  /// its true error demands then drives (57). @param errors gets the distances from the true object.
  void Follow(const StepRecord& step, const LawTerms& terms, const DesiredMotion& desired,
              const Vector6d* predicted, LawReference* law, LawErrors* errors);

 private:
  struct Followed {
    LawObject object;                   // velocities as old as the plant's
    Vector6d V_dot = Vector6d::Zero();  // from this step to the next
  };
  [[nodiscard]] bool accelerates_within_step() const { return velocity_age_ == 0.0; }
  /// (57) by itself, and driven by what is held during a step, from the step before to this one.
  void FollowHeld(const LawObject& truth, const DesiredMotion& desired, LawReference* law);
  void UpdateAngles(LawObject* object) const;
  /// As the plant steps, to the next step. @param change half of the change of p_ddot (world) and omega_dot
  /// within the step.
  void Move(const Vector6d& change, Followed* one) const;
  /// p_ddot (world) and omega_dot.
  static Vector6d CalcWorldAcceleration(const Followed& one);

  LawSpec spec_;
  double time_step_, velocity_age_;
  bool has_begun_ = false;
  Followed followed_, undisturbed_, held_;  // (57) driven by all, by nothing, by what is held
  Followed before_;                         // the plant's object, a step before
};

}  // namespace dexcheck
