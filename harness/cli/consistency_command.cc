#include <fmt/format.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "controller/model/parameter_reader.h"
#include "harness/checks/consistency.h"
#include "harness/cli/commands.h"
#include "harness/cli/output_file.h"
#include "harness/cli/progress_bar.h"
#include "harness/common/interrupts.h"
#include "harness/engine/engine.h"

namespace dexcheck::cli {
namespace {

using Json = nlohmann::ordered_json;

struct Request {
  RobotFiles files;
  ConsistencyOptions options;
  std::string json_file;
  bool quiet = false;

  /// The results themselves take standard output: a table would spoil them.
  [[nodiscard]] bool PrintsJson() const { return json_file == "-"; }
};

std::string FileName(const std::filesystem::path& path) { return path.filename().string(); }

/// Large results first fail, then where to look: what a person reads.
void PrintTable(const Request& request, const RobotModel& model, const ConsistencyResult& result) {
  const int base = model.num_base_velocities();
  fmt::print("{}: {} against {}, MuJoCo {}\n{} random states (seed {}), {:.1f} s\n\n", model.name(),
             FileName(request.files.robot), FileName(request.files.mjcf), mj_versionString(), result.samples,
             request.options.seed, result.seconds);

  fmt::print("{:<24}{:>9}  {:>12}  {:>9}\n", "constant", "compared", "worst error", "bound");
  for (const CheckRecord& record : result.gate.records) {
    fmt::print("{:<24}{:>9}  {:>12.2e}  {:>9.1e}  {}\n", record.name, record.comparisons, record.worst,
               record.bound, record.failed ? "DIFFERS" : "ok");
  }
  fmt::print("\n{:<24}{:>9}  {:>12}  {:>9}           {}\n", "term", "compared", "worst error", "bound",
             "where it is worst");
  for (const CheckRecord& record : result.terms) {
    fmt::print("{:<24}{:>9}  {:>12.2e}  {:>9.1e}  {:<7}  {}, sample {}\n", record.name, record.comparisons,
               record.worst, record.bound, record.failed ? "DIFFERS" : "ok",
               Describe(record.where, model, base), record.sample);
  }
  fmt::print("\nErrors are relative to each term's own scale; bounds follow from rounding (README.md).\n");
}

void PrintVerdict(const Request& request, const RobotModel& model, const ConsistencyResult& result) {
  const int base = model.num_base_velocities();
  if (result.samples < request.options.samples) {
    fmt::print("INTERRUPTED after {} of {} samples. So far:\n", result.samples, request.options.samples);
  }
  if (result.Agrees()) {
    fmt::print("AGREE: the analytic model and MuJoCo agree to rounding in all {} terms.\n",
               result.terms.size());
    return;
  }
  fmt::print("DISAGREE:\n");
  for (const GateFinding& finding : result.gate.findings) {
    fmt::print("  {}: {}: {:.12g} in {}, {:.12g} in {}\n", finding.check, finding.where, finding.model,
               FileName(request.files.robot), finding.engine, FileName(request.files.mjcf));
  }
  for (const CheckRecord& record : result.terms) {
    if (!record.failed) continue;
    fmt::print("  {}: nearest the base: {}; worst: {}: {:.12g} in the model, {:.12g} in MuJoCo (sample {})\n",
               record.name, Describe(record.first_failure, model, base), Describe(record.where, model, base),
               record.model_value, record.engine_value, record.sample);
  }
}

Json ToJson(const CheckRecord& record, const RobotModel& model) {
  const int base = model.num_base_velocities();
  Json json = {{"kind", NameOf(record.kind)},    {"max", record.worst},
               {"bound", record.bound},          {"pass", !record.failed},
               {"compared", record.comparisons}, {"where", Describe(record.where, model, base)},
               {"sample", record.sample},        {"model", record.model_value},
               {"engine", record.engine_value}};
  if (record.failed) json["first_failure"] = Describe(record.first_failure, model, base);
  return json;
}

const char* Judge(ExitCode code) {
  if (code == kSuccess) return "pass";
  return code == kDisagreement ? "disagreement" : "failed";
}

std::string ToText(const Request& request, const RobotModel& model, const ConsistencyResult& result,
                   ExitCode code) {
  Json json = {{"robot", request.files.robot.string()},
               {"mjcf", request.files.mjcf.string()},
               {"mujoco", mj_versionString()},
               {"samples", result.samples},
               {"samples_requested", request.options.samples},
               {"seed", request.options.seed},
               {"seconds", result.seconds},
               {"verdict", Judge(code)}};
  json["checks"] = Json::object();
  for (const CheckRecord& record : result.gate.records) json["checks"][record.name] = ToJson(record, model);
  for (const CheckRecord& record : result.terms) json["checks"][record.name] = ToJson(record, model);
  json["findings"] = Json::array();
  for (const GateFinding& finding : result.gate.findings) {
    json["findings"].push_back({{"check", finding.check},
                                {"where", finding.where},
                                {"model", finding.model},
                                {"engine", finding.engine}});
  }
  return json.dump(2) + "\n";
}

int Run(const Request& request) {
  const RobotModel model = ReadRobotModel(request.files.robot);
  const MjModelPtr engine = LoadMjcf(request.files.mjcf);
  const Adapter adapter(model, *engine, request.files.mjcf.string());
  CatchInterrupts();
  std::optional<OutputFile> json;
  if (!request.json_file.empty()) json.emplace(request.json_file);
  ProgressBar bar("comparing", request.options.samples, request.quiet);
  const ConsistencyResult result = CheckConsistency(adapter, request.options, [&](long samples) {
    bar.Update(samples);
    return !IsInterrupted();
  });
  bar.Finish();
  ExitCode code = result.samples < request.options.samples ? kFailure : kSuccess;
  if (!result.Agrees()) code = kDisagreement;
  if (json) json->Write(ToText(request, model, result, code));
  if (!request.PrintsJson()) {
    if (!request.quiet) PrintTable(request, model, result);
    PrintVerdict(request, model, result);
  }
  return code;
}

}  // namespace

void AddConsistencyCommand(Command app) {
  constexpr long kMaxSamples = 1000000000;
  const auto request = std::make_shared<Request>();
  Command command =
      app.AddCommand("consistency", "Compare every term of model and engine at random states");
  AddRobotOptions(command, &request->files);
  command.AddOption("--samples", &request->options.samples, "Number of random states")
      .TypeName("N")
      .Check(WholeNumber(1, kMaxSamples))
      .ShowDefault();
  command.AddOption("--seed", &request->options.seed, "Of the random states")
      .TypeName("N")
      .Check(WholeNumber(0, std::numeric_limits<std::uint64_t>::max()))
      .ShowDefault();
  command.AddOption("--json", &request->json_file,
                   "Write the results to this file (- for standard output, then without the table)")
      .TypeName("FILE.json");
  command.AddFlag("--quiet", &request->quiet, "Print the verdict only");
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
