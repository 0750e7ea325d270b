// A controller's library with a fault that the environment chooses: FAULT is throw, throw_number, nan, size,
// crash, abort, overflow, hang, exit, _exit, quick_exit, kill, load (a crash while it is loaded) or none.

#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>

#include "controller/control/controller_library.h"

namespace {

using namespace dexcheck;  // NOLINT: it stands for a user's code

/// Calls itself until the stack is full.
int Overflow(int depth) {
  volatile char room[4096] = {};
  return depth < 0 ? room[1] : Overflow(depth + 1) + room[0];
}

class FaultyController final : public Controller {
 public:
  explicit FaultyController(const ControllerContext& context)
      : law_(context.model, context.fingertips, context.object, context.surface, context.options,
             context.sampling),
        fault_(std::getenv("FAULT") == nullptr ? "none" : std::getenv("FAULT")) {}
  void Follow(const Trajectory& motion) override { law_.Follow(motion); }
  void Begin(double t, const Reading& reading) override {
    law_.Begin(t, reading);
    has_begun_ = true;
  }
  [[nodiscard]] const GraspModel& model() const override { return law_.model(); }
  void Step(const Reading& reading, double t, Command* command) override {
    law_.Step(reading, t, command);
    if (!has_begun_ || t < 0.01) return;
    if (fault_ == "throw") throw std::runtime_error("the widget is out of cheese");
    if (fault_ == "throw_number") throw 7;
    if (fault_ == "nan") command->tau[3] = std::numeric_limits<double>::quiet_NaN();
    if (fault_ == "size") command->tau.setZero(3);
    if (fault_ == "crash") Crash();
    if (fault_ == "abort") std::abort();
    if (fault_ == "overflow") command->tau[0] = Overflow(0);
    if (fault_ == "exit") std::exit(0);
    if (fault_ == "_exit") ::_exit(0);
    if (fault_ == "quick_exit") std::quick_exit(0);
    if (fault_ == "kill") ::raise(SIGKILL);
    if (fault_ == "hang") {
      while (has_begun_) std::this_thread::yield();
    }
  }

 private:
  static void Crash() { *reinterpret_cast<volatile int*>(8) = 1; }  // NOLINT

  TrajectoryController law_;
  std::string fault_;
  bool has_begun_ = false;
};

[[gnu::constructor]] void Load() {
  const char* const fault = std::getenv("FAULT");
  if (fault != nullptr && std::string(fault) == "load") std::abort();
}

std::unique_ptr<Controller> Make(const ControllerContext& context) {
  return std::make_unique<FaultyController>(context);
}

}  // namespace

#ifdef OTHER_INTERFACE
extern "C" const char* dexcheck_controller_interface() { return "0, of another time"; }
extern "C" dexcheck::Controller* dexcheck_make_controller(const dexcheck::ControllerContext* context) {
  return Make(*context).release();
}
#elif defined(OLD_INTERFACE)
extern "C" const char* dexcheck_controller_interface() {
  static const std::string text = DescribeControllerInterface(kOldestControllerInterface);
  return text.c_str();
}
extern "C" dexcheck::Controller* dexcheck_make_controller(const dexcheck::ControllerContext* context) {
  return Make(*context).release();
}
#else
DEXCHECK_CONTROLLER(Make)
#endif
