#include "harness/run/detectability.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "controller/common/text.h"
#include "controller/contact/object_surface.h"

namespace dexcheck {
namespace {

// Of a number's size: large against rounding of the terms, 1e-13, small enough that terms are linear in it.
constexpr double kStep = 1e-6;
// Singular values below this, of the largest, are what rounding and the step above leave of zero.
constexpr double kRank = 1e-7;

/// What a run had at one instant.
struct Sample {
  MeasuredState state;
  VectorXd xi_dot, f_c;
  Vector6d V_Bo_dot;
  double scale = 1.0;         // |C_bar' xi + F_bar'|_M^-1
  double object_scale = 1.0;  // N
  RowMatrixXd half_inverse;   // L^-T
};

/// What is left of (48) and (19).
struct Residual {
  VectorXd robot;
  Vector6d object;
};

Residual CalcResidual(GraspModel* model, const Sample& sample) {
  model->SetState(sample.state);
  const ModelTerms& robot = model->robot();
  const GraspTerms& grasp = model->grasp();
  const ObjectBodyTerms& body = grasp.body();
  return {robot.M() * sample.xi_dot + robot.C() * sample.state.xi + robot.gravity() + robot.friction() +
              grasp.J_B().transpose() * sample.f_c,
          body.M_hat * sample.V_Bo_dot + body.C_hat * grasp.V_Bo() + body.N_o - grasp.G() * sample.f_c};
}

/// A model with its own grasp.
struct ChangedModel {
  /// @throws InputError when there is no such robot.
  ChangedModel(const Setup& setup, RobotSpec spec)
      : robot(std::move(spec)),
        surface(MakeSurface(robot.object()->shape)),
        grasp(robot, setup.fingertips(), robot.object()->body, *surface, setup.MakeControllerOptions()) {}
  RobotModel robot;
  std::unique_ptr<Surface> surface;
  GraspModel grasp;
};

std::vector<Sample> TakeSamples(const Setup& setup, int states) {
  std::vector<Sample> samples;
  Runner runner(setup, /*check=*/true);
  const long every = std::max(1L, runner.loop().num_steps() / states);
  TreeFactor factor(setup.model());
  const double weight = setup.object().body.mass * setup.model().gravity().norm();
  const RunResult& result = runner.Run(
      [&](const StepRecord& step) {
        if (step.step % every != 0) return;
        Sample& sample = samples.emplace_back();
        sample.state = step.reading.state;
        sample.xi_dot = step.response.xi_dot;
        sample.V_Bo_dot = step.response.V_Bo_dot;
        sample.f_c = step.findings.f_c;
        const ModelTerms& robot = step.model->robot();
        factor.Compute(robot.M());
        const Eigen::Index n = sample.xi_dot.size();
        sample.half_inverse = RowMatrixXd::Identity(n, n);
        factor.SolveTransposedColumns(sample.half_inverse);
        sample.scale =
            (sample.half_inverse * (robot.C() * sample.state.xi + robot.gravity() + robot.friction())).norm();
        sample.object_scale = std::max(weight, sample.f_c.norm());
      },
      [] { return false; });
  if (!result.failure.empty()) throw InputError(setup.scenario().source + ": " + result.failure);
  return samples;
}

/// Bound over what a whole unit of error leaves; infinity where that is rounding.
double SmallestError(double bound, double left) {
  constexpr double kNothing = 1e-9;
  return left > kNothing ? bound / left : std::numeric_limits<double>::infinity();
}

}  // namespace

DetectabilityResult FindDetectability(const Setup& setup, int states,
                                      const std::function<bool(size_t done, size_t all)>& go_on) {
  if (setup.scenario().task) throw InputError(setup.scenario().source + ": task: has no trajectory");
  const std::vector<Sample> samples = TakeSamples(setup, states);
  const RobotSpec& spec = setup.model().spec();
  const std::vector<Parameter> numbers = ListParameters(spec);
  GraspModel right(setup.model(), setup.fingertips(), setup.object().body, setup.surface(),
                   setup.MakeControllerOptions());
  std::vector<Residual> residuals;
  for (const Sample& sample : samples) residuals.push_back(CalcResidual(&right, sample));
  const double arm = right.grasp().contacts()[0].geometry.g_o_cf.translation().norm();

  DetectabilityResult result;
  const auto bound = [](StepCheck which) { return kStepChecks[static_cast<size_t>(which)].bound; };
  const auto rows = static_cast<Eigen::Index>(samples.size()) * setup.model().num_velocities();
  MatrixXd regressor = MatrixXd::Zero(rows, static_cast<Eigen::Index>(numbers.size()));
  for (size_t k = 0; k < numbers.size(); ++k) {
    if (!go_on(k, numbers.size())) break;
    const double value = GetValue(spec, numbers[k]);
    double change = kStep * GetScale(spec, numbers[k]);
    std::unique_ptr<ChangedModel> changed;
    for (int side = 0; side < 2 && !changed; ++side) {
      RobotSpec wrong = spec;
      SetValue(&wrong, numbers[k], value + change);
      try {
        changed = std::make_unique<ChangedModel>(setup, std::move(wrong));
      } catch (const InputError&) {
        change = -change;
      }
    }
    if (!changed) continue;
    double robot = 0.0, object = 0.0;
    for (size_t i = 0; i < samples.size(); ++i) {
      const Sample& sample = samples[i];
      const Residual residual = CalcResidual(&changed->grasp, sample);
      const VectorXd left =
          sample.half_inverse * (residual.robot - residuals[i].robot) / (kStep * sample.scale);
      const auto n = left.size();
      regressor.col(static_cast<Eigen::Index>(k)).segment(static_cast<Eigen::Index>(i) * n, n) = left;
      robot = std::max(robot, left.norm());
      const Vector6d wrench = residual.object - residuals[i].object;
      object = std::max(object, std::max(wrench.head<3>().norm(), wrench.tail<3>().norm() / arm) /
                                    (kStep * sample.object_scale));
    }
    result.numbers.push_back({DescribePart(spec, numbers[k]) + ": " + DescribeQuantity(numbers[k]),
                              DescribeGroup(numbers[k]),
                              SmallestError(bound(StepCheck::kBalanceRobot), robot),
                              SmallestError(bound(StepCheck::kBalanceObject), object)});
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(regressor.transpose() * regressor,
                                                      Eigen::EigenvaluesOnly);
  const double largest = std::sqrt(std::max(0.0, eigen.eigenvalues().maxCoeff()));
  result.largest_singular_value = largest;
  for (Eigen::Index i = eigen.eigenvalues().size() - 1; i >= 0; --i) {
    const double value = std::sqrt(std::max(0.0, eigen.eigenvalues()[i]));
    if (!(value > kRank * largest)) break;
    result.smallest_singular_value = value;
    ++result.rank;
  }
  return result;
}

}  // namespace dexcheck
