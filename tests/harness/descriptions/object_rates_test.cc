// The checks' own P^-1 and its rate: the model's formulas and finite differences agree with them.

#include <gtest/gtest.h>

#include <random>

#include "controller/object/so3.h"
#include "harness/descriptions/engine_provider.h"
#include "tests/common/matrix_near.h"

namespace dexcheck::testing::object_rates_test {
namespace {

TEST(ObjectRates, AreThoseOfTheModelToRounding) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> draw(-3.0, 3.0);
  for (int i = 0; i < 200; ++i) {
    Vector6d X_o, X_o_dot;
    for (double& x : X_o) x = draw(random);
    for (double& x : X_o_dot) x = draw(random);
    const ObjectRates rates = CalcObjectRates(X_o, X_o_dot);
    ASSERT_TRUE(MatrixNear(rates.P_inv, CalcPInverse(X_o), 1e-14));
    ASSERT_TRUE(MatrixNear(rates.bias, Vector6d(CalcPInverseDot(X_o, X_o_dot) * X_o_dot), 1e-12));
    EXPECT_GT(rates.bias.norm(), 1e-3);
    // Central differences along X_o_dot: error of order h^2, measured 2e-9.
    constexpr double kStep = 1e-5;
    const Vector6d difference = (CalcObjectRates(X_o + kStep * X_o_dot, X_o_dot).P_inv -
                                 CalcObjectRates(X_o - kStep * X_o_dot, X_o_dot).P_inv) *
                                X_o_dot / (2.0 * kStep);
    ASSERT_TRUE(MatrixNear(rates.bias, difference, 1e-7));
  }
}

}  // namespace
}  // namespace dexcheck::testing::object_rates_test
