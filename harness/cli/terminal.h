#pragma once

// Standard output and standard error: whether they are terminals, how wide, and whether they take colours.

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "harness/base/answer.h"

namespace dexcheck::cli {

/// Columns of the terminal that a descriptor leads to, now; 0 when it is none or does not report them.
int CountColumns(int descriptor);

/// Most columns of a line of a table, and of text without long paths.
inline constexpr size_t kColumns = 80;

/// Lines of at most kColumns, broken at blanks; those after the first of each are indented. A word that is
/// longer stays whole.
std::string Wrap(std::string_view text, size_t indent);

using Tone = Answer::Tone;

/// The text in a colour when standard output is a terminal and the environment has no NO_COLOR (no-color.org)
/// and no TERM=dumb; otherwise as it is.
std::string Paint(Tone tone, std::string_view text);

/// A line on standard error that shows how far long work has come, never wider than the terminal; silent when
/// standard error is no terminal.
class ProgressBar {
 public:
  /// @param total 0 where it is not known: what is done is counted then.
  ProgressBar(std::string label, long total, bool quiet);
  ~ProgressBar() { Finish(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Update(long done);
  /// Update. @returns whether to go on: not once the program was interrupted.
  bool GoOn(long done);
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
