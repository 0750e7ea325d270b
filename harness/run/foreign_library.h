#pragma once

// A shared library of the user's own: what happens inside it comes back as a ControllerFailure.

#include <exception>
#include <filesystem>
#include <memory>
#include <string>

#include "harness/run/foreign_code.h"
#include "harness/run/own_controller.h"

namespace dexcheck {

/// What a call left in its middle stays in memory as it is, where leak checkers find it.
void KeepForEver(void* what);

/// Loaded while it exists. Its crashes, and calls that do not return in time, are as ForeignCode has them.
class ForeignLibrary {
 public:
  /// Making a controller and its first look at the robot may take this many times the limit of a step.
  static constexpr int kPatience = 10;

  /// @throws InputError when it cannot be loaded.
  explicit ForeignLibrary(const OwnControllerSetup& setup);
  ~ForeignLibrary();

  /// Null when there is none of this name.
  template <typename Function>
  [[nodiscard]] Function* Find(const char* name) const {
    return reinterpret_cast<Function*>(FindSymbol(name));
  }

  /// @param patience how many times the time limit the work may take. @throws ControllerFailure.
  template <typename Work>
  void Guard(const Work& work, int patience = 1) {
    std::string trouble;
    try {
      trouble = code_.Call(work, patience);
    } catch (const std::exception& error) {
      throw ControllerFailure(name_ + ": " + error.what());
    } catch (...) {
      throw ControllerFailure(name_ + ": threw something that is no std::exception");
    }
    if (trouble.empty()) return;
    is_broken_ = true;
    throw ControllerFailure(name_ + ": " + trouble);
  }

  /// Whether a call ended in its middle: then nothing of it may be called any more, and it stays in memory.
  [[nodiscard]] bool is_broken() const { return is_broken_; }

 private:
  [[nodiscard]] void* FindSymbol(const char* name) const;

  struct Close {
    void operator()(void* handle) const;
  };

  std::string name_;
  ForeignCode code_;
  bool is_broken_ = false;
  std::unique_ptr<void, Close> handle_;
};

}  // namespace dexcheck
