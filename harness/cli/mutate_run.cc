#include "harness/cli/mutate_run.h"

#include <fmt/format.h>

#include <map>
#include <optional>

#include "harness/base/interrupts.h"
#include "harness/cli/campaign_table.h"
#include "harness/cli/output_file.h"
#include "harness/cli/run_folder.h"
#include "harness/cli/terminal.h"
#include "harness/run/run_mutation.h"

namespace dexcheck::cli {
namespace {

/// What the table does not say: that a fault was not found, or that its cause or part is another.
std::string DescribeException(const RunMutant& mutant) {
  if (mutant.refused) return fmt::format("refused: {}: {}", mutant.name, mutant.failure);
  if (mutant.no_effect) return "no effect: " + mutant.name;
  if (!mutant.killed) {
    const std::string off = mutant.is_as_expected
                                ? ""
                                : fmt::format(", though the object is {:.1e} m off", mutant.position_error);
    return fmt::format("survived: {}{}", mutant.name, off);
  }
  if (!mutant.has_right_cause()) {
    return fmt::format("cause: {}: expected {}, named {} ({})", mutant.name, NameOf(mutant.expected),
                       NameOf(mutant.cause), mutant.evidence);
  }
  if (mutant.names_part) return "";
  return fmt::format("part: {}: expected {}, named {}", mutant.name, mutant.part, mutant.evidence);
}

CampaignFault Describe(const RunMutant& mutant) {
  CampaignFault fault{.kind = mutant.kind, .name = mutant.name};
  fault.outcome = mutant.refused     ? MutantOutcome::kRefused
                  : mutant.no_effect ? MutantOutcome::kNoEffect
                  : mutant.killed    ? MutantOutcome::kKilled
                                     : MutantOutcome::kSurvived;
  const bool counts = !mutant.refused && !mutant.no_effect;
  fault.cause_right = counts && mutant.has_right_cause();
  if (counts && !mutant.part.empty()) fault.part_named = fault.cause_right && mutant.names_part;
  fault.exception = DescribeException(mutant);
  if (!mutant.truth.empty()) {
    const NamingScore& score = mutant.score;
    const bool all = score.right == static_cast<int>(mutant.truth.size()) && score.wrong == 0;
    fault.cause_right = counts && all;
    fault.part_named.reset();
    if (counts && mutant.killed)
      fault.exception = all ? ""
                            : fmt::format("{}: {}: {}", mutant.name,
                                          score.wrong > 0      ? "WRONG NAME"
                                          : score.in_class > 0 ? "class"
                                                               : "not explained",
                                          mutant.causes);
  }
  fault.details = {{"expected_cause", NameOf(mutant.expected)},
                   {"cause", NameOf(mutant.cause)},
                   {"expected_part", mutant.part},
                   {"part_named", mutant.names_part},
                   {"evidence", mutant.evidence},
                   {"failure", mutant.failure},
                   {"failed_checks", mutant.failed_checks},
                   {"position_error_max_m", mutant.position_error},
                   {"causes", mutant.causes},
                   {"right", mutant.score.right},
                   {"in_class", mutant.score.in_class},
                   {"not_explained", mutant.score.not_explained},
                   {"wrong", mutant.score.wrong}};
  return fault;
}

/// Of drawn faults, by the number of those of a set that are found alone: how many are named.
void PrintScores(const Campaign& campaign) {
  struct Count {
    int sets = 0, all_right = 0, right = 0, in_class = 0, not_explained = 0, wrong = 0;
  };
  std::map<int, Count> counts;
  for (const CampaignFault& fault : campaign.faults) {
    if (fault.outcome != MutantOutcome::kKilled) continue;
    const int right = fault.details["right"].get<int>();
    const int in_class = fault.details["in_class"].get<int>();
    const int not_explained = fault.details["not_explained"].get<int>();
    Count& count = counts[right + in_class + not_explained];
    ++count.sets;
    count.all_right += static_cast<int>(in_class + not_explained == 0);
    count.right += right;
    count.in_class += in_class;
    count.not_explained += not_explained;
    count.wrong += fault.details["wrong"].get<int>();
  }
  for (const auto& [size, one] : counts)
    fmt::print(
        "{} sets of {}: all named in {}; of their faults {} named, {} up to a class, {} not explained; {} "
        "wrong names.\n",
        one.sets, size, one.all_right, one.right, one.in_class, one.not_explained, one.wrong);
}

}  // namespace

int MutateRun(const MutateRunRequest& request) {
  const ScenarioFiles files = FindScenario(request.scenario, request.overrides.List(), /*seed=*/0);
  CatchInterrupts();
  std::optional<OutputFile> json;
  if (!request.json_file.empty()) json.emplace(request.json_file);
  RunCampaign runs(files.scenario, files.robot, files.mjcf, request.options, IsInterrupted);
  Campaign campaign{.faults = {}, .total = runs.mutants().size()};
  ProgressBar bar("changing", static_cast<long>(campaign.total), request.quiet || request.json_file == "-");
  campaign.Make(request.jobs, &bar, [&](size_t i) {
    runs.Run(i, [] { return false; });
    return Describe(runs.mutants()[i]);
  });
  bar.Finish();
  if (json) {
    json->Write(campaign.ToText({{"scenario", request.scenario},
                                 {"overrides", request.overrides.List()},
                                 {"from_s", request.options.from},
                                 {"duration_s", request.options.duration},
                                 {"scale", request.options.scale}}));
  }
  if (request.json_file != "-") campaign.Print(request.quiet);
  if (request.json_file != "-" && request.options.draws > 0) PrintScores(campaign);
  return campaign.ToExitCode();
}

}  // namespace dexcheck::cli
