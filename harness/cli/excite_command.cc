#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/dynamics/torque_regressor.h"
#include "harness/base/interrupts.h"
#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/descriptions/read_description.h"
#include "harness/engine/clearance.h"
#include "harness/recordings/motion_design.h"

namespace dexcheck::cli {
namespace {

/// A motion for a robot of which a recording is to be made.
struct MotionRequest : Outputs {
  std::filesystem::path model, mjcf, limits, columns;
  std::vector<std::filesystem::path> recorded;
  std::string motion_file;
  MotionDesignOptions options;
};

std::vector<std::string> ListJointNames(const RobotModel& model) {
  std::vector<std::string> names;
  names.reserve(static_cast<size_t>(model.num_joints()));
  for (int i = 0; i < model.num_joints(); ++i) names.push_back(model.joint(i).name);
  return names;
}

/// Time, positions, velocities, accelerations and the model's torques.
std::string WriteMotion(const RobotModel& model, const SeriesMotion& motion, double rate) {
  std::string text = "t";
  for (const char* const quantity : {"q", "qd", "qdd", "tau"})
    for (const std::string& name : ListJointNames(model)) text += fmt::format(",{}.{}", quantity, name);
  text += "\n";
  TorqueRegressor regressor(model);
  VectorXd q, qd, qdd;
  const auto rows = static_cast<long>(std::floor(motion.duration() * rate));
  for (long row = 0; row <= rows; ++row) {
    const double time = static_cast<double>(row) / rate;
    motion.Calc(time, &q, &qd, &qdd);
    VectorXd torque = CalcMotionTorques(q, qd, qdd, &regressor);
    text += FormatNumber(time);
    for (const VectorXd* const values : {&q, &qd, &qdd, &torque})
      for (const double value : *values) text += fmt::format(",{:.9g}", value);
    text += "\n";
  }
  return text;
}

Json ToJson(const RobotModel& model, const MotionDesign& design, bool complete) {
  Json json = {{"model", model.spec().source},        {"complete", complete},
               {"motions", design.evaluations},       {"combinations", design.combinations},
               {"known_before", design.known_before}, {"known_after", design.known_after}};
  for (int i = 0; i < model.num_joints(); ++i) json["largest_torque"][model.joint(i).name] = design.torque[i];
  for (const ExpectedError& one : design.errors)
    json["errors"][one.fault] = {{"before", one.before}, {"after", one.after}};
  return json;
}

Report MakeReport(const MotionRequest& request, const RobotModel& model, const MotionDesign& design,
                  bool complete) {
  Report report{.data = ToJson(model, design, complete)};
  report.details = fmt::format(
      "{}: a motion of {} s, {} motions tried{}\n\n", model.name(), request.options.duration,
      design.evaluations,
      request.options.calc_overlap ? "" : "; overlaps of bodies are not known without an MJCF (--mjcf)");
  std::vector<TableRow> rows = {{{"standard error over plausible size", "before", "after"}}};
  for (const ExpectedError& one : design.errors)
    rows.push_back({{one.fault, fmt::format("{:.2g}", one.before), fmt::format("{:.2g}", one.after)}});
  rows.emplace_back();
  report.AddTable("<>>", rows);
  std::vector<TableRow> torques = {{{"joint", "largest torque"}}};
  for (int i = 0; i < model.num_joints(); ++i)
    torques.push_back({{model.joint(i).name, fmt::format("{:.3g}", design.torque[i])}});
  torques.emplace_back();
  report.AddTable("<>", torques);
  report.last = fmt::format(
      "{}: {} of {} combinations of parameters are known to a third of their plausible range, {} before.\n",
      complete ? "FOUND" : "INTERRUPTED, so far", design.known_after, design.combinations,
      design.known_before);
  if (!complete) report.failure = "interrupted";
  return report;
}

int Run(MotionRequest request) {
  const RobotDescription description = ReadDescription(request.model);
  const RobotModel model(description.spec);
  const MotionLimits limits = ReadMotionLimits(description, request.limits);
  std::vector<Recording> recordings;
  for (const std::filesystem::path& path : request.recorded)
    recordings.push_back(
        OpenRecordingOf(model, path, request.columns, /*is_complete=*/true, ListLinkFrames(description)));
  if (request.mjcf.empty() && description.format == RobotFormat::kMjcf) request.mjcf = request.model;
  std::optional<SelfContact> contact;
  if (!request.mjcf.empty()) {
    contact.emplace(LoadMjcf(request.mjcf), request.mjcf.string(), ListJointNames(model),
                    0.5 * (limits.lower + limits.upper));
    request.options.calc_overlap = [&](const VectorXd& q) { return contact->CalcDepth(q); };
  }
  CatchInterrupts();
  ReportOutput files(request);
  OutputFile motion(request.motion_file);
  std::optional<RecordingSet> recorded;
  if (!recordings.empty())
    recorded.emplace(model, &recordings, ReadOptions{}, [](long) { return !IsInterrupted(); });
  request.options.recorded = recorded ? &*recorded : nullptr;
  ProgressBar bar("motions", request.options.evaluations, request.quiet);
  request.options.go_on = [&](int evaluations) { return bar.GoOn(evaluations); };
  const MotionDesign design = DesignMotion(model, limits, request.options);
  bar.Finish();
  motion.Write([&] { return WriteMotion(model, design.motion, request.options.rate); });
  return files.Write(MakeReport(request, model, design, !IsInterrupted()),
                     /*is_printed=*/request.motion_file != "-");
}

}  // namespace

void AddExciteCommand(CLI::App* app) {
  const auto [command, request] = AddRequest<MotionRequest>(
      app, "excite", "Design a motion to record that shows errors of a robot's model best within its limits",
      {"dexcheck excite arm.urdf --out motion.csv", "dexcheck excite arm.urdf --limits limits.toml"});
  AddOption(command, "MODEL,--model", &request->model, "Parameter file, URDF or MJCF")->required();
  AddOption(command, "--out FILE.csv", &request->motion_file, "The motion: t, q, qd, qdd, model's torques");
  AddOption(command, "--recording FILE", &request->recorded,
            "An existing recording, which the motion complements")
      ->allow_extra_args(false);
  AddOption(command, "--columns FILE.toml", &request->columns, "Which column of the recordings is what");
  AddOption(command, "--limits FILE.toml", &request->limits, "Ranges, velocities, accelerations and torques");
  AddOption(command, "--mjcf FILE", &request->mjcf, "The robot's shapes, which must not overlap");
  AddOption(command, "--duration S", &request->options.duration, "How long the motion takes, s")
      ->check(NumberFrom(1.0, 3600.0))
      ->capture_default_str();
  AddOption(command, "--rate HZ", &request->options.rate, "Rows per second")
      ->check(NumberFrom(1.0, 1e5))
      ->capture_default_str();
  AddOption(command, "--motions N", &request->options.evaluations, "How many motions to try")
      ->check(WholeNumber(1, 1000000))
      ->capture_default_str();
  AddSeedOption(command, &request->options.seed, "Seed of the first random motions");
  AddJsonOption(command, "the results", &request->json_file);
  command->add_flag("--quiet", request->quiet, "Print the last line only");
}

}  // namespace dexcheck::cli
