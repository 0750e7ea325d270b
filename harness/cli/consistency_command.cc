#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/interrupts.h"
#include "harness/checks/consistency.h"
#include "harness/cli/commands.h"
#include "harness/cli/consistency_report.h"
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

ConsistencyResult Compare(const ConsistencyRequest& request,
                          const std::function<ConsistencyResult(const std::function<bool(long)>&)>& check) {
  ProgressBar bar("comparing", request.options.samples, request.quiet);
  ConsistencyResult result = check([&](long samples) {
    bar.Update(samples);
    return !IsInterrupted();
  });
  bar.Finish();
  return result;
}

UrdfOptions MakeUrdfOptions(const ConsistencyRequest& request) {
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
void CompareTableWithEngine(const ConsistencyRequest& request, Comparison* comparison) {
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
void CompareDescriptionWithEngine(const ConsistencyRequest& request, Comparison* comparison) {
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
    return !record.failed && std::find(completion.unstated.begin(), completion.unstated.end(), record.name) !=
                                 completion.unstated.end();
  });
  const std::vector<std::string> others = CheckDescription(robot, adapter, &gate);
  for (const auto& notes : {robot.notes, completion.notes, others, DescribeBaseCoordinates(robot)}) {
    AppendTo(&comparison->notes, notes);
  }
}

/// Two descriptions without the engine.
void CompareTwoDescriptions(const ConsistencyRequest& request, Comparison* comparison) {
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
void CompareWithAnswers(const ConsistencyRequest& request, Comparison* comparison) {
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

/// Why the two differ: of a parameter file or URDF against an MJCF the latter is read as a description.
void Explain(const ConsistencyRequest& request, Comparison* comparison) {
  if (comparison->result.Agrees() || request.has_answers()) return;
  comparison->hypotheses =
      ExplainDifference(request.files.robot, request.files.mjcf, MakeUrdfOptions(request));
}

/// Puts A and B where --robot and --mjcf would stand: an MJCF second, if there is one.
void SortSides(ConsistencyRequest* request) {
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

int Run(ConsistencyRequest request) {
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
  Explain(request, &comparison);
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
  constexpr std::uint64_t kMaxSamples = 1000000000;
  const auto request = std::make_shared<ConsistencyRequest>();
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
  AddSampleOptions(command, kMaxSamples, &request->options.samples, &request->options.seed);
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
