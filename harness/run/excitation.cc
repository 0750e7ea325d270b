#include "harness/run/excitation.h"

#include <cmath>
#include <limits>
#include <optional>

#include "controller/common/linear_algebra.h"
#include "controller/dynamics/model_terms.h"
#include "harness/diagnosis/parameters.h"

namespace dexcheck {
namespace {

// Of a number's size: forces are linear in all but centres of mass, and rounding of theirs, 1e-15, stays at
// 1e-9.
constexpr double kDifference = 1e-6;

/// What the robot's motion takes, M_bar' xi_dot + C_bar' xi + F_bar' (n).
VectorXd CalcForce(const MotionSample& sample, ModelTerms* terms) {
  terms->SetState(sample.q, sample.xi);
  terms->CalcDynamics();
  return terms->M() * sample.xi_dot + terms->C() * sample.xi + terms->gravity() + terms->friction();
}

}  // namespace

MotionSample TakeMotionSample(const StepRecord& step, TreeFactor* factor) {
  const ModelTerms& robot = step.true_model->robot();
  factor->Compute(robot.M());
  const VectorXd balanced = robot.C() * step.reading.state.xi + robot.gravity() + robot.friction();
  MotionSample sample{step.reading.state.q, step.reading.state.xi, step.response.xi_dot, {}};
  const Eigen::Index n = sample.xi.size();
  sample.half_inverse = RowMatrixXd::Identity(n, n);
  factor->SolveTransposedColumns(sample.half_inverse);
  VectorXd work;
  sample.half_inverse /= std::max(factor->CalcForceNorm(balanced, &work), std::numeric_limits<double>::min());
  return sample;
}

VectorXd CalcSingularValues(const RobotSpec& robot, const std::vector<MotionSample>& samples) {
  if (samples.empty()) return {};
  std::vector<Parameter> numbers;
  for (const Parameter& number : ListParameters(robot)) {
    if (IsDynamic(number.kind)) numbers.push_back(number);
  }
  const RobotModel right(robot);
  ModelTerms terms(right);
  std::vector<VectorXd> forces;
  forces.reserve(samples.size());
  for (const MotionSample& sample : samples) forces.push_back(CalcForce(sample, &terms));

  const Eigen::Index n = samples[0].xi.size();
  MatrixXd W = MatrixXd::Zero(n * static_cast<Eigen::Index>(samples.size()),
                              static_cast<Eigen::Index>(numbers.size()));
  for (size_t k = 0; k < numbers.size(); ++k) {
    const double size = GetScale(robot, numbers[k]);
    double change = kDifference * size;
    const std::optional<RobotModel> changed = TryChange(robot, numbers[k], &change);
    if (!changed) continue;
    ModelTerms wrong(*changed);
    for (size_t i = 0; i < samples.size(); ++i) {
      W.col(static_cast<Eigen::Index>(k)).segment(static_cast<Eigen::Index>(i) * n, n).noalias() =
          samples[i].half_inverse * (CalcForce(samples[i], &wrong) - forces[i]) * (size / change);
    }
  }
  W /= std::sqrt(static_cast<double>(samples.size()));
  return CalcSingularValues(W);
}

VectorXd CalcSingularValues(const MatrixXd& W) {
  return CalcSymmetricEigenvalues(W.transpose() * W).reverse().cwiseMax(0.0).cwiseSqrt();
}

int CountAbove(const VectorXd& singular_values, double floor) {
  return static_cast<int>((singular_values.array() > floor).count());
}

}  // namespace dexcheck
