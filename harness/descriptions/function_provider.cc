#include "harness/descriptions/function_provider.h"

#include "controller/common/errors.h"

namespace dexcheck {

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
