#include "harness/corrections/whole_readings.h"

#include <algorithm>
#include <span>

namespace dexcheck {
namespace {

bool IsRow(const PrintedLink& link) { return link.origin.form == RotationForm::kMdh; }

/// The row's alpha and a as a pose: Tx(a) Rx(alpha).
Pose CalcTwist(const PrintedOrigin& row) {
  Pose X = Pose::Identity();
  X.linear() = TurnAbout(0, row.r[0]);
  X.translation().x() = row.t[0];
  return X;
}

void Move(const Pose& X, PrintedOrigin* origin) {
  const Matrix3d R = X.linear() * origin->CalcRotation();
  origin->t = X * origin->CalcPose().translation();
  if (origin->form == RotationForm::kMdh) {
    origin->X_before = X * origin->X_before;
  } else {
    origin->SetRotation(R);
  }
}

/// Rows with alpha and a of another row; zeros where there is none.
template <typename FindSource>
PrintedRobot TakeTwists(const PrintedRobot& robot, const FindSource& find) {
  PrintedRobot read = robot;
  for (int i = 0; i < robot.size(); ++i) {
    if (!IsRow(robot.link(i))) continue;
    const int from = find(i);
    PrintedOrigin& row = read.link(i).origin;
    const PrintedOrigin none;
    const PrintedOrigin& source = from < 0 ? none : robot.link(from).origin;
    row.r[0] = source.r[0];
    row.half_r[0] = source.half_r[0];
    row.t[0] = source.t[0];
    row.half_t[0] = source.half_t[0];
  }
  return read;
}

/// In a classic row alpha and a stand behind the joint: they are the next row's, and bodies, frames and what
/// else hangs on the link are given behind them. @param read has the alpha and a of the rows before.
PrintedRobot ReadClassic(const PrintedRobot& robot, PrintedRobot read) {
  for (int i = 0; i < robot.size(); ++i) {
    if (!IsRow(robot.link(i))) continue;
    const Pose X = CalcTwist(robot.link(i).origin);
    PrintedLink& link = read.link(i);
    if (link.inertial) Move(X, &link.inertial->origin);
    for (const int child : link.children) {
      if (!IsRow(robot.link(child))) Move(X, &read.link(child).origin);
    }
  }
  return read;
}

/// In a modified row alpha and a stand before the joint, which turns about the link's own z axis.
PrintedRobot ReadModified(PrintedRobot robot) {
  for (PrintedLink& link : robot.links) {
    if (!link.as_modified) continue;
    link.origin = *link.as_modified;
    link.as_modified.reset();
    link.joint.axis = Vector3d::UnitZ();
    link.joint.anchor.setZero();
  }
  return robot;
}

/// Places and centres of mass in another unit.
PrintedRobot ScaleLengths(PrintedRobot robot, double factor) {
  const auto scale = [&](PrintedOrigin* origin) {
    origin->t *= factor;
    origin->half_t *= factor;
    origin->X_before.translation() *= factor;
  };
  for (PrintedLink& link : robot.links) {
    scale(&link.origin);
    link.joint.anchor *= factor;
    if (link.as_modified) scale(&*link.as_modified);
    if (link.inertial) scale(&link.inertial->origin);
  }
  return robot;
}

}  // namespace

std::vector<WholeReading> ListWholeReadings(const PrintedRobot& robot) {
  constexpr std::ptrdiff_t kFewest = 2;
  std::vector<WholeReading> readings;
  if (std::ranges::count_if(robot.links, IsRow) >= kFewest) {
    const auto before = [&](int i) {
      const int parent = robot.link(i).parent;
      return parent >= 0 && IsRow(robot.link(parent)) ? parent : -1;
    };
    const auto behind = [&](int i) {
      const std::vector<int>& children = robot.link(i).children;
      const auto row = std::ranges::find_if(children, [&](int k) { return IsRow(robot.link(k)); });
      return row == children.end() ? -1 : *row;
    };
    readings.push_back({{CorrectionKind::kClassicRows}, ReadClassic(robot, TakeTwists(robot, before))});
    readings.push_back({{CorrectionKind::kShiftedRows, SiteKind::kPosition, 0}, TakeTwists(robot, behind)});
    readings.push_back({{CorrectionKind::kShiftedRows, SiteKind::kPosition, 1}, TakeTwists(robot, before)});
  }
  if (std::ranges::any_of(robot.links, [](const PrintedLink& link) { return link.as_modified.has_value(); }))
    readings.push_back({{CorrectionKind::kClassicRows, SiteKind::kPosition, 1}, ReadModified(robot)});
  const std::span<const UnitFault> units = ListUnits(SiteKind::kPosition);
  for (size_t k = 0; k < units.size(); ++k) {
    FileFault fault{CorrectionKind::kUnit, SiteKind::kPosition, static_cast<int>(k)};
    fault.whole = true;
    readings.push_back({fault, ScaleLengths(robot, units[k].factor)});
  }
  std::vector<int> bodies;
  for (int i = 0; i < robot.size(); ++i) {
    if (robot.link(i).inertial && robot.link(i).parent >= 0) bodies.push_back(i);
  }
  if (bodies.size() > 3) {
    // The first body, or the last one, is lost.
    for (const bool up : {true, false}) {
      PrintedRobot read = robot;
      for (size_t k = 0; k + 1 < bodies.size(); ++k)
        read.link(bodies[up ? k + 1 : k]).inertial = robot.link(bodies[up ? k : k + 1]).inertial;
      readings.push_back({{CorrectionKind::kShiftedBodies, SiteKind::kMass, up ? 1 : 0}, std::move(read)});
    }
  }
  return readings;
}

}  // namespace dexcheck
