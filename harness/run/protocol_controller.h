#pragma once

// A controller of the user's own by controller/control/controller_protocol.h: a program, or a library in C.

#include <memory>
#include <optional>
#include <vector>

#include "controller/control/controller.h"
#include "controller/control/joint_controller.h"
#include "harness/run/controller_peers.h"

namespace dexcheck {

/// Exchanges request and reply at each control step; torques are held in between. Nothing allocates there.
class ProtocolController final : public Controller {
 public:
  /// Greets the other side and gives it its parameters.
  /// @throws InputError when it does not take them; else as ControllerPeer.
  ProtocolController(std::unique_ptr<ControllerPeer> peer, const OwnControllerSetup& setup);

  void Follow(const Trajectory& motion) override {
    motion_ = &motion;
    steps_until_due_ = 0;
  }
  void Begin(double t, const Reading& reading) override;
  void Step(const Reading& reading, double t, Command* command) override;
  [[nodiscard]] const GraspModel& model() const override { return model_; }

 private:
  void Greet();
  void FillRequest(const Reading& reading, double t, const Command& command);

  OwnControllerSetup setup_;
  std::unique_ptr<ControllerPeer> peer_;
  GraspModel model_;
  VectorXd sigma_prime_;                            // n
  Matrix2d wheels_inverse_ = Matrix2d::Identity();  // inverse of the wheels' block of E_bar'
  const Trajectory* motion_ = nullptr;
  std::optional<JointDemand> joints_;
  bool wants_terms_ = false;
  long steps_until_due_ = 0;
  std::vector<double> request_;  // the message, with one double before it for the header
  size_t filled_ = 0;
  std::vector<double> torques_;  // n, and 3 N of F_N where it is reported
};

}  // namespace dexcheck
