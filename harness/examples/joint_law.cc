// A controller of one's own for an arm that holds nothing: computed torque for its joints, in a few lines. It
// sends the torques of the built-in law to rounding. README.md says how it is compiled and run.

#include <memory>
#include <stdexcept>

#include "controller/control/controller_library.h"

namespace {

using namespace dexcheck;  // NOLINT: an example

class JointComputedTorque final : public Controller {
 public:
  explicit JointComputedTorque(const ControllerContext& context)
      : gains_(*context.joint_gains),
        model_(context.model, context.fingertips, context.object, context.surface, context.options) {
    // A number of its own, which a run or a study may set: controller.natural_frequency, rad/s.
    const double omega = context.parameters->Get("natural_frequency", 0.0);
    if (omega > 0.0) {
      gains_.K_p.setConstant(omega * omega);
      gains_.K_v.setConstant(2.0 * omega);
    }
  }

  void Follow(const Trajectory& /*motion*/) override {}
  void Begin(double /*t*/, const Reading& /*reading*/) override {}
  [[nodiscard]] const GraspModel& model() const override { return model_; }

  void Step(const Reading& reading, double /*t*/, Command* command) override {
    model_.SetState(reading.state);
    const ModelTerms& robot = model_.robot();
    const VectorXd e = command->joints.q - reading.state.q;
    const VectorXd e_dot = command->joints.q_dot - reading.state.xi;
    // (18) with q_ddot = q_d_ddot + K_v e_dot + K_p e
    const VectorXd q_ddot =
        command->joints.q_ddot + gains_.K_v.cwiseProduct(e_dot) + gains_.K_p.cwiseProduct(e);
    command->tau = robot.M() * q_ddot + robot.C() * reading.state.xi + robot.gravity() + robot.friction();
  }

 private:
  JointGains gains_;
  GraspModel model_;
};

std::unique_ptr<Controller> Make(const ControllerContext& context) {
  if (context.joint_gains == nullptr) throw std::invalid_argument("this law is for a [joint_motion]");
  return std::make_unique<JointComputedTorque>(context);
}

}  // namespace

DEXCHECK_CONTROLLER(Make)
