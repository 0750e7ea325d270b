#include "harness/base/check_record.h"

namespace dexcheck {
namespace {

std::string DescribeVelocity(int coordinate, const RobotModel& model, int base_velocities) {
  if (coordinate >= base_velocities) return model.dof_name(coordinate - base_velocities);
  static constexpr const char* kUnreduced[] = {"x_dot", "y_dot", "phi_dot"};
  static constexpr const char* kTwist[] = {"v_c", "w_c"};
  static constexpr const char* kWheelRates[] = {"thetadot_r", "thetadot_l"};
  static constexpr const char* kFloating[] = {"v_x", "v_y", "v_z", "w_x", "w_y", "w_z"};
  if (base_velocities == 6) return kFloating[coordinate];
  if (base_velocities == 3) return kUnreduced[coordinate];
  return model.base().velocity == DriveVelocity::kTwist ? kTwist[coordinate] : kWheelRates[coordinate];
}

}  // namespace

const char* NameOf(CheckCategory kind) {
  static constexpr const char* kNames[] = {"model", "inverse_dynamics", "forward_dynamics", "assumption",
                                           "law"};
  return kNames[static_cast<size_t>(kind)];
}

std::string Describe(const Location& where, const RobotModel& model, int base_velocities) {
  switch (where.kind) {
    case Location::Kind::kJoint: {
      const Joint& joint = model.joints()[static_cast<size_t>(where.first)];
      return "joint " + joint.name + " on link " + model.link_name(joint.parent);
    }
    case Location::Kind::kLink:
      return "link " + model.link_name(where.first);
    case Location::Kind::kFrame: {
      const Frame& frame = model.frames()[static_cast<size_t>(where.first)];
      return "frame " + frame.name + " on link " + model.link_name(frame.link);
    }
    case Location::Kind::kVelocity:
      return DescribeVelocity(where.first, model, base_velocities);
    case Location::Kind::kVelocityPair:
      return "(" + DescribeVelocity(where.first, model, base_velocities) + ", " +
             DescribeVelocity(where.second, model, base_velocities) + ")";
    case Location::Kind::kWheel:
      return "joint " + (where.first == 0 ? model.base().wheel_joint_right : model.base().wheel_joint_left);
    case Location::Kind::kObject:
      return "object " + (model.object() ? model.object()->name : std::string());
    case Location::Kind::kWhole:
      return "robot";
  }
  return "robot";
}

}  // namespace dexcheck
