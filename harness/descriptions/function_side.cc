#include "harness/descriptions/function_side.h"

#include <memory>

#include "controller/common/errors.h"
#include "harness/descriptions/answers_comparison.h"
#include "harness/descriptions/read_description.h"

namespace dexcheck {

void FunctionSide::CheckSize(const char* term, Eigen::Index rows, Eigen::Index cols,
                             Eigen::Index expected_cols) const {
  if (rows == size_ && cols == expected_cols) return;
  const auto describe = [](Eigen::Index r, Eigen::Index c) {
    return std::to_string(r) + (c == 1 ? " entries" : " x " + std::to_string(c) + " entries");
  };
  throw InputError(functions_.name + ": " + term + ": must have " + describe(size_, expected_cols) +
                   ", got " + describe(rows, cols));
}

SideTerms FunctionSide::Evaluate(long, const VectorXd& q, const VectorXd& xi) {
  SideTerms terms;
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
  if (functions_.h) {
    take("h", functions_.h(q, xi), &terms.bias);
  } else if (functions_.c && functions_.g) {
    terms.bias = terms.coriolis + terms.gravity;
  }
  return terms;
}

Comparison CompareFunctions(const std::filesystem::path& file, const TermFunctions& functions,
                            const UrdfOptions& urdf, const ConsistencyOptions& options) {
  if (!functions.M && !functions.c && !functions.g && !functions.h && !functions.friction) {
    throw InputError(functions.name + ": must have one of M, c, g, h, friction");
  }
  const RobotDescription robot = ReadDescription(file, urdf);
  Comparison comparison;
  comparison.first = file;
  comparison.second = functions.name;
  comparison.model.emplace(robot.spec);
  comparison.notes = robot.notes;
  const std::unique_ptr<TermSide> reference = MakeReferenceSide(robot, file.string());
  FunctionSide side(functions, comparison.model->num_velocities());
  SideComparison terms(robot, {reference.get(), &side});
  comparison.result.samples = CompareAtStates(
      FeedRandomStates(*comparison.model, options), [](long) { return true; }, &terms);
  comparison.result.terms = terms.TakePairs().front().terms;
  return comparison;
}

}  // namespace dexcheck
