#include "harness/recordings/cause_description.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

using Eigen::Index;

/// The number of a joint that a column of friction, an offset, a gain or a delay adds to.
std::optional<TorqueColumn::Kind> FindNumber(const TorqueFault& fault, const TorqueColumn& column) {
  using enum TorqueFault::Kind;
  for (const auto kind :
       {kDryFriction, kAllDry, kAllFriction, kViscousFriction, kAllOffsets, kOffset, kTorqueGain, kDelay})
    if (fault.kind == kind) return column.kind == TorqueColumn::kFriction ? TorqueColumn::kDry : column.kind;
  return std::nullopt;
}

/// Three digits of each entry.
std::string ShowVector(const Eigen::Ref<const VectorXd>& v) { return FormatVector(v, 3); }

}  // namespace

bool FoundFault::HasSize() const {
  const VectorXd finite = error.array().isFinite().select(error, 0.0);
  return amplitude.norm() > std::max(finite.norm(), std::numeric_limits<double>::min()) &&
         (!fault.is_possible || fault.is_possible(amplitude));
}

CauseDescription::JointNumber CauseDescription::CalcNumber(int joint, TorqueColumn::Kind kind) const {
  JointNumber number;
  for (const CauseTerm& term : estimator_.selection().terms) {
    const TorqueFault& fault = estimator_.faults()[term.candidate];
    for (size_t k = 0; k < fault.sums.size(); ++k)
      for (const ColumnPart& part : fault.sums[k]) {
        if (part.joint != joint || FindNumber(fault, part.column) != kind) continue;
        // Its velocity is no number of the joint.
        if (fault.HasVelocity() && &part != fault.sums.front().data()) continue;
        // A gain has what it multiplies beside its own column.
        const double factor = fault.kind == TorqueFault::kTorqueGain ? part.factor : 1.0;
        number.change += factor * term.amplitude[static_cast<Index>(k)];
        number.variance += Square(factor * term.error[static_cast<Index>(k)]);
        ++number.terms;
      }
  }
  return number;
}

bool CauseDescription::AddWholeNumbers(FoundFault* found, Fault* shown) const {
  const TorqueFault& fault = found->fault;
  if (fault.sums.empty()) return false;
  const auto kind = FindNumber(fault, fault.sums.front().front().column);
  if (!kind) return false;
  if (fault.index >= 0) {
    const JointNumber number = CalcNumber(fault.index, *kind);
    if (number.terms < 2) return false;
    shown->value = fault.nominal + number.change;
    shown->error = std::sqrt(number.variance);
    return true;
  }
  std::vector<std::string> names;
  bool is_shared = false;
  for (const int joint : set_.joints()) {
    const bool is_alone = CalcNumber(joint, *kind).terms < 2;
    if (is_alone) names.push_back(model_.joint(joint).name);
    is_shared = is_shared || !is_alone;
  }
  if (fault.sums.size() == 1) {
    if (is_shared) shown->place = (names.size() == 1 ? "joint " : "joints ") + JoinNames(names);
    return is_shared;
  }
  VectorXd whole(found->amplitude.size());
  for (size_t k = 0; k < fault.sums.size(); ++k) {
    const ColumnPart& part = fault.sums[k].front();
    const Joint& joint = model_.joint(part.joint);
    const TorqueColumn::Kind own = *FindNumber(fault, part.column);
    const JointNumber number = CalcNumber(part.joint, own);
    const bool is_viscous = own == TorqueColumn::kViscous, is_dry = own == TorqueColumn::kDry;
    const std::string unit = joint.type == JointType::kRevolute ? "N m" : "N";
    const double nominal = is_viscous ? joint.damping : is_dry ? joint.dry_friction : 0.0;
    whole[static_cast<Index>(k)] = nominal + number.change;
    found->parts.push_back({is_viscous ? "viscous friction"
                            : is_dry   ? "dry friction"
                                       : "torque offset",
                            joint.name, nominal + number.change, std::sqrt(number.variance),
                            !is_viscous                          ? unit
                            : joint.type == JointType::kRevolute ? "N m s/rad"
                                                                 : "N s/m",
                            ""});
  }
  shown->value = whole.mean();
  shown->detail = ShowVector(whole);
  if (fault.kind == TorqueFault::kAllFriction) {
    // Sizes of two units have no mean.
    const Index half = whole.size() / 2;
    shown->value = std::numeric_limits<double>::quiet_NaN();
    shown->detail =
        fmt::format("{} N m and {} N m s/rad", ShowVector(whole.head(half)), ShowVector(whole.tail(half)));
  }
  return is_shared;
}

double CauseDescription::ShapeVelocityOf(const TorqueFault& fault, const VectorXd& a) const {
  const double v = set_[0].motion.shape_velocities(fault.index, fault.sums.front().front().column.component);
  return a.size() == 1 ? v : v * std::sqrt(kFineRatio) * std::exp(a[1] / a[0]);
}

double CauseDescription::LimitOf(const TorqueFault& fault, const VectorXd& a) const {
  const int component = fault.sums.front().front().column.component;
  return FindCutOff(set_.refinements(), fault.index, component, set_[0].most_torque[fault.index]) *
         (1.0 + a[1] / a[0]);
}

std::string DescribeGeometry(const RobotModel& model, const LinkFrames& frames, int joint, bool is_turn,
                             const Vector3d& by) {
  const int parent = model.joint(joint).parent;
  const Matrix3d R = parent < 0 ? Matrix3d(Matrix3d::Identity()) : frames.Find(parent).linear();
  return (is_turn ? "turned by " : "moved by ") + ShowVector(R.transpose() * by) + (is_turn ? " rad" : " m") +
         " in " + (parent < 0 ? "the base's frame" : frames.NameOf(model.link_name(parent)));
}

Fault CauseDescription::Describe(const TorqueFault& fault, const VectorXd& a, VectorXd error) const {
  if (error.size() == 0) error = VectorXd::Zero(a.size());
  Fault one;
  one.fault = fault.fault;
  one.place = fault.place;
  one.unit = fault.unit;
  const bool is_number =
      (a.size() == 1 && fault.axes.size() == 0) || fault.kind == TorqueFault::kSpring || fault.HasVelocity();
  const bool is_of_joints = fault.index < 0 && fault.sums.size() > 1 && fault.sums.front().front().joint >= 0;
  one.value = is_number ? fault.nominal + a[0] : is_of_joints ? a.mean() : a.norm();
  // A combination that does not show leaves the others their size.
  const bool shows_some = !is_number && fault.kind != TorqueFault::kPayload &&
                          error.array().isFinite().any() && !error.array().isFinite().all();
  const VectorXd shown = shows_some ? VectorXd(error.array().isFinite().select(error, 0.0)) : error;
  one.error = is_number      ? error[0]
              : is_of_joints ? shown.norm() / static_cast<double>(a.size())
                             : shown.norm();
  const auto vector = ShowVector;
  using enum TorqueFault::Kind;
  const int carrier = fault.kind == kPayload ? fault.index : fault.push.payload;
  if (carrier >= 0) {
    one.value = a[0];
    one.error = error[0];
    const Vector3d place = frames_.Find(carrier).inverse() * Vector3d(a.segment<3>(1) / a[0]);
    one.detail = "at " + vector(place) + " m" + InFrameOf(carrier);
  } else if (fault.kind == kCentre) {
    const Matrix3d R = frames_.Find(fault.index).linear();
    one.detail = "moved by " + vector(R.transpose() * fault.axes * a) + InFrameOf(fault.index);
  } else if (fault.kind == kInertia && fault.IsEntry()) {
    one.detail = "times the model's";
  } else if (fault.kind == kInertia) {
    const Matrix3d R = frames_.Find(fault.index).linear();
    one.detail = "more by " + vector(ToEntries(R.transpose() * ToTensor(a) * R)) +
                 " (xx, yy, zz, xy, xz, yz)" + InFrameOf(fault.index);
  } else if (fault.kind == kSaturation) {
    one.value = LimitOf(fault, a);
    one.error = error[1] * one.value;
  } else if (fault.kind == kGeometry) {
    const bool is_turn = fault.sums.front().front().column.component > 0;
    one.detail = DescribeGeometry(model_, frames_, fault.index, is_turn, fault.axes * a);
  } else if (fault.kind == kPositionGain) {
    one.value = 1.0 / (1.0 - a[0]);
    one.error *= Square(one.value);
  } else if (fault.kind == kSpring) {
    one.detail = "at rest at " + FormatNumber(-a[1] / a[0], 3);
  } else if (fault.kind == kShaking) {
    one.value = a.head<6>().norm();
    one.error = error.head<6>().norm();
    const auto size = [&](Index i) { return a.segment<2>(2 * i).norm(); };
    one.detail =
        fmt::format("at {} Hz, along its axes {}", FormatNumber(set_.refinements().shaking / (2.0 * kPi), 4),
                    vector(Vector3d(size(0), size(1), size(2))));
    if (a.size() > 6) one.detail += ", about them " + vector(Vector3d(size(3), size(4), size(5))) + " rad";
  } else if (fault.kind == kStuckTorque || (fault.kind == kPush && fault.push.is_stuck)) {
    one.value = a[0];
    one.error = error[0];
  } else if (fault.kind == kPush && fault.push.has_moment) {
    one.value = a.head<3>().norm();
    one.error = error.head<3>().norm();
    one.detail =
        vector(a.head<3>()) + " N and " + vector(a.tail<3>()) + " N m at its centre of mass in world axes";
  } else if (fault.kind == kPush && fault.push.link < 0 && fault.push.joint < 0) {
    const double turned = 2.0 * std::asin(std::min(1.0, 0.5 * a.norm() / model_.gravity().norm()));
    one.detail = vector(a) + ", or tilted by " + FormatNumber(RadToDeg(turned), 3) + " deg";
  } else if (fault.kind == kGravity) {
    const Vector3d now = model_.gravity() + a.head<3>();
    const double turned = std::atan2(now.cross(model_.gravity()).norm(), now.dot(model_.gravity()));
    one.value = now.norm();
    constexpr double kNone = 0.1;  // of the model's: it has no direction
    one.detail = vector(now);
    if (now.norm() > kNone * model_.gravity().norm())
      one.detail += ", turned by " + FormatNumber(RadToDeg(turned), 3) + " deg";
  } else if (fault.kind == kTorqueGain && std::abs(one.value + 1.0) < 0.2) {
    one.detail = "(the other sign)";
  } else if (fault.kind == kStribeckFriction) {
    one.detail = "below about " + FormatNumber(ShapeVelocityOf(fault, a), 2) + " per s";
  } else if (!is_number) {
    one.detail = vector(a) + (fault.kind == kPush ? " at its centre of mass in world axes" : "");
  }
  if (shows_some) one.detail += ", as far as this motion shows it";
  if (fault.recording >= 0 && names_.size() > 1)
    one.detail += " in " + names_[static_cast<size_t>(fault.recording)];
  return one;
}

}  // namespace dexcheck
