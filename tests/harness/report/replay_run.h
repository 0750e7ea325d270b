#pragma once

// A run with a scene: the kinematic run of the renderer's tests, in a log.

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "harness/engine/engine.h"
#include "harness/engine/mjcf_file.h"
#include "harness/log/log_writer.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"
#include "tests/harness/report/report_run.h"
#include "tests/renders/kinematic_run.h"

namespace dexcheck::testing {

/// How far behind its desired place the object is, m: enough to see the two apart.
inline constexpr double kReplayLag = 0.1;

/// The kinematic run, with the object's desired pose ahead of it along x, turned by half a turn about z.
inline RunFrames MakeReplayRun(const mjModel& model, double duration, double step = 0.01) {
  RunFrames run = MakeKinematicRun(model, duration, step);
  run.desired_positions.col(0).array() += kReplayLag;
  run.desired_angles = RowMatrixXd::Constant(run.rows(), 3, 0.0);
  run.desired_angles.col(0).setConstant(kPi);
  return run;
}

/// Puts the shipped scene into a log.
inline void EmbedScene(LogWriter* log) {
  const std::filesystem::path mjcf = SourcePath("/mjcf/scene.xml");
  log->SetText("mjcf", "scene.xml");
  for (const std::string& file : ListMjcfFiles(mjcf))
    log->EmbedFile("inputs", "mjcf/" + file, ReadText(mjcf.parent_path() / file));
}

/// Adds signals, each with its rows, and writes these at their times.
inline void WriteRows(const std::vector<double>& times,
                      const std::vector<std::pair<SignalInfo, RowMatrixXd>>& signals, LogWriter* log) {
  for (const auto& [signal, rows] : signals) log->AddSignal(signal);
  log->StartRows();
  for (size_t i = 0; i < times.size(); ++i) {
    log->Row(LogWriter::kTime)[0] = times[i];
    for (size_t k = 0; k < signals.size(); ++k)
      std::ranges::copy(signals[k].second.row(static_cast<long>(i)),
                        log->Row(static_cast<int>(k) + 1).begin());
    log->EndRow();
  }
}

/// Writes FOLDER/log.h5 with the shipped scene. @returns what is in it.
inline RunFrames WriteReplayRun(const std::filesystem::path& folder, double duration, double step = 0.01) {
  const MjModelPtr model = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  const RunFrames run = MakeReplayRun(*model, duration, step);
  LogWriter log(folder / "log.h5", run.rows());
  log.SetText("scenario", "replayed");
  log.SetText("object_body", run.object_body);
  EmbedScene(&log);
  RowMatrixXd desired(run.rows(), 6);
  desired << run.desired_positions, run.desired_angles;
  WriteRows(run.times,
            {{{"engine/qpos", "m, rad", "positions", model->nq, {}, {}}, run.qpos},
             {{"contact/position", "m", "places", 12, {}, {}}, run.contact_positions},
             {{"contact/force", "N", "forces", 12, {}, {{"mu", run.friction}}}, run.contact_forces},
             {{"contact/normal", "1", "normals", 12, {}, {}}, run.contact_normals},
             {{"object/X_o", "m, rad", "pose", 6, {}, {}}, desired},
             {{"object/X_d", "m, rad", "desired", 6, {}, {}}, desired}},
            &log);
  log.SetText("summary", MakeReportSummary({.rows = run.rows(), .scenario = "replayed"}));
  log.Close();
  return run;
}

}  // namespace dexcheck::testing
