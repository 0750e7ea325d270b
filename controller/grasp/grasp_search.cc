#include "controller/grasp/grasp_search.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace dexcheck::grasp_internal {

namespace {

constexpr int kRolls = 12;
// Of the object from the fingers' bases, over the fingers' length; of a given place, the first stands for it.
constexpr std::array<double, 5> kDistances = {0.7, 0.55, 0.62, 0.78, 0.86};

/// Where the palm's z axis may point: down on a support, with up to 50 degrees of tilt, or anywhere.
std::vector<Vector3d> ListDirections(const Pose& X_Bo, const ContactPlanOptions& options) {
  std::vector<Vector3d> directions;
  if (options.support) {
    constexpr std::array<double, 2> kTilts = {DegToRad(25.0), DegToRad(50.0)};
    constexpr int kAzimuths = 8;
    const Vector3d down = -options.support->normal;
    const Vector3d side = down.unitOrthogonal();
    directions.push_back(down);
    for (const double tilt : kTilts) {
      for (int k = 0; k < kAzimuths; ++k) {
        const Vector3d axis = Eigen::AngleAxisd(2.0 * kPi * k / kAzimuths, down) * side;
        directions.emplace_back(Eigen::AngleAxisd(tilt, axis) * down);
      }
    }
    return directions;
  }
  // Along the object's axes and halfway between them.
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        directions.emplace_back(X_Bo.linear() * Vector3d(x, y, z).normalized());
      }
    }
  }
  return directions;
}

}  // namespace

PalmSearch::PalmSearch(const RobotModel& model, const Hand& hand, const HandReach& reach,
                       const Surface& object, const Pose& X_Bo, const Eigen::Ref<const VectorXd>& q_nominal,
                       const ContactPlanOptions& options)
    : reach_(reach),
      object_(object),
      options_(options),
      X_Bo_(X_Bo),
      arm_(model, hand.palm_frame, hand.arm_joints, q_nominal),
      range_(arm_.range().Shrink(options.joint_margin)),
      nominal_(arm_.Gather(q_nominal)),
      p_Po_(hand.hold_at.value_or(reach.center() + kDistances.front() * reach.length() * Vector3d::UnitZ())) {
}

Pose PalmSearch::CalcPalmPose(const Vector3d& direction, double roll) const {
  // From the nominal orientation by the shortest way to the direction, then about it.
  SerialChain::Poses poses;
  arm_.CalcPoses(nominal_, &poses);
  const Matrix3d R_nominal = poses.frame.linear();
  const Vector3d from = R_nominal.col(2);
  const Vector3d about = from.cross(direction);
  const Vector3d axis = about.isZero(0.0) ? from.unitOrthogonal() : about.normalized();
  const Matrix3d turn =
      Eigen::AngleAxisd(std::atan2(about.norm(), from.dot(direction)), axis).toRotationMatrix();
  Pose X_BP = Pose::Identity();
  X_BP.linear() = Eigen::AngleAxisd(roll, direction) * turn * R_nominal;
  X_BP.translation() = X_Bo_.translation() - X_BP.linear() * p_Po_;
  return X_BP;
}

bool PalmSearch::IsPalmClear(const Pose& X_BP) const {
  const Pose X_oP = X_Bo_.inverse() * X_BP;
  std::vector<Vector3d> points = reach_.bases();
  points.push_back(reach_.center());
  points.emplace_back(Vector3d::Zero());
  return std::ranges::all_of(points, [&](const Vector3d& p) {
    return CalcDistance(object_, X_oP * p) >= reach_.radius(0) &&
           (!options_.support ||
            options_.support->CalcHeight(X_BP * p) >= reach_.radius(0) + options_.clearance);
  });
}

bool PalmSearch::IsArmClear(const VectorXd& q_arm) const {
  if (!options_.support) return true;
  SerialChain::Poses poses;
  arm_.CalcPoses(q_arm, &poses);
  return std::ranges::all_of(poses.links, [&](const Pose& link) {
    return options_.support->CalcHeight(link.translation()) >= options_.arm_clearance;
  });
}

ChainSolution PalmSearch::SolveArm(const Pose& X_BP, const VectorXd& q_start) const {
  constexpr double kLength = 0.2;       // m
  constexpr double kTolerance = 1e-12;  // m, rad
  constexpr int kMaxIterations = 60;
  return SolveChain(arm_, {X_BP, kLength, kTolerance, kMaxIterations}, range_, q_start, nominal_);
}

void PalmSearch::Try(const Pose& X_BP, const std::vector<VectorXd>& starts, std::vector<PalmPose>* poses) {
  ++tally_.tried;
  if (!IsPalmClear(X_BP)) {
    ++tally_.blocked;
    return;
  }
  bool reached = false;
  std::optional<PalmPose> best;
  for (const VectorXd& start : starts) {
    const ChainSolution solution = SolveArm(X_BP, start);
    tally_.nearest_miss = std::min(tally_.nearest_miss, solution.position);
    if (!solution.reached) continue;
    reached = true;
    const double margin = arm_.range().CalcMargin(solution.q);
    if (!IsArmClear(solution.q) || (best && margin <= best->arm_margin)) continue;
    best = PalmPose{X_BP, solution.q, margin};
  }
  if (best) {
    poses->push_back(*best);
  } else {
    ++(reached ? tally_.arm_blocked : tally_.missed);
  }
}

std::vector<PalmPose> PalmSearch::List() {
  constexpr int kExtraStarts = 4;
  std::vector<PalmPose> poses;
  for (const Vector3d& direction : ListDirections(X_Bo_, options_)) {
    for (int roll = 0; roll < kRolls; ++roll) {
      std::vector<VectorXd> starts;
      if (!poses.empty()) starts.push_back(poses.back().q_arm);
      starts.push_back(nominal_);
      for (int k = 1; k <= kExtraStarts; ++k) starts.push_back(range_.CalcSpreadPoint(k));
      Try(CalcPalmPose(direction, 2.0 * kPi * roll / kRolls), starts, &poses);
    }
  }
  return poses;
}

std::vector<PalmPose> PalmSearch::ListOtherDistances(const PalmPose& pose) {
  std::vector<PalmPose> poses;
  for (size_t k = 1; k < kDistances.size(); ++k) {
    Pose X_BP = pose.X_BP;
    X_BP.translation() -= (kDistances[k] - kDistances.front()) * reach_.length() * X_BP.linear().col(2);
    Try(X_BP, {pose.q_arm}, &poses);
  }
  return poses;
}

bool PalmSearch::ReachesBeyond(const PalmPose& pose) const {
  return std::ranges::all_of(options_.reaches, [&](const Vector3d& displacement) {
    Pose X_BP = pose.X_BP;
    X_BP.translation() += displacement;
    const ChainSolution solution = SolveArm(X_BP, pose.q_arm);
    return solution.reached && IsArmClear(solution.q);
  });
}

TouchChooser::TouchChooser(const HandReach& hand, double mu, double length, TouchScore score)
    : hand_(hand), mu_(mu), length_(length), score_(score) {
  constexpr int kDirections = 244;
  for (Eigen::Index k = 0; k < 6; ++k) {
    directions_.emplace_back(Vector6d::Unit(k));
    directions_.emplace_back(-Vector6d::Unit(k));
  }
  const JointRange cube{-VectorXd::Ones(6), VectorXd::Ones(6)};
  for (int k = 1; k <= kDirections; ++k) directions_.emplace_back(cube.CalcSpreadPoint(k).normalized());
}

VectorXd TouchChooser::CalcSupports(const Touch& touch) const {
  Eigen::Matrix<double, 6, 3> G = touch.G;
  G.bottomRows<3>() /= length_;
  VectorXd supports(static_cast<Eigen::Index>(directions_.size()));
  for (size_t k = 0; k < directions_.size(); ++k) {
    const Vector3d g = G.transpose() * directions_[k];
    supports[static_cast<Eigen::Index>(k)] = g.z() + mu_ * g.head<2>().norm();
  }
  return supports;
}

void TouchChooser::SetSupports(std::vector<Touch>* touches) const {
  for (Touch& touch : *touches) touch.supports = CalcSupports(touch);
}

std::optional<TouchChoice> TouchChooser::Choose(const std::vector<std::vector<Touch>>& touches,
                                                const HandClearance& clearance, double arm_margin,
                                                int num_starts) const {
  constexpr double kGolden = 0.6180339887498949;
  constexpr int kSweeps = 6;
  for (const std::vector<Touch>& list : touches) {
    if (list.empty()) return {};
  }
  const size_t n = touches.size();
  std::optional<TouchChoice> best;
  VectorXd others;
  for (int start = 0; start < num_starts; ++start) {
    TouchChoice choice;
    for (size_t i = 0; i < n; ++i) {
      const double x = kGolden * start * static_cast<double>(i + 1);
      choice.indices.push_back(
          static_cast<size_t>((x - std::floor(x)) * static_cast<double>(touches[i].size())));
    }
    const auto chosen = [&](size_t i) -> const Touch& { return touches[i][choice.indices[i]]; };
    const auto fits = [&](size_t i, const Touch& touch) {
      for (size_t j = 0; j < n; ++j) {
        if (j != i && !hand_.AreApart(i, touch, j, chosen(j), clearance)) return false;
      }
      return true;
    };
    bool apart = false;
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      bool changed = false;
      apart = true;
      for (size_t i = 0; i < n; ++i) {
        others.setConstant(static_cast<Eigen::Index>(directions_.size()),
                           -std::numeric_limits<double>::infinity());
        for (size_t j = 0; j < n; ++j) {
          if (j != i) others = others.cwiseMax(chosen(j).supports);
        }
        double margin = arm_margin;
        for (size_t j = 0; j < n; ++j) {
          if (j != i) margin = std::min(margin, chosen(j).joint_margin);
        }
        size_t index = choice.indices[i];
        choice.score = -std::numeric_limits<double>::infinity();
        apart = fits(i, touches[i][index]);
        if (apart) {
          choice.bound = others.cwiseMax(chosen(i).supports).minCoeff();
          choice.score = score_.Calc(choice.bound, std::min(margin, chosen(i).joint_margin));
        }
        for (size_t k = 0; k < touches[i].size(); ++k) {
          const Touch& touch = touches[i][k];
          const double bound = others.cwiseMax(touch.supports).minCoeff();
          const double score = score_.Calc(bound, std::min(margin, touch.joint_margin));
          if (score <= choice.score || !fits(i, touch)) continue;
          choice.bound = bound;
          choice.score = score;
          index = k;
          apart = true;
        }
        changed = changed || index != choice.indices[i];
        choice.indices[i] = index;
      }
      if (!changed) break;
    }
    // The last finger fits to all others; the others must to each other.
    for (size_t i = 0; i + 1 < n && apart; ++i) apart = fits(i, chosen(i));
    if (apart && (!best || choice.bound > best->bound)) best = choice;
  }
  return best;
}

ForceClosureResult TouchChooser::Measure(const std::vector<const Touch*>& touches) {
  const auto n = static_cast<Eigen::Index>(touches.size());
  Matrix6Xd G(6, 3 * n);
  for (Eigen::Index i = 0; i < n; ++i) G.middleCols<3>(3 * i) = touches[static_cast<size_t>(i)]->G;
  ForceClosureOptions options;
  options.length = length_;
  ForceClosureResult result = CalcForceClosure(G, VectorXd::Constant(n, mu_), options);
  Vector6d direction = result.direction;
  direction.tail<3>() /= length_;
  directions_.push_back(direction.normalized());
  return result;
}

}  // namespace dexcheck::grasp_internal
