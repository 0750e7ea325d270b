#pragma once

// A page as a browser shows it: headless Chromium, driven by chromedriver through the WebDriver protocol.

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/common/run_program.h"

namespace dexcheck::testing {

class Browser {
 public:
  /// @throws std::runtime_error when it cannot be started.
  Browser();
  ~Browser();
  /// One for all tests of a process, which takes its time to start: as new, but for what was open.
  static Browser& Shared();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  void Open(const std::filesystem::path& page) const;
  /// Size in CSS pixels.
  void SetViewport(int width, int height, bool mobile = false) const;
  void SetDark(bool dark) const;
  /// Returns the value of a function with this body.
  [[nodiscard]] nlohmann::json Run(const std::string& body) const;
  /// Runs the body until it returns true; false after `seconds`.
  [[nodiscard]] bool WaitFor(const std::string& body, double seconds = 120.0) const;
  /// Works every control of the page that can be seen: options, buttons, boxes, sliders, texts, folds, heads
  /// and rows of tables, links within the page. A page that does not answer afterwards, or whose console is
  /// not silent, throws.
  /// @returns how many there were.
  [[nodiscard]] int WorkControls() const;
  /// Presses the mouse's button at the first place and lets it go at the second, in viewport coordinates.
  void Drag(int from_x, int from_y, int to_x, int to_y) const;
  void DoubleClick(int x, int y) const;
  /// How many ids stand twice, and how many things the page loaded beside itself.
  [[nodiscard]] int CountRepeatedIds() const {
    return Run(
        "const ids = [...document.querySelectorAll('[id]')].map(e => e.id);return ids.length - new "
        "Set(ids).size;");
  }
  [[nodiscard]] int CountLoaded() const {
    return Run(
        "return performance.getEntriesByType('resource')  .filter(e => !e.name.startsWith('data:')).length;");
  }
  /// Errors and warnings since the last call.
  [[nodiscard]] std::vector<std::string> TakeConsole() const;

 private:
  nlohmann::json Call(const std::string& method, const std::string& path, const nlohmann::json& body) const;
  void Command(const std::string& name, const nlohmann::json& parameters) const;
  void Act(const nlohmann::json& pointer_actions) const;

  TempFolder folder_;
  std::unique_ptr<Program> driver_;
  int port_ = 0;
  std::string session_;
};

}  // namespace dexcheck::testing
