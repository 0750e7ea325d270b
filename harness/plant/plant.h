#pragma once

// The simulated plant: robot and object, driven by torques.

#include <mujoco/mujoco.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/types.h"
#include "controller/control/reading.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

// Values that are read from a plant in one step: its true state before it is driven, and its response.

/// Motion of the base that the paper's coordinates leave out.
struct BaseDeparture {
  double tilt = 0.0;    ///< Angle of the base's z axis against the vertical, rad.
  double height = 0.0;  ///< Height of Sigma_0's origin above the model's, m.
};

/// The true state at the beginning of a step.
struct PlantReading {
  /// The state in the paper's coordinates, without tilt and height of the base, which q' does not have; kappa
  /// is where the plant's fingertips touch. For a fingertip that is far from the object, kappa is the nearest
  /// place and the overlap -kFar.
  MeasuredState state;
  Touch touch;
  BaseDeparture departure;
  Pose X_W0 = Pose::Identity();  ///< Pose of Sigma_0 in the world, tilt and height included.
  VectorXd qpos;                 ///< MuJoCo's positions (nq), which draw the scene.
  VectorXd qvel;                 ///< MuJoCo's velocities (nv).
  /// Origin (3) and rotation, row by row (9), of each of MuJoCo's bodies; empty for a plant without them.
  VectorXd body_positions, body_rotations;
  /// MuJoCo's data with the positions of this state, until the next step begins; null for a plant without it
  /// or with another model than the scenario's.
  const mjData* evaluated = nullptr;

  /// Gap between fingertip and object from which on they count as far apart, m.
  static constexpr double kFar = 5e-3;
};

/// Contact of one fingertip in the plant.
struct PlantContact {
  bool touching = false;
  Vector3d position = Vector3d::Zero();  ///< World, m.
  Vector3d normal = Vector3d::Zero();    ///< World, from the fingertip into the object.
  double distance = 0.0;                 ///< m, negative when the bodies overlap.
  Vector3d force = Vector3d::Zero();     ///< Force of the finger on the object, world, N.
};

/// Forces between two bodies that should not touch.
struct Collision {
  double force = 0.0;          ///< N
  int geom1 = -1, geom2 = -1;  ///< The engine's.
};

/// Contact of two bodies in the engine; the deepest contact when there are several.
struct BodyContact {
  bool touching = false;
  double distance = 0.0;             ///< m, negative when the bodies overlap.
  Vector3d slip = Vector3d::Zero();  ///< Tangential velocity of `body` against the other, world, m/s.
  double cone_use = 0.0;             ///< |tangential force| / (mu normal force); 1 slides.
  double cone_margin = 0.0;          ///< mu normal force - |tangential force|, N.
};

/// A foot's contact with the ground.
struct GroundContact : BodyContact {
  Vector3d force = Vector3d::Zero();  ///< Force of the ground on the foot, world, N.
};

/// A force and a torque on one of the engine's bodies, in world axes.
struct BodyForce {
  int body = 0;
  Vector3d point = Vector3d::Zero();   ///< Point of action of the force, m.
  Vector3d force = Vector3d::Zero();   ///< N.
  Vector3d torque = Vector3d::Zero();  ///< N m.
};

/// Contact of two geoms in the engine.
struct EngineContact {
  int geom1 = -1, geom2 = -1;             ///< The engine's.
  int dim = 0;                            ///< 1 without friction; 3, 4 or 6.
  double distance = 0.0, margin = 0.0;    ///< m; forces act below the margin.
  Vector3d position = Vector3d::Zero();   ///< World, m.
  Matrix3d frame = Matrix3d::Identity();  ///< Rows: the normal from geom1 to geom2, and two tangents.
  std::array<double, 5> friction{}, solimp{};
  std::array<double, 2> solref{}, solref_friction{};  ///< Along the normal, and along the surface.
};

/// One row of the engine's constraints.
struct ConstraintRow {
  int type = 0;        ///< mjtConstraint.
  int id = -1;         ///< Index of its contact in the step, or the engine's id of a joint, dof or equality.
  double force = 0.0;  ///< N or N m.
};

/// Accelerations and forces of the same step, for the torques that were applied.
struct PlantResponse {
  VectorXd xi_dot;                       ///< n.
  Vector6d V_Bo_dot = Vector6d::Zero();  ///< Sigma_o.
  std::vector<PlantContact> contacts;    ///< By fingertip.
  std::vector<BodyContact> fingertips;   ///< How the fingertips slip on the object.
  std::vector<BodyContact> wheels;       ///< How the right and left wheel slip on the floor.
  std::vector<GroundContact> feet;       ///< Feet of a robot that stands.
  Vector6d support_wrench =
      Vector6d::Zero();        ///< Wrench on the object from everything except fingertips, Sigma_o, N, N m.
  double support_force = 0.0;  ///< Its upward part, N.
  /// Counts of the engine; 0 for a plant without it.
  int contact_count = 0, constraint_rows = 0;
  Collision collision;     ///< The largest, for a plant whose bodies push; see Clearance.
  VectorXd motor_torques;  ///< n, N m: torques that wheels and joints received from their motors, as tau'.
  /// n, N and N m, as forces on xi, empty where there are none: dry friction of the joints, and their limits.
  VectorXd dry_friction, stop_force;
  // Quantities of the engine, empty for a plant without it.
  VectorXd qacc;  ///< Accelerations (nv).
  VectorXd
      left_over;  ///< M qacc less all forces, by the engine's own numbers (nv): the solver's remaining error.
  VectorXd mass;  ///< Entries of M as the engine keeps them (GetMassEntries).
  VectorXd bias;  ///< Coriolis forces, gravity and damping (nv).
  std::vector<BodyForce> forces;  ///< Forces of contacts and of joined points on each body.
  std::vector<EngineContact> engine_contacts;
  std::vector<ConstraintRow> rows;  ///< In the engine's order.
};

/// A force and a torque that act on one body, in world axes.
struct Wrench {
  static constexpr int kObject = -2;
  int body = kObject;                  ///< Index of the joint that moves the link; -1 is the base.
  Vector3d point = Vector3d::Zero();   ///< Point of action of the force, m.
  Vector3d force = Vector3d::Zero();   ///< N.
  Vector3d torque = Vector3d::Zero();  ///< N m.
};

/// The simulation left the region where its numbers mean anything.
class DivergenceError : public Error {
 public:
  using Error::Error;
};

/// The simulated robot failed: fell, or reached a motor's limit.
class RunFailure : public Error {
 public:
  using Error::Error;
};

/// The motor of one entry of tau'.
struct Motor {
  std::string name;    ///< Name of its joint.
  double limit = 0.0;  ///< Limit of |tau'|, N m; infinity without.
};

/// One plant. A step has two halves, so that a controller can be put between them:
///
///   BeginStep              positions, velocities, contacts
///   Read(PlantReading*)
///   EndStep(tau')          accelerations and forces for these torques, then the state a time step later
///   Read(PlantResponse*)
class Plant {
 public:
  virtual ~Plant() = default;
  Plant(const Plant&) = delete;
  Plant& operator=(const Plant&) = delete;

  /// Time step, s.
  [[nodiscard]] virtual double time_step() const = 0;
  /// Motors by entry of tau'.
  [[nodiscard]] virtual std::span<const Motor> motors() const = 0;

  virtual void BeginStep() = 0;
  /// Reads the true state; between BeginStep and EndStep.
  virtual void Read(PlantReading* reading) = 0;
  /// Adds pushes that act during the step whose torques come next.
  /// @throws InputError when there are any and this kind of plant takes none.
  virtual void Push(std::span<const Wrench> wrenches) {
    if (!wrenches.empty()) throw InputError("disturbance: this plant takes no pushes");
  }
  /// @param tau tau' (n), N m: of the right and left wheel, then of the joints.
  /// @throws DivergenceError when there is no state afterwards.
  virtual void EndStep(const Eigen::Ref<const VectorXd>& tau) = 0;
  /// Reads the response; after EndStep, for a step whose reading was read.
  virtual void Read(PlantResponse* response) = 0;

  // Between steps.

  /// Puts robot and object at rest at q' and X_Bo.
  virtual void Place(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo) = 0;
  /// Adds v (m/s, world) to the velocity of robot and object: the platform drives straight ahead at v with
  /// rolling wheels. @param state last read.
  virtual void AddVelocity(const MeasuredState& state, const Vector3d& v) = 0;
  /// Moves robot and object by `way` (m, world, horizontal).
  virtual void Translate(const Vector3d& way) = 0;

 protected:
  Plant() = default;
};

/// Inputs of every part of a loop that must make the same numbers again.
struct PartContext {
  const RobotModel* model = nullptr;
  size_t num_contacts = 0;
  double time_step = 0.0;  ///< s.
  std::uint64_t seed = 0;
  std::string source;  ///< The scenario's file, for messages.
};

/// Integration method of the rigid plant.
enum class Integrator {
  kRungeKutta4,  ///< Four evaluations, fourth order for the torques given; velocities and positions of one
                 ///< time.
  /// One evaluation: new velocities, then positions by them. Velocities belong to the middle of the step
  /// before, as the engine's.
  kSemiImplicitEuler,
};

// Twist and wheel rates of a differential drive in the plant: a wheel at y on the axle rolls at (v - w y) /
// r. The controller has formulas of its own (controller/model/platform.h).

/// Rates of the wheels at y = -b/2 (right) and b/2 (left), rad/s. @param twist [v; w], m/s and rad/s.
inline Vector2d CalcWheelRatesOfTwist(const Base& base, const Vector2d& twist) {
  const double y = 0.5 * base.wheel_distance;
  return Vector2d(twist[0] + twist[1] * y, twist[0] - twist[1] * y) / base.wheel_radius;
}

/// Returns the twist at which the wheels have these rates.
inline Vector2d CalcTwist(const Base& base, const Vector2d& rates) {
  const double r = base.wheel_radius;
  return {0.5 * r * rates.sum(), r * (rates[0] - rates[1]) / base.wheel_distance};
}

/// The base's entries of xi at this twist.
inline Vector2d CalcDriveVelocityOfTwist(const Base& base, const Vector2d& twist) {
  return base.velocity == DriveVelocity::kTwist ? twist : CalcWheelRatesOfTwist(base, twist);
}

}  // namespace dexcheck
