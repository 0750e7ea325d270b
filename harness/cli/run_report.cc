#include "harness/cli/run_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "controller/common/text.h"
#include "harness/base/check_record.h"
#include "harness/checks/check_table.h"
#include "harness/cli/output_file.h"
#include "harness/cli/terminal.h"

namespace dexcheck::cli {
std::vector<CheckRecord> ListChecksOf(const ClosedLoop& loop) {
  std::vector<CheckRecord> all;
  if (!loop.is_checking()) return all;
  for (const std::span<const CheckRecord> records :
       {loop.checks().model_checks(), loop.checks().motion_checks()})
    std::ranges::copy_if(records, std::back_inserter(all), &CheckRecord::applies);
  return all;
}

namespace {

std::string PaintStatus(const CheckRecord& check) {
  const std::string status = DescribeStatus(check);
  return check.failed ? Paint(Tone::kBad, status) : status == "ok" ? Paint(Tone::kGood, status) : status;
}

/// Adds a check's line to the table.
/// @param count number of the checks that the line stands for; empty for one.
void AddCheck(const CheckRecord& check, const std::string& count, std::vector<TableRow>* rows) {
  if (!check.applies || check.is_empty) return;
  TableRow& row = rows->emplace_back();
  row.cells = {NameOf(check.kind), count, check.name};
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
    rows->push_back({{NameOf(kind), std::to_string(passing.not_reached), "not reached"}});
}

void PrintChecks(const Setup& setup, const ClosedLoop& loop, Detail detail) {
  const bool all = detail == Detail::kAll;
  std::vector<TableRow> rows = {
      {{"category", "", all ? "check" : "checks, nearest to its bound", "worst", "bound"}}};
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
  fmt::print("\n{}", FormatTable(all ? "<<>><<" : "<><>><<", rows));
  if (!all) fmt::print("(--all lists each check)\n");
  std::vector<std::string> names;
  double from = 0.0;
  for (const CheckRecord& check : loop.checks().settling_failures()) {
    names.push_back(check.name);
    from = std::min(from, check.failed_at);
  }
  if (!names.empty())
    fmt::print("{}\n",
               Wrap(fmt::format("fails while settling, from {:.3f} s: {}", from, JoinNames(names)), 2));
}

/// "approach 0.0, close 3.4, ..." with the time each began.
void PrintTask(const ClosedLoop& loop) {
  const PickAndPlace& task = loop.task()->task();
  std::string line;
  for (const PhaseEntry& entry : task.history()) {
    line += fmt::format("{}{} {:.1f}", line.empty() ? "" : ", ", NameOf(entry.phase), entry.time);
  }
  fmt::print("{}\n", Wrap("phases, s: " + line, 2));
  if (!task.first_failure().empty()) fmt::print("first attempt: {}\n", task.first_failure());
  if (task.scale() != 1.0) fmt::print("weighed: {:.3f} of the stated mass\n", task.scale());
  fmt::print("object pushed by {:.1e} m before it was held; largest step of a torque {:.1e} N m\n",
             task.push(), loop.task()->torque_jump());
}

void PrintTracking(const Scenario& scenario, const TrackingStatistics& tracking) {
  if (scenario.joint_task() != nullptr) {
    fmt::print("joints: largest error {:.2e} rad (rms {:.2e})\n", tracking.joints.max, tracking.joints.rms());
    return;
  }
  fmt::print("object: position error {:.2e} m (rms {:.2e}), orientation error {:.2e} rad\n",
             tracking.position.max, tracking.position.rms(), tracking.orientation.max);
}

/// At which motors torques were cut off, and how long; the longest first.
void PrintLimits(std::span<const Motor> motors, const std::vector<LimitedTorque>& limited) {
  std::vector<size_t> order;
  for (size_t i = 0; i < limited.size(); ++i)
    if (limited[i].time > 0.0) order.push_back(i);
  std::ranges::sort(order, [&](size_t a, size_t b) { return limited[a].time > limited[b].time; });
  std::string text = "torque limited: ";
  for (const size_t i : order)
    text += fmt::format("{}{} for {:.3f} s from {:.3f} s, by up to {:.3g}", i == order.front() ? "" : "; ",
                        motors[i].name, limited[i].time, limited[i].first, limited[i].most);
  fmt::print("{}\n", Wrap(order.empty() ? text + "at no joint" : text, 2));
}

/// Which bodies came nearest to each other that must not touch.
void PrintClearance(const Clearance& clearance) {
  const Clearance::Nearest* nearest = nullptr;
  for (int i = 0; i < kPairClassCount; ++i) {
    const Clearance::Nearest& one = clearance.nearest(static_cast<PairClass>(i));
    if (one.pair >= 0 && (nearest == nullptr || one.distance < nearest->distance)) nearest = &one;
  }
  if (nearest == nullptr) return;
  fmt::print("smallest clearance: {}, {:.1f} mm {} at t = {:.3f} s\n", clearance.Describe(nearest->pair),
             1e3 * std::abs(nearest->distance), nearest->distance < 0.0 ? "into each other" : "apart",
             nearest->time);
}

/// How far the paper's rigid contacts are from the plant's.
void PrintRigidContacts(const RunChecks& checks) {
  if (!checks.Has("reduced_acceleration") || !checks.Has("contact_force")) return;
  const CheckRecord& acceleration = checks.Find("reduced_acceleration");
  if (acceleration.count == 0) return;
  fmt::print("rigid contacts explain accelerations to {:.1e}, contact forces to {:.1e}\n", acceleration.worst,
             checks.Find("contact_force").worst);
}

void PrintSpeed(const ClosedLoop& loop, const RunResult& result) {
  const LoopTimes& times = loop.times();
  const double scale = 1e6 / static_cast<double>(std::max(loop.record().step, 1L));
  fmt::print(
      "\n{:.1f} x real time; us/step: plant {:.0f}, controller {:.0f}, cross-check {:.0f}, recording "
      "{:.0f}\n",
      result.wall_seconds > 0.0 ? loop.time() / result.wall_seconds : 0.0, scale * times.plant,
      scale * times.controller, scale * times.cross_check, scale * result.recording_seconds);
}

}  // namespace

void PrintRunReport(const Setup& setup, const ClosedLoop& loop, const RunResult& result,
                    const std::string& folder, Detail detail) {
  const Scenario& scenario = setup.scenario();
  fmt::print("\n{}\n", Wrap(scenario.name + ": " + scenario.description, 2));
  fmt::print("{:.3f} of {:.3f} s simulated, {} steps of {} ms\n", loop.time(), scenario.duration,
             loop.record().step, 1e3 * scenario.plant.time_step);
  if (scenario.tolerance > 0.0) fmt::print("judged to a relative tolerance of {:g}\n", scenario.tolerance);
  for (const std::string& key : scenario.imperfections.declared) fmt::print("declared: {}\n", key);
  if (loop.record().step > 0) PrintTracking(scenario, result.tracking);
  if (scenario.control.kappa == ContactSource::kIntegrated) {
    const ContactDrift& drift = loop.largest_drift();
    fmt::print(
        "contacts followed by (40): off by {:.2e} m on the object, {:.2e} m on the fingertip, "
        "{:.2e} rad in psi\n",
        drift.object, drift.fingertip, drift.psi);
  }
  if (scenario.imperfections.actuation.saturates()) PrintLimits(loop.motors(), result.limited);
  if (loop.task() != nullptr) PrintTask(loop);
  if (loop.is_checking()) {
    PrintClearance(loop.checks().clearance());
    PrintRigidContacts(loop.checks());
    PrintChecks(setup, loop, detail);
  }
  PrintSpeed(loop, result);
  if (!folder.empty()) fmt::print("log and summary in {}\n", folder);
}

std::string WriteJUnit(const Setup& setup, const ClosedLoop& loop, const RunResult& result) {
  std::vector<JUnitCase> cases;
  if (loop.is_checking()) {
    for (const CheckRecord& check : setup.constants().records) {
      cases.push_back(MakeJUnitCase("constant", check, ""));
    }
    for (const CheckRecord& check : ListChecksOf(loop))
      cases.push_back(MakeJUnitCase(NameOf(check.kind), check, check.part));
  }
  const bool disagrees = result.verdict == Verdict::kDisagreement;
  const std::string cause =
      fmt::format("cause: {} ({})", NameOf(result.attribution.cause), result.attribution.evidence);
  cases.push_back({"run", "verdict", disagrees ? cause : "", ""});
  return WriteJUnit("dexcheck.run." + setup.scenario().name, cases, result.wall_seconds, result.failure);
}

}  // namespace dexcheck::cli
