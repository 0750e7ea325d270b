#pragma once

// The object's terms of (8) and (19) against the engine's free body.

#include <functional>
#include <vector>

#include "controller/object/euler_zyz.h"
#include "controller/object/object_dynamics.h"
#include "harness/adapter/adapter.h"
#include "harness/checks/check_record.h"
#include "harness/engine/engine.h"

namespace dexcheck {

/// The model's equations of the object. Checks of checks put wrong ones in their place.
struct ObjectFormulas {
  std::function<ObjectTerms(const MassProperties&, const Vector3d&, const Vector6d&, const Vector6d&)> terms =
      CalcObjectTerms;
  std::function<Pose(const Vector6d&)> pose = CalcObjectPose;
};

/// Compares pose, velocity, M_o, C_o X_o_dot, N_o and energy at random X_o, X_o_dot. The engine's side is
/// built from its own quaternion algebra, mass matrix and bias force of the free body.
class ObjectCheck {
 public:
  /// @throws InputError when the object's body does not move by a free joint alone.
  explicit ObjectCheck(const Adapter& adapter, ObjectFormulas formulas = {});

  void Compare(const Vector6d& X_o, const Vector6d& X_o_dot, long sample);

  [[nodiscard]] const std::vector<CheckRecord>& records() const { return records_; }

 private:
  enum Term { kPose, kBodyVelocity, kInertia, kCoriolis, kGravity, kKineticEnergy, kTermCount };
  void SetEngineState(const Vector6d& X_o, const Vector6d& X_o_dot);

  const Adapter* adapter_;
  ObjectFormulas formulas_;
  MjModelPtr engine_;
  MjDataPtr data_;
  int qpos_address_;
  int dof_address_;
  VectorXd force_nv_;
  MatrixXd M_nv_;
  std::vector<CheckRecord> records_;
};

}  // namespace dexcheck
