#include "harness/descriptions/term_results.h"

#include "controller/common/errors.h"

namespace dexcheck {

Eigen::Map<const MatrixXd> TermResults::Find(Term term) const {
  const auto find = [](const auto& values) {
    return Eigen::Map<const MatrixXd>(values.data(), values.rows(), values.cols());
  };
  const auto find_number = [](const std::optional<double>& value) {
    return Eigen::Map<const MatrixXd>(value ? &*value : nullptr, value ? 1 : 0, value ? 1 : 0);
  };
  switch (term) {
    case Term::kMBar:
      return find(M);
    case Term::kCBarXi:
      return find(coriolis);
    case Term::kGravity:
      return find(gravity);
    case Term::kBias:
      return find(bias);
    case Term::kFriction:
      return find(friction);
    case Term::kKineticEnergy:
      return find_number(kinetic);
    case Term::kPotentialEnergy:
      return find_number(potential);
    default:
      return find_number(std::nullopt);
  }
}

void FunctionProvider::CheckSize(const char* term, Eigen::Index rows, Eigen::Index cols,
                                 Eigen::Index expected_cols) const {
  if (rows == size_ && cols == expected_cols) return;
  const auto describe = [](Eigen::Index r, Eigen::Index c) {
    return std::to_string(r) + (c == 1 ? " entries" : " x " + std::to_string(c) + " entries");
  };
  throw InputError(functions_.name + ": " + term + ": must have " + describe(size_, expected_cols) +
                   ", got " + describe(rows, cols));
}

TermResults FunctionProvider::Evaluate(long, const VectorXd& q, const VectorXd& xi) {
  TermResults terms;
  if (functions_.M) {
    terms.M = functions_.M(q);
    CheckSize("M", terms.M.rows(), terms.M.cols(), size_);
  }
  const auto take = [&](const char* name, VectorXd values, VectorXd* term) {
    CheckSize(name, values.rows(), 1, 1);
    *term = std::move(values);
  };
  if (functions_.c) take("c", functions_.c(q, xi), &terms.coriolis);
  if (functions_.g) take("g", functions_.g(q), &terms.gravity);
  if (functions_.friction) take("friction", functions_.friction(q, xi), &terms.friction);
  if (functions_.h) take("h", functions_.h(q, xi), &terms.bias);
  terms.AddBias();
  return terms;
}

}  // namespace dexcheck
