#include "harness/log/log_content.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>

#include "harness/base/bounded_json.h"

namespace dexcheck {

std::string NameColumn(const SignalInfo& signal, size_t column) {
  if (signal.columns.empty() && signal.width == 1) return signal.name;
  return signal.name + "." + (signal.columns.empty() ? std::to_string(column) : signal.columns[column]);
}

std::vector<std::string> ListUnits(const SignalInfo& signal) {
  constexpr std::string_view kSeparator = ", ";
  std::vector<std::string> units;
  for (size_t begin = 0; begin <= signal.unit.size();) {
    const size_t end = std::min(signal.unit.find(kSeparator, begin), signal.unit.size());
    units.push_back(signal.unit.substr(begin, end - begin));
    begin = end + kSeparator.size();
  }
  const auto width = static_cast<size_t>(signal.width);
  if (units.size() != width) units.assign(width, signal.unit);
  return units;
}

bool IsPlainPath(std::string_view name) {
  size_t begin = 0;
  while (begin <= name.size()) {
    const size_t end = std::min(name.find('/', begin), name.size());
    const std::string_view part = name.substr(begin, end - begin);
    if (part.empty() || part == "." || part == "..") return false;
    begin = end + 1;
  }
  return std::ranges::none_of(
      name, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == '\\'; });
}

namespace {

using Json = nlohmann::ordered_json;
using Of = OldName::Of;

std::string RenameWord(const std::string& word) {
  for (const OldName& name : ListOldNames()) {
    if ((name.of == Of::kCheck || name.of == Of::kWord) && name.old == word) return std::string(name.now);
  }
  return word;
}

Json RenameAll(const Json& json) {
  if (json.is_string()) return RenameWord(json.get<std::string>());
  if (!json.is_structured()) return json;
  Json renamed = json.is_array() ? Json::array() : Json::object();
  for (const auto& [key, value] : json.items()) {
    if (json.is_array()) {
      renamed.push_back(RenameAll(value));
    } else {
      renamed[RenameWord(key)] = RenameAll(value);
    }
  }
  return renamed;
}

}  // namespace

const std::vector<OldName>& ListOldNames() {
  static const std::vector<OldName> names = {
      {Of::kCheck, "told", "measurement"},
      {Of::kCheck, "gain_stability", "closed_loop_spectral_radius"},
      {Of::kCheck, "balance_robot", "inverse_dynamics_robot"},
      {Of::kCheck, "balance_object", "inverse_dynamics_object"},
      {Of::kCheck, "joint_stop", "joint_limit"},
      {Of::kCheck, "unjudged", "excluded"},
      {Of::kSignal, "told/q", "measured/q"},
      {Of::kSignal, "told/xi", "measured/xi"},
      {Of::kWord, "plant_asked_for", "plant_declared"},
      {Of::kWord, "balance", "inverse_dynamics"},
      {Of::kWord, "prediction", "forward_dynamics"},
      {Of::kWord, "joint stop", "joint limit"},
      {Of::kWord, "unjudged_steps", "excluded_steps"},
      {Of::kKey, "may_touch", "allowed_collision_pairs"},
      {Of::kReplaced, "check/grasp_force",
       "check/grasp_null_space, check/grasp_cone and check/grasp_optimality"},
  };
  return names;
}

std::string RenameSignal(const std::string& name) {
  constexpr std::string_view kChecks = "check/";
  for (const OldName& old : ListOldNames()) {
    if (old.of == Of::kSignal && old.old == name) return std::string(old.now);
    if (old.of == Of::kCheck && name.starts_with(kChecks) && name.substr(kChecks.size()) == old.old)
      return std::string(kChecks) + std::string(old.now);
  }
  return name;
}

std::string RenameSummary(const std::string& summary) {
  const Json json = ParseJson<Json>(summary);
  return json.is_object() ? RenameAll(json).dump(2) + "\n" : summary;
}

std::string RenameKeys(const std::string& toml) {
  std::string renamed = toml;
  for (const OldName& name : ListOldNames()) {
    if (name.of != Of::kKey) continue;
    const std::regex word("\\b" + std::string(name.old) + "\\b");
    renamed = std::regex_replace(renamed, word, std::string(name.now));
  }
  return renamed;
}

}  // namespace dexcheck
