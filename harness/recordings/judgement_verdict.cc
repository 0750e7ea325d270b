#include "harness/recordings/judgement_verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <vector>

#include "controller/common/text.h"

namespace dexcheck {

JudgementVerdict MakeVerdict(const RecordingJudgement& judgement, const RobotModel& robot,
                             const std::string& recording) {
  const std::string& model = robot.name();
  const auto name_of = [&](int joint) { return robot.joint(joint).name; };
  std::string not_judged;
  std::map<std::string, std::vector<std::string>> by_reason;
  for (const UnjudgedJoint& one : judgement.unjudged) by_reason[one.reason].push_back(name_of(one.joint));
  for (const auto& [reason, joints] : by_reason)
    not_judged +=
        fmt::format("{}{} ({})", not_judged.empty() ? "; not judged: " : ", ", JoinNames(joints), reason);
  const bool are_velocities_alone = std::ranges::all_of(judgement.causes, [](const Explanation& one) {
    return one.channel == CauseChannel::kMeasurement &&
           one.faults.front().fault.find("velocit") != std::string::npos;
  });
  const size_t count = judgement.CountExplaining();
  const std::string causes_do = fmt::format("{} cause{}", count, count == 1 ? " does" : "s do");
  JudgementVerdict verdict;
  if (judgement.Agrees()) {
    verdict = {"explained", fmt::format("{} explains {}: what is left is noise", model, recording)};
  } else if (judgement.causes.empty() && judgement.IsWhole()) {
    std::vector<std::string> judged;
    for (const JointJudgement& one : judgement.balances)
      if (one.recording == 0) judged.push_back(name_of(one.joint));
    verdict = {"partly explained", fmt::format("{} explains {} at {}: what is left is noise", model,
                                               recording, JoinNames(judged))};
  } else if (are_velocities_alone && judgement.IsWhole()) {
    verdict = {"differs", fmt::format("{} explains the torques of {}; its velocities are not the positions' "
                                      "derivatives and are not used",
                                      model, recording)};
  } else if (count == 0) {
    verdict = {"not explained",
               fmt::format("{} does not explain {}, and no cause that is known does", model, recording)};
  } else {
    verdict = {"differs",
               fmt::format("{} does not explain {}; {}{}", model, recording, causes_do,
                           judgement.IsWhole() ? ""
                                               : fmt::format(" by {:.3g} %, and more than noise is left",
                                                             100.0 * judgement.explained))};
  }
  verdict.sentence += not_judged + ".";
  return verdict;
}

}  // namespace dexcheck
