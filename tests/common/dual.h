#pragma once

// Dual numbers a + b e, e^2 = 0: evaluating f(q + q_dot e) gives f(q) and its directional derivative, both to
// rounding.

#include <Eigen/Core>
#include <cmath>

namespace dexcheck::testing {

struct Dual {
  double value = 0.0;
  double rate = 0.0;

  constexpr Dual() = default;
  constexpr Dual(double value_in, double rate_in = 0.0) : value(value_in), rate(rate_in) {}

  constexpr Dual& operator+=(const Dual& b) { return *this = Dual(value + b.value, rate + b.rate); }
  constexpr Dual& operator-=(const Dual& b) { return *this = Dual(value - b.value, rate - b.rate); }
  constexpr Dual& operator*=(const Dual& b) {
    return *this = Dual(value * b.value, rate * b.value + value * b.rate);
  }
};

constexpr Dual operator-(const Dual& a) { return {-a.value, -a.rate}; }
constexpr Dual operator+(Dual a, const Dual& b) { return a += b; }
constexpr Dual operator-(Dual a, const Dual& b) { return a -= b; }
constexpr Dual operator*(Dual a, const Dual& b) { return a *= b; }
inline Dual sin(const Dual& a) { return {std::sin(a.value), std::cos(a.value) * a.rate}; }
inline Dual cos(const Dual& a) { return {std::cos(a.value), -std::sin(a.value) * a.rate}; }

}  // namespace dexcheck::testing

template <>
struct Eigen::NumTraits<dexcheck::testing::Dual> : Eigen::NumTraits<double> {
  using Real = dexcheck::testing::Dual;
  using NonInteger = dexcheck::testing::Dual;
  using Nested = dexcheck::testing::Dual;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 2,
    AddCost = 2,
    MulCost = 4
  };
};

namespace dexcheck::testing {

using DualMatrix = Eigen::Matrix<Dual, Eigen::Dynamic, Eigen::Dynamic>;
using DualVector = Eigen::Matrix<Dual, Eigen::Dynamic, 1>;

/// value + rate e, entry by entry.
inline DualVector MakeDual(const Eigen::VectorXd& value, const Eigen::VectorXd& rate) {
  return value.binaryExpr(rate, [](double a, double b) { return Dual(a, b); });
}

/// The derivatives' part of a dual matrix.
inline Eigen::MatrixXd GetRates(const DualMatrix& matrix) {
  return matrix.unaryExpr([](const Dual& a) { return a.rate; });
}

}  // namespace dexcheck::testing
