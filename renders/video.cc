#include "renders/video.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/process_pool.h"
#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"
#include "renders/overlay.h"
#include "renders/renderer.h"
#include "renders/viewpoint.h"

namespace dexcheck {

namespace {

/// @throws InputError for another name, std::invalid_argument for options that H.264 cannot take.
const EncodingOptions& Checked(const EncodingOptions& options, const std::filesystem::path& path) {
  RequireExtension(path, ".mp4");
  constexpr int kLargest = 16384;
  const auto check_size = [](const char* name, int value) {
    Require(value >= 2 && value <= kLargest && value % 2 == 0, name, "must be even and from 2 to 16384",
            value);
  };
  check_size("video width", options.width);
  check_size("video height", options.height);
  Require(options.fps >= 1 && options.fps <= 240, "frames a second", "must be from 1 to 240", options.fps);
  return options;
}

/// ffmpeg and its arguments. The same pictures give the same bytes: without cpu-independent, x264 picks code
/// by processor, and its AVX-512 code gives varying bytes for the same frames.
std::vector<std::string> MakeCommand(const PartialFile& file, const EncodingOptions& options) {
  const std::string size = std::to_string(options.width) + "x" + std::to_string(options.height);
  std::vector<std::string> words = {FindProgram("ffmpeg")};
  const auto add = [&](std::initializer_list<std::string> some) {
    words.insert(words.end(), some.begin(), some.end());
  };
  add({"-v", "error"});
  add({"-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", std::to_string(options.fps)});
  add({"-i", "pipe:0"});
  add({"-vf", "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p"});
  add({"-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"});
  add({"-g", std::to_string(2 * options.fps), "-threads", "1"});
  add({"-c:v", "libx264", "-preset", "veryfast", "-crf", "21", "-x264-params", "cpu-independent=1"});
  add({"-movflags", "+faststart", "-f", "mp4"});
  add({"-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"});
  add({"-y", "file:" + file.partial().string()});
  return words;
}

}  // namespace

VideoWriter::VideoWriter(const std::filesystem::path& path, const EncodingOptions& options)
    : file_(path), options_(Checked(options, path)) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) file_.Fail(std::strerror(errno));
  input_ = FileDescriptor(ends[0]);
  const int messages = messages_.descriptor();
  process_.emplace("ffmpeg", Program{MakeCommand(file_, options_), ends[1], messages, messages});
  ::close(ends[1]);
}

VideoWriter::~VideoWriter() { CloseInput(); }

void VideoWriter::CloseInput() {
  // Also of copies that processes forked meanwhile have.
  if (input_.is_open()) ::shutdown(input_.get(), SHUT_RDWR);
  input_.Close();
}

void VideoWriter::Write(const Image& image) {
  Require(image.width == options_.width, "frame width", "must be the video's", image.width);
  Require(image.height == options_.height, "frame height", "must be the video's", image.height);
  const std::string_view bytes(reinterpret_cast<const char*>(image.rgb.data()), image.rgb.size());
  if (!Send(input_.get(), bytes)) {
    FinishEncoding();
    file_.Fail("ffmpeg ended too early");
  }
  ++frames_;
}

void VideoWriter::Finish() {
  if (frames_ == 0) file_.Fail("there are no frames");
  FinishEncoding();
  file_.Commit();
}

void VideoWriter::FinishEncoding() {
  CloseInput();
  const ProcessEnd end = process_->Wait();
  if (end.has_succeeded()) return;
  std::string reason = messages_.ReadLastLine();
  if (end.exit_code == kNotFoundExitCode) reason = "ffmpeg cannot be run (Debian's package ffmpeg has it)";
  file_.Fail(end.signal != 0 ? end.Describe("") : reason.empty() ? "ffmpeg failed" : "ffmpeg: " + reason);
}

namespace {

constexpr double kHistorySpan = 3.0;  // s
constexpr size_t kMostHistory = 240;
constexpr double kInsetHeight = 0.36;  // of the picture's
constexpr double kInsetAspect = 16.0 / 9.0;
constexpr double kWidestInset = 0.45;  // of the picture's width
constexpr double kDown = -0.5;         // of a look at the object, against 1 along the floor

constexpr double kNarrowShift = 0.15;   // of the picture's width
constexpr double kCourseMargin = 0.03;  // fraction of the picture

// A frame at k / fps belongs to the row recorded at that time even if the two quotients round differently.
constexpr double kTimeRounding = 1e-9;

/// The decades that hold a run's errors, at most six, and none below 1 nm.
std::array<double, 2> ErrorRange(const std::vector<double>& errors) {
  double low = 1e300;
  double high = 0.0;
  for (const double error : errors) {
    if (!std::isfinite(error) || error <= 0.0) continue;
    low = std::min(low, error);
    high = std::max(high, error);
  }
  constexpr double kLeast = 1e-9, kMostDecades = 1e6;
  high = std::max(std::pow(10.0, std::ceil(std::log10(high))), 1e3 * kLeast);
  low = std::pow(10.0, std::floor(std::log10(low)));
  return {std::clamp(low, std::max(kLeast, high / kMostDecades), 0.1 * high), high};
}

const Color kForce = MakeColor(0xe0102e);
const Color kCone = MakeColor(0x2fb7ff, 0.30F);

// Sizes that suit a hand, m.
constexpr double kConeHeight = 0.026;
constexpr double kForceRadius = 0.0018;

/// The contact forces of a row, each in its friction cone. @param meters_per_newton as CalcMetersPerNewton
/// has it.
std::vector<Decoration> MakeForces(const RunFrames& run, long row, double meters_per_newton) {
  std::vector<Decoration> decorations;
  if (run.contact_forces.size() == 0) return decorations;
  for (long k = 0; k < run.contacts(); ++k) {
    const Vector3d p = ContactVector(run.contact_positions, row, k);
    const Vector3d force = ContactVector(run.contact_forces, row, k);
    if (!p.allFinite() || !force.allFinite() || force.isZero()) continue;
    decorations.emplace_back(Arrow{p, p + meters_per_newton * force, kForceRadius, kForce});
    if (run.contact_normals.size() == 0 || !(run.friction > 0.0)) continue;
    const Vector3d normal = ContactVector(run.contact_normals, row, k);
    if (!normal.allFinite() || normal.isZero()) continue;
    decorations.emplace_back(Cone{p, normal.normalized(), kConeHeight, std::atan(run.friction), kCone});
  }
  return decorations;
}

/// The object's desired way on the floor, with a bar across it after each metre; none of a shorter way.
std::vector<Decoration> MakeWay(const RunFrames& run) {
  constexpr double kPiece = 0.05, kHalfBar = 0.15, kRadius = 0.008;  // m
  constexpr size_t kMost = 2000;
  const Color color = MakeColor(0xf4a340);
  std::vector<Decoration> way;
  double length = 0.0;
  Vector3d from = Vector3d::Zero();
  for (long row = 0; row < run.desired_positions.rows() && way.size() < kMost; ++row) {
    const Vector3d to(run.desired_positions(row, 0), run.desired_positions(row, 1), 0.0);
    if (row == 0) from = to;
    const double piece = (to - from).norm();
    if (!(piece > kPiece)) continue;
    way.emplace_back(Arrow{from, to, kRadius, color, false});
    if (std::floor(length + piece) > std::floor(length)) {
      const Vector3d across = kHalfBar * Vector3d::UnitZ().cross(to - from) / piece;
      way.emplace_back(Arrow{to - across, to + across, kRadius, color, false});
    }
    length += piece;
    from = to;
  }
  return length < 1.0 ? std::vector<Decoration>() : way;
}

/// The key to their colours.
std::vector<LegendEntry> MakeForceLegend(const RunFrames& run) {
  std::vector<LegendEntry> legend;
  if (run.contact_forces.size() == 0) return legend;
  legend.push_back({"force on the object", kForce});
  if (run.friction > 0.0) legend.push_back({"friction cone", {kCone[0], kCone[1], kCone[2], 1.0F}});
  return legend;
}

/// Draws one run.
class Painter {
 public:
  Painter(const RunView& view, const VideoOptions& options)
      : model_((CheckRunFrames(*view.model, *view.frames), *view.model)),
        run_(*view.frames),
        options_(options),
        camera_(ChooseCamera()),
        data_(MakeData(model_)),
        renderer_(model_, MakeRenderOptions()),
        meters_per_newton_(CalcMetersPerNewton(run_)),
        checks_(run_),
        error_range_(ErrorRange(run_.position_errors)),
        way_(MakeWay(run_)) {
    if (options.panel) overlay_.emplace();
    for (const std::string& camera : {camera_, options.inset}) {
      if (IsOwn(camera, kObjectCamera)) FindObject();
    }
    bearing_ = FindWay(model_, run_, data_.get()).bearing;
    inset_height_ = static_cast<int>(std::lround(kInsetHeight * options.height));
    inset_width_ =
        static_cast<int>(std::lround(std::min(kInsetAspect * inset_height_, kWidestInset * options.width)));
    if (!options.inset.empty() && !IsOwn(options.inset, kRobotCamera) && !IsOwn(options.inset, kObjectCamera))
      CheckCamera(model_, options.inset);
  }

  Image Paint(double time) {
    const long row = run_.RowAt(run_.times.front() + time + kTimeRounding);
    SetRow(model_, run_, row, data_.get());
    std::vector<Decoration> decorations = way_;
    if (options_.forces) {
      for (const Decoration& force : MakeForces(run_, row, meters_per_newton_)) decorations.push_back(force);
    }
    const std::optional<Viewpoint> view = FindOwnView(camera_, MakeEdges());
    Image image = view ? renderer_.Render(*data_, *view, options_.width, options_.height, decorations)
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
    render.width = options_.width;
    render.height = options_.height;
    const bool is_own = IsOwn(camera_, kRobotCamera) || IsOwn(camera_, kObjectCamera);
    render.camera = is_own ? kCourseCamera : camera_;
    render.samples = options_.samples;
    render.shadow_size = options_.shadow_size;
    // In a narrow picture the panel would cover the robot.
    if (options_.panel && options_.width < options_.height * 5 / 4) render.shift_right = kNarrowShift;
    // Forces point into the object.
    if (options_.forces && run_.contacts() > 0) render.translucent_body = run_.object_body;
    if (camera_ == kCourseCamera || options_.inset == kCourseCamera) {
      render.course = FindCourse(model_, run_, MakeEdges(), data_.get());
    }
    return render;
  }

  /// Part of the picture for the whole run: right of the panel, with a margin around.
  [[nodiscard]] ViewEdges MakeEdges() const {
    const double top = std::tan(0.5 * DegToRad(model_.vis.global.fovy));
    const double side = top * options_.width / options_.height;
    const double margin = 2.0 * kCourseMargin * side;
    const double covered = options_.panel && (camera_ == kCourseCamera || IsOwn(camera_, kRobotCamera))
                               ? Overlay::CalcCoveredWidth(options_.width, options_.height)
                               : 0.0;
    return {side * (1.0 - 2.0 * covered / options_.width) - margin, side - margin, top - margin,
            top - margin};
  }

  /// Finds the body that the camera "object" looks at.
  void FindObject() {
    object_ = mj_name2id(&model_, mjOBJ_BODY, run_.object_body.c_str());
    if (object_ < 0)
      throw InputError(run_.source + ": object: no body " + Quote(run_.object_body) + " in the model");
  }

  /// Whether a name means one of the cameras below: an MJCF's camera of this name comes first.
  [[nodiscard]] bool IsOwn(const std::string& name, const char* own) const {
    return name == own && mj_name2id(&model_, mjOBJ_CAMERA, own) < 0;
  }

  /// Viewpoint of the camera "robot" or "object"; none for others.
  /// @param edges of the picture. data_ has the row's kinematics.
  [[nodiscard]] std::optional<Viewpoint> FindOwnView(const std::string& camera,
                                                     const ViewEdges& edges) const {
    if (IsOwn(camera, kRobotCamera)) return FindInstant(model_, bearing_, edges, *data_);
    if (!IsOwn(camera, kObjectCamera)) return std::nullopt;
    // From where a camera of the hand's stands, and otherwise from where one sees the robot.
    const int hand = mj_name2id(&model_, mjOBJ_CAMERA, "grasp");
    const Vector3d from =
        hand >= 0 ? Vector3d(data_->cam_xpos + 3 * hand)
                  : Vector3d(BodyPose(*data_, object_).translation() -
                             Vector3d(std::cos(bearing_), std::sin(bearing_), kDown).normalized());
    return FindCloseUp(model_, object_, from, *data_);
  }

  Image PaintInset(std::span<const Decoration> decorations) {
    const double top = std::tan(0.5 * DegToRad(model_.vis.global.fovy));
    const double side = top * inset_width_ / inset_height_;
    if (const std::optional<Viewpoint> view = FindOwnView(options_.inset, {side, side, top, top}))
      return renderer_.Render(*data_, *view, inset_width_, inset_height_, decorations);
    return renderer_.Render(*data_, options_.inset, inset_width_, inset_height_, decorations);
  }

  [[nodiscard]] OverlayState MakeState(long row) const {
    OverlayState state = MakeOverlayState(run_, row, checks_.ListCategories(row));
    state.history_span = kHistorySpan;
    state.history = MakeHistory(static_cast<size_t>(row));
    state.error_low = error_range_[0];
    state.error_high = error_range_[1];
    if (options_.forces) state.legend = MakeForceLegend(run_);
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
  double bearing_ = 0.0;  // of views that the run's way determines, rad
  int object_ = -1;       // body; for cameras that look at it
  const RunFrames& run_;
  VideoOptions options_;
  std::string camera_;
  int inset_width_ = 0;
  int inset_height_ = 0;
  MjDataPtr data_;
  Renderer renderer_;
  double meters_per_newton_;
  CheckHistory checks_;
  std::array<double, 2> error_range_;
  std::vector<Decoration> way_;
  std::optional<Overlay> overlay_;
};

}  // namespace

RunPainter MakePainter(const RunView& run, const VideoOptions& options) {
  return [painter = std::make_shared<Painter>(run, options)](double time) { return painter->Paint(time); };
}

long CountFrames(const RunView& run, int fps) {
  CheckRunFrames(*run.model, *run.frames);
  const double frames = run.frames->duration() * fps;
  constexpr double kMostFrames = 1e7;
  Require(frames <= kMostFrames, "frames", "must be at most ten million", frames);
  return std::max(1L, std::lround(frames));
}

bool RenderVideo(const RunView& run, const VideoOptions& options, VideoWriter* video,
                 const std::function<bool(long done, long total)>& progress) {
  Require(options.workers >= 1, "workers", "must be positive", options.workers);
  const long frames = CountFrames(run, options.fps);
  RunPainter painter;  // made in each of the processes
  const auto paint = [&](size_t frame) {
    if (!painter) painter = MakePainter(run, options);
    const Image image = painter(static_cast<double>(frame) / options.fps);
    return std::string(image.rgb.begin(), image.rgb.end());
  };
  bool goes_on = true;
  Image image(options.width, options.height);
  const auto write = [&](size_t frame, const std::string& rgb) {
    Require(rgb.size() == image.rgb.size(), "bytes of a frame", "must be the video's",
            static_cast<double>(rgb.size()));
    std::ranges::copy(rgb, image.rgb.begin());
    video->Write(image);
    goes_on = !progress || progress(static_cast<long>(frame) + 1, frames);
  };
  const auto count = static_cast<size_t>(frames);
  return RunJobs("drawing", count, options.workers, paint, write, [&] { return !goes_on; }) == count;
}

}  // namespace dexcheck
