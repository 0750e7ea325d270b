#include "harness/recordings/position_faults.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "controller/common/linear_algebra.h"

namespace dexcheck {
namespace {

using Eigen::Index;

bool IsTorque(const Channel& channel) {
  return channel.quantity == RecordedQuantity::kTorque || channel.quantity == RecordedQuantity::kCurrent;
}

bool IsMotion(const Channel& channel) {
  return channel.quantity == RecordedQuantity::kPosition || channel.quantity == RecordedQuantity::kVelocity ||
         channel.quantity == RecordedQuantity::kAcceleration;
}

/// The begin of a recording, and how well the model explains it.
class Begin {
 public:
  Begin(const RobotModel& model, Recording recording) : regressor_(model), torques_(model.num_joints()) {
    constexpr size_t kRows = 3000;
    MotionFit motion(model, &recording, kRows);
    joints_ = motion.joints();
    has_currents_ = motion.has_currents();
    motion.Run([&](const RecordedSample& sample) {
      samples_.push_back(sample);
      // Where friction holds a joint, its torque says nothing.
      const std::vector<bool> judged = motion.IsJudged(sample);
      for (const int joint : joints_)
        if (!judged[static_cast<size_t>(joint)])
          samples_.back().torque[joint] = std::numeric_limits<double>::quiet_NaN();
      return samples_.size() < kRows;
    });
  }

  [[nodiscard]] size_t size() const { return samples_.size(); }

  /// How far the model's torques are off beside gains' signs, friction and offsets: the sum over joints of
  /// the logarithm of the residual, at every such sample.
  double CalcMisfit(const PositionFault& undone, size_t every) {
    std::vector<Products> products(joints_.size(), Products::Zero());
    for (size_t i = 0; i < samples_.size(); i += every) {
      RecordedSample sample = samples_[i];
      undone.Undo(&sample);
      regressor_.SetMotion(sample.q, sample.qd, sample.qdd, sample.base);
      regressor_.CalcTorques(torques_);
      for (size_t place = 0; place < joints_.size(); ++place) {
        const int joint = joints_[place];
        if (std::isnan(sample.torque[joint])) continue;
        Eigen::Matrix<double, kColumns, 1> row;
        row << 1.0, sample.direction[joint], sample.qd[joint], torques_[joint], sample.torque[joint];
        // A current's scale is free.
        if (!has_currents_) row[4] -= std::exchange(row[3], 0.0);
        products[place] += row * row.transpose();
      }
    }
    double misfit = 0.0;
    for (const Products& G : products) misfit += CalcLogResidual(G);
    return misfit;
  }

 private:
  static constexpr int kColumns = 5;  // offset, direction, velocity, the model's torque, the measured one
  using Products = Eigen::Matrix<double, kColumns, kColumns>;

  static double CalcLogResidual(const Products& G) {
    const Eigen::Vector4d b = G.topRightCorner<4, 1>();
    const double y = G(4, 4);
    const double left = y - b.dot(SolveLeastSquares(G.topLeftCorner<4, 4>(), b));
    constexpr double kRounding = 1e-12;
    return 0.5 * std::log(std::max(left, kRounding * y) / std::max(1.0, G(0, 0)) +
                          std::numeric_limits<double>::min());
  }

  TorqueRegressor regressor_;
  std::vector<int> joints_;
  bool has_currents_ = false;
  std::vector<RecordedSample> samples_;
  VectorXd torques_;
};

std::vector<PositionFault> ListPositionFaults(const RobotModel& model, const Recording& recording) {
  std::vector<PositionFault> faults;
  faults.push_back(
      {{"unit of the positions", "all joints", 180.0 / kPi, 0.0, "", "(degrees)"}, -1, -1, kPi / 180.0});
  for (int joint = 0; joint < model.num_joints(); ++joint) {
    if (recording.FindColumn(RecordedQuantity::kPosition, joint) < 0) continue;
    const std::string place = "joint " + model.joint(joint).name;
    for (const double gain : {-1.0, 0.5, 0.8, 0.9, 1.1, 1.25, 2.0})
      faults.push_back({{"position gain", place, gain, 0.0, "", gain < 0.0 ? "(the other sign)" : ""},
                        joint,
                        -1,
                        1.0 / gain});
    faults.push_back({{"torque gain", place, -1.0, 0.0, "", "(the other sign)"}, joint, -1, -1.0, true});
    for (int other = joint + 1; other < model.num_joints(); ++other) {
      if (recording.FindColumn(RecordedQuantity::kPosition, other) < 0) continue;
      for (const char* const what : {"position", "torque"})
        faults.push_back({{std::string(what) + " exchanged with that of " + model.joint(other).name, place,
                           1.0, 0.0, "", ""},
                          joint,
                          other,
                          1.0,
                          *what == 't'});
    }
  }
  return faults;
}

}  // namespace

void PositionFault::Undo(Recording* recording) const {
  for (Channel& one : recording->channels) {
    if (!(is_torque ? IsTorque(one) : IsMotion(one))) continue;
    if (other >= 0) {
      if (one.joint == joint || one.joint == other) one.joint = joint + other - one.joint;
    } else if (joint < 0 || one.joint == joint) {
      one.scale *= factor;
      one.offset *= factor;
    }
  }
}

void PositionFault::Undo(RecordedSample* sample) const {
  for (VectorXd* const each : {&sample->torque, &sample->q, &sample->qd, &sample->qdd, &sample->direction}) {
    if (is_torque != (each == &sample->torque)) continue;
    if (other >= 0) {
      std::swap((*each)[joint], (*each)[other]);
    } else if (joint >= 0) {
      (*each)[joint] *= factor;
    } else if (each != &sample->direction) {
      *each *= factor;
    }
  }
}

std::optional<PositionFault> FindPositionFault(const RobotModel& model, Recording recording) {
  std::vector<PositionFault> all = ListPositionFaults(model, recording);
  Begin begin(model, std::move(recording));
  // A few samples say which are worth all of them.
  constexpr size_t kFewSamples = 100, kFewFaults = 10;
  std::vector<std::pair<double, PositionFault>> faults;
  for (PositionFault& one : all) {
    const double misfit = begin.CalcMisfit(one, std::max<size_t>(1, begin.size() / kFewSamples));
    faults.emplace_back(misfit, std::move(one));
  }
  std::sort(faults.begin(), faults.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  faults.resize(std::min(faults.size(), kFewFaults));
  // By a factor of three, of one joint or spread over several.
  constexpr double kMuch = 1.1, kMuchOfRatio = 5.0;
  const double as_read = begin.CalcMisfit({}, 1);
  double best = as_read - kMuch;
  std::optional<PositionFault> found;
  for (auto& [few, fault] : faults) {
    const double misfit = begin.CalcMisfit(fault, 1);
    if (misfit < best) best = misfit, found = std::move(fault);
  }
  // A ratio is anything; a sign, an exchange and a unit are not.
  const bool is_ratio = found && found->joint >= 0 && found->other < 0 && found->factor > 0.0;
  for (double step = 0.1; is_ratio && step > 1e-5; step *= 0.5)
    for (const double change : {1.0 - step, 1.0 + step}) {
      PositionFault near = *found;
      near.fault.value = 1.0 / (near.factor *= change);
      const double misfit = begin.CalcMisfit(near, 1);
      if (misfit < best) best = misfit, found = std::move(near);
    }
  // With a free number something is always explained.
  if (is_ratio && best > as_read - kMuchOfRatio) found.reset();
  return found;
}

}  // namespace dexcheck
