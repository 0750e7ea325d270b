#include "harness/cli/terminal.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "harness/base/interrupts.h"

namespace dexcheck::cli {

namespace {

bool TakesColors() {
  static const bool takes = [] {
    const char* const no_color = std::getenv("NO_COLOR");
    const char* const term = std::getenv("TERM");
    return ::isatty(STDOUT_FILENO) != 0 && (no_color == nullptr || *no_color == '\0') && term != nullptr &&
           std::string_view(term) != "dumb";
  }();
  return takes;
}

constexpr int kUsualColumns = 80;  // of a terminal that does not report them
constexpr int kWidestBar = 40;
constexpr int kNarrowestBar = 8;
constexpr std::chrono::milliseconds kRedrawEvery(100);
// The time left is not estimated before: the first steps touch memory for the first time.
constexpr double kLeastElapsed = 0.5;  // s

}  // namespace

int CountColumns(int descriptor) {
  winsize size{};
  return ::ioctl(descriptor, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

std::string Wrap(std::string_view text, size_t indent) {
  std::string wrapped;
  size_t column = 0;
  while (true) {
    const size_t begin = text.find_first_not_of(" \n");
    if (begin == std::string_view::npos) return wrapped;
    const std::string_view gap = text.substr(0, begin);
    const std::string_view word = text.substr(begin, text.find_first_of(" \n", begin) - begin);
    text.remove_prefix(begin + word.size());
    if (gap.find('\n') != std::string_view::npos) {
      wrapped += gap;
      column = begin - gap.rfind('\n') - 1;
    } else if (column > indent && column + begin + word.size() > kColumns) {
      wrapped += "\n" + std::string(indent, ' ');
      column = indent;
    } else {
      wrapped += gap;
      column += begin;
    }
    wrapped += word;
    column += word.size();
  }
}

std::string Paint(Tone tone, std::string_view text) {
  if (!TakesColors()) return std::string(text);
  const char* const code = tone == Tone::kGood ? "32" : tone == Tone::kBad ? "1;31" : "2";
  return "\033[" + std::string(code) + "m" + std::string(text) + "\033[0m";
}

ProgressBar::ProgressBar(std::string label, long total, bool quiet)
    : label_(std::move(label)), total_(total), visible_(!quiet && ::isatty(STDERR_FILENO) != 0) {}

std::string ProgressBar::MakeLine(long done, Clock::time_point now) const {
  const int reported = CountColumns(STDERR_FILENO);
  // The last column stays free: some terminals wrap when it is written.
  const int columns = (reported > 0 ? reported : kUsualColumns) - 1;
  if (total_ <= 0)
    return fmt::format("{}: {}", label_, done).substr(0, static_cast<size_t>(std::max(columns, 0)));
  const double fraction = std::clamp(static_cast<double>(done) / static_cast<double>(total_), 0.0, 1.0);
  const double elapsed = std::chrono::duration<double>(now - *first_time_).count();
  std::string end = fmt::format(" {:3.0f} %", 100.0 * fraction);
  const std::string count = fmt::format(" ({} of {})", done, total_);
  std::string left;
  if (elapsed >= kLeastElapsed && done > first_done_) {
    const double rate = static_cast<double>(done - first_done_) / elapsed;
    left = fmt::format(", {:.0f} s left", static_cast<double>(total_ - done) / rate);
  }
  // The least important goes first: the count, then the label's end, then the bar.
  const auto room = [&](size_t used) { return columns - static_cast<int>(used) - 3; };  // " [" and "]"
  std::string label = label_;
  if (room(label.size() + end.size() + count.size() + left.size()) >= kNarrowestBar) end += count;
  end += left;
  if (room(label.size() + end.size()) < kNarrowestBar) {
    const int shorter = static_cast<int>(label.size()) + room(label.size() + end.size()) - kNarrowestBar;
    label.resize(static_cast<size_t>(std::max(shorter, 0)));
  }
  const int width = std::min(room(label.size() + end.size()), kWidestBar);
  if (width < kNarrowestBar) return end.substr(0, static_cast<size_t>(std::max(columns, 0)));
  const int filled = static_cast<int>(fraction * width);
  return fmt::format("{} [{}{}]{}", label, std::string(static_cast<size_t>(filled), '#'),
                     std::string(static_cast<size_t>(width - filled), '.'), end);
}

void ProgressBar::Update(long done) {
  if (!visible_) return;
  const Clock::time_point now = Clock::now();
  if (!first_time_) {
    first_time_ = now;
    first_done_ = done;
  }
  if (drawn_ && now - last_drawn_ < kRedrawEvery) return;
  last_drawn_ = now;
  drawn_ = true;
  // Without the rest of an earlier, longer line.
  std::fputs(("\r" + MakeLine(done, now) + "\033[K").c_str(), stderr);  // gone: it does not matter
  std::fflush(stderr);
}

bool ProgressBar::GoOn(long done) {
  Update(done);
  return !IsInterrupted();
}

void ProgressBar::Finish() {
  if (!drawn_) return;
  drawn_ = false;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
}

}  // namespace dexcheck::cli
