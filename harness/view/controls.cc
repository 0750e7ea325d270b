#include "harness/view/controls.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "harness/view/window.h"
#include "renders/overlay.h"

namespace dexcheck {
namespace {

using Align = Canvas::Align;
using panel::kFaint;
using panel::kText;

const Color kGround = panel::MakeGround(0.78F);
const Color kButton = MakeColor(0x2a3542, 0.95F);
const Color kOn = MakeColor(0x1f6fc4, 0.95F);
const Color kTrack = MakeColor(0x55616e);

// Pixels.
constexpr double kBar = 74.0;
constexpr double kMargin = 14.0;
constexpr double kButtonHeight = 28.0;
constexpr double kSliderWidth = 200.0;
constexpr double kSliderLine = 40.0;

/// A line of the help: what keys and mouse do, after MuJoCo's own `simulate`.
struct HelpLine {
  const char* keys;
  const char* text;
  std::vector<std::pair<int, Action>> actions = {};  // of keys
};

const std::vector<HelpLine>& ListHelp() {
  static const std::vector<HelpLine> lines = {
      {"space", "pause, go on", {{' ', Action::kPlay}}},
      {"right, left", "one step, one step back", {{kKeyRight, Action::kStep}, {kKeyLeft, Action::kStepBack}}},
      {"- +", "slower, faster", {{'-', Action::kSlower}, {'=', Action::kFaster}, {'+', Action::kFaster}}},
      {"Backspace, R",
       "begins a live run anew",
       {{kKeyBackspace, Action::kRestart}, {'R', Action::kRestart}}},
      {"drag", "turns the camera"},
      {"right drag", "moves it"},
      {"middle drag, wheel", "brings it nearer"},
      {"Ctrl and drag", "pulls at the object or a link"},
      {"Esc", "a free camera, which follows nothing", {{kKeyEscape, Action::kFreeCamera}}},
      {"F", "follows the object, or does not", {{'F', Action::kFollow}}},
      {"G", "goes to the grasp", {{'G', Action::kGrasp}}},
      {"C", "forces on, off", {{'C', Action::kForces}}},
      {"S", "saves a live run as a scenario", {{'S', Action::kSave}}},
      {"Tab, F1", "controls, this list: on, off", {{kKeyTab, Action::kControls}, {kKeyF1, Action::kHelp}}},
      {"Q", "closes the window", {{'Q', Action::kClose}}},
  };
  return lines;
}

struct Rectangle {
  Vector2d corner;
  Vector2d size;
  [[nodiscard]] bool Contains(double x, double y) const {
    return x >= corner.x() && y >= corner.y() && x <= corner.x() + size.x() && y <= corner.y() + size.y();
  }
};

struct Button {
  Action action;
  std::string text;
  bool on;
  Rectangle place;
};

std::vector<Button> PlaceButtons(const ControlsState& state, int height) {
  std::vector<Button> buttons;
  double x = kMargin;
  const auto add = [&](Action action, const std::string& text, bool on, double width) {
    buttons.push_back({action, text, on, {{x, height - kButtonHeight - 8.0}, {width, kButtonHeight}}});
    x += width + 8.0;
  };
  add(Action::kPlay, state.playing ? "Pause" : "Play", state.playing, 66.0);
  add(Action::kStep, "Step", false, 52.0);
  add(Action::kSlower, "-", false, 28.0);
  add(Action::kFaster, "+", false, 28.0);
  x += 76.0;  // the speed
  add(Action::kFollow, "Follow", state.follow, 66.0);
  add(Action::kForces, "Forces", state.forces, 66.0);
  if (state.live) add(Action::kSave, "Save", false, 54.0);
  return buttons;
}

Rectangle PlaceTime(int width, int height) {
  return {{kMargin, height - kBar + 10.0}, {width - 2.0 * kMargin, 20.0}};
}

Rectangle PlaceSlider(size_t index, int width) {
  return {{width - kSliderWidth - 2.0 * kMargin, 34.0 + kSliderLine * static_cast<double>(index)},
          {kSliderWidth, 20.0}};
}

double ToFraction(double factor) { return 0.5 + 0.5 * std::log(factor) / std::log(kSliderRange); }

void DrawTrack(const Rectangle& place, double filled, double mark, Canvas* canvas) {
  const double y = place.corner.y() + 0.5 * place.size.y();
  const auto line = [&](double to, const Color& color) {
    canvas->StrokeLine({place.corner.x(), y}, {place.corner.x() + to * place.size.x(), y}, 5.0, color);
  };
  line(1.0, kTrack);
  if (filled > 0.0) line(filled, kOn);
  canvas->FillCircle({place.corner.x() + mark * place.size.x(), y}, 8.0, panel::kMark);
}

void DrawHelp(int height, const Font& font, Canvas* canvas) {
  constexpr double kLine = 19.0;
  constexpr double kWidth = 410.0;
  constexpr double kKeys = 145.0;
  const double lines = static_cast<double>(ListHelp().size());
  const Vector2d corner(kMargin, height - kBar - kLine * lines - 3.0 * kMargin);
  canvas->FillRoundedRectangle(corner, {kWidth, kLine * lines + 1.2 * kMargin}, 10.0,
                               panel::MakeGround(0.93F));
  double y = corner.y() + 1.5 * kMargin;
  for (const HelpLine& line : ListHelp()) {
    canvas->DrawText(font, 13.0, {corner.x() + kMargin, y}, line.keys, kFaint);
    canvas->DrawText(font, 13.0, {corner.x() + kMargin + kKeys, y}, line.text, kText);
    y += kLine;
  }
}

}  // namespace

std::optional<Action> FindAction(int key) {
  for (const HelpLine& line : ListHelp()) {
    for (const auto& [its_key, action] : line.actions) {
      if (its_key == key) return action;
    }
  }
  return std::nullopt;
}

void Controls::Draw(const ControlsState& state, Image* image) {
  const int width = image->width;
  const int height = image->height;
  Canvas canvas(image);
  if (state.help) DrawHelp(height, font_, &canvas);
  if (!state.shown) return;
  canvas.FillRoundedRectangle({0.0, height - kBar}, {static_cast<double>(width), kBar}, 0.0, kGround);
  const double span = std::max(state.end - state.begin, 1e-9);
  DrawTrack(PlaceTime(width, height), std::clamp((state.now - state.begin) / span, 0.0, 1.0),
            std::clamp((state.time - state.begin) / span, 0.0, 1.0), &canvas);
  double right = kMargin;
  for (const Button& button : PlaceButtons(state, height)) {
    canvas.FillRoundedRectangle(button.place.corner, button.place.size, 6.0, button.on ? kOn : kButton);
    const Vector2d middle = button.place.corner + 0.5 * button.place.size;
    canvas.DrawText(font_, 14.0, {middle.x(), middle.y() + 5.0}, button.text, kText, Align::kCenter);
    if (button.action == Action::kFaster) {
      canvas.DrawText(font_, 14.0, {button.place.corner.x() + 36.0, middle.y() + 5.0},
                      fmt::format("{:g} x", state.speed), kFaint);
    }
    right = button.place.corner.x() + button.place.size.x();
  }
  canvas.DrawText(font_, 13.0, {right + 16.0, height - 17.0}, state.message, kFaint);
  if (state.sliders.empty()) return;
  const double lines = static_cast<double>(state.sliders.size());
  canvas.FillRoundedRectangle({width - kSliderWidth - 3.0 * kMargin, 8.0},
                              {kSliderWidth + 2.0 * kMargin, kSliderLine * lines + 12.0}, 10.0, kGround);
  for (size_t i = 0; i < state.sliders.size(); ++i) {
    const Rectangle place = PlaceSlider(i, width);
    canvas.DrawText(font_, 12.5, {place.corner.x(), place.corner.y() - 3.0}, state.sliders[i].name, kFaint);
    canvas.DrawText(font_, 12.5, {place.corner.x() + place.size.x(), place.corner.y() - 3.0},
                    fmt::format("{:.2f} x", state.sliders[i].factor), kText, Align::kRight);
    DrawTrack(place, 0.0, ToFraction(state.sliders[i].factor), &canvas);
  }
}

std::optional<ControlHit> Controls::Find(const ControlsState& state, int width, int height, double x,
                                         double y, const std::optional<ControlHit>& held) {
  if (!state.shown) return std::nullopt;
  const auto fraction = [&](const Rectangle& place) {
    return std::clamp((x - place.corner.x()) / place.size.x(), 0.0, 1.0);
  };
  using Kind = ControlHit::Kind;
  const Rectangle time = PlaceTime(width, height);
  if (held ? held->kind == Kind::kTime : time.Contains(x, y)) {
    return ControlHit{Kind::kTime, Action::kPlay, 0,
                      state.begin + fraction(time) * (state.end - state.begin)};
  }
  for (size_t i = 0; i < state.sliders.size(); ++i) {
    const Rectangle place = PlaceSlider(i, width);
    if (held ? held->kind == Kind::kSlider && held->slider == i : place.Contains(x, y)) {
      return ControlHit{Kind::kSlider, Action::kPlay, i, std::pow(kSliderRange, 2.0 * fraction(place) - 1.0)};
    }
  }
  if (held) return held;
  for (const Button& button : PlaceButtons(state, height)) {
    if (button.place.Contains(x, y)) return ControlHit{Kind::kButton, button.action};
  }
  return std::nullopt;
}

}  // namespace dexcheck
