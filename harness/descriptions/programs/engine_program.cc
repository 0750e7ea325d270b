#include "harness/descriptions/programs/engine_program.h"

#include <urdf_parser/urdf_parser.h>

#include <exception>
#include <fstream>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
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

namespace {

using Json = nlohmann::json;

Json ToJson(const Eigen::VectorXd& values) { return std::vector<double>(values.begin(), values.end()); }

Json ToJson(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    rows.push_back(ToJson(Eigen::VectorXd(matrix.row(row).transpose())));
  }
  return rows;
}

Eigen::VectorXd ReadVector(const Json& json) {
  const auto values = json.get<std::vector<double>>();
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// The first joint behind which no link has a mass; empty when there is none.
std::string FindJointWithoutMass(const std::vector<UrdfBody>& bodies) {
  std::vector<double> carried(bodies.size(), 0.0);
  for (size_t i = bodies.size(); i-- > 0;) {  // children stand behind their parents
    carried[i] += bodies[i].mass;
    if (bodies[i].parent >= 0) carried[static_cast<size_t>(bodies[i].parent)] += carried[i];
  }
  for (size_t i = 1; i < bodies.size(); ++i) {
    if (carried[i] == 0.0) return bodies[i].joint;
  }
  return {};
}

/// The robot that the first request describes, and the first result.
class Session {
 public:
  Session(const std::string& path, std::string name, MakeRobot make)
      : bodies_(ReadUrdfTree(path)), name_(std::move(name)), make_(std::move(make)) {}

  Json Reply(const Json& request) {
    return request.at("request") == "hello" ? Greet(request) : Evaluate(request);
  }

 private:
  Json Greet(const Json& request) {
    const Json& robot = request.at("robot");
    RobotFacts facts;
    facts.floats = robot.at("base") == "floating";
    facts.gravity = ReadVector(robot.at("gravity"));
    robot_ = make_(bodies_, facts);
    Json result = {{"dexcheck_protocol", 1}, {"name", name_}, {"joints", Json::array()}};
    for (size_t i = 1; i < bodies_.size(); ++i) result["joints"].push_back(bodies_[i].joint);
    if (facts.floats) {
      result["base"] = {{"position", "wxyz_xyz"},
                        {"velocity", "angular_linear"},
                        {"linear_axes", "world"},
                        {"angular_axes", "world"}};
    }
    return result;
  }

  Json Evaluate(const Json& request) {
    if (!robot_) throw std::runtime_error("no hello came before");
    const EngineTerms terms = robot_->Evaluate(ReadVector(request.at("q")), ReadVector(request.at("v")));
    if (!terms.M.allFinite() || !terms.c.allFinite() || !terms.g.allFinite()) {
      const std::string joint = FindJointWithoutMass(bodies_);
      throw std::runtime_error(
          name_ + ": its terms are no numbers" +
          (joint.empty() ? "; a joint may move no inertia" : "; joint " + joint + " moves no mass") +
          " (dexcheck audit ROBOT lists such joints)");
    }
    Json result = {{"id", request.at("id")}};
    if (terms.M.size() > 0) result["M"] = ToJson(terms.M);
    if (terms.c.size() > 0) result["c"] = ToJson(terms.c);
    if (terms.g.size() > 0) result["g"] = ToJson(terms.g);
    if (terms.kinetic) result["kinetic_energy"] = *terms.kinetic;
    if (terms.potential) result["potential_energy"] = *terms.potential;
    return result;
  }

  std::vector<UrdfBody> bodies_;
  std::string name_;
  MakeRobot make_;
  std::unique_ptr<EngineRobot> robot_;
};

}  // namespace

int RunEngine(int argc, char** argv, const std::string& name, const MakeRobot& make) {
  if (argc != 2) {
    std::cerr << "usage: " << argv[0] << " ROBOT.urdf, as a program of dexcheck's protocol\n";
    return 2;
  }
  std::unique_ptr<Session> session;
  std::string line;
  while (std::getline(std::cin, line)) {
    Json result;
    try {
      if (!session) session = std::make_unique<Session>(argv[1], name, make);
      result = session->Reply(Json::parse(line));
    } catch (const std::exception& error) {
      result = {{"error", error.what()}};
    }
    std::cout << result.dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
  }
  return 0;
}

}  // namespace dexcheck::engines
