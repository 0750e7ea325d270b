#pragma once

// The small symmetric system of the interior-point step. Internal to controller/grasp.

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace dexcheck::grasp_internal {

inline constexpr int kAnySize = -1;

/// std::array when the size is known at compile time, else a std::vector that is sized once.
template <class T, int kSize>
struct BufferOf {
  using Type = std::array<T, static_cast<std::size_t>(kSize)>;
  static Type Make(std::size_t) { return Type{}; }
};
template <class T>
struct BufferOf<T, kAnySize> {
  using Type = std::vector<T>;
  static Type Make(std::size_t size) { return Type(size); }
};
template <class T, int kSize>
using Buffer = typename BufferOf<T, kSize>::Type;

/// S dy = b with S symmetric positive definite, factored in place as L D L^T.
template <int kRows>
class NormalEquations {
 public:
  explicit NormalEquations(std::size_t rows)
      : S_(BufferOf<double, kEntries>::Make(rows * rows)),
        diagonal_(BufferOf<double, kRows>::Make(rows)),
        inv_pivots_(diagonal_) {}

  /// Entry of the lower triangle, col <= row.
  double& operator()(std::size_t row, std::size_t col) { return S_[row * diagonal_.size() + col]; }

  void SetZero() { std::fill(S_.begin(), S_.end(), 0.0); }

  /// Replaces S by its factors.
  void Factor() {
    const std::size_t n = diagonal_.size();
    for (std::size_t j = 0; j < n; ++j) diagonal_[j] = (*this)(j, j);
    for (std::size_t j = 0; j < n; ++j) {
      const double inv_pivot = 1.0 / (*this)(j, j);
      inv_pivots_[j] = inv_pivot;
      for (std::size_t i = j + 1; i < n; ++i) {
        const double l = (*this)(i, j) * inv_pivot;
        for (std::size_t k = j + 1; k <= i; ++k) (*this)(i, k) -= l * (*this)(k, j);
      }
      for (std::size_t i = j + 1; i < n; ++i) (*this)(i, j) *= inv_pivot;
    }
  }

  /// Determinant of the leading `count` rows and columns of S after scaling them to a unit diagonal: one for
  /// rows of the constraint matrix at right angles, zero for dependent ones. Not finite if a pivot vanished.
  double CalcScaledDeterminant(std::size_t count) const {
    double determinant = 1.0;
    for (std::size_t j = 0; j < count; ++j) determinant /= inv_pivots_[j] * diagonal_[j];
    return determinant;
  }

  /// Replaces b by S^-1 b.
  void Solve(Buffer<double, kRows>& b) {
    const std::size_t n = diagonal_.size();
    for (std::size_t j = 0; j < n; ++j) {
      for (std::size_t i = j + 1; i < n; ++i) b[i] -= (*this)(i, j) * b[j];
    }
    for (std::size_t j = 0; j < n; ++j) b[j] *= inv_pivots_[j];
    for (std::size_t j = n; j-- > 0;) {
      for (std::size_t i = 0; i < j; ++i) b[i] -= (*this)(j, i) * b[j];
    }
  }

 private:
  static constexpr int kEntries = kRows == kAnySize ? kAnySize : kRows * kRows;

  Buffer<double, kEntries> S_;
  Buffer<double, kRows> diagonal_, inv_pivots_;
};

}  // namespace dexcheck::grasp_internal
