#pragma once

// A grasp of the torus in both worlds, evaluated as the controller does, for the checks of a step.

#include <random>

#include "harness/checks/step_model_check.h"
#include "harness/engine/adapter.h"
#include "tests/common/paths.h"
#include "tests/controller/control/grasp_scene.h"

namespace dexcheck::testing {

/// Evaluated terms of a controller of one robot and grasp, and their check against the shipped scene.
class CheckedController {
 public:
  CheckedController(const RobotSpec& spec, const Torus& torus, std::span<const int> fingertips,
                    OrientationFeedback orientation = OrientationFeedback::kAngles)
      : model(spec),
        engine(LoadMjcf(SourcePath("/mjcf/scene.xml"))),
        adapter(model, *engine, "scene.xml"),
        surface(torus),
        robot(model),
        grasp(model, fingertips, model.object()->body, surface),
        check(adapter, fingertips, orientation),
        orientation_(orientation) {}

  /// Sets robot and object, finds the contacts, and evaluates all terms.
  /// @param offset of the base in the plant against what q' has, in Sigma_0.
  void SetState(const VectorXd& q, const VectorXd& xi, const Pose& X_Bo, const Vector6d& V_Bo,
                const Pose& offset = Pose::Identity()) {
    state.q = q;
    state.xi = xi;
    state.X_Bo = X_Bo;
    state.V_Bo = V_Bo;
    robot.SetState(q, xi);
    robot.CalcDynamics();
    X_W0 = robot.CalcLinkPose(-1) * offset;
    const Pose X_oB = X_Bo.inverse() * X_W0 * robot.CalcLinkPose(-1).inverse();
    state.kappa.resize(grasp.fingertips().size());
    state.overlap.resize(grasp.fingertips().size());
    for (size_t i = 0; i < state.kappa.size(); ++i) {
      const Pose X_of = X_oB * robot.CalcFramePose(grasp.fingertips()[i]);
      const FoundContact found = FindContact(grasp.tip(static_cast<int>(i)), surface, X_of);
      state.kappa[i] = found.kappa;
      state.overlap[i] = -found.gap;
    }
    grasp.SetOverlaps(state.overlap);
    if (orientation_ == OrientationFeedback::kAngles) {
      const Vector6d X_o = CalcObjectCoordinates(X_Bo, Vector6d::Zero());
      grasp.SetState(robot, X_o, CalcP(X_o) * V_Bo, state.kappa);
    } else {
      grasp.SetPose(robot, X_Bo, V_Bo, state.kappa);
    }
  }

  void Compare(double when) { check.Compare(robot, grasp, state, X_W0, when); }

  RobotModel model;
  MjModelPtr engine;
  Adapter adapter;
  Torus surface;
  ModelTerms robot;
  GraspTerms grasp;
  StepModelCheck check;
  MeasuredState state;
  Pose X_W0 = Pose::Identity();

 private:
  OrientationFeedback orientation_;
};

/// States along a random walk about a grasp of the torus by the right hand.
class GraspWalk {
  GraspScene scene_;

 public:
  VectorXd q;
  VectorXd xi;
  Pose X_Bo;
  Vector6d V_Bo = Vector6d::Zero();

  GraspWalk() : q(scene_.q), X_Bo(CalcObjectPose(scene_.X_o)) { Step(0.0); }

  const GraspScene& scene() const { return scene_; }

  /// Moves on by a small step; velocities of about `rate` (m/s, rad/s).
  void Step(double rate) {
    constexpr double kTurn = 1e-3;
    constexpr double kMove = 5e-5;
    constexpr double kDrive = 0.05;
    for (double& angle : q) angle += kTurn * Draw();
    for (int i = 0; i < 3; ++i) q[i] += kDrive * Draw();
    // The object goes where the hand goes, and a little elsewhere.
    ModelTerms robot(scene_.model);
    robot.SetState(q, VectorXd::Zero(robot.size()));
    const int palm = scene_.model.FindFrame("r_palm_frame");
    if (steps_++ == 0) X_po_ = robot.CalcFramePose(palm).inverse() * X_Bo;
    for (int i = 0; i < 3; ++i) X_po_.translation()[i] += kMove * Draw();
    X_po_.linear() *=
        Eigen::AngleAxisd(kTurn, Vector3d(Draw(), Draw(), Draw()).normalized()).toRotationMatrix();
    X_Bo = robot.CalcFramePose(palm) * X_po_;
    X_Bo.linear() = Eigen::Quaterniond(X_Bo.linear()).normalized().toRotationMatrix();
    xi = VectorXd::Zero(robot.size());
    for (double& speed : xi) speed = rate * Draw();
    for (double& speed : V_Bo) speed = rate * Draw();
  }

 private:
  double Draw() { return std::uniform_real_distribution<double>(-1.0, 1.0)(random_); }

  std::mt19937 random_{31};
  Pose X_po_ = Pose::Identity();
  int steps_ = 0;
};

}  // namespace dexcheck::testing
