#pragma once

// The arrays of an mjModel, which stand one after the other in its one buffer.

#include <mujoco/mjxmacro.h>
#include <mujoco/mujoco.h>

#include <cstddef>
#include <string_view>

namespace dexcheck {

// visit(array, rows, columns, whether there is one row for each geom) for all arrays, as the engine lists
// them; `array` is a reference to the model's pointer.
#undef MJ_M
#define MJ_M(size) m->size
#define DEXCHECK_VISIT(type, name, rows, columns)                            \
  visit(m->name, static_cast<size_t>(m->rows), static_cast<size_t>(columns), \
        std::string_view(#rows) == "ngeom");
template <typename Visit>
void ForEachArray(mjModel* m, const Visit& visit) {
#define X DEXCHECK_VISIT
  MJMODEL_POINTERS
#undef X
}
#undef DEXCHECK_VISIT

/// Where the next array begins that may begin at `offset`: each is at a multiple of 64 bytes.
inline size_t AlignArray(size_t offset) {
  constexpr size_t kAlignment = 64;
  return (offset + kAlignment - 1) / kAlignment * kAlignment;
}

}  // namespace dexcheck
