#pragma once

// A controller of the user's own as a program, by controller/control/controller_protocol.h.

#include <optional>
#include <string>
#include <vector>

#include "controller/control/controller.h"
#include "controller/control/joint_controller.h"
#include "harness/base/child_process.h"
#include "harness/run/own_controller.h"

namespace dexcheck {

/// Runs the program, with a request and an answer at each step. A program that ends, is killed, is late or
/// sends another message ends the run, in one line. Nothing allocates in a step.
class ProgramController final : public Controller {
 public:
  /// Starts the program and greets it.
  /// @param command for the shell. @throws InputError when it cannot be started; RunFailure when it does not
  /// answer.
  ProgramController(const std::string& command, const OwnControllerSetup& setup);
  /// Ends the program, by force when it does not end by itself.
  ~ProgramController() override;

  void Follow(const Trajectory& motion) override { motion_ = &motion; }
  void Begin(double t, const Reading& reading) override;
  void Step(const Reading& reading, double t, Command* command) override;
  [[nodiscard]] const GraspModel& model() const override { return model_; }

 private:
  void Start(const std::string& command);
  void Greet();
  void SetTimeLimit(double seconds);
  void Stop();
  void Send(const void* data, size_t size);
  void Receive(void* data, size_t size);
  void FillRequest(const Reading& reading, double t, const Command& command);
  /// What became of the program, in words; waits for it a little.
  std::string TellEnd();

  std::string name_;
  OwnControllerSetup setup_;
  GraspModel model_;
  VectorXd sigma_prime_;                            // n
  Matrix2d wheels_inverse_ = Matrix2d::Identity();  // of E_bar'
  const Trajectory* motion_ = nullptr;
  std::optional<JointDemand> joints_;
  int socket_ = -1;
  double time_limit_ = 0.0;  // s
  std::optional<ChildProcess> process_;
  bool wants_terms_ = false;
  bool tells_F_N_ = false;
  std::vector<double> request_;  // the message before it takes the place of one double
  size_t filled_ = 0;
};

}  // namespace dexcheck
