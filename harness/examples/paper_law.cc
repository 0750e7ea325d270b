// A controller of one's own as a shared library: the paper's law (55), written once more with dense matrices.
// It sends the torques of the built-in law to rounding. README.md says how it is compiled and run.

#include <Eigen/LU>
#include <memory>

#include "controller/control/controller_library.h"
#include "controller/grasp/grasp_force.h"

namespace {

using namespace dexcheck;  // NOLINT: an example

class PaperLaw final : public Controller {
 public:
  explicit PaperLaw(const ControllerContext& context)
      : options_(context.options),
        sampling_(context.sampling),
        model_(context.model, context.fingertips, context.object, context.surface, context.options),
        actuation_(context.model),
        problem_(static_cast<int>(context.fingertips.size())),
        solver_(static_cast<int>(context.fingertips.size()), context.options.force) {
    problem_.mu.setConstant(options_.mu);
    problem_.f_min.setConstant(options_.f_min);
    problem_.f_max.setConstant(options_.f_max);
  }

  void Follow(const Trajectory& motion) override { motion_ = &motion; }
  void Begin(double /*t*/, const Reading& /*reading*/) override {}
  [[nodiscard]] const GraspModel& model() const override { return model_; }

  void Step(const Reading& reading, double t, Command* command) override {
    model_.SetState(reading.state);
    const ModelTerms& robot = model_.robot();
    const GraspTerms& grasp = model_.grasp();
    const MatrixXd J = grasp.J_B();
    const MatrixXd G = grasp.G();
    const VectorXd xi = robot.velocity();
    const Vector6d V = grasp.V_Bo();
    command->desired = TrajectoryController::EvaluateDesired(*motion_, t, sampling_.time_step);
    const Vector6d V_dot =
        CalcTrackingAcceleration(options_.gains, options_.orientation, grasp, command->desired);
    VectorXd sigma_prime(xi.size());
    options_.posture.CalcAcceleration(reading.state.q, xi, sigma_prime);

    // (47)
    const MatrixXd J_plus = J.transpose() * (J * J.transpose()).inverse();
    const VectorXd xi_c = xi - J_plus * (J * xi - G.transpose() * V);
    const VectorXd xi_dot_d = J_plus * (grasp.G_dot().transpose() * V + G.transpose() * V_dot -
                                        grasp.J_B_dot() * xi_c - J * sigma_prime) +
                              sigma_prime;
    // (49): the grasp forces that hold F_o inside the friction cones
    problem_.G = G;
    problem_.F_o = grasp.body().M_hat * V_dot + grasp.body().C_hat * V + grasp.body().N_o;
    const GraspForceResult& result = solver_.Solve(problem_);
    RequireGraspForce(result);
    const VectorXd least = G.transpose() * (G * G.transpose()).inverse() * problem_.F_o;
    // (55)
    VectorXd force = robot.M() * xi_dot_d + robot.C() * xi_c + robot.gravity() + robot.friction() +
                     J.transpose() * result.f_c;
    command->tau.resize(xi.size());
    actuation_.CalcTorque(force, command->tau);
    // The checks of the law need this.
    command->demand.F_N = result.f_c - least;
    command->force_solves = 1;
  }

 private:
  GraspControllerOptions options_;
  Sampling sampling_;
  GraspModel model_;
  ActuationMap actuation_;
  GraspForceProblem problem_;
  GraspForceSolver solver_;
  const Trajectory* motion_ = nullptr;
};

std::unique_ptr<Controller> Make(const ControllerContext& context) {
  return std::make_unique<PaperLaw>(context);
}

}  // namespace

DEXCHECK_CONTROLLER(Make)
