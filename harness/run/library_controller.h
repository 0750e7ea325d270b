#pragma once

// A controller of the user's own from a shared library.

#include <memory>
#include <optional>
#include <string>

#include "controller/control/controller.h"
#include "controller/control/joint_controller.h"
#include "harness/run/foreign_code.h"
#include "harness/run/own_controller.h"

namespace dexcheck {

/// Loads a library (controller/control/controller_library.h). What it throws ends the run, with its words; a
/// crash, a call that does not return in time and a torque of the wrong size likewise.
class LibraryController final : public Controller {
 public:
  /// @throws InputError when the library cannot be loaded, names no controller or was built for another
  /// interface; RunFailure when its controller cannot be made.
  LibraryController(const std::string& library, const OwnControllerSetup& setup);
  ~LibraryController() override;

  void Follow(const Trajectory& motion) override;
  void Begin(double t, const Reading& reading) override;
  void Step(const Reading& reading, double t, Command* command) override;
  [[nodiscard]] bool is_done() const override { return controller_->is_done(); }
  [[nodiscard]] const GraspModel& model() const override { return controller_->model(); }

 private:
  /// @param patience how many times the time limit the work may take.
  template <typename Work>
  void Guard(const Work& work, int patience = 1);

  struct CloseLibrary {
    void operator()(void* handle) const;
  };

  std::string name_;
  OwnControllerSetup setup_;
  std::optional<JointDemand> joints_;
  ForeignCode foreign_code_;
  bool is_broken_ = false;                      // a call ended in its middle
  std::unique_ptr<void, CloseLibrary> handle_;  // outlives the controller
  std::unique_ptr<Controller> controller_;
};

}  // namespace dexcheck
