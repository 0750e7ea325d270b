#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "controller/model/robot_model.h"
#include "harness/comparison/constant_checks.h"
#include "harness/engine/adapter.h"
#include "harness/engine/clearance.h"
#include "harness/engine/engine.h"
#include "harness/scenario/scenario.h"

namespace dexcheck {

/// A mismatch that the scenario declares: the plant's robot is not the one that the controller knows.
struct DeclaredMismatch {
  /// @param model, without, engine as the members; @param source the MJCF, for messages.
  DeclaredMismatch(RobotModel plant, MjModelPtr without, const mjModel& engine, const RobotModel& model,
                   const std::string& source);

  RobotModel plant;            ///< What the engine's robot is.
  MjModelPtr without;          ///< The engine's robot as it would be without the mismatch.
  Adapter plant_adapter;       ///< Of `plant` and the engine.
  Adapter controller_adapter;  ///< Of the controller's model and `without`.
};

/// A robot's two descriptions with the changes of a scenario, and which joint and body of one is which of the
/// other. Stays where it was made.
struct RobotPair {
  /// @param model read already, with the scenario's overrides. @param mjcf names the engine's in messages.
  /// @throws InputError when the two do not fit each other or the scenario.
  RobotPair(const Scenario& scenario, RobotModel model, const std::filesystem::path& mjcf, MjModelPtr engine);
  RobotPair(const RobotPair&) = delete;
  RobotPair& operator=(const RobotPair&) = delete;

  RobotModel model;                  ///< What the controller knows.
  MjModelPtr engine;                 ///< The plant's robot, its object and scene.
  std::unique_ptr<Adapter> adapter;  ///< Of the two.
  /// The robot that a rigid plant moves, without what the controller alone is made to believe; null for the
  /// engine.
  std::unique_ptr<RobotModel> rigid;
  std::unique_ptr<DeclaredMismatch> declared;  ///< Null without one.
  ConstantChecks
      constants;  ///< What the two disagree on before anything moves, with the friction of the scenario.
  Solids solids;  ///< The shapes of all bodies,
  std::vector<WatchedPair> watched_pairs;  ///< and those pairs that should not touch.
};

/// Whether bodies that must not touch push each other: as the scenario says, or by the MJCF's masks.
bool LetsBodiesPush(const PlantOptions& plant, const mjModel& engine);

/// The geoms of the pairs that are watched.
std::vector<std::pair<int, int>> ListGeoms(const RobotPair& robots);

/// These, and what the same bodies have besides their shapes: geoms that are seen may collide, too.
std::vector<std::pair<int, int>> ListPushingGeoms(const RobotPair& robots);

/// Makes the plant's robot what the scenario declares it to be, if it does.
/// @throws InputError when a link or joint is not there.
void DeclareMismatch(const Scenario& scenario, const std::filesystem::path& mjcf, RobotPair* robots);

/// Gives all contact pairs but those with a floor this friction along the surface.
void SetFingerFriction(double mu, mjModel* engine);

/// Makes contacts of the engine critically damped, of constant impedance, whatever the MJCF says.
void SetStiffness(double time_constant, double impedance, mjtNum* solref, mjtNum* solimp);

}  // namespace dexcheck
