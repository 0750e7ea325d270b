#include "harness/comparison/engine_settings.h"

#include <utility>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

/// Makes the bodies anew from their parts, each changed in its own frame.
void ChangeParts(const std::function<MassProperties(const DescribedPart&)>& change, RobotDescription* robot) {
  for (DescribedPart& part : robot->parts) {
    part.body = change(part);
    part.states_inertial = part.body.mass > 0.0 || part.body.inertia != Matrix3d::Zero();
  }
  FuseParts(robot);
}

/// Along the axes in which the file gives it, as if these were the link's.
MassProperties DropRotation(const DescribedPart& part) {
  MassProperties body = part.body;
  const Matrix3d R = part.X_LC.linear();
  body.inertia = R.transpose() * body.inertia * R;
  return body;
}

MassProperties DropProducts(const DescribedPart& part) {
  const Matrix3d R = part.X_LC.linear();
  const Matrix3d own = R.transpose() * part.body.inertia * R;
  MassProperties body = part.body;
  body.inertia = R * Matrix3d(own.diagonal().asDiagonal()) * R.transpose();
  return body;
}

MassProperties DropInertia(const DescribedPart& part) {
  MassProperties body = part.body;
  body.inertia.setZero();
  return body;
}

/// Reads the inertia as if it were given about the link's origin: subtracts m (|c|^2 1 - c c^T).
MassProperties ReadAboutOrigin(const DescribedPart& part) {
  MassProperties body = part.body;
  const Vector3d& c = body.com;
  body.inertia -= body.mass * (c.squaredNorm() * Matrix3d::Identity() - c * c.transpose());
  return body;
}

/// A way to read or treat the robot.
struct Setting {
  std::string text;
  std::function<void(RobotDescription*)> apply;
};

void ScaleDamping(double factor, RobotDescription* robot) {
  for (Joint& joint : robot->spec.joints) joint.damping *= factor;
}

/// Euler's step with damping taken at its end has M + h D instead of M.
void AddImplicitDamping(double step, RobotDescription* robot) {
  for (Joint& joint : robot->spec.joints) joint.armature += step * joint.damping;
}

void DropWeldedParts(RobotDescription* robot) {
  std::vector<bool> seen(robot->spec.joints.size() + 1, false);
  ChangeParts(
      [&](const DescribedPart& part) {
        const auto place = static_cast<size_t>(part.joint + 1);
        const bool is_welded = seen[place];
        seen[place] = true;
        return is_welded ? MassProperties{0.0, Vector3d::Zero(), Matrix3d::Zero()} : part.body;
      },
      robot);
}

std::vector<Setting> ListSettings() {
  std::vector<Setting> settings;
  const auto add = [&](const std::string& text, std::function<void(RobotDescription*)> apply) {
    settings.push_back({text, std::move(apply)});
  };
  add("viscous damping of joints left out", [](RobotDescription* robot) { ScaleDamping(0.0, robot); });
  add("armature left out", [](RobotDescription* robot) {
    for (Joint& joint : robot->spec.joints) joint.armature = 0.0;
  });
  for (const double step : {0.002, 0.001}) {
    add(step == 0.002 ? "damping taken at the end of a step of 2 ms (M + h D)"
                      : "damping taken at the end of a step of 1 ms (M + h D)",
        [step](RobotDescription* robot) { AddImplicitDamping(step, robot); });
  }
  add("the rotations (rpy) of the inertials not read",
      [](RobotDescription* robot) { ChangeParts(DropRotation, robot); });
  add("products of inertia left out", [](RobotDescription* robot) { ChangeParts(DropProducts, robot); });
  add("inertias left out, masses kept", [](RobotDescription* robot) { ChangeParts(DropInertia, robot); });
  add("inertias read as about the links' origins",
      [](RobotDescription* robot) { ChangeParts(ReadAboutOrigin, robot); });
  add("the masses of links on fixed joints lost in fusing", DropWeldedParts);
  add("no gravity", [](RobotDescription* robot) { robot->spec.gravity.setZero(); });
  add("gravity upwards", [](RobotDescription* robot) { robot->spec.gravity *= -1.0; });
  for (const double g : {9.8, 9.80665, 9.81}) {
    add("gravity of " + std::to_string(g) + " m/s^2", [g](RobotDescription* robot) {
      if (robot->spec.gravity.norm() > 0.0) robot->spec.gravity *= g / robot->spec.gravity.norm();
    });
  }
  return settings;
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
