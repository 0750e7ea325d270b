#include "harness/descriptions/robot_description.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <set>

#include "controller/common/linear_algebra.h"
#include "controller/common/text.h"
#include "controller/model/rigid_body.h"

namespace dexcheck {

Pose CalcRowPose(const Joint& joint, double position) {
  const bool slides = joint.type == JointType::kPrismatic;
  return joint.X_PB * CalcMdhTransform(joint.mdh.alpha, joint.mdh.a, joint.mdh.q + (slides ? 0.0 : position),
                                       joint.mdh.d + (slides ? position : 0.0));
}

const std::string& LinkOf(const RobotSpec& robot, int joint) {
  return joint < 0 ? robot.base.link : robot.joints[static_cast<size_t>(joint)].link;
}

DescribedShape DescribeShape(ShapeKind kind, const Vector3d& half, const Pose& X_LS) {
  const bool is_ball = kind == ShapeKind::kEllipsoid && half == Vector3d::Constant(half[0]);
  const bool has_axis = kind == ShapeKind::kCapsule || kind == ShapeKind::kCylinder;
  const Vector3d around = is_ball ? half : Vector3d(X_LS.linear().cwiseAbs() * half);
  DescribedShape shape;
  shape.low = X_LS.translation() - around;
  shape.high = X_LS.translation() + around;
  if (is_ball || has_axis) shape.radius = half[0];
  if (has_axis) shape.axis = X_LS.linear().col(2);
  if (kind == ShapeKind::kBox) shape.volume = 8.0 * half.prod();
  if (kind == ShapeKind::kEllipsoid) shape.volume = 4.0 / 3.0 * kPi * half.prod();
  if (kind == ShapeKind::kCylinder) shape.volume = 2.0 * kPi * half.prod();
  // Its round ends have a third of a cylinder's volume less.
  if (kind == ShapeKind::kCapsule) shape.volume = 2.0 * kPi * half[0] * half[0] * (half[2] - half[0] / 3.0);
  return shape;
}

std::vector<int> ListFreeVelocities(const RobotModel& model) {
  std::vector<int> free = ListIndices(model.num_velocities());
  std::erase_if(free, [&](int i) {
    const int dof = i - model.num_base_velocities();
    return dof >= 0 && model.joint(model.joint_of_dof(dof)).coupling.has_value();
  });
  return free;
}

MatrixXd CalcCouplingMap(const RobotModel& model) {
  MatrixXd T = MatrixXd::Identity(model.num_velocities(), model.num_velocities());
  for (int i = 0; i < model.num_joints(); ++i) {
    const std::optional<JointCoupling>& coupling = model.joint(i).coupling;
    const int base = model.num_base_velocities();
    if (coupling) T(base + model.dof(i), base + model.dof(coupling->leader)) = coupling->multiplier;
  }
  return T(Eigen::all, ListFreeVelocities(model));
}

void FuseParts(RobotDescription* robot) {
  std::vector<std::vector<MassProperties>> bodies(robot->spec.joints.size() + 1);
  for (const DescribedPart& part : robot->parts) {
    const MassProperties& body = part.body;
    if (!part.states_inertial || !(body.mass >= 0.0) || !std::isfinite(body.mass)) continue;
    if (!body.inertia.allFinite()) continue;
    bodies[static_cast<size_t>(part.joint + 1)].push_back(ExpressIn(body, part.X_iL));
  }
  // One part stays as it is: its sum would be rounded.
  const auto fuse = [&](size_t i) { return bodies[i].size() == 1 ? bodies[i][0] : Combine(bodies[i]); };
  for (size_t i = 0; i < bodies.size(); ++i) BodyOf(robot->spec, static_cast<int>(i) - 1) = fuse(i);
}

Matrix3d FindNearestInertia(const Matrix3d& inertia) {
  // Second moments S = tr(I) / 2 1 - I, of which I = tr(S) 1 - S.
  const Matrix3d S = 0.5 * inertia.trace() * Matrix3d::Identity() - inertia;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(S);
  constexpr double kThinnest = 1e-6;  // no thinner than what readers take for a body
  if (eigen.eigenvalues().minCoeff() > 0.0) return inertia;
  const Vector3d moments = eigen.eigenvalues().cwiseMax(kThinnest * eigen.eigenvalues().maxCoeff());
  const Matrix3d possible = eigen.eigenvectors() * moments.asDiagonal() * eigen.eigenvectors().transpose();
  return moments.sum() * Matrix3d::Identity() - 0.5 * (possible + possible.transpose());
}

void NoteImpossibleBodies(RobotDescription* robot) {
  std::vector<std::string> names;
  const auto check = [&](const std::string& link, const MassProperties& body) {
    if (!FindPhysicalInconsistency(body).empty()) names.push_back(link);
  };
  if (robot->spec.base.type != BaseType::kFixed) check(robot->spec.base.link, robot->spec.base.body);
  for (const Joint& joint : robot->spec.joints) check(joint.link, joint.body);
  if (names.empty()) return;
  robot->notes.push_back(
      "impossible inertias, whose largest principal moment exceeds the sum of the others (dexcheck audit "
      "lists them): " +
      JoinNames(names) +
      ". They are compared as they are. MuJoCo's compiler refuses such a body; with balanceinertia it "
      "replaces the moments by their mean");
}

void LetBaseFloat(RobotDescription* robot) {
  robot->spec.base.type = BaseType::kFloating;
  robot->spec.base.X_B0 = Pose::Identity();
  robot->states_base = true;
}

bool MoveBaseTo(const std::string& frame, RobotDescription* robot) {
  RobotSpec& spec = robot->spec;
  if (frame == spec.base.link) return true;
  const auto found = std::ranges::find_if(
      spec.frames, [&](const Frame& candidate) { return candidate.link < 0 && candidate.name == frame; });
  if (found == spec.frames.end()) return false;
  const Pose X_F0 = found->X_LF.inverse();  // Sigma_0 in the frame
  *found = {spec.base.link, -1, X_F0, std::nullopt};
  for (Frame& other : spec.frames) {
    if (other.link < 0 && &other != &*found) other.X_LF = X_F0 * other.X_LF;
  }
  for (Joint& joint : spec.joints) {
    if (joint.parent < 0) joint.X_PB = X_F0 * joint.X_PB;
  }
  for (DescribedPart& part : robot->parts) {
    if (part.joint < 0) part.X_iL = X_F0 * part.X_iL;
  }
  spec.base.body = ExpressIn(spec.base.body, X_F0);
  spec.base.link = frame;
  return true;
}

namespace {

std::vector<std::string> DescribeBase(const RobotDescription& robot) {
  if (robot.spec.base.type != BaseType::kFloating) return {};
  return {"base " + Quote(robot.spec.base.link) +
              " floats: q = [x y z, qw qx qy qz, joints from q[7]], xi = [velocity of its origin in world "
              "axes, angular velocity in its own axes, joints from xi[6]], as MuJoCo has them",
          "in Pinocchio's convention the quaternion is qx qy qz qw and the origin's velocity is in the "
          "base's axes: xi' = B xi with B = diag(R^T, 1, 1), M' = B^-T M B^-1, bias' = B^-T bias + M' [omega "
          "x v; 0; 0] (dexcheck eval prints both)",
          "in Drake's convention q = [qw qx qy qz, x y z, joints], xi = [angular velocity, velocity of its "
          "origin, both in world axes, joints]"};
}

/// Ball joints: where each one's entries are, and what others have in their place.
std::vector<std::string> DescribeBalls(const RobotDescription& robot) {
  const RobotModel model(robot.spec);
  std::vector<std::string> places;
  for (int i = 0; i < model.num_joints(); ++i) {
    const Joint& joint = model.joint(i);
    if (joint.type != JointType::kBall) continue;
    const auto range = [](int first, int count) {
      return "[" + std::to_string(first) + ".." + std::to_string(first + count - 1) + "]";
    };
    places.push_back(Quote(joint.name) + " has q" + range(model.position_index(i), 4) + " and xi" +
                     range(model.num_base_velocities() + model.dof(i), 3));
  }
  if (places.empty()) return {};
  return {"ball joints: " + JoinNames(places) +
              ": q = [qw qx qy qz] turns the link against its parent, xi = its angular velocity against the "
              "parent in the link's own axes, as MuJoCo has them",
          "a ball joint in Pinocchio's convention has qx qy qz qw and the same velocity; in Simbody's, qw qx "
          "qy qz and the angular velocity in the parent's axes: xi' = R xi"};
}

}  // namespace

std::vector<int> MatchJoints(const RobotSpec& a, const RobotSpec& b) {
  std::vector<int> match;
  for (const Joint& joint : a.joints) match.push_back(IndexOf(b.joints, joint.name, &Joint::name));
  return match;
}

RobotSpec AddSpheres(const RobotDescription& robot) {
  RobotSpec spec = robot.spec;
  for (const auto& [frame, radius] : robot.spheres) spec.frames[frame].sphere_radius = radius;
  return spec;
}

std::vector<std::string> DescribeCoordinates(const RobotDescription& robot) {
  std::vector<std::string> notes = DescribeBase(robot);
  Append(DescribeBalls(robot), &notes);
  return notes;
}

namespace {

bool HasParts(const RobotDescription& robot, int joint) {
  return std::ranges::any_of(robot.parts, [&](const DescribedPart& part) { return part.joint == joint; });
}

}  // namespace

Pose PlaceOnAxis(const RobotDescription& robot, int joint) {
  Pose X_iL = Pose::Identity();
  if (joint >= 0) X_iL.linear() = robot.joints[static_cast<size_t>(joint)].X_iL.linear();
  return X_iL;
}

std::vector<JointInLinkFrames> ListJointsInLinkFrames(const RobotDescription& robot) {
  std::vector<JointInLinkFrames> rows;
  for (size_t i = 0; i < robot.spec.joints.size(); ++i) {
    const Joint& joint = robot.spec.joints[i];
    const Pose X_iL = PlaceOnAxis(robot, static_cast<int>(i));
    rows.push_back({joint.parent, PlaceOnAxis(robot, joint.parent).inverse() * CalcRowPose(joint) * X_iL,
                    X_iL.linear().row(2).transpose(),  // one of those that a ball joint turns about
                    ExpressIn(joint.body, X_iL.inverse())});
  }
  return rows;
}

std::vector<Pose> CalcLinkPoses(const Pose& X_W0, const std::vector<JointInLinkFrames>& rows) {
  std::vector<Pose> poses = {X_W0};
  for (const JointInLinkFrames& row : rows)
    poses.push_back(poses[static_cast<size_t>(row.parent + 1)] * row.X_PL);
  return poses;
}

std::vector<Pose> PlaceLinkFrames(const RobotDescription& a, const RobotDescription& b) {
  const auto calc_poses = [](const RobotDescription& robot) {
    const Base& base = robot.spec.base;
    const Pose X_W0 = base.type == BaseType::kFloating ? Pose::Identity() : base.X_B0;
    return CalcLinkPoses(X_W0, ListJointsInLinkFrames(robot));
  };
  const std::vector<int> b_of_a = MatchJoints(a.spec, b.spec);
  const std::vector<Pose> poses_a = calc_poses(a), poses_b = calc_poses(b);
  std::vector<Pose> placed(b_of_a.size(), Pose::Identity());
  for (size_t i = 0; i < placed.size(); ++i) {
    if (b_of_a[i] >= 0)
      placed[i] = poses_a[i + 1].inverse(Eigen::Isometry) * poses_b[static_cast<size_t>(b_of_a[i] + 1)];
  }
  return placed;
}

std::vector<LinkPlace> PlaceLinks(const RobotDescription& a, const RobotDescription& b) {
  const std::vector<int> b_of_a = MatchJoints(a.spec, b.spec);
  if (Contains(b_of_a, -1)) return {};
  const std::vector<Pose> placed = PlaceLinkFrames(a, b);
  std::vector<LinkPlace> places;
  if (a.spec.base.type == BaseType::kFloating) places.emplace_back();
  for (size_t i = 0; i < b_of_a.size(); ++i) {
    if (!HasParts(b, b_of_a[i])) continue;  // between several joints of one body there is none
    places.push_back({static_cast<int>(i), b_of_a[i],
                      PlaceOnAxis(a, static_cast<int>(i)) * placed[i] *
                          PlaceOnAxis(b, b_of_a[i]).inverse(Eigen::Isometry)});
  }
  return places;
}

bool AddLinkFrames(RobotDescription* a, RobotDescription* b) {
  std::set<int> has_frame;
  std::set<std::string> taken;
  for (const Frame& frame : a->spec.frames) has_frame.insert(frame.link);
  for (const RobotDescription* const robot : {a, b}) {
    for (const Frame& frame : robot->spec.frames) taken.insert(frame.name);
  }
  const size_t before = a->spec.frames.size();
  for (const LinkPlace& place : PlaceLinks(*a, *b)) {
    if (place.a < 0 || has_frame.contains(place.a)) continue;
    const std::string& name = a->spec.joints[static_cast<size_t>(place.a)].link;
    if (!taken.insert(name).second) continue;
    const Pose& X_bL = b->joints[static_cast<size_t>(place.b)].X_iL;
    a->spec.frames.push_back({name, place.a, place.X_ab * X_bL, {}});
    b->spec.frames.push_back({name, place.b, X_bL, {}});
  }
  return a->spec.frames.size() > before;
}

}  // namespace dexcheck
