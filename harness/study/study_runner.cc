#include "harness/study/study_runner.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <thread>

#include "controller/common/errors.h"
#include "harness/engine/machine.h"
#include "harness/study/search_history.h"
#include "harness/study/trial_pool.h"

namespace dexcheck {
namespace {

/// So often a trial is begun whose process is killed from outside every time.
constexpr int kMostTries = 3;

/// A pool that stores what its trials come to.
class TrialMaker {
 public:
  TrialMaker(const StudyInputs& inputs, const RunOptions& options, StudyStore* store)
      : options_(options),
        store_(store),
        machine_(DescribeMachine()),
        pool_(options.jobs, inputs.study.trial_time_limit,
              [&](const Trial& trial) { return RunTrial(inputs, trial); }) {}

  /// Makes those of the trials that nobody else has. @param done is called with each row.
  void Run(const std::vector<Trial>& trials, const std::function<void(const TrialRow&)>& done) {
    std::deque<Trial> waiting(trials.begin(), trials.end());
    try {
      while (!options_.is_interrupted() && (!waiting.empty() || !pool_.IsEmpty())) {
        while (!pool_.IsFull() && !waiting.empty()) {
          const Trial trial = waiting.front();
          waiting.pop_front();
          if (store_->Claim(trial.number)) pool_.Start(trial);
        }
        auto ended = pool_.Wait();
        if (!ended) continue;
        if (ended->killed_from_outside && !Bury(&*ended, &waiting)) continue;
        ended->row.machine = machine_;
        store_->Add(ended->row);
        done(ended->row);
      }
    } catch (const InputError&) {
      throw;  // the database takes no more; nothing can be released in it
    } catch (const Error&) {
      Release();
      throw;
    }
    Release();
  }

 private:
  /// Whether a trial whose process was killed from outside is given up. With all others when it is this
  /// program that is ended; else it is tried once more, when others are done.
  bool Bury(EndedTrial* ended, std::deque<Trial>* waiting) {
    const Trial& trial = ended->row.trial;
    const bool again = ++tries_[trial.number] < kMostTries;
    if (again || options_.is_interrupted()) store_->Release(trial.number);
    if (again) waiting->push_back(trial);
    if (again || options_.is_interrupted()) return false;
    ended->row.result.failure += ", " + std::to_string(kMostTries) + " times";
    return true;
  }

  void Release() {
    for (const long trial : pool_.ListRunning()) store_->Release(trial);
  }

  const RunOptions& options_;
  StudyStore* store_;
  std::string machine_;
  std::map<long, int> tries_;
  TrialPool pool_;
};

}  // namespace

void RunTrials(const StudyInputs& inputs, const std::vector<Trial>& trials, const RunOptions& options,
               StudyStore* store) {
  const std::vector<long> done = store->ListNumbers();
  std::vector<Trial> missing;
  for (const Trial& trial : trials) {
    if (!std::binary_search(done.begin(), done.end(), trial.number)) missing.push_back(trial);
  }
  if (missing.empty()) return;
  auto finished = static_cast<long>(trials.size() - missing.size());
  TrialMaker maker(inputs, options, store);
  maker.Run(missing, [&](const TrialRow&) { options.tell(++finished); });
}

bool MakesRowsAgain(const StudyInputs& inputs, const std::vector<TrialRow>& rows) {
  std::vector<const TrialRow*> good;
  for (const TrialRow& row : rows) {
    if (!IsFailed(row.result.outcome)) good.push_back(&row);
  }
  if (good.empty()) return true;
  const std::set<const TrialRow*> chosen = {good.front(), good[good.size() / 2], good.back()};
  for (const TrialRow* row : chosen) {
    // In a process of its own, as when it was made.
    TrialPool pool(1, inputs.study.trial_time_limit,
                   [&](const Trial& trial) { return RunTrial(inputs, trial); });
    pool.Start(row->trial);
    std::optional<EndedTrial> ended;
    while (!ended) ended = pool.Wait();
    ended->row.machine = DescribeMachine();
    if (!IsSame(*row, ended->row)) return false;
  }
  return true;
}

void RunSearch(const StudyInputs& inputs, const RunOptions& options, StudyStore* store) {
  constexpr auto kPatience = std::chrono::milliseconds(100);  // with other processes
  SearchHistory history(inputs.study, FindSearchStart(inputs));
  const auto read = [&] {
    for (const TrialRow& row : store->ReadRows(history.first_of_batch())) history.Add(row);
  };
  read();
  TrialMaker maker(inputs, options, store);
  while (!history.is_over() && !options.is_interrupted()) {
    const std::vector<Trial> missing = history.ListMissing();
    long made = 0;
    const long before = history.first_of_batch();
    maker.Run(missing, [&](const TrialRow& row) {
      history.Add(row);
      options.tell(before + ++made);
    });
    read();
    if (made == 0 && !history.is_over()) std::this_thread::sleep_for(kPatience);
  }
}

}  // namespace dexcheck
