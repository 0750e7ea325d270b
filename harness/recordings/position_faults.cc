#include "harness/recordings/position_faults.h"

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "harness/recordings/torque_balance.h"

namespace dexcheck {
namespace {

using Eigen::Index;

bool IsMotion(const Channel& channel) {
  return channel.quantity == RecordedQuantity::kPosition || channel.quantity == RecordedQuantity::kVelocity ||
         channel.quantity == RecordedQuantity::kAcceleration;
}

/// How far the model's torques are off beside gains' signs, friction and offsets: the sum over joints of the
/// logarithm of the residual.
double CalcMisfit(const RobotModel& model, Recording recording) {
  constexpr size_t kRows = 3000;
  MotionFit motion(model, &recording, kRows);
  TorqueBalance balance(model, motion.joints(), motion.speeds(), motion.has_currents());
  size_t samples = 0;
  motion.Run([&](const RecordedSample& sample) {
    balance.Add(sample, motion.IsJudged(sample));
    return ++samples < kRows;
  });
  balance.Finish();
  double misfit = 0.0;
  for (size_t place = 0; place < motion.joints().size(); ++place) {
    const int joint = motion.joints()[place];
    const MatrixXd& G = balance.products(place);
    std::vector<Index> columns;
    for (const auto kind : {TorqueColumn::kOffset, TorqueColumn::kDry, TorqueColumn::kViscous})
      columns.push_back(balance.Find(place, {kind, joint}));
    Index y = G.cols() - 1;
    if (motion.has_currents()) {
      // A current's scale is free.
      columns.push_back(balance.Find(place, {TorqueColumn::kTorque, joint}));
      y = balance.Find(place, {TorqueColumn::kCurrent, joint});
    }
    const VectorXd b = G(columns, y);
    const double left =
        G(y, y) - b.dot(MatrixXd(G(columns, columns)).completeOrthogonalDecomposition().solve(b));
    misfit += 0.5 * std::log(std::max(left, 1e-12 * G(y, y)) / std::max(1.0, balance.samples(place)) +
                             std::numeric_limits<double>::min());
  }
  return misfit;
}

std::vector<PositionFault> ListPositionFaults(const RobotModel& model, const Recording& recording) {
  std::vector<PositionFault> faults;
  const auto scale = [](double factor, int joint) {
    return [=](Recording* changed) {
      for (Channel& one : changed->channels)
        if (IsMotion(one) && (joint < 0 || one.joint == joint)) one.scale *= factor, one.offset *= factor;
    };
  };
  faults.push_back(
      {{"unit of the positions", "all joints", 180.0 / kPi, 0.0, "", "(degrees)"}, scale(kPi / 180.0, -1)});
  for (int joint = 0; joint < model.num_joints(); ++joint) {
    if (recording.FindColumn(RecordedQuantity::kPosition, joint) < 0) continue;
    const std::string place = "joint " + model.joint(joint).name;
    faults.push_back({{"position gain", place, -1.0, 0.0, "", "(the other sign)"}, scale(-1.0, joint)});
    for (int other = joint + 1; other < model.num_joints(); ++other) {
      if (recording.FindColumn(RecordedQuantity::kPosition, other) < 0) continue;
      const auto exchange = [=](Recording* changed) {
        for (Channel& one : changed->channels)
          if (IsMotion(one) && (one.joint == joint || one.joint == other))
            one.joint = joint + other - one.joint;
      };
      faults.push_back(
          {{"position exchanged with that of " + model.joint(other).name, place, 1.0, 0.0, "", ""},
           exchange});
    }
  }
  return faults;
}

}  // namespace

std::optional<PositionFault> FindPositionFault(const RobotModel& model, const Recording& recording) {
  if (!recording.reopen) return std::nullopt;
  // By a factor of three, of one joint or spread over several.
  constexpr double kMuch = 1.1;
  double best = CalcMisfit(model, recording.reopen()) - kMuch;
  std::optional<PositionFault> found;
  for (PositionFault& fault : ListPositionFaults(model, recording)) {
    Recording changed = recording.reopen();
    fault.undo(&changed);
    try {
      const double misfit = CalcMisfit(model, std::move(changed));
      if (misfit < best) best = misfit, found = std::move(fault);
    } catch (const InputError&) {
      // Nothing that can be judged.
    }
  }
  return found;
}

}  // namespace dexcheck
