#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "harness/base/interrupts.h"
#include "harness/cli/campaign_table.h"
#include "harness/cli/commands.h"
#include "harness/cli/mutate_run.h"
#include "harness/cli/output_file.h"
#include "harness/cli/terminal.h"
#include "harness/diagnosis/formula_mutants.h"
#include "harness/engine/engine.h"

namespace dexcheck::cli {
namespace {

struct MutateRequest {
  MutateRunRequest run;  // with a scenario, faults are made in its run
  RobotFiles files;
  MutationOptions options;
  std::optional<double> duration;
  bool no_diagnosis = false;
  std::string json_file;
  bool quiet = false;
};

CampaignFault Describe(const TriedFault& tried) {
  CampaignFault fault{
      .kind = tried.kind, .name = tried.name, .outcome = tried.outcome, .cause_right = tried.named_first};
  if (tried.outcome == MutantOutcome::kSurvived) fault.exception = "survived: " + tried.name;
  if (tried.outcome == MutantOutcome::kNoEffect) fault.exception = "no effect: " + tried.name;
  fault.details = {{"failed_checks", tried.failed_checks}};
  return fault;
}

bool IsMissed(const TriedFault& tried) {
  return tried.outcome == MutantOutcome::kKilled && !tried.named_first;
}

CampaignFault Describe(const Mutant& mutant, bool diagnosed) {
  CampaignFault fault = Describe(static_cast<const TriedFault&>(mutant));
  if (diagnosed && IsMissed(mutant)) {
    fault.exception = fmt::format("cause: {} ({}): named {}{}", mutant.name, mutant.kind,
                                  mutant.named.empty() ? "nothing" : mutant.named,
                                  mutant.named_equal ? ", which is listed as equal" : "");
  }
  fault.details["named"] = mutant.named;
  fault.details["named_equal"] = mutant.named_equal;
  fault.details["explained"] = mutant.explained;
  return fault;
}

CampaignFault Describe(const FormulaMutant& mutant) {
  CampaignFault fault = Describe(static_cast<const TriedFault&>(mutant));
  if (IsMissed(mutant))
    fault.exception = fmt::format("cause: {}: expected {}, failed {}", mutant.name, mutant.equation.term,
                                  mutant.failed_checks);
  return fault;
}

/// Makes faults in a run of the scenario that stands in the place of two files.
int RunInScenario(MutateRequest request) {
  request.run.scenario = request.files.robot;
  request.run.options.scale = request.options.scale;
  const bool draws = request.run.options.draws > 0;
  request.run.options.looks_on = !request.duration && !draws;
  request.run.options.duration = request.duration.value_or(draws ? 0.0 : request.run.options.duration);
  request.run.json_file = request.json_file;
  request.run.quiet = request.quiet;
  return MutateRun(request.run);
}

int Run(MutateRequest request) {
  request.files.TakeShipped();
  request.options.diagnose = !request.no_diagnosis;
  const DescriptionFile robot(request.files.robot);
  if (robot.format() != RobotFormat::kToml)
    throw InputError(request.files.robot.string() + ": must be a parameter file to be changed on purpose");
  const MutatedPair pair(robot, DescriptionFile(request.files.mjcf));
  const RobotModel& model = pair.model;
  RequireNoBalls(model, "when each number is changed on purpose");
  const Adapter adapter(model, *pair.engine, pair.source);
  CatchInterrupts();
  ResultFile json(request.json_file);
  ConsistencyOptions unchanged;
  unchanged.samples = request.options.samples;
  unchanged.seed = request.options.seed;
  if (!CheckConsistency(adapter, unchanged, [](long) { return true; }).Agrees()) {
    throw InputError(request.files.robot.string() + ": must agree with " + pair.source +
                     " before it is changed on purpose (see dexcheck diagnose), got a disagreement");
  }

  std::vector<Mutant> mutants = ListMutants(model.spec(), request.options.scale);
  std::vector<FormulaMutant> formulas = ListFormulaMutants(model);
  Campaign campaign{.faults = {},
                    .total = mutants.size() + formulas.size(),
                    .names_causes = request.options.diagnose && pair.reference.has_value(),
                    .head = {{"robot", request.files.robot.string()},
                             {"mjcf", request.files.mjcf.string()},
                             {"mujoco", mj_versionString()},
                             {"scale", request.options.scale},
                             {"samples", request.options.samples},
                             {"diagnosed", request.options.diagnose},
                             {"seed", request.options.seed}}};
  campaign.Resume(request.json_file, {request.files.robot, request.files.mjcf});
  ProgressBar bar("changing", static_cast<long>(campaign.total), request.quiet);
  campaign.Make(request.run.jobs, &bar, [&](size_t i) {
    if (i < formulas.size()) {
      RunFormulaMutant(adapter, request.options.samples, &formulas[i]);
      return Describe(formulas[i]);
    }
    Mutant& mutant = mutants[i - formulas.size()];
    TryMutant(pair, request.options, &mutant);
    return Describe(mutant, campaign.names_causes);
  });
  bar.Finish();
  json.Write([&] { return campaign.ToJson(); });
  if (!json.TakesStdout()) campaign.Print(request.quiet);
  return campaign.ToExitCode();
}

}  // namespace

void AddMutateCommand(Command app) {
  const auto request = std::make_shared<MutateRequest>();
  Command command = app.AddCommand(
      "mutate",
      "Change every number and equation of the model on purpose: which faults are found and named?");
  const std::array<Option, 2> files = AddFileOptions(
      command,
      "Scenario whose run gets the faults: numbers, equations, laws, plants; with B a parameter file",
      "The same robot for the engine; without both, the shipped pair", &request->files);
  command.AddOption("--scale X", &request->options.scale, "Change of a number, relative to it")
      .Check(NumberFrom(1e-9, 0.5))
      .ShowDefault();
  std::vector<Option> of_runs;
  for (const Option option : AddOverrideOptions(command, &request->run.overrides)) of_runs.push_back(option);
  of_runs.push_back(
      command
          .AddOption("--from T", &request->run.options.from,
                     "In a run: when the fault begins, s; in a motion of joints it is there from the first")
          .Check(NumberFrom(0.0, 1e4))
          .ShowDefault());
  of_runs.push_back(
      command
          .AddOption("--duration T", &request->duration,
                     "In a run: how long it is looked at, s (default 0.1; faults that are drawn "
                     "in a motion of joints, or not found, are looked at to its end)")
          .Check(NumberFrom(1e-3, 1e4)));
  of_runs.push_back(command
                        .AddOption("--numbers N", &request->run.options.parameters,
                                   "In a run: how many numbers of the model are changed, evenly out of all")
                        .Check(WholeNumber(0, 100000))
                        .ShowDefault());
  const Option draws = command
                           .AddOption("--draws N", &request->run.options.draws,
                                      "In a run: sets of faults whose places, sizes and times are drawn, and "
                                      "whether they are named, in the place of the others")
                           .Check(WholeNumber(1, 100000));
  of_runs.push_back(draws);
  command.AddOption("--together N", &request->run.options.together, "With --draws: faults at once")
      .Check(WholeNumber(1, 5))
      .Needs(draws)
      .ShowDefault();
  of_runs.push_back(command.AddOption("--draw-seed N", &request->run.options.seed, "In a run: what is drawn")
                        .Check(WholeNumber(0, 1000000))
                        .ShowDefault());
  of_runs.push_back(
      command
          .AddOption(
              "--kinds KIND,...", &request->run.options.kinds,
              "In a run: out of which kinds of faults is drawn: motor, sensor, joint, body, floor, wheels, "
              "contact, solver, law (default: all)")
          .Delimiter(','));
  std::vector<Option> of_files;
  for (const Option option :
       AddSampleOptions(command, 1000, &request->options.samples, &request->options.seed))
    of_files.push_back(option);
  of_files.push_back(command.AddFlag("--no-diagnosis", &request->no_diagnosis,
                                     "Only whether each is found, not what is named"));
  of_runs.push_back(
      command.AddOption("--page FILE.html", &request->run.page_file,
                        "In a run: an HTML page with what was made, what was found, and how it was named"));
  AddJobsOption(command, "Faults", &request->run.jobs);
  AddJsonOption(command, "the results, from which an interrupted campaign goes on,", &request->json_file);
  command.AddFlag("--quiet", &request->quiet, "Print the verdict only");
  command.SetAction([=] {
    const bool in_run = files[0].is_given() && !files[1].is_given();
    for (const Option& option : in_run ? of_files : of_runs) {
      if (option.is_given())
        throw UsageError("mutate: " + option.name() +
                         (in_run ? " is of two files, got the scenario " : " is of a scenario's run, got ") +
                         (in_run                ? request->files.robot.string()
                          : files[0].is_given() ? "two files"
                                                : "no scenario"));
    }
    return in_run ? RunInScenario(*request) : Run(*request);
  });
}

}  // namespace dexcheck::cli
