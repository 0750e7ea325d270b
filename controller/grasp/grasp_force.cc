#include "controller/grasp/grasp_force.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <string>

#include "controller/common/errors.h"
#include "controller/grasp/grasp_force_kernel.h"
#include "controller/grasp/grasp_rank.h"

namespace dexcheck {
namespace {

constexpr int kLeastContacts = 3;

void RequireSize(Eigen::Index actual, Eigen::Index expected, const char* name) {
  if (actual == expected) return;
  Require(false, name, "size must be " + std::to_string(expected), static_cast<double>(actual));
}

template <class Derived>
void RequireFinite(const Eigen::PlainObjectBase<Derived>& values, const char* name) {
  // v - v is zero for a finite v, else NaN.
  if ((values.derived() - values.derived()).sum() == 0.0) return;
  for (Eigen::Index col = 0; col < values.cols(); ++col) {
    for (Eigen::Index row = 0; row < values.rows(); ++row) {
      if (std::isfinite(values(row, col))) continue;
      const std::string entry = "(" + std::to_string(row) + ", " + std::to_string(col) + ")";
      Require(false, name + entry, "must be finite", values(row, col));
    }
  }
}

void RequireEntry(bool condition, const char* name, Eigen::Index i, const char* requirement, double value) {
  if (condition) return;
  Require(false, std::string(name) + "[" + std::to_string(i) + "]", requirement, value);
}

void RequireValid(const GraspForceProblem& problem) {
  const Eigen::Index n = problem.mu.size();
  const Eigen::Index m = problem.A.rows();
  RequireSize(problem.G.cols(), 3 * n, "G columns");
  RequireSize(problem.f_min.size(), n, "f_min");
  RequireSize(problem.f_max.size(), n, "f_max");
  RequireSize(problem.weight.size(), n, "weight");
  RequireSize(problem.A.cols(), 3 * n, "A columns");
  RequireSize(problem.a_min.size(), m, "a_min");
  RequireSize(problem.a_max.size(), m, "a_max");
  RequireFinite(problem.G, "G");
  RequireFinite(problem.F_o, "F_o");
  RequireFinite(problem.mu, "mu");
  RequireFinite(problem.f_min, "f_min");
  RequireFinite(problem.f_max, "f_max");
  RequireFinite(problem.weight, "weight");
  RequireFinite(problem.A, "A");
  RequireFinite(problem.a_min, "a_min");
  RequireFinite(problem.a_max, "a_max");
  for (Eigen::Index i = 0; i < n; ++i) {
    RequireEntry(problem.mu[i] > 0.0, "mu", i, "must be positive", problem.mu[i]);
    RequireEntry(problem.f_min[i] >= 0.0, "f_min", i, "must not be negative", problem.f_min[i]);
    RequireEntry(problem.f_max[i] > problem.f_min[i], "f_max", i, "must be above f_min", problem.f_max[i]);
    RequireEntry(problem.weight[i] >= 0.0, "weight", i, "must not be negative", problem.weight[i]);
  }
  for (Eigen::Index j = 0; j < m; ++j) {
    RequireEntry(problem.a_max[j] > problem.a_min[j], "a_max", j, "must be above a_min", problem.a_max[j]);
  }
}

void RequireValid(const GraspForceOptions& options) {
  Require(options.barrier_weight > 0.0 && std::isfinite(options.barrier_weight), "barrier_weight",
          "must be positive and finite", options.barrier_weight);
  Require(options.gap_tolerance > 0.0, "gap_tolerance", "must be positive", options.gap_tolerance);
  Require(options.slack_tolerance > 0.0, "slack_tolerance", "must be positive", options.slack_tolerance);
  Require(options.residual_tolerance > 0.0, "residual_tolerance", "must be positive",
          options.residual_tolerance);
  Require(options.max_iterations > 0, "max_iterations", "must be positive", options.max_iterations);
}

// max of g^T f over the friction cone between its bounds: max(f_min h, f_max h), h = g3 + mu |(g1, g2)|.
double CalcSupport(const Vector3d& g, double mu, double f_min, double f_max) {
  const double h = g.z() + mu * std::hypot(g.x(), g.y());
  return std::max(f_min * h, f_max * h);
}

double CalcBound(const GraspForceProblem& problem, const Eigen::Ref<const VectorXd>& y,
                 double weight_factor) {
  RequireSize(y.size(), 6 + problem.num_limits(), "y");
  double bound = problem.F_o.dot(y.head<6>());
  for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) {
    Vector3d g = problem.G.middleCols<3>(3 * i).transpose() * y.head<6>();
    g += problem.A.middleCols<3>(3 * i).transpose() * y.tail(problem.num_limits());
    g.z() -= weight_factor * problem.weight[i];
    bound -= CalcSupport(g, problem.mu[i], problem.f_min[i], problem.f_max[i]);
  }
  for (Eigen::Index j = 0; j < problem.num_limits(); ++j) {
    bound += std::min(y[6 + j] * problem.a_min[j], y[6 + j] * problem.a_max[j]);
  }
  return bound;
}

}  // namespace

GraspForceProblem::GraspForceProblem(int num_contacts, int num_limits) {
  Require(num_contacts >= kLeastContacts, "num_contacts", "at least 3 hard-finger contacts balance a wrench",
          num_contacts);
  Require(num_limits >= 0, "num_limits", "must not be negative", num_limits);
  const Eigen::Index num_forces = Eigen::Index{3} * num_contacts;
  G = Matrix6Xd::Zero(6, num_forces);
  F_o = Vector6d::Zero();
  mu = VectorXd::Constant(num_contacts, 0.5);
  f_min = VectorXd::Zero(num_contacts);
  f_max = VectorXd::Constant(num_contacts, 100.0);
  weight = VectorXd::Ones(num_contacts);
  A = MatrixXd::Zero(num_limits, num_forces);
  a_min = VectorXd::Zero(num_limits);
  a_max = VectorXd::Zero(num_limits);
}

void GraspForceProblem::SetTorqueLimits(const Eigen::Ref<const MatrixXd>& J,
                                        const Eigen::Ref<const VectorXd>& tau_0,
                                        const Eigen::Ref<const VectorXd>& tau_min,
                                        const Eigen::Ref<const VectorXd>& tau_max) {
  RequireSize(J.rows(), A.cols(), "J rows");
  RequireSize(J.cols(), A.rows(), "J columns");
  RequireSize(tau_0.size(), A.rows(), "tau_0");
  RequireSize(tau_min.size(), A.rows(), "tau_min");
  RequireSize(tau_max.size(), A.rows(), "tau_max");
  A = J.transpose();
  a_min = tau_min - tau_0;
  a_max = tau_max - tau_0;
}

double CalcGraspForceBound(const GraspForceProblem& problem, const Eigen::Ref<const VectorXd>& y) {
  return CalcBound(problem, y, 1.0);
}

double CalcInfeasibility(const GraspForceProblem& problem, const Eigen::Ref<const VectorXd>& y) {
  return CalcBound(problem, y, 0.0);
}

VectorXd CalcInternalForce(const Eigen::Ref<const Matrix6Xd>& G, const Eigen::Ref<const Vector6d>& F_o,
                           const Eigen::Ref<const VectorXd>& f_c) {
  RequireSize(f_c.size(), G.cols(), "f_c");
  grasp_internal::RequireFullRank(G);
  const Matrix6d GGt = G * G.transpose();
  return f_c - G.transpose() * Eigen::LDLT<Matrix6d>(GGt).solve(F_o);
}

double CalcLeastConeMargin(const Eigen::Ref<const VectorXd>& f_c, const Eigen::Ref<const VectorXd>& mu) {
  RequireSize(f_c.size(), 3 * mu.size(), "f_c");
  double margin = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < mu.size(); ++i) {
    margin = std::min(margin, mu[i] * f_c[3 * i + 2] - std::hypot(f_c[3 * i], f_c[3 * i + 1]));
  }
  return margin;
}

GraspForceSolver::GraspForceSolver(int num_contacts, int num_limits, const GraspForceOptions& options)
    : options_(options) {
  RequireValid(options);
  const GraspForceProblem sizes(num_contacts, num_limits);
  result_.f_c = VectorXd::Zero(sizes.G.cols());
  result_.y = VectorXd::Zero(6 + num_limits);
  kernel_ = grasp_internal::MakeGraspForceKernel(num_contacts, num_limits);
}

GraspForceSolver::~GraspForceSolver() = default;
GraspForceSolver::GraspForceSolver(GraspForceSolver&&) noexcept = default;
GraspForceSolver& GraspForceSolver::operator=(GraspForceSolver&&) noexcept = default;

const GraspForceResult& GraspForceSolver::Solve(const GraspForceProblem& problem) {
  RequireSize(3 * problem.mu.size(), result_.f_c.size(), "problem: 3 N");
  RequireSize(6 + problem.num_limits(), result_.y.size(), "problem: 6 + M");
  RequireValid(problem);
  kernel_->Solve(problem, options_, result_);
  return result_;
}

void GraspForceSolver::Reset() { kernel_->Reset(); }

}  // namespace dexcheck
