// Conservation laws along motions of (18): energy against the work of torques and friction, and the momenta
// of a robot that nothing pushes. Any C whose C xi is wrong breaks them.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "controller/dynamics/model_terms.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paper_robot.h"
#include "tests/common/random_robot.h"
#include "tests/common/reduction_map.h"

namespace dexcheck::testing::power_balance_test {
namespace {

constexpr double kDuration = 0.2;  // s
constexpr int kSamples = 20;       // common to all step sizes

constexpr int kCoarse = 4;  // steps per sample: h = 2.5 ms

// Runge-Kutta's order. Measured 3.98 to 4.02.
constexpr double kOrder = 4.0;
constexpr double kOrderTolerance = 0.15;
// What is left at h = 1.25 ms, J of some 50 J; measured 1.8e-8.
constexpr double kEnergyDefect = 1e-7;
// The same for momenta of some 10 kg m/s, kg m^2/s; measured 4e-8.
constexpr double kMomentumDefect = 1e-7;
// A wrong force must miss by far more.
constexpr double kVisible = 1e-2;

/// C xi, as the motion shall have it: right by default.
using BiasFunction = std::function<VectorXd(const ModelTerms&, const VectorXd& q, const VectorXd& xi)>;

VectorXd CalcBias(const ModelTerms& terms, const VectorXd& /*q*/, const VectorXd& xi) {
  return terms.C() * xi;
}

/// v of a base at 0.5 m/s that turns with 1.5 rad/s.
Vector2d MakeDriveVelocity(const Base& base) { return CalcDriveVelocityOfTwist(base, {0.5, 1.5}); }

/// State of a motion and the work done on the robot since its start.
struct MotionState {
  VectorXd q;
  VectorXd xi;
  double work = 0.0;

  friend MotionState operator+(const MotionState& a, const MotionState& b) {
    return {a.q + b.q, a.xi + b.xi, a.work + b.work};
  }
  friend MotionState operator*(double s, const MotionState& a) { return {s * a.q, s * a.xi, s * a.work}; }
};

/// The robot (18) under smooth torques; the base of a planar robot is free.
class Motion {
 public:
  Motion(const RobotModel& model, unsigned seed, BiasFunction bias = CalcBias)
      : model_(model), bias_(std::move(bias)), terms_(model) {
    std::mt19937 random(seed);
    start_.q = DrawPositions(model, &random);
    start_.xi = 0.5 * DrawVelocities(model.num_velocities(), &random);
    const bool is_drive = model.base().type == BaseType::kDifferentialDrive;
    if (is_drive) start_.xi.head<2>() = MakeDriveVelocity(model.base());
    frequency_ = 5.0 * DrawVelocities(model.num_velocities(), &random);
    terms_.SetState(start_.q, start_.xi);
    terms_.CalcDynamics();
    // Torques in proportion to what they move, some 10 rad/s^2.
    amplitude_ = 10.0 * terms_.M().diagonal();
    if (model.base().type == BaseType::kPlanar) amplitude_.head<3>().setZero();
    if (is_drive) amplitude_.head<2>().setConstant(5.0);
  }

  [[nodiscard]] const MotionState& start() const { return start_; }

  /// Fourth-order Runge-Kutta step of q_dot' = S' xi, M_bar' xi_dot = E_bar' tau' - C_bar' xi - F_bar'.
  MotionState Step(double t, double h, const MotionState& x) {
    const MotionState k1 = CalcRate(t, x);
    const MotionState k2 = CalcRate(t + 0.5 * h, x + 0.5 * h * k1);
    const MotionState k3 = CalcRate(t + 0.5 * h, x + 0.5 * h * k2);
    const MotionState k4 = CalcRate(t + h, x + h * k3);
    return x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }

  EnergyAndMomentum CalcEnergyAndMomentum(const MotionState& x) {
    terms_.SetState(x.q, x.xi);
    terms_.CalcDynamics();
    return terms_.CalcEnergyAndMomentum();
  }

 private:
  MotionState CalcRate(double t, const MotionState& x) {
    terms_.SetState(x.q, x.xi);
    terms_.CalcDynamics();
    VectorXd force = amplitude_.array() * (frequency_.array() * t).cos();
    if (model_.base().type == BaseType::kDifferentialDrive) {
      const PlatformConstraint platform =
          CalcPlatformConstraint(model_.base(), x.q.head<3>(), x.xi.head<2>());
      force.head<2>() = platform.S_v_T_E_v * Vector2d(force.head<2>());
    }
    const VectorXd rest = force - bias_(terms_, x.q, x.xi) - terms_.gravity() - terms_.friction();
    const MatrixXd S = CalcReductionMap(model_, x.q, x.xi).S;
    return {S * x.xi, terms_.M().llt().solve(rest), x.xi.dot(force - terms_.friction())};
  }

  const RobotModel& model_;
  BiasFunction bias_;
  ModelTerms terms_;
  MotionState start_;
  VectorXd amplitude_;
  VectorXd frequency_;
};

struct EnergyRecord {
  double defect = 0.0;   // largest |T + V - start's - work|, J
  double kinetic = 0.0;  // how far T moved, J
  double work = 0.0;     // largest |work|, J
};

EnergyRecord RunEnergyBalance(Motion* motion, int steps_per_sample) {
  const double h = kDuration / (kSamples * steps_per_sample);
  MotionState x = motion->start();
  const EnergyAndMomentum start = motion->CalcEnergyAndMomentum(x);
  EnergyRecord record;
  for (int sample = 0; sample < kSamples; ++sample) {
    for (int i = 0; i < steps_per_sample; ++i) x = motion->Step((sample * steps_per_sample + i) * h, h, x);
    const EnergyAndMomentum now = motion->CalcEnergyAndMomentum(x);
    const double change = now.kinetic + now.potential - start.kinetic - start.potential;
    record.defect = std::max(record.defect, std::abs(change - x.work));
    record.kinetic = std::max(record.kinetic, std::abs(now.kinetic - start.kinetic));
    record.work = std::max(record.work, std::abs(x.work));
  }
  return record;
}

struct Case {
  std::string name;
  RobotModel model;
};

void PrintTo(const Case& robot, std::ostream* out) { *out << robot.name; }

RobotModel MakeTree(BaseType base, DriveVelocity velocity = DriveVelocity::kTwist) {
  std::mt19937 random(48);
  RandomRobotOptions options;
  options.base = base;
  options.velocity = velocity;
  options.joints = 8;
  return RobotModel(MakeRandomRobot(options, &random));
}

std::vector<Case> MakeCases() {
  return {{"Fixed", MakeTree(BaseType::kFixed)},
          {"Planar", MakeTree(BaseType::kPlanar)},
          {"DriveTwist", MakeTree(BaseType::kDifferentialDrive)},
          {"DriveWheelRates", MakeTree(BaseType::kDifferentialDrive, DriveVelocity::kWheelRates)},
          {"PaperTwist", ReadPaperRobot()},
          {"PaperWheelRates", ReadPaperRobot(DriveVelocity::kWheelRates)}};
}

class PowerBalance : public ::testing::TestWithParam<Case> {};

INSTANTIATE_TEST_SUITE_P(Robots, PowerBalance, ::testing::ValuesIn(MakeCases()),
                         [](const auto& info) { return info.param.name; });

TEST_P(PowerBalance, EnergyChangesByTheWorkDone) {
  Motion motion(GetParam().model, 1813);
  const EnergyRecord coarse = RunEnergyBalance(&motion, kCoarse);
  const EnergyRecord fine = RunEnergyBalance(&motion, 2 * kCoarse);
  ASSERT_GT(fine.kinetic, 1.0);
  ASSERT_GT(fine.work, 1.0);
  EXPECT_LT(fine.defect, kEnergyDefect * TolScale());
  EXPECT_NEAR(std::log2(coarse.defect / fine.defect), kOrder, kOrderTolerance * TolScale());
}

// With C xi left out, and with C_bar' without S'^T M S'_dot, energy appears from nowhere however small the
// step.
TEST_P(PowerBalance, WrongBiasIsSeen) {
  const RobotModel& model = GetParam().model;
  const auto no_bias = [](const ModelTerms& terms, const VectorXd&, const VectorXd&) -> VectorXd {
    return VectorXd::Zero(terms.size());
  };
  Motion without_C(model, 1813, no_bias);
  EXPECT_GT(RunEnergyBalance(&without_C, kCoarse).defect, kVisible);
  if (model.base().type != BaseType::kDifferentialDrive) return;

  ModelTerms unreduced(model, Coordinates::kUnreduced);
  const auto no_S_dot = [&](const ModelTerms&, const VectorXd& q, const VectorXd& xi) -> VectorXd {
    const MatrixXd S = CalcReductionMap(model, q, xi).S;
    unreduced.SetState(q, S * xi);
    unreduced.CalcDynamics();
    return S.transpose() * (unreduced.C() * S * xi);
  };
  Motion without_S_dot(model, 1813, no_S_dot);
  EXPECT_GT(RunEnergyBalance(&without_S_dot, kCoarse).defect, kVisible);
}

/// Largest change of the horizontal momentum and of the angular momentum about the vertical through the
/// centre of mass, kg m/s and kg m^2/s.
double FindMomentumDefect(Motion* motion, int steps) {
  const double h = kDuration / steps;
  MotionState x = motion->start();
  const EnergyAndMomentum start = motion->CalcEnergyAndMomentum(x);
  EXPECT_GT(start.linear_momentum.head<2>().norm(), 1.0);
  EXPECT_GT(std::abs(start.angular_momentum.z()), 0.1);
  for (int i = 0; i < steps; ++i) x = motion->Step(i * h, h, x);
  const EnergyAndMomentum end = motion->CalcEnergyAndMomentum(x);
  Vector3d change = end.linear_momentum - start.linear_momentum;
  change.z() = end.angular_momentum.z() - start.angular_momentum.z();
  return change.norm();
}

// Torques between the links of a robot that floats on the plane cannot change its momenta.
TEST(Momentum, IsKeptByAFreePlanarRobot) {
  RobotSpec spec = MakeTree(BaseType::kPlanar).spec();
  spec.gravity = Vector3d(0.0, 0.0, -9.81);
  const RobotModel model(spec);
  Motion motion(model, 1905);
  const double coarse = FindMomentumDefect(&motion, kSamples * kCoarse);
  const double fine = FindMomentumDefect(&motion, kSamples * kCoarse * 2);
  EXPECT_LT(fine, kMomentumDefect * TolScale());
  EXPECT_NEAR(std::log2(coarse / fine), kOrder, kOrderTolerance * TolScale());
  // C^T xi does the same work as C xi, but is not the same force.
  const auto transpose = [](const ModelTerms& terms, const VectorXd&, const VectorXd& xi) -> VectorXd {
    return terms.C().transpose() * xi;
  };
  Motion transposed(model, 1905, transpose);
  EXPECT_GT(FindMomentumDefect(&transposed, kSamples * kCoarse), kVisible);
}

}  // namespace
}  // namespace dexcheck::testing::power_balance_test
