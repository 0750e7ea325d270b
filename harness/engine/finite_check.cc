#include "harness/engine/finite_check.h"

#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/engine/engine.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

/// One attribute of all elements of a kind: `count` entries of `width` numbers.
struct Attribute {
  const char* kind;
  mjtObj type;
  const char* name;
  const mjtNum* values;
  EngineSize count;
  int width;
  const int* owner = nullptr;  ///< Element of each entry where they are not the same.
};

}  // namespace

void CheckFinite(const mjModel& model, const std::string& source) {
  const auto check = [&](const mjtNum* values, EngineSize count, const auto& describe) {
    for (EngineSize i = 0; i < count; ++i) {
      if (std::isfinite(values[i])) continue;
      throw InputError(source + ": " + describe(i) + " must be finite, got " + FormatNumber(values[i]));
    }
  };
  const auto option = [](const char* name) {
    return [name](EngineSize) { return std::string("option ") + name; };
  };
  check(&model.opt.timestep, 1, option("timestep"));
  check(model.opt.gravity, 3, option("gravity"));
  check(&model.opt.density, 1, option("density"));
  check(&model.opt.viscosity, 1, option("viscosity"));

  const Attribute attributes[] = {
      {"body", mjOBJ_BODY, "pos", model.body_pos, model.nbody, 3},
      {"body", mjOBJ_BODY, "quat", model.body_quat, model.nbody, 4},
      {"body", mjOBJ_BODY, "inertial pos", model.body_ipos, model.nbody, 3},
      {"body", mjOBJ_BODY, "inertial quat", model.body_iquat, model.nbody, 4},
      {"body", mjOBJ_BODY, "mass", model.body_mass, model.nbody, 1},
      {"body", mjOBJ_BODY, "inertia", model.body_inertia, model.nbody, 3},
      {"joint", mjOBJ_JOINT, "pos", model.jnt_pos, model.njnt, 3},
      {"joint", mjOBJ_JOINT, "axis", model.jnt_axis, model.njnt, 3},
      {"joint", mjOBJ_JOINT, "range", model.jnt_range, model.njnt, 2},
      {"joint", mjOBJ_JOINT, "stiffness", model.jnt_stiffness, model.njnt, 1},
      {"joint", mjOBJ_JOINT, "armature", model.dof_armature, model.nv, 1, model.dof_jntid},
      {"joint", mjOBJ_JOINT, "damping", model.dof_damping, model.nv, 1, model.dof_jntid},
      {"joint", mjOBJ_JOINT, "frictionloss", model.dof_frictionloss, model.nv, 1, model.dof_jntid},
      {"geom", mjOBJ_GEOM, "pos", model.geom_pos, model.ngeom, 3},
      {"geom", mjOBJ_GEOM, "quat", model.geom_quat, model.ngeom, 4},
      {"geom", mjOBJ_GEOM, "size", model.geom_size, model.ngeom, 3},
      {"geom", mjOBJ_GEOM, "friction", model.geom_friction, model.ngeom, 3},
      {"site", mjOBJ_SITE, "pos", model.site_pos, model.nsite, 3},
      {"site", mjOBJ_SITE, "quat", model.site_quat, model.nsite, 4},
      {"pair", mjOBJ_PAIR, "friction", model.pair_friction, model.npair, 5},
  };
  for (const Attribute& attribute : attributes) {
    check(attribute.values, attribute.count * attribute.width, [&](EngineSize i) {
      const auto entry = static_cast<int>(i / attribute.width);
      const int element = attribute.owner == nullptr ? entry : attribute.owner[entry];
      return std::string(attribute.kind) + " " + Quote(NameOf(model, attribute.type, element)) + ": " +
             attribute.name;
    });
  }
}

}  // namespace dexcheck
