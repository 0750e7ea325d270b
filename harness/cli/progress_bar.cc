#include "harness/cli/progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

namespace dexcheck::cli {
ProgressBar::ProgressBar(std::string label, long total, bool quiet)
    : label_(std::move(label)), total_(total), visible_(!quiet && ::isatty(STDERR_FILENO) != 0) {}

void ProgressBar::Update(long done) {
  if (!visible_) return;
  constexpr std::chrono::milliseconds kRedrawEvery(100);
  const auto now = std::chrono::steady_clock::now();
  if (drawn_ && now - last_drawn_ < kRedrawEvery) return;
  last_drawn_ = now;
  drawn_ = true;
  constexpr int kWidth = 40;
  const double fraction = total_ > 0 ? static_cast<double>(done) / static_cast<double>(total_) : 1.0;
  const int filled = static_cast<int>(fraction * kWidth);
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double left = fraction > 0.0 ? elapsed * (1.0 - fraction) / fraction : 0.0;
  const std::string line = fmt::format("\r{} [{}{}] {:3.0f} % ({} of {}), {:.0f} s left ", label_,
                                       std::string(static_cast<size_t>(filled), '#'),
                                       std::string(static_cast<size_t>(kWidth - filled), '.'),
                                       100.0 * fraction, done, total_, left);
  std::fputs(line.c_str(), stderr);  // a terminal that has gone does not matter
  std::fflush(stderr);
}

void ProgressBar::Finish() {
  if (!drawn_) return;
  drawn_ = false;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
}

}  // namespace dexcheck::cli
