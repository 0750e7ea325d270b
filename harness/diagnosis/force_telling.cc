#include "harness/diagnosis/force_telling.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

using Eigen::Index;
using namespace force_fault;

// Gravity whose size differs by less than this fraction of its change only points elsewhere.
constexpr double kTilted = 0.2;
// A spring's stiffness by its torque: less shows only the torque, 1 / rad or 1 / m.
constexpr double kSoft = 0.1;

std::string ShowVector(const Eigen::Ref<const VectorXd>& v) { return FormatVector(v, 4); }

/// A value within so many standard errors of zero shows no size.
void RequireSize(Fault* fault) {
  constexpr double kErrors = 5.0;
  if (kErrors * fault->error > std::abs(fault->value)) fault->error = std::numeric_limits<double>::infinity();
}

/// A push whose amplitudes are what it grows by a second and what it is at the time `nominal`.
Fault MakeGrowing(const Candidate& candidate, const VectorXd& a, const VectorXd& error) {
  const Index size = a.size() / 2;
  const VectorXd rate = a.head(size);
  Fault fault{candidate.fault,
              candidate.place,
              size == 1 ? rate[0] : rate.norm(),
              error.size() > 0 ? error.head(size).norm() : 0.0,
              candidate.unit,
              size == 1 ? "" : ShowVector(rate) + " "};
  RequireSize(&fault);
  fault.detail += "since " + FormatNumber(CalcGrowthBegin(a, candidate.nominal), 4) + " s";
  return fault;
}

/// Turns vectors and tensors of a body from frame i.
VectorXd TurnToLink(const Candidate& candidate, VectorXd a, const Matrix3d& R_Li) {
  const auto turn = [&](Index at) { a.segment<3>(at) = (R_Li * a.segment<3>(at)).eval(); };
  if (candidate.fault == "payload") {
    turn(1);
  } else if (candidate.fault == "inertia") {
    a.head<6>() = ToEntries(R_Li * ToTensor(a.head<6>()) * R_Li.transpose());
  } else if (candidate.fault == kCenter || candidate.fault == kCenterAlone ||
             candidate.fault == kForceInAxes || candidate.fault == kMomentInAxes ||
             candidate.fault == kForceAtPointInAxes) {
    turn(0);
    if (candidate.fault == kForceAtPointInAxes) turn(3);
  }
  return a;
}

}  // namespace

double CalcGrowthBegin(const VectorXd& a, double end) {
  const Index size = a.size() / 2;
  return end - a.head(size).dot(a.tail(size)) / a.head(size).squaredNorm();
}

Fault MakeForceFault(const Candidate& candidate, const VectorXd& amplitude, const VectorXd& error,
                     const RobotModel& model) {
  const Vector3d& gravity = model.gravity();
  // A body that is no link has its own axes.
  Matrix3d R_Li = Matrix3d::Identity();
  for (const Joint& one : model.joints())
    if (candidate.place == "link " + one.link) R_Li = one.R_iL.transpose();
  const VectorXd a = TurnToLink(candidate, amplitude, R_Li);
  if (candidate.fault.ends_with(kGrows)) return MakeGrowing(candidate, a, error);
  Fault fault{candidate.fault,          candidate.place,
              candidate.nominal + a[0], error.size() > 0 ? error[0] : 0.0,
              candidate.unit,           "",
              candidate.nominal};
  const bool sticks = candidate.fault == kStuckBearing;
  if (sticks || candidate.fault == kBearing) {
    fault.fault = "dry friction";
    fault.nominal = candidate.fitted[0];
    fault.value = fault.nominal + candidate.nominal * a[0];  // beside what is declared
    fault.error = sticks ? std::numeric_limits<double>::infinity() : fault.error * candidate.nominal;
    if (sticks) fault.detail = "or more: the joint sticks";
  } else if (candidate.fault == "spring") {
    fault.detail =
        a[0] > kSoft * std::abs(a[1]) ? "relaxed at " + FormatNumber(a[1] / a[0], 4) : "of any stiffness";
    fault.value = std::max(0.0, fault.value);
  } else if (candidate.fault == "tether") {
    if (a[0] != 0.0) fault.detail = "to " + ShowVector(a.tail<3>() / a[0]) + " m";
  } else if (candidate.fault == "payload") {
    if (a[0] != 0.0) fault.detail = "at " + ShowVector(a.segment<3>(1) / a[0]) + " m of its centre of mass";
  } else if (a.size() >= 3) {
    const Index size = candidate.fault == "inertia" ? 6 : 3;
    fault.value = a.head(size).norm();
    if (error.size() >= size) fault.error = error.head(size).norm();
    fault.detail = ShowVector(a.head(size));
    if (candidate.fault == kForceAtPoint)
      fault.detail += " at " + ShowVector(R_Li * candidate.fitted) + " m of its centre of mass";
    if (candidate.fault == kForceAtPointInAxes) {
      fault.fault = kForceAtPoint;
      fault.detail += " in its axes, at " + ShowVector(CalcArm(a)) + " m of its centre of mass";
    }
    if (candidate.fault == "force and moment") fault.detail += " and " + ShowVector(a.tail<3>()) + " N m";
  }
  if (candidate.fault == kForceInAxes || candidate.fault == kMomentInAxes) {
    fault.fault = candidate.fault == kForceInAxes ? kForce : "moment";
    fault.detail += " in its axes";
  } else if (candidate.fault == kCenterAlone) {
    fault.fault = kCenter;
  } else if (candidate.fault == kGravitySize) {
    fault.fault = kGravity;
    fault.value = std::abs(a[0]);
    fault.detail = ShowVector(Vector3d::Zero() + a[0] * gravity.normalized());  // no -0
  } else if (candidate.fault == kMassWithInertia) {
    fault.fault = "mass";
    fault.detail = "and its inertia by the same factor";
  }
  if (candidate.nominal == 0.0) RequireSize(&fault);
  if (candidate.fault != kGravity) return fault;
  const Vector3d change = a;
  if (std::abs(change.dot(gravity.normalized())) < kTilted * change.norm()) {
    const Vector3d actual = gravity + change;
    fault.fault = "slope";
    fault.value = RadToDeg(std::atan2(actual.cross(gravity).norm(), actual.dot(gravity)));
    fault.error = RadToDeg(fault.error / gravity.norm());
    fault.unit = "deg";
    fault.detail = "by " + fault.detail + " m/s^2";
  }
  return fault;
}

}  // namespace dexcheck
