#pragma once

// Robots drawn at random and written as a URDF, an MJCF or a parameter file. This shares no code with what
// reads them.

#include <array>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck::testing {

using Random = std::mt19937;
double Draw(Random* random, double low, double high);
int DrawIndex(Random* random, int count);
Vector3d DrawVector(Random* random, double size);
/// The rotation of roll, pitch and yaw, and back.
Matrix3d Turn(const Vector3d& rpy);
Vector3d SolveAngles(const Matrix3d& R);
/// The tensor of xx yy zz xy xz yz, and back.
Matrix3d Tensor(const Vector6d& entries);
Vector6d Entries(const Matrix3d& tensor);

/// A link and the joint that carries it, as numbers to be written.
struct DrawnLink {
  std::string name, joint;
  int parent = -1;
  char type = 'h';  ///< h: hinge, s: slide, f: fixed.
  Vector3d xyz = Vector3d::Zero(), rpy = Vector3d::Zero(), axis = Vector3d::UnitZ();
  std::optional<std::array<double, 2>> range;
  double damping = 0.0, friction = 0.0, armature = 0.0, effort = 0.0, velocity = 0.0;
  int leader = -1;  ///< Link whose joint it follows.
  double multiplier = 1.0;
  double gear = 1.0;  ///< 0: no motor.
  bool has_inertial = true;
  double mass = 0.0;
  Vector3d com = Vector3d::Zero(), com_rpy = Vector3d::Zero();
  Vector6d I = Vector6d::Zero();  ///< xx yy zz xy xz yz along com_rpy.
};

struct DrawnRobot {
  std::vector<DrawnLink> links;  ///< The first is the root.
  double gravity = 9.81;
};

struct WrittenForm {
  enum class Format { kUrdf, kMjcf, kToml } format = Format::kUrdf;
  int digits = 6;
  bool other_names = false;   ///< Whether bodies have other names.
  bool other_frames = false;  ///< On every link, at random.
  bool fuses = false;         ///< Fixed links are part of what carries them.
  bool euler = false;         ///< In place of quaternions.
  bool principal = false;     ///< Moments and a quaternion in place of a full tensor.
  bool motors = false;
  unsigned seed = 0;  ///< Seed of the frames.
};

DrawnRobot DrawRobot(std::mt19937* random);
std::string WriteRobot(const DrawnRobot& robot, const WrittenForm& form);
/// The end of the file's name: ".urdf".
const char* EndOf(const WrittenForm& form);

}  // namespace dexcheck::testing
