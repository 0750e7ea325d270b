#include "harness/report/recorded_frames.h"

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/handling/pick_and_place.h"
#include "harness/base/files.h"
#include "harness/engine/compiled_model.h"
#include "harness/engine/mjcf_file.h"
#include "harness/report/run_data.h"

namespace dexcheck {
namespace {

constexpr const char* kForces = "contact/force";

/// Empty when it was not recorded.
RowMatrixXd ReadMatrix(const LogReader& log, const std::string& name) {
  return log.Find(name) == nullptr ? RowMatrixXd() : log.ReadSignal(name);
}

std::vector<double> ReadSeries(const LogReader& log, const std::string& name) {
  const RowMatrixXd matrix = ReadMatrix(log, name);
  return {matrix.data(), matrix.data() + matrix.size()};
}

/// Marks contacts that carry nothing as open.
void OpenForcelessContacts(RunFrames* run) {
  if (run->contact_forces.size() != run->contact_positions.size()) return;
  for (long row = 0; row < run->contact_forces.rows(); ++row) {
    for (long k = 0; k < run->contacts(); ++k) {
      if (!run->contact_forces.block<1, 3>(row, 3 * k).isZero(0.0)) continue;
      run->contact_positions.block<1, 3>(row, 3 * k).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
}

MjModelPtr ReadModel(const LogReader& log) {
  const TemporaryFolder folder;
  log.ExtractFiles("inputs", folder.path());
  const std::filesystem::path mjcf = FindEmbedded(log, "mjcf", folder.path());
  try {
    return MakeVisible(LoadMjcf(mjcf));
  } catch (const InputError& error) {
    throw InputError(log.path().string() + ": " + error.what());
  }
}

RunFrames ReadFrames(const LogReader& log) {
  RunFrames run;
  run.source = log.path().string();
  run.title = log.ReadText("scenario");
  run.object_body = log.FindText("object_body");
  // Older logs do not say it, and had no other.
  if (const std::vector<std::string> texts = log.ListTexts();
      std::find(texts.begin(), texts.end(), "object_body") == texts.end())
    run.object_body = "torus";
  run.times = ReadSeries(log, "time");
  run.qpos = log.ReadSignal("engine/qpos");
  for (const double phase : ReadSeries(log, "task/phase")) {
    const bool known = phase >= 0.0 && phase <= static_cast<double>(Phase::kDone);
    run.phases.emplace_back(known ? NameOf(static_cast<Phase>(static_cast<int>(phase))) : "");
  }
  run.position_errors = ReadSeries(log, "object/position_error");
  run.orientation_errors = ReadSeries(log, "object/orientation_error");
  run.joint_errors = ReadSeries(log, "joints/largest_error");
  run.contact_positions = ReadMatrix(log, "contact/position");
  run.contact_forces = ReadMatrix(log, kForces);
  run.contact_normals = ReadMatrix(log, "contact/normal");
  const RowMatrixXd desired = ReadMatrix(log, "object/X_d");
  const bool has_rows = desired.rows() > 0;
  if (has_rows && desired.cols() >= 3) run.desired_positions = desired.leftCols<3>();
  if (has_rows && desired.cols() >= 6) run.desired_angles = desired.middleCols<3>(3);
  if (const SignalInfo* forces = log.Find(kForces)) {
    const auto mu = forces->attributes.find("mu");
    if (mu != forces->attributes.end()) run.friction = mu->second;
  }
  for (const SignalInfo& signal : log.signals()) {
    if (!signal.name.starts_with("check/")) continue;
    const CheckRecord check = ReadCheckInfo(log, signal);
    run.checks.push_back({check.name, check.kind, check.bound, ReadSeries(log, signal.name)});
  }
  OpenForcelessContacts(&run);
  return run;
}

}  // namespace

std::filesystem::path FindEmbedded(const LogReader& log, const std::string& kind,
                                   const std::filesystem::path& unpacked) {
  const std::string name = kind + "/" + log.ReadText(kind);
  (void)log.ReadFile("inputs", name);  // which is an error unless the log has it
  if (kind == "mjcf") (void)ListMjcfFiles(unpacked / name);
  return unpacked / name;
}

RecordedFrames ReadRecordedFrames(const LogReader& log) {
  RecordedFrames recorded{ReadModel(log), ReadFrames(log)};
  CheckRunFrames(*recorded.model, recorded.frames);
  return recorded;
}

RecordedFrames ReadRecordedFrames(const std::filesystem::path& run_folder) {
  return ReadRecordedFrames(LogReader(run_folder / "log.h5"));
}

}  // namespace dexcheck
