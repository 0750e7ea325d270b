#include <fmt/format.h>

#include <algorithm>
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
#include "harness/checks/answers_comparison.h"
#include "harness/checks/tolerance.h"
#include "harness/cli/commands.h"
#include "harness/cli/consistency_report.h"
#include "harness/cli/output_file.h"
#include "harness/cli/progress_bar.h"
#include "harness/descriptions/answer_files.h"
#include "harness/descriptions/program_side.h"
#include "harness/descriptions/read_description.h"

namespace dexcheck::cli {
namespace {

/// Calls `check` with what it tells its progress.
void ShowProgress(const ConsistencyRequest& request,
                  const std::function<void(const std::function<bool(long)>&)>& check) {
  ProgressBar bar("comparing", request.options.samples, request.quiet);
  check([&](long samples) {
    bar.Update(samples);
    return !IsInterrupted();
  });
  bar.Finish();
}

UrdfOptions MakeUrdfOptions(const ConsistencyRequest& request) {
  UrdfOptions options;
  options.packages.assign(request.packages.begin(), request.packages.end());
  options.floating = request.floating;
  return options;
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
  comparison->notes = robot.notes;
  for (const std::string& note : DescribeCoordinates(robot)) comparison->notes.push_back(note);
  ShowProgress(request, [&](const std::function<bool(long)>& progress) {
    comparison->result = CompareAnswers(robot, reference.get(), side.get(), make_feed, progress,
                                        &comparison->notes, &comparison->not_compared);
  });
}

/// Puts A and B where --robot and --mjcf would stand.
void SortSides(ConsistencyRequest* request) {
  if (request->a.empty() && !request->has_answers()) return;
  if (request->has_answers()) {
    if (request->a.empty() || !request->b.empty()) {
      throw InputError("consistency: one file must be given beside --program or --answers, got " +
                       std::string(request->a.empty() ? "none" : "two"));
    }
    request->files.robot = request->a;
    request->files.mjcf = request->answers.empty() ? std::filesystem::path("the program") : request->answers;
    return;
  }
  if (request->b.empty()) {
    throw InputError("consistency: two files must be given, got " + Quote(request->a));
  }
  request->files = {request->a, request->b};
}

int Run(ConsistencyRequest request) {
  SortSides(&request);
  CatchInterrupts();
  std::optional<OutputFile> json;
  if (!request.json_file.empty()) json.emplace(request.json_file);
  std::optional<OutputFile> junit;
  if (!request.junit_file.empty()) junit.emplace(request.junit_file);
  Comparison comparison;
  if (request.has_answers()) {
    comparison.first = request.files.robot;
    comparison.second = request.files.mjcf;
    CompareWithAnswers(request, &comparison);
  } else {
    ShowProgress(request, [&](const std::function<bool(long)>& progress) {
      comparison = CompareFiles(request.files.robot, request.files.mjcf, MakeUrdfOptions(request),
                                request.options, progress);
    });
  }
  if (const std::optional<double> tolerance = request.judging.Find()) {
    JudgeByTolerance(*tolerance, &comparison.result);
  }
  if (!request.has_answers())
    ExplainComparison(MakeUrdfOptions(request), &comparison, request.judging.Find().value_or(0.0));
  const ConsistencyResult& result = comparison.result;
  const bool is_whole = result.samples >= request.options.samples || !request.answers.empty();
  ExitCode code = is_whole ? kSuccess : kFailure;
  if (!result.Agrees()) code = kDisagreement;
  if (json) json->Write(ToText(request, comparison, code));
  if (junit) junit->Write(WriteJUnit(request, comparison));
  if (!request.PrintsJson()) {
    if (!request.quiet) PrintTable(request, comparison);
    PrintVerdict(request, comparison);
  }
  if (code == kFailure)
    return ReportFailure(
        fmt::format("only {} of {} states were compared", result.samples, request.options.samples));
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
                     "Command of a program that answers terms, instead of B (harness/descriptions/README.md)")
          .TypeName("CMD");
  command
      .AddOption(
          "--answers", &request->answers,
          "Folder with states as dexcheck states writes them and NumPy arrays of answers, instead of B")
      .TypeName("FOLDER")
      .Excludes(program);
  command.AddOption("--time-limit", &request->program_options.seconds, "For each answer of the program, s")
      .TypeName("S")
      .Check(PositiveNumber("must be a number above 0"))
      .ShowDefault();
  command.AddFlag("--floating", &request->floating, "The root of a URDF floats");
  command.AddOption("--package", &request->packages, "Folder of a URDF's packages; its meshes are looked for")
      .TypeName("PATH")
      .Repeatable();
  AddSampleOptions(command, kMaxSamples, &request->options.samples, &request->options.seed);
  AddJsonOption(command, "the results", &request->json_file);
  AddJUnitOption(command, &request->junit_file);
  AddToleranceOptions(command, &request->judging);
  AddIgnoreOption(command, &request->options.ignore);
  command.AddFlag("--quiet", &request->quiet, "Print the verdict only");
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
