#include "harness/engine/resized_copy.h"

#include <algorithm>
#include <cstring>
#include <new>
#include <vector>

#include "harness/engine/model_arrays.h"

namespace dexcheck {
namespace {

struct Rows {
  const void* data;
  size_t bytes;
};

}  // namespace

MjModelPtr MakeResizedCopy(const mjModel& model, const std::function<void(mjModel*)>& resize) {
  auto* m = static_cast<mjModel*>(mju_malloc(sizeof(mjModel)));
  if (m == nullptr) throw std::bad_alloc();
  *m = model;
  std::vector<Rows> old;
  ForEachArray(m, [&](auto* array, size_t rows, size_t columns, bool) {
    old.push_back({array, sizeof(*array) * rows * columns});
  });
  resize(m);
  size_t bytes = 0;
  ForEachArray(m, [&](auto* array, size_t rows, size_t columns, bool) {
    bytes = AlignArray(bytes) + sizeof(*array) * rows * columns;
  });
  m->buffer = mju_malloc(bytes);
  m->nbuffer = static_cast<decltype(m->nbuffer)>(bytes);
  MjModelPtr resized(m);
  if (m->buffer == nullptr) throw std::bad_alloc();
  size_t offset = 0;
  size_t i = 0;
  ForEachArray(m, [&]<typename Number>(Number*& array, size_t rows, size_t columns, bool) {
    offset = AlignArray(offset);
    const size_t size = sizeof(Number) * rows * columns;
    array = reinterpret_cast<Number*>(static_cast<char*>(m->buffer) + offset);
    std::memset(array, 0, size);
    if (const size_t kept = std::min(size, old[i].bytes); kept > 0) std::memcpy(array, old[i].data, kept);
    offset += size;
    ++i;
  });
  return resized;
}

}  // namespace dexcheck
