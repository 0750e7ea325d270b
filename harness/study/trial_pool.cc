#include "harness/study/trial_pool.h"

#include <limits>
#include <utility>

#include "controller/common/text.h"
#include "harness/base/byte_archive.h"

namespace dexcheck {

TrialPool::TrialPool(int size, double time_limit, const std::function<TrialResult(const Trial&)>& run)
    : time_limit_(time_limit), pool_("a trial", size, time_limit, [run](const std::string& request) {
        Trial trial;
        UnpackBytes(request, &trial.number, &trial.seed, &trial.parameters);
        const TrialResult result = run(trial);
        return PackBytes(result.outcome, result.metrics, result.failure);
      }) {}

void TrialPool::Start(const Trial& trial) {
  pool_.Start(trial.number, PackBytes(trial.number, trial.seed, trial.parameters));
  running_[trial.number] = trial;
}

std::optional<EndedTrial> TrialPool::Wait() {
  const std::optional<EndedJob> job = pool_.Wait();
  if (!job) return std::nullopt;
  EndedTrial ended;
  ended.killed_from_outside = job->killed_from_outside;
  ended.row.trial = std::move(running_.extract(job->number).mapped());
  TrialResult& result = ended.row.result;
  if (job->result) {
    UnpackBytes(*job->result, &result.outcome, &result.metrics, &result.failure);
    return ended;
  }
  result.outcome = job->timed_out ? Outcome::kTimedOut : Outcome::kCrashed;
  result.metrics.fill(std::numeric_limits<double>::quiet_NaN());
  result.failure = job->timed_out ? "it took more than trial_time_limit, " + FormatNumber(time_limit_) +
                                        " s of processor time"
                                  : job->failure;
  return ended;
}

}  // namespace dexcheck
