#include "harness/run/library_controller.h"

#include <dlfcn.h>

#include <exception>
#include <filesystem>
#include <utility>

#include "controller/common/text.h"
#include "harness/plant/plant.h"

namespace dexcheck {
namespace {

/// Making a controller and its first look at the robot may take this many times the limit of a step.
constexpr int kPatience = 10;

template <typename Function>
Function* FindFunction(void* handle, const char* name) {
  return reinterpret_cast<Function*>(dlsym(handle, name));
}

}  // namespace

void LibraryController::CloseLibrary::operator()(void* handle) const { dlclose(handle); }

LibraryController::LibraryController(const std::string& library, const OwnControllerSetup& setup)
    : name_("controller " + library), setup_(setup), foreign_code_(setup.time_limit) {
  // A bare name would be searched for among the system's libraries.
  const std::string path = std::filesystem::absolute(library).string();
  handle_.reset(dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL));
  if (handle_ == nullptr) throw InputError("--controller: " + std::string(dlerror()));
  const auto interface = FindFunction<const char*()>(handle_.get(), "dexcheck_controller_interface");
  const auto make =
      FindFunction<Controller*(const ControllerContext*)>(handle_.get(), "dexcheck_make_controller");
  if (interface == nullptr || make == nullptr) {
    throw InputError("--controller: " + library + ": names no controller (DEXCHECK_CONTROLLER is missing)");
  }
  const std::string built_for = interface();
  if (built_for != DescribeControllerInterface()) {
    throw InputError("--controller: " + library + ": was built for interface " + Quote(built_for) +
                     ", this program has " + Quote(DescribeControllerInterface()));
  }
  if (setup_.joints != nullptr) joints_.emplace(setup_.joints->motion, setup_.sampling.time_step);
  const ControllerContext context{*setup_.model,
                                  setup_.fingertips,
                                  setup_.object,
                                  *setup_.surface,
                                  setup_.options,
                                  setup_.sampling,
                                  setup_.joints != nullptr ? &setup_.joints->gains : nullptr};
  Guard([&] { controller_.reset(make(&context)); }, kPatience);
  if (controller_ == nullptr) throw RunFailure(name_ + ": made no controller");
}

LibraryController::~LibraryController() {
  if (!is_broken_) return;
  // It stays in memory as it is.
  static std::pair<void*, Controller*> abandoned;
  abandoned = {handle_.release(), controller_.release()};
}

template <typename Work>
void LibraryController::Guard(const Work& work, int patience) {
  std::string trouble;
  try {
    trouble = foreign_code_.Call(work, patience);
  } catch (const std::exception& error) {
    throw RunFailure(name_ + ": " + error.what());
  } catch (...) {
    throw RunFailure(name_ + ": threw something that is no std::exception");
  }
  if (trouble.empty()) return;
  is_broken_ = true;
  throw RunFailure(name_ + ": " + trouble);
}

void LibraryController::Follow(const Trajectory& motion) {
  Guard([&] { controller_->Follow(motion); });
}

void LibraryController::Begin(double t, const Reading& reading) {
  if (joints_) joints_->Begin();
  Guard([&] { controller_->Begin(t, reading); }, kPatience);
}

void LibraryController::Step(const Reading& reading, double t, Command* command) {
  if (joints_) {
    joints_->Fill(reading, t, command);
    command->computes_joints = true;
  }
  Guard([&] { controller_->Step(reading, t, command); });
  RequireTorques(name_, *command, setup_.model->num_velocities());
}

}  // namespace dexcheck
