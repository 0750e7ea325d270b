#include "controller/grasp/contact_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/grasp/finger_placement.h"
#include "controller/grasp/hand_reach.h"
#include "controller/grasp/own_joints.h"
#include "controller/grasp/serial_chain.h"
#include "controller/grasp/spread_points.h"
#include "controller/grasp/touch_choice.h"
#include "controller/object/so3.h"

namespace dexcheck {
namespace {

using grasp_internal::CalcDistance;
using grasp_internal::CalcRangeMargin;
using grasp_internal::ChainSolution;
using grasp_internal::ChainTarget;
using grasp_internal::HalfSpace;
using grasp_internal::HandClearance;
using grasp_internal::HandReach;
using grasp_internal::SerialChain;
using grasp_internal::Touch;
using grasp_internal::TouchChoice;
using grasp_internal::TouchChooser;
using grasp_internal::TouchScore;

constexpr int kRolls = 12;
constexpr double kMapGrid = 0.006;  // m
constexpr int kMapStarts = 8;
constexpr int kNumRefined = 4;  // palm poses whose contacts are refined
constexpr std::array<double, 5> kDistances = {0.7, 0.55, 0.62, 0.78, 0.86};  // of the fingers' length

/// The palm relative to the object: direction of its z axis, roll, distance.
struct PalmPose {
  Pose X_BP;
  VectorXd q_arm;
  double arm_margin = 0.0;
  std::vector<std::vector<Touch>> touches;
  TouchChoice choice;
};

/// A plan with everything that was measured about it.
struct Candidate {
  const PalmPose* palm = nullptr;
  std::vector<Touch> touches;
  double margin = 0.0;
  double joint_margin = 0.0;
  double score = 0.0;
};

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
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x != 0 || y != 0 || z != 0) {
          directions.emplace_back(X_Bo.linear() * Vector3d(x, y, z).normalized());
        }
      }
    }
  }
  return directions;
}

/// One search for one object pose.
class Planner {
 public:
  Planner(const RobotModel& model, const Hand& hand, const Surface& object, const Pose& X_Bo,
          const Eigen::Ref<const VectorXd>& q_nominal, const ContactPlanOptions& options)
      : model_(model),
        hand_(hand),
        object_(object),
        X_Bo_(X_Bo),
        q_nominal_(q_nominal),
        options_(options),
        arm_(model, hand.palm_frame, hand.arm_joints, q_nominal),
        reach_(model, hand.fingertips, hand.palm_frame, q_nominal, options.joint_margin),
        score_{options.comfort},
        chooser_(reach_, options.mu, options.length, score_),
        lower_(arm_.lower().array() + options.joint_margin),
        upper_(arm_.upper().array() - options.joint_margin),
        nominal_(arm_.Gather(q_nominal)) {
    Require((lower_.array() <= upper_.array()).all(), "joint_margin", "must leave each joint a range",
            options.joint_margin);
    clearance_.joint_margin = options.joint_margin;
    clearance_.thickness = options.finger_thickness;
    clearance_.spacing = options.spacing;
    clearance_.room = options.room;
    clearance_.support = options.clearance;
    clearance_.steepest = options.steepest;
  }

  ContactPlan Plan() {
    std::vector<PalmPose> poses = ListPalmPoses();
    for (PalmPose& pose : poses) MapTouches(&pose);
    const auto by_palm_score = [](const PalmPose& a, const PalmPose& b) {
      return a.choice.score > b.choice.score;
    };
    std::erase_if(poses, [](const PalmPose& pose) { return pose.choice.indices.empty(); });
    std::stable_sort(poses.begin(), poses.end(), by_palm_score);
    AddDistances(&poses);
    std::stable_sort(poses.begin(), poses.end(), by_palm_score);
    if (!poses.empty()) best_bound_ = poses.front().choice.bound;

    std::vector<Candidate> candidates;
    for (const PalmPose& pose : poses) {
      if (candidates.size() == kNumRefined || pose.choice.bound <= options_.least_margin) break;
      if (!ReachesBeyond(pose)) continue;
      Candidate candidate = Refine(pose);
      best_margin_ = std::max(best_margin_, candidate.margin);
      if (candidate.margin >= options_.least_margin) candidates.push_back(std::move(candidate));
    }
    ContactPlan plan;
    plan.palm_poses = num_poses_;
    if (candidates.empty()) {
      plan.problem = DescribeProblem(poses.size());
      return plan;
    }
    const auto by_score = [](const Candidate& a, const Candidate& b) { return a.score < b.score; };
    Finish(*std::max_element(candidates.begin(), candidates.end(), by_score), &plan);
    return plan;
  }

 private:
  [[nodiscard]] Pose CalcPalmPose(const Vector3d& direction, double roll, double distance) const {
    // From the nominal orientation by the shortest way to the direction, then about it.
    SerialChain::Poses poses;
    arm_.CalcPoses(nominal_, &poses);
    const Matrix3d R_nominal = poses.frame.linear();
    const Matrix3d turn = Eigen::Quaterniond::FromTwoVectors(R_nominal.col(2), direction).toRotationMatrix();
    Pose X_BP;
    X_BP.linear() = Eigen::AngleAxisd(roll, direction) * turn * R_nominal;
    const Vector3d& center = reach_.center();
    const Vector3d p_Po(center.x(), center.y(), center.z() + distance * reach_.length());
    X_BP.translation() = X_Bo_.translation() - X_BP.linear() * p_Po;
    X_BP.makeAffine();
    return X_BP;
  }

  /// Palm and fingers' bases are outside of the object and above the support.
  [[nodiscard]] bool IsPalmClear(const Pose& X_BP) const {
    const Pose X_oP = X_Bo_.inverse() * X_BP;
    std::vector<Vector3d> points = reach_.bases();
    points.push_back(reach_.center());
    points.emplace_back(Vector3d::Zero());
    for (const Vector3d& p : points) {
      if (CalcDistance(object_, X_oP * p) < reach_.radius(0)) return false;
      if (options_.support && CalcHeight(X_BP * p) < reach_.radius(0) + options_.clearance) return false;
    }
    return true;
  }

  [[nodiscard]] double CalcHeight(const Vector3d& p) const {
    return options_.support->normal.dot(p) - options_.support->height;
  }

  [[nodiscard]] bool IsArmClear(const VectorXd& q_arm) const {
    if (!options_.support) return true;
    SerialChain::Poses poses;
    arm_.CalcPoses(q_arm, &poses);
    return std::all_of(poses.links.begin(), poses.links.end(), [&](const Pose& link) {
      return CalcHeight(link.translation()) >= options_.arm_clearance;
    });
  }

  [[nodiscard]] ChainSolution SolveArm(const Pose& X_BP, const VectorXd& q_start) const {
    constexpr double kLength = 0.2;  // m
    return SolveChain(arm_, {X_BP, kLength, 1e-12, 60}, lower_, upper_, q_start, nominal_);
  }

  /// Adds the palm pose if the arm reaches it from one of the starts.
  bool TryPalmPose(const Pose& X_BP, const std::vector<VectorXd>& starts, std::vector<PalmPose>* poses) {
    ++num_poses_;
    if (!IsPalmClear(X_BP)) {
      ++num_palm_blocked_;
      return false;
    }
    bool reached = false;
    for (const VectorXd& start : starts) {
      const ChainSolution solution = SolveArm(X_BP, start);
      nearest_miss_ = std::min(nearest_miss_, solution.position);
      if (!solution.reached) continue;
      reached = true;
      if (!IsArmClear(solution.q)) continue;
      poses->push_back({X_BP, solution.q, CalcRangeMargin(solution.q, arm_.lower(), arm_.upper()), {}, {}});
      return true;
    }
    ++(reached ? num_arm_blocked_ : num_missed_);
    return false;
  }

  std::vector<PalmPose> ListPalmPoses() {
    constexpr int kExtraStarts = 2;
    std::vector<PalmPose> poses;
    for (const Vector3d& direction : ListDirections(X_Bo_, options_)) {
      for (int roll = 0; roll < kRolls; ++roll) {
        std::vector<VectorXd> starts;
        if (!poses.empty()) starts.push_back(poses.back().q_arm);
        starts.push_back(nominal_);
        for (int k = 1; k <= kExtraStarts; ++k) {
          starts.push_back(grasp_internal::CalcSpreadPoint(k, lower_, upper_));
        }
        TryPalmPose(CalcPalmPose(direction, 2.0 * kPi * roll / kRolls, kDistances.front()), starts, &poses);
      }
    }
    return poses;
  }

  [[nodiscard]] HandClearance MakeClearance(const Pose& X_BP) const {
    HandClearance clearance = clearance_;
    if (options_.support) {
      clearance.above =
          HalfSpace{options_.support->normal, options_.support->height}.Transform(X_BP.inverse());
    }
    return clearance;
  }

  /// What each finger can touch from a palm pose, and the best of it.
  void MapTouches(PalmPose* pose) const {
    const Pose X_Po = pose->X_BP.inverse() * X_Bo_;
    const HandClearance clearance = MakeClearance(pose->X_BP);
    for (size_t i = 0; i < reach_.num_fingers(); ++i) {
      pose->touches.push_back(reach_.ListTouches(i, object_, X_Po, clearance, kMapGrid));
      if (pose->touches.back().empty()) return;
      chooser_.SetSupports(&pose->touches.back());
    }
    if (const auto choice = chooser_.Choose(pose->touches, clearance, pose->arm_margin, kMapStarts))
      pose->choice = *choice;
  }

  /// The best palm poses also at the other distances.
  void AddDistances(std::vector<PalmPose>* poses) {
    const size_t count = std::min<size_t>(poses->size(), kNumRefined);
    std::vector<PalmPose> others;
    for (size_t k = 0; k < count; ++k) {
      const PalmPose& pose = (*poses)[k];
      for (size_t d = 1; d < kDistances.size(); ++d) {
        Pose X_BP = pose.X_BP;
        X_BP.translation() -= (kDistances[d] - kDistances.front()) * reach_.length() * X_BP.linear().col(2);
        TryPalmPose(X_BP, {pose.q_arm}, &others);
      }
    }
    for (PalmPose& pose : others) {
      MapTouches(&pose);
      if (!pose.choice.indices.empty()) poses->push_back(std::move(pose));
    }
  }

  [[nodiscard]] bool ReachesBeyond(const PalmPose& pose) {
    for (const Vector3d& displacement : options_.reaches) {
      Pose X_BP = pose.X_BP;
      X_BP.translation() += displacement;
      const ChainSolution solution = SolveArm(X_BP, pose.q_arm);
      if (solution.reached && IsArmClear(solution.q)) continue;
      ++num_short_;
      return false;
    }
    return true;
  }

  /// Moves the contacts over the surface in smaller and smaller steps while the exact margin grows.
  Candidate Refine(const PalmPose& pose) {
    constexpr std::array<double, 6> kSteps = {0.003, 0.003, 0.0015, 0.0015, 0.00075, 0.0004};  // m
    const Pose X_Po = pose.X_BP.inverse() * X_Bo_;
    const HandClearance clearance = MakeClearance(pose.X_BP);
    Candidate candidate;
    candidate.palm = &pose;
    for (size_t i = 0; i < reach_.num_fingers(); ++i) {
      candidate.touches.push_back(pose.touches[i][pose.choice.indices[i]]);
    }
    Measure(&candidate);
    for (const double step : kSteps) {
      std::vector<std::vector<Touch>> touches;
      for (size_t i = 0; i < reach_.num_fingers(); ++i) {
        touches.push_back(ListNeighbours(i, candidate.touches[i], X_Po, clearance, step));
      }
      // The bound is sharp only in directions seen before: choose, measure, and choose again.
      constexpr int kTries = 3;
      for (int k = 0; k < kTries; ++k) {
        for (std::vector<Touch>& list : touches) chooser_.SetSupports(&list);
        const std::optional<TouchChoice> choice = chooser_.Choose(touches, clearance, pose.arm_margin, 1);
        if (!choice || choice->score <= candidate.score) break;
        Candidate changed{&pose, {}};
        for (size_t i = 0; i < touches.size(); ++i) {
          changed.touches.push_back(touches[i][choice->indices[i]]);
        }
        Measure(&changed);
        if (changed.score <= candidate.score) continue;
        candidate = std::move(changed);
        break;
      }
    }
    return candidate;
  }

  void Measure(Candidate* candidate) {
    std::vector<const Touch*> touches;
    candidate->joint_margin = candidate->palm->arm_margin;
    for (const Touch& touch : candidate->touches) {
      touches.push_back(&touch);
      candidate->joint_margin = std::min(candidate->joint_margin, touch.joint_margin);
    }
    candidate->margin = chooser_.Measure(touches).margin_lower;
    candidate->score = score_.Calc(candidate->margin, candidate->joint_margin);
  }

  /// The touch itself first, then those `step` m beside it.
  [[nodiscard]] std::vector<Touch> ListNeighbours(size_t finger, const Touch& touch, const Pose& X_Po,
                                                  const HandClearance& clearance, double step) const {
    std::vector<Touch> touches = {touch};
    const SurfaceGeometry surface = object_.Evaluate(touch.alpha);
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        if (x == 0 && y == 0) continue;
        const Vector2d change = surface.M.inverse() * Vector2d(step * x, step * y);
        const SurfacePoint alpha =
            object_.Normalize({touch.alpha.u + change.x(), touch.alpha.v + change.y(), touch.alpha.chart});
        if (auto found = reach_.FindTouch(finger, object_, X_Po, clearance, alpha, touch.q)) {
          touches.push_back(std::move(*found));
        }
      }
    }
    return touches;
  }

  void Finish(const Candidate& candidate, ContactPlan* plan) const {
    plan->q = q_nominal_;
    arm_.Scatter(candidate.palm->q_arm, plan->q);
    for (size_t i = 0; i < candidate.touches.size(); ++i) {
      reach_.chain(i).Scatter(candidate.touches[i].q, plan->q);
      plan->contacts.push_back(candidate.touches[i].alpha);
    }
    const FingerPlacement touching =
        SolveFingerPlacement(model_, hand_.fingertips, object_, X_Bo_, plan->contacts, plan->q);
    const FingerPlacement open =
        SolveFingerPlacement(model_, hand_.fingertips, object_, X_Bo_, plan->contacts, touching.q,
                             {.penetration = -options_.room});
    plan->found = touching.reached;
    plan->q = touching.q;
    plan->q_open = open.q;
    plan->margin = candidate.margin;
    plan->joint_margin = candidate.joint_margin;
    plan->X_oP = X_Bo_.inverse() * candidate.palm->X_BP;
  }

  [[nodiscard]] std::string DescribeProblem(size_t num_mapped) const {
    const std::string tried = " (" + std::to_string(num_poses_) + " palm poses)";
    if (num_palm_blocked_ == num_poses_) return "the palm has no place beside the object" + tried;
    if (num_missed_ + num_palm_blocked_ == num_poses_) {
      return "the arm does not reach the object: the palm stays " + FormatNumber(nearest_miss_) + " m away" +
             tried;
    }
    if (num_missed_ + num_palm_blocked_ + num_arm_blocked_ == num_poses_) {
      return "the arm reaches the object only through the support" + tried;
    }
    if (num_mapped == 0) return "not all fingertips find a place on the object" + tried;
    if (best_bound_ > options_.least_margin && num_short_ > 0 && best_margin_ <= 0.0) {
      return "the arm reaches the object but not all displacements from there" + tried;
    }
    return "no force closure: the best margin is " + FormatNumber(std::max(best_margin_, 0.0)) +
           ", less than " + FormatNumber(options_.least_margin) + tried;
  }

  const RobotModel& model_;
  const Hand& hand_;
  const Surface& object_;
  Pose X_Bo_;
  VectorXd q_nominal_;
  ContactPlanOptions options_;
  SerialChain arm_;
  HandReach reach_;
  TouchScore score_;
  TouchChooser chooser_;
  VectorXd lower_, upper_;
  VectorXd nominal_;
  HandClearance clearance_;

  // For the message when nothing is found.
  int num_poses_ = 0;
  int num_palm_blocked_ = 0;
  int num_missed_ = 0;
  int num_arm_blocked_ = 0;
  int num_short_ = 0;
  double nearest_miss_ = std::numeric_limits<double>::infinity();
  double best_bound_ = 0.0;
  double best_margin_ = 0.0;
};

void RequireUsable(const Hand& hand, const Pose& X_Bo, const ContactPlanOptions& options) {
  const auto require_positive = [](double value, std::string_view name) {
    Require(std::isfinite(value) && value > 0.0, name, "must be positive", value);
  };
  const auto require_not_negative = [](double value, std::string_view name) {
    Require(std::isfinite(value) && value >= 0.0, name, "must not be negative", value);
  };
  Require(hand.fingertips.size() >= 3, "fingertips", "must be at least three",
          static_cast<double>(hand.fingertips.size()));
  RequireRotation(X_Bo.linear(), "X_Bo");
  Require(X_Bo.translation().allFinite(), "X_Bo", "must be finite", std::numeric_limits<double>::quiet_NaN());
  require_positive(options.mu, "mu");
  require_positive(options.length, "length");
  require_positive(options.least_margin, "least_margin");
  require_positive(options.finger_thickness, "finger_thickness");
  Require(options.steepest > 0.0 && options.steepest <= kPi / 2.0, "steepest", "must be in (0, pi/2]",
          options.steepest);
  require_not_negative(options.joint_margin, "joint_margin");
  require_not_negative(options.comfort, "comfort");
  require_not_negative(options.room, "room");
  require_not_negative(options.spacing, "spacing");
  require_not_negative(options.clearance, "clearance");
  require_not_negative(options.arm_clearance, "arm_clearance");
  if (options.support) {
    constexpr double kUnit = 1e-9;
    Require(std::abs(options.support->normal.norm() - 1.0) < kUnit, "support", "must have a unit normal",
            options.support->normal.norm());
    Require(std::isfinite(options.support->height), "support", "must be finite", options.support->height);
  }
}

}  // namespace

std::vector<int> ListArmJoints(const RobotModel& model, std::span<const int> fingertips, int palm_frame) {
  std::vector<int> joints = grasp_internal::ListChain(model, palm_frame);
  for (const int tip : model.fingertips()) {
    if (std::find(fingertips.begin(), fingertips.end(), tip) != fingertips.end()) continue;
    for (const int joint : grasp_internal::ListChain(model, tip)) std::erase(joints, joint);
  }
  return joints;
}

ContactPlan PlanContacts(const RobotModel& model, const Hand& hand, const Surface& object, const Pose& X_Bo,
                         const Eigen::Ref<const VectorXd>& q_nominal, const ContactPlanOptions& options) {
  RequireUsable(hand, X_Bo, options);
  return Planner(model, hand, object, X_Bo, q_nominal, options).Plan();
}

}  // namespace dexcheck
