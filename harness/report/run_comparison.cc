#include "harness/report/run_comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include "harness/base/files.h"
#include "harness/base/worst.h"
#include "harness/report/page_frame.h"

namespace dexcheck {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Texts of a log that say what went into the run, in the order of the table.
constexpr const char* kInputTexts[] = {"scenario",        "seed",   "overrides", "controller",
                                       "controller_hash", "robot",  "mjcf",      "dexcheck_version",
                                       "mujoco_version",  "machine"};

constexpr const char* kSimulated = "simulated";

/// Numbers of the summary that are compared.
constexpr struct {
  const char* pointer;
  const char* name;
  const char* unit;
} kResults[] = {{"/simulated_s", kSimulated, "s"},
                {"/tracking/position_error_max_m", "position error, largest", "m"},
                {"/tracking/position_error_rms_m", "position error, rms", "m"},
                {"/tracking/orientation_error_max_rad", "orientation error, largest", "rad"},
                {"/tracking/orientation_error_rms_rad", "orientation error, rms", "rad"},
                {"/speed/plant_us_per_step", "plant, time a step", "us"},
                {"/speed/controller_us_per_step", "controller, time a step", "us"},
                {"/speed/cross_check_us_per_step", "cross-check, time a step", "us"}};

std::string DescribeVerdict(const RunData& run) {
  if (run.is_cut_off()) return "cut off";
  const std::string verdict = run.FindSummaryText("/verdict");
  const std::string reason = verdict == "failed" ? run.FindSummaryText("/failure")
                             : verdict == "pass" ? ""
                                                 : run.FindSummaryText("/attribution/cause");
  return reason.empty() || reason == "none" ? verdict : verdict + ": " + reason;
}

template <typename Value>
bool AllEqual(const std::vector<Value>& values) {
  return std::ranges::all_of(values, [&](const Value& value) { return value == values[0]; });
}

/// The engine's settings, each by its name.
template <typename Compare>
void CompareSettings(const std::vector<const RunData*>& runs, const Compare& compare) {
  std::istringstream lines(runs[0]->FindText("engine_settings"));
  for (std::string line; std::getline(lines, line);) {
    const std::string name = line.substr(0, line.find(": "));
    compare("engine, " + name, [&](const RunData& run) {
      const std::string text = "\n" + run.FindText("engine_settings");
      const size_t found = text.find("\n" + name + ": ");
      if (found == std::string::npos) return std::string();
      const size_t begin = found + name.size() + 3;
      return text.substr(begin, text.find('\n', begin) - begin);
    });
  }
}

std::vector<InputDifference> CompareInputs(const std::vector<const RunData*>& runs) {
  std::vector<InputDifference> differences;
  const auto compare = [&](const std::string& name, const auto& read) {
    std::vector<std::string> values;
    for (const RunData* run : runs) values.push_back(read(*run));
    if (!AllEqual(values)) differences.push_back({name, std::move(values)});
  };
  for (const char* name : kInputTexts) {
    compare(name, [&](const RunData& run) {
      std::string text = run.FindText(name);
      while (!text.empty() && text.back() == '\n') text.pop_back();
      std::replace(text.begin(), text.end(), '\n', ' ');
      return text;
    });
  }
  CompareSettings(runs, compare);
  std::set<std::string> files;
  for (const RunData* run : runs) {
    for (const std::string& file : run->log().ListFiles("inputs")) files.insert(file);
  }
  for (const std::string& file : files) {
    compare(file, [&](const RunData& run) {
      const std::vector<std::string> own = run.log().ListFiles("inputs");
      const bool has = std::ranges::find(own, file) != own.end();
      if (!has) return std::string("none");
      const std::string bytes = run.log().ReadFile("inputs", file);
      return fmt::format("{} bytes, {}", bytes.size(), HashBytes(bytes));
    });
  }
  return differences;
}

std::vector<ComparedNumber> CompareResults(const std::vector<const RunData*>& runs) {
  std::vector<ComparedNumber> numbers;
  for (const auto& result : kResults) {
    ComparedNumber number{result.name, result.unit, {}, std::vector<bool>(runs.size(), false)};
    for (const RunData* run : runs) {
      double value = run->FindSummaryNumber(result.pointer);
      if (run->is_cut_off() && result.name == kSimulated) value = run->end();  // as long as its rows
      number.values.push_back(std::isnan(value) ? std::nullopt : std::optional(value));
    }
    if (std::ranges::any_of(number.values, [](const auto& value) { return value.has_value(); }))
      numbers.push_back(number);
  }
  for (const auto& [signal, name] : {std::pair("engine/contacts", "contacts of the engine, mean"),
                                     std::pair("engine/constraint_rows", "its constraint rows, mean")}) {
    ComparedNumber number{name, "1", {}, std::vector<bool>(runs.size(), false)};
    for (const RunData* run : runs) {
      const bool has_signal = run->Find(signal) != nullptr;
      number.values.push_back(has_signal ? std::optional(run->log().ReadSignal(signal).mean())
                                         : std::nullopt);
    }
    const auto is_some = [](const std::optional<double>& value) { return value.value_or(0.0) != 0.0; };
    if (std::ranges::any_of(number.values, is_some)) numbers.push_back(number);
  }
  return numbers;
}

std::vector<ComparedNumber> CompareChecks(const std::vector<const RunData*>& runs) {
  std::vector<ComparedNumber> checks;
  for (size_t i = 0; i < runs.size(); ++i) {
    for (const CheckRecord& record : runs[i]->checks()) {
      auto found = std::ranges::find(checks, record.name, &ComparedNumber::name);
      if (found == checks.end()) {
        checks.push_back({record.name, record.unit, std::vector<std::optional<double>>(runs.size()),
                          std::vector<bool>(runs.size(), false)});
        found = checks.end() - 1;
      }
      if (!IsReached(record)) continue;
      found->values[i] = record.worst;
      found->fails[i] = record.failed;
    }
  }
  return checks;
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
  for (int k = 0; k < signal.width; ++k) {
    double& size = sizes[units[static_cast<size_t>(k)]];
    size = std::max({size, MaxAbsFinite(a.col(k)), MaxAbsFinite(b.col(k))});
  }
  SignalDifference result{signal.name, units[0], "", 0, run};
  result.size = sizes[units[0]];
  result.at_time = first.time()[0];
  result.first_time = kInfinity;
  for (int k = 0; k < signal.width; ++k) {
    const std::string& unit = units[static_cast<size_t>(k)];
    const double size = sizes[unit];
    const VectorXd other = Resample(later.time(), b.col(k), first.time());
    for (Eigen::Index row = 0; row < a.rows(); ++row) {
      const double t = first.time()[row];
      if (t < later.time()[0] || t > later.end()) continue;
      const double apart = Subtract(a(row, k), other[row]);
      if (apart > tolerance * size) {
        result.differs = true;
        result.first_time = std::min(result.first_time, t);
      }
      // A fraction of the size decides between columns of several units.
      if (!(CalcFraction(apart, size) > result.fraction())) continue;
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

}  // namespace

std::optional<double> ComparedNumber::CalcRatio(size_t run) const {
  if (!values[0] || !values[run] || (*values[0] == 0.0 && *values[run] == 0.0)) return {};
  return *values[run] / *values[0];
}

bool ComparedNumber::fails_anywhere() const { return std::ranges::find(fails, true) != fails.end(); }

double SignalDifference::fraction() const { return CalcFraction(difference, size); }

std::string SignalDifference::NameColumn() const { return column.empty() ? name : name + "." + column; }

bool RunComparison::IsSame() const {
  if (!AllEqual(verdicts) || signals.empty()) return false;
  for (const ComparedNumber& result : results) {
    if (result.name == kSimulated && !AllEqual(result.values)) return false;
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
  comparison.tolerance = options.tolerance;
  comparison.inputs = CompareInputs(runs);
  for (const RunData* run : runs) comparison.verdicts.push_back(DescribeVerdict(*run));
  comparison.results = CompareResults(runs);
  comparison.checks = CompareChecks(runs);
  for (const SignalInfo& signal : ChooseSignals(runs[0]->log(), options.patterns)) {
    if (signal.name == "time" || signal.name.starts_with("check/")) continue;
    for (size_t i = 1; i < runs.size(); ++i) {
      const SignalInfo* const other = runs[i]->Find(signal.name);
      if (other == nullptr || other->width != signal.width || other->columns != signal.columns) {
        comparison.not_compared.push_back(signal.name);
        continue;
      }
      comparison.signals.push_back(CompareSignal(signal, *runs[0], *runs[i], i, options.tolerance));
    }
  }
  std::ranges::stable_sort(comparison.signals, [](const SignalDifference& a, const SignalDifference& b) {
    return a.fraction() > b.fraction();
  });
  return comparison;
}

nlohmann::ordered_json ToJson(const RunComparison& comparison, const std::vector<std::string>& names) {
  using Json = nlohmann::ordered_json;
  const SignalDifference* const first = comparison.FindFirst();
  Json json = {{"runs", names},
               {"verdicts", comparison.verdicts},
               {"tolerance", comparison.tolerance},
               {"same", comparison.IsSame()},
               {"first", nullptr},
               {"inputs", Json::object()},
               {"results", Json::object()},
               {"checks", Json::object()},
               {"signals", Json::array()},
               {"not_compared", comparison.not_compared}};
  if (first != nullptr) json["first"] = {{"name", first->NameColumn()}, {"time_s", first->first_time}};
  for (const InputDifference& input : comparison.inputs) json["inputs"][input.name] = input.values;
  for (const auto& [key, numbers] :
       {std::pair("results", &comparison.results), {"checks", &comparison.checks}}) {
    for (const ComparedNumber& number : *numbers) {
      Json values = Json::array();
      for (const std::optional<double>& value : number.values)
        values.push_back(value ? Json(*value) : Json());
      json[key][number.name] = {{"unit", number.unit}, {"values", values}, {"fails", number.fails}};
    }
  }
  for (const SignalDifference& signal : comparison.signals) {
    json["signals"].push_back({{"name", signal.name},
                               {"column", signal.column},
                               {"run", names[signal.run]},
                               {"unit", signal.unit},
                               {"difference", signal.difference},
                               {"size", signal.size},
                               {"at_time_s", signal.at_time},
                               {"differs", signal.differs}});
  }
  return json;
}

Answer MakeAnswer(const RunComparison& comparison) {
  const double tolerance = comparison.tolerance;
  const size_t count = comparison.signals.size();
  if (count == 0)
    return {Answer::Tone::kOpen, "NOT COMPARED", "no signal but time and checks is in all runs."};
  if (comparison.IsSame()) {
    return {Answer::Tone::kGood, "SAME",
            tolerance == 0.0
                ? fmt::format("{} signals are equal bit for bit.", count)
                : fmt::format("{} signals differ by at most {:g} of their size.", count, tolerance)};
  }
  Answer answer{Answer::Tone::kBad, "DIFFERENT", "the signals agree; verdict or duration differs."};
  const SignalDifference* const first = comparison.FindFirst();
  if (first == nullptr) return answer;
  const auto differing = std::ranges::count_if(comparison.signals,
                                               [](const SignalDifference& signal) { return signal.differs; });
  answer.sentence = fmt::format("{} of {} signals, first {} at {:.3f} s.", differing, count,
                                first->NameColumn(), first->first_time);
  return answer;
}

namespace {

/// Signals that are drawn: those that differ most.
constexpr size_t kMostPlots = 10;
/// Fractions below this are rounding, and their plots would be noise.
constexpr double kLeastFraction = 1e-15;

/// The object's error first, then the signals that differ most: overlaid, and subtracted.
std::vector<Figure> MakeFigures(const std::vector<const RunData*>& runs, const RunComparison& comparison) {
  std::vector<Figure> figures;
  const auto read = [&](size_t run, const std::string& name, int column) {
    return Resample(runs[run]->time(), runs[run]->log().ReadSignal(name).col(column), runs[0]->time());
  };
  const auto add = [&](bool subtracts, const std::string& title, const std::string& name, int column,
                       const std::string& label, bool log) {
    Figure figure{.name = (subtracts ? "difference" : "overlay") + std::to_string(figures.size()),
                  .title = title,
                  .label = label,
                  .log = log};
    for (size_t i = subtracts ? 1 : 0; i < runs.size(); ++i) {
      const SignalInfo* const signal = runs[i]->Find(name);
      if (signal == nullptr || signal->width <= column) continue;
      VectorXd values = read(i, name, column);
      if (subtracts) values -= read(0, name, column);
      figure.curves.push_back(
          {.label = static_cast<char>('A' + i % 26) + std::string(subtracts ? " - A" : ""),
           .values = values,
           .color = static_cast<int>(i),
           .dash = subtracts ? 0 : static_cast<int>(i)});
    }
    if (!figure.curves.empty()) figures.push_back(std::move(figure));
  };
  add(false, "position error of the object", "object/position_error", 0, "m", true);
  add(false, "largest error of a joint", "joints/largest_error", 0, "rad", true);
  std::vector<std::string> drawn;
  for (const SignalDifference& signal : comparison.signals) {
    if (drawn.size() == kMostPlots || signal.fraction() < kLeastFraction) break;
    if (std::ranges::find(drawn, signal.name) != drawn.end()) continue;
    drawn.push_back(signal.name);
    const std::string title = signal.NameColumn();
    const bool has_unit = signal.unit != "1";
    add(false, title, signal.name, signal.column_index, has_unit ? signal.unit : signal.name, false);
    add(true, title + ", difference", signal.name, signal.column_index, has_unit ? signal.unit : "difference",
        false);
  }
  return figures;
}

}  // namespace

std::string MakeComparisonPage(const std::vector<const RunData*>& runs, const std::vector<std::string>& names,
                               const RunComparison& comparison) {
  const std::vector<Figure> figures = MakeFigures(runs, comparison);
  const PlotGroup plots = {"", figures, runs[0]->time()};
  return AssemblePlotPage(fmt::format("Comparison of {}", fmt::join(names, ", ")), kComparisonJs,
                          EmbedJson("comparison", ToJson(comparison, names)), {&plots, 1});
}

}  // namespace dexcheck
