#pragma once

// A window that shows pictures and reports what mouse and keyboard do.

#include <memory>
#include <string>
#include <vector>

#include "renders/image.h"

namespace dexcheck {

/// What the user did, in pixels of the last picture shown.
struct InputEvent {
  enum class Kind { kPress, kRelease, kMove, kScroll, kKey };
  enum class Button { kLeft, kMiddle, kRight };
  Kind kind = Kind::kMove;
  Button button = Button::kLeft;
  bool control = false;  ///< The key was down.
  double x = 0.0, y = 0.0;
  double scroll = 0.0;  ///< Notches, away from the user.
  int key = 0;          ///< A capital letter, a sign, or one of the keys below.
};
inline constexpr int kKeyLeft = -1;
inline constexpr int kKeyRight = -2;
inline constexpr int kKeyEscape = -3;
inline constexpr int kKeyBackspace = -4;
inline constexpr int kKeyTab = -5;
inline constexpr int kKeyF1 = -6;

/// One at a time, in the program's first thread.
class Window {
 public:
  /// @throws InputError when there is no display.
  Window(const std::string& title, int width, int height);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// The picture as large as fits, in its own proportions.
  void Show(const Image& image);
  void SetTitle(const std::string& title);
  /// What happened since the last call. @param seconds waits at most so long for something.
  std::vector<InputEvent> Poll(double seconds);
  /// Whether the user wants it closed.
  [[nodiscard]] bool is_closed() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dexcheck
