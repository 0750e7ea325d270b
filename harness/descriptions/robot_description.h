#pragma once

// A robot as a file describes it, and which constants the file does not state.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "controller/model/parameter_reader.h"
#include "controller/model/robot_model.h"
#include "harness/base/ranges.h"

namespace dexcheck {

enum class RobotFormat {
  kToml,
  kUrdf,
  kMjcf,
  kBodies,  ///< A table of bodies (ReadBodyTable).
};

/// The least and the largest force that the motors of a joint may exert, N m or N.
struct StatedForces {
  double lower = 0.0;
  double upper = 0.0;
};

/// The row of a joint and its link as the file writes it, beside the specification.
struct DescribedJoint : WrittenRow {
  bool states_range = true;  ///< Whether the file states one. Otherwise it is +-pi in the specification.

  int line = 0;                        ///< Of the file; 0 when it is not known.
  std::optional<StatedForces> forces;  ///< Limits of the joint's motors; none where the file states none.
  double velocity_limit = 0.0;         ///< rad/s or m/s; 0 where the file states none.
  double axis_length = 1.0;            ///< Of the axis as the file gives it.
  double largest_angle = 0.0;          ///< Of the roll, pitch and yaw that the file gives, rad.
};

/// Geometry of a part, as the file gives it.
struct DescribedShape {
  double volume = 0.0;              ///< m^3; 0 when it is not known.
  Vector3d low = Vector3d::Zero();  ///< Corners of a box around it, along the link's own axes, m.
  Vector3d high = Vector3d::Zero();
  double radius = 0.0;               ///< Radius of a sphere, cylinder or capsule, m; 0 of other shapes.
  Vector3d axis = Vector3d::Zero();  ///< Unit axis of a cylinder or capsule; zero of a sphere.
};

/// How the volume of a shape follows from half its lengths: all round, with round ends, round about z, or not
/// round. A mesh has none here.
enum class ShapeKind { kEllipsoid, kCapsule, kCylinder, kBox, kMesh };
/// @param half of its box along its own axes, m. @param X_LS the shape's frame in the link's.
DescribedShape DescribeShape(ShapeKind kind, const Vector3d& half, const Pose& X_LS);

/// A link as the file gives it, before what is welded together becomes one body.
struct DescribedPart {
  std::string name;
  int line = 0;                  ///< Of the file; 0 when it is not known.
  bool states_inertial = true;   ///< Otherwise `body` is zero.
  MassProperties body;           ///< In the link's own frame.
  Pose X_LC = Pose::Identity();  ///< Frame along whose axes the file gives the inertia, in the link's own.
  int joint = -1;                ///< That moves it; -1 for the base.
  Pose X_iL = Pose::Identity();  ///< The link's own frame in that joint's frame i.
  std::vector<DescribedShape> shapes;
  double largest_angle = 0.0;  ///< Of the roll, pitch and yaw of a fixed joint and of the inertial, rad.
};

/// A robot as one file describes it.
struct RobotDescription {
  RobotSpec spec;
  RobotFormat format = RobotFormat::kToml;  ///< Of the file.
  std::vector<DescribedJoint> joints;       ///< By joint.
  bool states_gravity = true;
  bool states_base = true;  ///< Whether the base is fixed or floats; otherwise `spec` has a fixed one.
  std::vector<DescribedPart> parts;
  std::vector<std::string> unused;  ///< "mesh hand": what the file defines and nothing uses.
  std::vector<std::string> notes;   ///< What was done with the file that its reader may not expect.
  bool is_imported = false;         ///< A parameter file that dexcheck import wrote.
  /// Radii of spheres about frames' origins, as an MJCF's feet have them: by the place in spec.frames, m.
  std::map<size_t, double> spheres;
};

/// Pose of a joint's frame i in its parent's at a position, rad or m. @pre it is no ball.
Pose CalcRowPose(const Joint& joint, double position = 0.0);

/// The body that a joint moves, of -1 the base's, and the name of its link.
template <typename Spec>
auto& BodyOf(Spec& robot, int joint) {
  return joint < 0 ? robot.base.body : robot.joints[static_cast<size_t>(joint)].body;
}
const std::string& LinkOf(const RobotSpec& robot, int joint);

/// Index in `b` of each joint of `a`, by name; -1 where there is none.
std::vector<int> MatchJoints(const RobotSpec& a, const RobotSpec& b);

/// The robot with these spheres as its frames', as one that touches the ground with them needs.
RobotSpec AddSpheres(const RobotDescription& robot);

/// The nearest inertia about the centre of mass, kg m^2, that a body can have: of which no second moment of
/// mass is negative; itself where it is one.
Matrix3d FindNearestInertia(const Matrix3d& inertia);

/// Notes bodies whose principal moments no body can have. Their dynamics are well defined all the same.
void NoteImpossibleBodies(RobotDescription* robot);

/// Makes the bodies of the base and of the joints' links from the parts that are welded together there; those
/// that state no inertial, or one without dynamics (a negative mass), do not count.
void FuseParts(RobotDescription* robot);

/// Entries of xi that no coupling determines.
std::vector<int> ListFreeVelocities(const RobotModel& model);
/// T with xi = T xi_free of these; it is constant, so T^T M T, T^T C T, T^T F are the terms of the coupled
/// robot.
MatrixXd CalcCouplingMap(const RobotModel& model);

/// Lets a base that the file does not state float: its link's frame is Sigma_0.
void LetBaseFloat(RobotDescription* robot);

/// Puts Sigma_0 of a floating base at one of the base's frames and names the base's link by it; what was the
/// base's link becomes a frame. @return false when the base has no such frame.
bool MoveBaseTo(const std::string& frame, RobotDescription* robot);

/// Returns notes on q' and xi of a floating base and of ball joints, in this convention and in those of other
/// libraries.
std::vector<std::string> DescribeCoordinates(const RobotDescription& robot);

// A robot joint by joint as its file has it: each link in its own frame, placed in its parent's. Where the
// links of two descriptions are in each other, and a frame on each link that has no common one.

/// A joint and its link in the link's own frame: the joint turns about, or slides along, `axis` there.
struct JointInLinkFrames {
  int parent = -1;
  Pose X_PL = Pose::Identity();  ///< The link's own frame in its parent's own frame, at q = 0.
  Vector3d axis = Vector3d::UnitZ();
  MassProperties body;  ///< In the own frame.
};

/// The frame at a joint's place on its axis along the axes of the link's own frame, in frame i: an MJCF's own
/// frame may stand beside the axis. The identity of -1, the base.
Pose PlaceOnAxis(const RobotDescription& robot, int joint);
/// Lists the joints of a description; the base's own frame is Sigma_0.
std::vector<JointInLinkFrames> ListJointsInLinkFrames(const RobotDescription& robot);

/// Pose of each link's own frame in the world, the base first, with all joints at zero.
std::vector<Pose> CalcLinkPoses(const Pose& X_W0, const std::vector<JointInLinkFrames>& joints);

/// Frames of the links of `b` in those of `a`, by joint of `a`, as they stand with all joints at zero; the
/// identity for a joint without partner.
std::vector<Pose> PlaceLinkFrames(const RobotDescription& a, const RobotDescription& b);

/// A link of two descriptions: which frame it has is each description's own choice.
struct LinkPlace {
  int a = -1;  ///< Its joint in `a`; -1 the base.
  int b = -1;
  Pose X_ab = Pose::Identity();  ///< Frame i of `b` in that of `a`: they coincide so with all joints at zero.
};

/// The joints' links and a floating base, as far as `b` has parts of them.
/// @param a, b as CompleteEachOther left them; without places when their joints do not match.
std::vector<LinkPlace> PlaceLinks(const RobotDescription& a, const RobotDescription& b);

/// Adds to both descriptions a frame of the link's name on each link that joints move and on which they have
/// none in common, so that how links move is compared: the link's own frame of `b`, and in `a` where it is
/// with all joints at zero. @return whether there is such a link.
bool AddLinkFrames(RobotDescription* a, RobotDescription* b);

}  // namespace dexcheck
