#pragma once

// Elements of ranges by their values, and their median.

#include <algorithm>
#include <functional>
#include <iterator>
#include <vector>

namespace dexcheck {

/// The first element whose projection is the value; nullptr where there is none.
template <typename Range, typename Value, typename Projection = std::identity>
[[nodiscard]] auto* FindIn(Range& range, const Value& value, Projection projection = {}) {
  const auto found = std::ranges::find(range, value, projection);
  return found == std::ranges::end(range) ? nullptr : &*found;
}

/// Its index; -1 where there is none.
template <typename Range, typename Value, typename Projection = std::identity>
[[nodiscard]] int IndexOf(const Range& range, const Value& value, Projection projection = {}) {
  const auto* const found = FindIn(range, value, projection);
  return found == nullptr ? -1 : static_cast<int>(found - std::ranges::data(range));
}

template <typename Range, typename Value, typename Projection = std::identity>
[[nodiscard]] bool Contains(const Range& range, const Value& value, Projection projection = {}) {
  return std::ranges::find(range, value, projection) != std::ranges::end(range);
}

/// Adds elements at the end.
template <typename Range, typename Vector>
void Append(const Range& more, Vector* all) {
  all->insert(all->end(), std::ranges::begin(more), std::ranges::end(more));
}

/// The middle one, of an even number the larger one; 0 of none.
inline double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace dexcheck
