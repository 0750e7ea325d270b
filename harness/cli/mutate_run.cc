#include "harness/cli/mutate_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "harness/base/byte_archive.h"
#include "harness/base/interrupts.h"
#include "harness/base/process_pool.h"
#include "harness/cli/command_line.h"
#include "harness/cli/json_matrix.h"
#include "harness/cli/output_file.h"
#include "harness/cli/progress_bar.h"
#include "harness/cli/run_folder.h"
#include "harness/cli/terminal.h"
#include "harness/run/run_mutation.h"

namespace dexcheck::cli {
namespace {

/// A line of the table.
struct RunRow {
  std::string kind;
  int mutants = 0, refused = 0, killed = 0, no_effect = 0, survived = 0, cause = 0, with_part = 0, part = 0;

  void Add(const RunMutant& mutant) {
    ++mutants;
    refused += mutant.refused ? 1 : 0;
    if (mutant.refused) return;
    no_effect += mutant.no_effect ? 1 : 0;
    if (mutant.no_effect) return;
    killed += mutant.killed ? 1 : 0;
    survived += mutant.killed ? 0 : 1;
    cause += mutant.has_right_cause() ? 1 : 0;
    if (mutant.part.empty()) return;
    ++with_part;
    part += mutant.has_right_cause() && mutant.names_part ? 1 : 0;
  }
};

std::vector<RunRow> SumUp(const std::vector<RunMutant>& mutants, size_t done) {
  std::vector<RunRow> rows;
  RunRow all;
  all.kind = "all";
  for (size_t i = 0; i < done; ++i) {
    auto row =
        std::find_if(rows.begin(), rows.end(), [&](const RunRow& r) { return r.kind == mutants[i].kind; });
    if (row == rows.end()) {
      row = rows.insert(rows.end(), RunRow{});
      row->kind = mutants[i].kind;
    }
    row->Add(mutants[i]);
    all.Add(mutants[i]);
  }
  rows.push_back(all);
  return rows;
}

const char* OutcomeOf(const RunMutant& mutant) {
  if (mutant.refused) return "refused";
  if (mutant.no_effect) return "no effect";
  return mutant.killed ? "killed" : "survived";
}

/// What the table does not say: faults that were not found, or whose cause or part is another.
void PrintExceptions(const std::vector<RunMutant>& mutants, size_t done) {
  for (size_t i = 0; i < done; ++i) {
    const RunMutant& mutant = mutants[i];
    if (mutant.refused) {
      fmt::print("refused: {}: {}\n", mutant.name, mutant.failure);
    } else if (mutant.no_effect) {
      fmt::print("no effect: {}\n", mutant.name);
    } else if (!mutant.killed) {
      fmt::print("survived: {}{}\n", mutant.name,
                 mutant.is_as_expected
                     ? ""
                     : fmt::format(", though the object is {:.1e} m off", mutant.position_error));
    } else if (!mutant.has_right_cause()) {
      fmt::print("{}\n", Wrap(fmt::format("cause: {}: expected {}, told {} ({})", mutant.name,
                                          NameOf(mutant.expected), NameOf(mutant.cause), mutant.evidence),
                              2));
    } else if (!mutant.names_part) {
      fmt::print(
          "{}\n",
          Wrap(fmt::format("part: {}: expected {}, told {}", mutant.name, mutant.part, mutant.evidence), 2));
    }
  }
}

void Print(const MutateRunRequest& request, const RunCampaign& campaign, size_t done) {
  const std::vector<RunRow> rows = SumUp(campaign.mutants(), done);
  const RunRow& all = rows.back();
  if (!request.quiet) {
    fmt::print("{:<16}{:>9}{:>6}{:>8}{:>10}{:>9}{:>12}{:>10}\n", "what was wrong", "faults", "found",
               "refused", "no effect", "survived", "cause right", "part");
    for (const RunRow& row : rows) {
      fmt::print("{:<16}{:>9}{:>6}{:>8}{:>10}{:>9}{:>12}{:>10}\n", row.kind, row.mutants, row.killed,
                 row.refused, row.no_effect, row.survived, row.cause,
                 row.with_part > 0 ? fmt::format("{} of {}", row.part, row.with_part) : "");
    }
    PrintExceptions(campaign.mutants(), done);
    fmt::print("\n");
  }
  if (done < campaign.mutants().size())
    fmt::print("INTERRUPTED after {} of {} faults. So far:\n", done, campaign.mutants().size());
  const int possible = all.mutants - all.refused - all.no_effect;
  const std::string verdict = fmt::format(
      "{}: {} of {} faults that are possible and have an effect were found; the cause is right in {}, the "
      "part in {} of {}.",
      all.survived == 0 ? "ALL FOUND" : "SURVIVORS", all.killed, possible, all.cause, all.part,
      all.with_part);
  fmt::print("{}\n", Wrap(verdict, 2));
}

std::string ToText(const MutateRunRequest& request, const RunCampaign& campaign, size_t done) {
  Json json = {{"scenario", request.scenario},   {"overrides", request.overrides.List()},
               {"from_s", request.options.from}, {"duration_s", request.options.duration},
               {"scale", request.options.scale}, {"complete", done == campaign.mutants().size()}};
  json["kinds"] = Json::object();
  for (const RunRow& row : SumUp(campaign.mutants(), done)) {
    json["kinds"][row.kind] = {{"faults", row.mutants},    {"found", row.killed},
                               {"refused", row.refused},   {"no_effect", row.no_effect},
                               {"survived", row.survived}, {"cause_right", row.cause},
                               {"part_named", row.part},   {"with_a_part", row.with_part}};
  }
  json["faults"] = Json::array();
  for (size_t i = 0; i < done; ++i) {
    const RunMutant& mutant = campaign.mutants()[i];
    json["faults"].push_back({{"kind", mutant.kind},
                              {"name", mutant.name},
                              {"outcome", OutcomeOf(mutant)},
                              {"expected_cause", NameOf(mutant.expected)},
                              {"cause", NameOf(mutant.cause)},
                              {"expected_part", mutant.part},
                              {"part_named", mutant.names_part},
                              {"evidence", mutant.evidence},
                              {"failure", mutant.failure},
                              {"failed_checks", mutant.failed_checks},
                              {"position_error_max_m", mutant.position_error}});
  }
  return json.dump(2) + "\n";
}

}  // namespace

int MutateRun(const MutateRunRequest& request) {
  const ScenarioFiles files = FindScenario(request.scenario, request.overrides.List(), /*seed=*/0);
  CatchInterrupts();
  std::optional<OutputFile> json;
  if (!request.json_file.empty()) json.emplace(request.json_file);
  RunCampaign campaign(files.scenario, files.robot, files.mjcf, request.options, IsInterrupted);
  const size_t total = campaign.mutants().size();
  ProgressBar bar("changing", static_cast<long>(total), request.quiet || request.json_file == "-");
  const auto make = [&](size_t i) {
    campaign.Run(i, [] { return false; });
    const RunMutant& m = campaign.mutants()[i];
    return PackBytes(m.refused, m.killed, m.no_effect, m.cause, m.names_part, m.position_error,
                     m.is_as_expected, m.evidence, m.failure, m.failed_checks);
  };
  const auto take = [&](size_t i, const std::string& result) {
    RunMutant* const m = campaign.mutant(i);
    UnpackBytes(result, &m->refused, &m->killed, &m->no_effect, &m->cause, &m->names_part, &m->position_error,
                &m->is_as_expected, &m->evidence, &m->failure, &m->failed_checks);
    bar.Update(static_cast<long>(i) + 1);
  };
  const size_t done = RunJobs("a fault", total, CountJobs(request.jobs), make, take, IsInterrupted);
  bar.Finish();
  if (json) json->Write(ToText(request, campaign, done));
  if (request.json_file != "-") Print(request, campaign, done);
  if (done < total) return ReportFailure(fmt::format("interrupted after {} of {} faults", done, total));
  return SumUp(campaign.mutants(), done).back().survived > 0 ? kDisagreement : kSuccess;
}

}  // namespace dexcheck::cli
