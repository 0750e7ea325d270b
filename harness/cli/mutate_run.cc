#include "harness/cli/mutate_run.h"

#include <fmt/format.h>

#include <optional>

#include "harness/base/interrupts.h"
#include "harness/cli/campaign_table.h"
#include "harness/cli/output_file.h"
#include "harness/cli/progress_bar.h"
#include "harness/cli/run_folder.h"
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
  fault.details = {{"expected_cause", NameOf(mutant.expected)},
                   {"cause", NameOf(mutant.cause)},
                   {"expected_part", mutant.part},
                   {"part_named", mutant.names_part},
                   {"evidence", mutant.evidence},
                   {"failure", mutant.failure},
                   {"failed_checks", mutant.failed_checks},
                   {"position_error_max_m", mutant.position_error}};
  return fault;
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
  return campaign.ToExitCode();
}

}  // namespace dexcheck::cli
