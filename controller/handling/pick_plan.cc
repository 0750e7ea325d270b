#include "controller/handling/pick_plan.h"

#include <algorithm>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"
#include "controller/common/text.h"
#include "controller/dynamics/model_terms.h"
#include "controller/grasp/finger_placement.h"

namespace dexcheck {
namespace {

constexpr int kKnots = 9;
// Largest change of a joint from one knot to the next; more is another branch of the arm's postures, rad.
constexpr double kLargestChange = 0.5;

/// Moves the palm, with the fingers open.
class PathPlanner {
 public:
  PathPlanner(const RobotModel& model, const Hand& hand, const VectorXd& q_open, double joint_margin)
      : model_(&model), hand_(&hand), q_open_(q_open), q_(q_open), joint_margin_(joint_margin) {
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
                              {.num_starts = 1, .joint_margin = joint_margin_});
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
  double joint_margin_;
  Pose X_BP_;
};

/// Up, along and down, as far as the arm has to do it.
void PlanPaths(const RobotModel& model, const Hand& hand, const PickPlanOptions& options, double joint_margin,
               PickPlan* plan) {
  PathPlanner planner(model, hand, plan->contacts.q_open, joint_margin);
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

}  // namespace

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
  ContactPlanOptions contact_options;
  contact_options.mu = options.mu;
  contact_options.room = options.opening;
  contact_options.hemisphere = options.hemisphere;
  contact_options.support = SupportPlane{Vector3d::UnitZ(), options.support};
  contact_options.half_length = options.half_length;
  const Vector3d raise(0.0, 0.0, options.raise);
  contact_options.reaches = {raise};
  if (model.base().type == BaseType::kFixed) {
    contact_options.reaches.insert(contact_options.reaches.end(),
                                   {options.transport + raise, options.transport});
  }
  PickPlan plan;
  plan.contacts = PlanContacts(model, hand, object, X_Bo, q, contact_options);
  if (!plan.contacts.found) {
    plan.problem = plan.contacts.problem;
    return plan;
  }
  const Eigen::Index joints = model.num_joints();
  const VectorXd q_touch = plan.contacts.q.tail(joints);
  plan.q_open = plan.contacts.q_open.tail(joints);
  // Close to the contacts a straight way in joint space is one along their normals.
  const VectorXd off = (plan.q_open - q_touch) / options.opening;
  plan.q_near = q_touch + options.nearness * off;
  plan.q_deep = q_touch - options.depth * off;

  PlanPaths(model, hand, options, contact_options.joint_margin, &plan);
  plan.found = plan.problem.empty();
  return plan;
}

}  // namespace dexcheck
