#pragma once

// The description of a run: plant, model, grasp, trajectory, controller, checks. Read from a TOML file; the
// shipped ones are in harness/shipped/scenarios.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "controller/common/toml_reader.h"
#include "controller/common/types.h"
#include "controller/contact/surface.h"
#include "controller/control/baseline_law.h"
#include "controller/control/computed_torque.h"
#include "controller/control/grasp_terms.h"
#include "controller/control/joint_motion.h"
#include "controller/control/trajectory.h"
#include "controller/handling/pick_and_place.h"
#include "harness/plant/imperfections.h"
#include "harness/plant/plant.h"

namespace dexcheck {

/// How a run begins.
enum class Start {
  kMoving,  ///< Settled, then robot and object move with X_d_dot(0) from before t = 0 on.
  kRest,    ///< Settled at rest; X_d takes off at t = 0 as its formula says.
};

/// The plant that simulates robot and object.
enum class PlantType {
  kEngine,  ///< MuJoCo.
  kRigid,   ///< The paper's own equations, (46) and (48).
};

/// The plant, and changes to the MJCF's.
struct PlantOptions {
  PlantType type = PlantType::kEngine;
  Integrator integrator = Integrator::kRungeKutta4;  ///< kRigid.
  double time_step = 1e-3;                           ///< s.
  double control_step = 0.0;                         ///< Torques are held this long, s; 0 for every step.
  double contact_time_constant = 0.0;  ///< solref of all contact pairs, s; 0 for twice the time step.
  double contact_impedance = 0.99;     ///< solimp, constant.
  double impratio = 100.0;
  int noslip_iterations = 0;
  bool bonded = false;            ///< Fingertips hang on the object by ball joints instead of contacts.
  bool implicit_damping = false;  ///< The engine's own treatment of joint damping.
  std::optional<double> floor_friction;   ///< mu of wheels on the floor.
  std::optional<double> finger_friction;  ///< mu of fingertips on the object.
  bool collide = false;                   ///< Bodies that should not touch push each other.
  /// Two bodies each that may touch, or pass through each other, unwatched.
  std::vector<std::pair<std::string, std::string>> allowed_collision_pairs;

  /// By how much velocities are older than positions, s.
  [[nodiscard]] double velocity_age() const {
    return type == PlantType::kRigid && integrator == Integrator::kRungeKutta4 ? 0.0 : 0.5 * time_step;
  }
};

/// Place and manner in which the object is held.
struct GraspOptions {
  std::vector<std::string> fingertips;  ///< Frames.
  std::vector<SurfacePoint> contacts;   ///< Of the object, one for each fingertip.
  /// Out of the pole, in the fingertips' frames, where fingertips are hemispheres; none for whole spheres.
  std::optional<Vector3d> hemisphere;
  std::string frame;             ///< Frame that the object is placed in; of a task: the palm.
  Pose X_FO = Pose::Identity();  ///< Object in it while it is held.
  std::vector<std::pair<std::string, double>> joints;  ///< Posture, rad; other joints are 0.
};

/// Source of the controller's contact coordinates (39).
enum class ContactSource {
  kExact,       ///< From the geometry of fingertips and object at each step.
  kIntegrated,  ///< From (40), integrated since t = 0.
};

/// Law, gains and forces.
struct ControlOptions {
  ControlLaw law = ControlLaw::kComputedTorque;
  bool names_law = false;  ///< Whether the scenario says which.
  ObjectGains gains;
  std::optional<Vector6d> stiffness;  ///< N/m, N m/rad; none: as K_p with the inertia at the start.
  std::optional<Vector6d> damping;    ///< N s/m, N m s/rad; none: as K_v.
  OrientationFeedback orientation = OrientationFeedback::kAngles;
  RedundancyWeight::Kind weight = RedundancyWeight::Kind::kIdentity;
  double platform_weight = 1.0;     ///< W of the platform's velocities; kDiagonal.
  double arm_weight = 1.0;          ///< Of joints that move several fingertips of the grasp; kDiagonal.
  double posture_frequency = 10.0;  ///< Of the null-space posture task, rad/s, critically damped.
  double f_min = 0.0;               ///< Least normal force, N.
  double f_max = 0.0;               ///< Largest, N.
  double mu = 0.0;                  ///< Friction that the grasp force counts on.
  ContactSource kappa = ContactSource::kExact;
  double contact_error = 0.0;  ///< By how much the measured kappa is wrong, rad: a fault to be found.
};

/// A controller of the user's own in the place of the scenario's law.
struct OwnControllerOptions {
  std::string run;               ///< A library (.so), a Python file (.py) or a command; empty for none.
  std::filesystem::path folder;  ///< Absolute: where relative paths start, and where a command runs.
  double time_limit = 1.0;       ///< For each reply, s; ten times that to start.
  std::vector<std::pair<std::string, double>> parameters;  ///< Of its own.

  [[nodiscard]] bool exists() const { return !run.empty(); }
};

/// The object follows a trajectory, held at the contacts of the grasp.
struct TrajectoryTask {
  TrajectoryMaker trajectory;
  Vector6d start_error = Vector6d::Zero();  ///< X_d - X_o at t = 0: m, rad.
};

/// Take the object from a support, carry it, put it down.
struct PickTask {
  Pose X_Bo = Pose::Identity();  ///< Where the object lies.
  /// Joints that may place the palm; empty for those of the arm alone.
  std::vector<std::string> arm_joints;
  PickAndPlaceOptions pick_and_place;
};

/// A number for each of several joints, as the file has it.
struct JointNumbers {
  std::vector<std::pair<std::string, double>> by_name;  ///< rad or m.
  bool in_degrees = false;                              ///< As the file wrote them; they are in rad here.
  std::string key;                                      ///< For messages.
};

/// The feet on which a robot with a floating base stands, and how its body moves there.
struct StanceTask {
  std::vector<std::string> feet;  ///< Frames.
  double mu = 0.0;                ///< Friction that the law counts on.
  double f_min = 0.0;             ///< Least normal force of a foot, N.
  double f_max = 0.0;             ///< Largest, N.
  // By axis: displacement of the base since the start, x, y, z, m, and its roll, pitch, yaw, rad.
  std::vector<JointWayPoint> points;
  std::vector<JointOscillation> oscillations;
};

/// The joints of a robot that holds nothing follow a motion of their own, or that of its body.
struct JointTask {
  struct Point {
    double time = 0.0;   ///< s.
    JointNumbers where;  ///< Joints that it does not name stay where the point before has them.
  };
  struct Oscillation : JointOscillation {
    std::string name;  ///< Of the joint.
    bool in_degrees = false;
    std::string key;
  };
  JointNumbers start;  ///< Others begin at 0.
  std::vector<Point> points;
  std::vector<Oscillation> oscillations;
  std::optional<StanceTask> stance;  ///< Of a robot that stands; its joints have no motion of their own then.

  // Gains of its law: by joint, or for all.
  ByName natural_frequency, damping_ratio;  ///< rad/s and 1.
  ByName stiffness, damping;                ///< N m/rad and N m s/rad; without a key, as the gains above.
  ByName coulomb, viscous;                  ///< Friction that it compensates, N m and N m s/rad.
  double coulomb_velocity = 0.01;           ///< At which coulomb is smoothed, rad/s.
};

/// How well the object must follow, which belongs to what the scenario means. From `from` on, s.
struct Expectation {
  std::optional<double> position;     ///< Largest position error, m.
  std::optional<double> orientation;  ///< Largest orientation error, rad.
  std::optional<double> joints;       ///< Largest error of a joint, rad or m.
  double from = 0.0;
};

/// One bound that a scenario sets for a check by name.
using BoundOverride = std::pair<std::string, double>;

/// A run.
struct Scenario {
  std::string name;
  std::string description;
  double duration = 0.0;  ///< s.
  double settle = 1.0;    ///< Before t = 0, s.
  Start start = Start::kRest;
  double tolerance = 0.0;  ///< Relative, of what model and engine are compared by where it is wider.

  std::string model_file;                    ///< Empty for the shipped one.
  std::vector<std::string> model_overrides;  ///< "PATH=VALUE" of the parameter file.
  /// How many of them, the first, stand in the scenario itself: they make the parameter file's robot that of
  /// the scene. The others change what the controller believes alone.
  size_t own_model_overrides = 0;
  std::string mjcf_file;  ///< Empty for the shipped one.
  PlantOptions plant;
  std::variant<TrajectoryTask, PickTask, JointTask> task;
  GraspOptions grasp;  ///< Not of a JointTask.
  ControlOptions control;
  OwnControllerOptions controller;
  Imperfections imperfections;
  std::vector<BoundOverride> bounds;
  /// The file without overrides, whose plant and gains its bounds were stated for; null where it has none, or
  /// says nothing without them.
  std::shared_ptr<const Scenario> written;
  Expectation expect;
  std::uint64_t seed = 0;  ///< Of random changes to posture and grasp; 0 for none.

  std::string text;                    ///< The file.
  std::string source;                  ///< Its name, for messages.
  std::vector<std::string> overrides;  ///< "PATH=VALUE" of the scenario.

  /// Whether the law that is made is known: the scenario's own, or one of the user's that it names.
  [[nodiscard]] bool knows_law() const { return !controller.exists() || control.names_law; }
  // The task, where it is of this kind; null otherwise.
  [[nodiscard]] const TrajectoryTask* trajectory_task() const { return std::get_if<TrajectoryTask>(&task); }
  [[nodiscard]] const PickTask* pick_task() const { return std::get_if<PickTask>(&task); }
  [[nodiscard]] const JointTask* joint_task() const { return std::get_if<JointTask>(&task); }
  [[nodiscard]] bool stands() const { return joint_task() != nullptr && joint_task()->stance.has_value(); }
  /// X_d - X_o at t = 0; zero where nothing is to be followed from there.
  [[nodiscard]] Vector6d start_error() const {
    return trajectory_task() == nullptr ? Vector6d::Zero() : trajectory_task()->start_error;
  }
};

/// Assignments, "PATH=VALUE" each, that make a controller of one's own the scenario's.
/// @param run, folder as OwnControllerOptions has them.
std::vector<std::string> NameController(const std::string& run, const std::filesystem::path& folder);

/// Whether "PATH=VALUE" belongs to the robot's parameter file: it begins with "model.", and is none of
/// [model].
bool IsOfModel(std::string_view assignment);

/// The text of a scenario, in which keys can be changed before it is read. A copy has the same changes.
class ScenarioDocument {
 public:
  /// Relative paths in it start at `folder`, its own. @throws InputError as TomlDocument.
  ScenarioDocument(const std::string& text, const std::string& source, std::filesystem::path folder);

  /// @param assignment "PATH=VALUE", as users write it; "model.PATH=VALUE" reaches into the parameter file.
  /// @throws InputError as TomlDocument::Override.
  void Override(const std::string& assignment);
  /// Override for a number. @throws InputError as Override.
  void Set(const std::string& path, double value);
  /// @throws InputError, one line that names file, line, key and value.
  [[nodiscard]] Scenario Read() const;

 private:
  TomlDocument document_;
  std::string text_, source_;
  std::filesystem::path folder_;
  std::vector<std::string> overrides_, model_overrides_;
};

/// Reads a scenario at once. @throws InputError as ScenarioDocument.
Scenario ParseScenario(const std::string& text, const std::string& source,
                       const std::filesystem::path& folder, const std::vector<std::string>& overrides);

}  // namespace dexcheck
