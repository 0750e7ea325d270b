#pragma once

// A plant that is not ideal, as a scenario declares it: faults of sensing and motors, disturbances, and an
// engine whose masses are not those that the controller knows. The defaults are the ideal plant.

#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// One number for each of several named things: joints, motors, links.
struct ByName {
  double all = 0.0;  ///< Value for names in no group.
  /// A name, the beginning of names, or "all"; later ones win.
  std::vector<std::pair<std::string, double>> groups;
  std::string key;  ///< For messages: "sensing.joint_noise".

  /// Whether everything has this value.
  [[nodiscard]] bool Is(double value) const;
  /// Returns the numbers of these names. @param source the file, for messages.
  /// @throws InputError when a group fits none of the names.
  [[nodiscard]] VectorXd Resolve(std::span<const std::string> names, const std::string& source) const;
};

/// Longest delay, in steps: the size of the buffers of sensing and motors.
inline constexpr long kMaxDelaySteps = 1000;

/// Number of whole steps in a time that ParseScenario has accepted.
inline long CountSteps(double time, double time_step) { return std::lround(time / time_step); }

/// How a velocity is measured.
enum class VelocitySource {
  kMeasured,     ///< By a sensor of its own.
  kDifferenced,  ///< Change of the measured position, filtered.
  kKalman,       ///< By a Kalman filter from the measured position.
};

/// Differences of the measurements from the true state.
struct SensingOptions {
  ByName joint_counts;    ///< Counts of an encoder per turn (per metre of a prismatic joint); 0 is exact.
  ByName joint_noise;     ///< Standard deviation of a joint's position, rad, before the encoder counts.
  ByName velocity_noise;  ///< Standard deviation of the rate of a joint or wheel where it is measured, rad/s.
  VelocitySource velocity = VelocitySource::kMeasured;  ///< Source of the joints' velocities.
  double velocity_cutoff = 0.0;  ///< Cutoff of the low pass after differencing, Hz; 0 for none.
  double kalman_acceleration =
      0.0;                ///< Standard deviation that the filter expects of accelerations, rad/s^2.
  bool odometry = false;  ///< The base's pose is integrated from its wheels' rates.

  double object_position_noise = 0.0;                          ///< Standard deviation of each axis, m.
  double object_orientation_noise = 0.0;                       ///< Standard deviation about each axis, rad.
  double object_rate = 0.0;                                    ///< Poses a second; 0 for one at each step.
  double object_latency = 0.0;                                 ///< Age of the pose, s.
  VelocitySource object_velocity = VelocitySource::kMeasured;  ///< kMeasured: comes with the pose.
  double object_velocity_cutoff = 0.0;  ///< Cutoff of its low pass after differencing, Hz; 0 for none.
  double object_acceleration =
      0.0;  ///< Standard deviation that its filter expects of accelerations, m/s^2 and rad/s^2.

  double contact_force_noise = 0.0;  ///< Standard deviation of the support's force, N.
  double latency = 0.0;              ///< Age of all measurements, s; a whole number of time steps.

  double contact_error = 0.0;  ///< Error of each contact's measured place on the object, rad.

  /// Whether the true state is measured.
  [[nodiscard]] bool is_exact() const;
};

/// Differences of the delivered torques from those that are sent.
struct ActuationOptions {
  ByName torque_step;               ///< Torques are whole multiples of this, N m; 0 is exact.
  ByName gain_error;                ///< Relative.
  ByName lag;                       ///< Time constant of the motor's torque, s.
  ByName coulomb;                   ///< Dry friction of a moving joint, N m.
  ByName stribeck;                  ///< Additional dry friction near standstill, N m.
  ByName backlash;                  ///< Free play, rad.
  double stribeck_velocity = 0.05;  ///< Rate at which stribeck has fallen to 1/e, rad/s.
  double delay = 0.0;               ///< s.
  bool saturate = false;            ///< A motor delivers its limit when more is commanded.
  ByName limit;  ///< Limit that replaces the motor's own, N m, and saturates; 0 for its own.

  /// Whether torques above a motor's limit are cut off there; otherwise they end the run.
  [[nodiscard]] bool saturates() const { return saturate || !limit.Is(0.0); }
  [[nodiscard]] bool is_exact() const;
};

/// A wrench that acts on a body.
struct DisturbanceOptions {
  enum class Kind {
    kPulse,  ///< For `duration`.
    kStep,   ///< From `begin` on, or for `duration`.
    kSine,   ///< sin(2 pi frequency (t - begin)) times the wrench.
    kNoise,  ///< Random with variance 1 times the wrench, with no frequencies above `frequency`.
  };
  Kind kind = Kind::kPulse;
  std::string body;                    ///< A link, or the object.
  Vector3d force = Vector3d::Zero();   ///< N.
  Vector3d torque = Vector3d::Zero();  ///< N m.
  Vector3d at = Vector3d::Zero();      ///< Point of action of the force, in the body's frame, m.
  bool in_body_frame = false;  ///< Force and torque turn with the body; otherwise they are the world's.
  double begin = 0.0;          ///< s.
  double duration = 0.0;       ///< s; 0 until the end.
  double period = 0.0;         ///< Time after which it repeats, s; 0 does not.
  double frequency = 0.0;      ///< Hz.
  double begin_within = 0.0;   ///< Its beginning is delayed by a random time up to this, s.
  double size_within = 0.0;    ///< Its size is drawn from 1 -+ this.
  std::string key;             ///< For messages: "disturbance.0".
};

/// A mass that is fixed to a link of the plant and unknown to the controller.
struct Payload {
  std::string body;
  double mass = 0.0;               ///< kg, a point.
  Vector3d at = Vector3d::Zero();  ///< In the link's frame, m.
  std::string key;                 ///< For messages.
};

/// Differences of the engine's robot from the robot that the controller knows.
struct MismatchOptions {
  ByName mass{.all = 1.0};                            ///< Factor of a link's mass and inertia.
  ByName mass_within;                                 ///< The factor is drawn from 1 -+ this, times `mass`.
  ByName damping{.all = 1.0};                         ///< Factor of a joint's viscous friction.
  ByName armature{.all = 1.0};                        ///< Factor of a joint's rotor inertia.
  std::vector<std::pair<std::string, Vector3d>> com;  ///< Displacement of a link's centre of mass, m.
  std::vector<Payload> payloads;
  Vector2d slope = Vector2d::Zero();  ///< Rise of the floor along x and y, rad.
  std::optional<double> friction;     ///< mu of fingertips on the object, instead of the model's.

  [[nodiscard]] bool is_none() const;
};

/// All imperfections of a scenario.
struct Imperfections {
  SensingOptions sensing;
  ActuationOptions actuation;
  std::vector<DisturbanceOptions> disturbances;
  MismatchOptions mismatch;

  /// "sensing.latency = 0.002" for each key of the scenario: the text of a verdict.
  std::vector<std::string> declared;

  /// Whether the plant is the ideal one, whatever keys are set.
  [[nodiscard]] bool is_ideal() const;
};

}  // namespace dexcheck
