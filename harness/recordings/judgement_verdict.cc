#include "harness/recordings/judgement_verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <vector>

#include "controller/common/text.h"

namespace dexcheck {

namespace {

/// Returns " of 0.1 N m at elbow, where an error below 0.2 N m (3 % of its torque) would not show", for the
/// joint where that is the largest part.
std::string DescribeNoise(const RecordingJudgement& judgement, const RobotModel& robot) {
  static constexpr double kNone = 1e-300;  // N m or N, of a joint that the model gives no torque
  const auto part_of = [](const JointJudgement& one) { return one.hidden / std::max(one.modelled, kNone); };
  const JointJudgement& worst = *std::ranges::max_element(judgement.balances, {}, part_of);
  const Joint& joint = robot.joint(worst.joint);
  const std::string share = worst.hidden < worst.modelled
                                ? fmt::format("{:.2g} % of its torque", 100.0 * part_of(worst))
                                : std::string("more than its torque");
  return fmt::format(" of {:.2g} {} at {}, where an error below {:.2g} {} ({}) would not show", worst.noise,
                     joint.type == JointType::kRevolute ? "N m" : "N", joint.name, worst.hidden,
                     joint.type == JointType::kRevolute ? "N m" : "N", share);
}

}  // namespace

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
    verdict = {"explained", fmt::format("{} explains {}: the rest is noise{}", model, recording,
                                        DescribeNoise(judgement, robot))};
  } else if (judgement.causes.empty() && judgement.IsWhole() && judgement.IsHidden()) {
    verdict = {"partly explained", fmt::format("what {} leaves of {} is noise, beside which no error of the "
                                               "model would show",
                                               model, recording)};
  } else if (judgement.causes.empty() && judgement.IsWhole()) {
    std::vector<std::string> judged;
    for (const JointJudgement& one : judgement.balances)
      if (one.recording == 0) judged.push_back(name_of(one.joint));
    verdict = {"partly explained",
               fmt::format("{} explains {} at {}: the rest is noise", model, recording, JoinNames(judged))};
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
