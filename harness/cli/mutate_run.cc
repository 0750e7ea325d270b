#include "harness/cli/mutate_run.h"

#include <fmt/format.h>

#include <map>
#include <optional>

#include "harness/base/interrupts.h"
#include "harness/cli/campaign_table.h"
#include "harness/cli/output_file.h"
#include "harness/cli/run_folder.h"
#include "harness/cli/terminal.h"
#include "harness/report/page.h"
#include "harness/run/run_mutation.h"

namespace dexcheck::cli {
namespace {

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

CampaignFault Describe(const RunMutant& mutant) {
  CampaignFault fault{.kind = mutant.all.kind, .name = mutant.all.name};
  fault.outcome = mutant.refused     ? MutantOutcome::kRefused
                  : mutant.no_effect ? MutantOutcome::kNoEffect
                  : mutant.killed    ? MutantOutcome::kKilled
                                     : MutantOutcome::kSurvived;
  const bool counts = !mutant.refused && !mutant.no_effect;
  fault.cause_right = counts && (mutant.faults.size() > 1 ? mutant.is_named() : mutant.has_right_cause());
  if (counts && !(mutant.all.truth.empty() && mutant.all.part.empty())) fault.part_named = mutant.is_named();
  fault.exception = DescribeException(mutant);
  fault.details = {{"expected_cause", NameOf(mutant.all.cause)},
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
                   {"as_alone", mutant.is_as_alone()}};
  for (size_t i = 0; i < mutant.truth.size(); ++i)
    fault.details["names"].push_back({{"injected", mutant.truth[i].fault},
                                      {"place", mutant.truth[i].place},
                                      {"named", mutant.score.named_as[i]}});
  return fault;
}

/// Prints for drawn faults, by the number of those of a set that are found alone, how many are named, and in
/// how many sets each is named as well as when it is alone.
void PrintScores(const Campaign& campaign, int together) {
  constexpr const char* kNames[] = {"right", "in_class", "not_explained", "wrong"};
  struct Count {
    int sets = 0, all_right = 0, as_alone = 0, of[4] = {};
  };
  std::map<int, Count> counts;
  for (const CampaignFault& fault : campaign.faults) {
    if (fault.outcome != MutantOutcome::kKilled) continue;
    int of[std::size(kNames)] = {};
    for (size_t k = 0; k < std::size(kNames); ++k) of[k] = fault.details[kNames[k]].get<int>();
    Count& count = counts[of[0] + of[1] + of[2]];
    ++count.sets;
    count.all_right += static_cast<int>(of[1] + of[2] + of[3] == 0);
    count.as_alone += static_cast<int>(fault.details["as_alone"].get<bool>());
    for (size_t k = 0; k < std::size(kNames); ++k) count.of[k] += of[k];
  }
  for (const auto& [size, one] : counts) {
    const std::string alone = together > 1 ? fmt::format(", each as well as alone in {}", one.as_alone) : "";
    fmt::print(
        "{} sets of {}: all named in {}{}; of their faults {} named, {} up to a class, {} not explained; {} "
        "wrong names.\n",
        one.sets, size, one.all_right, alone, one.of[0], one.of[1], one.of[2], one.of[3]);
  }
}

}  // namespace

int MutateRun(const MutateRunRequest& request) {
  const ScenarioFiles files = FindScenario(request.scenario, request.overrides.List(), /*seed=*/0);
  CatchInterrupts();
  ResultFile json(request.json_file), page(request.page_file);
  RunCampaign runs(files.scenario, files.robot, files.mjcf, request.options, IsInterrupted);
  const RunMutationOptions& options = request.options;
  Campaign campaign{.faults = {},
                    .total = runs.mutants().size(),
                    .head = {{"scenario", request.scenario},
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
  ProgressBar bar("changing", static_cast<long>(campaign.total), request.quiet || json.TakesStdout());
  campaign.Make(request.jobs, &bar, [&](size_t i) {
    runs.Run(i, [] { return false; });
    return Describe(runs.mutants()[i]);
  });
  bar.Finish();
  json.Write([&] { return campaign.ToJson(); });
  page.Write([&] { return MakeCampaignPage(campaign.ToJson()); });
  if (json.TakesStdout()) return campaign.ToExitCode();
  campaign.Print(request.quiet);
  if (request.options.draws > 0) PrintScores(campaign, request.options.together);
  return campaign.ToExitCode();
}

}  // namespace dexcheck::cli
