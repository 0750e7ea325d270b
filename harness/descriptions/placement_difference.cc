#include "harness/descriptions/placement_difference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/descriptions/body_comparison.h"
#include "harness/descriptions/description_match.h"
#include "harness/descriptions/fault_search.h"

namespace dexcheck {
namespace {

// Positions, m, and directions that agree to this are the same; the files' digits have been judged before.
constexpr double kSame = 1e-7;

std::string DescribeVector(const Vector3d& vector) {
  const auto tidy = [](double x) { return std::abs(x) < 1e-12 ? 0.0 : x; };
  return fmt::format("[{:.6g} {:.6g} {:.6g}]", tidy(vector.x()), tidy(vector.y()), tidy(vector.z()));
}

/// "34.4 deg about z" or about an oblique axis.
std::string DescribeTurn(const Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  const double angle = turn.angle() * 180.0 / kPi;
  for (int k = 0; k < 3; ++k) {
    if (std::abs(std::abs(turn.axis()[k]) - 1.0) < 1e-6)
      return fmt::format("{:.6g} deg about {}", std::copysign(angle, turn.axis()[k]), "xyz"[k]);
  }
  return fmt::format("{:.6g} deg about {}", angle, DescribeVector(turn.axis()));
}

template <typename A, typename B>
bool AreSame(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  return (a - b).cwiseAbs().maxCoeff() < kSame;
}

/// "position x: 0.1 m in a.urdf, 0.2 m in b.urdf" for the component that differs most.
std::string DescribePositions(const DescribedPair& pair, const Vector3d& a, const Vector3d& b) {
  Eigen::Index k = 0;
  (a - b).cwiseAbs().maxCoeff(&k);
  return fmt::format("position {}: {:.9g} m in {}, {:.9g} m in {}", "xyz"[k], a[k], pair.first, b[k],
                     pair.second);
}

/// The joint's axes as both robots have them with all joints at zero.
std::string CompareAxesAtZero(const DescribedPair& pair, size_t i, size_t j) {
  const Pose X_a = CalcZeroPoses(pair.a)[i + 1];
  const Pose X_b = CalcZeroPoses(pair.b)[j + 1];
  const Vector3d axis_a = X_a.linear() * ListOwnRows(pair.a)[i].axis;
  const Vector3d axis_b = X_b.linear() * ListOwnRows(pair.b)[j].axis;
  if (!AreSame(axis_a, axis_b))
    return fmt::format("axis {} in {}, {} in {} (base frame, all joints at zero)", DescribeVector(axis_a),
                       pair.first, DescribeVector(axis_b), pair.second);
  const Vector3d between = X_a.translation() - X_b.translation();
  return fmt::format("axes are parallel and {:.6g} m apart (all joints at zero)",
                     between.cross(axis_a).norm());
}

}  // namespace

std::optional<std::string> DescribeJointDifference(const DescribedPair& pair, int joint) {
  const auto i = static_cast<size_t>(joint);
  const int other = MatchJoints(pair.a.spec, pair.b.spec)[i];
  if (other < 0) return std::nullopt;
  const auto j = static_cast<size_t>(other);
  const OwnRow a = ListOwnRows(pair.a)[i];
  OwnRow b = ListOwnRows(pair.b)[j];
  const std::vector<Pose> X_ab = RegisterLinks(pair.a, pair.b);
  const Pose X_ab_P = a.parent < 0 ? Pose::Identity() : X_ab[static_cast<size_t>(a.parent)];
  b.X_PL = X_ab_P * b.X_PL * X_ab[i].inverse(Eigen::Isometry);
  b.axis = X_ab[i].linear() * b.axis;
  const bool is_placed = AreSame(a.X_PL.translation(), b.X_PL.translation());
  const bool is_turned = !AreSame(a.X_PL.linear(), b.X_PL.linear());
  const bool has_axis = AreSame(a.axis, b.axis);
  const Vector3d point =
      X_ab[i].translation();  // of the axis of `b`; the axis of `a` passes through the origin
  const bool has_point = !a.is_revolute || point.cross(a.axis).norm() < kSame;
  const int differences =
      (is_placed ? 0 : 1) + (is_turned ? 1 : 0) + (has_axis ? 0 : 1) + (has_point ? 0 : 1);
  if (differences == 0) return std::nullopt;
  if (differences > 1) return CompareAxesAtZero(pair, i, j);
  if (!has_point)
    return fmt::format("axis through {} m of its link in {}, through the link's origin in {}",
                       DescribeVector(point), pair.second, pair.first);
  if (!has_axis)
    return fmt::format("axis {} in {}, {} in {}; its origin agrees", DescribeVector(a.axis), pair.first,
                       DescribeVector(b.axis), pair.second);
  if (is_turned)
    return fmt::format("origin in {} is turned by {} against {}; position and axis agree", pair.first,
                       DescribeTurn(b.X_PL.linear().transpose() * a.X_PL.linear()), pair.second);
  return "origin, " + DescribePositions(pair, a.X_PL.translation(), b.X_PL.translation());
}

std::optional<std::string> DescribeFrameDifference(const DescribedPair& pair, const std::string& frame) {
  const auto find = [&](const RobotSpec& spec) {
    return std::ranges::find(spec.frames, frame, &Frame::name);
  };
  const auto own = find(pair.a.spec);
  const auto other = find(pair.b.spec);
  const std::vector<Joint>& joints = pair.a.spec.joints;
  const bool is_link = std::ranges::find(joints, frame, &Joint::link) != joints.end();
  if (is_link || own == pair.a.spec.frames.end() || other == pair.b.spec.frames.end()) return std::nullopt;
  const auto in_link = [](const RobotDescription& robot, const Frame& one) {
    if (one.link < 0) return one.X_LF;
    return Pose(robot.joints[static_cast<size_t>(one.link)].X_iL.inverse(Eigen::Isometry) * one.X_LF);
  };
  const Pose a = in_link(pair.a, *own);
  Pose b = in_link(pair.b, *other);
  if (own->link >= 0) b = RegisterLinks(pair.a, pair.b)[static_cast<size_t>(own->link)] * b;
  const bool is_placed = AreSame(a.translation(), b.translation());
  if (AreSame(a.linear(), b.linear())) {
    if (is_placed) return std::nullopt;
    return DescribePositions(pair, a.translation(), b.translation());
  }
  return fmt::format(
      "{} has it turned by {} against {}; {}", pair.first, DescribeTurn(b.linear().transpose() * a.linear()),
      pair.second,
      is_placed ? "its position agrees" : DescribePositions(pair, a.translation(), b.translation()));
}

}  // namespace dexcheck
