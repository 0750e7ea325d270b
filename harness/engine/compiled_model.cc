#include "harness/engine/compiled_model.h"

#include <mujoco/mjxmacro.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <new>
#include <string_view>
#include <type_traits>
#include <vector>

#include "controller/common/errors.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

// The arrays of an mjModel stand one after the other in its one buffer.

/// Name of an array, and of the size that counts its rows: "name_bodyadr" has "nbody" rows.
struct ArrayName {
  std::string_view name;
  std::string_view rows;
};

// visit(array, rows, columns, its name) for all arrays, as the engine lists them; `array` is a reference to
// the model's pointer.
#undef MJ_M
#define MJ_M(size) m->size
#define DEXCHECK_VISIT(type, name, rows, columns) \
  visit(m->name, static_cast<size_t>(m->rows), static_cast<size_t>(columns), ArrayName{#name, #rows});
template <typename Visit>
void ForEachArray(mjModel* m, const Visit& visit) {
#define X DEXCHECK_VISIT
  MJMODEL_POINTERS
#undef X
}
#undef DEXCHECK_VISIT

/// Returns the first offset from `offset` on at which an array may begin, a multiple of 64 bytes.
inline size_t AlignArray(size_t offset) {
  constexpr size_t kAlignment = 64;
  return (offset + kAlignment - 1) / kAlignment * kAlignment;
}

/// Calls visit(id) for each reference that an element other than a pair makes to a geom.
template <typename Visit>
void ForEachReference(mjModel* m, const Visit& visit) {
  for (int i = 0; i < m->nwrap; ++i) {
    if (m->wrap_type[i] == mjWRAP_SPHERE || m->wrap_type[i] == mjWRAP_CYLINDER) visit(m->wrap_objid + i);
  }
  for (int i = 0; i < m->nsensor; ++i) {
    if (m->sensor_objtype[i] == mjOBJ_GEOM) visit(m->sensor_objid + i);
    if (m->sensor_reftype[i] == mjOBJ_GEOM) visit(m->sensor_refid + i);
  }
  for (int i = 0; i < m->neq; ++i) {
    if (m->eq_type[i] != mjEQ_DISTANCE) continue;
    visit(m->eq_obj1id + i);
    visit(m->eq_obj2id + i);
  }
  for (int i = 0; i < m->ntupledata; ++i) {
    if (m->tuple_objtype[i] == mjOBJ_GEOM) visit(m->tuple_objid + i);
  }
}

/// Moves the rows of the geoms that stay to the front of an array.
template <typename Number>
void KeepRows(const std::vector<int>& stay, size_t columns, Number* rows) {
  for (size_t i = 0; i < stay.size(); ++i) {
    std::memmove(rows + i * columns, rows + static_cast<size_t>(stay[i]) * columns, columns * sizeof(Number));
  }
}

struct Rows {
  const void* data;
  size_t bytes;
};

/// visit(addresses of names, how many) for each kind of element that can have a name, in the order in which
/// the engine's table has their slots.
template <typename Visit>
void ForEachKindOfName(mjModel* m, const Visit& visit) {
  ForEachArray(m, [&](const auto* array, size_t rows, size_t, const ArrayName& array_name) {
    if constexpr (std::is_same_v<decltype(array), const int*>) {
      if (array_name.name.starts_with("name_")) visit(array, rows);
    }
  });
}

/// Returns the slot at which the engine first looks for a name. @param slots of its kind.
size_t HashName(const char* name, size_t slots) {
  uint64_t hash = 5381;
  for (; *name != '\0'; ++name) hash = (hash * 33) ^ static_cast<uint64_t>(*name);
  return hash % slots;
}

/// The table by which the engine finds names, for sizes that changed.
void FillNameTable(mjModel* m) {
  int* table = GetNameSlots(*m);
  if (table == nullptr) return;
  ForEachKindOfName(m, [&](const int* addresses, size_t count) {
    const size_t slots = 2 * count;
    std::fill_n(table, slots, -1);
    for (size_t i = 0; i < count; ++i) {
      const char* const name = m->names + addresses[i];
      const bool is_new = addresses[i] == 0;  // where the model's own name stands
      if (is_new || *name == '\0') continue;
      size_t slot = HashName(name, slots);
      while (table[slot] >= 0) slot = (slot + 1) % slots;
      table[slot] = static_cast<int>(i);
    }
    table += slots;
  });
}

void FillPair(mjModel* m, int pair, const std::pair<int, int>& geoms) {
  const auto [a, b] = geoms;
  m->name_pairadr[pair] = static_cast<int>(m->nnames - 1);  // no name
  m->pair_dim[pair] = 3;
  m->pair_geom1[pair] = a;
  m->pair_geom2[pair] = b;
  m->pair_signature[pair] = MakeSignature(m->geom_bodyid[a], m->geom_bodyid[b]);
  m->pair_margin[pair] = 0.0;
  m->pair_gap[pair] = 0.0;
  const mjtNum solref[mjNREF] = {0.02, 1.0};
  const mjtNum solimp[mjNIMP] = {0.9, 0.95, 0.001, 0.5, 2.0};
  std::copy_n(solref, mjNREF, m->pair_solref + mjNREF * pair);
  std::copy_n(solimp, mjNIMP, m->pair_solimp + mjNIMP * pair);
  constexpr int kOfGeom[5] = {0, 0, 1, 2, 2};  // sliding twice, torsional, rolling twice
  for (int k = 0; k < 5; ++k) {
    m->pair_friction[5 * pair + k] =
        std::max(m->geom_friction[3 * a + kOfGeom[k]], m->geom_friction[3 * b + kOfGeom[k]]);
  }
}

// Radii relative to the largest distance between two bodies that hang on one another.
constexpr double kRodRadius = 0.04;
constexpr double kBallRadius = 0.07;
constexpr double kLeastLength = 1e-4;  // m
constexpr double kLoneRadius = 0.05;   // m, of a body that no other hangs on
constexpr int kFirstHiddenGroup = 3;   // the engine shows groups 0 to 2
constexpr float kRodColor[4] = {0.80F, 0.82F, 0.85F, 1.0F};
constexpr float kBallColor[4] = {0.30F, 0.50F, 0.78F, 1.0F};
constexpr float kDiffuse = 0.7F;  // of the headlight
constexpr float kAmbient = 0.4F;  // of the headlight; a floor, seen at an angle, has little else

/// A rod between two places of a body, or a ball where they are one, in the body's frame.
struct Bone {
  int body;
  Vector3d from;
  Vector3d to;

  [[nodiscard]] double length() const { return (to - from).norm(); }
};

bool Moves(const mjModel& m, int body) { return m.body_weldid[body] != 0; }

std::vector<int> ListMovingGeoms(const mjModel& m) {
  std::vector<int> geoms;
  for (int geom = 0; geom < m.ngeom; ++geom) {
    if (Moves(m, m.geom_bodyid[geom])) geoms.push_back(geom);
  }
  return geoms;
}

bool FloatsFreely(const mjModel& m, int body) {
  return m.body_jntnum[body] > 0 && m.jnt_type[m.body_jntadr[body]] == mjJNT_FREE;
}

/// Brightens a model without lights, or with lamps that reach one place only, which the headlight leaves
/// dark.
void Brighten(mjModel* m) {
  for (int light = 0; light < m->nlight; ++light) {
    if (IsDirectional(*m, light)) return;
  }
  for (int i = 0; i < 3; ++i) {
    if (m->nlight == 0) m->vis.headlight.diffuse[i] = std::max(m->vis.headlight.diffuse[i], kDiffuse);
    m->vis.headlight.ambient[i] = std::max(m->vis.headlight.ambient[i], kAmbient);
  }
}

/// By body, as the engine has a body's geoms in one block.
std::vector<Bone> ListBones(const mjModel& m) {
  std::vector<std::vector<Bone>> of_body(static_cast<size_t>(m.nbody));
  const auto add_rod = [&](int body, const Vector3d& to) {
    const Bone rod{body, Vector3d::Zero(), to};
    if (rod.length() > kLeastLength) of_body[static_cast<size_t>(body)].push_back(rod);
  };
  std::vector<bool> is_last(static_cast<size_t>(m.nbody), true);
  for (int body = 1; body < m.nbody; ++body) {
    if (!Moves(m, body)) continue;
    is_last[static_cast<size_t>(m.body_parentid[body])] = false;
    if (m.body_parentid[body] > 0) add_rod(m.body_parentid[body], MapVector(m.body_pos + 3 * body));
    for (int i = 0; i < m.body_jntnum[body]; ++i) {
      const int joint = m.body_jntadr[body] + i;
      if (m.jnt_type[joint] == mjJNT_FREE) continue;
      const Vector3d at = MapVector(m.jnt_pos + 3 * joint);
      of_body[static_cast<size_t>(body)].push_back({body, at, at});
    }
  }
  for (int site = 0; site < m.nsite; ++site) {
    if (Moves(m, m.site_bodyid[site])) add_rod(m.site_bodyid[site], MapVector(m.site_pos + 3 * site));
  }
  std::vector<Bone> bones;
  for (int body = 1; body < m.nbody; ++body) {
    std::vector<Bone>& own = of_body[static_cast<size_t>(body)];
    if (Moves(m, body) && is_last[static_cast<size_t>(body)]) {
      const Vector3d com = MapVector(m.body_ipos + 3 * body);
      if (FloatsFreely(m, body)) {
        own.push_back({body, com, com});
      } else {
        add_rod(body, com);
      }
    }
    bones.insert(bones.end(), own.begin(), own.end());
  }
  return bones;
}

void FillGeom(mjModel* m, int geom, const Bone& bone, double unit) {
  const bool is_rod = bone.length() > 0.0;
  const Vector3d middle = 0.5 * (bone.from + bone.to);
  m->name_geomadr[geom] = static_cast<int>(m->nnames - 1);  // no name
  m->geom_type[geom] = is_rod ? mjGEOM_CAPSULE : mjGEOM_SPHERE;
  m->geom_bodyid[geom] = bone.body;
  m->geom_dataid[geom] = m->geom_matid[geom] = -1;
  DetachPlugin(geom, m);
  const double radius = (is_rod ? kRodRadius : kBallRadius) * unit;
  m->geom_size[3 * geom] = radius;
  m->geom_size[3 * geom + 1] = 0.5 * bone.length();
  m->geom_rbound[geom] = radius + 0.5 * bone.length();
  mju_copy3(m->geom_pos + 3 * geom, middle.data());
  const Vector3d along = is_rod ? Vector3d(bone.to - bone.from) : Vector3d(Vector3d::UnitZ());
  mju_quatZ2Vec(m->geom_quat + 4 * geom, along.data());
  std::copy_n(is_rod ? kRodColor : kBallColor, 4, m->geom_rgba + 4 * geom);
  if (m->body_geomnum[bone.body]++ == 0) m->body_geomadr[bone.body] = geom;
}

}  // namespace

int RemoveLooks(MjModelPtr* model, std::span<const int> wanted) {
  mjModel* m = model->get();
  std::vector<bool> keep(static_cast<size_t>(m->ngeom), false);
  for (const int geom : wanted) keep[static_cast<size_t>(geom)] = true;
  for (int geom = 0; geom < m->ngeom; ++geom) {
    if (CanTouch(*m, geom) || m->geom_fluid[mjNFLUID * geom] != 0.0) keep[static_cast<size_t>(geom)] = true;
  }
  ForEachReference(m, [&](const int* geom) {
    if (*geom >= 0) keep[static_cast<size_t>(*geom)] = true;
  });
  std::vector<int> stay;
  std::vector<int> new_id(keep.size(), -1);
  for (int geom = 0; geom < m->ngeom; ++geom) {
    if (!keep[static_cast<size_t>(geom)]) continue;
    new_id[static_cast<size_t>(geom)] = static_cast<int>(stay.size());
    stay.push_back(geom);
  }
  const auto removed = static_cast<int>(m->ngeom) - static_cast<int>(stay.size());
  if (removed == 0) return 0;

  const auto renumber = [&](int* geom) {
    if (*geom >= 0) *geom = new_id[static_cast<size_t>(*geom)];
  };
  ForEachReference(m, renumber);
  for (int pair = 0; pair < m->npair; ++pair) {
    renumber(m->pair_geom1 + pair);
    renumber(m->pair_geom2 + pair);
  }
  ForEachArray(m, [&]<typename Number>(Number*& array, size_t, size_t columns, const ArrayName& array_name) {
    if (array_name.rows == "ngeom") KeepRows(stay, columns, array);
  });
  *model = MakeResizedCopy(*m, [&](mjModel* smaller) { smaller->ngeom = static_cast<int>(stay.size()); });
  m = model->get();
  DropGeomTrees(m);

  int next = 0;
  for (int body = 0; body < m->nbody; ++body) {
    const int first = next;
    while (next < m->ngeom && m->geom_bodyid[next] == body) ++next;
    m->body_geomnum[body] = next - first;
    m->body_geomadr[body] = next > first ? first : -1;
  }
  return removed;
}

size_t RemovePictures(MjModelPtr* model) {
  const mjModel& m = **model;
  if (m.ntex == 0) return 0;
  const auto before = static_cast<size_t>(m.nbuffer);
  *model = MakeResizedCopy(m, [](mjModel* smaller) { smaller->ntex = smaller->ntexdata = 0; });
  // Names distinguish arrays at one address: an empty array lies where the next one begins.
  ForEachArray(model->get(), [&]<typename Number>(Number*& array, size_t rows, size_t columns,
                                                  const ArrayName& array_name) {
    if constexpr (std::is_same_v<Number, int>) {
      if (array_name.name == "mat_texid") std::fill_n(array, rows * columns, -1);
    }
  });
  return before - static_cast<size_t>((*model)->nbuffer);
}

MjModelPtr MakeResizedCopy(const mjModel& model, const std::function<void(mjModel*)>& resize) {
  auto* m = static_cast<mjModel*>(mju_malloc(sizeof(mjModel)));
  if (m == nullptr) throw std::bad_alloc();
  *m = model;
  std::vector<Rows> old;
  ForEachArray(m, [&](auto* array, size_t rows, size_t columns, const ArrayName&) {
    old.push_back({array, sizeof(*array) * rows * columns});
  });
  resize(m);
  size_t names = 0;
  ForEachKindOfName(m, [&](const int*, size_t count) { names += count; });
  SetNameSlots(names, m);
  size_t bytes = 0;
  ForEachArray(m, [&](auto* array, size_t rows, size_t columns, const ArrayName&) {
    bytes = AlignArray(bytes) + sizeof(*array) * rows * columns;
  });
  m->buffer = mju_malloc(bytes);
  m->nbuffer = static_cast<decltype(m->nbuffer)>(bytes);
  MjModelPtr resized(m);
  if (m->buffer == nullptr) throw std::bad_alloc();
  size_t offset = 0;
  size_t i = 0;
  ForEachArray(m, [&]<typename Number>(Number*& array, size_t rows, size_t columns, const ArrayName&) {
    offset = AlignArray(offset);
    const size_t size = sizeof(Number) * rows * columns;
    array = reinterpret_cast<Number*>(static_cast<char*>(m->buffer) + offset);
    std::memset(array, 0, size);
    if (const size_t kept = std::min(size, old[i].bytes); kept > 0) std::memcpy(array, old[i].data, kept);
    offset += size;
    ++i;
  });
  FillNameTable(m);
  return resized;
}

MjModelPtr AddContactPairs(const mjModel& model, std::span<const std::pair<int, int>> geoms) {
  if (CollidesByType(model)) {
    throw InputError("MJCF: option collision: must be \"predefined\" for plant.collide");
  }
  const auto first = static_cast<int>(model.npair);
  MjModelPtr resized =
      MakeResizedCopy(model, [&](mjModel* m) { m->npair += static_cast<int>(geoms.size()); });
  for (size_t k = 0; k < geoms.size(); ++k) FillPair(resized.get(), first + static_cast<int>(k), geoms[k]);
  return resized;
}

MjModelPtr MakeVisible(MjModelPtr model) {
  Brighten(model.get());
  const std::vector<int> geoms = ListMovingGeoms(*model);
  if (model->nskin > 0) return model;
  const bool all_hidden =
      std::ranges::all_of(geoms, [&](int geom) { return model->geom_group[geom] >= kFirstHiddenGroup; });
  for (const int geom : geoms) {
    if (all_hidden) model->geom_group[geom] = 0;
  }
  // Shapes suffice on half of the moving bodies: a robot of feet alone would be invisible.
  int moving = 0, shaped = 0;
  for (int body = 1; body < model->nbody; ++body) {
    if (model->body_jntnum[body] == 0) continue;
    ++moving;
    shaped += model->body_geomnum[body] > 0 ? 1 : 0;
  }
  if (!geoms.empty() && 2 * shaped >= moving) return model;
  const std::vector<Bone> bones = ListBones(*model);
  if (bones.empty()) return model;
  double longest = 0.0;
  for (const Bone& bone : bones) longest = std::max(longest, bone.length());
  const double unit = longest > 0.0 ? longest : kLoneRadius / kBallRadius;
  const auto first = static_cast<int>(model->ngeom);
  MjModelPtr drawn = MakeResizedCopy(*model, [&](mjModel* m) { m->ngeom += static_cast<int>(bones.size()); });
  for (size_t i = 0; i < bones.size(); ++i)
    FillGeom(drawn.get(), first + static_cast<int>(i), bones[i], unit);
  return drawn;
}

}  // namespace dexcheck
