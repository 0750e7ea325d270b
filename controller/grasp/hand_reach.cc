#include "controller/grasp/hand_reach.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <stdexcept>

#include "controller/common/errors.h"
#include "controller/contact/contact_geometry.h"

namespace dexcheck::grasp_internal {
namespace {

constexpr int kPostures = 1500;     // of each finger, to find out where it reaches
constexpr double kBand = 0.008;     // m; a posture this near to touching is worth solving for
constexpr double kSpacing = 0.008;  // m, between points along a finger

/// Origins of the joints and the fingertip's centre, with points in between.
std::vector<Vector3d> ListPoints(const SerialChain::Poses& poses) {
  std::vector<Vector3d> points;
  Vector3d from = poses.links.front().translation();
  const auto add = [&](const Vector3d& to) {
    const int pieces = std::max(1, static_cast<int>(std::ceil((to - from).norm() / kSpacing)));
    for (int k = 0; k < pieces; ++k)
      points.emplace_back(from + (to - from) * (static_cast<double>(k) / pieces));
    from = to;
  };
  for (size_t k = 1; k < poses.links.size(); ++k) {
    if ((poses.links[k].translation() - from).norm() > 0.0) add(poses.links[k].translation());
  }
  add(poses.frame.translation());
  points.push_back(from);
  return points;
}

}  // namespace

double CalcDistance(const Surface& object, const Vector3d& p) {
  try {
    return object.Project(p).distance;
  } catch (const SingularityError&) {
    constexpr double kOffset = 1e-7;  // m
    return object.Project(p + kOffset * Vector3d(1.0, 2.0, 3.0)).distance;
  }
}

HandReach::HandReach(const RobotModel& model, std::span<const int> fingertips, int palm_frame,
                     const Eigen::Ref<const VectorXd>& q, double joint_margin) {
  const std::vector<std::vector<int>> own = ListOwnJoints(model, fingertips);
  const std::vector<int> palm_chain = model.ListChain(model.frame(palm_frame).link);
  const SerialChain palm(model, palm_frame, palm_chain, q);
  SerialChain::Poses poses;
  palm.CalcPoses(palm.Gather(q), &poses);
  const Pose X_PB = poses.frame.inverse();
  double farthest = 0.0;
  for (size_t i = 0; i < fingertips.size(); ++i) {
    const std::vector<int> chain = model.ListChain(model.frame(fingertips[i]).link);
    const bool on_palm = std::includes(chain.begin(), chain.end(), palm_chain.begin(), palm_chain.end());
    const bool is_free = std::ranges::find(palm_chain, own[i].back()) == palm_chain.end();
    if (!on_palm || !is_free) {
      throw std::invalid_argument("fingertips: " + model.frame(fingertips[i]).name +
                                  " does not hang on the palm with the others");
    }
    Finger finger{
        SerialChain(model, fingertips[i], own[i], q), model.tip_radius(fingertips[i]), {}, {}, {}, {}};
    finger.chain.SetRoot(X_PB);
    finger.range = finger.chain.range().Shrink(joint_margin);
    finger.middle = 0.5 * (finger.range.lower + finger.range.upper);
    for (int k = 1; k <= kPostures; ++k) {
      finger.postures.push_back(finger.range.CalcSpreadPoint(k));
      finger.chain.CalcPoses(finger.postures.back(), &poses);
      finger.tips.push_back(poses.frame.translation());
      farthest = std::max(farthest, poses.frame.translation().z());
    }
    bases_.push_back(poses.links.front().translation());
    fingers_.push_back(std::move(finger));
  }
  Vector3d least = bases_.front();
  Vector3d most = bases_.front();
  for (const Vector3d& base : bases_) {
    least = least.cwiseMin(base);
    most = most.cwiseMax(base);
  }
  center_ = 0.5 * (least + most);
  length_ = farthest - center_.z();
}

std::optional<Touch> HandReach::FindTouch(size_t finger_index, const Surface& object, const Pose& X_Po,
                                          const HandClearance& clearance, const SurfacePoint& alpha,
                                          const VectorXd& q_start) const {
  constexpr double kNearlyAll = 0.999;
  const Finger& finger = fingers_[finger_index];
  if (!object.Contains(alpha, finger.radius)) return {};
  const SurfaceGeometry surface = object.Evaluate(alpha);
  const Vector3d n = surface.R.col(2);
  if (std::abs(surface.p.z()) > clearance.options.half_length) return {};
  // The fingertip must come from somewhere.
  const double away = finger.radius + clearance.options.room;
  if (clearance.above) {
    const double slope = clearance.above->normal.dot(X_Po.linear() * n);
    if (std::abs(slope) > std::sin(clearance.options.steepest)) return {};
    const double height = clearance.above->CalcHeight(X_Po * Vector3d(surface.p + away * n));
    if (height < finger.radius + clearance.options.clearance) return {};
  }
  if (CalcDistance(object, surface.p + away * n) < kNearlyAll * away) return {};

  const auto solve = [&](double distance, const VectorXd& start) {
    constexpr double kTolerance = 1e-10;  // m
    constexpr int kMaxIterations = 40;
    Pose X = Pose::Identity();
    X.translation() = X_Po * Vector3d(surface.p + distance * n);
    return SolveChain(finger.chain, {X, 0.0, kTolerance, kMaxIterations}, finger.range, start, finger.middle);
  };
  const ChainSolution solution = solve(finger.radius, q_start);
  if (!solution.reached) return {};
  const ChainSolution open = solve(finger.radius + clearance.options.opening, solution.q);
  if (!open.reached) return {};

  Touch touch;
  SerialChain::Poses poses;
  finger.chain.CalcPoses(solution.q, &poses);
  touch.points = ListPoints(poses);
  // The object's outward normal points into the fingertip.
  const Vector3d p_f = -(poses.frame.linear().transpose() * (X_Po.linear() * n));
  if (clearance.options.hemisphere &&
      CalcRimDistance(finger.radius, *clearance.options.hemisphere, p_f) < 0.0)
    return {};
  const Pose X_oP = X_Po.inverse();
  const double thick = clearance.options.finger_thickness * finger.radius;
  for (size_t k = 0; k < touch.points.size(); ++k) {
    const bool is_tip = k + 1 == touch.points.size();
    const double radius = is_tip ? finger.radius : thick;
    if (clearance.above &&
        clearance.above->CalcHeight(touch.points[k]) < radius + clearance.options.clearance)
      return {};
    if (!is_tip && CalcDistance(object, X_oP * touch.points[k]) < thick) return {};
  }
  touch.alpha = alpha;
  // Forces of the finger in a frame whose z points into the object (23).
  Matrix3d R;
  R << surface.R.col(0), -surface.R.col(1), -n;
  touch.G << R, Skew(surface.p) * R;
  touch.q = solution.q;
  touch.q_open = open.q;
  touch.joint_margin = finger.chain.range().CalcMargin(solution.q);
  return touch;
}

std::vector<Touch> HandReach::ListTouches(size_t finger_index, const Surface& object, const Pose& X_Po,
                                          const HandClearance& clearance, double grid) const {
  const Finger& finger = fingers_[finger_index];
  const Pose X_oP = X_Po.inverse();
  std::vector<Touch> touches;
  std::set<std::array<int, 3>> cells;
  for (size_t k = 0; k < finger.tips.size(); ++k) {
    const Vector3d p = X_oP * finger.tips[k];
    SurfaceProjection projection;
    try {
      projection = object.Project(p);
    } catch (const SingularityError&) {
      continue;
    }
    if (std::abs(projection.distance - finger.radius) > kBand) continue;
    const SurfacePoint alpha = object.Normalize(projection.alpha);
    const Vector3d place = object.Evaluate(alpha).p / grid;
    const std::array<int, 3> cell = {static_cast<int>(std::floor(place.x())),
                                     static_cast<int>(std::floor(place.y())),
                                     static_cast<int>(std::floor(place.z()))};
    if (!cells.insert(cell).second) continue;
    std::optional<Touch> touch = FindTouch(finger_index, object, X_Po, clearance, alpha, finger.postures[k]);
    if (touch) touches.push_back(std::move(*touch));
  }
  return touches;
}

bool HandReach::AreApart(size_t finger_a, const Touch& a, size_t finger_b, const Touch& b,
                         const HandClearance& clearance) const {
  const double tips = fingers_[finger_a].radius + fingers_[finger_b].radius + clearance.options.spacing;
  if ((a.points.back() - b.points.back()).squaredNorm() < tips * tips) return false;
  const double tubes =
      clearance.options.finger_thickness * (fingers_[finger_a].radius + fingers_[finger_b].radius) +
      clearance.options.spacing;
  for (const Vector3d& p : a.points) {
    for (const Vector3d& q : b.points) {
      if ((p - q).squaredNorm() < tubes * tubes) return false;
    }
  }
  return true;
}

}  // namespace dexcheck::grasp_internal
