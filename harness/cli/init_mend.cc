#include "harness/cli/init_mend.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <tuple>

#include "controller/common/text.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "harness/base/console.h"
#include "harness/descriptions/description_writer.h"

namespace dexcheck::cli {

void MendForEngine(RobotDescription* robot) {
  constexpr double kLeast = 1e-12;  // kg, kg m^2
  std::vector<std::string> ranges, bodies, points;
  for (size_t i = 0; i < robot->spec.joints.size(); ++i) {
    Joint& joint = robot->spec.joints[i];
    if (robot->joints[i].states_range && joint.lower >= joint.upper) {
      robot->joints[i].states_range = false;
      std::tie(joint.lower, joint.upper) = std::pair(-kPi, kPi);
      ranges.push_back(joint.name);
    }
    const Matrix3d possible = FindNearestInertia(joint.body.inertia);
    if (possible != joint.body.inertia) bodies.push_back(joint.link);
    joint.body.inertia = possible;
    if (joint.body.mass > kLeast && possible.trace() > kLeast) continue;
    points.push_back(joint.link);
    joint.body.mass = std::max(joint.body.mass, 1e-3);
    joint.body.inertia += 1e-6 * Matrix3d::Identity();
  }
  if (!ranges.empty()) Warn("ranges of no width are left out: " + JoinNames(ranges));
  if (!bodies.empty())
    Warn("no body has the inertia that these links state, the nearest that one can have is written: " +
         JoinNames(bodies));
  if (!points.empty())
    Warn("joints move these links, which have no mass or no inertia; 1 g and 1e-6 kg m^2 are written: " +
         JoinNames(points));
}

VectorXd CalcJointInertias(const RobotModel& model) {
  ModelTerms terms(model);
  VectorXd q = VectorXd::Zero(model.num_positions());
  if (model.base().type == BaseType::kFloating) q[3] = 1.0;
  terms.SetState(q, VectorXd::Zero(model.num_velocities()));
  terms.CalcDynamics();
  return MatrixXd(terms.M().inverse()).diagonal().cwiseInverse().tail(model.num_joints());
}

std::vector<Joint> ReduceFriction(const std::string& source, RobotDescription* robot) {
  constexpr double kLeast = 0.01;  // s
  const RobotModel model = ParseRobotModel(WriteParameters(*robot, source), source);
  const VectorXd inertia = CalcJointInertias(model);
  std::vector<std::string> names;
  std::vector<Joint> reduced;
  for (int i = 0; i < model.num_joints(); ++i) {
    Joint& joint = robot->spec.joints[static_cast<size_t>(i)];
    const double most = inertia[i] / kLeast;
    if (std::max(joint.damping, joint.dry_friction) <= most) continue;
    names.push_back(
        fmt::format("{} ({:.3g} to {:.3g})", joint.name, std::max(joint.damping, joint.dry_friction), most));
    joint.damping = std::min(joint.damping, most);
    joint.dry_friction = std::min(joint.dry_friction, most);
    reduced.push_back(joint);
  }
  if (!names.empty()) Warn("friction that would stop a joint within 10 ms is reduced: " + JoinNames(names));
  return reduced;
}

void FreeCoupledJoints(RobotDescription* robot) {
  std::vector<std::string> names;
  for (Joint& joint : robot->spec.joints) {
    if (joint.coupling) names.push_back(joint.name);
    joint.coupling.reset();
  }
  if (!names.empty()) Warn("joints that follow others get motors of their own: " + JoinNames(names));
}

}  // namespace dexcheck::cli
