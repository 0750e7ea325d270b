#include "harness/report/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <iterator>
#include <memory>
#include <system_error>
#include <utility>

#include "controller/common/errors.h"
#include "harness/base/bounded_json.h"
#include "harness/base/files.h"
#include "harness/base/interrupts.h"
#include "harness/checks/check_table.h"
#include "harness/report/page_frame.h"
#include "renders/renderer.h"
#include "renders/video.h"
#include "renders/video_writer.h"
#include "renders/viewpoint.h"

namespace dexcheck {

namespace {

/// @param holds whether an object, as in the paper's figures.
std::vector<Picture> DrawConfigurations(const RecordedFrames& run, bool holds,
                                        const std::filesystem::path& folder) {
  VideoOptions options;
  options.width = 960;
  options.height = 600;
  options.camera = kRobotCamera;
  constexpr double kLongWay = 1.0;  // m, on which one wants to see how far it came
  const MjDataPtr data = MakeData(*run.model);
  if (FindWay(*run.model, run.frames, data.get()).length > kLongWay) options.inset = kCourseCamera;
  options.tracks = true;
  options.panel = false;
  VideoPainter painter({run.model.get(), &run.frames}, options);
  const std::string who = holds ? "Robot and object" : "Robot";
  const std::array<Picture, 2> pictures = {
      {{folder / "fig11a.png", holds ? "11 (a)" : "", who + " at the beginning"},
       {folder / "fig11b.png", holds ? "11 (b)" : "", who + " at the end"}}};
  WritePng(pictures[0].file, painter.Paint(0.0));
  WritePng(pictures[1].file, painter.Paint(run.frames.duration()));
  return {pictures.begin(), pictures.end()};
}

}  // namespace

RunScene MakeRunScene(const RunData& run, const std::filesystem::path& folder) {
  if (run.Find("engine/qpos") == nullptr) return {};
  const RecordedFrames frames = ReadRecordedFrames(run.log());
  return {DrawConfigurations(frames, !run.moves_joints(), folder),
          MakeReplayData(*frames.model, frames.frames)};
}

namespace {

using Json = nlohmann::ordered_json;

constexpr std::uintmax_t kLargestEmbeddedVideo = 20'000'000;  // bytes

/// The verdict in the words of the page.
struct Headline {
  const char* tone;  ///< CSS class.
  std::string word;
  std::string sentence;
};

Headline FindHeadline(const RunData& run) {
  if (run.is_cut_off()) {
    return {
        "open", "NO VERDICT",
        fmt::format("The run was cut off after {:.3f} s; what was recorded until then is below.", run.end())};
  }
  const std::string verdict = run.FindSummaryText("/verdict");
  if (verdict == "failed")
    return {"fail", "FAILED", "The run could not be completed: " + run.FindSummaryText("/failure")};
  if (verdict == "disagreement") {
    const std::string cause = run.FindSummaryText("/attribution/cause");
    return {"fail", "DISAGREEMENT",
            cause == "model"         ? "The two descriptions of the robot differ."
            : cause == "control law" ? "The torques are not those of the law, or do not do what is expected."
                                     : "The engine does not do what the equations say."};
  }
  if (run.checks().empty()) return {"open", "NOT CHECKED", "The run completed; nothing was checked."};
  std::string holds = DescribeWhatHolds(run.checks());
  holds.front() = static_cast<char>(std::toupper(holds.front()));
  return {"pass", "PASS", holds + "."};
}

/// A value with its unit; 0 has none.
std::string FormatWithUnit(double value, const std::string& unit) {
  return FormatShort(value) + (unit == "1" || value == 0.0 ? "" : " " + unit);
}

/// Of what may not be there: null.
Json OrNull(bool is_there, const Json& json) { return is_there ? json : Json(); }

class Page {
 public:
  Page(const RunData& run, const PageContent& content) : run_(run), content_(content) {}

  std::string Make() {
    Json json = {{"scenario", Text("scenario")},
                 {"description", run_.FindSummaryText("/description")},
                 {"version", Text("dexcheck_version")},
                 {"verdict", MakeVerdict()},
                 {"causes", run_.summary().value("causes", Json::array())},
                 {"categories", Json::array()},
                 {"tiles", MakeTiles()},
                 {"gain_card", run_.FindSummaryText("/gain_card")},
                 {"video", MakeVideo()},
                 {"pictures", MakePictures()},
                 {"inputs", MakeInputs()},
                 {"files", Json::array()}};
    for (const CheckCategory category : kCheckCategories)
      json["categories"].push_back(MakeCategory(category));
    AddFile("scenario.toml", "Scenario", true, &json["files"]);
    AddFile("robot/" + Text("robot"), "Parameters of the model: " + Text("robot"), false, &json["files"]);
    AddFile("mjcf/" + Text("mjcf"), "MJCF: " + Text("mjcf"), false, &json["files"]);
    const PlotGroup plots = {"", content_.figures, run_.time()};
    return AssemblePlotPage(fmt::format("{}: {}", FindHeadline(run_).word, Text("scenario")), kRunJs,
                            EmbedJson("run-page", json) + media_, {&plots, 1},
                            content_.scene.replay ? &*content_.scene.replay : nullptr);
  }

 private:
  std::string Text(const char* name) const { return run_.FindText(name); }

  [[nodiscard]] Json MakeVerdict() const {
    const Headline headline = FindHeadline(run_);
    const std::string cause = run_.FindSummaryText("/attribution/cause");
    const CheckRecord* const first = FindFirstFailure();
    return {{"tone", headline.tone},
            {"word", headline.word},
            {"sentence", headline.sentence},
            {"cause", cause == "none" ? "" : cause},
            {"evidence", run_.FindSummaryText("/attribution/evidence")},
            {"first_failure",
             first == nullptr ? Json() : Json{{"check", first->name}, {"time", first->failed_at}}},
            {"stopped_at", OrNull(run_.summary().value("interrupted", false), run_.end())}};
  }

  /// The check that failed first in time; null when none did in the run.
  [[nodiscard]] const CheckRecord* FindFirstFailure() const {
    const CheckRecord* first = nullptr;
    for (const CheckRecord& check : run_.checks()) {
      if (!check.failed || !IsTimed(check)) continue;
      if (first == nullptr || check.failed_at < first->failed_at) first = &check;
    }
    return first;
  }

  /// A category with its checks.
  [[nodiscard]] Json MakeCategory(CheckCategory category) const {
    CategoryStatus status(category);
    Json checks = Json::array();
    for (const CheckRecord& check : run_.checks()) {
      if (check.kind != category) continue;
      status.Add(check);
      checks.push_back(MakeCheck(check));
    }
    Json json = {{"name", NameOf(category)},
                 {"title", TitleOf(category)},
                 {"explanation", run_.Explain(category)},
                 {"tone", status.failed > 0                     ? "fail"
                          : status.checks == status.same_source ? "open"
                                                                : "pass"},
                 {"word", status.Describe()},
                 {"extent", ""},
                 {"checks", checks}};
    if (status.is_asked()) {
      json["extent"] =
          fmt::format("{} check{}, at most {} of a bound", status.checks, status.checks == 1 ? "" : "s",
                      FormatFraction(CalcFraction(status.nearest)));
    }
    if (status.not_reached > 0)
      json["extent"] = fmt::format("{}{}{} not reached", json["extent"].get<std::string>(),
                                   status.is_asked() ? "; " : "", status.not_reached);
    return json;
  }

  [[nodiscard]] Json MakeCheck(const CheckRecord& check) const {
    const double fraction = CalcFraction(check);
    std::string where = check.part;
    if (IsTimed(check)) where += fmt::format("{}{:.3f} s", where.empty() ? "" : ", ", check.at);
    const std::string cause = run_.FindSummaryText(("/attribution/checks/" + check.name).c_str());
    return {
        {"name", check.name},
        {"description", check.description},
        {"failed", check.failed},
        {"fails_from", OrNull(check.failed && IsTimed(check), check.failed_at)},
        {"is_equal", !check.failed && IsReached(check) && !IsTimed(check)},
        {"cause", check.failed ? cause : ""},
        {"status", IsTimed(check) || !IsReached(check) ? DescribeStatus(check) : ""},
        {"allowance",
         check.allowance > 0.0 && !check.failed ? FormatWithUnit(check.allowance, check.unit) : ""},
        {"worst",
         IsReached(check) ? FormatWithUnit(check.failed ? check.worst : check.residual, check.unit) : "–"},
        {"bound", FormatWithUnit(check.bound, check.unit)},
        {"of_bound", IsReached(check) ? FormatFraction(fraction) : ""},
        {"meter", 100.0 * std::clamp(std::isfinite(fraction) ? fraction : 1.0, 0.0, 1.0)},
        {"where", where}};
  }

  /// Values and what they are.
  [[nodiscard]] Json MakeTiles() const {
    Json tiles = Json::array();
    const auto add = [&](const std::string& value, const std::string& label) {
      tiles.push_back({value, label});
    };
    const auto add_error = [&](const char* pointer, const char* unit, const char* label) {
      const double value = run_.FindSummaryNumber(pointer);
      add(std::isfinite(value) ? FormatShort(value) + unit : std::string("–"), label);
    };
    if (std::isfinite(run_.FindSummaryNumber("/tracking/joint_error_max_rad"))) {
      add_error("/tracking/joint_error_max_rad", " rad", "largest error of a joint");
    } else {
      add_error("/tracking/position_error_max_m", " m", "largest position error of the object");
      add_error("/tracking/orientation_error_max_rad", " rad", "largest orientation error");
    }
    const double simulated = run_.FindSummaryNumber("/simulated_s");
    add(fmt::format("{:.4g} s", std::isfinite(simulated) ? simulated : run_.end()),
        fmt::format("simulated, {} steps", run_.time().size()));
    for (const CheckRecord& check : run_.checks()) {
      if (check.name == "cone_use")
        add(FormatFraction(check.worst), "of the fingertips' friction used, at most");
    }
    for (const nlohmann::json& one : run_.summary().value("torque_limited", nlohmann::json::array()))
      add(fmt::format("{:.3g} s", one.value("time_s", 0.0)),
          "torque limited: " + one.value("motor", std::string()));
    // By class of bodies that should not touch.
    const nlohmann::json clearance = run_.summary().value("clearance", nlohmann::json::object());
    for (const auto& [pairs, nearest] : clearance.items()) {
      std::string name = pairs;
      std::replace(name.begin(), name.end(), '_', ' ');
      add(fmt::format("{:.1f} mm", 1e3 * nearest.value("smallest_m", std::nan(""))),
          fmt::format("{}: nearest are {}", name, nearest.value("bodies", "")));
    }
    const double factor = run_.FindSummaryNumber("/speed/real_time_factor");
    if (std::isfinite(factor)) add(fmt::format("{:.2g} ×", factor), "real time");
    return tiles;
  }

  Json MakeVideo() {
    if (content_.video.empty()) return nullptr;
    const bool is_large = SizeOf(content_.video) > kLargestEmbeddedVideo;
    if (!is_large) media_ += EmbedBytes("run-video", ReadBytes(content_.video));
    return {{"is_embedded", !is_large},
            {"link", content_.video_link},
            {"name", content_.video.filename().string()}};
  }

  Json MakePictures() {
    Json pictures = Json::array();
    for (const Picture& picture : content_.scene.pictures) {
      const std::string id = fmt::format("run-picture-{}", pictures.size());
      media_ += EmbedBytes(id, ReadBytes(picture.file));
      pictures.push_back({{"panel", picture.panel}, {"title", picture.title}, {"data", id}});
    }
    return pictures;
  }

  void AddFile(const std::string& name, const std::string& title, bool open, Json* list) const {
    const std::vector<std::string> files = run_.log().ListFiles("inputs");
    if (std::ranges::find(files, name) == files.end()) return;
    list->push_back({{"title", title}, {"text", run_.log().ReadFile("inputs", name)}, {"open", open}});
  }

  /// Terms, texts, and whether a text is code.
  [[nodiscard]] Json MakeInputs() const {
    std::string overrides = Text("overrides");
    while (overrides.ends_with('\n')) overrides.pop_back();
    Json inputs = {{"Command", Text("command"), true},
                   {"Overrides", overrides.empty() ? "none" : overrides, !overrides.empty()}};
    constexpr std::array<std::array<const char*, 2>, 6> kTexts = {{{"Seed", "seed"},
                                                                   {"Model", "robot"},
                                                                   {"MJCF", "mjcf"},
                                                                   {"dexcheck", "dexcheck_version"},
                                                                   {"MuJoCo", "mujoco_version"},
                                                                   {"Machine", "machine"}}};
    for (const auto& [term, name] : kTexts) inputs.push_back({term, Text(name), false});
    return inputs;
  }

  const RunData& run_;
  const PageContent& content_;
  std::string media_;  // elements with the bytes of video and pictures
};

}  // namespace

std::string MakePage(const RunData& run, const PageContent& content) {
  try {
    return Page(run, content).Make();
  } catch (const nlohmann::json::exception& error) {
    throw InputError(run.log().path().string() + ": summary: " + DescribeJsonError(error));
  }
}

namespace {

namespace fs = std::filesystem;

/// Copies pictures into a folder, which it makes when it is not there. Destroyed before Commit, it leaves
/// nothing.
class FigureFolder {
 public:
  explicit FigureFolder(fs::path folder) : folder_(std::move(folder)) {
    const HeldSignals until_protected;
    std::error_code error;
    made_ = fs::create_directory(folder_, error);
    if (error || !IsFolder(folder_)) {
      throw InputError(folder_.string() +
                       ": cannot be made: " + (error ? error.message() : std::strerror(ENOTDIR)));
    }
    if (made_) protection_.emplace(folder_);
  }
  ~FigureFolder() {
    files_.clear();
    std::error_code ignored;
    if (made_) fs::remove(folder_, ignored);
  }
  FigureFolder(const FigureFolder&) = delete;
  FigureFolder& operator=(const FigureFolder&) = delete;

  void Add(const fs::path& picture) {
    files_.push_back(std::make_unique<PartialFile>(folder_ / picture.filename()));
    std::error_code error;
    fs::copy_file(picture, files_.back()->partial(), fs::copy_options::overwrite_existing, error);
    if (error) files_.back()->Fail(error.message());
  }

  void Commit() {
    for (const auto& file : files_) file->Commit();
    made_ = false;
    protection_.reset();
  }

 private:
  fs::path folder_;
  std::vector<std::unique_ptr<PartialFile>> files_;
  bool made_ = false;
  std::optional<TemporaryPath> protection_;  // of a folder that was made
};

/// The video beside the log, and how the page can link to it.
void AddVideo(const fs::path& run_dir, const fs::path& page, PageContent* content) {
  const fs::path video = run_dir / "video.mp4";
  std::error_code error;
  if (!fs::is_regular_file(video, error)) return;
  content->video = video;
  const fs::path folder = MakeAbsolute(page).parent_path();
  content->video_link = fs::proximate(MakeAbsolute(video), folder, error).generic_string();
}

}  // namespace

ReportFiles MakeReportFiles(const fs::path& run_dir) {
  return {run_dir / "report.html", run_dir / "figures"};
}

void WriteRunReport(const fs::path& run_dir, const ReportFiles& files, const SceneMaker& make_scene) {
  const RunData run(run_dir);
  PartialFile page(files.page);
  std::optional<FigureFolder> folder;
  if (!files.figures.empty()) folder.emplace(files.figures);

  const TemporaryFolder drawings;
  PageContent content;
  content.figures = MakeMotionFigures(run);
  std::vector<Figure> residuals = MakeResidualFigures(run);
  std::move(residuals.begin(), residuals.end(), std::back_inserter(content.figures));
  std::vector<Figure> printed;
  std::copy_if(content.figures.begin(), content.figures.end(), std::back_inserter(printed),
               [](const Figure& figure) { return figure.printed; });
  DrawFigures(printed, run.time(), drawings.path());
  content.scene = make_scene(run, drawings.path());
  AddVideo(run_dir, files.page, &content);
  page.Write(MakePage(run, content));

  if (folder) {
    for (const Picture& picture : content.scene.pictures) folder->Add(picture.file);
    for (const Figure& figure : printed) {
      for (const char* extension : kFigureFiles) folder->Add(drawings.path() / (figure.name + extension));
    }
    folder->Commit();
  }
  page.Commit();
}

}  // namespace dexcheck
