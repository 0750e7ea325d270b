#include "harness/report/run_data.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/handling/pick_and_place.h"
#include "harness/base/bounded_json.h"
#include "harness/base/files.h"
#include "harness/engine/mjcf_file.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/scenario/runnable_robot.h"

namespace dexcheck {
namespace {

constexpr std::string_view kCheckPrefix = "check/";

[[noreturn]] void Fail(const LogReader& log, const std::string& what) {
  throw InputError(log.path().string() + ": " + what);
}

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
    MjcfFile file(mjcf);
    AddSky(&file);  // pictures without one are black
    return LoadVisible(&file);
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
      std::ranges::find(texts, "object_body") == texts.end())
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

RunData::RunData(const std::filesystem::path& run_dir) : log_(run_dir / "log.h5") {
  if (log_.rows() == 0) Fail(log_, "the run has no steps (rows: 0), " + DescribeCut(log_));
  time_ = log_.ReadSignal("time").col(0);
  for (Eigen::Index row = 0; row < time_.size(); ++row) {
    const bool advances = row == 0 || time_[row] > time_[row - 1];
    if (!advances || !std::isfinite(time_[row])) {
      Fail(log_, "time: must be finite and increase, got " + FormatNumber(time_[row]) + " in row " +
                     std::to_string(row));
    }
  }
  if (FindText("summary").empty()) {
    ReadChecksOfSignals();
  } else {
    ReadChecksOfSummary();
  }
  std::ranges::stable_sort(checks_, [](const CheckRecord& a, const CheckRecord& b) {
    return a.failed != b.failed ? a.failed : CalcFraction(a) > CalcFraction(b);
  });
}

const char* RunData::Explain(CheckCategory category) const {
  // First where an object is held, then where joints follow a motion of their own.
  static constexpr const char* kWords[][2] = {
      {"same state, both descriptions", "same state, both descriptions"},
      {"engine's motion in the model's equations", "engine's motion in the model's equations"},
      {"accelerations and contact forces", "accelerations"},
      {"no slip, level base, forces in cones",
       "joints within their ranges, motors within their limits, bodies apart"},
      {"torques against (53)-(55)", "torques against the law of the joints"}};
  return kWords[static_cast<size_t>(category)][moves_joints() ? 1 : 0];
}

std::string RunData::NameColumn(const SignalInfo& signal, int column) {
  const auto index = static_cast<size_t>(column);
  return index < signal.columns.size() ? signal.columns[index] : std::to_string(column + 1);
}

std::string RunData::FindSummaryText(const char* pointer) const {
  return dexcheck::FindText(summary_, pointer);
}

double RunData::FindSummaryNumber(const char* pointer) const {
  const nlohmann::json::json_pointer place(pointer);
  return summary_.contains(place) && summary_[place].is_number() ? summary_[place].get<double>()
                                                                 : std::nan("");
}

std::string DescribeCut(const LogReader& log) {
  const std::string text = log.FindText("summary");
  const nlohmann::json summary = ParseJson(text);
  const bool stopped = summary.is_object() && summary.value("interrupted", nlohmann::json()) == true;
  if (!text.empty() && !stopped && log.rows() > 0) return "";
  const std::string how = text.empty() ? "was cut off" : stopped ? "was stopped by hand" : "ended";
  return "the run " + how +
         (log.rows() > 0 ? " after " + std::to_string(log.rows()) + " steps" : " before its first step");
}

void RunData::ReadChecksOfSummary() {
  summary_ = ParseJson(FindText("summary"));
  if (!summary_.is_object() || !summary_.contains("verdict") || !summary_.contains("checks"))
    Fail(log_, "summary: is not a run's summary");
  try {
    for (const auto& [name, json] : summary_["checks"].items()) checks_.push_back(ReadCheck(name, json));
  } catch (const nlohmann::json::exception& error) {
    Fail(log_, "summary: " + DescribeJsonError(error));
  }
}

CheckRecord ReadCheckInfo(const LogReader& log, const SignalInfo& signal) {
  const auto find = [&](const char* name) {
    const auto attribute = signal.attributes.find(name);
    if (attribute == signal.attributes.end()) Fail(log, signal.name + ": has no attribute " + Quote(name));
    return attribute->second;
  };
  const double kind = find("kind");
  if (!(kind >= 0.0 && kind <= 4.0) || kind != std::floor(kind))
    Fail(log, signal.name + ": kind must be 0, 1, 2, 3 or 4, got " + FormatNumber(kind));
  CheckRecord check;
  check.name = signal.name.substr(kCheckPrefix.size());
  check.kind = static_cast<CheckCategory>(static_cast<int>(kind));
  check.unit = signal.unit;
  check.description = signal.description;
  check.bound = find("bound");
  return check;
}

void RunData::ReadChecksOfSignals() {
  for (const SignalInfo& signal : log_.signals()) {
    if (!signal.name.starts_with(kCheckPrefix)) continue;
    CheckRecord& check = checks_.emplace_back(ReadCheckInfo(log_, signal));
    const VectorXd values = log_.ReadSignal(signal.name).col(0);
    for (Eigen::Index row = 0; row < values.size(); ++row) check.Add(values[row], time_[row]);
  }
}

std::filesystem::path FindEmbedded(const LogReader& log, const std::string& kind,
                                   const std::filesystem::path& unpacked) {
  const std::string name = kind + "/" + log.ReadText(kind);
  (void)log.ReadFile("inputs", name);  // which is an error unless the log has it
  if (kind == "mjcf") {
    (void)ListMjcfFiles(unpacked / name);
    KeepQuietAbout(unpacked / name);
  }
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
