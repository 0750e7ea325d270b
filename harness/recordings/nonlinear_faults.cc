#include "harness/recordings/nonlinear_faults.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace dexcheck {
namespace {

using Eigen::Index;

constexpr double kNoSize = std::numeric_limits<double>::quiet_NaN();  // of an exchange

/// Faults of positions and torques that nothing in the recording speaks against: its units, its columns, and
/// the joints' ranges.
class NonlinearFaults {
 public:
  NonlinearFaults(const RobotModel& model, const Recording& recording, const MatrixXd& ranges)
      : model_(model), recording_(recording), ranges_(ranges), own_(static_cast<size_t>(model.num_joints())) {
    std::iota(own_.begin(), own_.end(), 0);
  }

  std::vector<NonlinearFault> List() {
    AddUnits();
    AddTorqueSign(-1);
    AddClock();
    AddAlphabet();
    for (int joint = 0; joint < model_.num_joints(); ++joint) {
      if (!HasPosition(joint)) continue;
      AddNumbers(joint);
      AddGeometry(joint);
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
  /// Whether positions in another order stay in the joints' ranges, or leave none that they do not leave now.
  [[nodiscard]] bool IsInRange(const std::vector<int>& order) const {
    constexpr double kBeyond = 0.2;  // rad or m
    const auto is_beyond = [&](size_t from, int joint) {
      const auto row = ranges_.row(static_cast<Index>(from));
      return row[0] < model_.joint(joint).lower - kBeyond || row[1] > model_.joint(joint).upper + kBeyond;
    };
    for (size_t from = 0; from < order.size(); ++from)
      if (is_beyond(from, order[from]) && !is_beyond(from, static_cast<int>(from))) return false;
    return true;
  }
  /// Adds a fault of a joint's motion; of all joints for -1.
  NonlinearFault& Add(const std::string& fault, int joint, double value, const std::string& unit = "",
                      const std::string& detail = "") {
    const std::string place = joint < 0 ? "all joints" : "joint " + model_.joint(joint).name;
    return faults_.emplace_back(
        NonlinearFault{.fault = {fault, place, value, 0.0, unit, detail}, .joint = joint});
  }

  /// Adds degrees where no column has a unit: of the joints that would turn further than they can, and of
  /// all.
  void AddUnits() {
    constexpr double kBeyond = 1.1;
    std::vector<int> beyond;
    for (const Channel& one : recording_.channels) {
      if (one.quantity != RecordedQuantity::kPosition) continue;
      if (one.scale != 1.0 || one.states_unit) return;
      const Joint& joint = model_.joint(one.joint);
      const double most = std::max({std::abs(joint.lower), std::abs(joint.upper), kPi});
      if (ranges_.row(one.joint).cwiseAbs().maxCoeff() > kBeyond * most) beyond.push_back(one.joint);
    }
    if (beyond.empty()) return;
    beyond.push_back(-1);
    for (const int joint : beyond)
      Add(joint < 0 ? "unit of the positions" : "unit of the position", joint, 180.0 / kPi, "", "(degrees)")
          .factor = kPi / 180.0;
  }

  /// Adds a clock that is fast or slow: velocities that are the positions' derivatives show that it is right.
  void AddClock() {
    if (recording_.Has(RecordedQuantity::kVelocity)) return;
    for (const double clock : {0.5, 1.0, 2.0}) {
      NonlinearFault& one = Add("clock", -1, 1.0, "", "times the true time");
      one.number = NonlinearFault::Number::kClock;
      one.clock = clock;
    }
  }

  /// Adds a joint that stands elsewhere or has another axis. All that a fixed base carries turns with
  /// gravity.
  void AddGeometry(int joint) {
    Add("axis", joint, 0.0, "rad").number = NonlinearFault::Number::kAxis;
    if (model_.joint(joint).parent < 0) return;
    Add("placement", joint, 0.0, "m").number = NonlinearFault::Number::kPlacement;
    Add("orientation", joint, 0.0, "rad").number = NonlinearFault::Number::kOrientation;
  }

  void AddTorqueSign(int joint) {
    NonlinearFault& sign = Add("torque gain", joint, -1.0, "", "(the other sign)");
    sign.factor = -1.0;
    sign.is_motion = false;
    sign.is_torque = true;
  }

  void AddNumbers(int joint) {
    for (const double gain : {-1.0, 0.5, 0.8, 0.9, 0.98, 1.02, 1.1, 1.25, 2.0}) {
      NonlinearFault& one = Add("position gain", joint, gain, "", gain < 0.0 ? "(the other sign)" : "");
      if (gain > 0.0) one.number = NonlinearFault::Number::kGain;
      one.factor = 1.0 / gain;
    }
    const bool turns = model_.joint(joint).type == JointType::kRevolute;
    for (const double offset : {0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.4, kPi / 2.0, 2.0, kPi})
      for (const double value : {-offset, offset})
        if (turns) {
          NonlinearFault& one = Add("position offset", joint, value, "rad");
          one.number = NonlinearFault::Number::kOffset;
          one.offset = -value;
        }
    if (HasTorque(joint)) AddTorqueSign(joint);
  }

  void AddExchanges(int joint, int other) {
    std::vector<int> order = own_;
    std::swap(order[static_cast<size_t>(joint)], order[static_cast<size_t>(other)]);
    const bool have_torques = HasTorque(joint) && HasTorque(other), is_in_range = IsInRange(order);
    const auto add = [&](const std::string& what, const char* with, bool is_motion, bool is_torque) {
      NonlinearFault& one = Add(what + with + model_.joint(other).name, joint, kNoSize);
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
    if (order == own_ || !IsInRange(order)) return;
    std::string names;
    for (const int joint : order) names += (names.empty() ? "" : ", ") + model_.joint(joint).name;
    NonlinearFault& one = Add("columns in alphabetical order", -1, kNoSize, "", "(" + names + ")");
    one.order = order;
    one.is_torque = true;
  }

  const RobotModel& model_;
  const Recording& recording_;
  const MatrixXd& ranges_;
  std::vector<int> own_;
  std::vector<NonlinearFault> faults_;
};

}  // namespace

Index NonlinearFault::CountNumbers() const {
  switch (number) {
    case Number::kPlacement:
    case Number::kOrientation:
      return 3;
    case Number::kAxis:
      return 2;
    default:
      return 1;
  }
}

void NonlinearFault::Undo(Recording* recording) const {
  for (Channel& one : recording->channels) {
    if (one.quantity == RecordedQuantity::kTime) {
      one.scale *= clock;
      one.offset *= clock;
      continue;
    }
    const bool is_position = one.quantity == RecordedQuantity::kPosition;
    const bool is_effort =
        one.quantity == RecordedQuantity::kTorque || one.quantity == RecordedQuantity::kCurrent;
    const bool is_changed = is_effort ? is_torque : is_motion && (is_position || !has_right_rates);
    if (!is_changed || CountComponents(one.quantity) > 0) continue;
    if (!order.empty()) {
      one.joint = order[static_cast<size_t>(one.joint)];
    } else if (joint < 0 || one.joint == joint) {
      one.scale *= factor;
      one.offset = factor * one.offset + (is_position ? offset : 0.0);
    }
  }
}

void NonlinearFault::Undo(RecordedSample* sample) const {
  sample->qd /= clock;
  sample->qdd /= clock * clock;
  for (VectorXd* const each : {&sample->torque, &sample->q, &sample->qd, &sample->qdd, &sample->direction}) {
    if (!(each == &sample->torque ? is_torque : is_motion)) continue;
    if (!order.empty()) {
      const VectorXd recorded = *each;
      for (size_t i = 0; i < order.size(); ++i) (*each)[order[i]] = recorded[static_cast<Index>(i)];
    } else if (joint >= 0) {
      (*each)[joint] = factor * (*each)[joint] + (each == &sample->q ? offset : 0.0);
    } else if (each != &sample->direction) {
      *each *= factor;
    }
  }
}

void NonlinearFault::Undo(RobotSpec* robot) const {
  if (!IsOfModel()) return;
  Joint& moved = robot->joints[static_cast<size_t>(joint)];
  const Pose home = CalcRowPose(moved);
  const Vector3d origin = home.translation();
  const Eigen::AngleAxisd turned(turn.norm(), turn.normalized());
  moved.X_PB =
      Pose(Eigen::Translation3d(origin + shift) * turned * Eigen::Translation3d(-origin)) * moved.X_PB;
  if (number != Number::kAxis) return;
  const Matrix3d back = home.linear().transpose() * turned.inverse() * home.linear();
  moved.body.com = back * moved.body.com;
  moved.body.inertia = back * moved.body.inertia * back.transpose();
  for (Joint& one : robot->joints)
    if (one.parent == joint) one.X_PB = Pose(back) * one.X_PB;
}

MatrixXd FindDirections(const RobotModel& model, int joint) {
  const Joint& one = model.joint(joint);
  const Vector3d axis =
      one.X_PB.linear() * Eigen::AngleAxisd(one.mdh.alpha, Vector3d::UnitX()) * Vector3d::UnitZ();
  const Vector3d first = axis.unitOrthogonal();
  return (MatrixXd(3, 3) << first, axis.cross(first), axis).finished();
}

std::vector<NonlinearFault> ListNonlinearFaults(const RobotModel& model, const Recording& recording,
                                                const MatrixXd& ranges) {
  return NonlinearFaults(model, recording, ranges).List();
}

}  // namespace dexcheck
