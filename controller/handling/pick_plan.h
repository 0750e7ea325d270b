#pragma once

// The postures of a grasp from above: over the object, around it, at its surface.

#include <limits>
#include <string>
#include <vector>

#include "controller/grasp/contact_plan.h"

namespace dexcheck {

/// A smooth path of postures: per joint the polynomial through given knots.
class PosturePath {
 public:
  /// Where knot i of `count` lies on the path, from 0 to 1: dense at the ends, so that the polynomial does
  /// not swing between them.
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

struct PickPlanOptions {
  double mu = 0.5;          ///< Friction that the choice of contacts counts on.
  double raise = 0.15;      ///< How far the object is to be lifted; the hand arrives as far over it, m.
  double opening = 0.015;   ///< Gap between fingertips and contacts before the hand closes, m.
  double nearness = 0.002;  ///< Gap from which the fingertips go on slowly, m.
  double depth = 0.004;     ///< How far beyond the surface they go when they find nothing, m.
  double support = 0.0;     ///< Height of what the object lies on, m.
  /// How far the object is to be carried, m. A robot whose base is fixed needs arm postures for it; otherwise
  /// the base drives, and the arm keeps its posture.
  Vector3d transport = Vector3d::Zero();
  /// As ContactPlanOptions.
  double half_length = std::numeric_limits<double>::infinity();
  std::optional<Vector3d> hemisphere = std::nullopt;  ///< As ContactPlanOptions.
};

/// Joint positions (rad), in the model's order.
struct PickPlan {
  bool found = false;
  std::string problem;   ///< Why there is none.
  ContactPlan contacts;  ///< Where the fingertips go.
  VectorXd q_open;       ///< The hand is open around the object.
  PosturePath rise;      ///< From there straight up by `raise`.
  PosturePath along;     ///< From there straight along `transport`; empty where the base drives.
  PosturePath landing;   ///< As `rise`, from where the object is put down.
  VectorXd q_near;       ///< Just off the contacts.
  VectorXd q_deep;       ///< Fingertips in the object.
};

/// @param X_Bo where the object lies. @param q q' to start from and to stay near to.
/// @throws std::invalid_argument as PlanContacts.
PickPlan MakePickPlan(const RobotModel& model, const Hand& hand, const Surface& object, const Pose& X_Bo,
                      const Eigen::Ref<const VectorXd>& q, const PickPlanOptions& options);

}  // namespace dexcheck
