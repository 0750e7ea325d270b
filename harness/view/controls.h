#pragma once

// What can be clicked on in the window: buttons, the time line, sliders.

#include <optional>
#include <string>
#include <vector>

#include "renders/canvas.h"
#include "renders/image.h"

namespace dexcheck {

/// A number that a live run can be started with anew.
struct Slider {
  std::string name;
  double factor = 1.0;  ///< Of the scenario's own; from 1 / kSliderRange to kSliderRange.
};
inline constexpr double kSliderRange = 4.0;

/// What the controls show.
struct ControlsState {
  bool live = false;
  bool playing = true;
  bool forces = true;
  bool follow = true;
  bool shown = true;                         ///< Else there are no controls, and only keys work.
  bool help = false;                         ///< The list of keys.
  double time = 0.0;                         ///< Shown, s.
  double begin = 0.0, now = 0.0, end = 1.0;  ///< First recorded, last recorded so far, last at all, s.
  double speed = 1.0;
  std::vector<Slider> sliders;
  std::string message;
};

/// What a button or a key does.
enum class Action {
  kPlay,
  kStep,
  kStepBack,
  kSlower,
  kFaster,
  kRestart,
  kFreeCamera,
  kFollow,
  kGrasp,
  kForces,
  kSave,
  kControls,
  kHelp,
  kClose
};

/// By a key as InputEvent has it; none for a key that does nothing.
std::optional<Action> FindAction(int key);

/// Where a click went.
struct ControlHit {
  enum class Kind { kButton, kTime, kSlider };
  Kind kind = Kind::kButton;
  Action action = Action::kPlay;  ///< kButton.
  size_t slider = 0;              ///< kSlider.
  double value = 0.0;             ///< kTime: s; kSlider: the factor.
};

/// For the thread that made it, but for Find.
class Controls {
 public:
  void Draw(const ControlsState& state, Image* image);
  /// @param x, y in a picture of this size. @param held the control that the button went down on: it is found
  /// wherever the mouse is since.
  static std::optional<ControlHit> Find(const ControlsState& state, int width, int height, double x, double y,
                                        const std::optional<ControlHit>& held = {});

 private:
  Font font_{Font::SystemFolder() / "DejaVuSans.ttf"};
};

}  // namespace dexcheck
