#include "harness/study/study_runner.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <iterator>
#include <limits>
#include <thread>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/engine/machine.h"
#include "harness/study/search.h"

namespace dexcheck {

namespace {

/// So often a trial is begun whose process is killed from outside every time.
constexpr int kMostTries = 3;

std::string Pack(const TrialResult& result) {
  return PackBytes(result.outcome, result.metrics, result.failure);
}

/// A pool that stores what its trials come to. Claims and rows go into the database together, as many as fall
/// into kTogether: a transaction waits for the disk, which costs more than a short trial.
class TrialMaker {
 public:
  TrialMaker(const StudyInputs& inputs, const RunOptions& options, StudyStore* store)
      : options_(options),
        store_(store),
        machine_(DescribeMachine()),
        time_limit_(inputs.study.trial_time_limit),
        pool_("a trial", options.jobs, time_limit_, [&](const std::string& request) {
          Trial trial;
          UnpackBytes(request, &trial.number, &trial.seed, &trial.parameters);
          return Pack(RunTrial(inputs, trial));
        }) {}

  /// Makes those of the trials that nobody else has. @param done is called with each row.
  void Run(const std::vector<Trial>& trials, const std::function<void(const TrialRow&)>& done) {
    waiting_.assign(trials.begin(), trials.end());
    try {
      while (!options_.is_interrupted() && (!waiting_.empty() || !claimed_.empty() || !pool_.IsEmpty())) {
        ClaimSome();
        while (!pool_.IsFull() && !claimed_.empty()) {
          const Trial& next = claimed_.front();
          pool_.Start(next.number, PackBytes(next.number, next.seed, next.parameters));
          running_[next.number] = next;
          claimed_.pop_front();
        }
        if (const auto ended = pool_.Wait()) Take(*ended);
        if (Clock::now() - stored_ > kTogether) Store(done);
      }
      Store(done);
    } catch (const InputError&) {
      throw;  // the database takes no more; nothing can be released in it
    } catch (const Error&) {
      Release();
      throw;
    }
    Release();
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kTogether{200};

  /// Number of trials that end in kTogether, by what is known of it, and one for each job.
  void ClaimSome() {
    if (pool_.IsFull() || !claimed_.empty() || waiting_.empty()) return;
    std::map<long, Trial> some;
    const size_t most = std::max(recent_, rows_.size()) + static_cast<size_t>(options_.jobs);
    while (!waiting_.empty() && some.size() < most) {
      some.emplace(waiting_.front().number, waiting_.front());
      waiting_.pop_front();
    }
    std::vector<long> numbers;
    for (const auto& [number, trial] : some) numbers.push_back(number);
    for (const long number : store_->Claim(numbers)) claimed_.push_back(some.at(number));
  }

  void Take(const EndedJob& ended) {
    TrialRow row{std::move(running_.extract(ended.number).mapped()), {}, machine_};
    TrialResult& result = row.result;
    if (ended.result) {
      UnpackBytes(*ended.result, &result.outcome, &result.metrics, &result.failure);
    } else {
      result.outcome = ended.timed_out ? Outcome::kTimedOut : Outcome::kCrashed;
      result.metrics.fill(std::numeric_limits<double>::quiet_NaN());
      result.failure = ended.timed_out ? "it took more than trial_time_limit, " + FormatNumber(time_limit_) +
                                             " s of processor time"
                                       : ended.failure;
    }
    if (!ended.killed_from_outside || GiveUp(&row)) rows_.push_back(std::move(row));
  }

  void Store(const std::function<void(const TrialRow&)>& done) {
    stored_ = Clock::now();
    if (rows_.empty()) return;
    store_->Add(rows_);
    for (const TrialRow& row : rows_) done(row);
    recent_ = rows_.size();
    rows_.clear();
  }

  /// Whether a trial whose process was killed from outside is given up. With all others when it is this
  /// program that is ended; else it is tried once more, when others are done.
  bool GiveUp(TrialRow* row) {
    const Trial& trial = row->trial;
    const bool again = ++tries_[trial.number] < kMostTries;
    if (again || options_.is_interrupted()) store_->Release({trial.number});
    if (again) waiting_.push_back(trial);
    if (again || options_.is_interrupted()) return false;
    row->result.failure += ", " + std::to_string(kMostTries) + " times";
    return true;
  }

  void Release() {
    std::vector<long> trials = pool_.ListRunning();
    for (const Trial& trial : claimed_) trials.push_back(trial.number);
    store_->Release(trials);
    claimed_.clear();
  }

  const RunOptions& options_;
  StudyStore* store_;
  std::string machine_;
  double time_limit_;  // s
  std::map<long, int> tries_;
  std::map<long, Trial> running_;
  std::deque<Trial> waiting_, claimed_;
  std::vector<TrialRow> rows_;  // not stored yet
  size_t recent_ = 0;           // rows that were stored last
  Clock::time_point stored_ = Clock::now();
  ProcessPool pool_;
};

}  // namespace

std::vector<Trial> ListMissing(const std::vector<Trial>& trials, const StudyStore& store) {
  std::vector<Trial> missing = trials;
  std::erase_if(missing, [done = store.ListNumbers()](const Trial& trial) {
    return std::ranges::binary_search(done, trial.number);
  });
  return missing;
}

void RunTrials(const StudyInputs& inputs, const std::vector<Trial>& trials, const RunOptions& options,
               StudyStore* store) {
  const std::vector<Trial> missing = ListMissing(trials, *store);
  if (missing.empty()) return;
  auto finished = static_cast<long>(trials.size() - missing.size());
  TrialMaker maker(inputs, options, store);
  maker.Run(missing, [&](const TrialRow&) { options.report(++finished); });
}

bool MakesRowsAgain(const StudyInputs& inputs, const std::vector<TrialRow>& rows) {
  std::vector<const TrialRow*> good;
  for (const TrialRow& row : rows) {
    if (!IsFailed(row.result.outcome)) good.push_back(&row);
  }
  if (good.empty()) return true;
  const TrialRow* const chosen[] = {good.front(), good[good.size() / 2], good.back()};
  bool are_same = true;
  const auto run = [&](size_t i) { return Pack(RunTrial(inputs, chosen[i]->trial)); };
  const auto take = [&](size_t i, const std::string& bytes) {
    TrialRow again{chosen[i]->trial, {}, DescribeMachine()};
    UnpackBytes(bytes, &again.result.outcome, &again.result.metrics, &again.result.failure);
    are_same = IsSame(*chosen[i], again);
  };
  RunJobs("a trial", std::min(good.size(), std::size(chosen)), 1, run, take, [&] { return !are_same; });
  return are_same;
}

void RunSearch(const StudyInputs& inputs, const RunOptions& options, StudyStore* store) {
  constexpr auto kPatience = std::chrono::milliseconds(100);  // with other processes
  SearchHistory history(inputs.study);
  const auto read = [&] {
    for (const TrialRow& row : store->ReadRows(history.first_of_batch())) history.Add(row);
  };
  read();
  TrialMaker maker(inputs, options, store);
  while (!history.is_over() && !options.is_interrupted()) {
    const std::vector<Trial> missing = history.ListMissing();
    long made = 0;
    maker.Run(missing, [&](const TrialRow& row) {
      history.Add(row);
      ++made;
      options.report(history.CountDone());
    });
    read();
    if (made == 0 && !history.is_over()) std::this_thread::sleep_for(kPatience);
  }
}

}  // namespace dexcheck
