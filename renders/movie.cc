#include "renders/movie.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/engine/engine.h"
#include "renders/compose.h"
#include "renders/course.h"
#include "renders/frame_line.h"
#include "renders/overlay.h"
#include "renders/renderer.h"
#include "renders/run_decorations.h"

namespace dexcheck {
namespace {

constexpr double kHistorySpan = 3.0;  // s
constexpr size_t kMostHistory = 240;
constexpr double kInsetHeight = 0.36;  // of the picture's
constexpr double kInsetAspect = 16.0 / 9.0;
constexpr double kWidestInset = 0.45;  // of the picture's width

constexpr double kNarrowShift = 0.15;   // of the picture's width
constexpr double kCourseMargin = 0.03;  // likewise

// A frame at k / fps belongs to the row recorded at that time even if the two quotients round differently.
constexpr double kTimeRounding = 1e-9;

double Duration(const RunFrames& run) { return run.times.back() - run.times.front(); }

/// The decades that hold a run's errors, at most six.
std::array<double, 2> ErrorRange(const std::vector<double>& errors) {
  double low = 1e300;
  double high = 0.0;
  for (const double error : errors) {
    if (!std::isfinite(error) || error <= 0.0) continue;
    low = std::min(low, error);
    high = std::max(high, error);
  }
  if (high == 0.0) return {1e-12, 1e-9};
  high = std::pow(10.0, std::ceil(std::log10(high)));
  low = std::pow(10.0, std::floor(std::log10(low)));
  constexpr double kMostDecades = 1e6;
  return {std::max(low, high / kMostDecades), high};
}

}  // namespace

/// Draws one run.
class MoviePainter::RunPainter {
 public:
  RunPainter(const RunView& view, const MovieOptions& options, int width)
      : model_((CheckRunFrames(*view.model, *view.frames), *view.model)),
        run_(*view.frames),
        options_(options),
        width_(width),
        camera_(ChooseCamera()),
        data_(MakeData(model_)),
        renderer_(model_, MakeRenderOptions()),
        decorator_(model_, run_, {options.forces, options.tracks, options.frames}, data_.get()),
        checks_(run_),
        error_range_(ErrorRange(run_.position_errors)) {
    if (options.panel) overlay_.emplace();
    if (options.free && (options.free->follow || !options.free->look_at)) FindObject();
    inset_height_ = static_cast<int>(std::lround(kInsetHeight * options.height));
    inset_width_ =
        static_cast<int>(std::lround(std::min(kInsetAspect * inset_height_, kWidestInset * width)));
    if (!options.inset.empty()) CheckCamera(model_, options.inset);
  }

  Image Paint(double time) {
    const long row = run_.RowAt(run_.times.front() + time + kTimeRounding);
    SetRow(model_, run_, row, data_.get());
    const std::vector<Decoration> decorations = decorator_.Make(row, *data_);
    Image image = options_.free ? renderer_.Render(*data_, FindFreeView(row), decorations)
                                : renderer_.Render(*data_, decorations);
    if (!options_.inset.empty()) PlaceInset(PaintInset(decorations), &image);
    if (overlay_) overlay_->Draw(MakeState(row), &image);
    return image;
  }

 private:
  [[nodiscard]] std::string ChooseCamera() const {
    constexpr const char* kUsual = "overview";
    if (!options_.camera.empty()) return options_.camera;
    return mj_name2id(&model_, mjOBJ_CAMERA, kUsual) >= 0 ? kUsual : kCourseCamera;
  }

  [[nodiscard]] RenderOptions MakeRenderOptions() {
    RenderOptions render;
    render.width = width_;
    render.height = options_.height;
    render.camera = camera_;
    render.samples = options_.samples;
    render.shadow_size = options_.shadow_size;
    // In a narrow picture the panel would cover the robot.
    if (options_.panel && width_ < options_.height * 5 / 4) render.shift_right = kNarrowShift;
    // Forces point into the object.
    if (options_.forces && run_.contacts() > 0) render.translucent_body = run_.object_body;
    if (camera_ == kCourseCamera || options_.inset == kCourseCamera) {
      render.course = FindCourse(model_, run_, MakeEdges(), data_.get());
    }
    return render;
  }

  /// What the whole run has to fit into: right of the panel, with a margin around.
  [[nodiscard]] ViewEdges MakeEdges() const {
    const double top = std::tan(0.5 * DegToRad(model_.vis.global.fovy));
    const double side = top * width_ / options_.height;
    const double margin = 2.0 * kCourseMargin * side;
    const double covered =
        options_.panel && camera_ == kCourseCamera ? Overlay::CalcCoveredWidth(width_, options_.height) : 0.0;
    return {side * (1.0 - 2.0 * covered / width_) - margin, side - margin, top - margin, top - margin};
  }

  /// @param row whose kinematics data_ has.
  [[nodiscard]] Viewpoint FindFreeView(long row) const {
    const FreeCamera& free = *options_.free;
    const Vector3d object = object_ < 0 ? object_start_ : Vector3d(BodyPose(*data_, object_).translation());
    const Vector3d way = free.follow ? Vector3d(object - object_start_) : Vector3d(Vector3d::Zero());
    const Vector3d target = free.look_at ? Vector3d(*free.look_at + way) : object;
    const double angle = free.orbit * (run_.times[static_cast<size_t>(row)] - run_.times.front());
    const Vector3d arm = free.from + way - target;
    return LookFrom(target + Eigen::AngleAxisd(angle, Vector3d::UnitZ()) * arm, target);
  }

  /// Where the object is at the beginning, which a free camera needs.
  void FindObject() {
    object_ = mj_name2id(&model_, mjOBJ_BODY, run_.object_body.c_str());
    if (object_ < 0)
      throw InputError(run_.source + ": object: no body " + Quote(run_.object_body) + " in the model");
    SetRow(model_, run_, 0, data_.get());
    object_start_ = BodyPose(*data_, object_).translation();
  }

  Image PaintInset(std::span<const Decoration> decorations) {
    return renderer_.Render(*data_, options_.inset, inset_width_, inset_height_, decorations);
  }

  [[nodiscard]] OverlayState MakeState(long row) const {
    const auto at = static_cast<size_t>(row);
    OverlayState state;
    state.title = run_.title;
    if (!run_.phases.empty()) state.title += ": " + run_.phases[static_cast<size_t>(row)];
    state.time = run_.times[at];
    if (!run_.position_errors.empty()) state.position_error = run_.position_errors[at];
    if (!run_.joint_errors.empty()) state.joint_error = run_.joint_errors[at];
    if (!run_.orientation_errors.empty()) state.orientation_error = run_.orientation_errors[at];
    state.history_span = kHistorySpan;
    state.history = MakeHistory(at);
    state.error_low = error_range_[0];
    state.error_high = error_range_[1];
    if (!run_.checks.empty()) {
      for (const CheckKind kind :
           {CheckKind::kModel, CheckKind::kBalance, CheckKind::kPrediction, CheckKind::kAssumption}) {
        const CheckHistory::Standing standing = checks_.At(kind, row);
        QuestionStatus& question = state.questions.emplace_back();
        question.name = NameOf(kind);
        question.asked = standing.check != nullptr;
        if (!question.asked) continue;
        question.check = standing.check->name;
        question.worst = standing.worst;
        question.bound = standing.check->bound;
      }
    }
    state.legend = decorator_.MakeLegend();
    return state;
  }

  /// The largest error of each of at most kMostHistory spans.
  [[nodiscard]] std::vector<Vector2d> MakeHistory(size_t row) const {
    std::vector<Vector2d> history;
    if (run_.position_errors.empty()) return history;
    const auto first = static_cast<size_t>(run_.RowAt(run_.times[row] - kHistorySpan));
    const size_t stride = (row - first) / kMostHistory + 1;
    // Groups begin at multiples of the stride, so that a group stays the same from frame to frame.
    for (size_t begin = first - first % stride; begin <= row; begin += stride) {
      const size_t end = std::min(begin + stride, row + 1);
      const auto errors = run_.position_errors.begin();
      const double worst =
          *std::max_element(errors + static_cast<long>(begin), errors + static_cast<long>(end));
      history.emplace_back(run_.times[end - 1], worst);
    }
    return history;
  }

  const mjModel& model_;
  int object_ = -1;  // body; with a free camera
  Vector3d object_start_ = Vector3d::Zero();
  const RunFrames& run_;
  MovieOptions options_;
  int width_;
  std::string camera_;
  int inset_width_ = 0;
  int inset_height_ = 0;
  MjDataPtr data_;
  Renderer renderer_;
  RunDecorator decorator_;
  CheckHistory checks_;
  std::array<double, 2> error_range_;
  std::optional<Overlay> overlay_;
};

MoviePainter::MoviePainter(std::span<const RunView> runs, const MovieOptions& options) {
  Require(runs.size() == 1 || runs.size() == 2, "runs", "must be one or two",
          static_cast<double>(runs.size()));
  const int width = options.width / static_cast<int>(runs.size());
  for (const RunView& run : runs) painters_.push_back(std::make_unique<RunPainter>(run, options, width));
}

MoviePainter::~MoviePainter() = default;

Image MoviePainter::Paint(double time) {
  Image image = painters_.front()->Paint(time);
  if (painters_.size() == 1) return image;
  return PlaceBeside(image, painters_.back()->Paint(time));
}

long CountFrames(std::span<const RunView> runs, int fps) {
  double longest = 0.0;
  for (const RunView& run : runs) {
    CheckRunFrames(*run.model, *run.frames);
    longest = std::max(longest, Duration(*run.frames));
  }
  constexpr double kMostFrames = 1e7;
  Require(longest * fps <= kMostFrames, "frames", "must be at most ten million", longest * fps);
  return std::max(1L, std::lround(longest * fps));
}

bool RenderMovie(std::span<const RunView> runs, const MovieOptions& options, VideoWriter* video,
                 const std::function<bool(long done, long total)>& progress) {
  Require(options.workers >= 1, "workers", "must be positive", options.workers);
  const long frames = CountFrames(runs, options.fps);
  const auto make_painter = [&]() -> FrameLine::Painter {
    return [painter = std::make_shared<MoviePainter>(runs, options), fps = options.fps](long frame) {
      return painter->Paint(static_cast<double>(frame) / fps);
    };
  };
  FrameLine line(make_painter, frames, options.workers, options.width, options.height);
  for (long frame = 0; frame < frames; ++frame) {
    video->Write(line.Take());
    if (progress && !progress(frame + 1, frames)) return false;
  }
  return true;
}

}  // namespace dexcheck
