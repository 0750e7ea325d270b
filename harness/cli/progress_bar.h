#pragma once

#include <chrono>
#include <string>

namespace dexcheck::cli {

/// A line on standard error that shows how far long work has come; silent when standard error is no terminal.
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
  std::string label_;
  long total_;
  bool visible_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point last_drawn_{};
};

}  // namespace dexcheck::cli
