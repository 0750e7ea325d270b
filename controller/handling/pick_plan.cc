#include "controller/handling/pick_plan.h"

#include "controller/common/text.h"
#include "controller/dynamics/model_terms.h"
#include "controller/grasp/frame_placement.h"

namespace dexcheck {
namespace {

constexpr int kKnots = 9;
// Largest change of a joint from one knot to the next; more is another branch of the arm's postures, rad.
constexpr double kLargestChange = 0.5;

/// The palm goes straight up, the fingers stay open.
void PlanRise(const RobotModel& model, const Hand& hand, double raise, double joint_margin, PickPlan* plan) {
  const VectorXd& q_open = plan->contacts.q_open;
  ModelTerms kinematics(model, Coordinates::kReduced);
  kinematics.SetState(q_open, VectorXd::Zero(model.num_velocities()));
  const Pose X_BP = kinematics.CalcFramePose(hand.palm_frame);
  std::vector<VectorXd> knots = {plan->q_open};
  VectorXd q = q_open;
  for (int i = 1; i < kKnots; ++i) {
    const double height = raise * PosturePath::KnotPlace(i, kKnots);
    Pose X_goal = X_BP;
    X_goal.pretranslate(Vector3d(0.0, 0.0, height));
    const FramePlacement placement =
        SolveFramePlacement(model, hand.palm_frame, X_goal, hand.arm_joints, q, q_open,
                            {.num_starts = 1, .joint_margin = joint_margin});
    const double change = (placement.q - q).cwiseAbs().maxCoeff();
    if (!placement.reached || change > kLargestChange) {
      plan->problem =
          "the arm cannot go straight up from the object by more than " + FormatNumber(height) + " m";
      return;
    }
    q = placement.q;
    knots.emplace_back(q.tail(model.num_joints()));
  }
  plan->rise = PosturePath(knots);
}

}  // namespace

PickPlan MakePickPlan(const RobotModel& model, const Hand& hand, const Surface& object, const Pose& X_Bo,
                      const Eigen::Ref<const VectorXd>& q, const PickPlanOptions& options) {
  ContactPlanOptions contact_options;
  contact_options.mu = options.mu;
  contact_options.room = options.opening;
  contact_options.hemisphere = options.hemisphere;
  contact_options.support = SupportPlane{Vector3d::UnitZ(), options.support};
  contact_options.reaches = {Vector3d(0.0, 0.0, options.raise)};
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

  PlanRise(model, hand, options.raise, contact_options.joint_margin, &plan);
  plan.found = plan.problem.empty();
  return plan;
}

}  // namespace dexcheck
