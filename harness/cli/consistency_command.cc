#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/interrupts.h"
#include "harness/checks/consistency.h"
#include "harness/cli/commands.h"
#include "harness/cli/output_file.h"
#include "harness/cli/progress_bar.h"
#include "harness/engine/engine.h"
#include "harness/sides/answer_files.h"
#include "harness/sides/answers_comparison.h"
#include "harness/sides/complete_description.h"
#include "harness/sides/description_check.h"
#include "harness/sides/description_match.h"
#include "harness/sides/model_comparison.h"
#include "harness/sides/program_side.h"
#include "harness/sides/read_description.h"
#include "harness/sides/robot_file.h"
#include "harness/sides/tolerance.h"

namespace dexcheck::cli {
namespace {

using Json = nlohmann::ordered_json;

struct Request {
  std::string a, b;  ///< Two descriptions; none with --robot and --mjcf.
  RobotFiles files;
  std::string program;            ///< Command of the shell that stands for B.
  std::filesystem::path answers;  ///< Folder that stands for B.
  ProgramOptions program_options;
  std::vector<std::string> packages;
  bool floating = false;
  bool with_engine = true;  ///< files.mjcf is an MJCF; otherwise any other description.
  ConsistencyOptions options;
  std::string json_file;
  bool quiet = false;
  int digits = 0;                   ///< 0: not given.
  std::optional<double> tolerance;  ///< Relative, wider than rounding.

  /// By which published numbers are judged; none: by rounding.
  [[nodiscard]] std::optional<double> FindTolerance() const {
    return digits > 0 ? std::pow(10.0, -digits) : tolerance;
  }

  /// What stands for B answers terms, and is no description.
  [[nodiscard]] bool has_answers() const { return !program.empty() || !answers.empty(); }

  /// The results themselves take standard output: a table would spoil them.
  [[nodiscard]] bool PrintsJson() const { return json_file == "-"; }
};

std::string FileName(const std::filesystem::path& path) { return path.filename().string(); }

/// What was compared: the model that locations belong to, and the results.
struct Comparison {
  std::optional<RobotModel> model;
  std::vector<std::string> notes;
  ConsistencyResult result;
};

/// Large results first fail, then where to look: what a person reads.
void PrintTable(const Request& request, const Comparison& comparison) {
  const RobotModel& model = *comparison.model;
  const ConsistencyResult& result = comparison.result;
  const int base = model.num_base_velocities();
  fmt::print("{}: {} against {}{}\n{} random states (seed {}), {:.1f} s\n\n", model.name(),
             FileName(request.files.robot), FileName(request.files.mjcf),
             request.with_engine ? std::string(", MuJoCo ") + mj_versionString() : "", result.samples,
             request.options.seed, result.seconds);

  if (!comparison.notes.empty()) {
    fmt::print("not compared, or worth knowing:\n");
    for (const std::string& note : comparison.notes) fmt::print("  {}\n", note);
    fmt::print("\n");
  }
  fmt::print("{:<24}{:>9}  {:>12}  {:>9}  {:>6}\n", "constant", "compared", "worst error", "bound", "digits");
  for (const CheckRecord& record : result.gate.records) {
    fmt::print("{:<24}{:>9}  {:>12.2e}  {:>9.1e}  {:>6}  {}\n", record.name, record.comparisons, record.worst,
               record.bound, CountDigits(record.worst), record.failed ? "DIFFERS" : "ok");
  }
  fmt::print("\n{:<24}{:>9}  {:>12}  {:>9}  {:>6}           {}\n", "term", "compared", "worst error", "bound",
             "digits", "where it is worst");
  for (const CheckRecord& record : result.terms) {
    fmt::print("{:<24}{:>9}  {:>12.2e}  {:>9.1e}  {:>6}  {:<7}  {}, sample {}\n", record.name,
               record.comparisons, record.worst, record.bound, CountDigits(record.worst),
               record.failed ? "DIFFERS" : "ok", Describe(record.where, model, base),
               static_cast<long>(record.at));
  }
  fmt::print("\nErrors are relative to each term's own scale; {} (README.md).\n",
             request.FindTolerance()
                 ? "bounds are those of rounding or the tolerance given, whichever is wider"
                 : "bounds follow from rounding");
}

void PrintVerdict(const Request& request, const Comparison& comparison) {
  const RobotModel& model = *comparison.model;
  const ConsistencyResult& result = comparison.result;
  const int base = model.num_base_velocities();
  if (result.samples < request.options.samples && request.answers.empty()) {
    fmt::print("INTERRUPTED after {} of {} samples. So far:\n", result.samples, request.options.samples);
  }
  if (result.Agrees()) {
    const std::optional<double> tolerance = request.FindTolerance();
    fmt::print("AGREE: {} agree to {} in all {} terms.\n",
               request.with_engine     ? "the analytic model and MuJoCo"
               : request.has_answers() ? "the description and the answers"
                                       : "the two descriptions",
               tolerance ? fmt::format("{:g}", *tolerance) : "rounding", result.terms.size());
    return;
  }
  fmt::print("DISAGREE:\n");
  for (const GateFinding& finding : result.gate.findings) {
    fmt::print("  {}: {}: {:.12g} in {}, {:.12g} in {}\n", finding.check, finding.where, finding.model,
               FileName(request.files.robot), finding.engine, FileName(request.files.mjcf));
  }
  for (const CheckRecord& record : result.terms) {
    if (!record.failed) continue;
    fmt::print("  {}: nearest the base: {}; worst: {}: {:.12g} in {}, {:.12g} in {} (sample {})\n",
               record.name, Describe(record.first_failure, model, base), Describe(record.where, model, base),
               record.model_value, request.with_engine ? "the model" : FileName(request.files.robot),
               record.engine_value, request.with_engine ? "MuJoCo" : FileName(request.files.mjcf),
               static_cast<long>(record.at));
  }
  // Inertias printed with six digits, 1.5708 for pi / 2, a "fullinertia" that the engine diagonalises to
  // 1e-6.
  constexpr int kDigitsOfRoundedInput = 4;
  const int digits = CountDigits(result);
  if (digits < kDigitsOfRoundedInput) return;
  fmt::print(
      "All checks agree to {} digits, as they would with rounded numbers on one side; --digits {} judges by "
      "that.\n",
      digits, digits);
}

Json ToJson(const CheckRecord& record, const RobotModel& model) {
  const int base = model.num_base_velocities();
  Json json = {{"kind", NameOf(record.kind)},
               {"max", record.worst},
               {"bound", record.bound},
               {"pass", !record.failed},
               {"compared", record.comparisons},
               {"where", Describe(record.where, model, base)},
               {"sample", static_cast<long>(record.at)},
               {"model", record.model_value},
               {"engine", record.engine_value},
               {"digits", CountDigits(record.worst)}};
  if (record.failed) json["first_failure"] = Describe(record.first_failure, model, base);
  return json;
}

const char* Judge(ExitCode code) {
  if (code == kSuccess) return "pass";
  return code == kDisagreement ? "disagreement" : "failed";
}

std::string ToText(const Request& request, const Comparison& comparison, ExitCode code) {
  const RobotModel& model = *comparison.model;
  const ConsistencyResult& result = comparison.result;
  Json json = {{"robot", request.files.robot.string()},
               {"mjcf", request.files.mjcf.string()},
               {"mujoco", mj_versionString()},
               {"samples", result.samples},
               {"samples_requested", request.options.samples},
               {"seed", request.options.seed},
               {"seconds", result.seconds},
               {"verdict", Judge(code)}};
  json["notes"] = comparison.notes;
  if (const std::optional<double> tolerance = request.FindTolerance()) json["tolerance"] = *tolerance;
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

ConsistencyResult Compare(const Request& request,
                          const std::function<ConsistencyResult(const std::function<bool(long)>&)>& check) {
  ProgressBar bar("comparing", request.options.samples, request.quiet);
  ConsistencyResult result = check([&](long samples) {
    bar.Update(samples);
    return !IsInterrupted();
  });
  bar.Finish();
  return result;
}

UrdfOptions MakeUrdfOptions(const Request& request) {
  UrdfOptions options;
  options.packages.assign(request.packages.begin(), request.packages.end());
  options.floating = request.floating;
  return options;
}

/// Accepts a number above 0 and below 1.
std::string Fraction(const std::string& text) {
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const std::from_chars_result read = std::from_chars(text.data(), end, value);
  if (read.ec == std::errc() && read.ptr == end && 0.0 < value && value < 1.0) return {};
  return "must be a number above 0 and below 1, got " + Quote(text);
}

/// Accepts a number above 0.
std::string PositiveNumber(const std::string& text) {
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const std::from_chars_result read = std::from_chars(text.data(), end, value);
  if (read.ec == std::errc() && read.ptr == end && value > 0.0 && std::isfinite(value)) return {};
  return "must be a number above 0, got " + Quote(text);
}

void AppendTo(std::vector<std::string>* notes, const std::vector<std::string>& more) {
  notes->insert(notes->end(), more.begin(), more.end());
}

/// A parameter file against the engine.
void CompareTableWithEngine(const Request& request, Comparison* comparison) {
  const RobotDescription table = ReadDescription(request.files.robot);
  comparison->model.emplace(table.spec);
  const MjModelPtr engine = LoadMjcf(request.files.mjcf);
  const Adapter adapter(*comparison->model, *engine, request.files.mjcf.string());
  comparison->result = Compare(request, [&](const std::function<bool(long)>& progress) {
    return CheckConsistency(adapter, request.options, progress);
  });
  AppendTo(&comparison->notes, CheckDescription(table, adapter, &comparison->result.gate));
  AppendTo(&comparison->notes, DescribeBaseCoordinates(table));
}

/// A URDF, or another MJCF, against the engine.
void CompareDescriptionWithEngine(const Request& request, Comparison* comparison) {
  RobotDescription robot = ReadDescription(request.files.robot, MakeUrdfOptions(request));
  const MjModelPtr engine = LoadMjcf(request.files.mjcf);
  Completion completion = CompleteFromEngine(*engine, FileName(request.files.mjcf), &robot);
  comparison->model.emplace(robot.spec);
  const Adapter adapter(*comparison->model, *engine, request.files.mjcf.string());
  comparison->result = Compare(request, [&](const std::function<bool(long)>& progress) {
    return CheckConsistency(adapter, request.options, progress);
  });
  GateResult& gate = comparison->result.gate;
  std::erase_if(gate.records, [&](const CheckRecord& record) {
    return std::find(completion.unstated.begin(), completion.unstated.end(), record.name) !=
           completion.unstated.end();
  });
  const std::vector<std::string> others = CheckDescription(robot, adapter, &gate);
  for (const auto& notes : {robot.notes, completion.notes, others, DescribeBaseCoordinates(robot)}) {
    AppendTo(&comparison->notes, notes);
  }
}

/// Two descriptions without the engine.
void CompareTwoDescriptions(const Request& request, Comparison* comparison) {
  RobotDescription a = ReadDescription(request.files.robot, MakeUrdfOptions(request));
  RobotDescription b = ReadDescription(request.files.mjcf, MakeUrdfOptions(request));
  const std::vector<std::string> taken = CompleteEachOther(&a, &b);
  for (const auto& notes : {a.notes, b.notes, taken, DescribeBaseCoordinates(a)}) {
    AppendTo(&comparison->notes, notes);
  }
  comparison->model.emplace(a.spec);
  comparison->result = Compare(request, [&](const std::function<bool(long)>& progress) {
    return CompareDescriptions(a, b, request.options, progress);
  });
}

/// A description against what a program answers, or has answered; of an MJCF the engine is the other side.
void CompareWithAnswers(const Request& request, Comparison* comparison) {
  const RobotDescription robot = ReadDescription(request.files.robot, MakeUrdfOptions(request));
  comparison->model.emplace(robot.spec);
  const std::unique_ptr<TermSide> reference = MakeReferenceSide(robot, request.files.robot.string());
  std::unique_ptr<AnsweringSide> side;
  std::function<StateFeed()> make_feed = [&] {
    return FeedRandomStates(*comparison->model, request.options);
  };
  if (request.answers.empty()) {
    side = std::make_unique<ProgramSide>(request.program, robot, request.program_options);
  } else {
    auto answers = std::make_unique<AnswerFiles>(request.answers, robot);
    make_feed = [&feed = *answers] { return feed.MakeFeed(); };
    side = std::move(answers);
  }
  for (const auto& notes : {robot.notes, DescribeBaseCoordinates(robot)}) AppendTo(&comparison->notes, notes);
  comparison->result = Compare(request, [&](const std::function<bool(long)>& progress) {
    return CompareAnswers(robot, reference.get(), side.get(), make_feed, progress, &comparison->notes);
  });
}

/// Puts A and B where --robot and --mjcf would stand: an MJCF second, if there is one.
void SortSides(Request* request) {
  if (request->a.empty() && !request->has_answers()) return;
  if (request->has_answers()) {
    if (request->a.empty() || !request->b.empty()) {
      throw InputError("consistency: one file must be given beside --program or --answers, got " +
                       std::string(request->a.empty() ? "none" : "two"));
    }
    request->files.robot = request->a;
    request->files.mjcf = request->answers.empty() ? std::filesystem::path("the program") : request->answers;
    request->with_engine = false;
    return;
  }
  if (request->b.empty()) {
    throw InputError("consistency: two files must be given, got " + Quote(request->a));
  }
  request->files = {request->a, request->b};
  const bool engine_first = FindFormat(request->files.robot) == RobotFormat::kMjcf;
  if (engine_first && FindFormat(request->files.mjcf) != RobotFormat::kMjcf) {
    std::swap(request->files.robot, request->files.mjcf);
  }
  request->with_engine = FindFormat(request->files.mjcf) == RobotFormat::kMjcf;
}

int Run(Request request) {
  SortSides(&request);
  CatchInterrupts();
  std::optional<OutputFile> json;
  if (!request.json_file.empty()) json.emplace(request.json_file);
  Comparison comparison;
  if (request.has_answers()) {
    CompareWithAnswers(request, &comparison);
  } else if (!request.with_engine) {
    CompareTwoDescriptions(request, &comparison);
  } else if (FindFormat(request.files.robot) == RobotFormat::kToml) {
    CompareTableWithEngine(request, &comparison);
  } else {
    CompareDescriptionWithEngine(request, &comparison);
  }
  if (const std::optional<double> tolerance = request.FindTolerance()) {
    JudgeByTolerance(*tolerance, &comparison.result);
  }
  const ConsistencyResult& result = comparison.result;
  const bool is_whole = result.samples >= request.options.samples || !request.answers.empty();
  ExitCode code = is_whole ? kSuccess : kFailure;
  if (!result.Agrees()) code = kDisagreement;
  if (json) json->Write(ToText(request, comparison, code));
  if (!request.PrintsJson()) {
    if (!request.quiet) PrintTable(request, comparison);
    PrintVerdict(request, comparison);
  }
  return code;
}

}  // namespace

void AddConsistencyCommand(Command app) {
  constexpr long kMaxSamples = 1000000000;
  const auto request = std::make_shared<Request>();
  Command command = app.AddCommand("consistency", "Compare every term of model and engine at random states");
  const Option robot = AddRobotOptions(command, &request->files);
  command
      .AddOption("A", &request->a,
                 "One of two descriptions of a robot, instead of --robot and --mjcf: parameter file (TOML), "
                 "URDF or MJCF")
      .TypeName("FILE")
      .Excludes(robot);
  command.AddOption("B", &request->b, "The other one").TypeName("FILE");
  const Option program =
      command
          .AddOption("--program", &request->program,
                     "Command of a program that answers terms, instead of B (harness/sides/README.md)")
          .TypeName("CMD");
  command
      .AddOption(
          "--answers", &request->answers,
          "Folder with states as dexcheck states writes them and NumPy arrays of answers, instead of B")
      .TypeName("FOLDER")
      .Excludes(program);
  command.AddOption("--time-limit", &request->program_options.seconds, "For each answer of the program, s")
      .TypeName("S")
      .Check(PositiveNumber)
      .ShowDefault();
  command.AddFlag("--floating", &request->floating, "The root of a URDF floats");
  command.AddOption("--package", &request->packages, "Folder of a URDF's packages; its meshes are looked for")
      .TypeName("PATH")
      .Repeatable();
  command.AddOption("--samples", &request->options.samples, "Number of random states")
      .TypeName("N")
      .Check(WholeNumber(1, kMaxSamples))
      .ShowDefault();
  command.AddOption("--seed", &request->options.seed, "Of the random states")
      .TypeName("N")
      .Check(WholeNumber(0, std::numeric_limits<std::uint64_t>::max()))
      .ShowDefault();
  command
      .AddOption("--json", &request->json_file,
                 "Write the results to this file (- for standard output, then without the table)")
      .TypeName("FILE.json");
  constexpr int kMostDigits = 15;
  const Option digits = command
                            .AddOption("--digits", &request->digits,
                                       "Agreement to this many digits of a term's scale is enough")
                            .TypeName("N")
                            .Check(WholeNumber(1, kMostDigits));
  command.AddOption("--tolerance", &request->tolerance, "The same as a relative tolerance")
      .TypeName("REL")
      .Check(Fraction)
      .Excludes(digits);
  command.AddFlag("--quiet", &request->quiet, "Print the verdict only");
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
