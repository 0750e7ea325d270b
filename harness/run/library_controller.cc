#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <exception>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/interrupts.h"
#include "harness/run/own_controller.h"

namespace dexcheck {
namespace {

/// Number of looks of the timer in a time limit. Looks are counted instead of time, so that a process that
/// was stopped for a while does not fail.
constexpr int kLooks = 4;

/// State that a timer of the process reads.
struct {
  int libraries = 0;
  std::string line;            // message for a call that does not return
  std::atomic<long> call = 0;  // 1, 3, ... while one is made
  std::atomic<int> patience = 1;
  std::atomic<long> seen = 0;
  std::atomic<int> looks = 0;
} timed;

void LookAtCall(int /*signal*/) {
  const long call = timed.call;
  timed.looks = call == timed.seen ? timed.looks + 1 : 0;
  timed.seen = call;
  if (call % 2 == 1 && timed.looks >= kLooks * timed.patience) FailAtOnce(timed.line);
}

/// Sets the period of the timer; 0 stops it.
void SetTimer(const timeval& period) {
  const itimerval timer{.it_interval = period, .it_value = period};
  ::setitimer(ITIMER_REAL, &timer, nullptr);
}

/// A shared library of the user's own in this process, loaded while this object exists. Exceptions in it are
/// thrown again as ControllerFailure. A call that does not return in time ends the program with one line, and
/// so does a crash where the process is watched (ContinueWatched). Calls are made one at a time in a process.
class ForeignLibrary {
 public:
  /// @throws InputError when it cannot be loaded.
  explicit ForeignLibrary(const OwnControllerSetup& setup) : name_(setup.name), timer_(setup) {
    Guard([&] { handle_.reset(dlopen(FindControllerFile(setup.own()).c_str(), RTLD_NOW | RTLD_LOCAL)); },
          kPatience);
    if (handle_ == nullptr) throw InputError(name_ + ": " + dlerror());
  }

  /// Returns the function of this name; null when there is none.
  template <typename Function>
  [[nodiscard]] Function* Find(const char* name) const {
    return reinterpret_cast<Function*>(dlsym(handle_.get(), name));
  }

  /// Calls the work. @param patience how many times the time limit it may take. @throws ControllerFailure.
  template <typename Work>
  void Guard(const Work& work, int patience = 1) const {
    const TimedCall call(patience);
    try {
      work();
    } catch (const std::exception& error) {
      throw ControllerFailure(name_ + ": " + error.what());
    } catch (...) {
      throw ControllerFailure(name_ + ": threw something that is no std::exception");
    }
  }

 private:
  /// Watches the calls as long as there are libraries.
  struct Timer {
    explicit Timer(const OwnControllerSetup& setup) {
      ++timed.libraries;
      timed.line =
          setup.name + ": did not return in time (" + FormatNumber(setup.own().time_limit) + " s for a step)";
      struct sigaction action {};
      action.sa_handler = LookAtCall;
      action.sa_flags = SA_RESTART;
      ::sigaction(SIGALRM, &action, nullptr);
      SetTimer(ToTime(setup.own().time_limit / kLooks));
    }
    ~Timer() {
      if (--timed.libraries == 0) SetTimer({});
    }
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;
  };
  struct TimedCall {
    explicit TimedCall(int patience) {
      timed.patience.store(patience, std::memory_order_relaxed);
      timed.call.fetch_add(1, std::memory_order_release);
    }
    ~TimedCall() { timed.call.fetch_add(1, std::memory_order_release); }
    TimedCall(const TimedCall&) = delete;
    TimedCall& operator=(const TimedCall&) = delete;
  };
  struct Close {
    void operator()(void* handle) const { dlclose(handle); }
  };

  std::string name_;
  Timer timer_;
  std::unique_ptr<void, Close> handle_;
};

/// A library in C++.
class LibraryController final : public OwnController {
 public:
  LibraryController(std::unique_ptr<ForeignLibrary> library, const OwnControllerSetup& own)
      : OwnController(own),
        options_(own.setup.MakeControllerOptions()),
        parameters_(own.own().parameters),
        library_(std::move(library)) {
    RequireInterface();
    const auto make = library_->Find<Controller*(const ControllerContext*)>("dexcheck_make_controller");
    const Setup& setup = own.setup;
    const ControllerContext context{setup.model(),
                                    setup.fingertips(),
                                    setup.object().body,
                                    setup.surface(),
                                    options_,
                                    own.sampling,
                                    joints_ ? &setup.joints()->gains : nullptr,
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
        kPatience);
    if (controller_ == nullptr) throw InputError(own.name + ": " + refusal);
    const std::vector<std::string>& asked = parameters_.asked();
    for (const auto& [parameter, value] : parameters_.given()) {
      if (std::ranges::find(asked, parameter) == asked.end())
        own.RejectParameter(parameter, asked.empty() ? "asks for no parameters"
                                                     : fmt::format("asks for {}", fmt::join(asked, ", ")));
    }
  }

  void Follow(const Trajectory& motion) override {
    Restart();
    library_->Guard([&] { controller_->Follow(motion); });
  }

  void Begin(double t, const Reading& reading) override {
    BeginMotion();
    library_->Guard([&] { controller_->Begin(t, reading); }, kPatience);
  }

  void Step(const Reading& reading, double t, Command* command) override {
    const bool is_due = CountStep(reading, t, command);
    library_->Guard([&] { controller_->Step(reading, t, command); });
    RequireTorques(*command);
    if (is_due) held_ = command->tau;
    if (command->tau == held_) return;
    const Sampling& sampling = setup_.sampling;
    throw ControllerFailure(fmt::format("{}: changed its torques within plant.control_step ({} s)",
                                        setup_.name,
                                        static_cast<double>(sampling.hold) * sampling.time_step));
  }
  [[nodiscard]] bool is_done() const override { return controller_->is_done(); }
  [[nodiscard]] const GraspModel& model() const override { return controller_->model(); }

 private:
  void RequireInterface() const {
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

  GraspControllerOptions options_;
  ControllerParameters parameters_;
  VectorXd held_;                            // torques of the last control step, n
  std::unique_ptr<ForeignLibrary> library_;  // outlives the controller
  std::unique_ptr<Controller> controller_;
};

/// The functions of a library in C.
class LibraryPeer final : public ControllerPeer {
 public:
  LibraryPeer(std::unique_ptr<ForeignLibrary> library, const OwnControllerSetup& setup)
      : library_(std::move(library)),
        setup_(setup),
        step_(library_->Find<const char*(void*, const double*, double*)>("dexcheck_step")) {}

  ~LibraryPeer() override {
    const auto close = library_->Find<void(void*)>("dexcheck_close");
    if (controller_ == nullptr || close == nullptr) return;
    try {
      library_->Guard([&] { close(controller_); });
    } catch (const ControllerFailure&) {  // the run has its verdict
    }
  }

  uint32_t Greet(const dexcheck_hello& hello, std::span<const double> joint_gains) override {
    const uint32_t protocol = library_->Find<uint32_t()>("dexcheck_protocol")();
    if (protocol != DEXCHECK_PROTOCOL) {
      throw InputError(setup_.name + ": is of protocol " + std::to_string(protocol) + ", this program of " +
                       std::to_string(DEXCHECK_PROTOCOL));
    }
    const auto open =
        library_->Find<void*(const dexcheck_hello*, const char*, const char*, const double*, uint32_t*)>(
            "dexcheck_open");
    if (open == nullptr || step_ == nullptr)
      throw InputError(setup_.name + ": must have dexcheck_open and dexcheck_step");
    hello_ = hello;
    joint_gains_.assign(joint_gains.begin(), joint_gains.end());
    uint32_t flags = 0;
    library_->Guard(
        [&] {
          controller_ = open(&hello_, setup_.robot_text.c_str(), setup_.scenario_text.c_str(),
                             joint_gains_.empty() ? nullptr : joint_gains_.data(), &flags);
        },
        kPatience);
    if (controller_ == nullptr) throw InputError(setup_.name + ": made no controller");
    const bool takes_parameters = library_->Find<void>("dexcheck_set_parameter") != nullptr;
    return takes_parameters ? flags | DEXCHECK_PARAMETERS : flags & ~uint32_t{DEXCHECK_PARAMETERS};
  }

  void SetParameters() override {
    const auto set = library_->Find<const char*(void*, const char*, double)>("dexcheck_set_parameter");
    for (const auto& [parameter, value] : setup_.own().parameters) {
      std::string problem;
      library_->Guard([&, name = parameter.c_str(), number = value] {
        if (const char* text = set(controller_, name, number)) problem = Abbreviate(text);
      });
      if (!problem.empty())
        throw InputError(fmt::format("{}: controller.{}: {}", setup_.name, parameter, problem));
    }
  }

  void Begin() override {
    if (const auto begin = library_->Find<void(void*)>("dexcheck_begin"))
      library_->Guard([&] { begin(controller_); }, kPatience);
  }

  void Step(std::span<double> request, std::span<double> torques) override {
    const char* problem = nullptr;
    library_->Guard([&] { problem = step_(controller_, request.data() + 1, torques.data()); });
    if (problem != nullptr) throw ControllerFailure(setup_.name + ": " + Abbreviate(problem));
  }

 private:
  std::unique_ptr<ForeignLibrary> library_;
  OwnControllerSetup setup_;
  // Data to which the library may keep pointers.
  dexcheck_hello hello_{};
  std::vector<double> joint_gains_;
  void* controller_ = nullptr;
  const char* (*step_)(void*, const double*, double*) = nullptr;
};

}  // namespace

std::unique_ptr<Controller> MakeLibraryController(const OwnControllerSetup& setup) {
  ContinueWatched(setup.name);
  auto library = std::make_unique<ForeignLibrary>(setup);
  if (library->Find<void>("dexcheck_protocol") == nullptr)
    return std::make_unique<LibraryController>(std::move(library), setup);
  return MakeProtocolController(std::make_unique<LibraryPeer>(std::move(library), setup), setup);
}

}  // namespace dexcheck
