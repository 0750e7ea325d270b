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

int Run(MutateRequest request) {
  if (!request.run.scenario.empty()) {
    request.run.options.scale = request.options.scale;
    const bool draws = request.run.options.draws > 0;
    request.run.options.looks_on = !request.duration && !draws;
    request.run.options.duration = request.duration.value_or(draws ? 0.0 : request.run.options.duration);
    request.run.json_file = request.json_file;
    request.run.quiet = request.quiet;
    return MutateRun(request.run);
  }
  request.options.diagnose = !request.no_diagnosis;
  const DescriptionFile robot(request.files.robot);
  if (robot.format() != RobotFormat::kToml)
    throw InputError(request.files.robot.string() + ": must be a parameter file to be changed on purpose");
  const MutatedPair pair(robot, DescriptionFile(request.files.mjcf));
  const RobotModel& model = pair.model;
  RequireNoBalls(model, "when each number is changed on purpose");
  const Adapter adapter(model, *pair.engine, pair.source);
  CatchInterrupts();
  std::optional<OutputFile> json;
  if (!request.json_file.empty()) json.emplace(request.json_file);
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
  if (json) json->Write(campaign.ToText());
  if (request.json_file != "-") campaign.Print(request.quiet);
  return campaign.ToExitCode();
}

}  // namespace

void AddMutateCommand(Command app) {
  const auto request = std::make_shared<MutateRequest>();
  Command command = app.AddCommand(
      "mutate",
      "Change every number and equation of the model on purpose: which faults are found and named?");
  Option robot = AddRobotOptions(command, &request->files);
  command.AddOption("--scale", &request->options.scale, "Change of a number, relative to it")
      .TypeName("X")
      .Check(NumberFrom(1e-9, 0.5))
      .ShowDefault();
  Option run =
      command
          .AddOption("--run", &request->run.scenario,
                     "Make faults in a run of this scenario instead: numbers, equations, laws, plants")
          .TypeName("SCENARIO");
  for (Option option : AddOverrideOptions(command, &request->run.overrides)) option.Needs(run);
  command
      .AddOption("--from", &request->run.options.from,
                 "In a run: when the fault begins, s; in a motion of joints it is there from the first")
      .TypeName("T")
      .Check(NumberFrom(0.0, 1e4))
      .Needs(run)
      .ShowDefault();
  command
      .AddOption("--duration", &request->duration,
                 "In a run: how long it is looked at, s (default 0.1; faults that are "
                 "drawn in a motion of joints, or not found, are looked at to its end)")
      .TypeName("T")
      .Check(NumberFrom(1e-3, 1e4))
      .Needs(run);
  command
      .AddOption("--numbers", &request->run.options.parameters,
                 "In a run: how many numbers of the model are changed, evenly out of all")
      .TypeName("N")
      .Check(WholeNumber(0, 100000))
      .Needs(run)
      .ShowDefault();
  Option draws =
      command
          .AddOption("--draws", &request->run.options.draws,
                     "In a run: sets of faults whose places, sizes and times are drawn, and whether "
                     "they are named, in the place of the others")
          .TypeName("N")
          .Check(WholeNumber(1, 100000))
          .Needs(run);
  command.AddOption("--together", &request->run.options.together, "With --draws: faults at once")
      .TypeName("N")
      .Check(WholeNumber(1, 5))
      .Needs(draws)
      .ShowDefault();
  command.AddOption("--draw-seed", &request->run.options.seed, "In a run: what is drawn")
      .TypeName("N")
      .Check(WholeNumber(0, 1000000))
      .Needs(run)
      .ShowDefault();
  command
      .AddOption(
          "--kinds", &request->run.options.kinds,
          "In a run: out of which kinds of faults is drawn: motor, sensor, joint, body, floor, wheels, "
          "contact, solver, law (default: all)")
      .TypeName("KIND,...")
      .Delimiter(',')
      .Needs(run);
  const auto states = AddSampleOptions(command, 1000, &request->options.samples, &request->options.seed);
  Option no_diagnosis = command.AddFlag("--no-diagnosis", &request->no_diagnosis,
                                        "Only whether each is found, not what is named");
  robot.Excludes(run);
  for (Option option : states) option.Excludes(run);
  no_diagnosis.Excludes(run);
  command
      .AddOption("--page", &request->run.page_file,
                 "In a run: an HTML page with what was made, what was found, and how it was named")
      .TypeName("FILE")
      .Needs(run);
  AddJobsOption(command, "Faults", &request->run.jobs);
  AddJsonOption(command, "the results, from which an interrupted campaign goes on,", &request->json_file);
  command.AddFlag("--quiet", &request->quiet, "Print the verdict only");
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
