#include "harness/report/page.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
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
#include "harness/checks/failure_cause.h"
#include "harness/report/page_frame.h"
#include "harness/run/runner.h"
#include "renders/renderer.h"
#include "renders/video.h"
#include "renders/viewpoint.h"

namespace dexcheck {

namespace {

/// @param holds whether an object. @param is_papers whether they are the paper's figures.
std::vector<Picture> DrawConfigurations(const RecordedFrames& run, bool holds, bool is_papers,
                                        const std::filesystem::path& folder) {
  VideoOptions options;
  options.width = 960;
  options.height = 600;
  options.camera = kRobotCamera;
  constexpr double kLongWay = 1.0;  // m, on which one wants to see how far it came
  const MjDataPtr data = MakeData(*run.model);
  if (FindWay(*run.model, run.frames, data.get()).length > kLongWay) options.inset = kCourseCamera;
  options.panel = false;
  const RunPainter paint = MakePainter({run.model.get(), &run.frames}, options);
  const std::string who = holds ? "Robot and object" : "Robot";
  const std::array<Picture, 2> pictures = {
      {{folder / "fig11a.png", is_papers ? "11 (a)" : "", who + " at the beginning"},
       {folder / "fig11b.png", is_papers ? "11 (b)" : "", who + " at the end"}}};
  WritePng(pictures[0].file, paint(0.0));
  WritePng(pictures[1].file, paint(run.frames.duration()));
  return {pictures.begin(), pictures.end()};
}

}  // namespace

RunScene MakeRunScene(const RunData& run, const std::filesystem::path& folder) {
  if (run.Find("engine/qpos") == nullptr) return {};
  const RecordedFrames frames = ReadRecordedFrames(run.log());
  return {DrawConfigurations(frames, !run.moves_joints(), run.is_papers(), folder),
          MakeReplayData(*frames.model, frames.frames)};
}

namespace {

using Json = nlohmann::ordered_json;

constexpr std::uintmax_t kLargestEmbeddedVideo = 20'000'000;  // bytes

/// The verdict; none of a run that was cut off.
Answer FindAnswer(const RunData& run) {
  if (!run.is_cut_off()) return MakeRunAnswer(run.summary(), run.checks());
  return {
      Answer::Tone::kOpen, "NO VERDICT",
      fmt::format("the run was cut off after {:.3f} s; what was recorded until then is below.", run.end())};
}

/// A category with its checks, as summaries have them; the page's script shows the numbers.
Json MakeCategory(const RunData& run, CheckCategory category) {
  CategoryStatus status(category);
  Json checks = Json::array();
  for (const CheckRecord& check : run.checks()) {
    if (check.kind != category) continue;
    status.Add(check);
    const bool is_timed = IsTimed(check) || !IsReached(check);
    checks.push_back({{"name", check.name}, {"status", is_timed ? DescribeStatus(check) : ""}});
    checks.back().update(ToJson(check, is_timed));
  }
  return {{"name", NameOf(category)},
          {"title", TitleOf(category)},
          {"explanation", run.Explain(category)},
          {"tone", status.failed > 0                     ? "fail"
                   : status.checks == status.same_source ? "open"
                                                         : "pass"},
          {"word", status.Describe()},
          {"checks", checks}};
}

class Page {
 public:
  Page(const RunData& run, const PageContent& content) : run_(run), content_(content) {}

  std::string Make() {
    Answer answer = FindAnswer(run_);
    answer.sentence.front() = static_cast<char>(std::toupper(answer.sentence.front()));
    Json summary = run_.summary();
    summary.erase("checks");
    Json json = {{"scenario", Text("scenario")},
                 {"verdict",
                  {{"tone", NameOf(answer.tone)},
                   {"word", answer.word},
                   {"sentence", answer.sentence},
                   {"causes", answer.causes},
                   {"remarks", answer.remarks}}},
                 {"end", run_.end()},
                 {"steps", run_.time().size()},
                 {"summary", std::move(summary)},
                 {"categories", Json::array()},
                 {"video", MakeVideo()},
                 {"pictures", MakePictures()},
                 {"texts", Json::object()},
                 {"files", Json::array()}};
    for (const char* name :
         {"command", "overrides", "seed", "robot", "mjcf", "dexcheck_version", "mujoco_version", "machine"})
      json["texts"][name] = Text(name);
    for (const CheckCategory category : kCheckCategories)
      json["categories"].push_back(MakeCategory(run_, category));
    AddFile("scenario.toml", "Scenario", true, &json["files"]);
    AddFile("robot/" + Text("robot"), "Parameters of the model: " + Text("robot"), false, &json["files"]);
    AddFile("mjcf/" + Text("mjcf"), "MJCF: " + Text("mjcf"), false, &json["files"]);
    const PlotGroup plots = {"", content_.figures, run_.time()};
    return AssemblePlotPage(fmt::format("{}: {}", answer.word, Text("scenario")), kRunJs,
                            EmbedJson("run-page", json) + media_, {&plots, 1},
                            content_.scene.replay ? &*content_.scene.replay : nullptr);
  }

 private:
  std::string Text(const char* name) const { return run_.FindText(name); }

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

std::string MakeCampaignPage(const nlohmann::ordered_json& campaign) {
  return AssemblePage({.title = "faults made on purpose",
                       .styles = {},
                       .markup = {kPageHtml},
                       .data = EmbedJson("campaign-data", campaign),
                       .scripts = {kCampaignJs}});
}

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

namespace {

Json ListEntries(const Vector3d& v) { return {v[0], v[1], v[2]}; }

/// Position, m, and quaternion w, x, y, z.
Json DescribePose(const Pose& X) {
  const Vector4d q = ToQuaternion(X.linear());
  return {{"position", ListEntries(X.translation())}, {"quaternion", {q[0], q[1], q[2], q[3]}}};
}

/// The ellipsoid of even density that has an inertial's mass m and principal moments I: its semi-axes a
/// follow from I_x = m (a_y^2 + a_z^2) / 5. Where no such body exists, the axis is 0.
Json MakeEllipsoid(const PrintedInertial& inertial) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(ToTensor(inertial.I));
  const Vector3d& moments = principal.eigenvalues();
  Matrix3d axes = principal.eigenvectors();
  if (axes.determinant() < 0.0) axes.col(0) = -axes.col(0);
  Pose X = inertial.origin.CalcPose();
  X.linear() = X.linear() * axes;
  Vector3d size = Vector3d::Zero();
  for (int i = 0; i < 3 && inertial.mass.value > 0.0; ++i) {
    const double square = 2.5 * (moments.sum() - 2.0 * moments[i]) / inertial.mass.value;
    size[i] = std::sqrt(std::max(square, 0.0));
  }
  Json json = DescribePose(X);
  json["size"] = ListEntries(size);
  json["mass"] = inertial.mass.value;
  return json;
}

Json DescribeRobot(const PrintedRobot& robot) {
  static constexpr std::array<const char*, 5> kKinds = {"fixed", "hinge", "slide", "ball", "free"};
  Json links = Json::array();
  for (const PrintedLink& link : robot.links) {
    Json& json = links.emplace_back(DescribePose(link.origin.CalcPose()));
    json["name"] = link.name;
    json["joint"] = link.joint.name;
    json["parent"] = link.parent;
    json["kind"] = kKinds[static_cast<size_t>(link.joint.kind)];
    json["axis"] = ListEntries(link.joint.axis);
    json["anchor"] = ListEntries(link.joint.anchor);
    if (link.joint.range) {
      const auto& [lower, upper] = *link.joint.range;
      json["range"] = {lower.value, upper.value};
    }
    if (link.inertial) json["ellipsoid"] = MakeEllipsoid(*link.inertial);
  }
  return {{"file", std::filesystem::path(robot.source).filename().string()}, {"links", links}};
}

}  // namespace

std::string MakeFilesPage(const PrintedRobot& first, const PrintedRobot& second, const Json& result) {
  const Json robots = {DescribeRobot(first), DescribeRobot(second)};
  return AssemblePage(
      {.title = robots[0]["file"].get<std::string>() + " and " + robots[1]["file"].get<std::string>(),
       .styles = {},
       .markup = {kPageHtml},
       .data = EmbedJson("result", result) + EmbedJson("robots", robots),
       .scripts = {kThreeJs, kFilesJs}});
}

}  // namespace dexcheck
