#include "harness/recordings/motion_limits.h"

#include <limits>

#include "controller/common/toml_reader.h"
#include "harness/base/files.h"

namespace dexcheck {
namespace {

MotionLimits MakeUsualLimits(const RobotDescription& robot) {
  constexpr double kMargin = 0.05;
  const auto n = static_cast<Eigen::Index>(robot.spec.joints.size());
  MotionLimits limits{VectorXd(n), VectorXd(n), VectorXd(n), VectorXd(n),
                      VectorXd::Constant(n, std::numeric_limits<double>::infinity())};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Joint& joint = robot.spec.joints[static_cast<size_t>(i)];
    const bool turns = joint.type == JointType::kRevolute;
    const double free = turns ? 0.5 * kPi : 0.25;
    const bool has_range = robot.joints[static_cast<size_t>(i)].states_range && joint.upper > joint.lower;
    const double low = has_range ? joint.lower : -free, high = has_range ? joint.upper : free;
    limits.lower[i] = low + kMargin * (high - low);
    limits.upper[i] = high - kMargin * (high - low);
    limits.velocity[i] = turns ? 1.0 : 0.25;
    limits.acceleration[i] = turns ? 4.0 : 1.0;
  }
  return limits;
}

void Read(const TomlValue& value, Eigen::Index joint, MotionLimits* limits) {
  TomlTable table = value.AsTable();
  if (const auto lower = table.Find("lower")) limits->lower[joint] = lower->AsNumber();
  if (const auto upper = table.Find("upper")) limits->upper[joint] = upper->AsNumber();
  if (const auto velocity = table.Find("velocity")) limits->velocity[joint] = velocity->AsPositive();
  if (const auto most = table.Find("acceleration")) limits->acceleration[joint] = most->AsPositive();
  if (const auto torque = table.Find("torque")) limits->torque[joint] = torque->AsPositive();
  table.RejectUnused();
  if (!(limits->lower[joint] < limits->upper[joint])) value.Reject("lower must be less than upper");
}

}  // namespace

MotionLimits ReadMotionLimits(const RobotDescription& robot, const std::filesystem::path& file) {
  MotionLimits limits = MakeUsualLimits(robot);
  if (file.empty()) return limits;
  TomlDocument document(ReadBytes(file.string()), file.string());
  TomlTable root = document.Open();
  if (const auto all = root.Find("all"))
    for (Eigen::Index i = 0; i < limits.lower.size(); ++i) Read(*all, i, &limits);
  if (const auto joints = root.Find("joints")) {
    const RobotModel model(robot.spec);
    for (const auto& [name, value] : joints->AsTable().GetEntries()) {
      const int joint = model.FindJoint(name);
      if (joint < 0) value.Reject("is no joint of " + robot.spec.source);
      Read(value, joint, &limits);
    }
  }
  root.RejectUnused();
  return limits;
}

}  // namespace dexcheck
