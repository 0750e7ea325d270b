#include "harness/run/library_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {

LibraryController::LibraryController(std::unique_ptr<ForeignLibrary> library, const OwnControllerSetup& setup)
    : setup_(setup), parameters_(setup.own.parameters), library_(std::move(library)) {
  RequireInterface();
  const auto make = library_->Find<Controller*(const ControllerContext*)>("dexcheck_make_controller");
  if (setup_.joints != nullptr) joints_.emplace(setup_.joints->motion, setup_.sampling.time_step);
  const ControllerContext context{*setup_.model,
                                  setup_.fingertips,
                                  setup_.object,
                                  *setup_.surface,
                                  setup_.options,
                                  setup_.sampling,
                                  setup_.joints != nullptr ? &setup_.joints->gains : nullptr,
                                  &parameters_};
  std::string refusal = "made no controller";
  library_->Guard(
      [&] {
        try {
          controller_.reset(make(&context));
        } catch (const std::exception& error) {
          refusal = error.what();
        }
      },
      ForeignLibrary::kPatience);
  if (controller_ == nullptr) throw InputError(setup_.name + ": " + refusal);
  const std::vector<std::string>& asked = parameters_.asked();
  for (const auto& [parameter, value] : parameters_.given()) {
    if (std::find(asked.begin(), asked.end(), parameter) == asked.end())
      RejectParameter(
          setup_, parameter,
          asked.empty() ? "asks for no parameters" : fmt::format("asks for {}", fmt::join(asked, ", ")));
  }
}

void LibraryController::RequireInterface() const {
  const auto interface = library_->Find<const char*()>("dexcheck_controller_interface");
  if (interface == nullptr)
    throw InputError(setup_.name + ": names no controller (DEXCHECK_CONTROLLER is missing)");
  const std::string built_for = interface();
  for (int known = kOldestControllerInterface; known <= kControllerInterface; ++known) {
    if (built_for == DescribeControllerInterface(known)) return;
  }
  throw InputError(setup_.name + ": was built for interface " + Quote(built_for) + ", this program has " +
                   Quote(DescribeControllerInterface()));
}

void LibraryController::Follow(const Trajectory& motion) {
  steps_until_due_ = 0;
  library_->Guard([&] { controller_->Follow(motion); });
}

void LibraryController::Begin(double t, const Reading& reading) {
  if (joints_) joints_->Begin();
  steps_until_due_ = 0;
  library_->Guard([&] { controller_->Begin(t, reading); }, ForeignLibrary::kPatience);
}

void LibraryController::Step(const Reading& reading, double t, Command* command) {
  if (joints_) {
    joints_->Fill(reading, t, command);
    command->computes_joints = steps_until_due_ == 0;
  }
  library_->Guard([&] { controller_->Step(reading, t, command); });
  RequireTorques(setup_.name, *command, setup_.model->num_velocities());
  RequireHeld(command->tau);
}

void LibraryController::RequireHeld(const VectorXd& tau) {
  const Sampling& sampling = setup_.sampling;
  if (steps_until_due_ == 0) {
    steps_until_due_ = sampling.hold;
    held_ = tau;
  }
  --steps_until_due_;
  if (tau != held_) {
    throw ControllerFailure(fmt::format("{}: changed its torques within plant.control_step ({} s)",
                                        setup_.name,
                                        static_cast<double>(sampling.hold) * sampling.time_step));
  }
}

}  // namespace dexcheck
