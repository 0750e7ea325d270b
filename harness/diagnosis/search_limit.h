#pragma once

// How long searches for causes may take.

namespace dexcheck {

/// While one exists, searches for causes end after so much processor time, and when the user interrupts: what
/// was found until then stands.
class SearchLimit {
 public:
  /// @param seconds of processor time.
  explicit SearchLimit(double seconds);
  ~SearchLimit();
  SearchLimit(const SearchLimit&) = delete;
  SearchLimit& operator=(const SearchLimit&) = delete;

  /// Whether searches are to end now; without a limit never.
  static bool IsOver();
  /// Whether this one has ended a search.
  [[nodiscard]] bool has_ended() const { return has_ended_; }

 private:
  double end_;  // of the thread's processor time, s
  bool was_interrupted_;
  bool has_ended_ = false;
};

}  // namespace dexcheck
