#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/parameter_reader.h"
#include "harness/base/byte_archive.h"
#include "harness/base/interrupts.h"
#include "harness/base/process_pool.h"
#include "harness/cli/commands.h"
#include "harness/cli/json_matrix.h"
#include "harness/cli/mutate_run.h"
#include "harness/cli/output_file.h"
#include "harness/cli/progress_bar.h"
#include "harness/diagnosis/formula_mutants.h"
#include "harness/engine/engine.h"

namespace dexcheck::cli {
namespace {

struct MutateRequest {
  MutateRunRequest run;  // with a scenario, faults are made in its run
  RobotFiles files;
  MutationOptions options;
  bool no_diagnosis = false;
  std::string json_file;
  bool quiet = false;
};

struct Campaign {
  std::vector<Mutant> mutants;
  std::vector<FormulaMutant> formulas;
  size_t done = 0;
  size_t formulas_done = 0;

  [[nodiscard]] bool IsComplete() const { return done == mutants.size() && formulas_done == formulas.size(); }
};

/// A line of the table.
struct MutationRow {
  std::string kind;
  int mutants = 0;
  int killed = 0;
  int refused = 0;
  int no_effect = 0;
  int survived = 0;
  int named_first = 0;

  void Add(MutantOutcome outcome, bool named) {
    ++mutants;
    killed += outcome == MutantOutcome::kKilled ? 1 : 0;
    refused += outcome == MutantOutcome::kRefused ? 1 : 0;
    no_effect += outcome == MutantOutcome::kNoEffect ? 1 : 0;
    survived += outcome == MutantOutcome::kSurvived ? 1 : 0;
    named_first += named ? 1 : 0;
  }
};

const char* NameOf(MutantOutcome outcome) {
  switch (outcome) {
    case MutantOutcome::kKilled:
      return "killed";
    case MutantOutcome::kRefused:
      return "refused";
    case MutantOutcome::kNoEffect:
      return "no effect";
    case MutantOutcome::kSurvived:
      break;
  }
  return "survived";
}

std::vector<MutationRow> SumUp(const Campaign& campaign) {
  std::vector<MutationRow> rows;
  const auto add = [&](const std::string& kind, MutantOutcome outcome, bool named) {
    auto row = std::find_if(rows.begin(), rows.end(), [&](const MutationRow& r) { return r.kind == kind; });
    if (row == rows.end()) {
      row = rows.insert(rows.end(), MutationRow{});
      row->kind = kind;
    }
    row->Add(outcome, named);
  };
  for (size_t i = 0; i < campaign.done; ++i)
    add(campaign.mutants[i].kind, campaign.mutants[i].outcome, campaign.mutants[i].named_first);
  for (size_t i = 0; i < campaign.formulas_done; ++i)
    add("wrong equation", campaign.formulas[i].outcome, campaign.formulas[i].localised);
  return rows;
}

MutationRow Total(const std::vector<MutationRow>& rows) {
  MutationRow total;
  total.kind = "all";
  for (const MutationRow& row : rows) {
    total.mutants += row.mutants;
    total.killed += row.killed;
    total.refused += row.refused;
    total.no_effect += row.no_effect;
    total.survived += row.survived;
    total.named_first += row.named_first;
  }
  return total;
}

void Print(const MutateRequest& request, const Campaign& campaign) {
  const auto line = [](const MutationRow& row) {
    fmt::print("{:<32}{:>8}{:>7}{:>8}{:>10}{:>9}{:>6}\n", row.kind, row.mutants, row.killed, row.refused,
               row.no_effect, row.survived, row.named_first);
  };
  const std::vector<MutationRow> rows = SumUp(campaign);
  const MutationRow total = Total(rows);
  if (!request.quiet) {
    fmt::print("{:<32}{:>8}{:>7}{:>8}{:>10}{:>9}{:>6}\n", "what was changed", "mutants", "killed", "refused",
               "no effect", "survived", "first");
    for (const MutationRow& row : rows) line(row);
    line(total);
    for (size_t i = 0; i < campaign.done; ++i) {
      const Mutant& mutant = campaign.mutants[i];
      if (mutant.outcome == MutantOutcome::kSurvived || mutant.outcome == MutantOutcome::kNoEffect)
        fmt::print("{}: {}\n", NameOf(mutant.outcome), mutant.name);
      if (request.options.diagnose && mutant.outcome == MutantOutcome::kKilled && !mutant.named_first)
        fmt::print("not named first: {} ({}); named: {}{}\n", mutant.name, mutant.kind,
                   mutant.named.empty() ? "nothing" : mutant.named,
                   mutant.named_equal ? ", which is listed as equal" : "");
    }
    for (size_t i = 0; i < campaign.formulas_done; ++i) {
      const FormulaMutant& mutant = campaign.formulas[i];
      if (mutant.outcome != MutantOutcome::kKilled)
        fmt::print("{}: {}\n", NameOf(mutant.outcome), mutant.name);
      else if (!mutant.localised)
        fmt::print("not named: {}: expected {}, failed {}\n", mutant.name, mutant.first,
                   mutant.failed_checks);
    }
    fmt::print("\n");
  }
  if (!campaign.IsComplete()) {
    fmt::print("INTERRUPTED after {} of {} mutants. So far:\n", campaign.done + campaign.formulas_done,
               campaign.mutants.size() + campaign.formulas.size());
  }
  const int effective = total.mutants - total.refused - total.no_effect;
  fmt::print("{}: {} of {} mutants that are possible and have an effect were found",
             total.survived == 0 ? "ALL KILLED" : "SURVIVORS", total.killed, effective);
  if (request.options.diagnose) fmt::print("; {} named first", total.named_first);
  fmt::print(".\n");
}

std::string ToText(const MutateRequest& request, const Campaign& campaign) {
  Json json = {{"robot", request.files.robot.string()}, {"mjcf", request.files.mjcf.string()},
               {"mujoco", mj_versionString()},          {"scale", request.options.scale},
               {"samples", request.options.samples},    {"seed", request.options.seed},
               {"complete", campaign.IsComplete()}};
  json["kinds"] = Json::object();
  for (const MutationRow& row : SumUp(campaign)) {
    json["kinds"][row.kind] = {{"mutants", row.mutants},   {"killed", row.killed},
                               {"refused", row.refused},   {"no_effect", row.no_effect},
                               {"survived", row.survived}, {"named_first", row.named_first}};
  }
  json["mutants"] = Json::array();
  for (size_t i = 0; i < campaign.done; ++i) {
    const Mutant& mutant = campaign.mutants[i];
    json["mutants"].push_back({{"name", mutant.name},
                               {"kind", mutant.kind},
                               {"outcome", NameOf(mutant.outcome)},
                               {"failed_checks", mutant.failed_checks},
                               {"named", mutant.named},
                               {"named_first", mutant.named_first},
                               {"named_equal", mutant.named_equal},
                               {"explained", mutant.explained}});
  }
  for (size_t i = 0; i < campaign.formulas_done; ++i) {
    const FormulaMutant& mutant = campaign.formulas[i];
    json["mutants"].push_back({{"name", mutant.name},
                               {"kind", "wrong equation"},
                               {"outcome", NameOf(mutant.outcome)},
                               {"failed_checks", mutant.failed_checks},
                               {"named_first", mutant.localised}});
  }
  return json.dump(2) + "\n";
}

/// Empty for a number that a mutant can be changed by; what is wrong otherwise.
std::string CheckScale(const std::string& text) {
  constexpr double kSmallest = 1e-9;
  constexpr double kLargest = 0.5;
  double scale = 0.0;
  const char* const end = text.data() + text.size();
  const std::from_chars_result result = std::from_chars(text.data(), end, scale);
  if (result.ec == std::errc() && result.ptr == end && kSmallest <= scale && scale <= kLargest) return {};
  return fmt::format("must be a number from {} to {}, got {}", kSmallest, kLargest, Quote(text));
}

/// Empty for a time that can be taken.
ValueCheck Seconds(double least, double most) {
  return [=](const std::string& text) -> std::string {
    double value = 0.0;
    const char* const end = text.data() + text.size();
    const std::from_chars_result result = std::from_chars(text.data(), end, value);
    if (result.ec == std::errc() && result.ptr == end && least <= value && value <= most) return {};
    return fmt::format("must be a number of seconds from {} to {}, got {}", least, most, Quote(text));
  };
}

int Run(MutateRequest request) {
  if (!request.run.scenario.empty()) {
    request.run.options.scale = request.options.scale;
    request.run.json_file = request.json_file;
    request.run.quiet = request.quiet;
    return request.run.smallest ? PrintSmallestErrors(request.run) : MutateRun(request.run);
  }
  request.options.diagnose = !request.no_diagnosis;
  const RobotModel model = ReadRobotModel(request.files.robot);
  RequireNoBalls(model, "when each number is changed on purpose");
  const MjModelPtr engine = LoadMjcf(request.files.mjcf);
  const std::string source = request.files.mjcf.string();
  const Adapter adapter(model, *engine, source);
  CatchInterrupts();
  std::optional<OutputFile> json;
  if (!request.json_file.empty()) json.emplace(request.json_file);
  ConsistencyOptions unchanged;
  unchanged.samples = request.options.samples;
  unchanged.seed = request.options.seed;
  if (!CheckConsistency(adapter, unchanged, [](long) { return true; }).Agrees()) {
    throw InputError(request.files.robot.string() + ": must agree with " + source +
                     " before it is changed on purpose (see dexcheck diagnose), got a disagreement");
  }

  Campaign campaign;
  campaign.mutants = ListMutants(model.spec(), request.options.scale);
  campaign.formulas = ListFormulaMutants(model);
  const auto total = static_cast<long>(campaign.mutants.size() + campaign.formulas.size());
  ProgressBar bar("changing", total, request.quiet);
  const auto make = [&](size_t i) {
    if (i < campaign.formulas.size()) {
      FormulaMutant& f = campaign.formulas[i];
      RunFormulaMutant(adapter, request.options.samples, &f);
      return PackBytes(f.outcome, f.failed_checks, f.localised);
    }
    Mutant& m = campaign.mutants[i - campaign.formulas.size()];
    TryMutant(model, *engine, source, request.options, &m);
    return PackBytes(m.outcome, m.failed_checks, m.named, m.named_first, m.named_equal, m.causes,
                     m.explained);
  };
  const auto take = [&](size_t i, const std::string& result) {
    if (i < campaign.formulas.size()) {
      FormulaMutant& f = campaign.formulas[campaign.formulas_done++];
      UnpackBytes(result, &f.outcome, &f.failed_checks, &f.localised);
    } else {
      Mutant& m = campaign.mutants[campaign.done++];
      UnpackBytes(result, &m.outcome, &m.failed_checks, &m.named, &m.named_first, &m.named_equal, &m.causes,
                  &m.explained);
    }
    bar.Update(static_cast<long>(i) + 1);
  };
  RunJobs("a mutant", static_cast<size_t>(total), CountJobs(request.run.jobs), make, take, IsInterrupted);
  bar.Finish();
  if (json) json->Write(ToText(request, campaign));
  if (request.json_file != "-") Print(request, campaign);
  if (Total(SumUp(campaign)).survived > 0) return kDisagreement;
  return campaign.IsComplete() ? kSuccess : ReportFailure("interrupted");
}

}  // namespace

void AddMutateCommand(Command app) {
  const auto request = std::make_shared<MutateRequest>();
  Command command = app.AddCommand(
      "mutate",
      "Change every number and equation of the model on purpose: which faults are found and named?");
  Option robot = AddRobotOptions(command, &request->files);
  Option scale = command.AddOption("--scale", &request->options.scale, "Change of a number, relative to it")
                     .TypeName("X")
                     .Check(CheckScale)
                     .ShowDefault();
  Option run =
      command
          .AddOption("--run", &request->run.scenario,
                     "Make faults in a run of this scenario instead: numbers, equations, laws, plants")
          .TypeName("SCENARIO");
  for (Option option : AddOverrideOptions(command, &request->run.overrides)) option.Needs(run);
  Option from =
      command
          .AddOption("--from", &request->run.options.from,
                     "In a run: when the fault begins, s; in a motion of joints it is there from the first")
          .TypeName("T")
          .Check(Seconds(0.0, 1e4))
          .Needs(run)
          .ShowDefault();
  Option duration =
      command.AddOption("--duration", &request->run.options.duration, "In a run: how long it is looked at, s")
          .TypeName("T")
          .Check(Seconds(1e-3, 1e4))
          .Needs(run)
          .ShowDefault();
  Option faults = command
                      .AddOption("--numbers", &request->run.options.parameters,
                                 "In a run: how many numbers of the model are changed, evenly out of all")
                      .TypeName("N")
                      .Check(WholeNumber(0, 100000))
                      .Needs(run)
                      .ShowDefault();
  const auto states = AddSampleOptions(command, 1000, &request->options.samples, &request->options.seed);
  Option no_diagnosis = command.AddFlag("--no-diagnosis", &request->no_diagnosis,
                                        "Only whether each is found, not what is named");
  robot.Excludes(run);
  Option smallest = command.AddFlag(
      "--smallest", &request->run.smallest,
      "In a run: how small an error of each number balance, prediction and law find, and how well it moves "
      "everything");
  smallest.Needs(run);
  for (Option option : {from, duration, faults, scale}) option.Excludes(smallest);
  for (Option option : states) option.Excludes(run);
  no_diagnosis.Excludes(run);
  AddJobsOption(command, "Faults", &request->run.jobs).Excludes(smallest);
  AddJsonOption(command, "the results", &request->json_file);
  command.AddFlag("--quiet", &request->quiet, "Print the verdict only");
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
