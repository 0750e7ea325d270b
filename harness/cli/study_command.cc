#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/cli/commands.h"
#include "harness/cli/output_file.h"
#include "harness/cli/progress_bar.h"
#include "harness/cli/study_files.h"
#include "harness/common/interrupts.h"
#include "harness/study/study_report.h"
#include "harness/study/study_store.h"
#include "harness/study/trial_pool.h"

namespace dexcheck::cli {
namespace {

struct Request {
  std::string study;
  std::string database;
  std::string shard;
  std::uint64_t jobs = 0;
  bool quiet = false;
};

/// The trials of one of N shards; "" is all.
std::vector<Trial> SelectShard(const std::vector<Trial>& trials, const std::string& text) {
  if (text.empty()) return trials;
  long index = 0;
  long count = 0;
  const char* const end = text.data() + text.size();
  const auto [slash, error] = std::from_chars(text.data(), end, index);
  const bool good = error == std::errc() && slash != end && *slash == '/' &&
                    std::from_chars(slash + 1, end, count).ptr == end && 1 <= index && index <= count;
  if (!good) throw InputError("--shard: must be I/N with 1 <= I <= N, got " + Quote(text));
  std::vector<Trial> shard;
  for (const Trial& trial : trials) {
    if (trial.number % count == index - 1) shard.push_back(trial);
  }
  return shard;
}

void PrintOutcomes(const std::vector<TrialRow>& rows) {
  std::map<Outcome, long> counts;
  for (const TrialRow& row : rows) ++counts[row.result.outcome];
  for (const auto& [outcome, count] : counts) fmt::print("  {:<18}{:>7}\n", NameOf(outcome), count);
}

/// Makes the trials that are missing. @return how many of them are done.
long RunMissing(const StudyInputs& inputs, const std::vector<Trial>& trials, const Request& request,
                StudyStore* store) {
  std::vector<bool> done(trials.empty() ? 0 : static_cast<size_t>(trials.back().number) + 1);
  for (const TrialRow& row : store->ReadRows()) {
    if (static_cast<size_t>(row.trial.number) < done.size()) {
      done[static_cast<size_t>(row.trial.number)] = true;
    }
  }
  std::vector<Trial> waiting;
  for (const Trial& trial : trials) {
    if (!done[static_cast<size_t>(trial.number)]) waiting.push_back(trial);
  }
  const long total = static_cast<long>(trials.size());
  long finished = total - static_cast<long>(waiting.size());
  std::reverse(waiting.begin(), waiting.end());
  ProgressBar bar(inputs.study.name, total, request.quiet);
  const auto jobs =
      static_cast<int>(request.jobs > 0 ? request.jobs : std::max(std::thread::hardware_concurrency(), 1U));
  TrialPool pool(jobs, [&](const Trial& trial) { return RunTrial(inputs, trial); });
  const auto release = [&] {
    for (const long trial : pool.ListRunning()) store->Release(trial);
  };
  try {
    while (!IsInterrupted() && (!waiting.empty() || !pool.IsEmpty())) {
      while (!pool.IsFull() && !waiting.empty()) {
        const Trial trial = waiting.back();
        waiting.pop_back();
        if (store->Claim(trial.number)) pool.Start(trial);
      }
      if (const auto row = pool.Wait()) {
        store->Add(*row);
        bar.Update(++finished);
      }
    }
  } catch (const InputError&) {
    throw;  // the database takes no more; nothing can be released in it
  } catch (const Error&) {
    release();
    throw;
  }
  release();
  return finished;
}

int RunStudy(const Request& request) {
  StudyInputs inputs = FindStudy(request.study);
  const std::vector<Trial> trials = SelectShard(ListTrials(inputs.study), request.shard);
  CheckTrials(&inputs);
  StudyStore store = StudyStore::OpenOrCreate(request.database, IdentifyStudy(inputs), inputs.study);
  CatchInterrupts();
  RunMissing(inputs, trials, request, &store);
  const std::vector<TrialRow> rows = store.ReadRows();
  const auto missing = std::count_if(trials.begin(), trials.end(),
                                     [&](const Trial& trial) { return !store.Has(trial.number); });
  if (missing > 0) {
    throw Error(fmt::format("{}: {} of {} trials are missing ({}); the same command goes on with them",
                            request.database, missing, trials.size(),
                            IsInterrupted() ? "interrupted" : "another process has them"));
  }
  if (!request.quiet) {
    fmt::print("{}: {} of {} trials in {}\n", inputs.study.name, rows.size(), ListTrials(inputs.study).size(),
               request.database);
    PrintOutcomes(rows);
  }
  return kSuccess;
}

int MergeStudies(const std::string& out, const std::vector<std::string>& databases, bool quiet) {
  // All are looked at before anything is written.
  std::vector<std::vector<TrialRow>> rows;
  const StudyStore first = StudyStore::Open(databases.front());
  for (const std::string& database : databases) {
    const StudyStore store = StudyStore::Open(database);
    store.RequireSame(first.identity());
    rows.push_back(store.ReadRows());
  }
  StudyStore merged = StudyStore::OpenOrCreate(out, first.identity(), first.study());
  for (size_t i = 0; i < databases.size(); ++i) merged.AddAll(rows[i], databases[i]);
  const std::vector<TrialRow> all = merged.ReadRows();
  if (!quiet) {
    fmt::print("{}: {} of {} trials in {}\n", first.study().name, all.size(),
               ListTrials(first.study()).size(), out);
    PrintOutcomes(all);
  }
  return kSuccess;
}

}  // namespace

void AddStudyCommand(Command app) {
  Command study = app.AddCommand("study", "Vary a scenario's gains, models or plant over many runs");
  study.RequireCommand();
  const auto request = std::make_shared<Request>();
  const auto databases = std::make_shared<std::vector<std::string>>();
  const auto whole = WholeNumber(1, 1000000);
  const auto add_quiet = [&](Command command) {
    command.AddFlag("--quiet", &request->quiet, "Print nothing but errors");
  };

  Command run = study.AddCommand("run", "Make the trials that are missing in the database");
  run.AddOption("STUDY", &request->study, "Name of a shipped study, or a TOML file").Required();
  run.AddOption("--db", &request->database, "The study's database (SQLite), made when there is none")
      .TypeName("FILE.sqlite")
      .Required();
  run.AddOption("--jobs", &request->jobs, "Trials at a time (all processors by default)")
      .TypeName("N")
      .Check(whole);
  run.AddOption("--shard", &request->shard, "Only the I-th of N parts of the study").TypeName("I/N");
  add_quiet(run);
  run.SetAction([=] { return RunStudy(*request); });

  Command merge = study.AddCommand("merge", "Put the databases of one study together");
  merge.AddOption("OUT", &request->database, "Database that gets all trials").Required();
  merge.AddOption("DB", databases.get(), "Databases of the same study").Required();
  add_quiet(merge);
  merge.SetAction([=] { return MergeStudies(request->database, *databases, request->quiet); });

  Command report = study.AddCommand("report", "Write an HTML page of a study's results");
  report.AddOption("DB", &request->database, "The study's database").Required();
  const auto page = std::make_shared<std::string>();
  report.AddOption("--out", page.get(), "The page (DB.html by default); - for standard output")
      .TypeName("FILE.html");
  report.SetAction([=] {
    RequirePageName(*page);
    const StudyStore store = StudyStore::Open(request->database);
    OutputFile out(page->empty() ? request->database + ".html" : *page);
    out.Write(MakeStudyReport(store));
    return kSuccess;
  });

  Command slurm = study.AddCommand("slurm", "Print an array job for Slurm that makes the study");
  slurm.AddOption("STUDY", &request->study, "Name of a shipped study, or a TOML file").Required();
  slurm.AddOption("--tasks", &request->jobs, "Parts of the study, each a task")
      .TypeName("N")
      .Required()
      .Check(whole);
  slurm.SetAction([=] {
    fmt::print("{}", MakeSlurmScript(FindStudy(request->study), request->study, request->jobs));
    return kSuccess;
  });
}

}  // namespace dexcheck::cli
