#pragma once

namespace dexcheck {

/// Chooses whether checks have a thread of their own, by which way was faster lately: on a machine that is
/// busy with other work two threads wait for each other longer than one takes. Steps come in blocks; one
/// block tries the thread, one goes without it, and those that follow use the faster way.
class ThreadChoice {
 public:
  static constexpr long kBlock = 32, kBlocks = 64;

  /// Whether the next step's checks are made beside the step after it. @param now s, before the step.
  [[nodiscard]] bool Next(double now) {
    const long step = steps_++;
    if (step % kBlock != 0) return is_beside_;
    (is_beside_ ? beside_ : alone_) = now - begin_;
    begin_ = now;
    const long block = step / kBlock % kBlocks;
    is_beside_ = block == 0 || (block > 1 && beside_ < alone_);
    return is_beside_;
  }

 private:
  long steps_ = 0;
  bool is_beside_ = false;
  double begin_ = 0.0, beside_ = 0.0, alone_ = 0.0;  // s; the last block of each kind took
};

}  // namespace dexcheck
