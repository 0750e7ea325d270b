#include "controller/handling/pick_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"
#include "controller/common/text.h"
#include "controller/dynamics/model_terms.h"
#include "controller/grasp/finger_placement.h"
#include "controller/grasp/force_closure.h"
#include "controller/object/so3.h"

namespace dexcheck {
namespace {

constexpr int kKnots = 9;
// Largest change of a joint from one knot to the next; more is another branch of the arm's postures, rad.
constexpr double kLargestChange = 0.5;
constexpr double kJointMargin = 0.05;   // of the arm's joints from the ends of their ranges, rad or m
constexpr double kLeastClosure = 0.01;  // a smaller margin of force closure counts as none
constexpr int kTurns = 24;              // about the axis of a solid of revolution

/// Moves the palm, with the fingers open.
class PathPlanner {
 public:
  PathPlanner(const RobotModel& model, const Hand& hand, const VectorXd& q_open)
      : model_(&model), hand_(&hand), q_open_(q_open), q_(q_open) {
    ModelTerms kinematics(model, Coordinates::kReduced);
    kinematics.SetState(q_open, VectorXd::Zero(model.num_velocities()));
    X_BP_ = kinematics.CalcFramePose(hand.palm_frame);
  }

  /// Knots straight on by a displacement from where the path before ended, without turning.
  /// @param problem says how far it goes when that is not all the way.
  std::vector<VectorXd> Plan(const Vector3d& displacement, const std::string& where, std::string* problem) {
    std::vector<VectorXd> knots = {q_.tail(model_->num_joints())};
    for (int i = 1; i < kKnots; ++i) {
      const Vector3d way = PosturePath::KnotPlace(i, kKnots) * displacement;
      Pose X_goal = X_BP_;
      X_goal.pretranslate(way);
      const FramePlacement placement =
          SolveFramePlacement(*model_, hand_->palm_frame, X_goal, hand_->arm_joints, q_, q_open_,
                              {.num_starts = 1, .joint_margin = kJointMargin});
      const double change = (placement.q - q_).cwiseAbs().maxCoeff();
      if (!placement.reached || change > kLargestChange) {
        *problem = "the arm cannot go straight " + where + " by more than " + FormatNumber(way.norm()) + " m";
        return {};
      }
      q_ = placement.q;
      knots.emplace_back(q_.tail(model_->num_joints()));
    }
    X_BP_.pretranslate(displacement);
    return knots;
  }

 private:
  const RobotModel* model_;
  const Hand* hand_;
  VectorXd q_open_, q_;
  Pose X_BP_;
};

/// Up, along and down, as far as the arm has to do it.
/// @param q_open q' with the hand open around the object.
void PlanPaths(const RobotModel& model, const Hand& hand, const PickPlanOptions& options,
               const VectorXd& q_open, PickPlan* plan) {
  PathPlanner planner(model, hand, q_open);
  const Vector3d raise(0.0, 0.0, options.raise);
  const std::vector<VectorXd> rise = planner.Plan(raise, "up from the object", &plan->problem);
  if (!plan->problem.empty()) return;
  plan->rise = plan->landing = PosturePath(rise);
  if (model.base().type != BaseType::kFixed) return;
  const std::vector<VectorXd> along =
      planner.Plan(options.transport, "along with the object", &plan->problem);
  if (!plan->problem.empty()) return;
  plan->along = PosturePath(along);
  std::vector<VectorXd> down = planner.Plan(-raise, "down where it puts the object", &plan->problem);
  if (!plan->problem.empty()) return;
  std::ranges::reverse(down);
  plan->landing = PosturePath(down);
}

/// Least margin of force closure of these contacts, per newton of normal force.
double CalcClosureMargin(const Surface& object, const std::vector<SurfacePoint>& contacts, double mu) {
  const auto count = static_cast<Eigen::Index>(contacts.size());
  Matrix6Xd G(6, 3 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const SurfaceGeometry surface = object.Evaluate(contacts[static_cast<size_t>(i)]);
    // Forces of the finger in a frame whose z points into the object (23).
    Matrix3d R;
    R << surface.R.col(0), -surface.R.col(1), -surface.R.col(2);
    G.middleCols<3>(3 * i) << R, Skew(surface.p) * R;
  }
  return CalcForceClosure(G, VectorXd::Constant(count, mu)).margin_lower;
}

/// The hand around the object, turned about the object's z axis.
struct Reach {
  double turn;  // rad
  FramePlacement arm;
};

/// All turns at which the arm reaches, those first that change its posture least.
/// @param problem says how near it comes when there is none.
std::vector<Reach> ListReaches(const RobotModel& model, const Hand& hand, const Pose& X_Bo,
                               const Eigen::Ref<const VectorXd>& q, const PickPlanOptions& options,
                               std::string* problem) {
  const Shape& shape = model.object()->shape;
  const bool is_round = std::holds_alternative<SolidSphere>(shape) ||
                        std::holds_alternative<SolidCylinder>(shape) ||
                        std::holds_alternative<SolidTorus>(shape);
  std::vector<Reach> reaches;
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < (is_round ? kTurns : 1); ++i) {
    const double turn = 2.0 * kPi * i / kTurns;
    const Pose X_BP = X_Bo * Eigen::AngleAxisd(turn, Vector3d::UnitZ()) * options.X_Po.inverse();
    const FramePlacement arm = SolveFramePlacement(model, hand.palm_frame, X_BP, hand.arm_joints, q, q,
                                                   {.num_starts = 8, .joint_margin = kJointMargin});
    nearest = std::min(nearest, arm.position_residual);
    if (arm.reached) reaches.push_back({turn, arm});
  }
  std::ranges::stable_sort(reaches, {}, [&](const Reach& reach) { return (reach.arm.q - q).norm(); });
  if (reaches.empty()) {
    *problem =
        "the arm does not reach the object: the palm stays " + FormatNumber(1e3 * nearest, 3) + " mm short";
  }
  return reaches;
}

}  // namespace

std::vector<int> ListArmJoints(const RobotModel& model, std::span<const int> fingertips, int palm_frame) {
  std::vector<int> joints = model.ListChain(model.frame(palm_frame).link);
  for (const int tip : model.fingertips()) {
    if (std::ranges::find(fingertips, tip) != fingertips.end()) continue;
    for (const int joint : model.ListChain(model.frame(tip).link)) std::erase(joints, joint);
  }
  return joints;
}

double PosturePath::KnotPlace(int i, int count) {
  return 0.5 * (1.0 - std::cos(kPi * static_cast<double>(i) / (count - 1)));
}

PosturePath::PosturePath(const std::vector<VectorXd>& knots) {
  const auto count = static_cast<int>(knots.size());
  Require(count >= 2, "number of knots", "must be at least two", count);
  MatrixXd powers(count, count);
  coefficients_.resize(knots.front().size(), count);
  for (int i = 0; i < count; ++i) {
    coefficients_.col(i) = knots[static_cast<size_t>(i)];
    const double x = 2.0 * KnotPlace(i, count) - 1.0;
    for (int power = 0; power < count; ++power) powers(i, power) = std::pow(x, power);
  }
  // knots = coefficients powers^T
  coefficients_ = (coefficients_ * CalcPseudoinverse(powers).transpose()).eval();
}

void PosturePath::Evaluate(double s, VectorXd* q, VectorXd* q_s, VectorXd* q_ss) const {
  const double x = 2.0 * s - 1.0;
  q->setZero(size());
  q_s->setZero(size());
  q_ss->setZero(size());
  for (Eigen::Index power = coefficients_.cols() - 1; power >= 0; --power) {
    *q_ss = x * *q_ss + 2.0 * *q_s;
    *q_s = x * *q_s + *q;
    *q = x * *q + coefficients_.col(power);
  }
  *q_s *= 2.0;
  *q_ss *= 4.0;
}

VectorXd PosturePath::Evaluate(double s) const {
  VectorXd q, q_s, q_ss;
  Evaluate(s, &q, &q_s, &q_ss);
  return q;
}

PickPlan MakePickPlan(const RobotModel& model, const Hand& hand, const Surface& object, const Pose& X_Bo,
                      const Eigen::Ref<const VectorXd>& q, const PickPlanOptions& options) {
  PickPlan plan;
  plan.margin = CalcClosureMargin(object, options.contacts, options.mu);
  if (plan.margin < kLeastClosure) {
    plan.problem = "no force closure with mu = " + FormatNumber(options.mu) + ": the margin is " +
                   FormatNumber(plan.margin, 3) + ", less than " + FormatNumber(kLeastClosure);
    return plan;
  }
  const Eigen::Index joints = model.num_joints();
  for (const Reach& reach : ListReaches(model, hand, X_Bo, q, options, &plan.problem)) {
    plan.problem.clear();
    std::vector<SurfacePoint> contacts = options.contacts;
    for (SurfacePoint& contact : contacts) {
      if (reach.turn != 0.0) contact = object.Normalize({contact.u + reach.turn, contact.v, contact.chart});
    }
    const auto place = [&](const VectorXd& start, double opening) {
      return SolveFingerPlacement(model, hand.fingertips, object, X_Bo, contacts, start,
                                  {.penetration = -opening});
    };
    const FingerPlacement touch = place(reach.arm.q, 0.0);
    const FingerPlacement open = place(touch.q, options.opening);
    if (!touch.reached || !open.reached) {
      plan.problem =
          "the fingertips do not reach their contacts within the joint ranges; the farthest stays " +
          FormatNumber(1e3 * std::max(touch.residual, open.residual), 3) + " mm away";
      return plan;
    }
    const VectorXd q_touch = touch.q.tail(joints);
    plan.q_open = open.q.tail(joints);
    // Close to the contacts a straight way in joint space is one along their normals.
    const VectorXd off = (plan.q_open - q_touch) / options.opening;
    plan.q_near = q_touch + options.nearness * off;
    plan.q_deep = q_touch - options.depth * off;
    PlanPaths(model, hand, options, open.q, &plan);
    plan.found = plan.problem.empty();
    if (plan.found) break;
  }
  return plan;
}

}  // namespace dexcheck
