#include "harness/report/run_data.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "renders/category_status.h"

namespace dexcheck {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr const char* kCheckPrefix = "check/";

CheckCategory ReadKind(const std::string& name) {
  for (const CheckCategory kind : kCheckCategorys) {
    if (name == NameOf(kind)) return kind;
  }
  return CheckCategory::kAssumption;
}

/// JSON has no infinity: it is written as null.
double ReadNumber(const nlohmann::json& json, const char* key) {
  const auto value = json.find(key);
  if (value == json.end()) return 0.0;
  return value->is_number() ? value->get<double>() : kUnbounded;
}

}  // namespace

double CheckLine::fraction() const {
  if (bound > 0.0) return max / bound;
  return max == 0.0 ? 0.0 : kUnbounded;
}

RunData::RunData(const std::filesystem::path& run_dir) : path_(run_dir / "log.h5"), log_(path_) {
  if (log_.rows() == 0)
    throw InputError(path_.string() + ": the run has no steps (rows: 0), " + DescribeCut(log_));
  time_ = log_.ReadSignal("time").col(0);
  for (Eigen::Index row = 0; row < time_.size(); ++row) {
    const bool advances = row == 0 || time_[row] > time_[row - 1];
    if (!advances || !std::isfinite(time_[row])) {
      throw InputError(path_.string() + ": time: must be finite and increase, got " +
                       FormatNumber(time_[row]) + " in row " + std::to_string(row));
    }
  }
  ReadSummary();
  if (summary_.is_null()) {
    ReadChecksOfSignals();
  } else {
    ReadChecksOfSummary();
  }
  std::stable_sort(checks_.begin(), checks_.end(), [](const CheckLine& a, const CheckLine& b) {
    return a.pass != b.pass ? !a.pass : a.fraction() > b.fraction();
  });
}

const SignalInfo* RunData::Find(const std::string& signal) const {
  const auto found = std::find_if(log_.signals().begin(), log_.signals().end(),
                                  [&](const SignalInfo& info) { return info.name == signal; });
  return found == log_.signals().end() ? nullptr : &*found;
}

std::string RunData::NameColumn(const SignalInfo& signal, int column) {
  const auto index = static_cast<size_t>(column);
  return index < signal.columns.size() ? signal.columns[index] : std::to_string(column + 1);
}

std::string DescribeCut(const LogReader& log) {
  const std::string text = log.FindText("summary");
  const nlohmann::json summary = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  const bool stopped = summary.is_object() && summary.value("interrupted", nlohmann::json()) == true;
  if (!text.empty() && !stopped && log.rows() > 0) return "";
  const std::string how = text.empty() ? "was cut off" : stopped ? "was stopped by hand" : "ended";
  return "the run " + how +
         (log.rows() > 0 ? " after " + std::to_string(log.rows()) + " steps" : " before its first step");
}

void RunData::ReadSummary() {
  const std::string text = log_.FindText("summary");
  if (text.empty()) return;
  summary_ = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!summary_.is_object() || !summary_.contains("verdict") || !summary_.contains("checks")) {
    throw InputError(path_.string() + ": summary: is not a run's summary");
  }
}

void RunData::ReadChecksOfSummary() {
  try {
    for (const auto& [name, json] : summary_.at("checks").items()) {
      CheckLine line;
      line.name = name;
      line.kind = ReadKind(json.at("kind").get<std::string>());
      line.unit = json.value("unit", "1");
      line.description = json.value("description", "");
      line.bound = ReadNumber(json, "bound");
      line.max = ReadNumber(json, "max");
      line.at_time = ReadNumber(json, "at_time_s");
      line.failed_at = ReadNumber(json, "failed_at_s");
      line.pass = json.at("pass").get<bool>();
      line.constant = !json.contains("at_time_s");
      line.where = json.value("where", "");
      checks_.push_back(line);
    }
  } catch (const nlohmann::json::exception& error) {
    throw InputError(path_.string() + ": summary: " + error.what());
  }
}

void RunData::ReadChecksOfSignals() {
  for (const SignalInfo& signal : log_.signals()) {
    if (!signal.name.starts_with(kCheckPrefix)) continue;
    const auto bound = signal.attributes.find("bound");
    const auto kind = signal.attributes.find("kind");
    if (bound == signal.attributes.end() || kind == signal.attributes.end()) {
      throw InputError(path_.string() + ": " + signal.name + ": has no attribute \"bound\" or \"kind\"");
    }
    CheckLine line;
    line.name = signal.name.substr(std::string(kCheckPrefix).size());
    line.kind = static_cast<CheckCategory>(
        std::clamp(static_cast<int>(kind->second), 0, static_cast<int>(CheckCategory::kLaw)));
    line.unit = signal.unit;
    line.description = signal.description;
    line.bound = bound->second;
    const RowMatrixXd values = log_.ReadSignal(signal.name);
    for (long row = 0; row < values.rows(); ++row) {
      const double value = values(row, 0);
      if (!(value <= line.bound) && line.pass) {
        line.pass = false;
        line.failed_at = time_[row];
      }
      if (value <= line.max) continue;
      line.max = value;
      if (std::isnan(value)) line.max = kUnbounded;
      line.at_time = time_[row];
    }
    checks_.push_back(line);
  }
}

}  // namespace dexcheck
