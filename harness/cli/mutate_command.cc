#include <fmt/format.h>

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "harness/base/interrupts.h"
#include "harness/cli/campaign_table.h"
#include "harness/cli/commands.h"
#include "harness/cli/run_folder.h"
#include "harness/diagnosis/formula_mutants.h"
#include "harness/engine/engine.h"
#include "harness/report/page.h"
#include "harness/run/run_mutation.h"

namespace dexcheck::cli {
namespace {

struct MutateRequest : Outputs {
  RobotFiles files;  // or a scenario in the place of the robot, in whose run faults are made
  MutationOptions options;
  Overrides overrides;
  RunMutationOptions run;
  std::optional<double> duration;
  std::uint64_t jobs = 0;
  bool no_diagnosis = false;
};

/// @param missed what is said of a fault that was found, and is not the first cause.
Json Describe(const TriedFault& tried, const std::string& missed) {
  const bool is_missed = tried.outcome == MutantOutcome::kKilled && !tried.named_first;
  Json fault = MakeFaultResult(tried.kind, tried.name, tried.outcome, tried.named_first,
                               tried.outcome == MutantOutcome::kSurvived   ? "survived: " + tried.name
                               : tried.outcome == MutantOutcome::kNoEffect ? "no effect: " + tried.name
                               : is_missed                                 ? missed
                                                                           : "");
  fault["failed_checks"] = tried.failed_checks;
  return fault;
}

Json Describe(const Mutant& mutant, bool diagnosed) {
  const std::string missed = fmt::format("cause: {} ({}): named {}{}", mutant.name, mutant.kind,
                                         mutant.named.empty() ? "nothing" : mutant.named,
                                         mutant.named_equal ? ", which is listed as equal" : "");
  Json fault = Describe(static_cast<const TriedFault&>(mutant), diagnosed ? missed : "");
  fault["named"] = mutant.named;
  fault["named_equal"] = mutant.named_equal;
  fault["explained"] = mutant.explained;
  return fault;
}

Json Describe(const FormulaMutant& mutant) {
  return Describe(mutant, fmt::format("cause: {}: expected {}, failed {}", mutant.name, mutant.equation.term,
                                      mutant.failed_checks));
}

/// Makes faults in two descriptions.
int MutateFiles(MutateRequest request) {
  request.files.TakeShipped();
  request.options.diagnose = !request.no_diagnosis;
  const DescriptionFile robot(request.files.robot);
  if (robot.format() != RobotFormat::kToml)
    throw InputError(request.files.robot.string() + ": must be a parameter file to get faults");
  const MutatedPair pair(robot, DescriptionFile(request.files.mjcf));
  const RobotModel& model = pair.model;
  RequireNoBalls(model, "when faults are injected into each number");
  const Adapter adapter(model, *pair.engine, pair.source);
  CatchInterrupts();
  ReportOutput output(request);
  ConsistencyOptions unchanged;
  unchanged.samples = request.options.samples;
  unchanged.seed = request.options.seed;
  if (!CheckConsistency(adapter, unchanged, [](long) { return true; }).Agrees()) {
    throw InputError(request.files.robot.string() + ": must agree with " + pair.source +
                     " before faults are injected (see dexcheck diagnose), got a disagreement");
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
  campaign.Make(request.jobs, request.quiet, [&](size_t i) {
    if (i < formulas.size()) {
      RunFormulaMutant(adapter, request.options.samples, &formulas[i]);
      return Describe(formulas[i]);
    }
    Mutant& mutant = mutants[i - formulas.size()];
    TryMutant(pair, request.options, &mutant);
    return Describe(mutant, campaign.names_causes);
  });
  return output.Write(campaign.MakeReport());
}

/// Describes what the table does not say: that a fault was not found, or that its cause or name is another.
std::string DescribeException(const RunMutant& mutant) {
  const std::string& name = mutant.all.name;
  if (mutant.refused) return fmt::format("refused: {}: {}", name, mutant.failure);
  if (mutant.no_effect) return "no effect: " + name;
  if (!mutant.killed) return "survived: " + name;
  if (mutant.faults.size() == 1 && !mutant.has_right_cause()) {
    return fmt::format("cause: {}: expected {}, named {} ({})", name, NameOf(mutant.all.cause),
                       NameOf(mutant.cause), mutant.evidence);
  }
  if (mutant.is_named()) return "";
  if (mutant.all.truth.empty())
    return fmt::format("part: {}: expected {}, named {}", name, mutant.all.part, mutant.evidence);
  const char* const outcome = mutant.score.wrong > 0      ? "WRONG NAME"
                              : mutant.score.in_class > 0 ? "class"
                                                          : "not explained";
  return fmt::format("{}: {}: {}", outcome, name, mutant.causes);
}

Json Describe(const RunMutant& mutant) {
  const MutantOutcome outcome = mutant.refused     ? MutantOutcome::kRefused
                                : mutant.no_effect ? MutantOutcome::kNoEffect
                                : mutant.killed    ? MutantOutcome::kKilled
                                                   : MutantOutcome::kSurvived;
  const bool counts = !mutant.refused && !mutant.no_effect;
  const bool is_right = mutant.faults.size() > 1 ? mutant.is_named() : mutant.has_right_cause();
  Json fault = MakeFaultResult(mutant.all.kind, mutant.all.name, outcome, counts && is_right,
                               DescribeException(mutant));
  if (counts && !(mutant.all.truth.empty() && mutant.all.part.empty()))
    fault["part_named"] = mutant.is_named();
  fault.update({{"expected_cause", NameOf(mutant.all.cause)},
                {"cause", NameOf(mutant.cause)},
                {"expected_part", mutant.all.part},
                {"evidence", mutant.evidence},
                {"failure", mutant.failure},
                {"failed_checks", mutant.failed_checks},
                {"position_error_max_m", mutant.position_error},
                {"causes", mutant.causes},
                {"right", mutant.score.right},
                {"in_class", mutant.score.in_class},
                {"not_explained", mutant.score.not_explained},
                {"wrong", mutant.score.wrong},
                {"as_alone", mutant.is_as_alone()}});
  for (size_t i = 0; i < mutant.truth.size(); ++i)
    fault["names"].push_back({{"injected", mutant.truth[i].fault},
                              {"place", mutant.truth[i].place},
                              {"named", mutant.score.named_as[i]}});
  return fault;
}

/// Says of drawn faults, by the number of those of a set that are found alone, how many are named, and in
/// how many sets each is named as well as when it is alone.
std::string DescribeScores(const Campaign& campaign, int together) {
  constexpr const char* kNames[] = {"right", "in_class", "not_explained", "wrong"};
  struct Count {
    int sets = 0, all_right = 0, as_alone = 0, of[4] = {};
  };
  std::map<int, Count> counts;
  for (const Json& fault : campaign.faults) {
    if (fault.at("outcome") != "found") continue;
    int of[std::size(kNames)] = {};
    for (size_t k = 0; k < std::size(kNames); ++k) of[k] = fault.at(kNames[k]).get<int>();
    Count& count = counts[of[0] + of[1] + of[2]];
    ++count.sets;
    count.all_right += static_cast<int>(of[1] + of[2] + of[3] == 0);
    count.as_alone += static_cast<int>(fault.at("as_alone").get<bool>());
    for (size_t k = 0; k < std::size(kNames); ++k) count.of[k] += of[k];
  }
  std::string text;
  for (const auto& [size, one] : counts) {
    const std::string alone = together > 1 ? fmt::format(", each as well as alone in {}", one.as_alone) : "";
    text += fmt::format(
        "{} sets of {}: all named in {}{}; of their faults {} named, {} up to a class, {} not explained; {} "
        "wrong names.\n",
        one.sets, size, one.all_right, alone, one.of[0], one.of[1], one.of[2], one.of[3]);
  }
  return text;
}

/// Makes faults in the run of a scenario.
int MutateRun(const MutateRequest& request) {
  RunMutationOptions options = request.run;
  options.scale = request.options.scale;
  options.looks_on = !request.duration && options.draws == 0;
  options.duration = request.duration.value_or(options.draws > 0 ? 0.0 : options.duration);
  const ScenarioFiles files = FindScenario(request.files.robot, request.overrides.List(), /*seed=*/0);
  CatchInterrupts();
  ReportOutput output(request);
  RunCampaign runs(files.scenario, files.robot, files.mjcf, options, IsInterrupted);
  Campaign campaign{.faults = {},
                    .total = runs.mutants().size(),
                    .head = {{"scenario", request.files.robot.string()},
                             {"overrides", request.overrides.List()},
                             {"from_s", options.from},
                             {"duration_s", runs.duration()},
                             {"scale", options.scale},
                             {"numbers", options.parameters},
                             {"kinds_drawn", options.kinds},
                             {"draws", options.draws},
                             {"together", options.together},
                             {"draw_seed", options.seed}}};
  campaign.Resume(request.json_file, {files.scenario.source, files.robot, files.mjcf});
  campaign.Make(request.jobs, request.quiet || !output.prints(), [&](size_t i) {
    runs.Run(i, [] { return false; });
    return Describe(runs.mutants()[i]);
  });
  Report report = campaign.MakeReport();
  report.page = [&] { return MakeCampaignPage(report.data); };
  if (options.draws > 0) report.last = DescribeScores(campaign, options.together);
  return output.Write(report);
}

}  // namespace

void AddMutateCommand(CLI::App* app) {
  const auto request = std::make_shared<MutateRequest>();
  CLI::App* command = AddCommand(
      app, "mutate", "Inject faults into numbers and equations, and count which are found and named",
      {"dexcheck mutate arm.toml arm.xml", "dexcheck mutate panda-reach --draws 20 --page faults.html"});
  AddFileOptions(
      command,
      "Scenario whose run gets the faults: numbers, equations, laws, plants; with B a parameter file",
      "The same robot for the engine; without both, the shipped pair", &request->files);
  AddOption(command, "--scale X", &request->options.scale, "Change of a number, relative to it")
      ->check(NumberFrom(1e-9, 0.5))
      ->capture_default_str();
  AddOverrideOptions(command, &request->overrides);
  AddOption(command, "--from T", &request->run.from,
            "In a run: when the fault begins, s; in a joint motion it begins at once")
      ->check(NumberFrom(0.0, 1e4))
      ->capture_default_str();
  AddOption(command, "--duration T", &request->duration,
            "In a run: time after the fault, s (default 0.1; random faults of a joint motion, and faults not "
            "found, run to the end)")
      ->check(NumberFrom(1e-3, 1e4));
  AddOption(command, "--numbers N", &request->run.parameters,
            "In a run: number of changed parameters, spread over all")
      ->check(WholeNumber(0, 100000))
      ->capture_default_str();
  CLI::Option* const draws = AddOption(command, "--draws N", &request->run.draws,
                                       "In a run: sets of random faults, instead of the systematic ones")
                                 ->check(WholeNumber(1, 100000));
  AddOption(command, "--together N", &request->run.together, "With --draws: faults at once")
      ->check(WholeNumber(1, 5))
      ->needs(draws)
      ->capture_default_str();
  AddOption(command, "--draw-seed N", &request->run.seed, "In a run: seed of the random sets")
      ->check(WholeNumber(0, 1000000))
      ->capture_default_str();
  AddOption(
      command, "--kinds KIND,...", &request->run.kinds,
      "In a run: kinds of random faults: motor, sensor, joint, body, floor, wheels, contact, solver, law")
      ->delimiter(',');
  AddSampleOptions(command, 1000, &request->options.samples, &request->options.seed);
  command->add_flag("--no-diagnosis", request->no_diagnosis, "Count found faults, without naming causes");
  AddOption(command, "--page FILE.html", &request->page_file,
            "In a run: a page of injected and found faults");
  AddJobsOption(command, "Faults", &request->jobs);
  AddJsonOption(command, "the results, from which an interrupted campaign goes on,", &request->json_file);
  command->add_flag("--quiet", request->quiet, "Print the verdict only");
  SetAction(command, [=] {
    constexpr std::array kOfFiles = {"--samples", "--seed", "--no-diagnosis"};
    constexpr std::array kOfRuns = {"--set",     "--unset", "--controller", "--from",  "--duration",
                                    "--numbers", "--draws", "--draw-seed",  "--kinds", "--page"};
    const bool has_first = command->count("--robot"), in_run = has_first && !command->count("--mjcf");
    for (const char* option : in_run ? std::span<const char* const>(kOfFiles) : kOfRuns) {
      if (command->count(option))
        throw UsageError(std::string("mutate: ") + option +
                         (in_run ? " is of two files, got the scenario " : " is of a scenario's run, got ") +
                         (in_run      ? request->files.robot.string()
                          : has_first ? "two files"
                                      : "no scenario"));
    }
    return in_run ? MutateRun(*request) : MutateFiles(*request);
  });
}

}  // namespace dexcheck::cli
