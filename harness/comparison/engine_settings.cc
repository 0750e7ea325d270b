#include "harness/comparison/engine_settings.h"

#include <utility>

#include "controller/common/errors.h"
#include "controller/model/rigid_body.h"

namespace dexcheck {
namespace {

using Change = std::function<void(RobotDescription*)>;

/// Returns what makes the bodies anew from their parts, each changed by `change(R, body)`: R turns the axes
/// along which the file gives the inertia into the link's.
template <typename ChangeBody>
Change ChangeParts(const ChangeBody& change) {
  return [change](RobotDescription* robot) {
    for (DescribedPart& part : robot->parts) {
      change(Matrix3d(part.X_LC.linear()), &part.body);
      part.states_inertial = part.body.mass > 0.0 || part.body.inertia != Matrix3d::Zero();
    }
    FuseParts(robot);
  };
}

template <typename ChangeJoint>
Change ChangeJoints(const ChangeJoint& change) {
  return [change](RobotDescription* robot) {
    for (Joint& joint : robot->spec.joints) change(&joint);
  };
}

/// Euler's step with damping taken at its end has M + h D instead of M.
Change AddImplicitDamping(double step) {
  return ChangeJoints([step](Joint* joint) { joint->armature += step * joint->damping; });
}

void DropWeldedParts(RobotDescription* robot) {
  std::vector<bool> seen(robot->spec.joints.size() + 1, false);
  for (DescribedPart& part : robot->parts) {
    const auto place = static_cast<size_t>(part.joint + 1);
    if (seen[place]) part.body = {0.0, Vector3d::Zero(), Matrix3d::Zero()};
    part.states_inertial = part.body.mass > 0.0 || part.body.inertia != Matrix3d::Zero();
    seen[place] = true;
  }
  FuseParts(robot);
}

Change SetGravity(double g) {
  return [g](RobotDescription* robot) {
    if (robot->spec.gravity.norm() > 0.0) robot->spec.gravity *= g / robot->spec.gravity.norm();
  };
}

/// A way to read or treat the robot.
struct Setting {
  std::string text;
  Change apply;
};

std::vector<Setting> ListSettings() {
  return {
      {"viscous damping of joints left out", ChangeJoints([](Joint* joint) { joint->damping = 0.0; })},
      {"armature left out", ChangeJoints([](Joint* joint) { joint->armature = 0.0; })},
      {"damping taken at the end of a step of 2 ms (M + h D)", AddImplicitDamping(0.002)},
      {"damping taken at the end of a step of 1 ms (M + h D)", AddImplicitDamping(0.001)},
      {"the rotations (rpy) of the inertials not read",
       ChangeParts([](const Matrix3d& R, MassProperties* body) {
         body->inertia = R.transpose() * body->inertia * R;
       })},
      {"products of inertia left out", ChangeParts([](const Matrix3d& R, MassProperties* body) {
         const Matrix3d own = R.transpose() * body->inertia * R;
         body->inertia = R * Matrix3d(own.diagonal().asDiagonal()) * R.transpose();
       })},
      {"inertias left out, masses kept",
       ChangeParts([](const Matrix3d&, MassProperties* body) { body->inertia.setZero(); })},
      {"inertias read as about the links' origins", ChangeParts([](const Matrix3d&, MassProperties* body) {
         body->inertia -= CalcPointInertia(body->mass, body->com);
       })},
      {"the masses of links on fixed joints lost in fusing", DropWeldedParts},
      {"no gravity", [](RobotDescription* robot) { robot->spec.gravity.setZero(); }},
      {"gravity upwards", [](RobotDescription* robot) { robot->spec.gravity *= -1.0; }},
      {"gravity of 9.800000 m/s^2", SetGravity(9.8)},
      {"gravity of 9.806650 m/s^2", SetGravity(9.80665)},
      {"gravity of 9.810000 m/s^2", SetGravity(9.81)},
  };
}

}  // namespace

std::optional<std::string> FindSetting(const RobotDescription& robot, DynamicsProvider* provider,
                                       const std::function<StateFeed()>& make_feed, double tolerance,
                                       const std::vector<OtherDescription>& others) {
  const RobotModel coordinates(robot.spec);
  const auto is_explained_by = [&](const RobotDescription& changed) {
    try {
      AnalyticProvider model(changed.spec, "");
      return AgreeAtFirst(coordinates, &model, provider, make_feed(), tolerance);
    } catch (const InputError&) {
      return false;  // no body is like that
    }
  };
  const std::vector<Setting> settings = ListSettings();
  const auto explains = [&](const std::vector<const Setting*>& chosen) {
    RobotDescription changed = robot;
    for (const Setting* setting : chosen) setting->apply(&changed);
    return is_explained_by(changed);
  };
  for (const OtherDescription& other : others) {
    if (is_explained_by(other.robot)) return other.text;
  }
  // Alone first, then two at a time: an engine may leave out damping and misread inertials.
  for (const Setting& setting : settings) {
    if (explains({&setting})) return "as with " + setting.text;
  }
  for (size_t i = 0; i < settings.size(); ++i) {
    for (size_t j = i + 1; j < settings.size(); ++j) {
      if (explains({&settings[i], &settings[j]})) {
        return "as with " + settings[i].text + ", and " + settings[j].text;
      }
    }
  }
  return std::nullopt;
}

}  // namespace dexcheck
