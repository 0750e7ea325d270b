#include "harness/engine/robot_tree.h"

#include <map>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"

namespace dexcheck {

int FindTree(const mjModel& engine, int joint) {
  const int root = engine.body_rootid[engine.jnt_bodyid[joint]];
  const bool floats = engine.body_jntnum[root] > 0 && engine.jnt_type[engine.body_jntadr[root]] == mjJNT_FREE;
  return floats ? root : 0;
}

RobotTree FindRobotTree(const mjModel& engine, const std::string& source) {
  std::map<int, int> joints;  // by tree: how many, free ones not counted
  for (int id = 0; id < engine.njnt; ++id) joints[FindTree(engine, id)] += engine.jnt_type[id] != mjJNT_FREE;
  RobotTree robot;
  int most = -1;
  for (const auto& [tree, count] : joints) {
    if (count > most) {
      most = count;
      robot.floating_body = tree;
    }
  }
  const auto name = [&](int tree) { return tree == 0 ? "world" : NameOf(engine, mjOBJ_BODY, tree); };
  for (const auto& [tree, count] : joints) {
    if (tree == robot.floating_body) continue;
    if (count == most) {
      throw InputError(source + ": must have one robot; " + Quote(name(robot.floating_body)) + " and " +
                       Quote(name(tree)) + " carry as many joints");
    }
    if (tree != 0) robot.others.push_back(name(tree));
  }
  if (robot.floating_body == 0) return robot;
  for (int body = 1; body < engine.nbody; ++body) {
    const bool stands_on_world = engine.body_rootid[body] == body && body != robot.floating_body;
    const int count = engine.body_jntnum[body];
    const bool moves = count > 0 && engine.jnt_type[engine.body_jntadr[body]] != mjJNT_FREE;
    if (stands_on_world && moves) robot.others.push_back(name(body));
  }
  return robot;
}

int FindTipSphere(const mjModel& engine, int site, double within) {
  if (site < 0) return -1;
  int found = -1;
  bool found_touches = false;
  double nearest = 0.0;
  for (int geom = 0; geom < engine.ngeom; ++geom) {
    if (engine.geom_bodyid[geom] != engine.site_bodyid[site] || engine.geom_type[geom] != mjGEOM_SPHERE)
      continue;
    const bool touches = CanTouch(engine, geom);
    const double apart =
        (MapVector(engine.geom_pos + 3 * geom) - MapVector(engine.site_pos + 3 * site)).norm();
    if (found >= 0 && (touches == found_touches ? apart >= nearest : found_touches)) continue;
    found = geom;
    found_touches = touches;
    nearest = apart;
  }
  return nearest <= within ? found : -1;
}

double CalcSpinInertia(const mjModel& engine, const EngineWheel& wheel) {
  const int body = engine.jnt_bodyid[wheel.joint];
  mjtNum axis[3];
  mjtNum inverse[4];
  mju_negQuat(inverse, engine.body_iquat + 4 * body);
  mju_rotVecQuat(axis, engine.jnt_axis + 3 * wheel.joint, inverse);
  const mjtNum* moments = engine.body_inertia + 3 * body;
  double spin = 0.0;
  for (int k = 0; k < 3; ++k) spin += moments[k] * axis[k] * axis[k];
  return spin;
}

}  // namespace dexcheck
