#pragma once

// Controllers of the user's own: shared libraries, Python files and programs.

#include <sys/time.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controller/control/controller.h"
#include "controller/control/controller_library.h"
#include "controller/control/controller_protocol.h"
#include "controller/control/joint_controller.h"
#include "harness/plant/plant.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// A failure of a controller of the user's own, which cannot be used any more.
class ControllerFailure : public RunFailure {
 public:
  using RunFailure::RunFailure;
};

/// Makes the scenario's own controller, which must be stated.
/// @throws InputError when the scenario has no work for it, when it cannot be loaded or started, is of
/// another version, or does not take a parameter; ControllerFailure when it fails at once.
std::unique_ptr<Controller> MakeOwnController(const Setup& setup, const Sampling& sampling);

/// Returns the file of a controller: a library or a Python file; empty for a command.
std::filesystem::path FindControllerFile(const OwnControllerOptions& own);

/// Returns the hash of that file's bytes; empty for a command.
std::string HashController(const OwnControllerOptions& own);

// Hosts of controllers of the user's own: a library in C++, a library in C, a program.

/// Factor of the time limit for a controller's start, and for a library's begin.
inline constexpr int kPatience = 10;
/// At least a microsecond: timers take 0 for none.
timeval ToTime(double seconds);

/// Inputs of a controller of the user's own.
struct OwnControllerSetup {
  const Setup& setup;  ///< Outlives the controller.
  Sampling sampling;
  std::string name;           ///< For messages: "controller law.so".
  std::string robot_text;     ///< The parameter file, with the changes made to it.
  std::string scenario_text;  ///< The scenario, with the changes made to it.

  [[nodiscard]] const OwnControllerOptions& own() const { return setup.scenario().controller; }
  /// Throws the error of a controller that does not take a parameter. @param why such as "takes none".
  [[noreturn]] void RejectParameter(const std::string& parameter, const std::string& why) const;
};

/// One that is called at each step. It counts the steps for which torques are held.
class OwnController : public Controller {
 protected:
  explicit OwnController(const OwnControllerSetup& setup);
  /// Torques are due at the next step.
  void Restart() { steps_until_due_ = 0; }
  void BeginMotion() {
    if (joints_) joints_->Begin();
    Restart();
  }
  /// Counts a step, whose desired joints it fills in. @returns whether torques are due.
  bool CountStep(const Reading& reading, double t, Command* command);
  /// @throws ControllerFailure unless there are n torques.
  void RequireTorques(const Command& command) const;

  OwnControllerSetup setup_;
  std::optional<JointDemand> joints_;  // of a scenario that moves joints

 private:
  long steps_until_due_ = 0;
};

/// The other side of controller/control/controller_protocol.h: a program, or a shared library in C.
class ControllerPeer {
 public:
  virtual ~ControllerPeer() = default;

  /// @param joint_gains K_p, K_v (2 n); empty with contacts. @returns the flags of its answer: requests and
  /// reports. @throws InputError for another protocol; ControllerFailure without an answer, as in all calls.
  virtual uint32_t Greet(const dexcheck_hello& hello, std::span<const double> joint_gains) = 0;
  /// Sends the parameters to a side that wants them. @throws InputError when it refuses one.
  virtual void SetParameters() = 0;
  virtual void Begin() = 0;
  /// @param request the doubles of STEP, after one that is free for its header. @param torques the answer.
  virtual void Step(std::span<double> request, std::span<double> torques) = 0;
};

/// A program that runs while the peer exists, or the listener at a socket ("unix:PATH").
/// @throws InputError when it cannot be started.
std::unique_ptr<ControllerPeer> MakeProgramPeer(const OwnControllerSetup& setup,
                                                std::vector<std::string> words);

/// A controller by the protocol: exchanges request and reply at each control step; torques are held in
/// between. Nothing allocates there. Greets the other side and gives it its parameters.
/// @throws InputError when it does not take them; else as ControllerPeer.
std::unique_ptr<Controller> MakeProtocolController(std::unique_ptr<ControllerPeer> peer,
                                                   const OwnControllerSetup& setup);

/// A controller from a shared library: in C by the protocol, in C++ behind
/// controller/control/controller_library.h. An exception in one in C++ ends the run, with its words. A torque
/// of the wrong size, and another torque before the control step is over, end it as well.
/// @throws InputError when the library cannot be loaded, names no controller, was built for another
/// interface, makes no controller, or does not read one of the parameters.
std::unique_ptr<Controller> MakeLibraryController(const OwnControllerSetup& setup);

}  // namespace dexcheck
