#pragma once

// Robots drawn at random and written as a URDF, an MJCF or a parameter file, and faults that are made in what
// is written. It shares no code with what finds them.

#include <array>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "controller/common/types.h"
#include "harness/corrections/correction.h"

namespace dexcheck::testing {

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
  bool other_names = false;   ///< Of bodies.
  bool other_frames = false;  ///< On every link, at random.
  bool fuses = false;         ///< Fixed links are part of what carries them.
  bool euler = false;         ///< In place of quaternions.
  bool principal = false;     ///< Moments and a quaternion in place of a full tensor.
  bool motors = false;
  unsigned seed = 0;  ///< Of the frames.
};

DrawnRobot DrawRobot(std::mt19937* random);
std::string WriteRobot(const DrawnRobot& robot, const WrittenForm& form);
/// The end of the file's name: ".urdf".
const char* EndOf(const WrittenForm& form);

/// A fault that was made, and what names it.
struct MadeFault {
  std::string name;
  SiteKind of = SiteKind::kMass;
  std::vector<CorrectionKind> kinds;  ///< That say the same.
  std::vector<std::string> places;    ///< "joint q1", "link l1": all of them, or of an exchange one.
  std::vector<std::string> hardly;    ///< Where it changes little, and may be listed or not.
  bool any_place = false;
};

/// Kinds of faults by name.
std::vector<std::string> ListFaultNames();
/// Makes a fault of a kind somewhere. @param form of the file that will have it. @return none where it does
/// not show.
std::optional<MadeFault> MakeFault(const std::string& name, const WrittenForm& form, std::mt19937* random,
                                   DrawnRobot* robot);

}  // namespace dexcheck::testing
