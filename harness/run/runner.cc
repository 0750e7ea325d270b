#include "harness/run/runner.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "controller/common/text.h"
#include "harness/base/bounded_json.h"
#include "harness/base/check_record.h"
#include "harness/base/interrupts.h"
#include "harness/base/version.h"
#include "harness/checks/check_table.h"
#include "harness/checks/failure_cause.h"
#include "harness/engine/machine.h"

namespace dexcheck {

namespace {

using Json = nlohmann::ordered_json;

constexpr double kNoError = 1e-14;  // rad or m, which no gain makes a torque of

/// Converts the object's tracking statistics.
Json TrackingToJson(const TrackingStatistics& tracking) {
  return {{"position_error_max_m", tracking.position.max},
          {"position_error_rms_m", tracking.position.rms()},
          {"orientation_error_max_rad", tracking.orientation.max},
          {"orientation_error_rms_rad", tracking.orientation.rms()}};
}

Json TaskToJson(const ClosedLoop& loop) {
  const PickAndPlace& task = loop.task()->task();
  Json json = {{"done", task.is_done()},
               {"attempts", task.history().empty() ? 0 : task.history().back().attempt},
               {"first_failure", task.first_failure()},
               {"weighed", task.scale()},
               {"push_m", task.push()},
               {"torque_jump_max_N_m", loop.task()->torque_jump()},
               {"force_closure_margin", task.plan().margin},
               {"phases", Json::array()}};
  for (const PhaseEntry& entry : task.history()) {
    json["phases"].push_back(
        {{"phase", NameOf(entry.phase)}, {"begin_s", entry.time}, {"attempt", entry.attempt}});
  }
  return json;
}

/// Lists the smallest distance of each class of pairs, with bodies and time.
Json ClearanceToJson(const Clearance& clearance) {
  Json json = Json::object();
  for (int i = 0; i < kPairClassCount; ++i) {
    const auto pairs = static_cast<PairClass>(i);
    const Clearance::Nearest& nearest = clearance.nearest(pairs);
    if (nearest.pair < 0) continue;
    json[NameOf(pairs)] = {{"smallest_m", nearest.distance},
                           {"bodies", clearance.Describe(nearest.pair)},
                           {"at_time_s", nearest.time}};
  }
  return json;
}

/// Motors whose torque was cut off.
Json LimitsToJson(std::span<const Motor> motors, const std::vector<LimitedTorque>& limited) {
  Json json = Json::array();
  for (size_t i = 0; i < limited.size(); ++i) {
    if (limited[i].time == 0.0) continue;
    json.push_back({{"motor", motors[i].name},
                    {"time_s", limited[i].time},
                    {"first_s", limited[i].first},
                    {"most_N_m", limited[i].most}});
  }
  return json;
}

Json ToJson(const StabilityMargins& margins) {
  return {{"gain", margins.gain},
          {"least_gain", margins.least_gain},
          {"phase_rad", margins.phase},
          {"delay_s", margins.delay}};
}

Json ToJson(const JointMargins& margins) {
  Json json = {{"spectral_radius", margins.radius}};
  if (!margins.is_stable()) return json;
  json["one_torque"] = ToJson(margins.least);
  json["one_torque"]["joints"] = {margins.gain_joint, margins.phase_joint, margins.delay_joint};
  json["all_torques"] = ToJson(margins.together);
  return json;
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

/// The checks of the motion. Those that always hold stand first if they failed while everything settled and
/// not since: how the run began follows from that.
std::vector<CheckRecord> ListJudged(const RunChecks& checks) {
  std::vector<CheckRecord> judged;
  const auto fails = [](const CheckRecord& check) { return check.failed && HoldsAlways(check); };
  if (std::ranges::none_of(checks.motion_checks(), fails))
    std::ranges::copy_if(checks.settling_failures(), std::back_inserter(judged), HoldsAlways);
  std::ranges::copy(checks.motion_checks(), std::back_inserter(judged));
  return judged;
}

/// Returns whether a motor is one that a run cannot drive.
bool HasServos(const Json& checks) {
  for (const auto& [name, check] : checks.items())
    if (name.starts_with("motor_") && check.is_object() && !check.value("pass", true)) return true;
  return false;
}

}  // namespace

const char* NameOf(Verdict verdict) {
  if (verdict == Verdict::kPass) return "pass";
  return verdict == Verdict::kDisagreement ? "disagreement" : "failed";
}

void ErrorStatistics::Add(double size, double square) {
  max = Worst(max, size);
  squares += square;
  ++count;
}

double ErrorStatistics::rms() const {
  return count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0.0;
}

void TrackingStatistics::Add(const TrackingError& error) {
  position.Add(error.position.norm(), error.position.squaredNorm());
  orientation.Add(error.orientation, error.orientation * error.orientation);
  joints.Add(error.joints, error.joints * error.joints);
}

void AddLimits(const StepRecord& step, double dt, std::vector<LimitedTorque>* limited) {
  const VectorXd& cut = step.drive.cut;
  limited->resize(static_cast<size_t>(cut.size()));
  for (size_t i = 0; i < limited->size(); ++i) {
    const double off = std::abs(cut[static_cast<Eigen::Index>(i)]);
    if (off == 0.0) continue;
    LimitedTorque& one = (*limited)[i];
    if (one.time == 0.0) one.first = step.time;
    one.time += dt;
    one.most = std::max(one.most, off);
  }
}

void Judge(const Setup& setup, const ClosedLoop& loop, const SearchOptions& search, RunResult* result) {
  if (loop.is_checking()) {
    const std::vector<CheckRecord> steps = ListJudged(loop.checks());
    const bool is_before = steps.size() > loop.checks().motion_checks().size();
    // A run that ends while everything settles has these steps in its own store.
    const StepStore* const before = is_before ? loop.settling_store() : nullptr;
    bool stopped = false;
    const auto has_failed = [](const CheckRecord& check) { return check.failed; };
    const auto is_mismeasured = [](const CheckRecord& check) {
      return check.failed && check.name == "measurement";
    };
    SearchOptions options = search;
    options.model_fails = std::ranges::any_of(loop.checks().model_checks(), has_failed) &&
                          std::ranges::none_of(steps, is_mismeasured);
    result->causes =
        ExplainRun(before != nullptr ? *before : loop.store(), FindVoid(steps), options, &stopped);
    result->attribution = Attribute(setup.constants(), loop.checks().model_checks(), steps,
                                    loop.checks().context(), &result->causes);
    if (stopped && result->attribution.cause != Cause::kNone)
      result->attribution.evidence +=
          "; the search for causes was stopped " +
          (IsInterrupted() && !result->interrupted
               ? "by hand"
               : "after " + FormatNumber(search.seconds) + " s of processor time");
  }
  const bool disagrees = result->attribution.cause != Cause::kNone;
  result->verdict = disagrees ? Verdict::kDisagreement : Verdict::kPass;
  if (!result->failure.empty()) result->verdict = Verdict::kFailed;
}

Json MakeSummary(const Setup& setup, const ClosedLoop& loop, const RunResult& result) {
  const Scenario& scenario = setup.scenario();
  Json json = {{"scenario", scenario.name},         {"description", scenario.description},
               {"verdict", NameOf(result.verdict)}, {"failure", result.failure},
               {"interrupted", result.interrupted}, {"seed", scenario.seed},
               {"overrides", scenario.overrides},   {"duration_s", scenario.duration},
               {"simulated_s", loop.time()},        {"time_step_s", scenario.plant.time_step}};
  if (scenario.joint_task() != nullptr) {
    json["tracking"] = {{"joint_error_max_rad", result.tracking.joints.max},
                        {"joint_error_rms_rad", result.tracking.joints.rms()}};
    for (Eigen::Index i = 0; i < result.tracking.of_joints.size() && scenario.controller.exists(); ++i) {
      if (result.tracking.of_joints[i] <= kNoError)
        json["tracking"]["joints_without_error"].push_back(setup.model().joint(static_cast<int>(i)).name);
    }
  } else {
    json["tracking"] = TrackingToJson(result.tracking);
  }
  if (scenario.control.kappa == ContactSource::kIntegrated) {
    const ContactDrift& drift = loop.largest_drift();
    json["contact_drift"] = {
        {"object_max_m", drift.object}, {"fingertip_max_m", drift.fingertip}, {"psi_max_rad", drift.psi}};
  }
  if (loop.task() != nullptr) json["task"] = TaskToJson(loop);
  if (!scenario.imperfections.is_ideal()) json["plant_declared"] = scenario.imperfections.declared;
  if (result.margins) json["margins"] = ToJson(*result.margins);
  if (!result.gain_card.empty()) json["gain_card"] = result.gain_card;
  if (scenario.imperfections.actuation.saturates())
    json["torque_limited"] = LimitsToJson(loop.motors(), result.limited);
  json["attribution"] = {{"cause", NameOf(result.attribution.cause)},
                         {"evidence", result.attribution.evidence},
                         {"checks", Json::object()}};
  for (const Attribution& one : result.attribution.attributions) {
    json["attribution"]["checks"][one.check] = NameOf(one.cause);
  }
  json["causes"] = Json::array();
  for (const Explanation& one : result.causes) json["causes"].push_back(ToJson(one));
  json["checks"] = Json::object();
  if (loop.is_checking()) {
    for (const CheckRecord& record : setup.constants().records)
      json["checks"][record.name] = ToJson(record, /*timed=*/false);
    for (const std::span<const CheckRecord> checks :
         {loop.checks().model_checks(), loop.checks().motion_checks()}) {
      for (const CheckRecord& check : checks) {
        if (check.applies) json["checks"][check.name] = ToJson(check, /*timed=*/true);
      }
    }
    json["settling"] = Json::object();
    for (const CheckRecord& check : loop.checks().settling_failures())
      json["settling"][check.name] = ToJson(check, /*timed=*/true);
    const StepFindings& findings = loop.checks().analysis().findings;
    const auto worst = [&](const char* name) -> Json {
      if (!loop.checks().Has(name)) return 0.0;
      const CheckRecord& check = loop.checks().Find(name);
      return IsReached(check) ? Json(check.worst) : Json();
    };
    json["assumptions"] = {{"fingertip_slip_max_m", worst("fingertip_slip")},
                           {"wheel_slip_max_m", worst("wheel_slip")},
                           {"base_tilt_max_rad", worst("base_tilt")},
                           {"cone_margin_min", findings.least_cone_margin},
                           {"contacts_lost", findings.contacts_lost}};
  }
  if (loop.is_checking()) json["clearance"] = ClearanceToJson(loop.checks().clearance());
  const LoopTimes& times = loop.times();
  const double steps = static_cast<double>(std::max(loop.record().step, 1L));
  const double microseconds = 1e6 / steps;
  json["speed"] = {{"steps", loop.record().step},
                   {"real_time_factor", result.wall_seconds > 0.0 ? loop.time() / result.wall_seconds : 0.0},
                   {"plant_us_per_step", microseconds * times.plant},
                   {"controller_us_per_step", microseconds * times.controller},
                   {"cross_check_us_per_step", microseconds * times.cross_check},
                   {"grasp_force_us_per_solve",
                    times.solves > 0 ? 1e6 * times.grasp_force / static_cast<double>(times.solves) : 0.0},
                   {"recording_us_per_step", microseconds * result.recording_seconds}};
  json["versions"] = {{"dexcheck", Version()}, {"mujoco", mj_versionString()}};
  json["machine"] = DescribeMachine();
  return json;
}

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
    const Json::json_pointer idle("/tracking/joints_without_error");
    if (summary.contains(idle))
      answer.remarks.push_back("not tested: gains of " +
                               JoinNames(summary[idle].get<std::vector<std::string>>()) +
                               ", whose error stayed 0");
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

namespace {

/// Returns the check's value in another scenario; none where that cannot be run.
std::optional<double> Repeat(const Scenario& scenario, const std::string& check,
                             const std::filesystem::path& robot, const std::filesystem::path& mjcf,
                             const std::function<bool()>& should_stop) {
  try {
    const Setup setup(scenario, robot, mjcf);
    Runner runner(setup, /*check=*/true);
    const RunResult& repeated = runner.Run([](const StepRecord&) {}, should_stop);
    if (!repeated.failure.empty() || !runner.loop().checks().Has(check)) return std::nullopt;
    return runner.loop().checks().Find(check).worst;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

/// Sets the cause of the run, and of failures that have none of their own.
void SetCause(Cause cause, RunResult* result) {
  for (Attribution& one : result->attribution.attributions)
    if (one.cause == result->attribution.cause) one.cause = cause;
  result->attribution.cause = cause;
  result->causes.front().faults.front().fault = NameOf(cause);
}

}  // namespace

void WeighDeclared(const Setup& setup, const ClosedLoop& loop, const std::filesystem::path& robot,
                   const std::filesystem::path& mjcf, const std::function<bool()>& should_stop,
                   RunResult* result) {
  constexpr double kLongest = 10.0;  // s
  const Scenario& scenario = setup.scenario();
  if (scenario.imperfections.declared.empty() || scenario.controller.exists()) return;
  AttributionResult& attribution = result->attribution;
  const CheckInfo* const info = FindCheck(attribution.check);
  if (!loop.is_checking() || info == nullptr || info->meaning.rank != Rank::kResidual) return;
  const CheckRecord& check = loop.checks().Find(attribution.check);
  if (!std::isfinite(check.worst)) return;
  Scenario ideal = scenario;
  ideal.duration = (check.at <= kLongest ? check.at : check.failed_at) + scenario.plant.time_step;
  if (ideal.duration > kLongest) return;
  ideal.imperfections = {};
  const std::optional<double> without = Repeat(ideal, attribution.check, robot, mjcf, should_stop);
  if (!without) return;
  const double explained = std::max(0.0, 1.0 - *without / check.worst);
  constexpr double kMost = 0.5;
  if (explained >= kMost) SetCause(Cause::kDeclared, result);
  attribution.evidence += "; without what the scenario declares (" +
                          Abbreviate(fmt::format("{}", fmt::join(scenario.imperfections.declared, ", "))) +
                          ") it is " + FormatNumber(*without, 3) + " " + check.unit + ": that explains " +
                          FormatNumber(100.0 * explained, 3) + " % of the error";
}

}  // namespace dexcheck
