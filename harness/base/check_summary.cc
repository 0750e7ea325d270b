#include "harness/base/check_summary.h"

#include <limits>
#include <nlohmann/json.hpp>

namespace dexcheck {

const char* TitleOf(CheckCategory category) {
  static constexpr const char* kTitles[] = {"Model", "Inverse dynamics", "Forward dynamics", "Assumptions",
                                            "Law"};
  return kTitles[static_cast<size_t>(category)];
}

double CalcFraction(double value, double bound) {
  if (bound > 0.0) return value / bound;
  return value > 0.0 ? std::numeric_limits<double>::infinity() : 0.0;
}

nlohmann::ordered_json ToJson(const CheckRecord& record, bool timed) {
  nlohmann::ordered_json json = {{"kind", NameOf(record.kind)}, {"max", record.worst}};
  if (timed) json["rms"] = record.rms();
  json["bound"] = record.bound;
  json["unit"] = record.unit;
  if (timed) json["at_time_s"] = record.at;
  json["pass"] = !record.failed;
  if (timed && record.failed) json["failed_at_s"] = record.failed_at;
  if (!record.part.empty()) json["where"] = record.part;
  if (!record.description.empty()) json["description"] = record.description;
  return json;
}

CheckRecord ReadCheck(const std::string& name, const nlohmann::json& json) {
  const auto number = [&](const char* key) {
    const auto value = json.find(key);
    if (value == json.end()) return 0.0;
    return value->is_number() ? value->get<double>() : std::numeric_limits<double>::infinity();
  };
  CheckRecord record;
  record.name = name;
  record.kind = CheckCategory::kAssumption;
  for (const CheckCategory kind : kCheckCategories) {
    if (json.at("kind").get<std::string>() == NameOf(kind)) record.kind = kind;
  }
  record.unit = json.value("unit", "1");
  record.description = json.value("description", "");
  record.bound = number("bound");
  record.worst = number("max");
  record.at = number("at_time_s");
  record.failed = !json.at("pass").get<bool>();
  record.failed_at = number("failed_at_s");
  record.part = json.value("where", "");
  record.count = json.contains("at_time_s") ? 1 : 0;
  return record;
}

void CategoryStatus::Add(const std::string& name, double value, double its_bound, bool fails) {
  if (!is_asked() || CalcFraction(value, its_bound) > fraction()) {
    check = name;
    worst = value;
    bound = its_bound;
  }
  ++checks;
  failed += fails ? 1 : 0;
}

}  // namespace dexcheck
