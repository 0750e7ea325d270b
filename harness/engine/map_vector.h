#pragma once

// Vectors and poses of the engine's arrays.

#include <mujoco/mujoco.h>

#include "controller/common/types.h"

namespace dexcheck {

/// Returns three numbers of the engine as a vector.
inline Vector3d MapVector(const mjtNum* v) { return {v[0], v[1], v[2]}; }

/// A rotation of the engine, row by row.
using RotationMap = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>;

inline Pose MapPose(const mjtNum* rotation, const mjtNum* position) {
  Pose X = Pose::Identity();
  X.linear() = RotationMap(rotation);
  X.translation() = MapVector(position);
  return X;
}

/// Returns where the kinematics have a body.
inline Pose BodyPose(const mjData& data, int body) {
  return MapPose(data.xmat + 9 * body, data.xpos + 3 * body);
}

/// @param wxyz a quaternion of any length.
inline Pose ReadPose(const mjtNum* position, const mjtNum* wxyz) {
  Pose X = Pose::Identity();
  X.linear() = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized().toRotationMatrix();
  X.translation() = MapVector(position);
  return X;
}

/// Returns the pose that a free joint's seven entries of qpos state: origin, then a quaternion.
inline Pose ReadFreePose(const mjtNum* qpos) { return ReadPose(qpos, qpos + 3); }

inline void WriteFreePose(const Pose& X, mjtNum* qpos) {
  const Eigen::Quaterniond rotation(X.linear());
  const mjtNum wxyz[4] = {rotation.w(), rotation.x(), rotation.y(), rotation.z()};
  mju_copy3(qpos, X.translation().data());
  mju_copy4(qpos + 3, wxyz);
}

}  // namespace dexcheck
