#include "harness/recordings/position_faults.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "controller/common/linear_algebra.h"

namespace dexcheck {
namespace {

using Eigen::Index;

constexpr double kNoSize = std::numeric_limits<double>::quiet_NaN();  // of an exchange

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
  Begin(const RobotModel& model, Recording* recording) : regressor_(model), torques_(model.num_joints()) {
    constexpr size_t kRows = 3000;
    MotionFit motion(model, recording, kRows);
    joints_ = motion.joints();
    has_currents_ = motion.has_currents();
    motion.Run([&](const RecordedSample& sample) {
      samples_.push_back(sample);
      // A joint that friction holds has a torque that says nothing.
      const std::vector<bool> judged = motion.IsJudged(sample);
      for (const int joint : joints_)
        if (!judged[static_cast<size_t>(joint)])
          samples_.back().torque[joint] = std::numeric_limits<double>::quiet_NaN();
      return samples_.size() < kRows;
    });
  }

  [[nodiscard]] size_t size() const { return samples_.size(); }
  /// Size of the positions, by joint.
  [[nodiscard]] VectorXd largest() const {
    VectorXd largest = VectorXd::Zero(torques_.size());
    for (const RecordedSample& sample : samples_) largest = largest.cwiseMax(sample.q.cwiseAbs());
    return largest;
  }
  /// Whether positions in another order stay in the joints' ranges, or leave none that they do not leave now.
  [[nodiscard]] bool IsInRange(const std::vector<int>& order) const {
    constexpr double kBeyond = 0.2;  // rad or m
    const auto is_beyond = [&](size_t from, int joint) {
      const Joint& there = regressor_.model().joint(joint);
      return std::ranges::any_of(samples_, [&](const RecordedSample& sample) {
        const double q = sample.q[static_cast<Index>(from)];
        return q < there.lower - kBeyond || q > there.upper + kBeyond;
      });
    };
    for (size_t from = 0; from < order.size(); ++from)
      if (is_beyond(from, order[from]) && !is_beyond(from, static_cast<int>(from))) return false;
    return true;
  }

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

/// Faults of positions and torques that nothing in the recording speaks against: its units, its columns, and
/// the joints' ranges.
class PositionFaults {
 public:
  PositionFaults(const RobotModel& model, const Recording& recording, const Begin& begin)
      : model_(model), recording_(recording), begin_(begin), own_(static_cast<size_t>(model.num_joints())) {
    std::iota(own_.begin(), own_.end(), 0);
  }

  std::vector<PositionFault> List() {
    AddUnit();
    AddTorqueSign(-1);
    AddAlphabet();
    for (int joint = 0; joint < model_.num_joints(); ++joint) {
      if (!HasPosition(joint)) continue;
      AddNumbers(joint);
      for (int other = joint + 1; other < model_.num_joints(); ++other)
        if (HasPosition(other)) AddExchanges(joint, other);
    }
    return std::move(faults_);
  }

 private:
  [[nodiscard]] bool HasPosition(int joint) const {
    return recording_.FindColumn(RecordedQuantity::kPosition, joint) >= 0;
  }
  [[nodiscard]] bool HasTorque(int joint) const {
    return recording_.FindColumn(RecordedQuantity::kTorque, joint) >= 0 ||
           recording_.FindColumn(RecordedQuantity::kCurrent, joint) >= 0;
  }
  /// Adds a fault of a joint's motion; of all joints for -1.
  PositionFault& Add(const std::string& fault, int joint, double value, const std::string& unit = "",
                     const std::string& detail = "") {
    const std::string place = joint < 0 ? "all joints" : "joint " + model_.joint(joint).name;
    return faults_.emplace_back(
        PositionFault{.fault = {fault, place, value, 0.0, unit, detail}, .joint = joint});
  }

  /// Degrees: where no column has a unit, and what is read is more than a joint can turn.
  void AddUnit() {
    constexpr double kBeyond = 1.1;
    bool is_beyond = false;
    for (const Channel& one : recording_.channels) {
      if (one.quantity != RecordedQuantity::kPosition) continue;
      if (one.scale != 1.0 || one.states_unit) return;
      const Joint& joint = model_.joint(one.joint);
      const double most = std::max({std::abs(joint.lower), std::abs(joint.upper), kPi});
      is_beyond = is_beyond || begin_.largest()[one.joint] > kBeyond * most;
    }
    if (is_beyond) Add("unit of the positions", -1, 180.0 / kPi, "", "(degrees)").factor = kPi / 180.0;
  }

  void AddTorqueSign(int joint) {
    PositionFault& sign = Add("torque gain", joint, -1.0, "", "(the other sign)");
    sign.factor = -1.0;
    sign.is_motion = false;
    sign.is_torque = true;
  }

  void AddNumbers(int joint) {
    for (const double gain : {-1.0, 0.5, 0.8, 0.9, 0.98, 1.02, 1.1, 1.25, 2.0})
      for (const bool has_right_rates : {true, false}) {
        PositionFault& one = Add("position gain", joint, gain, "", gain < 0.0 ? "(the other sign)" : "");
        one.factor = 1.0 / gain;
        one.has_right_rates = has_right_rates;
      }
    const bool turns = model_.joint(joint).type == JointType::kRevolute;
    for (const double offset : {0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.4, kPi / 2.0, 2.0, kPi})
      for (const double value : {-offset, offset})
        if (turns) Add("position offset", joint, value, "rad").offset = -value;
    if (HasTorque(joint)) AddTorqueSign(joint);
  }

  void AddExchanges(int joint, int other) {
    std::vector<int> order = own_;
    std::swap(order[static_cast<size_t>(joint)], order[static_cast<size_t>(other)]);
    const bool have_torques = HasTorque(joint) && HasTorque(other), is_in_range = begin_.IsInRange(order);
    const auto add = [&](const std::string& what, const char* with, bool is_motion, bool is_torque) {
      PositionFault& one = Add(what + with + model_.joint(other).name, joint, kNoSize);
      one.order = order;
      one.is_motion = is_motion;
      one.is_torque = is_torque;
    };
    constexpr const char* kWith = " exchanged with that of ";
    if (is_in_range) add("position", kWith, true, false);
    if (have_torques) add("torque", kWith, false, true);
    if (is_in_range && have_torques) add("all columns", " exchanged with those of ", true, true);
  }

  /// Messages of ROS have joints by name: a logger that forgets the names has them in that order.
  void AddAlphabet() {
    for (const int joint : own_)
      if (!HasPosition(joint) || !HasTorque(joint)) return;
    std::vector<int> order = own_;
    std::ranges::sort(order, {}, [&](int joint) { return model_.joint(joint).name; });
    if (order == own_ || !begin_.IsInRange(order)) return;
    std::string names;
    for (const int joint : order) names += (names.empty() ? "" : ", ") + model_.joint(joint).name;
    PositionFault& one = Add("columns in alphabetical order", -1, kNoSize, "", "(" + names + ")");
    one.order = order;
    one.is_torque = true;
  }

  const RobotModel& model_;
  const Recording& recording_;
  const Begin& begin_;
  std::vector<int> own_;
  std::vector<PositionFault> faults_;
};

}  // namespace

void PositionFault::Undo(Recording* recording) const {
  for (Channel& one : recording->channels) {
    const bool is_position = one.quantity == RecordedQuantity::kPosition;
    const bool is_changed =
        IsTorque(one) ? is_torque : is_motion && IsMotion(one) && (is_position || !has_right_rates);
    if (!is_changed) continue;
    if (!order.empty()) {
      one.joint = order[static_cast<size_t>(one.joint)];
    } else if (joint < 0 || one.joint == joint) {
      one.scale *= factor;
      one.offset = factor * one.offset + (is_position ? offset : 0.0);
    }
  }
}

void PositionFault::Undo(RecordedSample* sample) const {
  for (VectorXd* const each : {&sample->torque, &sample->q, &sample->qd, &sample->qdd, &sample->direction}) {
    const bool is_position = each == &sample->q;
    const bool is_changed =
        each == &sample->torque ? is_torque : is_motion && (is_position || !has_right_rates);
    if (!is_changed) continue;
    if (!order.empty()) {
      const VectorXd recorded = *each;
      for (size_t i = 0; i < order.size(); ++i) (*each)[order[i]] = recorded[static_cast<Index>(i)];
    } else if (joint >= 0) {
      (*each)[joint] = factor * (*each)[joint] + (is_position ? offset : 0.0);
    } else if (each != &sample->direction) {
      *each *= factor;
    }
  }
}

namespace {

/// A ratio and an offset are anything; a sign, an order and a unit are not.
bool HasFreeNumber(const PositionFault& fault) {
  return fault.joint >= 0 && fault.order.empty() && fault.factor > 0.0;
}

/// Moves a fault's free number to where it explains most. @param every of so many samples one counts.
void Refine(size_t every, Begin* begin, PositionFault* fault) {
  if (!HasFreeNumber(*fault)) return;
  const bool is_offset = fault->offset != 0.0;
  double best = begin->CalcMisfit(*fault, every);
  constexpr int kHalvings = 17;  // of the step, to less than 1e-6
  double step = 0.1;
  for (int i = 0; i < kHalvings; ++i, step *= 0.5) {
    for (const double change : {-step, step}) {
      PositionFault near = *fault;
      if (is_offset) {
        near.fault.value = -(near.offset += change);
      } else {
        near.fault.value = 1.0 / (near.factor *= 1.0 + change);
      }
      const double misfit = begin->CalcMisfit(near, every);
      if (misfit < best) best = misfit, *fault = std::move(near);
    }
  }
}

}  // namespace

std::optional<PositionFault> FindPositionFault(const RobotModel& model, Recording recording) {
  Begin begin(model, &recording);
  std::vector<PositionFault> all = PositionFaults(model, recording, begin).List();
  // A few samples say which are worth all of them: of each kind and place the best number.
  constexpr size_t kFewSamples = 100, kFewFaults = 10;
  const size_t few = std::max<size_t>(1, begin.size() / kFewSamples);
  std::vector<std::pair<double, PositionFault>> faults;
  for (PositionFault& one : all) {
    const double misfit = begin.CalcMisfit(one, few);
    const auto same = std::ranges::find_if(faults, [&](const auto& known) {
      const PositionFault& other = known.second;
      return HasFreeNumber(one) && HasFreeNumber(other) && one.fault.fault == other.fault.fault &&
             one.joint == other.joint && one.has_right_rates == other.has_right_rates;
    });
    if (same == faults.end()) {
      faults.emplace_back(misfit, std::move(one));
    } else if (misfit < same->first) {
      *same = {misfit, std::move(one)};
    }
  }
  std::sort(faults.begin(), faults.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  faults.resize(std::min(faults.size(), kFewFaults));
  // The residual falls by a factor of three, of one joint or spread over several. With a free number
  // something is always explained.
  constexpr double kMuch = 1.1, kMuchOfNumber = 3.0;
  const double as_read = begin.CalcMisfit({}, 1);
  double best = as_read;
  std::optional<PositionFault> found;
  for (auto& [of_few, fault] : faults) {
    Refine(few, &begin, &fault);  // a number is compared where it explains most
    const double misfit = begin.CalcMisfit(fault, 1);
    const double most = as_read - (HasFreeNumber(fault) ? kMuchOfNumber : kMuch);
    if (misfit < std::min(best, most)) best = misfit, found = std::move(fault);
  }
  if (found) Refine(1, &begin, &*found);
  return found;
}

}  // namespace dexcheck
