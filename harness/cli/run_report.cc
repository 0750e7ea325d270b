#include "harness/cli/run_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "harness/base/check_record.h"
#include "harness/checks/check_table.h"
#include "harness/cli/junit_file.h"
#include "harness/cli/terminal.h"

namespace dexcheck::cli {
namespace {

std::string PaintStatus(const CheckRecord& check) {
  const std::string status = DescribeStatus(check);
  return check.failed ? Paint(Tone::kBad, status) : status == "ok" ? Paint(Tone::kGood, status) : status;
}

/// @param count of the checks that the row stands for; empty for one.
void PrintCheck(const CheckRecord& check, const std::string& count = "") {
  if (!check.applies || check.is_empty) return;
  fmt::print("  {:<17}{:>3} {:<28}", NameOf(check.kind), count, check.name);
  if (!IsReached(check)) {
    fmt::print("{:>8}  {}\n", "-", PaintStatus(check));
    return;
  }
  fmt::print("{:>8.1e}{:>8.0e}  {:<4} {}\n", check.failed ? check.worst : check.residual, check.bound,
             check.unit == "1" ? "" : check.unit, PaintStatus(check));
  if (check.residual > check.bound && !check.failed)
    fmt::print("{:22}with an allowance of {:.1e}\n", "", check.allowance);
  if (check.failed) fmt::print("{:22}from {:.3f} s\n", "", check.failed_at);
}

/// Checks of the model and of the motion that the run has.
std::vector<CheckRecord> ListChecksOf(const ClosedLoop& loop) {
  std::vector<CheckRecord> all;
  for (const std::span<const CheckRecord> records :
       {loop.checks().model_checks(), loop.checks().motion_checks()})
    std::ranges::copy_if(records, std::back_inserter(all), &CheckRecord::applies);
  return all;
}

/// One line for what passes of a category, with the check that came nearest to its bound, and each that
/// fails.
void PrintCategory(CheckCategory kind, const ClosedLoop& loop) {
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
  if (passing.is_asked())
    PrintCheck(passing.nearest, passing.checks == 1 ? "" : std::to_string(passing.checks));
  const bool is_asked =
      passing.is_asked() || !failing.empty();  // contacts of an arm that touches nothing are not
  if (is_asked && passing.not_reached > 0)
    fmt::print("  {:<17}{:>3} not reached\n", NameOf(kind), passing.not_reached);
  for (const CheckRecord& check : failing) PrintCheck(check);
}

void PrintChecks(const Setup& setup, const ClosedLoop& loop, Detail detail) {
  fmt::print("\n  {:<17}    {:<28}{:>8}{:>8}\n", "category",
             detail == Detail::kAll ? "check" : "checks, nearest to its bound", "worst", "bound");
  const auto& constants = setup.constants().records;
  const auto differs = std::ranges::count_if(constants, [](const CheckRecord& r) { return r.failed; });
  fmt::print("  {:<17}{:>3} {:<28}{:>8}{:>8}       {}\n", "model", constants.size(), "constants", differs, 0,
             differs > 0 ? Paint(Tone::kBad, "FAILS") : Paint(Tone::kGood, "ok"));
  if (detail == Detail::kAll) {
    for (const CheckRecord& check : ListChecksOf(loop)) PrintCheck(check);
  } else {
    for (const CheckCategory kind : kCheckCategories) {
      PrintCategory(kind, loop);
    }
    fmt::print("  (--all lists each check)\n");
  }
  const std::span<const CheckRecord> settling = loop.checks().settling_failures();
  if (!settling.empty()) fmt::print("\n  while settling, before t = 0:\n");
  for (const CheckRecord& check : settling) PrintCheck(check);
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
    fmt::print("joints: largest error {:.2e} rad (rms {:.2e})\n", tracking.joints_max(),
               tracking.joints_rms());
    return;
  }
  fmt::print("object: position error {:.2e} m (rms {:.2e}), orientation error {:.2e} rad\n",
             tracking.position_max(), tracking.position_rms(), tracking.orientation_max());
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

/// Prints the causes that explain the residuals, numbered; those that nothing explains last.
void PrintCauses(const Causes& causes) {
  int number = 0;
  for (const Explanation& one : causes)
    fmt::print("{}\n", Wrap(fmt::format("  {}. {}: {}", ++number, NameOf(one.channel), one.Describe()), 5));
  const bool has_class = std::ranges::any_of(
      causes, [](const Explanation& one) { return one.outcome == CauseOutcome::kNamedClass; });
  if (has_class) fmt::print("    (what is not isolable here may be on another motion)\n");
}

}  // namespace

void PrintRunReport(const Setup& setup, const ClosedLoop& loop, const RunResult& result,
                    const std::string& folder, Detail detail) {
  const Scenario& scenario = setup.scenario();
  if (detail != Detail::kVerdict) {
    fmt::print("{}\n", Wrap(scenario.name + ": " + scenario.description, 2));
    fmt::print("{:.3f} of {:.3f} s simulated, {} steps of {} ms\n", loop.time(), scenario.duration,
               loop.record().step, 1e3 * scenario.plant.time_step);
    if (scenario.tolerance > 0.0) fmt::print("judged to a relative tolerance of {:g}\n", scenario.tolerance);
    if (!scenario.imperfections.is_ideal()) {
      for (const std::string& key : scenario.imperfections.declared) fmt::print("declared: {}\n", key);
    }
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
    if (loop.is_checking()) PrintClearance(loop.checks().clearance());
    if (loop.is_checking()) PrintRigidContacts(loop.checks());
    if (loop.is_checking()) PrintChecks(setup, loop, detail);
    PrintSpeed(loop, result);
    if (!folder.empty()) fmt::print("log and summary in {}\n", folder);
    fmt::print("\n");
  }
  switch (result.verdict) {
    case Verdict::kPass:
      fmt::print("{}: {}\n", Paint(Tone::kGood, "PASS"),
                 loop.is_checking() ? DescribeWhatHolds(ListChecksOf(loop)) +
                                          (scenario.imperfections.is_ideal()
                                               ? "."
                                               : ",\nwith what the scenario asks of the plant counted in.")
                                    : "the run completed; nothing was checked.");
      return;
    case Verdict::kFailed:
      PrintVerdict(Tone::kBad, "FAILED", ": " + result.failure + ".");
      break;
    case Verdict::kDisagreement:
      PrintVerdict(Tone::kBad, "DISAGREEMENT",
                   fmt::format(": {}.", DescribeCause(NameOf(result.attribution.cause))));
      break;
  }
  if (result.attribution.cause == Cause::kNone) return;
  PrintCauses(result.causes);
  fmt::print("{}\n", Wrap("  evidence: " + result.attribution.evidence, 5));
  for (const ConstantFinding& finding : setup.constants().findings) {
    fmt::print("  {}: {}: {:.12g} in the model, {:.12g} in the MJCF\n", finding.check, finding.where,
               finding.model, finding.engine);
  }
  const std::vector<ConstantFinding>& findings = setup.constants().findings;
  const bool has_servos = std::ranges::any_of(
      findings, [](const ConstantFinding& finding) { return finding.check.starts_with("motor_"); });
  if (has_servos)
    fmt::print(
        "  A run sends torques: each actuator must be a <motor> of gear 1, not a servo or a muscle; dexcheck "
        "import "
        "FILE.xml --motors --out COPY.xml writes such a copy.\n");
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
