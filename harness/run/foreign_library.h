#pragma once

// A shared library of the user's own, in this process.

#include <exception>
#include <filesystem>
#include <memory>
#include <string>

#include "harness/run/own_controller.h"

namespace dexcheck {

/// A library, loaded while this object exists. Exceptions in it are thrown again as ControllerFailure. A call
/// that does not return in time ends the program with one line, and so does a crash where the process is
/// watched (ContinueWatched). Calls are made one at a time in a process.
class ForeignLibrary {
 public:
  /// Making a controller and its first look at the robot may take this many times the limit of a step.
  static constexpr int kPatience = 10;

  /// @throws InputError when it cannot be loaded.
  explicit ForeignLibrary(const OwnControllerSetup& setup);

  /// Returns the function of this name; null when there is none.
  template <typename Function>
  [[nodiscard]] Function* Find(const char* name) const {
    return reinterpret_cast<Function*>(FindSymbol(name));
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
    explicit Timer(const OwnControllerSetup& setup);
    ~Timer();
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;
  };
  struct TimedCall {
    explicit TimedCall(int patience);
    ~TimedCall();
    TimedCall(const TimedCall&) = delete;
    TimedCall& operator=(const TimedCall&) = delete;
  };
  struct Close {
    void operator()(void* handle) const;
  };
  [[nodiscard]] void* FindSymbol(const char* name) const;

  std::string name_;
  Timer timer_;
  std::unique_ptr<void, Close> handle_;
};

}  // namespace dexcheck
