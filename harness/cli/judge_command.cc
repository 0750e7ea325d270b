#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>

#include "harness/base/files.h"
#include "harness/base/interrupts.h"
#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/descriptions/read_description.h"
#include "harness/recordings/compare_recordings.h"
#include "harness/recordings/judgement_verdict.h"
#include "harness/recordings/write_corrections.h"
#include "harness/report/page.h"

namespace dexcheck::cli {
namespace {

struct JudgeRequest : Outputs {
  std::filesystem::path model, recording;
  std::vector<std::filesystem::path> more;  // recordings
  std::filesystem::path columns, corrected;
  UrdfOptions urdf;
  bool describe = false;
};

std::string Number(double value) { return fmt::format("{:.3g}", value); }

Answer AnswerFor(const RobotModel& model, const RecordingJudgement& judgement,
                 const std::vector<Recording>& recordings) {
  const bool is_one = recordings.size() == 1;
  return MakeAnswer(judgement, model,
                    is_one ? recordings.front().name : std::to_string(recordings.size()) + " recordings");
}

/// Adds what stands below the verdict.
void AddDetails(const RobotModel& model, const RecordingJudgement& judgement,
                const std::vector<Recording>& recordings, Report* report) {
  const bool has_gains = judgement.balances.front().drive_gain != 0.0;
  report->details = "\n";
  for (size_t recording = 0; recording < recordings.size(); ++recording) {
    if (recordings.size() > 1) report->details += recordings[recording].name + "\n";
    std::vector<TableRow> rows = {{{"torque, rms", "measured", "unexplained", "left", "noise", "held out"}}};
    if (has_gains) rows[0].cells.push_back("N m/A");
    for (const JointJudgement& one : judgement.balances) {
      if (one.recording != static_cast<int>(recording)) continue;
      TableRow& row = rows.emplace_back();
      row.cells = {model.joint(one.joint).name, Number(one.torque),   Number(one.residual), Number(one.left),
                   Number(one.noise),           Number(one.held_left)};
      if (has_gains) row.cells.push_back(Number(one.drive_gain));
    }
    report->AddTable(has_gains ? "<>>>>>>" : "<>>>>>", rows);
    report->details += "\n";
  }
  for (const std::string& note : judgement.notes) report->Add(note);
}

Json ToJson(const HeldPrediction& one) { return {{"numbers", one.numbers}, {"left", one.held_left}}; }

Json ToJson(const RobotModel& model, const RecordingJudgement& judgement,
            const std::vector<Recording>& recordings, const Answer& answer) {
  std::string word = answer.word;
  std::ranges::transform(word, word.begin(), [](unsigned char c) { return std::tolower(c); });
  Json json = {{"model", model.spec().source},
               {"verdict", word},
               {"verdict_text", answer.sentence},
               {"rows", judgement.rows},
               {"explained", judgement.explained},
               {"left", judgement.left},
               {"rest_is_noise", judgement.IsWhole()},
               {"held_out", {{"causes", ToJson(judgement.by_causes)}, {"all", ToJson(judgement.by_all)}}}};
  json["recordings"] = Json::array();
  for (const Recording& one : recordings) json["recordings"].push_back(one.name);
  json["joints"] = Json::array();
  for (const JointJudgement& one : judgement.balances) {
    json["joints"].push_back({{"joint", model.joint(one.joint).name},
                              {"recording", one.recording},
                              {"samples", one.samples},
                              {"torque", one.torque},
                              {"residual", one.residual},
                              {"left", one.left},
                              {"noise", one.noise},
                              {"hidden", one.hidden},
                              {"held_residual", one.held_residual},
                              {"held_left", one.held_left}});
    if (one.drive_gain != 0.0) json["joints"].back()["drive_gain"] = one.drive_gain;
  }
  json["not_judged"] = Json::array();
  for (const UnjudgedJoint& one : judgement.unjudged)
    json["not_judged"].push_back(
        {{"joint", model.joint(one.joint).name}, {"moves", one.moves}, {"reason", one.reason}});
  json["causes"] = Json::array();
  for (const Explanation& one : judgement.causes) json["causes"].push_back(dexcheck::ToJson(one));
  // A recording's own causes come first.
  for (size_t i = 0; i < judgement.found.size(); ++i)
    for (const Fault& part : judgement.found[i].parts)
      json["causes"][json["causes"].size() - judgement.found.size() + i]["parts"].push_back(
          dexcheck::ToJson(part));
  json["notes"] = judgement.notes;
  return json;
}

/// Writes the model's file with what was found. @returns what was corrected, and what was not.
std::vector<std::string> Correct(const RecordingJudgement& judgement, const JudgeRequest& request,
                                 OutputFile* file) {
  const CorrectedFile corrected = WriteCorrections(DescriptionFile(request.model, request.urdf), judgement,
                                                   std::filesystem::path(request.corrected).parent_path());
  file->Write(corrected.text);
  std::vector<std::string> remarks = {fmt::format("{}: {} of {} causes are corrected",
                                                  request.corrected.string(), corrected.written.size(),
                                                  judgement.causes.size())};
  // A recording's own causes come first, and those of geometry.
  for (size_t i = 0; i + judgement.found.size() < judgement.causes.size(); ++i) {
    const Fault& fault = judgement.causes[i].faults.front();
    remarks.push_back("not in it: " + fault.place + ": " + fault.fault);
  }
  for (const std::string& one : corrected.left) remarks.push_back("not in it: " + one);
  return remarks;
}

/// @throws UsageError when MODEL and RECORDING stand the other way round.
void RequireOrder(const JudgeRequest& request) {
  const std::filesystem::path model = request.model.extension(), recording = request.recording.extension();
  if (recording == ".urdf" || recording == ".xml" || IsFolder(request.model) ||
      (recording == ".toml" && model == ".csv"))
    throw UsageError(fmt::format("judge: MODEL comes before RECORDING: judge {} {}",
                                 request.recording.string(), request.model.string()));
}

int Run(JudgeRequest request) {
  if (request.describe && request.recording.empty()) std::swap(request.model, request.recording);
  if (request.recording.empty()) throw UsageError("judge: RECORDING is missing");
  RequireOrder(request);
  constexpr int kManyJoints = 64;
  std::optional<RobotDescription> description;
  if (!request.model.empty()) description = ReadDescription(request.model, request.urdf);
  const RobotModel model =
      !description ? MakeUnknownRobot(kManyJoints) : RobotModel(AddSpheres(*description));
  const LinkFrames frames = description ? ListLinkFrames(*description) : LinkFrames();
  std::vector<std::filesystem::path> paths = {request.recording};
  paths.insert(paths.end(), request.more.begin(), request.more.end());
  std::vector<Recording> recordings;
  recordings.reserve(paths.size());
  for (const std::filesystem::path& path : paths)
    recordings.push_back(OpenRecordingOf(model, path, request.columns, !request.describe, frames));
  if (request.describe) {
    for (const Recording& one : recordings) fmt::print("{}", DescribeColumns(model, one, frames));
    return kSuccess;
  }
  CatchInterrupts();
  ReportOutput files(request);
  OutputFile corrected(request.corrected);
  ProgressBar bar("rows", 0, request.quiet);
  JudgeOptions options;
  options.frames = frames;
  const bool is_live = request.recording == "-";
  if (is_live) {
    // Rows that come in as they are recorded are reported as they come.
    constexpr size_t kAhead = 1000;
    options.ahead = kAhead;
    if (!request.quiet && files.prints())
      options.on_second = [&model, has_head = false](double time, const std::vector<int>& joints,
                                                     const VectorXd& residual) mutable {
        if (!has_head) {
          fmt::print("what the model does not explain, rms by second:\n{:>9}", "s");
          for (const int joint : joints) fmt::print(" {:>12}", model.joint(joint).name.substr(0, 12));
          fmt::print("\n");
        }
        has_head = true;
        fmt::print("{:9.2f}", time);
        for (const double value : residual) fmt::print(" {:12.3g}", value);
        fmt::print("\n");
        std::fflush(stdout);
      };
  }
  const RecordingJudgement judgement =
      JudgeRecordings(model, &recordings, options, [&](long rows) { return bar.GoOn(rows); });
  bar.Finish();
  Report report{.answer = AnswerFor(model, judgement, recordings)};
  report.data = ToJson(model, judgement, recordings, report.answer);
  report.page = [&] {
    const std::optional<ReplayData> replay = MakeMotionReplay(model, request.model, judgement);
    return MakeJudgePage(model, judgement, report.data, replay ? &*replay : nullptr);
  };
  AddDetails(model, judgement, recordings, &report);
  if (IsInterrupted()) {
    report.answer.remarks.emplace_back("interrupted: the later rows were not judged");
    report.failure = "interrupted";
  } else {
    report.code = judgement.Agrees() ? kSuccess : kDisagreement;
    if (corrected.exists())
      for (std::string& line : Correct(judgement, request, &corrected))
        report.answer.remarks.push_back(std::move(line));
  }
  return files.Write(report, /*is_printed=*/request.corrected != "-");
}

Json ToJson(const RobotModel& model, const RecordingPair& pair, const RecordingComparison& comparison) {
  Json json = {{"model", pair.model.string()},
               {"recordings", {pair.first.string(), pair.second.string()}},
               {"verdict", comparison.causes.empty() ? "same" : "differ"},
               {"same_motion", comparison.is_same_motion}};
  if (comparison.is_same_motion) json["delay"] = comparison.delay;
  json["joints"] = Json::array();
  for (const JointDifference& one : comparison.joints)
    json["joints"].push_back(
        {{"joint", model.joint(one.joint).name}, {"position", one.position}, {"torque", one.torque}});
  json["causes"] = Json::array();
  for (const CauseDifference& one : comparison.causes) {
    Json cause = {{"text", one.Describe()}};
    if (one.first) cause["first"] = dexcheck::ToJson(*one.first);
    if (one.second) cause["second"] = dexcheck::ToJson(*one.second);
    json["causes"].push_back(cause);
  }
  return json;
}

Report MakeReport(const RobotModel& model, const RecordingPair& pair, const RecordingComparison& comparison) {
  const std::string first = pair.first.filename().string(), second = pair.second.filename().string();
  Report report{.data = ToJson(model, pair, comparison)};
  Answer& answer = report.answer;
  if (comparison.causes.empty()) {
    answer.word = "SAME";
    answer.sentence = fmt::format("the residuals of {} are equal in both.", model.name());
  } else {
    answer.tone = Answer::Tone::kBad;
    answer.word = "DIFFER";
    answer.sentence = fmt::format("{} and {} are of robots that differ.", first, second);
    report.code = kDisagreement;
  }
  for (const CauseDifference& one : comparison.causes) answer.causes.push_back(one.Describe());
  if (!comparison.is_same_motion) {
    answer.remarks.emplace_back("the motions differ, so that only their causes are compared");
    return report;
  }
  constexpr double kLeast = 1e-6;  // s
  if (std::abs(comparison.delay) > kLeast)
    answer.remarks.push_back(fmt::format("{} is {:.4g} s {} {}", second, std::abs(comparison.delay),
                                         comparison.delay > 0.0 ? "after" : "before", first));
  std::vector<TableRow> rows = {{}, {{"difference, rms", "position", "torque"}}};
  for (const JointDifference& one : comparison.joints)
    rows.push_back({{model.joint(one.joint).name, Number(one.position), Number(one.torque)}});
  report.AddTable("<>>", rows);
  return report;
}

}  // namespace

int CompareTwoRecordings(const RecordingPair& pair) {
  const RobotDescription description = ReadDescription(pair.model);
  const RobotModel model(AddSpheres(description));
  JudgeOptions options;
  options.frames = ListLinkFrames(description);
  std::vector<Recording> recordings;
  for (const std::filesystem::path& path : {pair.first, pair.second})
    recordings.push_back(OpenRecordingOf(model, path, pair.columns, /*is_complete=*/true, options.frames));
  CatchInterrupts();
  ReportOutput files(pair);
  ProgressBar bar("rows", 0, pair.quiet);
  const RecordingComparison comparison =
      CompareRecordings(model, &recordings, options, [&](long rows) { return bar.GoOn(rows); });
  bar.Finish();
  if (IsInterrupted()) return ReportFailure("interrupted");
  return files.Write(MakeReport(model, pair, comparison));
}

void AddJudgeCommand(CLI::App* app) {
  const auto [command, request] = AddRequest<JudgeRequest>(
      app, "judge", "Say whether a model explains a recording of a robot, and what is missing",
      {"dexcheck judge arm.urdf recording.csv --page judged.html",
       "dexcheck judge arm.urdf recording.csv --columns columns.toml"});
  AddOption(command, "MODEL", &request->model, "Parameter file, URDF or MJCF")->required();
  AddOption(
      command, "RECORDING", &request->recording,
      "CSV or text, MCAP, ROS 2 bag, HDF5, NumPy, a run's log, a file of columns, - for standard input");
  AddOption(command, "--recording FILE", &request->more, "One more recording")->allow_extra_args(false);
  AddOption(command, "--columns FILE.toml", &request->columns, "Meaning of the columns; see --describe");
  command->add_flag("--describe", request->describe, "Print the columns as understood, for --columns");
  AddOption(command, "--write FILE", &request->corrected, "Write a copy of MODEL with the causes corrected");
  AddUrdfOptions(command, &request->urdf);
  AddJsonOption(command, "the judgement", &request->json_file);
  AddOption(command, "--page FILE.html", &request->page_file, "Write a page: torques, residuals, causes");
  command->add_flag("--quiet", request->quiet, "No progress, and causes and verdict only");
}

}  // namespace dexcheck::cli
