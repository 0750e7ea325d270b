#include "harness/run/side_thread.h"

#include <utility>

namespace dexcheck {
namespace {

/// Lets the other thread of the core go first.
void Pause() {
#ifdef __x86_64__
  __builtin_ia32_pause();
#endif
}

}  // namespace

SideThread::SideThread(std::function<void()> work) : work_(std::move(work)), thread_([this] { Run(); }) {}

SideThread::~SideThread() {
  AwaitChange(kWorking);
  Set(kQuit);
  thread_.join();
}

void SideThread::Start() { Set(kWorking); }

void SideThread::Wait() {
  AwaitChange(kWorking);
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void SideThread::AwaitChange(State from) const {
  // Sleeping and waking takes longer than a step: awake for some of them, but in nobody else's way.
  constexpr int kSpins = 5000, kAlone = 200;
  for (int i = 0; i < kSpins; ++i) {
    if (state_.load(std::memory_order_acquire) != from) return;
    if (i >= kAlone)
      std::this_thread::yield();
    else
      Pause();
  }
  state_.wait(from, std::memory_order_acquire);
}

void SideThread::Set(State state) {
  state_.store(state, std::memory_order_release);
  state_.notify_one();
}

void SideThread::Run() {
  while (true) {
    AwaitChange(kIdle);
    if (state_.load(std::memory_order_acquire) == kQuit) return;
    try {
      work_();
    } catch (...) {
      failure_ = std::current_exception();
    }
    Set(kIdle);
  }
}

}  // namespace dexcheck
