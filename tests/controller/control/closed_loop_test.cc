// The law in closed loop with the paper's own rigid plant: (57) as a measurement.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "controller/control/computed_torque.h"
#include "controller/control/object_tracking.h"
#include "tests/common/matrix_near.h"
#include "tests/controller/control/ideal_simulation.h"
#include "tests/controller/control/printed_law.h"

namespace dexcheck::testing::closed_loop_test {
namespace {

constexpr double kDuration = 0.4;    // s
constexpr double kFrequency = 12.0;  // rad/s, natural frequency of the error

ObjectGains MakeGains(double damping_ratio) {
  ObjectGains gains;
  gains.K_p.setConstant(kFrequency * kFrequency);
  gains.K_v.setConstant(2.0 * damping_ratio * kFrequency);
  return gains;
}

/// Solution of e_ddot + 2 zeta w e_dot + w^2 e = 0 with e(0) = e_0, e_dot(0) = 0.
double SolveErrorDynamics(double damping_ratio, double e_0, double t) {
  const double a = damping_ratio * kFrequency;
  if (damping_ratio < 1.0) {
    const double w = kFrequency * std::sqrt(1.0 - damping_ratio * damping_ratio);
    return e_0 * std::exp(-a * t) * (std::cos(w * t) + a / w * std::sin(w * t));
  }
  if (damping_ratio == 1.0) return e_0 * std::exp(-a * t) * (1.0 + a * t);
  const double w = kFrequency * std::sqrt(damping_ratio * damping_ratio - 1.0);
  return e_0 * std::exp(-a * t) * (std::cosh(w * t) + a / w * std::sinh(w * t));
}

/// A line with constant velocity and turning rate, starting `offset` away from the object.
class ClosedLoop {
 public:
  explicit ClosedLoop(Hands hands, double damping_ratio)
      : scene_(hands),
        simulation_(&scene_),
        law_(scene_.model, scene_.grasp.num_contacts()),
        actuation_(scene_.model),
        task_(scene_.model),
        gains_(MakeGains(damping_ratio)),
        sigma_prime_(scene_.robot.size()),
        force_(scene_.robot.size()) {
    offset_ << 0.010, -0.005, 0.008, 0.05, -0.04, 0.06;
    velocity_ << 0.20, 0.05, -0.05, 0.2, 0.1, -0.1;
    start_ = scene_.X_o;
    scene_.X_o_dot = velocity_;
    scene_.ProjectVelocity();
    task_.q_posture = scene_.q.tail(scene_.model.num_joints());
    task_.stiffness.setConstant(25.0);
    task_.damping.setConstant(10.0);
    task_.damping.head<2>().setZero();
  }

  [[nodiscard]] DesiredMotion CalcDesired(double t) const {
    return {start_ + offset_ + velocity_ * t, velocity_, Vector6d::Zero()};
  }
  [[nodiscard]] Vector6d CalcError() const { return CalcDesired(simulation_.time()).X_d - scene_.X_o; }

  void Run(double dt, bool project = true) {
    const int steps = static_cast<int>(std::lround(kDuration / dt));
    for (int i = 0; i < steps; ++i) {
      simulation_.Step(
          dt, [this](double t) { return CalcForce(t); }, project);
      for_each_step(*this);
    }
  }

  VectorXd CalcForce(double t) {
    task_.CalcAcceleration(scene_.q, scene_.xi, sigma_prime_);
    const VectorXd F_N = scene_.CalcInternalForce(3.0);
    if (fault != Fault::kNone) {
      Pseudoinverse J_B_pinv("J_B'", scene_.num_forces(), scene_.robot.size());
      J_B_pinv.Factor(scene_.grasp.J_B());
      return PrintedLaw(scene_, J_B_pinv, gains_, CalcDesired(t), sigma_prime_, F_N, fault).force;
    }
    law_.SetDemand(scene_.robot, scene_.grasp, CalcTrackingAcceleration(gains_, scene_.grasp, CalcDesired(t)),
                   sigma_prime_);
    actuation_.CalcForce(law_.CalcTorque(scene_.grasp, F_N), force_);
    return force_;
  }

  GraspScene& scene() { return scene_; }
  IdealSimulation& simulation() { return simulation_; }
  PostureTask& task() { return task_; }
  [[nodiscard]] const Vector6d& offset() const { return offset_; }

  Fault fault = Fault::kNone;
  std::function<void(ClosedLoop&)> for_each_step = [](ClosedLoop&) {};

 private:
  GraspScene scene_;
  IdealSimulation simulation_;
  ComputedTorque law_;
  ActuationMap actuation_;
  PostureTask task_;
  ObjectGains gains_;
  Vector6d offset_, velocity_, start_;
  VectorXd sigma_prime_, force_;
};

/// Largest deviation of the error from its closed-form solution over a run.
double MeasureDeviation(Hands hands, double damping_ratio, double dt, Fault fault = Fault::kNone) {
  ClosedLoop loop(hands, damping_ratio);
  loop.fault = fault;
  double deviation = 0.0;
  loop.for_each_step = [&](ClosedLoop& l) {
    const double decay = SolveErrorDynamics(damping_ratio, 1.0, l.simulation().time());
    deviation = std::max(deviation, (l.CalcError() - decay * l.offset()).cwiseAbs().maxCoeff());
  };
  loop.Run(dt);
  return deviation;
}

class ClosedLoopTest : public ::testing::TestWithParam<std::tuple<Hands, double>> {};

TEST_P(ClosedLoopTest, ErrorIsTheClosedFormSolution) {
  const auto [hands, damping_ratio] = GetParam();
  const double coarse = MeasureDeviation(hands, damping_ratio, 0.01);
  const double fine = MeasureDeviation(hands, damping_ratio, 0.005);
  // Offsets of 5 to 60 mm and mrad; fourth order, halving the step gives 16. Measured 2.2e-8 at most.
  EXPECT_GT(coarse / fine, 12.0);
  EXPECT_LT(coarse / fine, 24.0);
  EXPECT_LT(fine, 2e-7);
}

std::string NameCase(const ::testing::TestParamInfo<ClosedLoopTest::ParamType>& info) {
  const Hands hands = std::get<0>(info.param);
  const double ratio = std::get<1>(info.param);
  return std::string(hands == Hands::kRight  ? "RightHand"
                     : hands == Hands::kLeft ? "LeftHand"
                                             : "BothHands") +
         (ratio < 1.0   ? "Underdamped"
          : ratio > 1.0 ? "Overdamped"
                        : "Critical");
}

INSTANTIATE_TEST_SUITE_P(HandsAndGains, ClosedLoopTest,
                         ::testing::Combine(::testing::Values(Hands::kRight, Hands::kLeft, Hands::kBoth),
                                            ::testing::Values(0.4, 1.0, 1.5)),
                         NameCase);

TEST(ClosedLoop, FaultyLawsLeaveTheClosedFormSolution) {
  const double sound = MeasureDeviation(Hands::kRight, 1.0, 0.005);
  // A transposed grasp map drops the object within milliseconds (LawTest has it at single states).
  for (const Fault fault : {Fault::kNoPlatformRate, Fault::kNoCoriolis, Fault::kNoContactRate}) {
    EXPECT_GT(MeasureDeviation(Hands::kRight, 1.0, 0.005, fault), 100.0 * sound) << static_cast<int>(fault);
  }
  EXPECT_LT(sound, 1e-7);  // measured 8e-9
}

TEST(ClosedLoop, EnergyIsTheWorkOfTheActuators) {
  const auto measure = [](double dt) {
    ClosedLoop loop(Hands::kRight, 1.0);
    const double start = loop.simulation().CalcEnergy();
    loop.Run(dt, false);
    const double gain = loop.simulation().CalcEnergy() - start;
    EXPECT_GT(std::abs(loop.simulation().work()), 0.01);
    return std::abs(gain - loop.simulation().work());
  };
  const double coarse = measure(0.01);
  const double fine = measure(0.005);
  EXPECT_GT(coarse / fine, 12.0);
  EXPECT_LT(fine, 2e-6);  // J, measured 2.4e-7
}

// (40) integrated is where the bodies touch, and nothing slips, without any projection.
TEST(ClosedLoop, ContactsStayClosedAndRoll) {
  ClosedLoop loop(Hands::kRight, 1.0);
  const std::vector<ContactCoordinates> before = loop.scene().kappa;
  double slip = 0.0;
  loop.for_each_step = [&](ClosedLoop& l) {
    slip = std::max(slip, l.scene().grasp.slip().cwiseAbs().maxCoeff());
  };
  loop.Run(0.0025, false);
  EXPECT_LT(slip, 3e-9);  // m/s, measured 2.8e-10
  const std::vector<ContactCoordinates> rolled = loop.scene().kappa;
  const double gap = loop.scene().FindContacts();
  EXPECT_LT(gap, 2e-10);  // m, measured 1.9e-11
  double travel = 0.0;
  for (size_t i = 0; i < rolled.size(); ++i) {
    const SurfaceGeometry by_rolling = loop.scene().surface.Evaluate(rolled[i].alpha_o);
    const SurfaceGeometry by_geometry = loop.scene().surface.Evaluate(loop.scene().kappa[i].alpha_o);
    const SurfaceGeometry at_start = loop.scene().surface.Evaluate(before[i].alpha_o);
    travel = std::max(travel, (by_rolling.p - at_start.p).norm());
    EXPECT_TRUE(MatrixNear(by_rolling.p, by_geometry.p, 3e-11));
  }
  EXPECT_GT(travel, 1e-4);
}

// The left arm and hand keep their configuration while the right hand manipulates.
TEST(ClosedLoop, PostureTaskKeepsTheLeftArmStill) {
  const auto calc_left = [](const GraspScene& scene) {
    VectorXd left(7 + 16);
    left << scene.q.segment<7>(12), scene.q.segment<16>(35);
    return left;
  };
  ClosedLoop loop(Hands::kRight, 1.0);
  const VectorXd before = calc_left(loop.scene());
  const VectorXd right_before = loop.scene().q.segment<7>(5);
  loop.Run(0.005);
  ASSERT_GT((loop.scene().q.segment<7>(5) - right_before).norm(), 1e-3);
  EXPECT_TRUE(MatrixNear(calc_left(loop.scene()), before, 6e-12));  // rad, measured 7e-13

  // Pushed, it returns: e_ddot + 10 e_dot + 25 e = 0; without the task it does not.
  const auto push = [&](bool with_task) {
    ClosedLoop pushed(Hands::kRight, 1.0);
    if (!with_task) {
      pushed.task().stiffness.setZero();
      pushed.task().damping.setZero();
    }
    pushed.scene().q[12] += 0.1;
    pushed.scene().SetState();
    pushed.Run(0.005);
    return pushed.scene().q[12] - before[0];
  };
  EXPECT_NEAR(push(true), 0.1 * std::exp(-5.0 * kDuration) * (1.0 + 5.0 * kDuration), 1e-7);
  EXPECT_NEAR(push(false), 0.1, 1e-9);
}

}  // namespace
}  // namespace dexcheck::testing::closed_loop_test
