#include "harness/diagnosis/force_points.h"

#include <algorithm>
#include <utility>

#include "controller/common/linear_algebra.h"
#include "harness/diagnosis/search_limit.h"
#include "harness/diagnosis/step_forces.h"

namespace dexcheck {
namespace {

using Eigen::Index;
using namespace force_fault;

constexpr size_t kMostBodies = 8;       // that are looked at
constexpr double kPointExplains = 0.9;  // of |y|^2, by force and moment
constexpr int kMostIterations = 30;     // of Gauss-Newton

/// Columns of force and moment of one body, and which way it is turned at each step.
struct Body {
  const Candidate *force, *moment;
  std::vector<Matrix3d> turns;
  StepRange within;

  /// Effects of moments that `arm` makes of the body's turn, at each step.
  template <typename Arm>
  [[nodiscard]] MatrixXd CalcMoments(const Arm& arm) const {
    MatrixXd columns = MatrixXd::Zero(moment->columns.rows(), 3);
    const Index rows = columns.rows() / static_cast<Index>(turns.size());
    for (Index k = within.begin; k < within.end; ++k)
      columns.middleRows(k * rows, rows) =
          moment->columns.middleRows(k * rows, rows) * arm(turns[static_cast<size_t>(k)]);
    return columns;
  }
  /// y by the force, which acts at p: C_F + C_M [R p]x.
  [[nodiscard]] MatrixXd AtPoint(const Vector3d& p) const {
    MatrixXd columns = CalcMoments([&](const Matrix3d& R) { return Skew(R * p); });
    const Index rows = columns.rows() / static_cast<Index>(turns.size());
    const Index begin = within.begin * rows, count = (within.end - within.begin) * rows;
    columns.middleRows(begin, count) += force->columns.middleRows(begin, count);
    return columns;
  }
  /// y by the point where F acts: -C_M [F]x R.
  [[nodiscard]] MatrixXd ByPoint(const Vector3d& F) const {
    return CalcMoments([&](const Matrix3d& R) { return Matrix3d(-Skew(F) * R); });
  }
};

std::vector<Body> ListBodies(const std::vector<Turns>& turns, const std::vector<Candidate>& candidates) {
  std::vector<Body> bodies;
  for (const Candidate& force : candidates) {
    if (force.fault != kForce) continue;
    const auto moment = std::find_if(candidates.begin(), candidates.end(), [&](const Candidate& one) {
      return one.fault == "moment" && one.place == force.place;
    });
    Body body{&force, &*moment, {}, {0, static_cast<Index>(turns.size())}};
    for (const Turns& step : turns) body.turns.push_back(step[bodies.size()]);
    bodies.push_back(std::move(body));
  }
  return bodies;
}

/// The body of a force at a point, in the steps in which that acts.
Body FindBody(const std::vector<Turns>& turns, const std::vector<Candidate>& candidates,
              const ForceAtPoint& force) {
  const std::vector<Body> bodies = ListBodies(turns, candidates);
  Body body = *std::ranges::find(
      bodies, force.place, [](const Body& one) -> const auto& { return one.force->place; });
  body.within = force.within;
  return body;
}

Candidate MakeCandidate(const Body& body, const Vector3d& p) {
  Candidate candidate = *body.force;
  candidate.fault = kForceAtPoint;
  candidate.columns = body.AtPoint(p);
  candidate.parameters = 3;
  candidate.fitted = p;
  return candidate;
}

/// The point at which a force explains most of y.
class PointFit {
 public:
  PointFit(const VectorXd& y, const Body& body) : y_(&y), body_(&body) {
    MatrixXd both(y.size(), 6);
    both << body.force->columns, body.moment->columns;
    const VectorXd a = SolveLeastSquares(both, y);
    explains_ = 1.0 - (y - both * a).squaredNorm() / y.squaredNorm();
    F_ = a.head<3>();
    if (F_.squaredNorm() > 0.0)
      p_ = body.turns.front().transpose() * F_.cross(Vector3d(a.tail<3>())) / F_.squaredNorm();
  }

  /// By force and moment, of |y|^2.
  [[nodiscard]] double explains() const { return explains_; }

  /// From this force on.
  void Start(const ForceAtPoint& force) { F_ = force.force, p_ = force.point; }

  /// @param beside columns of what else there is. @return whether there is such a point.
  bool Improve(double reach, const MatrixXd& beside) {
    constexpr double kExact = 1e-10;  // m
    for (int i = 0; i < kMostIterations; ++i) {
      MatrixXd all(y_->size(), 6 + beside.cols());
      all << body_->AtPoint(p_), body_->ByPoint(F_), beside;
      const VectorXd a = SolveLeastSquares(all, *y_);
      F_ = a.head<3>();
      p_ += a.segment<3>(3);
      if (a.segment<3>(3).norm() < kExact) break;
    }
    return p_.norm() < reach;
  }

  [[nodiscard]] ForceAtPoint force() const { return {body_->force->place, F_, p_, body_->within}; }
  [[nodiscard]] Candidate Make() const { return MakeCandidate(*body_, p_); }

 private:
  const VectorXd* y_;
  const Body* body_;
  double explains_ = 0.0;
  Vector3d F_ = Vector3d::Zero(), p_ = Vector3d::Zero();
};

}  // namespace

void AddForcesAtPoints(const VectorXd& y, const std::vector<Turns>& turns, double reach,
                       std::vector<Candidate>* candidates) {
  const std::vector<Body> bodies = ListBodies(turns, *candidates);
  std::vector<PointFit> fits;
  fits.reserve(bodies.size());
  for (const Body& body : bodies) fits.emplace_back(y, body);
  std::stable_sort(fits.begin(), fits.end(),
                   [](const PointFit& a, const PointFit& b) { return a.explains() > b.explains(); });
  std::vector<Candidate> added;
  for (PointFit& fit : fits) {
    if (added.size() == kMostBodies || fit.explains() < kPointExplains || SearchLimit::IsOver()) break;
    if (fit.Improve(reach, MatrixXd(y.size(), 0))) added.push_back(fit.Make());
  }
  std::move(added.begin(), added.end(), std::back_inserter(*candidates));
}

Candidate MakeForceAtPoint(const ForceAtPoint& force, const std::vector<Turns>& turns,
                           const std::vector<Candidate>& candidates) {
  return MakeCandidate(FindBody(turns, candidates, force), force.point);
}

std::optional<ForceAtPoint> RefinePoint(const VectorXd& y, const std::vector<Turns>& turns, double reach,
                                        const ForceAtPoint& start, const MatrixXd& beside,
                                        const std::vector<Candidate>& candidates) {
  const Body body = FindBody(turns, candidates, start);
  PointFit fit(y, body);
  fit.Start(start);
  if (!fit.Improve(reach, beside)) return std::nullopt;
  return fit.force();
}

MatrixXd CalcCenterColumns(const std::string& place, const Vector3d& d, double more,
                           std::span<const Candidate> candidates) {
  const auto find = [&](const char* fault) -> const Candidate& {
    return *std::ranges::find_if(
        candidates, [&](const Candidate& one) { return one.fault == fault && one.place == place; });
  };
  const double nominal = find("mass").nominal, mass = nominal + more;
  const Vector3d m_d = mass * d, half = 0.5 * m_d;
  Eigen::Matrix<double, 6, 3> B;
  B.topRows<3>() = m_d.transpose().replicate<3, 1>();
  B.diagonal().setZero();
  B.bottomRows<3>() << -half[1], -half[0], 0.0, -half[2], 0.0, -half[0], 0.0, -half[2], -half[1];
  const MatrixXd& all = find(force_fault::kCenter).columns;
  return mass / nominal * all.leftCols<3>() + all.rightCols<6>() * B;
}

bool IsPossibleLoad(const VectorXd& amplitude, const VectorXd& error) {
  constexpr double kErrors = 3.0, kRelative = 1e-3;
  const Vector6d about = amplitude.tail<6>();
  const Matrix3d I =
      ToTensor(about) - CalcPointInertia(amplitude[0], Vector3d(amplitude.segment<3>(1) / amplitude[0]));
  // The largest principal moment is at most the sum of the others.
  const double largest = DecomposeSymmetric(I).values[2];
  return I.trace() - 2.0 * largest >= -kErrors * error.tail<6>().norm() - kRelative * about.norm();
}

}  // namespace dexcheck
