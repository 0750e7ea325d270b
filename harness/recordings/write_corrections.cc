#include "harness/recordings/write_corrections.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/corrections/read_printed.h"
#include "harness/corrections/write_repaired.h"

namespace dexcheck {
namespace {

/// The model's numbers that change.
struct Corrections {
  std::map<int, double> dry, viscous, armature;       // by joint
  std::map<int, TorqueRegressor::BodyVector> bodies;  // by link: what is added
  std::optional<Vector3d> gravity;
};

Corrections Collect(const RobotModel& model, const RecordingJudgement& judgement, CorrectedFile* file) {
  Corrections corrections;
  for (size_t i = 0; i < judgement.found.size(); ++i) {
    const TorqueFault& fault = judgement.found[i].fault;
    const VectorXd& a = judgement.found[i].amplitude;
    const auto add_body = [&] {
      TorqueRegressor::BodyVector& body =
          corrections.bodies.emplace(fault.index, TorqueRegressor::BodyVector::Zero()).first->second;
      for (size_t k = 0; k < fault.sums.size(); ++k)
        for (const ColumnPart& part : fault.sums[k])
          body[part.column.component] += part.factor * a[static_cast<Eigen::Index>(k)];
    };
    const auto add = [&](std::map<int, double>* values, int joint, double before, double change) {
      values->emplace(joint, before).first->second += change;
    };
    if (!judgement.found[i].is_named) {
      file->left.push_back(fault.place + ": " + fault.fault + ", or another cause");
      continue;
    }
    bool is_written = fault.recording < 0;
    switch (fault.kind) {
      case TorqueFault::kDryFriction:
      case TorqueFault::kViscousFriction:
      case TorqueFault::kAllDry:
      case TorqueFault::kAllFriction:
      case TorqueFault::kArmature:
        for (Eigen::Index k = 0; k < (fault.HasVelocity() ? 1 : a.size()); ++k) {
          const TorqueColumn& column = fault.sums[static_cast<size_t>(k)].front().column;
          const Joint& joint = model.joint(column.index);
          const bool is_viscous = column.kind == TorqueColumn::kViscous;
          if (column.kind == TorqueColumn::kAcceleration) {
            add(&corrections.armature, column.index, joint.armature, a[k]);
          } else {
            add(is_viscous ? &corrections.viscous : &corrections.dry, column.index,
                is_viscous ? joint.damping : joint.dry_friction, a[k]);
          }
        }
        break;
      case TorqueFault::kMass:
      case TorqueFault::kCentre:
      case TorqueFault::kInertia:
      case TorqueFault::kPayload:
        if (is_written) add_body();
        break;
      case TorqueFault::kGravity:
        corrections.gravity = model.gravity() + a.head<3>();
        break;
      default:
        is_written = false;
    }
    (is_written ? file->written : file->left).push_back(fault.place + ": " + fault.fault);
  }
  return corrections;
}

/// Returns a link's body with what is added to it, in the frame of its file.
MassProperties CorrectBody(const RobotDescription& robot, int link, const TorqueRegressor::BodyVector& change,
                           CorrectedFile* file) {
  const Joint& joint = robot.spec.joints[static_cast<size_t>(link)];
  const auto part = std::ranges::find_if(
      robot.parts, [&](const DescribedPart& one) { return one.name == joint.link && one.joint == link; });
  const bool has_part = part != robot.parts.end();
  const Pose X = has_part ? part->X_iL : Pose::Identity();  // of the part in frame i
  const TorqueRegressor::BodyVector before =
      TorqueRegressor::Pack(has_part ? ExpressIn(part->body, X) : joint.body);
  TorqueRegressor::BodyVector after = before + change;
  // Each correction is of a body that can be; several together need not be.
  if (!IsBody(after) && IsBody(before)) {
    after = FindNearestBody(after);
    file->left.push_back("link " + joint.link +
                         ": what was found is together no body that can be; the nearest one is written");
  }
  return ExpressIn(TorqueRegressor::Unpack(after), X.inverse());
}

/// Says that the format has no place for a correction.
void MoveToLeft(const std::string& what, CorrectedFile* file) {
  std::erase(file->written, what);
  file->left.push_back(what);
}

/// A file's robot with the corrections.
PrintedRobot CorrectPrinted(const RobotDescription& robot, PrintedRobot printed,
                            const Corrections& corrections, CorrectedFile* file) {
  const bool is_urdf = robot.format == RobotFormat::kUrdf;
  const auto find = [&](auto is_it, const std::string& what) -> PrintedLink& {
    const auto link = std::ranges::find_if(printed.links, is_it);
    if (link == printed.links.end())
      throw InputError(
          fmt::format("{}: {}: stands in no element of its own", robot.spec.source, Quote(what)));
    return *link;
  };
  const auto set = [&](JointScalar scalar, const std::map<int, double>& values) {
    for (const auto& [joint, value] : values) {
      const std::string& name = robot.spec.joints[static_cast<size_t>(joint)].name;
      find([&](const PrintedLink& one) { return one.joint.name == name; }, name)
          .joint.scalars[static_cast<size_t>(scalar)] = PrintedScalar{value};
    }
  };
  set(JointScalar::kFriction, corrections.dry);
  set(JointScalar::kDamping, corrections.viscous);
  if (!is_urdf) {
    set(JointScalar::kArmature, corrections.armature);
    if (corrections.gravity) printed.gravity = corrections.gravity;
  } else {
    for (const auto& [joint, value] : corrections.armature)
      MoveToLeft("joint " + robot.spec.joints[static_cast<size_t>(joint)].name + ": armature", file);
    if (corrections.gravity) MoveToLeft("world: gravity", file);
  }
  for (const auto& [link, change] : corrections.bodies) {
    const std::string& name = robot.spec.joints[static_cast<size_t>(link)].link;
    PrintedLink& one = find([&](const PrintedLink& each) { return each.name == name; }, name);
    if (!one.inertial) one.inertial.emplace();
    const MassProperties body = CorrectBody(robot, link, change, file);
    const Matrix3d R = one.inertial->origin.CalcRotation();
    one.inertial->mass.value = body.mass;
    one.inertial->origin.t = body.com;
    one.inertial->I = ToEntries(R.transpose() * body.inertia * R);
  }
  return printed;
}

}  // namespace

CorrectedFile WriteCorrections(const DescriptionFile& source, const RecordingJudgement& judgement,
                               const std::filesystem::path& folder) {
  const RobotDescription robot = source.Describe();
  CorrectedFile file;
  const Corrections corrections = Collect(RobotModel(robot.spec), judgement, &file);
  const PrintedRobot before = ReadPrintedRobot(source);
  file.text = WriteNumbers(source, before, CorrectPrinted(robot, before, corrections, &file), folder);
  return file;
}

}  // namespace dexcheck
