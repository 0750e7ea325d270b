#pragma once

// The motion that a new folder begins with: each joint leaves its place, comes back, and swings on its way,
// as its motors can.

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "controller/control/joint_motion.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/robot_model.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// Positions by joint, rad or m, and several of them.
using JointPositions = std::map<std::string, double>;
using JointPoses = std::vector<JointPositions>;

/// One joint's part of the motion: where it begins and where it goes, well within its range; rad or m.
struct JointSpan {
  double start = 0.0;
  double end = 0.0;
  double swing = 0.0;  ///< Amplitude of both sines.
};

/// A motion there and back, and which motors it asks too much of.
struct FirstMotion {
  std::vector<JointSpan> spans;   ///< One a joint.
  JointPoses poses;               ///< Postures along it.
  double frequency = 10.0;        ///< Natural frequency of its law, rad/s.
  std::vector<std::string> weak;  ///< Joints whose limit does not even hold the robot, or move it so little.
};

/// A motion within the joints' ranges, smaller where motors would be at their limits.
/// @param limits of motors by joint, N m or N. @param rates largest by joint, rad/s or m/s. @param home
/// where it had best begin, by joint, rad or m; 0 for others.
FirstMotion PlanFirstMotion(const RobotDescription& robot, const RobotModel& model,
                            const std::map<std::string, double>& limits,
                            const std::map<std::string, double>& rates, const JointPositions& home);

/// Halves a motion.
void Shrink(FirstMotion* motion);

/// Inertia of each joint while all else is free, all at zero: kg m^2 or kg.
VectorXd CalcJointInertias(const RobotModel& model);

/// The force on the velocities that a motion asks for, N m or N. @param terms set to its state.
VectorXd CalcForce(const ModelTerms& terms, const DesiredJoints& desired);

/// Adds a slow sine and a fast one, which separate forces that a smooth way does not: a torque, an inertia
/// and friction. @param amplitude of both. @param number that frequencies are chosen by, none the same.
void AddSwings(int joint, double amplitude, size_t number, std::vector<JointOscillation>* swings);

// Parts of a scenario's text.

/// The key `oscillations`. @param key of what swings: "joint". @param name of each.
std::string WriteSwings(const std::vector<JointOscillation>& swings, const char* key,
                        const std::function<std::string(int joint)>& name);

/// "shoulder" = 0.1, "elbow" = 0: a number of each joint.
std::string ListJoints(const RobotDescription& robot, const std::function<double(size_t joint)>& value);

/// The parts in which such scenarios differ.
struct MotionText {
  const char* title;
  const char* description;
  double settle;     ///< s.
  std::string text;  ///< The tables of the motion.
  double frequency;  ///< Natural frequency of the law, rad/s.
  bool is_followed;  ///< To 0.01 rad, without friction.
};
std::string WriteScenario(const RobotDescription& robot, const MotionText& motion, double tolerance);

/// The scenario of that motion. @param tolerance of runs; 0 for rounding.
std::string WriteMotionScenario(const RobotDescription& robot, const FirstMotion& motion, double tolerance);

/// The study of its gains, for the best with margins that an arm needs.
/// @param stands on feet, whose margins are not judged.
std::string WriteGainStudy(bool stands);

}  // namespace dexcheck
