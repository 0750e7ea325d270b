#include "controller/grasp/grasp_force.h"

#include <cmath>
#include <string>

#include "controller/common/errors.h"
#include "controller/grasp/interior_point_kernel.h"

namespace dexcheck {
namespace {

constexpr int kLeastContacts = 3;

void RequireSize(Eigen::Index actual, Eigen::Index expected, const char* name) {
  if (actual == expected) return;
  Require(false, name, "size must be " + std::to_string(expected), actual);
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
  RequireSize(problem.G.cols(), 3 * n, "G columns");
  RequireSize(problem.f_min.size(), n, "f_min");
  RequireSize(problem.f_max.size(), n, "f_max");
  RequireFinite(problem.G, "G");
  RequireFinite(problem.F_o, "F_o");
  RequireFinite(problem.mu, "mu");
  RequireFinite(problem.f_min, "f_min");
  RequireFinite(problem.f_max, "f_max");
  for (Eigen::Index i = 0; i < n; ++i) {
    RequireEntry(problem.mu[i] > 0.0, "mu", i, "must be positive", problem.mu[i]);
    RequireEntry(problem.f_min[i] >= 0.0, "f_min", i, "must not be negative", problem.f_min[i]);
    RequireEntry(problem.f_max[i] > problem.f_min[i], "f_max", i, "must be above f_min", problem.f_max[i]);
  }
}

void RequireValid(const GraspForceOptions& options) {
  Require(options.barrier_weight > 0.0 && std::isfinite(options.barrier_weight), "barrier_weight",
          "must be positive and finite", options.barrier_weight);
  Require(options.slack_tolerance > 0.0, "slack_tolerance", "must be positive", options.slack_tolerance);
  Require(options.residual_tolerance > 0.0, "residual_tolerance", "must be positive",
          options.residual_tolerance);
  Require(options.max_iterations > 0, "max_iterations", "must be positive", options.max_iterations);
}

}  // namespace

GraspForceProblem::GraspForceProblem(int num_contacts) {
  Require(num_contacts >= kLeastContacts, "num_contacts", "at least 3 hard-finger contacts balance a wrench",
          num_contacts);
  const Eigen::Index num_forces = Eigen::Index{3} * num_contacts;
  G = Matrix6Xd::Zero(6, num_forces);
  F_o = Vector6d::Zero();
  mu = VectorXd::Constant(num_contacts, 0.5);
  f_min = VectorXd::Zero(num_contacts);
  f_max = VectorXd::Constant(num_contacts, 100.0);
}

GraspForceSolver::GraspForceSolver(int num_contacts, const GraspForceOptions& options) : options_(options) {
  RequireValid(options);
  result_.f_c = VectorXd::Zero(GraspForceProblem(num_contacts).G.cols());
  result_.y = VectorXd::Zero(6);
  kernel_ = std::make_unique<grasp_internal::InteriorPointKernel>(num_contacts);
}

GraspForceSolver::~GraspForceSolver() = default;
GraspForceSolver::GraspForceSolver(GraspForceSolver&&) noexcept = default;
GraspForceSolver& GraspForceSolver::operator=(GraspForceSolver&&) noexcept = default;

const GraspForceResult& GraspForceSolver::Solve(const GraspForceProblem& problem) {
  RequireSize(3 * problem.mu.size(), result_.f_c.size(), "problem: 3 N");
  RequireValid(problem);
  kernel_->Solve(problem, options_, result_);
  return result_;
}

void GraspForceSolver::Reset() { kernel_->Reset(); }

}  // namespace dexcheck
