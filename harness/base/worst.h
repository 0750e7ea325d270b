#pragma once

// Largest values that do not lose what is not a number, as std::max and Eigen's maxCoeff do by position.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace dexcheck {

/// Whether `value` is larger than `other`, or is not a number where the other one is.
template <typename T>
[[nodiscard]] constexpr bool IsWorse(T value, T other) {
  return !(value <= other) && other == other;
}

/// The largest of its arguments; NaN where one of them is NaN.
template <typename T, typename... More>
[[nodiscard]] constexpr T Worst(T first, T second, More... more) {
  const T worst = IsWorse(second, first) ? second : first;
  if constexpr (sizeof...(more) > 0) {
    return Worst(worst, more...);
  } else {
    return worst;
  }
}

/// The largest entry; NaN where one of them is NaN, and 0 where there is none.
template <typename Derived>
[[nodiscard]] double Largest(const Eigen::DenseBase<Derived>& values) {
  return values.size() > 0 ? values.template maxCoeff<Eigen::PropagateNaN>() : 0.0;
}

/// The largest magnitude of the finite entries; 0 where there is none.
template <typename Derived>
[[nodiscard]] double MaxAbsFinite(const Eigen::DenseBase<Derived>& values) {
  double largest = 0.0;
  for (const double value : values.reshaped()) {
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  return largest;
}

/// The largest magnitude of an entry; NaN when one is.
template <typename Derived>
[[nodiscard]] double MaxAbs(const Eigen::MatrixBase<Derived>& values) {
  return Largest(values.cwiseAbs());
}

}  // namespace dexcheck
