#include "harness/report/write_report.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "controller/common/errors.h"
#include "harness/base/files.h"
#include "harness/base/interrupts.h"
#include "harness/report/run_figures.h"

namespace dexcheck {
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
    if (error || !fs::is_directory(folder_)) {
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
  const fs::path folder = fs::absolute(page).parent_path();
  content->video_link = fs::proximate(fs::absolute(video), folder, error).generic_string();
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
      folder->Add(drawings.path() / (figure.name + ".pdf"));
      folder->Add(drawings.path() / (figure.name + ".png"));
    }
    folder->Commit();
  }
  page.Commit();
}

}  // namespace dexcheck
