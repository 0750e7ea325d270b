#include "harness/run/run_answer.h"

#include <nlohmann/json.hpp>
#include <string>

#include "harness/checks/check_table.h"
#include "harness/checks/failure_cause.h"

namespace dexcheck {
namespace {

using Json = nlohmann::ordered_json;

/// Returns the text at a place of the summary; empty where there is none.
std::string FindText(const Json& summary, const char* place) {
  const Json::json_pointer pointer(place);
  const bool is_text = summary.contains(pointer) && summary.at(pointer).is_string();
  return is_text ? summary.at(pointer).get<std::string>() : "";
}

/// Lists the causes, each with the channel that shows it.
void AddCauses(const Json& causes, Answer* answer) {
  bool has_several = false;
  for (const Json& cause : causes) {
    const std::string channel = FindText(cause, "/channel");
    const std::string prefix = channel.empty() || channel == "observation" ? "" : channel + ": ";
    answer->causes.push_back(prefix + FindText(cause, "/text"));
    has_several = has_several || (FindText(cause, "/outcome") == "class" && cause["faults"].size() > 1);
  }
  if (has_several) answer->remarks.emplace_back("another motion may separate the causes joined by \"or\"");
}

/// Returns whether a motor is one that a run cannot drive.
bool HasServos(const Json& checks) {
  for (const auto& [name, check] : checks.items())
    if (name.starts_with("motor_") && check.is_object() && !check.value("pass", true)) return true;
  return false;
}

}  // namespace

Answer MakeRunAnswer(const Json& summary, std::span<const CheckRecord> checks) {
  const std::string verdict = FindText(summary, "/verdict");
  const std::string cause = FindText(summary, "/attribution/cause");
  Answer answer;
  if (verdict == "failed") {
    answer = {Answer::Tone::kBad, "FAILED", FindText(summary, "/failure") + "."};
  } else if (verdict == "disagreement") {
    answer = {Answer::Tone::kBad, "DISAGREEMENT", std::string(DescribeCause(cause)) + "."};
  } else if (checks.empty()) {
    answer = {Answer::Tone::kOpen, "NOT CHECKED", "the run completed."};
  } else {
    const bool is_ideal = !summary.contains("plant_declared");
    answer.word = "PASS";
    answer.sentence =
        DescribeWhatHolds(checks) + (is_ideal ? "." : ", the scenario's imperfections counted in.");
  }
  if (cause.empty() || cause == "none") return answer;
  if (summary.contains("causes")) AddCauses(summary["causes"], &answer);
  std::string evidence = FindText(summary, "/attribution/evidence");
  // Causes are listed already.
  for (const Json& one : summary.value("causes", Json::array())) {
    const std::string text = "; " + FindText(one, "/text");
    if (const size_t at = evidence.find(text); at != std::string::npos) evidence.erase(at, text.size());
  }
  if (answer.causes.empty() || answer.causes.front() != evidence)
    answer.remarks.push_back("evidence: " + evidence);
  if (summary.contains("checks") && HasServos(summary["checks"]))
    answer.remarks.emplace_back(
        "a run sends torques, so that each actuator must be a <motor> of gear 1: dexcheck import FILE.xml "
        "--motors --out COPY.xml writes such a copy");
  return answer;
}

}  // namespace dexcheck
