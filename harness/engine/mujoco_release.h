#pragma once

// What differs between MuJoCo's releases, as far as dexcheck's code touches it: everything that must be
// written in two ways stands here. dexcheck is built and tested with 2.2.2, which Debian 12 has. The other
// branches are written for 3.x: those of 3.12.1's public headers are compiled, and nothing was linked or run.
//
// | since | what |
// |---|---|
// | 3.0   | option collision is gone; eq_active is what acts now, eq_active0 what acts at first |
// | 3.2   | files in memory by mj_addBufferVFS; mj_makeEmptyFileVFS and the tables of mjVFS are gone |
// | 3.2   | (or before) mjv_connector takes points; sensors have no noise |
// | 3.2.3 | mpr_iterations, mpr_tolerance are ccd_iterations, ccd_tolerance |
// | 3.3   | mj_makeM makes the mass matrix, rotors of tendons included |
// | 3.5   | version numbers have three digits for minor and patch: 3005000; sizes are mjtSize |
// | 3.5   | mj_ray gives the normal of what it meets |
// | 3.6   | the tendons' Jacobian is sparse in any case, and its rows are the model's |
// | 3.7   | collision functions get data that they may write |
// | 3.9   | they fill mjPreContact (distance, position, normal, tangent) in the place of mjContact |
// | 3.10  | mj_fullM(m, d, M) |
// | 3.11  | qM is gone: M has compressed rows of the lower triangle |
//
// What an MJCF says in another way since a release (limits by default, ...) stands in newer_mjcf.cc.

#include <mujoco/mujoco.h>

#include <algorithm>
#include <string>
#include <utility>

namespace dexcheck {

static_assert(mjVERSION_HEADER == 222 || mjVERSION_HEADER >= 320,
              "dexcheck is written for MuJoCo 2.2.2 and 3.2 or newer");

/// How many elements a model has.
#if mjVERSION_HEADER >= 3005000
using EngineSize = mjtSize;
#else
using EngineSize = int;
#endif

/// Whether geoms may collide by their masks (contype, conaffinity), and whether those of <pair>s may. An
/// option of 2.2.2 excludes one of them; in 3.x both may, and geoms whose masks are zero do not collide.
#if mjVERSION_HEADER >= 300
inline bool CollidesByType(const mjModel& m) {
  const auto is_set = [](int mask) { return mask != 0; };
  return std::any_of(m.geom_contype, m.geom_contype + m.ngeom, is_set) ||
         std::any_of(m.geom_conaffinity, m.geom_conaffinity + m.ngeom, is_set);
}
inline bool CollidesByPair(const mjModel& /*m*/) { return true; }
/// The option's value; that of "all" where there is none.
inline int GetCollisionOption(const mjModel& /*m*/) { return 0; }
#else
inline bool CollidesByType(const mjModel& m) { return m.opt.collision != mjCOL_PAIR; }
inline bool CollidesByPair(const mjModel& m) { return m.opt.collision != mjCOL_DYNAMIC; }
inline int GetCollisionOption(const mjModel& m) { return m.opt.collision; }
#endif

/// By equality constraint: whether it acts when a run starts.
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

/// How the general collider of convex bodies ends: most iterations, and tolerance, m.
#if mjVERSION_HEADER >= 323
inline int GetColliderIterations(const mjOption& option) { return option.ccd_iterations; }
inline mjtNum GetColliderTolerance(const mjOption& option) { return option.ccd_tolerance; }
#else
inline int GetColliderIterations(const mjOption& option) { return option.mpr_iterations; }
inline mjtNum GetColliderTolerance(const mjOption& option) { return option.mpr_tolerance; }
#endif

/// What the engine warned of. Its information is an int, or in later releases a size.
template <typename Info>
std::string DescribeWarning(const char* (*text)(int, Info), const mjData& d, int warning) {
  return text(warning, static_cast<Info>(d.warning[warning].lastinfo));
}
inline std::string DescribeWarning(const mjData& d, int warning) {
  return DescribeWarning(mju_warningText, d, warning);
}

/// Lets a drawn geom reach from one point to another.
inline void MakeConnector(int type, mjtNum width, const mjtNum* from, const mjtNum* to, mjvGeom* geom) {
#if mjVERSION_HEADER >= 320
  mjv_connector(geom, type, width, from, to);
#else
  mjv_makeConnector(geom, type, width, from[0], from[1], from[2], to[0], to[1], to[2]);
#endif
}

/// "2.2.2" of 222, "3.12.1" of 3012001.
inline std::string FormatRelease(int version) {
  const int base = version < 1000 ? 10 : 1000;
  return std::to_string(version / (base * base)) + "." + std::to_string(version / base % base) + "." +
         std::to_string(version % base);
}

/// Puts a text as a file of that name into an empty file system in memory.
inline void AddFile(const char* name, const std::string& text, mjVFS* vfs) {
  const auto size = static_cast<int>(text.size());
#if mjVERSION_HEADER >= 320
  mj_addBufferVFS(vfs, name, text.data(), size);
#else
  mj_makeEmptyFileVFS(vfs, name, size);
  std::copy(text.begin(), text.end(), static_cast<char*>(vfs->filedata[mj_findFileVFS(vfs, name)]));
#endif
}

/// How pairs and exclusions name their two bodies, which 2.2.2 counts from 1.
inline int MakeSignature(int body1, int body2) { return ((body1 + 1) << 16) + body2 + 1; }
inline std::pair<int, int> ReadSignature(int signature) {
  return {(signature >> 16) - 1, (signature & 0xffff) - 1};
}

/// The mass matrix at the positions that mj_kinematics and mj_comPos have placed.
inline void MakeMass(const mjModel& m, mjData* d) {
#if mjVERSION_HEADER >= 330
  mj_makeM(&m, d);
#else
  mj_crb(&m, d);
#endif
}

/// Its entries that can differ from zero: of each dof with itself and those that it hangs on.
inline const mjtNum* GetMassEntries(const mjData& d) {
#if mjVERSION_HEADER >= 3011000
  return d.M;
#else
  return d.qM;
#endif
}

/// How an address among them changes from a dof to the one that it hangs on, in the row of one dof.
inline constexpr int kTowardRoot = mjVERSION_HEADER >= 3011000 ? -1 : 1;

/// Where the entry of a dof and the one `steps` toward the root stands among them; -1 when it is always zero.
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

/// ten_velocity = ten_J qvel, as mj_tendon left the Jacobian.
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

/// How far a ray goes until it meets a geom, -1 when it meets none; static geoms and all bodies count.
/// @param from x, y, z. @param along the direction. @param groups mjNGROUP flags. @param geom the one it
/// meets, or -1.
inline mjtNum CastRay(const mjModel& m, const mjData& d, const mjtNum* from, const mjtNum* along,
                      const mjtByte* groups, int* geom) {
#if mjVERSION_HEADER >= 3005000
  return mj_ray(&m, &d, from, along, groups, 1, -1, geom, nullptr);
#else
  return mj_ray(&m, &d, from, along, groups, 1, -1, geom);
#endif
}

// What collision functions get and fill.
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

/// Fills what a collision function says of a contact; the engine completes the tangents.
/// @param position, normal x, y, z in the world; the normal points from the first geom to the second.
inline void FillContact(mjtNum distance, const mjtNum* position, const mjtNum* normal,
                        CollisionContact* contact) {
  contact->dist = distance;
  mju_copy3(contact->pos, position);
  mju_copy3(NormalOf(contact), normal);
  mju_zero3(TangentOf(contact));
}

}  // namespace dexcheck
