#include "harness/engine/remove_looks.h"

#include <algorithm>
#include <cstring>
#include <type_traits>
#include <vector>

#include "harness/engine/engine.h"
#include "harness/engine/model_arrays.h"
#include "harness/engine/resized_copy.h"

namespace dexcheck {
namespace {

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
  ForEachArray(m, [&]<typename Number>(Number*& array, size_t, size_t columns, bool of_geoms) {
    if (of_geoms) KeepRows(stay, columns, array);
  });
  *model = MakeResizedCopy(*m, [&](mjModel* smaller) { smaller->ngeom = static_cast<int>(stay.size()); });
  m = model->get();

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
  // In later releases a material has several.
  ForEachArray(model->get(), [&]<typename Number>(Number*& array, size_t rows, size_t columns, bool) {
    if constexpr (std::is_same_v<Number, int>) {
      if (array == (*model)->mat_texid) std::fill_n(array, rows * columns, -1);
    }
  });
  return before - static_cast<size_t>((*model)->nbuffer);
}

}  // namespace dexcheck
