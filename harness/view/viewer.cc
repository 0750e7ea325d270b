#include "harness/view/viewer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

#include "harness/base/interrupts.h"
#include "harness/view/controls.h"
#include "harness/view/pointer.h"
#include "harness/view/studio.h"
#include "harness/view/window.h"

namespace dexcheck {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::array<double, 7> kSpeeds = {0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0};
constexpr double kForceLength = 0.042;    // m, of the largest contact force so far
constexpr double kArrowRadius = 0.006;    // m
constexpr double kPixelsOfANotch = 32.0;  // of the middle button's way that count as one notch of the wheel

/// One window on one source.
class Viewer {
 public:
  Viewer(const FrameSource& source, LiveRun* live, Window* window, const ViewerOptions& options,
         ControlsState controls, std::function<std::string()> save)
      : source_(source),
        live_(live),
        window_(*window),
        options_(options),
        state_(std::move(controls)),
        save_(std::move(save)),
        camera_(source, options.width, options.height),
        studio_(source, options.width, options.height) {
    state_.live = live != nullptr;
    state_.end = source.end();
  }

  /// Until the window is closed, or sliders were moved. @returns whether it was the sliders.
  bool Show(const std::string& title) {
    while (!window_.is_closed() && !closed_ && !IsInterrupted()) {
      for (const InputEvent& event : window_.Poll(0.008)) Handle(event);
      if (restart_) return true;
      Move();
      if (const std::optional<Image> image = studio_.Take()) window_.Show(*image);
      const std::string now = fmt::format("{} - {:.3f} s - {}", title, state_.time,
                                          source_.rows() == 0                        ? "coming to rest"
                                          : !state_.playing                          ? "paused"
                                          : live_ != nullptr && live_->is_finished() ? "finished"
                                                                                     : "running");
      if (now != title_) window_.SetTitle(now);
      title_ = now;
    }
    return false;
  }

  [[nodiscard]] const ControlsState& state() const { return state_; }

 private:
  /// The newest row of a live run, unless the user looks back.
  void Move() {
    const long rows = source_.rows();
    if (rows == 0) return;
    if (row_ < 0) camera_.AimAt(row_ = 0);
    state_.begin = source_.TimeAt(0);
    state_.now = source_.TimeAt(rows - 1);
    const auto wall = Clock::now();
    const double passed = std::chrono::duration<double>(wall - last_).count();
    last_ = wall;
    if (live_ != nullptr && !looks_back_) {
      Go(rows - 1);
    } else if (state_.playing) {
      PlayOn(passed, rows);
    }
    camera_.Follow(row_, state_.follow);
    const ViewFrame frame = source_.Read(row_);
    if (spring_) UpdateForce(frame);
    Studio::Order order{row_, {camera_.view(), state_.forces, MeasureForces(frame), arrow_}, state_};
    studio_.Request(order);
  }

  void Go(long row) {
    row_ = row;
    state_.time = source_.TimeAt(row);
  }

  /// Time goes on in what is recorded; a live run is taken up again at its end.
  void PlayOn(double passed, long rows) {
    played_ += state_.speed * passed;
    long row = row_;
    while (row + 1 < rows && source_.TimeAt(row + 1) <= played_) ++row;
    if (row + 1 == rows) {
      looks_back_ = false;
      if (live_ == nullptr) state_.playing = false;
    }
    if (row != row_) Go(row);
  }

  void LookBack(double time) {
    long low = 0;
    long high = source_.rows() - 1;
    while (low < high) {
      const long middle = (low + high + 1) / 2;
      if (source_.TimeAt(middle) <= time) {
        low = middle;
      } else {
        high = middle - 1;
      }
    }
    if (source_.rows() == 0) return;
    SetPlaying(false);
    looks_back_ = low + 1 < source_.rows();
    Go(low);
    played_ = state_.time;
  }

  void SetPlaying(bool playing) {
    if (playing && live_ == nullptr && row_ + 1 == source_.rows()) Go(0);
    state_.playing = playing;
    played_ = state_.time;
    if (live_ != nullptr) live_->SetPaused(!playing);
  }

  void Step(long steps) {
    SetPlaying(false);
    if (live_ != nullptr && !looks_back_ && steps > 0) {
      live_->Advance();
    } else if (source_.rows() > 0) {
      const long row = std::clamp(row_ + steps, 0L, source_.rows() - 1);
      LookBack(source_.TimeAt(row));
    }
  }

  void ChangeSpeed(int by) {
    const auto at = std::ranges::min_element(
        kSpeeds, [&](double a, double b) { return std::abs(a - state_.speed) < std::abs(b - state_.speed); });
    const long next = std::clamp<long>(at - kSpeeds.begin() + by, 0, static_cast<long>(kSpeeds.size()) - 1);
    state_.speed = kSpeeds[static_cast<size_t>(next)];
    if (live_ != nullptr) live_->SetSpeed(state_.speed);
  }

  [[nodiscard]] double MeasureForces(const ViewFrame& frame) {
    const RowMatrixXd& forces = frame.run->contact_forces;
    for (long k = 0; k < forces.cols() / 3; ++k) {
      const double size = forces.block<1, 3>(frame.row, 3 * k).norm();
      if (std::isfinite(size)) largest_force_ = std::max(largest_force_, size);
    }
    return kForceLength / std::max(largest_force_, 1e-9);
  }

  // Mouse and keys.

  void UpdateForce(const ViewFrame& frame) {
    const MouseForce force = spring_->Find(frame, camera_.FindRay(mouse_.x, mouse_.y));
    live_->SetForce(force);
    const Vector3d point = spring_->FindPoint(frame);
    arrow_ = Arrow{point,
                   point + 0.3 * force.force / std::max(force.force.norm(), 3.0),
                   kArrowRadius,
                   {1.0F, 0.85F, 0.1F, 1.0F}};
    state_.message = fmt::format("pulling at {} with {:.2f} N", force.body, force.force.norm());
  }

  void LetGo() {
    if (!spring_) return;
    spring_.reset();
    arrow_.reset();
    live_->SetForce(std::nullopt);
    state_.message = "let go; the checks know the force";
  }

  void Handle(const InputEvent& event) {
    using Kind = InputEvent::Kind;
    switch (event.kind) {
      case Kind::kPress:
        Press(event);
        break;
      case Kind::kRelease:
        Release();
        break;
      case Kind::kMove:
        Drag(event);
        break;
      case Kind::kScroll:
        camera_.Zoom(event.scroll);
        break;
      case Kind::kKey:
        if (const std::optional<Action> action = FindAction(event.key)) Act(*action);
        break;
    }
    mouse_ = event;
  }

  void Press(const InputEvent& event) {
    button_ = event.button;
    held_ = event.button == InputEvent::Button::kLeft
                ? Controls::Find(state_, options_.width, options_.height, event.x, event.y)
                : std::nullopt;
    if (held_ && held_->kind == ControlHit::Kind::kButton) {
      Act(held_->action);
    } else if (held_) {
      Slide(*held_);
    } else if (event.control && live_ != nullptr && source_.rows() > 0 && !live_->is_finished()) {
      looks_back_ = false;
      spring_ = MouseSpring::Grab(live_->setup(), live_->model(), source_.Read(source_.rows() - 1),
                                  camera_.FindRay(event.x, event.y));
      state_.message = spring_ ? "" : "nothing to pull at here";
    } else {
      turning_ = true;
    }
  }

  void Release() {
    turning_ = false;
    LetGo();
    if (held_ && held_->kind == ControlHit::Kind::kSlider) restart_ = true;
    held_.reset();
  }

  void Drag(const InputEvent& event) {
    const double x = event.x - mouse_.x;
    const double y = event.y - mouse_.y;
    if (held_ && held_->kind != ControlHit::Kind::kButton) {
      held_ = Controls::Find(state_, options_.width, options_.height, event.x, event.y, held_);
      Slide(*held_);
    } else if (turning_ && button_ == InputEvent::Button::kLeft) {
      camera_.Turn(x, y);
    } else if (turning_ && button_ == InputEvent::Button::kMiddle) {
      camera_.Zoom(y / kPixelsOfANotch);
    } else if (turning_) {
      camera_.Move(x, y);
    }
  }

  void Slide(const ControlHit& hit) {
    if (hit.kind == ControlHit::Kind::kTime) LookBack(hit.value);
    if (hit.kind == ControlHit::Kind::kSlider) state_.sliders[hit.slider].factor = hit.value;
  }

  void Act(Action action) {
    switch (action) {
      case Action::kPlay:
        return SetPlaying(!state_.playing);
      case Action::kStep:
        return Step(1);
      case Action::kStepBack:
        return Step(-1);
      case Action::kSlower:
        return ChangeSpeed(-1);
      case Action::kFaster:
        return ChangeSpeed(1);
      case Action::kRestart:
        restart_ = live_ != nullptr;
        return;
      case Action::kFreeCamera:
        state_.follow = false;
        return;
      case Action::kFollow:
        state_.follow = !state_.follow;
        return;
      case Action::kGrasp:
        if (source_.rows() > 0) camera_.AimAtObject(std::max(row_, 0L));
        return;
      case Action::kForces:
        state_.forces = !state_.forces;
        return;
      case Action::kSave:
        if (live_ != nullptr) state_.message = save_();
        return;
      case Action::kControls:
        state_.shown = !state_.shown;
        return;
      case Action::kHelp:
        state_.help = !state_.help;
        return;
      case Action::kClose:
        closed_ = true;
        return;
    }
  }

  const FrameSource& source_;
  LiveRun* live_;  // null for a recording
  Window& window_;
  ViewerOptions options_;
  ControlsState state_;
  std::function<std::string()> save_;
  ObjectCamera camera_;
  long row_ = -1;
  bool looks_back_ = false;
  bool closed_ = false;
  bool restart_ = false;
  double played_ = 0.0;  // time that playing has come to, s
  Clock::time_point last_ = Clock::now();
  double largest_force_ = 0.0;
  InputEvent mouse_;
  InputEvent::Button button_ = InputEvent::Button::kLeft;
  bool turning_ = false;
  std::optional<ControlHit> held_;
  std::optional<MouseSpring> spring_;
  std::optional<Arrow> arrow_;
  std::string title_;
  Studio studio_;
};

}  // namespace

void ViewRecording(const FrameSource& recording, const std::string& title, const ViewerOptions& options) {
  Window window(title, options.width, options.height);
  ControlsState controls;
  controls.playing = !options.paused;
  controls.speed = options.speed;
  controls.message = "F1: keys, drag: turn, wheel: nearer, space: play, arrows: step, Q: quit";
  Viewer(recording, nullptr, &window, options, controls, {}).Show(title);
}

std::unique_ptr<LiveRun> ViewLive(const LiveRunMaker& make, const std::string& title,
                                  const ViewerOptions& options,
                                  const std::function<std::string(const LiveRun& run)>& save) {
  Window window(title, options.width, options.height);
  ControlsState controls;
  controls.playing = !options.paused;
  controls.speed = options.speed;
  controls.message = "F1: keys, Ctrl-drag: pull, drag: turn, space: pause, arrows: step, S: save, Q: quit";
  std::unique_ptr<LiveRun> run = make({});
  const Scenario first = run->setup().scenario();  // of whose gains the sliders are factors
  controls.sliders = MakeGainSliders(first);
  while (true) {
    run->SetPaused(!controls.playing);
    bool restart = false;
    {
      // It draws this run in a thread of its own, and ends before the run does.
      Viewer viewer(*run, run.get(), &window, options, controls, [&] { return save(*run); });
      restart = viewer.Show(title);
      controls = viewer.state();
    }
    run->Finish();
    if (!restart) return run;
    controls.playing = true;
    controls.message = "";
    run = make(MakeGainOverrides(first, controls.sliders));
  }
}

}  // namespace dexcheck
