#pragma once

// Pages: of two files, of a campaign of faults, and of a run.

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "harness/corrections/printed_robot.h"
#include "harness/recordings/judge_recordings.h"
#include "harness/report/figure.h"
#include "harness/report/replay.h"
#include "harness/report/run_data.h"

namespace dexcheck {

/// Returns a whole HTML document that loads nothing: the verdict, the causes with their numbers, the terms
/// that were compared, and both robots one over the other. Each link is drawn by what its file states: rods
/// to the links that it carries, the axis of its joint, its centre of mass, and the ellipsoid that has its
/// mass and inertia. What a cause is about has the colour of its file.
/// @param result what `consistency --json` writes of the two.
std::string MakeFilesPage(const PrintedRobot& first, const PrintedRobot& second,
                          const nlohmann::ordered_json& result);

/// A whole HTML document that loads nothing: what was found, a matrix of the faults that were made and the
/// names that they got, and each of them. @param campaign as `mutate --json` writes it.
std::string MakeCampaignPage(const nlohmann::ordered_json& campaign);

// The page of evidence.

// The run as it is seen in space: pictures and the replay of its page.

/// A picture of the run.
struct Picture {
  std::filesystem::path file;  ///< PNG.
  std::string panel;           ///< Number in the paper, "11 (a)"; or empty.
  std::string title;
};

struct RunScene {
  std::vector<Picture> pictures;
  std::optional<ReplayData> replay;
};

/// The paper's Figure 11, robot and object at the run's beginning and end, and the replay. Empty when the log
/// has no positions of the engine.
/// @param folder gets the pictures' files.
/// @throws InputError that names the log and what is wrong with it.
RunScene MakeRunScene(const RunData& run, const std::filesystem::path& folder);

/// Content of the page besides the run.
struct PageContent {
  std::vector<Figure> figures;  ///< Plots that can be zoomed.
  RunScene scene;               ///< Pictures and replay.
  std::filesystem::path video;  ///< Empty for none.
  std::string video_link;       ///< From the page to the video, used when it is too large to be embedded.
};

/// A whole HTML document that loads nothing: verdict, evidence, replay, video, pictures, plots, checks,
/// inputs.
/// @throws InputError that names the log when its summary is none.
std::string MakePage(const RunData& run, const PageContent& content);

// The report of a recorded run: a page and its figures.

/// Files of a report.
struct ReportFiles {
  std::filesystem::path page;
  std::filesystem::path figures;  ///< Folder for the figures' PDF and PNG files; empty for none.
};

/// Makes pictures and replay of a run, as MakeRunScene.
using SceneMaker = std::function<RunScene(const RunData& run, const std::filesystem::path& folder)>;

/// RUN_DIR/report.html and RUN_DIR/figures.
ReportFiles MakeReportFiles(const std::filesystem::path& run_dir);

/// Writes the report, all of it or nothing. The page holds all that it shows; RUN_DIR/video.mp4, if it is
/// there, is embedded up to 20 MB.
/// @param run_dir folder with the run's log.h5.
/// @param make_scene called with a folder to put pictures in, from which they go to the figures' folder.
/// @throws InputError, one line, when there is no log, or one without rows, or a file cannot be written.
void WriteRunReport(const std::filesystem::path& run_dir, const ReportFiles& files,
                    const SceneMaker& make_scene = MakeRunScene);

/// A table for LaTeX with booktabs: tracking errors, and of each category of checks the one nearest its
/// bound. Its caption names the verdict, the program's commit and the command.
/// @throws InputError that names the log when its summary is none.
std::string MakeTexTable(const RunData& run);

/// Panels of the paper's Figures 12 and 13, as far as the log has their signals, and plots beside them: the
/// object's error, the other torques, how far friction is used.
std::vector<Figure> MakeMotionFigures(const RunData& run);

/// One figure for each category of checks that was evaluated: its checks' values as fractions of their
/// bounds.
std::vector<Figure> MakeResidualFigures(const RunData& run);

// The motion of a judged recording, for the replay in its page.

/// Time from which a page counts a recording's times: its begin where it is one of several, or has a clock's
/// time; otherwise 0.
double FindTimeBegin(const RecordingJudgement& judgement, int recording);

/// The first recording's: with the shapes of an MJCF, otherwise with rods between the joints. None for a
/// robot with ball joints or a base that moves.
/// @param file that the model was read from.
std::optional<ReplayData> MakeMotionReplay(const RobotModel& model, const std::filesystem::path& file,
                                           const RecordingJudgement& judgement);

// The page of a judged recording.

/// A whole HTML document that loads nothing: the verdict, the causes and those that the motion does not
/// distinguish, each joint's torques over time with their residuals and the noise, and the recorded motion.
/// @param model that judged. @param json of the judgement, as `judge --json` writes it.
/// @param replay of the first recording; none where it cannot be drawn.
std::string MakeJudgePage(const RobotModel& model, const RecordingJudgement& judgement,
                          const nlohmann::ordered_json& json, const ReplayData* replay = nullptr);

}  // namespace dexcheck
