#pragma once

// A controller of the user's own from a shared library in C++.

#include <memory>
#include <optional>

#include "controller/control/controller.h"
#include "controller/control/joint_controller.h"
#include "harness/run/foreign_library.h"

namespace dexcheck {

/// A controller behind controller/control/controller_library.h. An exception in it ends the run, with its
/// words. A torque of the wrong size, and another torque before the control step is over, end it as well.
class LibraryController final : public Controller {
 public:
  /// @throws InputError when the library names no controller, was built for another interface, makes no
  /// controller, or does not read one of the parameters.
  LibraryController(std::unique_ptr<ForeignLibrary> library, const OwnControllerSetup& setup);

  void Follow(const Trajectory& motion) override;
  void Begin(double t, const Reading& reading) override;
  void Step(const Reading& reading, double t, Command* command) override;
  [[nodiscard]] bool is_done() const override { return controller_->is_done(); }
  [[nodiscard]] const GraspModel& model() const override { return controller_->model(); }

 private:
  void RequireInterface() const;
  void RequireHeld(const VectorXd& tau);

  OwnControllerSetup setup_;
  ControllerParameters parameters_;
  std::optional<JointDemand> joints_;
  long steps_until_due_ = 0;
  VectorXd held_;                            // torques of the last control step, n
  std::unique_ptr<ForeignLibrary> library_;  // outlives the controller
  std::unique_ptr<Controller> controller_;
};

}  // namespace dexcheck
