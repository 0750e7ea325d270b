#include "controller/handling/pick_plan.h"

#include "controller/common/text.h"
#include "controller/dynamics/model_terms.h"
#include "controller/grasp/frame_placement.h"

namespace dexcheck {
PickPlan MakePickPlan(const RobotModel& model, const Hand& hand, const Surface& object, const Pose& X_Bo,
                      const Eigen::Ref<const VectorXd>& q, const PickPlanOptions& options) {
  const Vector3d raise(0.0, 0.0, options.raise);
  ContactPlanOptions contact_options;
  contact_options.mu = options.mu;
  contact_options.room = options.opening;
  contact_options.support = SupportPlane{Vector3d::UnitZ(), options.support};
  contact_options.reaches = {raise};
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

  ModelTerms kinematics(model, Coordinates::kReduced);
  kinematics.SetState(plan.contacts.q_open, VectorXd::Zero(model.num_velocities()));
  Pose X_BP = kinematics.CalcFramePose(hand.palm_frame);
  X_BP.pretranslate(raise);
  const FramePlacement above =
      SolveFramePlacement(model, hand.palm_frame, X_BP, hand.arm_joints, plan.contacts.q_open,
                          plan.contacts.q_open, {.joint_margin = contact_options.joint_margin});
  plan.q_above = above.q.tail(joints);
  if (!above.reached)
    plan.problem = "the arm does not reach " + FormatNumber(options.raise) + " m over the object";
  plan.found = plan.problem.empty();
  return plan;
}

}  // namespace dexcheck
