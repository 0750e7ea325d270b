#pragma once

// The other side of controller/control/controller_protocol.h: a program, or a shared library in C.

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controller/control/controller_protocol.h"
#include "harness/base/child_process.h"
#include "harness/run/foreign_library.h"

namespace dexcheck {

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

/// A program that runs while this object exists, or the listener at a socket ("unix:PATH").
class ProgramPeer final : public ControllerPeer {
 public:
  /// Starts the program. @throws InputError when that is not possible.
  ProgramPeer(const OwnControllerSetup& setup, std::vector<std::string> words);
  /// Ends the program, by force when it does not end by itself.
  ~ProgramPeer() override;
  uint32_t Greet(const dexcheck_hello& hello, std::span<const double> joint_gains) override;
  void SetParameters() override;
  void Begin() override;
  void Step(std::span<double> request, std::span<double> torques) override;

 private:
  void Start(std::vector<std::string> words);
  void Connect(const std::string& path);
  void SetTimeLimit(double seconds);
  void Send(const void* data, size_t size);
  void Receive(void* data, size_t size);
  /// Returns the message; an error message is thrown as `Failure`.
  template <typename Failure>
  dexcheck_message ReceiveMessage();
  /// Describes how the program ended, after a short wait; empty while it runs.
  std::string ReportEnd();

  OwnControllerSetup setup_;
  FileDescriptor socket_;
  double time_limit_ = 0.0;   // s
  bool answers_soon_ = true;  // the last wait was short
  std::optional<ChildProcess> process_;
};

/// The functions of a library in C.
class LibraryPeer final : public ControllerPeer {
 public:
  LibraryPeer(std::unique_ptr<ForeignLibrary> library, const OwnControllerSetup& setup);
  ~LibraryPeer() override;
  uint32_t Greet(const dexcheck_hello& hello, std::span<const double> joint_gains) override;
  void SetParameters() override;
  void Begin() override;
  void Step(std::span<double> request, std::span<double> torques) override;

 private:
  std::unique_ptr<ForeignLibrary> library_;
  OwnControllerSetup setup_;
  // Data to which the library may keep pointers.
  dexcheck_hello hello_{};
  std::vector<double> joint_gains_;
  void* controller_ = nullptr;
  const char* (*step_)(void*, const double*, double*) = nullptr;
};

}  // namespace dexcheck
