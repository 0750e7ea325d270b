// A ball driven around the tube of a torus in the engine, through the hole: (40) must follow the engine's
// contact.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "controller/contact/contact_geometry.h"
#include "controller/contact/shapes.h"
#include "controller/object/so3.h"
#include "harness/engine/engine.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::rolling_engine_test {
namespace {

constexpr double kRing = 0.035;
constexpr double kTube = 0.011;
constexpr double kBall = 0.009;
constexpr double kDuration = 5.0;
constexpr double kPress = 1.0;  // N, along the common normal
// So deep the contact carries it, m. Of surfaces that just touch, a release has no contact in the first step,
// and the ball falls in.
constexpr double kDepth = 8e-7;

/// A ball in weightlessness that forces at its centre press on a fixed torus and drag along a path; friction
/// rolls it.
class RollingBall {
 public:
  explicit RollingBall(double time_step)
      : torus_(kRing, kTube),
        ball_(kBall),
        engine_(LoadMjcfText(fmt::format(R"(<mujoco><size nuser_geom="2"/><compiler meshdir="{}/mjcf/assets"/>
              <option timestep="{}" gravity="0 0 0" cone="elliptic" impratio="100" solver="Newton" tolerance="1e-14"/>
              <default><geom solref="{} 1" solimp="0.99 0.99 0.001 0.5 2" friction="1 0.005 0.0001" condim="3"/></default>
              <asset><mesh name="torus" file="torus.msh"/></asset><worldbody>
              <body name="torus"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
                <geom type="mesh" mesh="torus" mass="0" user="{} {}"/></body>
              <body name="ball"><freejoint/><geom type="sphere" size="{}" mass="0.05"/></body>
              </worldbody></mujoco>)",
                                         SourcePath(), time_step, 2.0 * time_step, kRing, kTube, kBall),
                             "rolling ball")),
        data_(MakeData(*engine_)) {
    const SurfaceGeometry start = torus_.Evaluate(PathPoint(0.0));
    const Vector3d center = start.p + (kBall - kDepth) * start.R.col(2);
    mju_copy3(data_->qpos, center.data());
    kappa_ = FindContact(ball_, torus_, BallPose()).kappa;
  }

  /// Around the tube once (v from 0 over pi, the hole's side, to 2 pi) while going along the ring.
  static SurfacePoint PathPoint(double t) {
    const double s = t / kDuration;
    const double smooth = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
    return {1.5 * smooth, 2.0 * kPi * smooth, 0};
  }

  /// One engine step under force, then kappa over the same motion.
  void Step() {
    const SurfaceGeometry at = torus_.Evaluate(PathPoint(data_->time));
    const Vector3d wanted = at.p + kBall * at.R.col(2);
    const Vector3d position = Eigen::Map<const Vector3d>(data_->qpos);
    const Vector3d velocity = Eigen::Map<const Vector3d>(data_->qvel);
    constexpr double kStiffness = 200.0;
    constexpr double kDamping = 4.0;
    const Vector3d force = kStiffness * (wanted - position) - kDamping * velocity - kPress * at.R.col(2);
    mju_copy3(data_->xfrc_applied + 6 * 2, force.data());

    const Pose before = BallPose();
    mj_step(engine_.get(), data_.get());
    // Semi-implicit Euler moves the ball with its new velocity, constant over the step.
    const Vector3d v = Eigen::Map<const Vector3d>(data_->qvel);
    const Vector3d omega = Eigen::Map<const Vector3d>(data_->qvel + 3);
    const auto twist = [&](double t, const ContactGeometry& contact) {
      const Matrix3d R = before.linear() * ExpSo3(omega * t);
      Vector6d V_f;
      V_f << R.transpose() * v, omega;
      return CalcRelativeTwist(contact, V_f, Vector6d::Zero());
    };
    kappa_ = IntegrateKappa(ball_, torus_, kappa_, 0.0, engine_->opt.timestep, twist);
    mj_kinematics(engine_.get(), data_.get());
    mj_collision(engine_.get(), data_.get());
  }

  [[nodiscard]] Pose BallPose() const {
    Pose X = Pose::Identity();
    const mjtNum* q = data_->qpos + 3;
    X.linear() = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
    X.translation() = Eigen::Map<const Vector3d>(data_->qpos);
    return X;
  }

  /// Distance of kappa's contact point from the engine's, on the ball (0) and on the torus (1), m.
  [[nodiscard]] double CalcError(int side) const {
    const Eigen::Map<const Vector3d> engine_point(data_->contact[0].pos);
    const Vector3d point = side == 0 ? Vector3d(BallPose() * ball_.Evaluate(kappa_.alpha_f).p)
                                     : torus_.Evaluate(kappa_.alpha_o).p;
    return (point - engine_point).norm();
  }

  [[nodiscard]] bool InContact() const { return data_->ncon == 1; }
  [[nodiscard]] double time() const { return data_->time; }
  [[nodiscard]] const ContactCoordinates& kappa() const { return kappa_; }
  /// kappa by geometry: the projection back on the constraint.
  [[nodiscard]] ContactCoordinates FindKappa() const {
    return FindContact(ball_, torus_, BallPose(), kappa_).kappa;
  }
  void set_kappa(const ContactCoordinates& kappa) { kappa_ = kappa; }
  [[nodiscard]] double CalcSlipSpeed() const {
    const Vector3d v = Eigen::Map<const Vector3d>(data_->qvel);
    const Vector3d omega = BallPose().linear() * Eigen::Map<const Vector3d>(data_->qvel + 3);
    const Vector3d arm =
        Eigen::Map<const Vector3d>(data_->contact[0].pos) - Eigen::Map<const Vector3d>(data_->qpos);
    const Vector3d normal = Eigen::Map<const Vector3d>(data_->contact[0].frame);
    const Vector3d at_contact = v + omega.cross(arm);
    return (at_contact - normal.dot(at_contact) * normal).norm();
  }

 private:
  Torus torus_;
  Sphere ball_;
  MjModelPtr engine_;
  MjDataPtr data_;
  ContactCoordinates kappa_;
};

struct Errors {
  double on_ball = 0.0;
  double on_torus = 0.0;
  double slip = 0.0;
  double least_cos_v = 1.0;  // -1 on the hole's side
};

Errors Roll(double time_step, bool project) {
  RollingBall ball(time_step);
  Errors errors;
  while (ball.time() < kDuration) {
    ball.Step();
    if (!ball.InContact()) continue;  // the first step may not touch yet
    errors.on_ball = std::max(errors.on_ball, ball.CalcError(0));
    errors.on_torus = std::max(errors.on_torus, ball.CalcError(1));
    errors.slip = std::max(errors.slip, ball.CalcSlipSpeed());
    errors.least_cos_v = std::min(errors.least_cos_v, std::cos(ball.kappa().alpha_o.v));
    if (project) ball.set_kappa(ball.FindKappa());
  }
  EXPECT_TRUE(ball.InContact());
  return errors;
}

// The bound asked of a model that is to predict where the fingers touch.
constexpr double kContactPointBound = 1e-4;  // m

TEST(RollingBall, IntegratedContactFollowsTheEngineThroughTheHole) {
  const Errors errors = Roll(1e-3, false);
  RecordProperty("on_ball_m", std::to_string(errors.on_ball));
  EXPECT_LT(errors.least_cos_v, -0.99) << "the path goes through the inner, negatively curved side";
  EXPECT_LT(errors.on_ball, kContactPointBound);
  EXPECT_LT(errors.on_torus, kContactPointBound);
  fmt::print("1 ms, integrated for {} s: ball {:.2e} m, torus {:.2e} m, slip {:.2e} m/s\n", kDuration,
             errors.on_ball, errors.on_torus, errors.slip);
}

TEST(RollingBall, ProjectionRemovesTheDrift) {
  const Errors integrated = Roll(1e-3, false);
  const Errors projected = Roll(1e-3, true);
  fmt::print("1 ms, projected every step: ball {:.2e} m, torus {:.2e} m\n", projected.on_ball,
             projected.on_torus);
  EXPECT_LT(projected.on_ball, integrated.on_ball);
  EXPECT_LT(projected.on_torus, integrated.on_torus);
}

}  // namespace
}  // namespace dexcheck::testing::rolling_engine_test
