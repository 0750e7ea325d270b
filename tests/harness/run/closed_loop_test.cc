// Theory of the closed loop: error dynamics (57), orders of convergence, no allocation.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/common/allocation_counter.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::closed_loop_test {
namespace {

/// E(t) / E(0) of E_ddot + 2 zeta omega E_dot + omega^2 E = 0 from rest.
double CalcErrorDecay(double omega, double zeta, double t) {
  if (zeta == 1.0) return (1.0 + omega * t) * std::exp(-omega * t);
  if (zeta < 1.0) {
    const double rate = omega * std::sqrt(1.0 - zeta * zeta);
    return std::exp(-zeta * omega * t) * (std::cos(rate * t) + zeta * omega / rate * std::sin(rate * t));
  }
  const double root = std::sqrt(zeta * zeta - 1.0);
  const double slow = -omega * (zeta - root);
  const double fast = -omega * (zeta + root);
  return (fast * std::exp(slow * t) - slow * std::exp(fast * t)) / (fast - slow);
}

struct Gains {
  double omega;
  double zeta;
  std::vector<std::string> plant;
  double bound;  // of the error's difference from the closed form, over the start's: of the time step
};

class ErrorDynamics : public ::testing::TestWithParam<Gains> {};

TEST_P(ErrorDynamics, FollowTheClosedFormOfEquation57) {
  const double omega = GetParam().omega;
  const double zeta = GetParam().zeta;
  const std::vector<std::string>& plant = GetParam().plant;
  const auto measure = [&](const std::string& time_step) {
    std::vector<std::string> overrides = {"duration=1",
                                          "control.natural_frequency=" + std::to_string(omega),
                                          "control.damping_ratio=" + std::to_string(zeta),
                                          "start_error.xyz=[1e-3, -5e-4, 8e-4]",
                                          "start_error.zyz=[0.01, -0.008, 0.012]",
                                          "plant.time_step=" + time_step};
    overrides.insert(overrides.end(), plant.begin(), plant.end());
    ShippedRun run("hold", overrides);
    const Vector6d E_0 = run.setup().scenario().start_error();
    Vector6d worst = Vector6d::Zero();
    Vector6d last = Vector6d::Zero();
    run.Run([&] {
      const Vector6d E = run.step().command.desired.X_d - CalcX_o(run.step());
      const Vector6d expected = CalcErrorDecay(omega, zeta, run.step().time) * E_0;
      worst = worst.cwiseMax((E - expected).cwiseQuotient(E_0).cwiseAbs());
      last = E;
    });
    EXPECT_LT(last.norm(), 0.2 * E_0.norm());
    return worst.maxCoeff();
  };
  const double fine = measure("1e-3");
  EXPECT_LE(fine, GetParam().bound);
  // Sampled and held at each step: what the hold leaves is of first order.
  if (!plant.empty()) EXPECT_NEAR(measure("2e-3") / fine, 2.0, 0.15);
}

INSTANTIATE_TEST_SUITE_P(GainSets, ErrorDynamics,
                         ::testing::Values(Gains{20.0, 1.0, {}, 0.01},  // measured 0.0062
                                           Gains{10.0, 0.7, {}, 0.01}, Gains{6.0, 1.5, {}, 0.01},
                                           Gains{20.0, 1.0, {"plant.type=rigid"}, 0.02}));

/// Largest differences of the engine's motion from the rigid model's prediction in a run. The checks compare
/// them less the known effect of soft contacts.
struct Discrepancies {
  double acceleration = 0.0;  ///< |xi_dot - prediction|, m/s^2 and rad/s^2.
  double force = 0.0;         ///< |f_c - prediction| / |f_c|.
  double slip = 0.0;          ///< m
  double position = 0.0;      ///< Distance of the object from its trajectory, m.
};

Discrepancies Measure(const std::string& scenario, const std::vector<std::string>& overrides) {
  ShippedRun run(scenario, overrides);
  Discrepancies worst;
  const RunResult& result = run.Run([&] {
    const StepFindings& findings = run.loop().checks().analysis().findings;
    worst.acceleration =
        std::max(worst.acceleration, (findings.xi_dot_model - run.step().response.xi_dot).norm());
    worst.force = std::max(worst.force, (findings.f_c_model - findings.f_c).norm() / findings.f_c.norm());
  });
  EXPECT_TRUE(result.failure.empty()) << result.failure;
  worst.slip = run.Worst("fingertip_slip");
  worst.position = result.tracking.position.max;
  return worst;
}

TEST(Convergence, HalvingTheTimeStepHalvesTheDiscrepanciesOrBetter) {
  const Discrepancies coarse = Measure("paper-ramp", {"duration=1.2", "plant.time_step=2e-3"});
  const Discrepancies fine = Measure("paper-ramp", {"duration=1.2", "plant.time_step=1e-3"});
  EXPECT_GT(coarse.acceleration, 1e-7);
  // Measured: 4.0, 4.0, 2.0, 3.9.
  EXPECT_GE(coarse.acceleration / fine.acceleration, 2.0);
  EXPECT_GE(coarse.force / fine.force, 2.0);
  EXPECT_GE(coarse.slip / fine.slip, 1.95);
  EXPECT_GE(coarse.position / fine.position, 2.0);
}

TEST(Convergence, StifferContactsReduceTheDiscrepancies) {
  const Discrepancies soft = Measure("curve", {"duration=1.5", "plant.contact_time_constant=4e-3"});
  const Discrepancies stiff = Measure("curve", {"duration=1.5", "plant.contact_time_constant=2e-3"});
  // Measured: 3.0, 2.0.
  EXPECT_GE(soft.acceleration / stiff.acceleration, 2.0);
  EXPECT_GE(soft.slip / stiff.slip, 1.5);
}

// The engine's own treatment of joint damping is the wrong setting here: it must show.
TEST(ImplicitDamping, LosesDigitsThatExplicitDampingKeeps) {
  const Discrepancies as_force = Measure("reorient", {"duration=1.5"});
  const Discrepancies implicit = Measure("reorient", {"duration=1.5", "plant.implicit_damping=true"});
  EXPECT_GT(implicit.acceleration, 20.0 * as_force.acceleration);
}

TEST(ClosedLoop, StepsWithoutAllocation) {
  const std::vector<std::string> real = {"sensing.latency=0.003",          "sensing.object_latency=0.002",
                                         "sensing.object_velocity=kalman", "sensing.object_acceleration=5",
                                         "actuation.coulomb=0.001",        "actuation.lag=0.001"};
  const std::vector<std::string> friction = {"control.law=feedforward_pd", "control.coulomb=0.5",
                                             "expect={}"};
  const std::pair<const char*, std::vector<std::string>> kRuns[] = {{"curve", {}},
                                                                    {"curve", {"plant.type=rigid"}},
                                                                    {"curve", {"plant.type=rigid_euler"}},
                                                                    {"curve", {"control.law=impedance"}},
                                                                    {"curve-real", real},
                                                                    {"panda-reach", {}},
                                                                    {"panda-reach", friction}};
  for (const auto& [scenario, overrides] : kRuns) {
    SCOPED_TRACE(::testing::PrintToString(overrides));
    const ShippedRun run(scenario, overrides);
    ClosedLoop loop(run.setup(), /*check=*/true);
    loop.Settle();
    for (int i = 0; i < 100; ++i) loop.Step();
    const AllocationCounter counter;
    for (int i = 0; i < 100; ++i) loop.Step();
    EXPECT_EQ(counter.count(), 0);
  }
}

}  // namespace
}  // namespace dexcheck::testing::closed_loop_test
