#include "harness/recordings/judgement_verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "controller/common/text.h"

namespace dexcheck {

namespace {

constexpr double kLeast = 5e-3;  // explained, that is said

/// Returns "Noise of 0.1 N m at elbow hides errors below 0.2 N m (3 % of its torque)", for the joint where
/// that is the largest part.
std::string DescribeNoise(const RecordingJudgement& judgement, const RobotModel& robot) {
  static constexpr double kNone = 1e-300;  // N m or N, of a joint that the model gives no torque
  const auto part_of = [](const JointJudgement& one) { return one.hidden / std::max(one.modelled, kNone); };
  const JointJudgement& worst = *std::ranges::max_element(judgement.balances, {}, part_of);
  const Joint& joint = robot.joint(worst.joint);
  const std::string share = worst.hidden < worst.modelled
                                ? fmt::format("{:.2g} % of its torque", 100.0 * part_of(worst))
                                : std::string("more than its torque");
  const char* const unit = joint.type == JointType::kRevolute ? "N m" : "N";
  return fmt::format("Noise of {:.2g} {} at {} hides errors below {:.2g} {} ({})", worst.noise, unit,
                     joint.name, worst.hidden, unit, share);
}

/// Lists the causes, the nearest ones of what nothing explains, and how well both predict what was held out.
void AddCauses(const RecordingJudgement& judgement, Answer* answer) {
  std::string nearest;
  for (const Explanation& one : judgement.causes) {
    if (one.outcome != CauseOutcome::kNotExplained || one.faults.empty())
      answer->causes.push_back(one.Describe());
    else if (!std::isnan(one.faults.front().value))
      nearest += fmt::format("{}{} ({:.0f} %)", nearest.empty() ? "" : ", ", one.faults.front().Describe(),
                             100.0 * std::min(1.0, one.fraction));
  }
  if (!nearest.empty()) answer->remarks.push_back("nearest, but not shown to be causes: " + nearest);
  if (judgement.causes.empty()) return;
  if (judgement.explained > kLeast)
    answer->remarks.push_back(
        fmt::format("{} {:.4g} % of the difference; the rest is {:.2g} times the noise",
                    answer->causes.empty() ? "the nearest would explain" : "the causes explain",
                    100.0 * judgement.explained, judgement.left));
  // A short recording is not divided: nothing is held out.
  const HeldPrediction &causes = judgement.by_causes, &all = judgement.by_all;
  if (all.held_left > 0.0)
    answer->remarks.push_back(fmt::format(
        "on the held-out quarter the causes leave {:.2g} times the noise, a fit of all {} parameters "
        "{:.2g} times{}",
        causes.held_left, all.numbers, all.held_left, judgement.IsBeaten() ? ": some cause is missing" : ""));
}

}  // namespace

Answer MakeAnswer(const RecordingJudgement& judgement, const RobotModel& robot,
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
  Answer answer{.tone = judgement.Agrees() ? Answer::Tone::kGood : Answer::Tone::kBad};
  const auto say = [&](const char* word, std::string sentence) {
    answer.word = word, answer.sentence = std::move(sentence);
  };
  if (judgement.Agrees()) {
    say("EXPLAINED", fmt::format("{} explains {}. {}", model, recording, DescribeNoise(judgement, robot)));
  } else if (judgement.causes.empty() && judgement.IsWhole() && judgement.IsHidden()) {
    say("PARTLY EXPLAINED", fmt::format("{} explains {} up to noise, which would hide an error of a fifth of "
                                        "any joint's torque",
                                        model, recording));
  } else if (judgement.causes.empty() && judgement.IsWhole() && judgement.rests) {
    say("PARTLY EXPLAINED",
        fmt::format("no joint of {} moves: {} explains gravity there; nothing else was tested", recording,
                    model));
  } else if (judgement.causes.empty() && judgement.IsWhole()) {
    std::vector<std::string> judged, hidden;
    for (const JointJudgement& one : judgement.balances)
      if (one.recording == 0) (one.IsHidden() ? hidden : judged).push_back(name_of(one.joint));
    say("PARTLY EXPLAINED",
        fmt::format("{} explains {} at {}: the rest is noise", model, recording, JoinNames(judged)));
    if (!hidden.empty())
      answer.sentence +=
          fmt::format("; noise at {} would hide an error of a fifth of the torque", JoinNames(hidden));
  } else if (are_velocities_alone && judgement.IsWhole()) {
    say("DIFFERS", fmt::format("the velocities of {} are not its positions' derivatives and were not used; "
                               "{} explains its torques",
                               recording, model));
  } else if (count == 0) {
    say("NOT EXPLAINED",
        fmt::format("{} does not explain {}, and neither does any known cause", model, recording));
  } else {
    const std::string share =
        judgement.explained > kLeast ? fmt::format(" by {:.3g} %", 100.0 * judgement.explained) : "";
    say("DIFFERS", fmt::format("{} does not explain {}; {}{}", model, recording, causes_do,
                               judgement.IsWhole()   ? ""
                               : judgement.IsNoise() ? ", and another cause is missing"
                                                     : share + ", and more than noise is left"));
  }
  answer.sentence += not_judged + ".";
  AddCauses(judgement, &answer);
  return answer;
}

}  // namespace dexcheck
