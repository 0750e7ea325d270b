#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <thread>

namespace dexcheck {

/// A second thread that does one kind of work beside its owner's, once at each Start.
class SideThread {
 public:
  explicit SideThread(std::function<void()> work);
  ~SideThread();
  SideThread(const SideThread&) = delete;
  SideThread& operator=(const SideThread&) = delete;

  /// Begins the work; what the owner did before is seen there. Wait comes before the next.
  void Start();
  /// Until the work is done; what it did is seen from then on. @throws what it threw.
  void Wait();

 private:
  enum State : int { kIdle, kWorking, kQuit };
  /// Until the state is another: a millisecond or so awake, then asleep.
  void AwaitChange(State from) const;
  void Set(State state);
  void Run();

  std::function<void()> work_;
  std::exception_ptr failure_;
  std::atomic<State> state_ = kIdle;
  std::thread thread_;
};

}  // namespace dexcheck
