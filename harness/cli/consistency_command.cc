#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>

#include "controller/common/errors.h"
#include "harness/base/interrupts.h"
#include "harness/cli/commands.h"
#include "harness/cli/consistency_report.h"
#include "harness/comparison/consistency.h"
#include "harness/corrections/read_printed.h"
#include "harness/report/page.h"

namespace dexcheck::cli {
namespace {

void TakeFiles(ConsistencyRequest* request) {
  if (!request->has_results()) return request->TakeFiles("consistency");
  const RobotFiles& files = request->files;
  if (files.robot.empty() || !files.mjcf.empty()) {
    throw InputError("consistency: one file must be given beside --program or --results, got " +
                     std::string(files.robot.empty() ? "none" : "two"));
  }
}

std::string MakePage(const ConsistencyRequest& request, const Comparison& comparison, Json result) {
  const DescriptionFile first(request.files.robot, request.urdf);
  const DescriptionFile second(request.files.mjcf, request.urdf);
  for (size_t i = 0; i < result["causes"].size(); ++i) {
    for (const Site& site : comparison.causes->items[i].sites)
      result["causes"][i]["sites"].push_back(NameSite(site.kind));
  }
  return MakeFilesPage(ReadPrintedRobot(first, &second), ReadPrintedRobot(second, &first), result);
}

int Run(ConsistencyRequest request) {
  TakeFiles(&request);
  if (!request.page_file.empty() && request.has_results())
    throw InputError("consistency: --page must have two files");
  for (const std::string& joint : request.lock) AddHeldJoint(joint, &request.options.part);
  for (const std::string& name : request.ignore) {
    const bool is_word =
        std::find(std::begin(kIgnorable), std::end(kIgnorable), name) != std::end(kIgnorable);
    (is_word ? request.options.ignore : request.options.part.left_out).push_back(name);
  }
  if (request.has_results() && !request.options.part.empty())
    throw InputError("consistency: --only, --lock and --ignore BODY must have two files");
  CatchInterrupts();
  ReportOutput files(request);
  ProgressBar bar("comparing", request.options.samples, request.quiet);
  const Comparison comparison = Compare(request, [&](long samples) { return bar.GoOn(samples); });
  bar.Finish();
  Report report =
      MakeReport(request, comparison, files.prints() ? TryRepair(request, comparison) : RepairTrial());
  report.page = [&] { return MakePage(request, comparison, report.data); };
  return files.Write(report);
}

}  // namespace

void AddConsistencyCommand(CLI::App* app) {
  constexpr std::uint64_t kMaxSamples = 1000000000;
  const auto request = std::make_shared<ConsistencyRequest>();
  CLI::App* command =
      AddCommand(app, "consistency", "Compare every term of model and engine at random states",
                 {"dexcheck arm.urdf arm.xml --page files.html",
                  "dexcheck consistency arm.urdf --program 'python3 mine.py'"});
  AddFileOptions(command, "A description of a robot: parameter file (TOML), URDF or MJCF",
                 "Another one of the same robot; without both, the shipped pair", &request->files);
  CLI::Option* const program =
      AddOption(command, "--program CMD", &request->source.program,
                "Command of a program that provides terms, instead of B (harness/descriptions/README.md)");
  AddOption(command, "--results FOLDER", &request->source.results,
            "Folder with states as eval --states writes them and NumPy arrays of results, instead of B")
      ->excludes(program);
  AddOption(command, "--time-limit S", &request->source.program_options.seconds,
            "For each result of the program, s")
      ->check(PositiveNumber("must be a number above 0"))
      ->capture_default_str();
  AddUrdfOptions(command, &request->urdf);
  AddSampleOptions(command, kMaxSamples, &request->options.samples, &request->options.seed);
  AddJsonOption(command, "the results", &request->json_file);
  AddJUnitOption(command, &request->junit_file);
  AddOption(command, "--page FILE.html", &request->page_file,
            "Write a page: both robots in one view, what differs, and the causes");
  AddJudgingOptions(command, request.get());
  AddOption(command, "--ignore WORD,...", &request->ignore,
            "Constants of joints in which the two may differ: armature, damping, friction, coupling to "
            "others, effort; or links to leave out with all that they carry")
      ->delimiter(',');
  AddOption(command, "--only LINK", &request->options.part.only,
            "Compare this link or joint and what it carries only");
  AddOption(command, "--lock JOINT[=VALUE]", &request->lock,
            "Hold a joint at a value (0), rad or m; may be given again")
      ->allow_extra_args(false);
  command->add_flag("--quiet", request->quiet, "Print the verdict only");
  SetAction(command, [=] { return Run(*request); });
}

}  // namespace dexcheck::cli
