#include "controller/grasp/contact_plan.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/grasp/finger_placement.h"
#include "controller/grasp/grasp_search.h"
#include "controller/grasp/hand_reach.h"
#include "controller/object/so3.h"

namespace dexcheck {
namespace {

using grasp_internal::HandClearance;
using grasp_internal::HandReach;
using grasp_internal::PalmPose;
using grasp_internal::PalmSearch;
using grasp_internal::PalmTally;
using grasp_internal::Touch;
using grasp_internal::TouchChoice;
using grasp_internal::TouchChooser;
using grasp_internal::TouchScore;

/// A palm pose with the best of what the fingers can touch from there.
struct MappedPose {
  PalmPose palm;
  std::vector<Touch> touches;  // one for each finger
  double bound = 0.0;          // of the margin
  double score = 0.0;
};

/// A plan with everything that was measured about it.
struct Candidate {
  const MappedPose* pose = nullptr;
  std::vector<Touch> touches;
  double margin = 0.0;
  double joint_margin = 0.0;
  double score = 0.0;
};

HandClearance MakeClearance(const ContactPlanOptions& options, const Pose& X_BP) {
  HandClearance clearance{options, std::nullopt};
  if (options.support) clearance.above = options.support->Transform(X_BP.inverse());
  return clearance;
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
        reach_(model, hand.fingertips, hand.palm_frame, q_nominal, options.joint_margin),
        search_(model, hand, reach_, object, X_Bo, q_nominal, options),
        score_{options.comfort},
        chooser_(reach_, options.mu, options.length, score_) {}

  ContactPlan Plan() {
    constexpr size_t kMostRefined = 6;
    constexpr size_t kMostMapped = 80;
    std::vector<PalmPose> palms = search_.List();
    const auto by_margin = [](const PalmPose& a, const PalmPose& b) { return a.arm_margin > b.arm_margin; };
    std::ranges::stable_sort(palms, by_margin);
    if (palms.size() > kMostMapped) palms.resize(kMostMapped);
    std::vector<MappedPose> poses;
    for (const PalmPose& palm : palms) Map(palm, &poses);
    Sort(&poses);
    const size_t best = std::min(poses.size(), kMostRefined);
    for (size_t k = 0; k < best; ++k) {
      for (const PalmPose& palm : search_.ListOtherDistances(poses[k].palm)) Map(palm, &poses);
    }
    Sort(&poses);

    std::vector<Candidate> candidates;
    double best_margin = 0.0;
    bool is_short = false;
    for (const MappedPose& pose : poses) {
      if (candidates.size() == kMostRefined || pose.bound <= options_.least_margin) break;
      if (!search_.ReachesBeyond(pose.palm)) {
        is_short = true;
        continue;
      }
      Candidate candidate = Refine(pose);
      best_margin = std::max(best_margin, candidate.margin);
      if (candidate.margin >= options_.least_margin) candidates.push_back(std::move(candidate));
    }
    ContactPlan plan;
    plan.palm_poses = search_.tally().tried;
    if (candidates.empty()) {
      plan.problem = DescribeProblem(!poses.empty(), is_short, best_margin);
      return plan;
    }
    const auto by_score = [](const Candidate& a, const Candidate& b) { return a.score < b.score; };
    Finish(*std::ranges::max_element(candidates, by_score), &plan);
    return plan;
  }

 private:
  static void Sort(std::vector<MappedPose>* poses) {
    const auto by_score = [](const MappedPose& a, const MappedPose& b) { return a.score > b.score; };
    std::ranges::stable_sort(*poses, by_score);
  }

  /// What each finger can touch from a palm pose, and the best of it, if there is any.
  void Map(const PalmPose& palm, std::vector<MappedPose>* poses) const {
    constexpr double kGrid = 0.006;  // m
    constexpr int kStarts = 8;
    const Pose X_Po = palm.X_BP.inverse() * X_Bo_;
    const HandClearance clearance = MakeClearance(options_, palm.X_BP);
    std::vector<std::vector<Touch>> touches;
    for (size_t i = 0; i < reach_.num_fingers(); ++i) {
      touches.push_back(reach_.ListTouches(i, object_, X_Po, clearance, kGrid));
      if (touches.back().empty()) return;
      chooser_.SetSupports(&touches.back());
    }
    const std::optional<TouchChoice> choice = chooser_.Choose(touches, clearance, palm.arm_margin, kStarts);
    if (choice) poses->push_back({palm, Pick(touches, *choice), choice->bound, choice->score});
  }

  static std::vector<Touch> Pick(const std::vector<std::vector<Touch>>& touches, const TouchChoice& choice) {
    std::vector<Touch> picked;
    for (size_t i = 0; i < touches.size(); ++i) picked.push_back(touches[i][choice.indices[i]]);
    return picked;
  }

  Candidate Measure(const MappedPose& pose, std::vector<Touch> touches) {
    Candidate candidate{&pose, std::move(touches)};
    std::vector<const Touch*> pointers;
    candidate.joint_margin = pose.palm.arm_margin;
    for (const Touch& touch : candidate.touches) {
      pointers.push_back(&touch);
      candidate.joint_margin = std::min(candidate.joint_margin, touch.joint_margin);
    }
    candidate.margin = chooser_.Measure(pointers).margin_lower;
    candidate.score = score_.Calc(candidate.margin, candidate.joint_margin);
    return candidate;
  }

  /// Moves the contacts over the surface in smaller and smaller steps while the score grows.
  Candidate Refine(const MappedPose& pose) {
    constexpr std::array<double, 6> kSteps = {0.003, 0.003, 0.0015, 0.0015, 0.00075, 0.0004};  // m
    constexpr int kTries = 3;
    const Pose X_Po = pose.palm.X_BP.inverse() * X_Bo_;
    const HandClearance clearance = MakeClearance(options_, pose.palm.X_BP);
    Candidate candidate = Measure(pose, pose.touches);
    for (const double step : kSteps) {
      std::vector<std::vector<Touch>> touches;
      for (size_t i = 0; i < reach_.num_fingers(); ++i) {
        touches.push_back(ListNeighbours(i, candidate.touches[i], X_Po, clearance, step));
      }
      // Bounds are sharp only in directions known before: choose, measure, and choose again.
      for (int k = 0; k < kTries; ++k) {
        for (std::vector<Touch>& list : touches) chooser_.SetSupports(&list);
        const std::optional<TouchChoice> choice =
            chooser_.Choose(touches, clearance, pose.palm.arm_margin, 1);
        if (!choice || choice->score <= candidate.score) break;
        Candidate moved = Measure(pose, Pick(touches, *choice));
        if (moved.score <= candidate.score) continue;
        candidate = std::move(moved);
        break;
      }
    }
    return candidate;
  }

  /// The touch itself first, then those `step` m beside it.
  [[nodiscard]] std::vector<Touch> ListNeighbours(size_t finger, const Touch& touch, const Pose& X_Po,
                                                  const HandClearance& clearance, double step) const {
    std::vector<Touch> touches = {touch};
    const Matrix2d M_inv = object_.Evaluate(touch.alpha).M.inverse();
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        if (x == 0 && y == 0) continue;
        const Vector2d change = M_inv * Vector2d(step * x, step * y);
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
    search_.arm().Scatter(candidate.pose->palm.q_arm, plan->q);
    plan->q_open = plan->q;
    for (size_t i = 0; i < candidate.touches.size(); ++i) {
      const Touch& touch = candidate.touches[i];
      reach_.chain(i).Scatter(touch.q, plan->q);
      reach_.chain(i).Scatter(touch.q_open, plan->q_open);
      plan->contacts.push_back(touch.alpha);
    }
    const auto place = [&](VectorXd* q, double opening) {
      const FingerPlacement placement = SolveFingerPlacement(model_, hand_.fingertips, object_, X_Bo_,
                                                             plan->contacts, *q, {.penetration = -opening});
      *q = placement.q;
      return placement.reached;
    };
    plan->found = place(&plan->q, 0.0) && place(&plan->q_open, options_.opening);
    if (!plan->found) plan->problem = "the fingertips do not come to rest at the contacts found";
    plan->margin = candidate.margin;
    plan->joint_margin = candidate.joint_margin;
    plan->X_oP = X_Bo_.inverse() * candidate.pose->palm.X_BP;
  }

  [[nodiscard]] std::string DescribeProblem(bool is_mapped, bool is_short, double best_margin) const {
    const PalmTally& tally = search_.tally();
    const std::string tried = " (" + std::to_string(tally.tried) + " palm poses tried)";
    if (tally.blocked == tally.tried) return "the palm finds no place beside the object" + tried;
    if (tally.blocked + tally.missed == tally.tried) {
      constexpr double kMillimeter = 1e-3;
      const double miss = std::round(tally.nearest_miss / kMillimeter);
      return "the arm does not reach the object: the palm stays " + FormatNumber(miss) + " mm short" + tried;
    }
    if (tally.blocked + tally.missed + tally.arm_blocked == tally.tried) {
      return "the arm reaches the object only through the support" + tried;
    }
    if (!is_mapped) {
      return std::string("not all fingertips find a place on the object") +
             (options_.hemisphere ? " within the rims of their hemispheres" : "") + tried;
    }
    if (is_short && best_margin <= 0.0) {
      return "the arm reaches the object but cannot make all the displacements from there" + tried;
    }
    return "no force closure with mu = " + FormatNumber(options_.mu) + ": the best margin is " +
           FormatNumber(best_margin) + ", less than " + FormatNumber(options_.least_margin) + tried;
  }

  const RobotModel& model_;
  const Hand& hand_;
  const Surface& object_;
  Pose X_Bo_;
  VectorXd q_nominal_;
  const ContactPlanOptions& options_;
  HandReach reach_;
  PalmSearch search_;
  TouchScore score_;
  TouchChooser chooser_;
};

void RequireUsable(const Hand& hand, const Pose& X_Bo, const ContactPlanOptions& options) {
  Require(hand.fingertips.size() >= 3, "fingertips", "must be at least three", hand.fingertips.size());
  RequireRotation(X_Bo.linear(), "X_Bo");
  Require(X_Bo.translation().allFinite(), "X_Bo", "must be finite", std::numeric_limits<double>::quiet_NaN());
  RequirePositive(options.mu, "mu");
  RequirePositive(options.length, "length");
  RequirePositive(options.least_margin, "least_margin");
  RequirePositive(options.finger_thickness, "finger_thickness");
  Require(options.steepest > 0.0 && options.steepest <= kPi / 2.0, "steepest", "must be in (0, pi/2]",
          options.steepest);
  RequireNotNegative(options.joint_margin, "joint_margin");
  RequireNotNegative(options.comfort, "comfort");
  RequireNotNegative(options.opening, "opening");
  RequireNotNegative(options.room, "room");
  Require(options.half_length >= 0.0, "half_length", "must not be negative", options.half_length);
  RequireNotNegative(options.spacing, "spacing");
  RequireNotNegative(options.clearance, "clearance");
  RequireNotNegative(options.arm_clearance, "arm_clearance");
  for (const Vector3d& displacement : options.reaches) {
    for (const double value : displacement) {
      Require(std::isfinite(value), "reaches", "must be finite", value);
    }
  }
  if (options.support) {
    constexpr double kUnit = 1e-9;
    Require(std::abs(options.support->normal.norm() - 1.0) < kUnit, "support", "must have a unit normal",
            options.support->normal.norm());
    Require(std::isfinite(options.support->height), "support", "must be finite", options.support->height);
  }
}

}  // namespace

double CalcContactHalfLength(const Shape& shape, double tip_radius) {
  if (const auto* cylinder = std::get_if<SolidCylinder>(&shape)) {
    return std::max(0.5 * cylinder->length - tip_radius, 0.0);
  }
  return std::numeric_limits<double>::infinity();
}

std::vector<int> ListArmJoints(const RobotModel& model, std::span<const int> fingertips, int palm_frame) {
  std::vector<int> joints = model.ListChain(model.frame(palm_frame).link);
  for (const int tip : model.fingertips()) {
    if (std::ranges::find(fingertips, tip) != fingertips.end()) continue;
    for (const int joint : model.ListChain(model.frame(tip).link)) std::erase(joints, joint);
  }
  return joints;
}

ContactPlan PlanContacts(const RobotModel& model, const Hand& hand, const Surface& object, const Pose& X_Bo,
                         const Eigen::Ref<const VectorXd>& q_nominal, const ContactPlanOptions& options) {
  RequireUsable(hand, X_Bo, options);
  return Planner(model, hand, object, X_Bo, q_nominal, options).Plan();
}

}  // namespace dexcheck
