#pragma once

// A run with a scene: the kinematic run of the renderer's tests, in a log.

#include <filesystem>

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

/// Writes FOLDER/log.h5 with the shipped scene. @returns what is in it.
inline RunFrames WriteReplayRun(const std::filesystem::path& folder, double duration, double step = 0.01) {
  const std::filesystem::path mjcf = SourcePath("/mjcf/scene.xml");
  const MjModelPtr model = LoadMjcf(mjcf);
  const RunFrames run = MakeReplayRun(*model, duration, step);
  LogWriter log(folder / "log.h5", run.rows());
  log.SetText("scenario", "replayed");
  log.SetText("object_body", run.object_body);
  log.SetText("mjcf", "scene.xml");
  for (const std::string& file : ListMjcfFiles(mjcf)) {
    log.EmbedFile("inputs", "mjcf/" + file, ReadText(mjcf.parent_path() / file));
  }
  const auto add = [&](const char* name, const char* unit, long width) {
    SignalInfo info{name, unit, name, static_cast<int>(width), {}, {}};
    if (std::string(name) == "contact/force") info.attributes["mu"] = run.friction;
    return log.AddSignal(info);
  };
  const int qpos = add("engine/qpos", "m, rad", run.qpos.cols());
  const int position = add("contact/position", "m", run.contact_positions.cols());
  const int force = add("contact/force", "N", run.contact_forces.cols());
  const int normal = add("contact/normal", "1", run.contact_normals.cols());
  const int X_o = add("object/X_o", "m, rad", 6);
  const int X_d = add("object/X_d", "m, rad", 6);
  log.StartRows();
  const auto copy = [&](int signal, const auto& row) {
    std::copy_n(row.data(), row.size(), log.Row(signal).begin());
  };
  for (long row = 0; row < run.rows(); ++row) {
    log.Row(LogWriter::kTime)[0] = run.times[static_cast<size_t>(row)];
    copy(qpos, run.qpos.row(row));
    copy(position, run.contact_positions.row(row));
    copy(force, run.contact_forces.row(row));
    copy(normal, run.contact_normals.row(row));
    Vector6d desired;
    desired << run.desired_positions.row(row).transpose(), run.desired_angles.row(row).transpose();
    copy(X_d, desired);
    copy(X_o, desired);
    log.EndRow();
  }
  log.SetText("summary", MakeReportSummary({.rows = run.rows(), .scenario = "replayed"}));
  log.Close();
  return run;
}

}  // namespace dexcheck::testing
