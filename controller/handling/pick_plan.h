#pragma once

// The postures of a grasp from above: over the object, around it, at its surface.

#include <span>
#include <string>
#include <vector>

#include "controller/common/types.h"
#include "controller/contact/surface.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// A smooth path of postures: per joint the polynomial through given knots.
class PosturePath {
 public:
  /// Path parameter of knot i of `count`, from 0 to 1: dense at the ends, so that the polynomial does not
  /// swing between them.
  static double KnotPlace(int i, int count);

  PosturePath() = default;
  /// @param knots postures at KnotPlace(0), .. KnotPlace(n - 1), two or more of one size.
  explicit PosturePath(const std::vector<VectorXd>& knots);

  [[nodiscard]] Eigen::Index size() const { return coefficients_.rows(); }
  /// Posture at s, and its first two derivatives by s. Nothing allocates when the sizes fit.
  void Evaluate(double s, VectorXd* q, VectorXd* q_s, VectorXd* q_ss) const;
  [[nodiscard]] VectorXd Evaluate(double s) const;

 private:
  MatrixXd coefficients_;  // joints x powers of x = 2 s - 1
};

/// The hand that is to hold the object.
struct Hand {
  std::vector<int> fingertips;  ///< Frames that carry spheres, three or more.
  int palm_frame = -1;
  std::vector<int> arm_joints;  ///< On the chain to the palm, to be moved; see ListArmJoints.
};

/// Joints that move a frame but none of the model's fingertips beyond the given ones: the hand's own arm.
std::vector<int> ListArmJoints(const RobotModel& model, std::span<const int> fingertips, int palm_frame);

struct PickPlanOptions {
  std::vector<SurfacePoint> contacts;  ///< On the object, one for each fingertip.
  Pose X_Po = Pose::Identity();        ///< The object in the palm frame while it is held.
  double mu = 0.5;                     ///< Friction that force closure counts on.
  double raise = 0.15;      ///< How far the object is to be lifted; the hand arrives as far over it, m.
  double opening = 0.015;   ///< Gap between fingertips and contacts before the hand closes, m.
  double nearness = 0.002;  ///< Gap from which the fingertips go on slowly, m.
  double depth = 0.004;     ///< How far beyond the surface they go when they find nothing, m.
  /// How far the object is to be carried, m. A robot whose base is fixed needs arm postures for it; otherwise
  /// the base drives, and the arm keeps its posture.
  Vector3d transport = Vector3d::Zero();
};

/// Joint positions (rad), in the model's order.
struct PickPlan {
  bool found = false;
  std::string problem;  ///< Why there is none.
  double margin = 0.0;  ///< Of force closure per newton of normal force, a lower bound.
  VectorXd q_open;      ///< The hand is open around the object.
  PosturePath rise;     ///< From there straight up by `raise`.
  PosturePath along;    ///< From there straight along `transport`; empty where the base drives.
  PosturePath landing;  ///< As `rise`, from where the object is put down.
  VectorXd q_near;      ///< Just off the contacts.
  VectorXd q_deep;      ///< Fingertips in the object.
};

/// Postures with which the hand takes the object at the given contacts. A grasp of a sphere, a cylinder or a
/// torus may turn about the object's z axis: of turns by 15 degrees, the feasible one that changes the arm's
/// posture least is taken.
/// @param X_Bo pose of the object. @param q q' at the start, from which the plan departs little; its entries
/// of the fingers are where the search for contact begins.
/// @throws std::invalid_argument as SolveFramePlacement and SolveFingerPlacement.
PickPlan MakePickPlan(const RobotModel& model, const Hand& hand, const Surface& object, const Pose& X_Bo,
                      const Eigen::Ref<const VectorXd>& q, const PickPlanOptions& options);

}  // namespace dexcheck
