#include "harness/view/viewer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "harness/base/interrupts.h"
#include "harness/view/controls.h"
#include "harness/view/pull.h"
#include "harness/view/scene_painter.h"
#include "harness/view/window.h"
#include "renders/run_decorations.h"

namespace dexcheck {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::array<double, 7> kSpeeds = {0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0};
constexpr double kTurn = 0.006;         // rad a pixel
constexpr double kZoom = 0.88;          // a notch
constexpr double kFrameTime = 0.02;     // s: at most so many pictures are drawn
constexpr double kNearest = 0.1;        // m
constexpr double kFarthest = 30.0;      // m
constexpr double kForceLength = 0.042;  // m, of the largest contact force so far
constexpr double kPullRadius = 0.006;   // m

/// A picture drawn elsewhere: the newest one is what counts.
class Studio {
 public:
  Studio(const FrameSource& source, int width, int height)
      : source_(source), thread_([this, width, height] { Work(width, height); }) {}
  ~Studio() {
    quit_ = true;
    thread_.join();
  }
  Studio(const Studio&) = delete;
  Studio& operator=(const Studio&) = delete;

  struct Order {
    long row = 0;
    SceneLook look;
    ControlsState controls;
  };
  void Ask(const Order& order) {
    const std::lock_guard lock(mutex_);
    order_ = order;
  }
  /// None when there is none since the last call. @throws what drawing threw.
  std::optional<Image> Take() {
    const std::lock_guard lock(mutex_);
    if (problem_) std::rethrow_exception(problem_);
    return std::exchange(image_, std::nullopt);
  }

 private:
  void Work(int width, int height) {
    try {
      ScenePainter painter(source_.model(), width, height);
      Controls controls;
      while (!quit_) {
        const auto begin = Clock::now();
        if (std::optional<Order> order = TakeOrder()) {
          Image image = painter.Paint(source_.Read(order->row), order->look);
          controls.Draw(order->controls, &image);
          const std::lock_guard lock(mutex_);
          image_ = std::move(image);
        }
        std::this_thread::sleep_until(begin + std::chrono::duration<double>(kFrameTime));
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      problem_ = std::current_exception();
    }
  }
  std::optional<Order> TakeOrder() {
    const std::lock_guard lock(mutex_);
    return std::exchange(order_, std::nullopt);
  }

  const FrameSource& source_;
  std::mutex mutex_;
  std::optional<Order> order_;
  std::optional<Image> image_;
  std::exception_ptr problem_;
  std::atomic<bool> quit_ = false;
  std::thread thread_;
};

/// One window on one source.
class Viewer {
 public:
  Viewer(const FrameSource& source, LiveRun* live, Window* window, const ViewerOptions& options,
         ControlsState controls)
      : source_(source),
        live_(live),
        window_(*window),
        options_(options),
        state_(std::move(controls)),
        studio_(source, options.width, options.height) {
    state_.live = live != nullptr;
    state_.end = source.end();
    view_.azimuth = DegToRad(143.0);
    view_.elevation = DegToRad(-14.0);
    view_.distance = 2.3;
  }

  /// Until the window is closed, or sliders were moved. @returns whether it was the sliders.
  bool Show(const std::string& title, const std::function<std::string()>& save) {
    while (!window_.is_closed() && !closed_ && !IsInterrupted()) {
      for (const InputEvent& event : window_.Poll(0.008)) Handle(event, save);
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
    if (row_ < 0) AimAt(0);
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
    Follow();
    const ViewFrame frame = source_.Read(row_);
    if (mouse_pull_) UpdatePull(frame);
    Studio::Order order{row_, {view_, state_.forces, MeasureForces(frame), pull_arrow_}, state_};
    studio_.Ask(order);
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
    const auto at = std::min_element(kSpeeds.begin(), kSpeeds.end(), [&](double a, double b) {
      return std::abs(a - state_.speed) < std::abs(b - state_.speed);
    });
    const long next = std::clamp<long>(at - kSpeeds.begin() + by, 0, static_cast<long>(kSpeeds.size()) - 1);
    state_.speed = kSpeeds[static_cast<size_t>(next)];
    if (live_ != nullptr) live_->SetSpeed(state_.speed);
  }

  // Camera.

  /// Where the object is, or else the model's middle.
  [[nodiscard]] Vector3d FindObject(long row) {
    const ViewFrame frame = source_.Read(row);
    const mjModel& model = source_.model();
    const int body = mj_name2id(&model, mjOBJ_BODY, frame.frame.object_body.c_str());
    if (body < 0) return Vector3d(model.stat.center);
    if (!data_) data_ = MakeData(model);
    SetRow(model, frame.frame, 0, data_.get());
    return BodyPose(*data_, body).translation();
  }

  void AimAt(long row) {
    row_ = row;
    followed_ = FindObject(row);
    view_.look_at = followed_ + Vector3d(-0.15, 0.05, 0.02);
  }

  void Follow() {
    const Vector3d now = FindObject(row_);
    if (state_.follow) view_.look_at += now - followed_;
    followed_ = now;
  }

  [[nodiscard]] double MeasureForces(const ViewFrame& frame) {
    const RowMatrixXd& forces = frame.frame.contact_forces;
    for (long k = 0; k < forces.cols() / 3; ++k) {
      const double size = forces.block<1, 3>(0, 3 * k).norm();
      if (std::isfinite(size)) largest_force_ = std::max(largest_force_, size);
    }
    return kForceLength / std::max(largest_force_, 1e-9);
  }

  // Mouse and keys.

  [[nodiscard]] Ray FindRay(double x, double y) const {
    const double half = 0.5 * options_.height;
    return CalcRay(view_, DegToRad(source_.model().vis.global.fovy), (x - 0.5 * options_.width) / half,
                   (half - y) / half);
  }

  void UpdatePull(const ViewFrame& frame) {
    const Pull pull = mouse_pull_->Find(frame, FindRay(mouse_.x, mouse_.y));
    live_->SetPull(pull);
    const Vector3d point = mouse_pull_->FindPoint(frame);
    pull_arrow_ = Arrow{point,
                        point + 0.3 * pull.force / std::max(pull.force.norm(), 3.0),
                        kPullRadius,
                        {1.0F, 0.85F, 0.1F, 1.0F}};
    state_.message = fmt::format("pulling at {} with {:.2f} N", pull.body, pull.force.norm());
  }

  void LetGo() {
    if (!mouse_pull_) return;
    mouse_pull_.reset();
    pull_arrow_.reset();
    live_->SetPull(std::nullopt);
    state_.message = "let go; the judge knows the pull";
  }

  void Handle(const InputEvent& event, const std::function<std::string()>& save) {
    using Kind = InputEvent::Kind;
    switch (event.kind) {
      case Kind::kPress:
        Press(event, save);
        break;
      case Kind::kRelease:
        Release(event);
        break;
      case Kind::kMove:
        Drag(event);
        break;
      case Kind::kScroll:
        view_.distance = std::clamp(view_.distance * std::pow(kZoom, event.scroll), kNearest, kFarthest);
        break;
      case Kind::kKey:
        PressKey(event.key, save);
        break;
    }
    mouse_ = event;
  }

  void Press(const InputEvent& event, const std::function<std::string()>& save) {
    button_ = event.button;
    held_ = event.button == InputEvent::Button::kLeft
                ? Controls::Find(state_, options_.width, options_.height, event.x, event.y)
                : std::nullopt;
    if (held_) {
      Click(*held_, save);
    } else if (event.control && live_ != nullptr && source_.rows() > 0 && !live_->is_finished()) {
      looks_back_ = false;
      mouse_pull_ = MousePull::Grab(live_->setup(), live_->model(), source_.Read(source_.rows() - 1),
                                    FindRay(event.x, event.y));
      state_.message = mouse_pull_ ? "" : "nothing to pull at here";
    } else {
      turning_ = true;
    }
  }

  void Release(const InputEvent& /*event*/) {
    turning_ = false;
    LetGo();
    if (held_ && held_->id == ControlId::kSlider) restart_ = true;
    held_.reset();
  }

  void Drag(const InputEvent& event) {
    const double x = event.x - mouse_.x;
    const double y = event.y - mouse_.y;
    if (held_ && (held_->id == ControlId::kTime || held_->id == ControlId::kSlider)) {
      held_ = Controls::Find(state_, options_.width, options_.height, event.x, event.y, held_);
      Slide(*held_);
    } else if (turning_ && button_ == InputEvent::Button::kLeft) {
      view_.azimuth -= kTurn * x;
      view_.elevation = std::clamp(view_.elevation - kTurn * y, DegToRad(-89.0), DegToRad(80.0));
    } else if (turning_) {
      const Vector3d right(std::sin(view_.azimuth), -std::cos(view_.azimuth), 0.0);
      view_.look_at += view_.distance / options_.height * (-x * right + y * Vector3d::UnitZ());
    }
  }

  void Slide(const ControlHit& hit) {
    if (hit.id == ControlId::kTime) LookBack(hit.value);
    if (hit.id == ControlId::kSlider) state_.sliders[hit.slider].factor = hit.value;
  }

  void Click(const ControlHit& hit, const std::function<std::string()>& save) {
    switch (hit.id) {
      case ControlId::kPlay:
        SetPlaying(!state_.playing);
        break;
      case ControlId::kStep:
        Step(1);
        break;
      case ControlId::kSlower:
        ChangeSpeed(-1);
        break;
      case ControlId::kFaster:
        ChangeSpeed(1);
        break;
      case ControlId::kFollow:
        state_.follow = !state_.follow;
        break;
      case ControlId::kForces:
        state_.forces = !state_.forces;
        break;
      case ControlId::kSave:
        state_.message = save();
        break;
      case ControlId::kTime:
      case ControlId::kSlider:
        Slide(hit);
        break;
    }
  }

  void PressKey(int key, const std::function<std::string()>& save) {
    switch (key) {
      case ' ':
        SetPlaying(!state_.playing);
        break;
      case kKeyRight:
        Step(1);
        break;
      case kKeyLeft:
        Step(-1);
        break;
      case '-':
        ChangeSpeed(-1);
        break;
      case '=':
      case '+':
        ChangeSpeed(1);
        break;
      case 'F':
        state_.follow = !state_.follow;
        break;
      case 'C':
        state_.forces = !state_.forces;
        break;
      case 'G':
        AimAt(std::max(row_, 0L));
        view_.look_at = followed_;
        view_.distance = 0.4;
        break;
      case 'S':
        if (live_ != nullptr) state_.message = save();
        break;
      case 'R':
        restart_ = live_ != nullptr;
        break;
      case 'Q':
      case kKeyEscape:
        closed_ = true;
        break;
      default:
        break;
    }
  }

  const FrameSource& source_;
  LiveRun* live_;  // null for a recording
  Window& window_;
  ViewerOptions options_;
  ControlsState state_;
  Viewpoint view_;
  long row_ = -1;
  bool looks_back_ = false;
  bool closed_ = false;
  bool restart_ = false;
  double played_ = 0.0;  // time that playing has come to, s
  Clock::time_point last_ = Clock::now();
  Vector3d followed_ = Vector3d::Zero();
  double largest_force_ = 0.0;
  MjDataPtr data_;
  InputEvent mouse_;
  InputEvent::Button button_ = InputEvent::Button::kLeft;
  bool turning_ = false;
  std::optional<ControlHit> held_;
  std::optional<MousePull> mouse_pull_;
  std::optional<Arrow> pull_arrow_;
  std::string title_;
  Studio studio_;
};

/// Assignments that multiply a scenario's gains.
std::vector<std::string> MakeGainOverrides(const Scenario& scenario, const std::vector<Slider>& sliders) {
  std::vector<std::string> overrides;
  const auto vector = [](const Vector6d& v) {
    return fmt::format("[{}, {}, {}, {}, {}, {}]", v[0], v[1], v[2], v[3], v[4], v[5]);
  };
  const ObjectGains& gains = scenario.control.gains;
  const double stiffness = sliders[0].factor;
  const double damping = sliders[1].factor;
  if (stiffness != 1.0 || damping != 1.0) {
    const Vector6d K_p = stiffness * gains.K_p;
    const Vector6d K_v = damping * gains.K_v;
    const bool has_frequency = scenario.text.find("natural_frequency") != std::string::npos;
    if (has_frequency) {
      const Vector6d omega = K_p.cwiseSqrt();
      overrides.push_back("control.natural_frequency=" + vector(omega));
      overrides.push_back("control.damping_ratio=" + vector(0.5 * K_v.cwiseQuotient(omega)));
    } else {
      overrides.push_back("control.K_p=" + vector(K_p));
      overrides.push_back("control.K_v=" + vector(K_v));
    }
  }
  if (sliders[2].factor != 1.0) {
    overrides.push_back(fmt::format("control.f_min={}", sliders[2].factor * scenario.control.f_min));
  }
  return overrides;
}

}  // namespace

void ViewRecording(const FrameSource& recording, const std::string& title, const ViewerOptions& options) {
  Window window(title, options.width, options.height);
  ControlsState controls;
  controls.playing = !options.paused;
  controls.speed = options.speed;
  controls.message = "drag: turn, wheel: nearer, space: play, arrows: step, G: grasp, Q: quit";
  Viewer(recording, nullptr, &window, options, controls).Show(title, [] { return std::string(); });
}

std::unique_ptr<LiveRun> ViewLive(const LiveRunMaker& make, const std::string& title,
                                  const ViewerOptions& options,
                                  const std::function<std::string(const LiveRun& run)>& save) {
  Window window(title, options.width, options.height);
  ControlsState controls;
  controls.playing = !options.paused;
  controls.speed = options.speed;
  controls.sliders = {{"stiffness K_p"}, {"damping K_v"}, {"squeeze f_min"}};
  controls.message =
      "Ctrl-drag: pull, drag: turn, space: pause, arrows: step, G: grasp, R: anew, S: save, Q: quit";
  std::unique_ptr<LiveRun> run = make({});
  const Scenario first = run->setup().scenario();  // of whose gains the sliders are factors
  while (true) {
    run->SetPaused(!controls.playing);
    Viewer viewer(*run, run.get(), &window, options, controls);
    const bool restart = viewer.Show(title, [&] { return save(*run); });
    run->Finish();
    if (!restart) return run;
    controls = viewer.state();
    controls.playing = true;
    controls.message = "";
    run = make(MakeGainOverrides(first, controls.sliders));
  }
}

}  // namespace dexcheck
