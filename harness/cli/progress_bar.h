#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace dexcheck::cli {

/// A line on standard error that shows how far long work has come, never wider than the terminal; silent when
/// standard error is no terminal.
class ProgressBar {
 public:
  ProgressBar(std::string label, long total, bool quiet);
  ~ProgressBar() { Finish(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Update(long done);
  /// Clears the line.
  void Finish();

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] std::string MakeLine(long done, Clock::time_point now) const;

  std::string label_;
  long total_;
  bool visible_;
  bool drawn_ = false;
  // The first update: what came before, such as coming to rest, says nothing of the speed.
  std::optional<Clock::time_point> first_time_;
  long first_done_ = 0;
  Clock::time_point last_drawn_{};
};

}  // namespace dexcheck::cli
