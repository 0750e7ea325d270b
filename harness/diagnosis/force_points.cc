#include "harness/diagnosis/force_points.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "controller/common/linear_algebra.h"
#include "harness/diagnosis/search_limit.h"
#include "harness/diagnosis/step_forces.h"

namespace dexcheck {
namespace {

using Eigen::Index;
using namespace force_fault;

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

std::vector<Body> ListBodies(const std::vector<Turns>& turns, std::span<const Candidate> candidates) {
  std::vector<Body> bodies;
  for (const Candidate& force : candidates) {
    if (force.fault != kForce) continue;
    Body body{&force, &FindCandidate(candidates, "moment", force.place), {}, {0, std::ssize(turns)}};
    for (const Turns& step : turns) body.turns.push_back(step[bodies.size()]);
    bodies.push_back(std::move(body));
  }
  return bodies;
}

/// The body of a force at a point, in the steps in which that acts.
Body FindBody(const std::vector<Turns>& turns, std::span<const Candidate> candidates,
              const std::string& place, const StepRange& within) {
  const std::vector<Body> bodies = ListBodies(turns, candidates);
  Body body = *std::ranges::find(
      bodies, place, [](const Body& one) -> const auto& { return one.force->place; });
  body.within = within;
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

/// Moves a force and its point to where they explain most of y. @param beside columns of what else there is.
/// @return none where there is no such point.
std::optional<Candidate> Improve(const VectorXd& y, const Body& body, Vector3d force, Vector3d point,
                                 double reach, const MatrixXd& beside) {
  constexpr int kMostIterations = 30;  // of Gauss-Newton
  constexpr double kExact = 1e-10;     // m
  for (int i = 0; i < kMostIterations; ++i) {
    MatrixXd all(y.size(), 6 + beside.cols());
    all << body.AtPoint(point), body.ByPoint(force), beside;
    const VectorXd a = SolveLeastSquares(all, y);
    force = a.head<3>();
    point += a.segment<3>(3);
    if (a.segment<3>(3).norm() < kExact) break;
  }
  return point.norm() < reach ? std::optional(MakeCandidate(body, point)) : std::nullopt;
}

}  // namespace

const Candidate& FindCandidate(std::span<const Candidate> candidates, std::string_view fault,
                               std::string_view place) {
  return *std::ranges::find_if(
      candidates, [&](const Candidate& one) { return one.fault == fault && one.place == place; });
}

Vector3d CalcArm(const Eigen::Ref<const VectorXd>& wrench) {
  const Vector3d force = wrench.head<3>(), moment = wrench.tail<3>();
  return force.cross(moment) / force.squaredNorm();
}

void AddForcesAtPoints(const VectorXd& y, const std::vector<Turns>& turns, double reach,
                       std::vector<Candidate>* candidates) {
  constexpr size_t kMostBodies = 8;       // that are looked at
  constexpr double kPointExplains = 0.9;  // of |y|^2, by force and moment
  const std::vector<Body> bodies = ListBodies(turns, *candidates);
  std::vector<std::pair<double, size_t>> ranked;  // by the square of the rest of y
  std::vector<VectorXd> wrenches;
  for (const Body& body : bodies) {
    MatrixXd both(y.size(), 6);
    both << body.force->columns, body.moment->columns;
    wrenches.push_back(SolveLeastSquares(both, y));
    ranked.emplace_back((y - both * wrenches.back()).squaredNorm(), ranked.size());
  }
  std::ranges::sort(ranked);
  std::vector<Candidate> added;
  for (const auto& [left, index] : ranked) {
    const Body& body = bodies[index];
    const Vector3d force = wrenches[index].head<3>();
    if (added.size() == kMostBodies || left > (1.0 - kPointExplains) * y.squaredNorm() ||
        SearchLimit::IsOver())
      break;
    if (force.isZero(0.0)) continue;
    const Vector3d start = body.turns.front().transpose() * CalcArm(wrenches[index]);
    if (auto found = Improve(y, body, force, start, reach, MatrixXd(y.size(), 0)))
      added.push_back(*std::move(found));
  }
  std::ranges::move(added, std::back_inserter(*candidates));
}

std::optional<Candidate> MakeForceOfWrench(const std::string& place, const VectorXd& wrench,
                                           const StepRange& within, Eigen::Index step, double reach,
                                           const std::vector<Turns>& turns,
                                           std::span<const Candidate> candidates) {
  if (wrench.head<3>().isZero(0.0)) return std::nullopt;
  const Body body = FindBody(turns, candidates, place, within);
  const Vector3d point = body.turns[static_cast<size_t>(step)].transpose() * CalcArm(wrench);
  if (!(point.norm() < reach)) return std::nullopt;
  return MakeCandidate(body, point);
}

std::optional<Candidate> RefinePoint(const VectorXd& y, const std::vector<Turns>& turns, double reach,
                                     const Candidate& one, const VectorXd& force, const StepRange& within,
                                     const MatrixXd& beside, std::span<const Candidate> candidates) {
  return Improve(y, FindBody(turns, candidates, one.place, within), force, one.fitted, reach, beside);
}

MatrixXd CalcCenterColumns(const std::string& place, const Vector3d& d, double more,
                           std::span<const Candidate> candidates) {
  const double nominal = FindCandidate(candidates, "mass", place).nominal, mass = nominal + more;
  const Vector3d m_d = mass * d, half = 0.5 * m_d;
  Eigen::Matrix<double, 6, 3> B;
  B.topRows<3>() = m_d.transpose().replicate<3, 1>();
  B.diagonal().setZero();
  B.bottomRows<3>() << -half[1], -half[0], 0.0, -half[2], 0.0, -half[0], 0.0, -half[2], -half[1];
  const MatrixXd& all = FindCandidate(candidates, kCenter, place).columns;
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
