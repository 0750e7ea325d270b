#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "controller/common/text.h"
#include "harness/base/bounded_json.h"
#include "harness/base/check_record.h"
#include "harness/checks/check_table.h"
#include "harness/cli/run_folder.h"

namespace dexcheck::cli {
namespace {

/// Returns the checks of the model and of the motion that the run has; none of a run that was not checked.
std::vector<CheckRecord> ListChecksOf(const ClosedLoop& loop) {
  std::vector<CheckRecord> all;
  if (!loop.is_checking()) return all;
  for (const std::span<const CheckRecord> records :
       {loop.checks().model_checks(), loop.checks().motion_checks()})
    std::ranges::copy_if(records, std::back_inserter(all), &CheckRecord::applies);
  return all;
}

std::string PaintStatus(const CheckRecord& check) {
  const std::string status = DescribeStatus(check);
  return check.failed ? Paint(Tone::kBad, status) : status == "ok" ? Paint(Tone::kGood, status) : status;
}

/// Returns "inverse" of "inverse_dynamics", so that lines have at most 80 letters.
std::string NameShortly(CheckCategory kind) {
  const std::string name = NameOf(kind);
  return name.substr(0, name.find('_'));
}

/// Adds a check's line to the table.
/// @param count number of the checks that the line stands for; empty for one.
void AddCheck(const CheckRecord& check, const std::string& count, std::vector<TableRow>* rows) {
  if (!check.applies || check.is_empty) return;
  TableRow& row = rows->emplace_back();
  row.cells = {NameShortly(check.kind), count, check.name};
  if (!IsReached(check)) {
    row.cells.insert(row.cells.end(), {"-", "", "", "unreached"});
    return;
  }
  const std::string allowed =
      check.residual > check.bound && !check.failed ? fmt::format(", {:.1e} allowed", check.allowance) : "";
  const std::string from = check.failed ? fmt::format(" {:.3f} s", check.failed_at) : "";
  row.cells.insert(row.cells.end(), {fmt::format("{:.1e}", check.failed ? check.worst : check.residual),
                                     fmt::format("{:.0e}", check.bound), check.unit == "1" ? "" : check.unit,
                                     PaintStatus(check) + from + allowed});
}

/// Adds one line for what passes of a category, with the check that came nearest to its bound, and each check
/// that fails.
void AddCategory(CheckCategory kind, const ClosedLoop& loop, std::vector<TableRow>* rows) {
  CategoryStatus passing{kind};
  std::vector<CheckRecord> failing;
  for (const CheckRecord& check : ListChecksOf(loop)) {
    if (check.kind != kind) continue;
    if (check.failed) {
      failing.push_back(check);
    } else {
      passing.Add(check);
    }
  }
  for (const CheckRecord& check : failing) AddCheck(check, "", rows);
  if (passing.is_asked())
    AddCheck(passing.nearest, passing.checks == 1 ? "" : std::to_string(passing.checks), rows);
  const bool is_asked =
      passing.is_asked() || !failing.empty();  // contacts of an arm that touches nothing are not
  if (is_asked && passing.not_reached > 0)
    rows->push_back({{NameShortly(kind), std::to_string(passing.not_reached), "not reached"}});
}

void AddChecks(const Setup& setup, const ClosedLoop& loop, bool all, Report* report) {
  std::vector<TableRow> rows = {
      {{"category", "", all ? "check" : "check nearest to its bound", "worst", "bound"}}};
  const auto& constants = setup.constants().records;
  const auto differs = std::ranges::count_if(constants, [](const CheckRecord& r) { return r.failed; });
  rows.push_back({{"model", std::to_string(constants.size()),
                   all ? fmt::format("{} constants", constants.size()) : "constants", std::to_string(differs),
                   "0", "", differs > 0 ? Paint(Tone::kBad, "FAILS") : Paint(Tone::kGood, "ok")}});
  if (all) {
    for (const CheckRecord& check : ListChecksOf(loop)) AddCheck(check, "", &rows);
  } else {
    for (const CheckCategory kind : kCheckCategories) AddCategory(kind, loop, &rows);
  }
  if (all) {  // each line is one check
    for (TableRow& row : rows) row.cells.erase(row.cells.begin() + 1);
  }
  report->details += "\n";
  report->AddTable(all ? "<<>><<" : "<><>><<", rows);
  if (!all) report->Add("(--all lists each check)");
  std::vector<std::string> names;
  double from = 0.0;
  for (const CheckRecord& check : loop.checks().settling_failures()) {
    names.push_back(check.name);
    from = std::min(from, check.failed_at);
  }
  if (!names.empty())
    report->Add(fmt::format("fails while settling, from {:.3f} s: {}", from, JoinNames(names)));
}

/// "approach 0.0, close 3.4, ..." with the time each began.
void AddTask(const Json& task, Report* report) {
  std::vector<std::string> phases;
  for (const Json& phase : task["phases"])
    phases.push_back(fmt::format("{} {:.1f}", FindText(phase, "/phase"), phase["begin_s"].get<double>()));
  report->Add(fmt::format("phases, s: {}", fmt::join(phases, ", ")));
  const std::string failure = FindText(task, "/first_failure");
  if (!failure.empty()) report->Add("first attempt: " + failure);
  const double scale = task["weighed"];
  if (scale != 1.0) report->Add(fmt::format("estimated mass: {:.3f} of the stated one", scale));
  report->Add(fmt::format("object pushed by {:.1e} m before it was held; largest step of a torque {:.1e} N m",
                          task["push_m"].get<double>(), task["torque_jump_max_N_m"].get<double>()));
}

/// At which motors torques were cut off, and how long; the longest first.
void AddLimits(const Json& limited, Report* report) {
  std::vector<Json> longest(limited.begin(), limited.end());
  std::ranges::stable_sort(longest, std::ranges::greater(),
                           [](const Json& one) { return one["time_s"].get<double>(); });
  std::vector<std::string> texts;
  texts.reserve(longest.size());
  for (const Json& one : longest)
    texts.push_back(fmt::format("{} for {:.3f} s from {:.3f} s, by up to {:.3g}", FindText(one, "/motor"),
                                one["time_s"].get<double>(), one["first_s"].get<double>(),
                                one["most_N_m"].get<double>()));
  if (texts.empty()) texts.emplace_back("at no joint");
  report->Add(fmt::format("torque limited: {}", fmt::join(texts, "; ")));
}

/// Which bodies came nearest to each other that must not touch.
void AddClearance(const Json& clearance, Report* report) {
  const auto distance = [](const Json& one) { return one["smallest_m"].get<double>(); };
  const auto nearest =
      std::min_element(clearance.begin(), clearance.end(),
                       [&](const Json& a, const Json& b) { return distance(a) < distance(b); });
  if (nearest == clearance.end()) return;
  report->Add(fmt::format("smallest clearance: {}, {:.1f} mm {} at t = {:.3f} s",
                          FindText(*nearest, "/bodies"), 1e3 * std::abs(distance(*nearest)),
                          distance(*nearest) < 0.0 ? "into each other" : "apart",
                          (*nearest)["at_time_s"].get<double>()));
}

/// How far the paper's rigid contacts are from the plant's.
void AddRigidContacts(const RunChecks& checks, Report* report) {
  if (!checks.Has("reduced_acceleration") || !checks.Has("contact_force")) return;
  const CheckRecord& acceleration = checks.Find("reduced_acceleration");
  if (acceleration.count == 0) return;
  report->Add(fmt::format("the rigid prediction misses accelerations by {:.1e}, contact forces by {:.1e}",
                          acceleration.worst, checks.Find("contact_force").worst));
}

/// Adds what stands below the verdict.
void AddDetails(const Setup& setup, const ClosedLoop& loop, const TrackingStatistics& tracking,
                const Json& summary, bool all, Report* report) {
  const Scenario& scenario = setup.scenario();
  report->Add("\n" + scenario.name + ": " + scenario.description);
  report->Add(fmt::format("{:.3f} of {:.3f} s simulated, {} steps of {} ms", loop.time(), scenario.duration,
                          loop.record().step, 1e3 * scenario.plant.time_step));
  if (scenario.tolerance > 0.0)
    report->Add(fmt::format("judged to a relative tolerance of {:g}", scenario.tolerance));
  for (const std::string& key : scenario.imperfections.declared) report->Add("declared: " + key);
  if (loop.record().step > 0)
    report->Add(
        scenario.joint_task() != nullptr
            ? fmt::format("joints: largest error {:.2e} rad (rms {:.2e})", tracking.joints.max,
                          tracking.joints.rms())
            : fmt::format("object: position error {:.2e} m (rms {:.2e}), orientation error {:.2e} rad",
                          tracking.position.max, tracking.position.rms(), tracking.orientation.max));
  if (scenario.control.kappa == ContactSource::kIntegrated) {
    const ContactDrift& drift = loop.largest_drift();
    report->Add(fmt::format(
        "contact points by (40): errors {:.2e} m on the object, {:.2e} m on the fingertip, {:.2e} rad in psi",
        drift.object, drift.fingertip, drift.psi));
  }
  if (summary.contains("torque_limited")) AddLimits(summary["torque_limited"], report);
  if (summary.contains("task")) AddTask(summary["task"], report);
  if (loop.is_checking()) {
    AddClearance(summary["clearance"], report);
    AddRigidContacts(loop.checks(), report);
    AddChecks(setup, loop, all, report);
  }
  const auto speed = [&](const char* key) { return summary["speed"][key].get<double>(); };
  report->Add(fmt::format(
      "\n{:.1f} x real time; us per step: plant {:.0f}, controller {:.0f}, checks {:.0f}, log {:.0f}",
      speed("real_time_factor"), speed("plant_us_per_step"), speed("controller_us_per_step"),
      speed("cross_check_us_per_step"), speed("recording_us_per_step")));
}

}  // namespace

Report MakeRunReport(const Setup& setup, const ClosedLoop& loop, const RunResult& result, const Json& summary,
                     const std::string& folder, bool all) {
  const std::vector<CheckRecord> checks = ListChecksOf(loop);
  Report report{.answer = MakeRunAnswer(summary, checks),
                .data = summary,
                .suite = "run." + setup.scenario().name,
                .seconds = result.wall_seconds,
                .failure = result.failure};
  AddDetails(setup, loop, result.tracking, summary, all, &report);
  if (!folder.empty()) report.Add("log and summary in " + folder);
  if (loop.is_checking()) {
    for (const CheckRecord& check : setup.constants().records) report.AddCase("constant", check, "");
    for (const CheckRecord& check : checks) report.AddCase(NameOf(check.kind), check, check.part);
  }
  JUnitCase& verdict = report.cases.emplace_back(JUnitCase{"run", "verdict"});
  if (result.verdict == Verdict::kDisagreement) {
    report.code = kDisagreement;
    verdict.failure =
        fmt::format("cause: {} ({})", NameOf(result.attribution.cause), result.attribution.evidence);
  }
  return report;
}

}  // namespace dexcheck::cli
