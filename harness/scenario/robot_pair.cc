#include "harness/scenario/robot_pair.h"

#include <algorithm>
#include <string>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/parameter_reader.h"
#include "harness/base/files.h"
#include "harness/comparison/engine_constants.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

/// Nothing moves in a run but the robot, its base and its object.
void RequireNothingElse(const Adapter& adapter, const std::string& mjcf) {
  if (adapter.other_joints().empty()) return;
  throw InputError(mjcf + ": must have nothing that moves but the robot and its object, has joint " +
                   Quote(NameOf(adapter.engine(), mjOBJ_JOINT, adapter.other_joints().front())));
}

void RequireUsable(const Scenario& scenario, const RobotModel& model) {
  const std::string& robot = model.spec().source;
  if ((model.base().type == BaseType::kFloating) != scenario.stands()) {
    throw InputError(scenario.stands() ? robot + ": base.type: must be \"floating\" to stand on feet"
                                       : robot +
                                             ": base.type: must not be \"floating\" in a run, unless the "
                                             "robot stands on feet ([stance])");
  }
  RequireNoBalls(model, "in a run, whose law has one number for each joint");
  if (!model.object() && scenario.joint_task() == nullptr) {
    throw InputError(robot + ": object: is missing, and the scenario holds one");
  }
}

/// The robot that a rigid plant moves: the scenario's, whatever the controller is made to believe.
std::unique_ptr<RobotModel> ReadRigidModel(const Scenario& scenario, const std::string& robot) {
  if (scenario.plant.type != PlantType::kRigid) return nullptr;
  const auto first = scenario.model_overrides.begin();
  const std::vector<std::string> own(first,
                                     first + static_cast<std::ptrdiff_t>(scenario.own_model_overrides));
  return std::make_unique<RobotModel>(ParseRobotModel(ReadBytes(robot), robot, own));
}

/// Gives contact pairs this friction along the surface, those with a floor or all others.
void SetFriction(double mu, bool of_floors, mjModel* engine) {
  const mjModel& m = *engine;
  for (int pair = 0; pair < m.npair; ++pair) {
    const bool has_floor =
        m.geom_type[m.pair_geom1[pair]] == mjGEOM_PLANE || m.geom_type[m.pair_geom2[pair]] == mjGEOM_PLANE;
    if (has_floor == of_floors) m.pair_friction[5 * pair] = m.pair_friction[5 * pair + 1] = mu;
  }
}

void ApplyFriction(const PlantOptions& plant, mjModel* engine) {
  if (plant.floor_friction) SetFriction(*plant.floor_friction, true, engine);
  if (plant.finger_friction) SetFriction(*plant.finger_friction, false, engine);
}

void ApplyPlantOptions(const PlantOptions& plant, mjModel* engine) {
  mjModel& m = *engine;
  ApplyFriction(plant, engine);
  m.opt.timestep = plant.time_step;
  m.opt.impratio = plant.impratio;
  m.opt.noslip_iterations = plant.noslip_iterations;
  const double time_constant =
      plant.contact_time_constant > 0.0 ? plant.contact_time_constant : 2.0 * plant.time_step;
  for (int pair = 0; pair < m.npair; ++pair) {
    SetStiffness(time_constant, plant.contact_impedance, m.pair_solref + mjNREF * pair,
                 m.pair_solimp + mjNIMP * pair);
  }
  // By default dry friction creeps until (1 - d) f tc / (2 M): by radians a second at joints of little
  // inertia.
  for (int dof = 0; dof < m.nv; ++dof) {
    if (m.dof_frictionloss[dof] > 0.0)
      SetStiffness(time_constant, plant.contact_impedance, m.dof_solref + mjNREF * dof,
                   m.dof_solimp + mjNIMP * dof);
  }
}

/// Lists the pairs, and lets them push when the scenario says so; some MJCFs do by themselves.
void WatchBodies(const Scenario& scenario, const std::string& mjcf, RobotPair* robots) {
  const PlantOptions& plant = scenario.plant;
  robots->watched_pairs = ListWatchedPairs(*robots->engine, *robots->adapter, robots->solids,
                                           plant.allowed_collision_pairs, scenario.source);
  if (!plant.collide) return;
  robots->engine = AddContactPairs(*robots->engine, ListGeoms(*robots), mjcf);
  robots->adapter = std::make_unique<Adapter>(robots->model, *robots->engine, mjcf);
}

}  // namespace

void SetFingerFriction(double mu, mjModel* engine) { SetFriction(mu, false, engine); }

void SetStiffness(double time_constant, double impedance, mjtNum* solref, mjtNum* solimp) {
  solref[0] = time_constant;
  solref[1] = 1.0;
  const mjtNum constant[mjNIMP] = {impedance, impedance, 0.001, 0.5, 2.0};  // the last three without effect
  std::copy_n(constant, mjNIMP, solimp);
}

bool LetsBodiesPush(const PlantOptions& plant, const mjModel& engine) {
  return plant.collide || CollidesByType(engine);
}

std::vector<std::pair<int, int>> ListGeoms(const RobotPair& robots) {
  std::vector<std::pair<int, int>> geoms;
  for (const WatchedPair& pair : robots.watched_pairs) {
    geoms.emplace_back(robots.solids.list[static_cast<size_t>(pair.a)].geom,
                       robots.solids.list[static_cast<size_t>(pair.b)].geom);
  }
  return geoms;
}

std::vector<std::pair<int, int>> ListPushingGeoms(const RobotPair& robots) {
  const mjModel& m = *robots.engine;
  std::vector<bool> is_shape(static_cast<size_t>(m.ngeom), false);
  for (const Solid& solid : robots.solids.list) is_shape[static_cast<size_t>(solid.geom)] = true;
  const auto list_geoms = [&](int solid) {
    const Solid& shape = robots.solids.list[static_cast<size_t>(solid)];
    std::vector<int> geoms = {shape.geom};
    for (int i = 0; i < m.body_geomnum[shape.body]; ++i) {
      const int geom = m.body_geomadr[shape.body] + i;
      if (!is_shape[static_cast<size_t>(geom)] && CanTouch(m, geom)) geoms.push_back(geom);
    }
    return geoms;
  };
  std::vector<std::pair<int, int>> pushing;
  for (const WatchedPair& pair : robots.watched_pairs)
    for (const int a : list_geoms(pair.a))
      for (const int b : list_geoms(pair.b)) pushing.emplace_back(a, b);
  return pushing;
}

RobotPair::RobotPair(const Scenario& scenario, RobotModel the_model, const std::filesystem::path& mjcf,
                     MjModelPtr the_engine)
    : model(std::move(the_model)),
      engine(std::move(the_engine)),
      rigid(ReadRigidModel(scenario, model.spec().source)) {
  RequireUsable(scenario, model);
  solids = ListSolids(*engine);
  adapter = std::make_unique<Adapter>(model, *engine, mjcf.string());
  RequireNothingElse(*adapter, mjcf.string());
  ApplyFriction(scenario.plant, engine.get());
  constants = CheckConstants(*adapter);
  if (scenario.tolerance > 0.0) JudgeByTolerance(scenario.tolerance, &constants);
  WatchBodies(scenario, mjcf.string(), this);
  ApplyPlantOptions(scenario.plant, engine.get());
}

DeclaredMismatch::DeclaredMismatch(RobotModel the_plant, MjModelPtr engine_without, const mjModel& engine,
                                   const RobotModel& model, const std::string& source)
    : plant(std::move(the_plant)),
      without(std::move(engine_without)),
      plant_adapter(plant, engine, source),
      controller_adapter(model, *without, source) {}

}  // namespace dexcheck
