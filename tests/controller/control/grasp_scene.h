#pragma once

// A torus held by the paper's robot, with velocities that satisfy (45).

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "controller/contact/contact_geometry.h"
#include "controller/contact/shapes.h"
#include "controller/control/grasp_terms.h"
#include "controller/control/pseudoinverse.h"
#include "controller/grasp/finger_placement.h"
#include "controller/object/so3.h"
#include "tests/common/paper_robot.h"

namespace dexcheck::testing {

/// X_o_ddot = P (V_Bo_dot - d/dt(P^-1) X_o_dot).
inline Vector6d CalcCoordinateAcceleration(const GraspTerms& grasp, const Vector6d& V_Bo_dot) {
  return CalcP(grasp.X_o()) * (V_Bo_dot - grasp.coordinates().P_inv_dot * grasp.X_o_dot());
}

/// Entries within -+scale.
inline VectorXd DrawVector(Eigen::Index size, double scale, std::mt19937* random) {
  std::uniform_real_distribution<double> uniform(-scale, scale);
  VectorXd v(size);
  for (double& entry : v) entry = uniform(*random);
  return v;
}

/// Another gain for each axis.
inline ObjectGains MakeGains() {
  ObjectGains gains;
  gains.K_v << 10.0, 12.0, 14.0, 16.0, 18.0, 20.0;
  gains.K_p << 30.0, 40.0, 50.0, 60.0, 70.0, 80.0;
  return gains;
}

enum class Hands { kRight, kLeft, kBoth };

/// Robot, torus and contacts at one state.
class GraspScene {
 public:
  explicit GraspScene(Hands hands = Hands::kRight, DriveVelocity velocity = DriveVelocity::kTwist)
      : model(ReadPaperRobot(velocity)),
        surface(hands == Hands::kBoth ? Torus(0.25, 0.04) : Torus(0.035, 0.011)),
        object(hands == Hands::kBoth ? MakeLargeTorus() : model.object()->body),
        fingertips(ListFingertips(hands)),
        robot(model),
        grasp(model, fingertips, object, surface) {
    q = VectorXd::Zero(model.num_positions());
    q.head<3>() << 0.3, -0.2, 0.4;
    if (hands == Hands::kBoth) {
      PlaceBothHands();
    } else {
      PlaceOneHand(hands == Hands::kRight ? "r_" : "l_");
    }
    xi = VectorXd::Zero(robot.size());
    SetState();
  }

  int num_forces() const { return grasp.num_forces(); }

  /// Any xi and X_o_dot that satisfy (45), of some `scale` (m/s, rad/s).
  void DrawVelocities(std::mt19937* random, double scale) {
    std::uniform_real_distribution<double> uniform(-scale, scale);
    for (double& rate : xi) rate = uniform(*random);
    for (double& rate : X_o_dot) rate = uniform(*random);
    ProjectVelocity();
  }

  /// Moves xi onto (45), least in the norm of xi.
  void ProjectVelocity() {
    SetState();
    Pseudoinverse J_B_pinv("J_B'", num_forces(), robot.size());
    J_B_pinv.Factor(grasp.J_B());
    VectorXd change(robot.size());
    J_B_pinv.Apply(grasp.slip(), change);
    xi -= change;
    SetState();
  }

  /// Terms at q, xi, X_o, X_o_dot, kappa.
  void SetState() {
    robot.SetState(q, xi);
    robot.CalcDynamics();
    grasp.SetState(robot, X_o, X_o_dot, kappa);
  }

  /// kappa by geometry; returns the largest gap, m.
  double FindContacts() {
    double gap = 0.0;
    robot.SetState(q, xi);
    const Pose X_Bo = CalcObjectPose(X_o);
    kappa.resize(fingertips.size());
    for (size_t i = 0; i < fingertips.size(); ++i) {
      const Pose X_OF = X_Bo.inverse() * robot.CalcFramePose(fingertips[i]);
      const FoundContact found = FindContact(grasp.tip(static_cast<int>(i)), surface, X_OF);
      kappa[i] = found.kappa;
      gap = std::max(gap, std::abs(found.gap));
    }
    return gap;
  }

  /// An internal force: every finger pushes with about `push` N. G F_N = 0.
  VectorXd CalcInternalForce(double push) const {
    VectorXd f = VectorXd::Zero(num_forces());
    for (Eigen::Index i = 2; i < f.size(); i += 3) f[i] = push;
    Pseudoinverse G_pinv("G", 6, num_forces());
    G_pinv.Factor(grasp.G());
    G_pinv.Project(f);
    return f;
  }

  RobotModel model;
  Torus surface;
  MassProperties object;
  std::vector<int> fingertips;
  ModelTerms robot;
  GraspTerms grasp;
  VectorXd q;
  VectorXd xi;
  Vector6d X_o = Vector6d::Zero();
  Vector6d X_o_dot = Vector6d::Zero();
  std::vector<ContactCoordinates> kappa;

 private:
  static MassProperties MakeLargeTorus() {
    return CalcMassProperties(SolidTorus{0.25, 0.04}, 1.0, Pose::Identity());
  }

  std::vector<int> ListFingertips(Hands hands) const {
    const std::span<const int> all(model.fingertips());
    const std::span<const int> chosen = hands == Hands::kRight  ? all.first(4)
                                        : hands == Hands::kLeft ? all.last(4)
                                                                : all;
    return {chosen.begin(), chosen.end()};
  }

  void SetJoint(const std::string& name, double degrees) { q[3 + model.FindJoint(name)] = DegToRad(degrees); }

  void Close(const Pose& X_Bo, const std::vector<SurfacePoint>& targets) {
    const FingerPlacement placement = SolveFingerPlacement(model, fingertips, surface, X_Bo, targets, q);
    if (!placement.reached) {
      throw std::runtime_error("fingers do not reach the torus, residual " +
                               std::to_string(placement.residual));
    }
    q = placement.q;
    X_o = CalcObjectCoordinates(X_Bo, Vector6d::Zero());
    xi = VectorXd::Zero(robot.size());
    FindContacts();
  }

  void PlaceOneHand(const std::string& prefix) {
    SetJoint(prefix + "shoulder_pitch", 10.0);
    SetJoint(prefix + "elbow", 85.0);
    for (int joint = 16; joint < model.num_joints(); ++joint) q[3 + joint] = 0.3;
    robot.SetState(q, VectorXd::Zero(robot.size()));
    Pose X_po = Pose::Identity();
    X_po.translation() = Vector3d(0.0, 0.0, 0.12);
    std::vector<SurfacePoint> targets;
    for (const double degrees : {125.0, 90.0, 55.0, -90.0}) targets.push_back({DegToRad(degrees), 0.0, 0});
    Close(robot.CalcFramePose(model.FindFrame(prefix + "palm_frame")) * X_po, targets);
  }

  /// Both palms before the body, the torus between fingers (one side of the tube) and thumbs (the other).
  void PlaceBothHands() {
    for (const auto& [prefix, sign] : {std::pair("r_", 1.0), std::pair("l_", -1.0)}) {
      const std::string arm = prefix;
      SetJoint(arm + "shoulder_pitch", 14.0);
      SetJoint(arm + "elbow", 69.0);
      SetJoint(arm + "shoulder_roll", 13.0 * sign);
      SetJoint(arm + "upper_arm_yaw", -20.0 * sign);
      SetJoint(arm + "wrist_deviation", -14.0 * sign);
      SetJoint(arm + "wrist_flexion", -11.0);
    }
    for (int joint = 16; joint < model.num_joints(); ++joint) q[3 + joint] = 0.3;
    robot.SetState(q, VectorXd::Zero(robot.size()));
    const Pose X_Br = robot.CalcFramePose(model.FindFrame("r_palm_frame"));
    const Pose X_Bl = robot.CalcFramePose(model.FindFrame("l_palm_frame"));
    // The tube's middle passes 0.12 m before both palms; the ring's plane holds their common x axis.
    const Vector3d right = X_Br * Vector3d(0.0, 0.0, 0.12);
    const Vector3d left = X_Bl * Vector3d(0.0, 0.0, 0.12);
    const Vector3d y = (left - right).normalized();
    const Vector3d down = X_Br.linear().col(1) + X_Bl.linear().col(1);
    const Vector3d z = -(down - down.dot(y) * y).normalized();
    const double half = (left - right).norm() / 2.0;
    const double distance = std::sqrt(surface.ring_radius() * surface.ring_radius() - half * half);
    Pose X_Bo = Pose::Identity();
    X_Bo.linear() << y.cross(z), y, z;
    X_Bo.translation() = (left + right) / 2.0 + distance * X_Bo.linear().col(0);
    std::vector<SurfacePoint> targets;
    for (const Pose& X_palm : {X_Br, X_Bl}) {
      for (const double x : {-0.028, 0.0, 0.028, 0.0}) {
        const Vector3d p = X_Bo.inverse() * (X_palm * Vector3d(x, 0.0, 0.12));
        const bool is_thumb = targets.size() % 4 == 3;
        targets.push_back({std::atan2(p.y(), p.x()), is_thumb ? kPi / 2.0 : -kPi / 2.0, 0});
      }
    }
    Close(X_Bo, targets);
  }
};

}  // namespace dexcheck::testing
