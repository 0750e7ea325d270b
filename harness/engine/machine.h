#pragma once

// Properties of the machine that determine the bits of a deterministic computation, besides its inputs.

#include <mujoco/mujoco.h>

#include <string>

namespace dexcheck {

/// Returns the processor features by which the C library chooses its code, C library, engine and compiler, as
/// "x86_64 AVX AVX2 FMA; glibc 2.36; MuJoCo 2.2.2; compiled by ...". The same inputs give the same bits where
/// this text is the same. With fused multiply-add, sines and exponentials differ in their last bits.
std::string DescribeMachine();

/// Describes how the engine integrates, solves and collides, one property a line: "integrator: Euler", "cone:
/// elliptic", "features: constraint equality ...", the release's features that are switched on.
/// @param integrator mjtIntegrator, the model's or another.
std::string DescribeSettings(const mjModel& model, int integrator);

/// Whether two results of one computation on different machines differ by no more than rounding.
/// @param scale size of the values that both were made from.
/// @param tolerance relative to 1 + scale.
bool IsSameWithin(double tolerance, double a, double b, double scale);

/// Largest difference of a signal between machines, relative to 1 (in the signal's unit) + its largest value.
/// It occurs in accelerations of the last finger links, 1e-6 kg m^2 each, which contacts push. Measured over
/// hold, curve, offset and paper-rest with and without FMA: 2.8e-9.
inline constexpr double kSignalTolerance = 2e-8;
/// Largest difference of the metrics of trials, which contain no accelerations. Measured: 6.4e-11, an
/// overshoot relative to a start error of 1e-6 m.
inline constexpr double kMetricTolerance = 5e-10;

}  // namespace dexcheck
