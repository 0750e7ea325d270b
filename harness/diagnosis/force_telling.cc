#include "harness/diagnosis/force_telling.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

using Eigen::Index;
using namespace force_fault;

// Gravity whose size differs by less than this fraction of its change only points elsewhere.
constexpr double kTilted = 0.2;
// A spring's stiffness by its torque: less shows only the torque, 1 / rad or 1 / m.
constexpr double kSoft = 0.1;

// Residuals whose change from one step to the next is further from that of the steps around than this, in
// units of noise, and than this many times what theirs are, have begun, or ended.
constexpr double kJumpNoise = 0.01, kJump = 5.0;

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
  if (size > 1) fault.numbers = rate;
  RequireSize(&fault);
  fault.detail += "since " + FormatNumber(CalcGrowthBegin(a, candidate.nominal), 4) + " s";
  return fault;
}

/// A step that differs.
struct DifferingStep {
  Index index;
  bool follows;     // the one before
  VectorXd change;  // since then
  Vector2d apart;   // how far that is from the neighbours' changes
};

/// Returns the root mean square of a step's rows, the robot's and the object's.
Vector2d CalcSizes(const VectorXd& y) {
  const Index n = y.size() - 6;
  return {y.head(n).norm() / std::sqrt(static_cast<double>(n)), y.tail<6>().norm() / std::sqrt(6.0)};
}

std::vector<DifferingStep> ListDiffering(const StepStore& store, StepForces* forces) {
  std::vector<DifferingStep> steps;
  VectorXd before;
  for (Index i = 0; i < store.size(); ++i) {
    if (!(store.Get(StepStore::kNoise)(0, i) > 0.0)) continue;
    forces->SetStep(i);
    const VectorXd y = forces->CalcResidual();
    if (forces->Differs(y)) {
      const bool follows = !steps.empty() && steps.back().index == i - 1;
      const VectorXd change = follows ? VectorXd(y - before) : y;
      steps.push_back({i, follows, change, CalcSizes(change)});
    }
    before = y;
  }
  // A push that grows evenly changes as one of its neighbours does, even where it begins, or between two
  // jumps.
  for (size_t k = 0; k < steps.size(); ++k)
    for (const size_t other : {k - 2, k - 1, k + 1, k + 2})
      if (other < steps.size() && steps[other].follows)
        steps[k].apart = steps[k].apart.cwiseMin(CalcSizes(steps[k].change - steps[other].change));
  return steps;
}

/// Whether something begins or ends at step k, which its neighbours do not have: of two on a side one may be
/// where something else begins.
bool Jumps(const std::vector<DifferingStep>& steps, size_t k) {
  if (!steps[k].follows) return true;
  const auto calc = [&](size_t near, size_t far) -> Vector2d {
    if (near >= steps.size() || !steps[near].follows) return Vector2d::Zero();  // as before the first
    const bool has_both = far < steps.size() && steps[far].follows;
    return steps[near].apart.cwiseMin(steps[has_both ? far : near].apart);
  };
  const Vector2d around = calc(k - 1, k - 2).cwiseMax(calc(k + 1, k + 2));
  return (steps[k].apart.array() > (kJump * around.array()).max(kJumpNoise)).any();
}

/// Returns the axes of a link's own frame in frame i; of what is no link, its own.
Matrix3d FindLinkAxes(const std::string& place, const RobotModel& model) {
  const auto joint =
      std::ranges::find_if(model.joints(), [&](const Joint& one) { return place == "link " + one.link; });
  return joint == model.joints().end() ? Matrix3d(Matrix3d::Identity()) : joint->R_iL;
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
  const Matrix3d R_Li = FindLinkAxes(candidate.place, model).transpose();
  const VectorXd a = TurnToLink(candidate, amplitude, R_Li);
  if (candidate.fault.ends_with(kGrows)) return MakeGrowing(candidate, a, error);
  Fault fault{candidate.fault,          candidate.place,
              candidate.nominal + a[0], error.size() > 0 ? error[0] : 0.0,
              candidate.unit,           "",
              candidate.nominal};
  if (a.size() > 1) fault.numbers = a;
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
      const Vector3d f = a.head<3>();
      fault.fault = kForceAtPoint;
      fault.detail += " in its axes, at " + ShowVector(f.cross(Vector3d(a.tail<3>())) / f.squaredNorm()) +
                      " m of its centre of mass";
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

void FindSegments(const StepStore& store, StepForces* forces, double level, Segment* whole,
                  std::vector<Segment>* parts) {
  forces->SetLevel(Vector2d::Constant(level));
  const std::vector<DifferingStep> steps = ListDiffering(store, forces);
  for (size_t k = 0; k < steps.size(); ++k) {
    if (Jumps(steps, k)) parts->emplace_back();
    whole->push_back(steps[k].index);
    parts->back().push_back(steps[k].index);
  }
}

}  // namespace dexcheck
