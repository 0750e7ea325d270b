#pragma once

// Where a hand should hold an object: contact points chosen by force closure and reach.

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controller/common/types.h"
#include "controller/contact/surface.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// A plane that the hand stays above, in the world.
struct SupportPlane {
  Vector3d normal = Vector3d::UnitZ();  ///< Out of the support.
  double height = 0.0;                  ///< normal . x on the plane, m.

  [[nodiscard]] double CalcHeight(const Vector3d& p) const { return normal.dot(p) - height; }
  /// The same seen from a frame that X_FB places this one's frame in.
  [[nodiscard]] SupportPlane Transform(const Pose& X_FB) const {
    const Vector3d turned = X_FB.linear() * normal;
    return {turned, height + turned.dot(X_FB.translation())};
  }
};

/// The hand that is to hold the object.
struct Hand {
  std::vector<int> fingertips;  ///< Frames that carry spheres, three or more, all on one palm.
  int palm_frame = -1;          ///< Its z axis points at what the palm takes.
  std::vector<int> arm_joints;  ///< On the chain to the palm, to be moved; see ListArmJoints.
  /// Where in the palm frame the object's centre is held, m: the search begins there. None: on the axis along
  /// z through the middle of the fingers' bases, which suits fingers that stand around the palm.
  std::optional<Vector3d> hold_at;
};

struct ContactPlanOptions {
  double mu = 0.5;             ///< Friction counted on.
  double length = 0.05;        ///< Of the margin, m: a moment counts as the force moment / length.
  double least_margin = 0.01;  ///< A smaller margin counts as no force closure.
  double joint_margin = 0.05;  ///< Distance that the joints keep from the ends of their ranges, rad or m.
  /// Joint margin, rad or m, with which a margin of force closure counts half; 0 counts it whole always.
  double comfort = 0.1;
  double opening = 0.01;   ///< How far the fingers can open from their contacts along the normals, m.
  double room = 0.02;      ///< Free way of each fingertip out from the object along the normal, m.
  double spacing = 0.002;  ///< Between the fingers, m.
  /// Fingers count as tubes with this fraction of their fingertips' radius; the model has no other size of
  /// them.
  double finger_thickness = 0.8;
  /// Contacts have |z| up to this in the object, m: for cylinders, whose surface has no end.
  double half_length = std::numeric_limits<double>::infinity();

  /// Out of the pole, in the fingertips' frames, where fingertips are hemispheres: contacts stay within their
  /// rims. None for whole spheres.
  std::optional<Vector3d> hemisphere;

  std::optional<SupportPlane> support;
  /// With a support: largest angle between a contact's normal and the support plane, rad. A steeper contact
  /// would press the object down.
  double steepest = DegToRad(30.0);
  double clearance = 0.003;     ///< Between fingers and support, m.
  double arm_clearance = 0.05;  ///< Between the origins of the arm's joints and the support, m.

  /// Displacements in the world, m, by which the arm can move the palm from the plan.
  std::vector<Vector3d> reaches;
};

/// What was found.
struct ContactPlan {
  bool found = false;
  std::string problem;                 ///< Why nothing was found.
  std::vector<SurfacePoint> contacts;  ///< On the object, one for each fingertip.
  VectorXd q;                          ///< q' with arm and fingers solved: all fingertips touch.
  VectorXd q_open;                     ///< The same with the fingertips `opening` away along the normals.
  double margin = 0.0;                 ///< Of force closure per newton of normal force, a lower bound.
  double joint_margin = 0.0;     ///< Smallest distance of a moved joint from the ends of its range, rad or m.
  Pose X_oP = Pose::Identity();  ///< Palm frame in the object.
  int palm_poses = 0;            ///< Tried.
};

/// Largest |z| of contacts in an object of this shape, m: a fingertip stays off the ends of a cylinder.
double CalcContactHalfLength(const Shape& shape, double tip_radius);

/// Joints that move a frame but none of the model's fingertips beyond the given ones: the hand's own arm.
std::vector<int> ListArmJoints(const RobotModel& model, std::span<const int> fingertips, int palm_frame);

/// Chooses a pose of the palm and a contact point for each fingertip.
///
/// The palm is tried with its z axis towards the object from directions all around, or from above a support,
/// at several roll angles and distances, as far as the arm reaches. There each finger's joints give a map of
/// the points that it can touch: fingertip on the surface, room to come from and
/// joints to open with, the rest of the finger outside
/// the object and above the support, joints in their ranges. Of the maps the contacts with the largest margin
/// of force closure, weighted by the joint margin, are taken (coordinate ascent from many starts), and
/// refined in ever smaller steps. What is not tested: arm and palm against the object or the robot itself.
/// Deterministic.
///
/// @param X_Bo object in the world. @param q_nominal q': joints that are not moved, and the arm posture to
/// stay near to. @throws std::invalid_argument for frames, joints or options that cannot be used.
ContactPlan PlanContacts(const RobotModel& model, const Hand& hand, const Surface& object, const Pose& X_Bo,
                         const Eigen::Ref<const VectorXd>& q_nominal, const ContactPlanOptions& options);

}  // namespace dexcheck
