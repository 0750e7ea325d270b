#include "harness/engine/add_contact_pairs.h"

#include <mujoco/mjxmacro.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <vector>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

// All arrays of a model, as the engine lists them: visit(array, bytes of a row, rows).
#undef MJ_M
#define MJ_M(size) m->size
#define DEXCHECK_VISIT(type, name, rows, columns) \
  visit(m->name, sizeof(type) * static_cast<size_t>(columns), static_cast<size_t>(m->rows));
template <typename Visit>
void ForEachArray(mjModel* m, const Visit& visit) {
#define X DEXCHECK_VISIT
  MJMODEL_POINTERS
#undef X
}

/// The engine lays them out one after the other, each at a multiple of this.
constexpr size_t kAlignment = 64;

size_t RoundUp(size_t offset) { return (offset + kAlignment - 1) / kAlignment * kAlignment; }

struct Rows {
  const void* data;
  size_t bytes;
};

void FillPair(mjModel* m, int pair, const std::pair<int, int>& geoms) {
  const auto [a, b] = geoms;
  m->name_pairadr[pair] = m->nnames - 1;  // no name
  m->pair_dim[pair] = 3;
  m->pair_geom1[pair] = a;
  m->pair_geom2[pair] = b;
  m->pair_signature[pair] = ((m->geom_bodyid[a] + 1) << 16) + m->geom_bodyid[b] + 1;
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

}  // namespace

MjModelPtr AddContactPairs(const mjModel& model, std::span<const std::pair<int, int>> geoms) {
  if (model.opt.collision != mjCOL_PAIR) {
    throw InputError("MJCF: option collision: must be \"predefined\" for plant.collide");
  }
  auto* m = static_cast<mjModel*>(mju_malloc(sizeof(mjModel)));
  if (m == nullptr) throw std::bad_alloc();
  *m = model;
  std::vector<Rows> old;
  ForEachArray(m, [&](auto* array, size_t row, size_t rows) { old.push_back({array, row * rows}); });
  const int first = m->npair;
  m->npair += static_cast<int>(geoms.size());
  size_t bytes = 0;
  ForEachArray(m, [&](auto*, size_t row, size_t rows) { bytes = RoundUp(bytes) + row * rows; });
  m->buffer = mju_malloc(bytes);
  m->nbuffer = static_cast<decltype(m->nbuffer)>(bytes);
  MjModelPtr grown(m);
  if (m->buffer == nullptr) throw std::bad_alloc();
  size_t offset = 0;
  size_t i = 0;
  ForEachArray(m, [&]<typename Number>(Number*& array, size_t row, size_t rows) {
    offset = RoundUp(offset);
    array = reinterpret_cast<Number*>(static_cast<char*>(m->buffer) + offset);
    std::memset(array, 0, row * rows);
    std::memcpy(array, old[i].data, old[i].bytes);
    offset += row * rows;
    ++i;
  });
  for (size_t k = 0; k < geoms.size(); ++k) FillPair(m, first + static_cast<int>(k), geoms[k]);
  return grown;
}

}  // namespace dexcheck
