// Faults that are drawn, in recordings: how many are named.
//
// DEXCHECK_RECORDINGS=100 draws so many faults and prints what they were named.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <random>

#include "tests/harness/recordings/judge_panda.h"

namespace dexcheck::testing::judge_campaign_test {
namespace {

enum class Score { kNamed, kClass, kMissed, kWrong };

/// Named: the first cause, alone or with others that are right; a class that has it; wrong: another name.
Score ScoreOf(const RecordingJudgement& judgement, const std::vector<RecordedFault>& faults) {
  bool all_named = true, all_found = true, has_wrong = false;
  for (const RecordedFault& fault : faults) {
    bool is_named = false, is_found = false;
    for (const Explanation& one : judgement.causes)
      for (const Fault& candidate : one.faults) {
        if (candidate.fault != fault.fault || candidate.place != fault.place) continue;
        is_found = true;
        const double off = std::abs(candidate.value - fault.value);
        is_named |=
            one.outcome == CauseOutcome::kNamed &&
            (std::isnan(fault.value) || off <= std::max(0.05 * std::abs(fault.value), 3.0 * candidate.error));
      }
    all_named &= is_named;
    all_found &= is_found;
  }
  for (const Explanation& one : judgement.causes) {
    bool is_right = one.outcome != CauseOutcome::kNamed;
    for (const RecordedFault& fault : faults)
      is_right |= one.faults.front().fault == fault.fault && one.faults.front().place == fault.place;
    has_wrong |= !is_right;
  }
  if (has_wrong) return Score::kWrong;
  return all_named ? Score::kNamed : all_found ? Score::kClass : Score::kMissed;
}

TEST(JudgeCampaign, NamesDrawnFaults) {
  const char* asked = std::getenv("DEXCHECK_RECORDINGS");
  const int draws = asked == nullptr ? 2 * CountRecordedFaultKinds() : std::atoi(asked);
  const char* several = std::getenv("DEXCHECK_TOGETHER");
  const int together = several == nullptr ? 1 : std::atoi(several);
  std::mt19937 random(7);
  int counts[4] = {};
  for (int i = 0; i < draws; ++i) {
    std::vector<RecordedFault> faults = {DrawRecordedFault(kMjcf, i % CountRecordedFaultKinds(), &random)};
    while (static_cast<int>(faults.size()) < together) {
      const int kind = std::uniform_int_distribution<>(0, CountRecordedFaultKinds() - 1)(random);
      RecordedFault other = DrawRecordedFault(kMjcf, kind, &random);
      // One that is there already would be told as one.
      if (other.fault != faults[0].fault || other.place != faults[0].place)
        faults.push_back(std::move(other));
    }
    RecordingOptions options;
    options.has_velocities = std::bernoulli_distribution()(random);
    const RecordingJudgement judgement = Judge(RecordRobot(kMjcf, faults, options, &random));
    const Score score = ScoreOf(judgement, faults);
    for (const Explanation& one : judgement.causes)
      EXPECT_NE(one.rival, one.faults.front().place + ": " + one.faults.front().fault);
    ++counts[static_cast<int>(score)];
    constexpr const char* kNames[] = {"named", "class", "missed", "WRONG"};
    if (score != Score::kNamed || asked != nullptr) {
      std::cout << i << " " << kNames[static_cast<int>(score)] << ":";
      for (const RecordedFault& fault : faults)
        std::cout << " " << fault.place << ": " << fault.fault << " " << fault.value << ";";
      std::cout << Tell(judgement) << "\n";
    }
  }
  std::cout << "named " << counts[0] << " class " << counts[1] << " missed " << counts[2] << " wrong "
            << counts[3] << "\n";
  EXPECT_GE(counts[0] + counts[1], 9 * draws / 10);
  EXPECT_LE(counts[3], draws / 50);
}

}  // namespace
}  // namespace dexcheck::testing::judge_campaign_test
