#include "harness/run/detectability.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "controller/common/text.h"
#include "controller/contact/shapes.h"
#include "controller/control/computed_torque.h"
#include "controller/control/constrained_dynamics.h"
#include "controller/control/joint_controller.h"
#include "harness/checks/check_table.h"
#include "harness/engine/engine.h"
#include "harness/run/excitation.h"

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
  VectorXd tau, F_N;
  DesiredMotion desired;
  DesiredJoints joints;
  double scale = 1.0;         // |C_bar' xi + F_bar'|_M^-1
  double object_scale = 1.0;  // N
  double motion_compliance = 0.0,
         force_compliance = 0.0;  // what contacts that give are allowed above the bounds
  RowMatrixXd half_inverse;       // L^-T
  MatrixXd M;
};

/// What a model says at that instant.
struct Answer {
  VectorXd robot;          // left of (48)
  Vector6d object;         // left of (19)
  VectorXd xi_dot, f_c;    // predicted
  VectorXd law;            // E_bar' tau' of the law
  double condition = 1.0;  // number of J_B'
};

/// A model with all that a run makes of it.
class Asked {
 public:
  /// @throws InputError when there is no such robot.
  Asked(const Setup& setup, RobotModel robot)
      : robot_(std::move(robot)),
        surface_(robot_.object() ? MakeSurface(robot_.object()->shape) : nullptr),
        options_(setup.MakeControllerOptions()),
        grasp_(robot_, setup.fingertips(), robot_.object() ? robot_.object()->body : setup.object().body,
               surface_ ? *surface_ : setup.surface(), setup.MakeModelOptions()),
        dynamics_(robot_, static_cast<int>(setup.fingertips().size())),
        actuation_(robot_) {
    if (setup.joints() != nullptr) {
      joint_law_.emplace(robot_, setup.scenario().control.law, setup.joints()->gains);
    } else if (options_.law == ControlLaw::kComputedTorque) {
      law_.emplace(robot_, static_cast<int>(setup.fingertips().size()), options_.weight);
    }
  }

  [[nodiscard]] const GraspTerms& grasp() const { return grasp_.grasp(); }

  Answer Ask(const Sample& sample) {
    grasp_.SetState(sample.state);
    const ModelTerms& robot = grasp_.robot();
    const GraspTerms& grasp = grasp_.grasp();
    const ObjectBodyTerms& body = grasp.body();
    Answer answer;
    answer.robot = robot.M() * sample.xi_dot + robot.C() * sample.state.xi + robot.gravity() +
                   robot.friction() - Push(sample.tau);
    answer.object = body.M_hat * sample.V_Bo_dot + body.C_hat * grasp.V_Bo() + body.N_o;
    if (grasp.num_contacts() > 0) {
      answer.robot += grasp.J_B().transpose() * sample.f_c;
      answer.object -= grasp.G() * sample.f_c;
      const Prediction& prediction = dynamics_.Predict(robot, grasp, Push(sample.tau));
      answer.xi_dot = prediction.xi_dot;
      answer.f_c = prediction.f_c;
    } else {
      answer.xi_dot = dynamics_.PredictFree(robot, Push(sample.tau)).xi_dot;
    }
    if (joint_law_) {
      answer.law = Push(joint_law_->CalcTorque(robot, sample.state.q, sample.state.xi, sample.joints));
    } else if (law_) {
      VectorXd sigma_prime(robot.size());
      options_.posture.CalcAcceleration(sample.state.q, sample.state.xi, sigma_prime);
      law_->SetDemand(robot, grasp,
                      CalcTrackingAcceleration(options_.gains, options_.orientation, grasp, sample.desired),
                      sigma_prime);
      answer.law = Push(law_->CalcTorque(grasp, sample.F_N));
      answer.condition = CalcConditionNumber();
    }
    return answer;
  }

 private:
  /// E_bar' tau' (n).
  [[nodiscard]] VectorXd Push(const VectorXd& tau) const {
    VectorXd force(tau.size());
    actuation_.CalcForce(tau, force);
    return force;
  }
  /// As LawReference: sqrt(trace A) |A^-1/2| of A = J_B' W^-1 J_B'^T.
  [[nodiscard]] double CalcConditionNumber() const {
    const MatrixXd& J = grasp_.grasp().J_B();
    MatrixXd W_inv_J_T = J.transpose();
    if (options_.weight.kind == RedundancyWeight::Kind::kDiagonal) {
      W_inv_J_T = options_.weight.w.cwiseInverse().asDiagonal() * W_inv_J_T;
    } else if (options_.weight.kind == RedundancyWeight::Kind::kMass) {
      W_inv_J_T = grasp_.robot().M().llt().solve(W_inv_J_T);
    }
    const MatrixXd A = J * W_inv_J_T;
    return std::sqrt(A.trace() * A.llt().solve(MatrixXd::Identity(A.rows(), A.cols())).trace());
  }

  RobotModel robot_;
  std::unique_ptr<Surface> surface_;
  GraspControllerOptions options_;
  GraspModel grasp_;
  ConstrainedDynamics dynamics_;
  ActuationMap actuation_;
  std::optional<ComputedTorque> law_;
  std::optional<JointLaw> joint_law_;
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
        const StepAnalysis& analysis = runner.loop().checks().analysis();
        Sample& sample = samples.emplace_back();
        sample.state = step.reading.state;
        sample.xi_dot = step.response.xi_dot;
        sample.V_Bo_dot = step.response.V_Bo_dot;
        sample.f_c = step.findings.f_c;
        sample.tau = step.command.tau;
        sample.F_N = step.command.demand.F_N;
        sample.desired = step.command.desired;
        sample.joints = step.command.joints;
        sample.M = step.model->robot().M();
        const Eigen::Index n = sample.xi_dot.size();
        sample.half_inverse = RowMatrixXd::Identity(n, n);
        factor.Compute(sample.M);
        factor.SolveTransposedColumns(sample.half_inverse);
        sample.scale = analysis.balanced;
        sample.object_scale = std::max(weight, sample.f_c.norm());
        sample.motion_compliance = analysis.acceleration_compliance;
        sample.force_compliance = analysis.contact_force_compliance;
      },
      [] { return false; });
  if (!result.failure.empty()) throw InputError(setup.scenario().source + ": " + result.failure);
  return samples;
}

/// Makes `smallest` the error of which `bound` is left, where that is less; `left` of a whole unit of error.
void Lower(double bound, double left, double* smallest) {
  constexpr double kNothing = 1e-9;  // what rounding leaves
  if (left > kNothing) *smallest = std::min(*smallest, bound / left);
}

/// What is compared with the bounds of the questions.
struct Bounds {
  double robot, object, motion, force, law;
};

/// To first order, what an error that changes the answers so at one instant fails. @param fraction of a unit
/// of error that was made. @param arm m. @param left robot's residual, |.|_M^-1 relative.
void LowerAll(const Sample& sample, const Answer& right, const Answer& wrong, const Bounds& bounds,
              double fraction, double arm, Detectability* number, VectorXd* left) {
  *left = sample.half_inverse * (wrong.robot - right.robot) / (fraction * sample.scale);
  Lower(bounds.robot, left->norm(), &number->robot);
  const Vector6d wrench = wrong.object - right.object;
  Lower(bounds.object,
        std::max(wrench.head<3>().norm(), wrench.tail<3>().norm() / arm) / (fraction * sample.object_scale),
        &number->object);
  // |a|_M
  const VectorXd apart = wrong.xi_dot - right.xi_dot;
  const double motion = std::sqrt(std::max(0.0, apart.dot(sample.M * apart))) / (fraction * sample.scale);
  Lower(bounds.motion + sample.motion_compliance, motion, &number->prediction);
  if (right.f_c.size() > 0) {
    const double force = (wrong.f_c - right.f_c).norm() / (fraction * sample.f_c.norm());
    Lower(bounds.force + sample.force_compliance, force, &number->prediction);
  }
  if (right.law.size() == 0) return;
  const double torque = (sample.half_inverse * (wrong.law - right.law)).norm() / (fraction * sample.scale);
  Lower(bounds.law, torque / right.condition, &number->law);
}

}  // namespace

DetectabilityResult FindDetectability(const Setup& setup, int states,
                                      const std::function<bool(size_t done, size_t all)>& go_on) {
  if (setup.scenario().pick_task() != nullptr)
    throw InputError(setup.scenario().source + ": task: has no trajectory");
  const std::vector<Sample> samples = TakeSamples(setup, states);
  const RobotSpec& spec = setup.model().spec();
  const std::vector<Parameter> numbers = ListParameters(spec);
  Asked right(setup, setup.model());
  std::vector<Answer> answers;
  answers.reserve(samples.size());
  for (const Sample& sample : samples) answers.push_back(right.Ask(sample));
  const bool holds = right.grasp().num_contacts() > 0;
  const double arm = holds ? right.grasp().contacts()[0].geometry.g_o_cf.translation().norm() : 1.0;

  DetectabilityResult result;
  const auto bound = [&](const char* name) { return CalcBound(*FindCheck(name), setup.scenario()); };
  const Bounds bounds{bound("inverse_dynamics_robot"), bound("inverse_dynamics_object"),
                      bound("reduced_acceleration"), bound("contact_force"), bound("law_torque")};
  const auto rows = static_cast<Eigen::Index>(samples.size()) * setup.model().num_velocities();
  MatrixXd regressor = MatrixXd::Zero(rows, static_cast<Eigen::Index>(numbers.size()));
  for (size_t k = 0; k < numbers.size(); ++k) {
    if (!go_on(k, numbers.size())) break;
    double change = kStep * GetScale(spec, numbers[k]);
    std::optional<RobotModel> robot = TryChange(spec, numbers[k], &change);
    if (!robot) continue;
    Asked changed(setup, *std::move(robot));
    Detectability number{numbers[k], DescribePart(spec, numbers[k]) + ": " + DescribeQuantity(numbers[k]),
                         DescribeGroup(numbers[k])};
    VectorXd left;
    for (size_t i = 0; i < samples.size(); ++i) {
      LowerAll(samples[i], answers[i], changed.Ask(samples[i]), bounds, kStep, arm, &number, &left);
      const auto n = left.size();
      regressor.col(static_cast<Eigen::Index>(k)).segment(static_cast<Eigen::Index>(i) * n, n) = left;
    }
    result.numbers.push_back(std::move(number));
  }
  const VectorXd values = CalcSingularValues(regressor);
  result.rank = CountAbove(values, kRank * values[0]);
  result.largest_singular_value = values[0];
  if (result.rank > 0) result.smallest_singular_value = values[result.rank - 1];
  return result;
}

RetriedError RetryError(const Scenario& scenario, const std::filesystem::path& robot,
                        const std::filesystem::path& mjcf, const Parameter& parameter, double error,
                        const std::vector<std::string>& checks, const std::function<bool()>& should_stop) {
  constexpr int kDoublings = 2;
  RetriedError retried;
  for (int doubling = 0; doubling <= kDoublings; ++doubling) {
    retried = {error * std::exp2(doubling)};
    for (int seed = 1; seed <= kRetrySeeds && !should_stop(); ++seed) {
      Scenario varied = scenario;
      varied.seed = static_cast<std::uint64_t>(seed);
      try {
        const Setup right(varied, robot, mjcf);
        const Setup wrong(right.scenario(), ChangeNumber(right.model().spec(), parameter, retried.error),
                          mjcf, LoadMjcf(mjcf));
        Runner runner(wrong, /*check=*/true);
        const auto fails = [&] {
          return std::any_of(checks.begin(), checks.end(), [&](const std::string& name) {
            return runner.loop().checks().Has(name) && runner.loop().checks().Find(name).failed;
          });
        };
        runner.Run([](const StepRecord&) {}, [&] { return should_stop() || fails(); });
        ++retried.runs;
        retried.found += fails() ? 1 : 0;
      } catch (const InputError&) {
        continue;
      }
    }
    if (retried.found == retried.runs || error == 0.0) break;
  }
  return retried;
}

}  // namespace dexcheck
