#include "harness/descriptions/programs/urdf_tree.h"

#include <urdf_parser/urdf_parser.h>

#include <fstream>
#include <iterator>
#include <stdexcept>

namespace dexcheck::engines {
namespace {

Eigen::Isometry3d ToPose(const urdf::Pose& pose) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  const urdf::Rotation& q = pose.rotation;
  X.linear() = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
  X.translation() = Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z);
  return X;
}

/// Adds a link's inertial to a body. @param X_BL the link's frame in that of the body.
void AddInertial(const urdf::Inertial& inertial, const Eigen::Isometry3d& X_BL, UrdfBody* body) {
  const Eigen::Isometry3d X_BC = X_BL * ToPose(inertial.origin);
  const Eigen::Matrix3d R = X_BC.linear();
  Eigen::Matrix3d I;
  // clang-format off
  I << inertial.ixx, inertial.ixy, inertial.ixz,
       inertial.ixy, inertial.iyy, inertial.iyz,
       inertial.ixz, inertial.iyz, inertial.izz;
  // clang-format on
  body->inertia += R * I * R.transpose();
  const double mass = body->mass + inertial.mass;
  if (mass != 0.0) {
    // I = I_1 + I_2 + m_1 m_2 / m (d^2 1 - d d^T)
    const Eigen::Vector3d d = X_BC.translation() - body->com;
    body->inertia += body->mass * inertial.mass / mass *
                     (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
    body->com += inertial.mass / mass * d;
  }
  body->mass = mass;
}

Motion ReadMotion(const urdf::Joint& joint, const std::string& path) {
  if (joint.type == urdf::Joint::PRISMATIC) return Motion::kSlides;
  if (joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS) return Motion::kTurns;
  throw std::runtime_error(path + ": joint " + joint.name +
                           ": must be fixed, revolute, continuous or prismatic");
}

/// A link to come.
struct Open {
  urdf::LinkConstSharedPtr link;
  int body;                // that its parent belongs to
  Eigen::Isometry3d X_BP;  // where the parent is in it
};

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
  std::vector<Open> open = {{root, -1, Eigen::Isometry3d::Identity()}};
  while (!open.empty()) {
    auto [link, body, X_BL] = open.back();
    open.pop_back();
    if (body >= 0) X_BL = X_BL * ToPose(link->parent_joint->parent_to_joint_origin_transform);
    if (body < 0 || link->parent_joint->type != urdf::Joint::FIXED) {
      UrdfBody own;
      own.name = link->name;
      own.parent = body;
      if (body >= 0) {
        const urdf::Joint& joint = *link->parent_joint;
        own.joint = joint.name;
        own.motion = ReadMotion(joint, path);
        own.X_PL = X_BL;
        own.axis = Eigen::Vector3d(joint.axis.x, joint.axis.y, joint.axis.z).normalized();
      }
      body = static_cast<int>(bodies.size());
      bodies.push_back(own);
      X_BL.setIdentity();
    }
    if (link->inertial) AddInertial(*link->inertial, X_BL, &bodies[static_cast<size_t>(body)]);
    for (auto child = link->child_links.rbegin(); child != link->child_links.rend(); ++child) {
      open.push_back({*child, body, X_BL});
    }
  }
  return bodies;
}

}  // namespace dexcheck::engines
