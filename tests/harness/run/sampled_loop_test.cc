// Margins of sampled loops: textbook cases, closed forms, and the spectral radius just inside and just
// outside.

#include "harness/run/sampled_loop.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dexcheck::testing::sampled_loop_test {
namespace {

using Complex = std::complex<double>;

// log L is followed linearly over steps of 1.5 % of the frequency.
constexpr double kGrid = 1e-3;

// G(s) = K / (s (s + 1) (s + 5)) [Ogata 2010, example 7-20]: the phase is -180 degrees at w = sqrt(5), where
// |G| = K / 30.
TEST(StabilityMargins, AreThoseOfATextbook) {
  std::vector<double> w;
  for (int i = 0; i <= 700; ++i) w.push_back(std::pow(10.0, -2.0 + 4.0 * i / 700.0));
  const auto evaluate = [&](double K) {
    std::vector<Complex> L;
    for (const double omega : w) {
      const Complex s(0.0, omega);
      L.push_back(K / (s * (s + 1.0) * (s + 5.0)));
    }
    return FindMargins(w, L);
  };
  const StabilityMargins margins = evaluate(10.0);
  EXPECT_NEAR(margins.gain, 3.0, 3.0 * kGrid);
  EXPECT_EQ(margins.least_gain, 0.0);
  // The crossing is at w^2 (w^2 + 1) (w^2 + 25) = K^2.
  double low = 0.1, high = 10.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high), x = middle * middle;
    (x * (x + 1.0) * (x + 25.0) < 100.0 ? low : high) = middle;
  }
  const double phase = 0.5 * kPi - std::atan(low) - std::atan(low / 5.0);
  EXPECT_NEAR(phase, DegToRad(25.4), DegToRad(0.1));
  EXPECT_NEAR(margins.phase, phase, kGrid);
  EXPECT_NEAR(margins.delay, phase / low, kGrid * phase / low);
  // At its limit nothing is left, and beyond it a smaller gain is what would help.
  EXPECT_NEAR(evaluate(30.0).phase, 0.0, kGrid);
  EXPECT_NEAR(evaluate(60.0).least_gain, 0.5, 0.5 * kGrid);
}

/// A free mass of 1 under K_p and K_v.
LinearLoop MakeServo(const SampledLoop& timing, double omega, double zeta) {
  const MatrixXd one = MatrixXd::Identity(1, 1);
  return {.timing = timing,
          .M = one,
          .D = 0.0 * one,
          .G = 0.0 * one,
          .K = omega * omega * one,
          .V = 2.0 * zeta * omega * one};
}

// By Jury's criterion K_v + T K_p / 2 < 2 / T, both with the same factor; and without
// sampling |L| = 1 at w^2 = omega^2 (2 zeta^2 + sqrt(4 zeta^4 + 1)), where 2 zeta w / omega is the tangent of
// the margin.
TEST(SampledLoop, HasTheClosedFormsOfAServo) {
  for (const double zeta : {0.4, 1.0}) {
    const double omega = 20.0, T = 1e-3;
    const LoopMargins margins = CalcMargins(CalcSampledSystem(MakeServo({}, omega, zeta)));
    ASSERT_EQ(margins.loops.size(), 1U);
    const StabilityMargins& one = margins.loops.front();
    const double gain = 2.0 / T / (2.0 * zeta * omega + 0.5 * T * omega * omega);
    EXPECT_NEAR(one.gain, gain, 1e-6 * gain);
    const double crossing = omega * std::sqrt(2.0 * zeta * zeta + std::sqrt(4.0 * std::pow(zeta, 4) + 1.0));
    const double phase = std::atan(2.0 * zeta * crossing / omega);
    // Sampling reduces the phase by about the angle of a step.
    EXPECT_LT(one.phase, phase);
    EXPECT_GT(one.phase, phase - crossing * T);
    EXPECT_NEAR(one.delay, phase / crossing, T);
    EXPECT_NEAR(margins.together.gain, one.gain, 1e-6 * gain);
  }
}

double CalcRadius(const LinearLoop& loop) {
  const SampledSystem system = CalcSampledSystem(loop);
  return CalcMargins(system).radius;
}

/// K and V of torque i times a factor.
LinearLoop Strengthen(LinearLoop loop, Eigen::Index i, double factor) {
  loop.K.row(i) *= factor;
  loop.V.row(i) *= factor;
  return loop;
}

// The spectral radius says the same, whatever is late or filtered: a little inside a margin the loop is
// stable, a little outside it is not.
TEST(SampledLoop, TurnsAtItsMargins) {
  constexpr double kInside = 0.99, kOutside = 1.01;
  for (const SampledLoop& timing :
       {SampledLoop{}, SampledLoop{.hold = 4}, SampledLoop{.delay = 2.5e-3, .latency = 3},
        SampledLoop{.hold = 2, .low_pass = 0.2}}) {
    LinearLoop loop = MakeServo(timing, 30.0, 0.8);
    if (timing.low_pass < 1.0) loop.lag.setConstant(1, 4e-3);
    const StabilityMargins margins = CalcMargins(CalcSampledSystem(loop)).loops.front();
    ASSERT_GT(margins.gain, 1.5);
    EXPECT_LT(CalcRadius(Strengthen(loop, 0, kInside * margins.gain)), 1.0);
    EXPECT_GT(CalcRadius(Strengthen(loop, 0, kOutside * margins.gain)), 1.0);
    ASSERT_GT(margins.delay, 5e-3);
    loop.timing.delay = timing.delay + kInside * margins.delay;
    EXPECT_LT(CalcRadius(loop), 1.0);
    loop.timing.delay = timing.delay + kOutside * margins.delay;
    EXPECT_GT(CalcRadius(loop), 1.0);
  }
}

// Two joints that feel each other, one of which would fall over.
TEST(SampledLoop, IsBrokenAtOneTorqueAtATime) {
  LinearLoop loop;
  loop.M = (MatrixXd(2, 2) << 2.0, 0.6, 0.6, 0.5).finished();
  loop.D = (MatrixXd(2, 2) << 0.1, 0.0, 0.0, 0.2).finished();
  loop.G = (MatrixXd(2, 2) << -60.0, -8.0, -8.0, -5.0).finished();
  loop.K = (MatrixXd(2, 2) << 900.0, 0.0, 0.0, 200.0).finished();
  loop.V = (MatrixXd(2, 2) << 70.0, 0.0, 0.0, 15.0).finished();
  const LoopMargins margins = CalcMargins(CalcSampledSystem(loop));
  ASSERT_TRUE(margins.is_stable());
  for (Eigen::Index i = 0; i < 2; ++i) {
    const StabilityMargins& one = margins.loops[static_cast<size_t>(i)];
    EXPECT_LT(CalcRadius(Strengthen(loop, i, 0.99 * one.gain)), 1.0) << i;
    EXPECT_GT(CalcRadius(Strengthen(loop, i, 1.01 * one.gain)), 1.0) << i;
    ASSERT_GT(one.least_gain, 0.01) << i;
    EXPECT_LT(CalcRadius(Strengthen(loop, i, 1.01 * one.least_gain)), 1.0) << i;
    EXPECT_GT(CalcRadius(Strengthen(loop, i, 0.99 * one.least_gain)), 1.0) << i;
  }
  const LoopMargins alone = CalcMargins(CalcSampledSystem(loop), /*together=*/false);
  for (size_t i = 0; i < 2; ++i) EXPECT_NEAR(alone.loops[i].gain, margins.loops[i].gain, 1e-9) << i;
  // All together is another question.
  const auto both = [&](double factor) {
    return CalcRadius(Strengthen(Strengthen(loop, 0, factor), 1, factor));
  };
  EXPECT_LT(both(0.99 * margins.together.gain), 1.0);
  EXPECT_GT(both(1.01 * margins.together.gain), 1.0);
  EXPECT_LT(margins.together.gain, 0.99 * std::min(margins.loops[0].gain, margins.loops[1].gain));
}

// A plant by Runge-Kutta's method moves as the exponential of its matrix, to fourth order.
TEST(SampledLoop, StepsAPlantOfEitherKind) {
  LinearLoop loop = MakeServo({.time_step = 0.01}, 0.0, 0.0);
  loop.G(0, 0) = 4.0;
  loop.D(0, 0) = 0.4;
  loop.steps_together = true;
  // q_ddot + 0.4 q_dot + 4 q = 0
  const double decay = 0.2, omega = std::sqrt(4.0 - decay * decay), h = 0.01;
  const double expected = std::exp(-decay * h) * (std::cos(omega * h) + decay / omega * std::sin(omega * h));
  EXPECT_NEAR(CalcSampledSystem(loop).A(0, 0), expected, 1e-10);
  loop.steps_together = false;
  EXPECT_NEAR(CalcSampledSystem(loop).A(0, 0), 1.0 - h * h * 4.0, 1e-15);
}

}  // namespace
}  // namespace dexcheck::testing::sampled_loop_test
