#pragma once

// Differences between MuJoCo's releases that dexcheck's code depends on: everything that must be written in
// two ways stands here. Debian 12 has 2.2.2.
//
// | since | what |
// |---|---|
// | 2.3   | names are found by a table whose size follows from the model's; geoms may be of plugins |
// | 3.0   | option collision is gone; eq_active is what acts now, eq_active0 what acts at first |
// | 3.0   | bodies have trees of their geoms; signatures of pairs count bodies from 0 |
// | 3.2   | files in memory by mj_addBufferVFS; mj_makeEmptyFileVFS and the tables of mjVFS are gone |
// | 3.2   | (or before) a frame within 1e-6 of its body's is taken for it |
// | 3.2   | (or before) mjv_connector takes points; sensors have no noise |
// | 3.2.3 | mpr_iterations, mpr_tolerance are ccd_iterations, ccd_tolerance |
// | 3.3   | mj_makeM makes the mass matrix, rotors of tendons included |
// | 3.3.3 | lights have a type in the place of whether they are directional |
// | 3.5   | version numbers have three digits for minor and patch: 3005000; sizes are mjtSize |
// | 3.5   | mj_ray gives the normal of what it meets |
// | 3.6   | the tendons' Jacobian is sparse in any case, and its rows are the model's |
// | 3.7   | collision functions get data that they may write |
// | 3.8   | there is room for mj_maxContact of them, 1 of a sphere, in the place of mjMAXCONPAIR |
// | 3.9   | they fill mjPreContact (distance, position, normal, tangent) in the place of mjContact |
// | 3.10  | mj_fullM(m, d, M) |
// | 3.11  | qM is gone: M has compressed rows of the lower triangle |
// | 3.11  | of bodies whose frame is their inertial frame, the attribute simple leaves entries out of M |
// | 3.11  | actuators may have several controls and forces |
//
// Changes of the MJCF format (limits by default, ...) stand in newer_words.cc and newer_mjcf.cc.

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <string>
#include <type_traits>
#include <utility>

namespace dexcheck {

static_assert(mjVERSION_HEADER == 222 || mjVERSION_HEADER >= 320,
              "dexcheck is written for MuJoCo 2.2.2 and 3.2 or newer");

/// Type of the number of a model's elements.
#if mjVERSION_HEADER >= 3005000
using EngineSize = mjtSize;
#else
using EngineSize = int;
#endif

/// Type of a flag such as jnt_limited, actuator_ctrllimited: a byte, or in later releases a bool.
using EngineFlag = std::remove_pointer_t<decltype(mjModel::jnt_limited)>;

/// Whether geoms may collide by their masks (contype, conaffinity), and whether those of <pair>s may. An
/// option of 2.2.2 excludes one of them; in 3.x both may, and geoms whose masks are zero do not collide.
#if mjVERSION_HEADER >= 300
inline bool CollidesByType(const mjModel& m) {
  const auto is_set = [](int mask) { return mask != 0; };
  return std::any_of(m.geom_contype, m.geom_contype + m.ngeom, is_set) ||
         std::any_of(m.geom_conaffinity, m.geom_conaffinity + m.ngeom, is_set);
}
inline bool CollidesByPair(const mjModel& /*m*/) { return true; }
/// The option's value, and the setting of "all", which is fixed where there is no such option.
inline int GetCollisionOption(const mjModel& /*m*/) { return 0; }
inline void LetBothCollide(mjModel* /*m*/) {}
#else
inline bool CollidesByType(const mjModel& m) { return m.opt.collision != mjCOL_PAIR; }
inline bool CollidesByPair(const mjModel& m) { return m.opt.collision != mjCOL_DYNAMIC; }
inline int GetCollisionOption(const mjModel& m) { return m.opt.collision; }
inline void LetBothCollide(mjModel* m) { m->opt.collision = mjCOL_ALL; }
#endif

/// Member that says of each equality constraint whether it is active when a run starts.
#if mjVERSION_HEADER >= 300
inline constexpr auto kEqualityActive = &mjModel::eq_active0;
#else
inline constexpr auto kEqualityActive = &mjModel::eq_active;
#endif
inline auto* GetEqualityActive(const mjModel& m) { return m.*kEqualityActive; }

/// Enable flag that adds noise to sensors; 0 where there is none.
#if mjVERSION_HEADER >= 320
inline constexpr int kSensorNoiseFlag = 0;
#else
inline constexpr int kSensorNoiseFlag = mjENBL_SENSORNOISE;
#endif

/// Limits of the general collider of convex bodies: most iterations, and tolerance, m.
#if mjVERSION_HEADER >= 323
inline int GetColliderIterations(const mjOption& option) { return option.ccd_iterations; }
inline mjtNum GetColliderTolerance(const mjOption& option) { return option.ccd_tolerance; }
#else
inline int GetColliderIterations(const mjOption& option) { return option.mpr_iterations; }
inline mjtNum GetColliderTolerance(const mjOption& option) { return option.mpr_tolerance; }
#endif

/// Whether a light is directional: the same everywhere.
inline bool IsDirectional(const mjModel& m, int light) {
#if mjVERSION_HEADER >= 333
  return m.light_type[light] == mjLIGHT_DIRECTIONAL;
#else
  return m.light_directional[light] != 0;
#endif
}

/// Describes a warning of the engine. Its information is an int, or in later releases a size.
template <typename Info>
std::string DescribeWarning(const char* (*text)(int, Info), const mjData& d, int warning) {
  return text(warning, static_cast<Info>(d.warning[warning].lastinfo));
}
inline std::string DescribeWarning(const mjData& d, int warning) {
  return DescribeWarning(mju_warningText, d, warning);
}

/// Keeps frames where they are: later releases take a frame within 1e-6 of its body's for the body's own.
inline void KeepNearFrames([[maybe_unused]] mjModel* m) {
#if mjVERSION_HEADER >= 320
  std::fill_n(m->body_sameframe, m->nbody, mjtByte{0});
  std::fill_n(m->geom_sameframe, m->ngeom, mjtByte{0});
  std::fill_n(m->site_sameframe, m->nsite, mjtByte{0});
#endif
}

/// Whether a library that is loaded brings the plugin of that name.
inline bool HasPlugin([[maybe_unused]] const char* name) {
#if mjVERSION_HEADER >= 320
  return mjp_getPlugin(name, nullptr) != nullptr;
#else
  return false;
#endif
}

/// Stretches a drawn geom from one point to another.
inline void MakeConnector(int type, mjtNum width, const mjtNum* from, const mjtNum* to, mjvGeom* geom) {
#if mjVERSION_HEADER >= 320
  mjv_connector(geom, type, width, from, to);
#else
  mjv_makeConnector(geom, type, width, from[0], from[1], from[2], to[0], to[1], to[2]);
#endif
}

/// Returns "2.2.2" for 222, "3.12.1" for 3012001.
inline std::string FormatRelease(int version) {
  const int base = version < 1000 ? 10 : 1000;
  return std::to_string(version / (base * base)) + "." + std::to_string(version / base % base) + "." +
         std::to_string(version % base);
}

/// Adds a text as a file of that name to an empty file system in memory.
inline void AddFile(const char* name, const std::string& text, mjVFS* vfs) {
  const auto size = static_cast<int>(text.size());
#if mjVERSION_HEADER >= 320
  mj_addBufferVFS(vfs, name, text.data(), size);
#else
  mj_makeEmptyFileVFS(vfs, name, size);
  std::copy(text.begin(), text.end(), static_cast<char*>(vfs->filedata[mj_findFileVFS(vfs, name)]));
#endif
}

/// Number of the first body in the signatures of pairs and exclusions: 1 in 2.2.2.
inline constexpr int kFirstBody = mjVERSION_HEADER >= 300 ? 0 : 1;
inline int MakeSignature(int body1, int body2) { return ((body1 + kFirstBody) << 16) + body2 + kFirstBody; }
inline std::pair<int, int> ReadSignature(int signature) {
  return {(signature >> 16) - kFirstBody, (signature & 0xffff) - kFirstBody};
}

/// Whether geom_sameframe or site_sameframe states the body's inertial frame, or (3.2) its axes.
inline bool IsInertialFrame(int sameframe) { return sameframe == 2 || sameframe == 4; }

/// Returns the first actuator without exactly one control and one force, which all have in 2.2.2; -1 if none.
inline int FindWideActuator([[maybe_unused]] const mjModel& m) {
#if mjVERSION_HEADER >= 3011000
  for (int i = 0; i < m.nactuator; ++i) {
    if (m.actuator_ctrlnum[i] != 1 || m.actuator_outnum[i] != 1) return i;
  }
#endif
  return -1;
}

/// Features of the MJCF format.
inline constexpr bool kHasFrames = mjVERSION_HEADER >= 320;
inline constexpr bool kHasImplicitFast = mjVERSION_HEADER >= 300;
inline constexpr bool kHasPolynomials = mjVERSION_HEADER >= 3007000;
inline constexpr bool kHasSimpleBodies = mjVERSION_HEADER >= 3011000;

/// Forces and inertias that 2.2.2 does not have; zero where a model has none.
struct NewerForce {
  const char* check;
  const char* name;
  mjtObj type;
  mjtNum* mjModel::*values;
  int columns;
};
struct NewerPart {
  const char* name;
  EngineSize mjModel::*count;
};
#if mjVERSION_HEADER >= 320
inline constexpr NewerForce kNewerForces[] = {
    {"gravity_compensation", "gravcomp", mjOBJ_BODY, &mjModel::body_gravcomp, 1},
#if mjVERSION_HEADER >= 331
    {"tendon_armature", "armature", mjOBJ_TENDON, &mjModel::tendon_armature, 1},
#endif
#if mjVERSION_HEADER >= 3007000
    {"joint_spring", "stiffness (polynomial)", mjOBJ_JOINT, &mjModel::jnt_stiffnesspoly, mjNPOLY},
    {"joint_damping", "damping (polynomial)", mjOBJ_DOF, &mjModel::dof_dampingpoly, mjNPOLY},
    {"tendon_spring", "stiffness (polynomial)", mjOBJ_TENDON, &mjModel::tendon_stiffnesspoly, mjNPOLY},
    {"tendon_damping", "damping (polynomial)", mjOBJ_TENDON, &mjModel::tendon_dampingpoly, mjNPOLY},
    {"motor_damping", "damping", mjOBJ_ACTUATOR, &mjModel::actuator_damping, 1},
    {"motor_damping", "damping (polynomial)", mjOBJ_ACTUATOR, &mjModel::actuator_dampingpoly, mjNPOLY},
    {"motor_armature", "armature", mjOBJ_ACTUATOR, &mjModel::actuator_armature, 1},
#endif
};
inline constexpr NewerPart kNewerParts[] = {{"flex", &mjModel::nflex}, {"plugin", &mjModel::nplugin}};
#else
inline constexpr std::array<NewerForce, 0> kNewerForces = {};
inline constexpr std::array<NewerPart, 0> kNewerParts = {};
#endif

/// Removes the elastic forces of flexes. @return the number of flexes.
inline int LeaveOutFlexes([[maybe_unused]] mjModel* m) {
#if mjVERSION_HEADER >= 3012000
  std::fill_n(m->flex_stiffness, m->nflexstiffness, 0.0);
  std::fill_n(m->flex_bending, m->nflexbending, 0.0);
  for (mjtNum* const values : {m->flex_damping, m->flex_edgestiffness, m->flex_edgedamping})
    std::fill_n(values, m->nflex, 0.0);
  return static_cast<int>(m->nflex);
#else
  return 0;
#endif
}

/// Calculates the mass matrix at the positions that mj_kinematics and mj_comPos have set.
inline void MakeMass(const mjModel& m, mjData* d) {
#if mjVERSION_HEADER >= 330
  mj_makeM(&m, d);
#else
  mj_crb(&m, d);
#endif
}

/// Entries of it that can differ from zero: of each dof with itself and with the dofs that it hangs on.
inline const mjtNum* GetMassEntries(const mjData& d) {
#if mjVERSION_HEADER >= 3011000
  return d.M;
#else
  return d.qM;
#endif
}

/// Returns the address of a dof's entry with the one `steps` toward the root; -1 when it is always zero.
inline int FindMassEntry(const mjModel& m, int dof, int steps) {
#if mjVERSION_HEADER >= 3011000
  return steps < m.M_rownnz[dof] ? m.M_rowadr[dof] + m.M_rownnz[dof] - 1 - steps : -1;
#else
  return m.dof_Madr[dof] + steps;
#endif
}

/// The whole mass matrix, nv x nv.
inline void ExpandMass(const mjModel& m, const mjData& d, mjtNum* M) {
#if mjVERSION_HEADER >= 3010000
  mj_fullM(&m, &d, M);
#else
  mj_fullM(&m, M, d.qM);
#endif
}

/// Calculates ten_velocity = ten_J qvel, with the Jacobian that mj_tendon left.
inline void CalcTendonVelocities(const mjModel& m, mjData* d) {
#if mjVERSION_HEADER >= 3006000
  const int* const starts = m.ten_J_rowadr;
  const int* const counts = m.ten_J_rownnz;
  const int* const columns = m.ten_J_colind;
#else
  if (mj_isSparse(&m) == 0) {
    mju_mulMatVec(d->ten_velocity, d->ten_J, d->qvel, m.ntendon, m.nv);
    return;
  }
  const int* const starts = d->ten_J_rowadr;
  const int* const counts = d->ten_J_rownnz;
  const int* const columns = d->ten_J_colind;
#endif
  for (int i = 0; i < m.ntendon; ++i) {
    d->ten_velocity[i] = 0.0;
    for (int k = starts[i]; k < starts[i] + counts[i]; ++k)
      d->ten_velocity[i] += d->ten_J[k] * d->qvel[columns[k]];
  }
}

// Arguments of collision functions.
#if mjVERSION_HEADER >= 3009000
using CollisionData = mjData;
using CollisionContact = mjPreContact;
inline mjtNum* NormalOf(CollisionContact* contact) { return contact->normal; }
inline mjtNum* TangentOf(CollisionContact* contact) { return contact->tangent; }
#else
#if mjVERSION_HEADER >= 3007000
using CollisionData = mjData;
#else
using CollisionData = const mjData;
#endif
using CollisionContact = mjContact;
inline mjtNum* NormalOf(CollisionContact* contact) { return contact->frame; }
inline mjtNum* TangentOf(CollisionContact* contact) { return contact->frame + 3; }
#endif

/// Returns the solref of a contact's friction, which in later releases may differ from that of its normal.
inline const mjtNum* GetFrictionReference(const mjContact& contact) {
#if mjVERSION_HEADER >= 300
  if (contact.solreffriction[0] != 0.0 || contact.solreffriction[1] != 0.0) return contact.solreffriction;
#endif
  return contact.solref;
}

inline const mjtNum* GetFrictionReference(const mjModel& m, int pair) {
  const mjtNum* const reference = m.pair_solref + mjNREF * pair;
#if mjVERSION_HEADER >= 300
  const mjtNum* const own = m.pair_solreffriction + mjNREF * pair;
  if (own[0] != 0.0 || own[1] != 0.0) return own;
#endif
  return reference;
}

/// Returns the number of contacts that a collision function may fill for two geoms.
inline int CountMostContacts([[maybe_unused]] const mjModel& m, [[maybe_unused]] int geom1,
                             [[maybe_unused]] int geom2, [[maybe_unused]] mjtNum margin) {
#if mjVERSION_HEADER >= 3008000
  return mj_maxContact(&m, geom1, geom2, margin > 0.0 ? 1 : 0);
#else
  return mjMAXCONPAIR;
#endif
}

/// Fills a contact of a collision function; the engine completes the tangents.
/// @param position, normal x, y, z in the world; the normal points from the first geom to the second.
inline void FillContact(mjtNum distance, const mjtNum* position, const mjtNum* normal,
                        CollisionContact* contact) {
  contact->dist = distance;
  mju_copy3(contact->pos, position);
  mju_copy3(NormalOf(contact), normal);
  mju_zero3(TangentOf(contact));
}

}  // namespace dexcheck
