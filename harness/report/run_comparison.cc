#include "harness/report/run_comparison.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Texts of a log that say what went into the run, in the order of the table.
constexpr const char* kInputTexts[] = {"scenario",         "seed",           "overrides", "robot", "mjcf",
                                       "dexcheck_version", "mujoco_version", "machine"};

constexpr const char* kSimulated = "simulated_s";

std::string DescribeVerdict(const RunData& run) {
  const nlohmann::json& summary = run.summary();
  if (summary.is_null()) return "cut off";
  std::string verdict = summary.value("verdict", "");
  if (verdict == "failed") return verdict + ": " + summary.value("failure", "");
  if (verdict == "pass" || !summary.contains("attribution")) return verdict;
  const auto cause = summary["attribution"].find("cause");
  return cause != summary["attribution"].end() && cause->is_string() && *cause != "none"
             ? verdict + ": " + cause->get<std::string>()
             : verdict;
}

/// FNV-1a: files are compared by their bytes, this is what a reader sees of them.
std::string DescribeFile(const std::string& bytes) {
  std::uint64_t hash = 14695981039346656037U;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  return fmt::format("{} bytes, {:016x}", bytes.size(), hash);
}

bool AllEqual(const std::vector<std::string>& values) {
  return std::all_of(values.begin(), values.end(),
                     [&](const std::string& value) { return value == values[0]; });
}

std::vector<InputDifference> CompareInputs(const std::vector<const RunData*>& runs) {
  std::vector<InputDifference> differences;
  const auto add = [&](const std::string& name, std::vector<std::string> values) {
    if (!AllEqual(values)) differences.push_back({name, std::move(values)});
  };
  for (const char* name : kInputTexts) {
    std::vector<std::string> values;
    for (const RunData* run : runs) {
      std::string text = run->FindText(name);
      while (!text.empty() && text.back() == '\n') text.pop_back();
      std::replace(text.begin(), text.end(), '\n', ' ');
      values.push_back(text);
    }
    add(name, std::move(values));
  }
  std::set<std::string> files;
  std::vector<std::set<std::string>> of_runs;
  for (const RunData* run : runs) {
    const std::vector<std::string> list = run->log().ListFiles("inputs");
    of_runs.emplace_back(list.begin(), list.end());
    files.insert(list.begin(), list.end());
  }
  for (const std::string& file : files) {
    std::vector<std::string> values;
    for (size_t i = 0; i < runs.size(); ++i) {
      values.push_back(of_runs[i].count(file) != 0 ? DescribeFile(runs[i]->log().ReadFile("inputs", file))
                                                   : "none");
    }
    add(file, std::move(values));
  }
  return differences;
}

std::optional<double> FindResult(const RunData& run, const char* group, const char* key) {
  const nlohmann::json& summary = run.summary();
  if (summary.is_null()) {  // runs that were cut off are as long as their rows
    return key == kSimulated ? std::optional(run.time()[run.time().size() - 1]) : std::nullopt;
  }
  const nlohmann::json* json = &summary;
  if (group != nullptr) {
    const auto found = summary.find(group);
    if (found == summary.end() || !found->is_object()) return {};
    json = &*found;
  }
  const auto value = json->find(key);
  if (value == json->end() || !value->is_number()) return {};
  return value->get<double>();
}

std::vector<ComparedNumber> CompareResults(const std::vector<const RunData*>& runs) {
  struct Result {
    const char* group;
    const char* key;
    const char* name;
    const char* unit;
  };
  static constexpr Result kResults[] = {
      {nullptr, kSimulated, "simulated", "s"},
      {"tracking", "position_error_max_m", "position error, largest", "m"},
      {"tracking", "position_error_rms_m", "position error, rms", "m"},
      {"tracking", "orientation_error_max_rad", "orientation error, largest", "rad"},
      {"tracking", "orientation_error_rms_rad", "orientation error, rms", "rad"},
      {"speed", "plant_us_per_step", "plant, time a step", "us"},
      {"speed", "controller_us_per_step", "controller, time a step", "us"},
      {"speed", "cross_check_us_per_step", "cross-check, time a step", "us"}};
  std::vector<ComparedNumber> numbers;
  for (const Result& result : kResults) {
    ComparedNumber number{result.name, result.unit, {}, std::vector<bool>(runs.size(), false)};
    for (const RunData* run : runs) number.values.push_back(FindResult(*run, result.group, result.key));
    const auto has_value = [](const std::optional<double>& value) { return value.has_value(); };
    if (std::any_of(number.values.begin(), number.values.end(), has_value)) numbers.push_back(number);
  }
  return numbers;
}

std::vector<ComparedNumber> CompareChecks(const std::vector<const RunData*>& runs) {
  std::vector<ComparedNumber> checks;
  for (size_t i = 0; i < runs.size(); ++i) {
    for (const CheckLine& line : runs[i]->checks()) {
      auto found = std::find_if(checks.begin(), checks.end(),
                                [&](const ComparedNumber& check) { return check.name == line.name; });
      if (found == checks.end()) {
        checks.push_back({line.name, line.unit, std::vector<std::optional<double>>(runs.size()),
                          std::vector<bool>(runs.size(), false)});
        found = checks.end() - 1;
      }
      found->values[i] = line.max;
      found->fails[i] = !line.pass;
    }
  }
  return checks;
}

double LargestOf(const Eigen::Ref<const VectorXd>& values) {
  double largest = 0.0;
  for (const double value : values) {
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  return largest;
}

double FractionOf(double difference, double size) {
  if (size > 0.0) return difference / size;
  return difference == 0.0 ? 0.0 : kInfinity;
}

/// The difference of two numbers; 0 where both are the same infinity or both are none.
double Subtract(double a, double b) {
  if (std::isfinite(a) && std::isfinite(b)) return std::abs(a - b);
  return a == b || (std::isnan(a) && std::isnan(b)) ? 0.0 : kInfinity;
}

SignalDifference CompareSignal(const SignalInfo& signal, const RunData& first, const RunData& later,
                               size_t run, double tolerance) {
  const RowMatrixXd a = first.log().ReadSignal(signal.name);
  const RowMatrixXd b = later.log().ReadSignal(signal.name);
  const std::vector<std::string> units = ListUnits(signal);
  std::map<std::string, double> sizes;
  std::vector<VectorXd> others;
  for (int k = 0; k < signal.width; ++k) {
    double& size = sizes[units[static_cast<size_t>(k)]];
    size = std::max({size, LargestOf(a.col(k)), LargestOf(b.col(k))});
    others.push_back(Resample(later.time(), b.col(k), first.time()));
  }
  SignalDifference result{signal.name, units[0], "", 0, run};
  result.size = sizes[units[0]];
  result.at_time = first.time()[0];
  result.first_time = kInfinity;
  const double begin = later.time()[0];
  const double end = later.time()[later.time().size() - 1];
  for (int k = 0; k < signal.width; ++k) {
    const std::string& unit = units[static_cast<size_t>(k)];
    const double size = sizes[unit];
    for (Eigen::Index row = 0; row < a.rows(); ++row) {
      const double t = first.time()[row];
      if (t < begin || t > end) continue;
      const double apart = Subtract(a(row, k), others[static_cast<size_t>(k)][row]);
      if (apart > tolerance * size) {
        result.differs = true;
        result.first_time = std::min(result.first_time, t);
      }
      // A fraction of the size decides between columns of several units.
      if (!(FractionOf(apart, size) > result.fraction())) continue;
      result.difference = apart;
      result.size = size;
      result.unit = unit;
      result.column = signal.width > 1 ? RunData::NameColumn(signal, k) : "";
      result.column_index = k;
      result.at_time = t;
    }
  }
  return result;
}

bool Matches(const std::string& name, const std::vector<std::string>& patterns) {
  return patterns.empty() || std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
           return ::fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
         });
}

void RequireMatches(const RunData& run, const std::vector<std::string>& patterns) {
  std::vector<std::string> names;
  for (const SignalInfo& signal : run.log().signals()) names.push_back(signal.name);
  for (const std::string& pattern : patterns) {
    if (std::any_of(names.begin(), names.end(),
                    [&](const std::string& name) { return Matches(name, {pattern}); }))
      continue;
    const std::string nearest = FindNearest(pattern, names);
    throw InputError("--signals: no signal matches " + Quote(pattern) +
                     (nearest.empty() ? "" : ", did you mean " + Quote(nearest) + "?"));
  }
}

}  // namespace

std::optional<double> ComparedNumber::CalcRatio(size_t run) const {
  if (!values[0] || !values[run] || (*values[0] == 0.0 && *values[run] == 0.0)) return {};
  return *values[run] / *values[0];
}

double SignalDifference::fraction() const { return FractionOf(difference, size); }

bool RunComparison::IsSame() const {
  if (!AllEqual(verdicts) || signals.empty()) return false;
  for (const ComparedNumber& result : results) {
    if (result.name == "simulated" &&
        !std::all_of(result.values.begin(), result.values.end(),
                     [&](const std::optional<double>& value) { return value == result.values[0]; }))
      return false;
  }
  return FindFirst() == nullptr;
}

const SignalDifference* RunComparison::FindFirst() const {
  const SignalDifference* first = nullptr;
  for (const SignalDifference& signal : signals) {
    if (signal.differs && (first == nullptr || signal.first_time < first->first_time)) first = &signal;
  }
  return first;
}

VectorXd Resample(const VectorXd& time, const Eigen::Ref<const VectorXd>& values, const VectorXd& at) {
  VectorXd result = VectorXd::Constant(at.size(), std::nan(""));
  Eigen::Index next = 0;  // the first row that is not before the time
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    while (next < time.size() && time[next] < at[i]) ++next;
    if (next == time.size()) break;
    if (time[next] == at[i]) {
      result[i] = values[next];
    } else if (next > 0) {
      const double fraction = (at[i] - time[next - 1]) / (time[next] - time[next - 1]);
      result[i] = values[next - 1] + fraction * (values[next] - values[next - 1]);
    }
  }
  return result;
}

RunComparison CompareRuns(const std::vector<const RunData*>& runs, const RunComparisonOptions& options) {
  RunComparison comparison;
  RequireMatches(*runs[0], options.patterns);
  comparison.inputs = CompareInputs(runs);
  for (const RunData* run : runs) comparison.verdicts.push_back(DescribeVerdict(*run));
  comparison.results = CompareResults(runs);
  comparison.checks = CompareChecks(runs);
  for (const SignalInfo& signal : runs[0]->log().signals()) {
    if (signal.name == "time" || signal.name.starts_with("check/") || !Matches(signal.name, options.patterns))
      continue;
    for (size_t i = 1; i < runs.size(); ++i) {
      const SignalInfo* const other = runs[i]->Find(signal.name);
      if (other == nullptr || other->width != signal.width || other->columns != signal.columns) {
        comparison.not_compared.push_back(signal.name);
        continue;
      }
      comparison.signals.push_back(CompareSignal(signal, *runs[0], *runs[i], i, options.tolerance));
    }
  }
  std::stable_sort(
      comparison.signals.begin(), comparison.signals.end(),
      [](const SignalDifference& a, const SignalDifference& b) { return a.fraction() > b.fraction(); });
  return comparison;
}

}  // namespace dexcheck
