#include "harness/descriptions/programs/urdf_tree.h"

#include <urdf_parser/urdf_parser.h>

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace dexcheck::engines {
namespace {

Eigen::Isometry3d ToPose(const urdf::Pose& pose) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  const urdf::Rotation& q = pose.rotation;
  X.linear() = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
  X.translation() = Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z);
  return X;
}

void ReadInertial(const urdf::Link& link, UrdfBody* body) {
  if (!link.inertial) return;
  const urdf::Inertial& inertial = *link.inertial;
  body->mass = inertial.mass;
  body->X_LC = ToPose(inertial.origin);
  // clang-format off
  body->inertia << inertial.ixx, inertial.ixy, inertial.ixz,
                   inertial.ixy, inertial.iyy, inertial.iyz,
                   inertial.ixz, inertial.iyz, inertial.izz;
  // clang-format on
}

void ReadJoint(const urdf::Joint& joint, const std::string& path, UrdfBody* body) {
  body->joint = joint.name;
  body->X_PL = ToPose(joint.parent_to_joint_origin_transform);
  switch (joint.type) {
    case urdf::Joint::FIXED:
      body->motion = Motion::kFixed;
      return;
    case urdf::Joint::REVOLUTE:
    case urdf::Joint::CONTINUOUS:
      body->motion = Motion::kTurns;
      break;
    case urdf::Joint::PRISMATIC:
      body->motion = Motion::kSlides;
      break;
    default:
      throw std::runtime_error(path + ": joint " + joint.name +
                               ": must be fixed, revolute, continuous or prismatic");
  }
  body->axis = Eigen::Vector3d(joint.axis.x, joint.axis.y, joint.axis.z).normalized();
}

}  // namespace

std::vector<UrdfBody> ReadUrdfTree(const std::string& path) {
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text);
  if (!model) throw std::runtime_error(path + ": is no URDF");
  urdf::LinkConstSharedPtr root = model->getRoot();
  if (root->child_joints.size() == 1 && root->child_joints[0]->type == urdf::Joint::FLOATING) {
    root = root->child_links[0];
  }
  std::vector<UrdfBody> bodies;
  std::vector<std::pair<urdf::LinkConstSharedPtr, int>> open = {{root, -1}};  // links to come, their parents
  while (!open.empty()) {
    const auto [link, parent] = open.back();
    open.pop_back();
    UrdfBody body;
    body.name = link->name;
    body.parent = parent;
    if (parent >= 0) ReadJoint(*link->parent_joint, path, &body);
    ReadInertial(*link, &body);
    bodies.push_back(body);
    const int own = static_cast<int>(bodies.size()) - 1;
    for (auto child = link->child_links.rbegin(); child != link->child_links.rend(); ++child) {
      open.emplace_back(*child, own);
    }
  }
  return bodies;
}

std::vector<std::string> ListJoints(const std::vector<UrdfBody>& bodies) {
  std::vector<std::string> names;
  for (const UrdfBody& body : bodies) {
    if (body.motion == Motion::kTurns || body.motion == Motion::kSlides) names.push_back(body.joint);
  }
  return names;
}

std::vector<UrdfBody> FuseFixedLinks(const std::vector<UrdfBody>& bodies) {
  std::vector<UrdfBody> fused;
  std::vector<int> index;                // of each link's body in `fused`
  std::vector<Eigen::Isometry3d> poses;  // of each link in that body's frame
  std::vector<Eigen::Vector3d> moments;  // of `fused`, mass times centre of mass
  for (const UrdfBody& body : bodies) {
    const bool is_fixed = body.motion == Motion::kFixed;
    Eigen::Isometry3d X_BL = Eigen::Isometry3d::Identity();
    if (body.parent >= 0) {
      const auto parent = static_cast<size_t>(body.parent);
      const Eigen::Isometry3d X_BP = poses[parent];
      if (is_fixed) {
        X_BL = X_BP * body.X_PL;
        index.push_back(index[parent]);
      } else {
        UrdfBody& own = fused.emplace_back(body);
        own.parent = index[parent];
        own.X_PL = X_BP * body.X_PL;
      }
    } else {
      fused.push_back(body);
    }
    if (!is_fixed) {
      index.push_back(static_cast<int>(fused.size()) - 1);
      fused.back().mass = 0.0;
      fused.back().inertia.setZero();  // about the body's origin, until all is summed
      fused.back().X_LC.setIdentity();
      moments.push_back(Eigen::Vector3d::Zero());
    }
    poses.push_back(X_BL);
    const auto place = static_cast<size_t>(index.back());
    const Eigen::Matrix3d R = X_BL.linear();
    const Eigen::Vector3d com = X_BL * body.X_LC.translation();
    fused[place].mass += body.mass;
    moments[place] += body.mass * com;
    fused[place].inertia +=
        R * body.CalcInertiaInLink() * R.transpose() +
        body.mass * (com.squaredNorm() * Eigen::Matrix3d::Identity() - com * com.transpose());
  }
  for (size_t i = 0; i < fused.size(); ++i) {
    if (fused[i].mass <= 0.0) continue;
    const Eigen::Vector3d com = moments[i] / fused[i].mass;
    fused[i].X_LC.translation() = com;
    fused[i].inertia -=
        fused[i].mass * (com.squaredNorm() * Eigen::Matrix3d::Identity() - com * com.transpose());
  }
  return fused;
}

}  // namespace dexcheck::engines
