#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/text.h"
#include "harness/base/answer.h"
#include "harness/diagnosis/attribution.h"
#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/run_causes.h"
#include "harness/run/closed_loop.h"
#include "harness/run/own_controller.h"
#include "harness/run/sampled_loop.h"

namespace dexcheck {

// Summary of a run: verdict, tracking, checks, attribution, speed.

enum class Verdict { kPass, kDisagreement, kFailed };

/// "pass", "disagreement", "failed".
const char* NameOf(Verdict verdict);

/// Statistics of an error over the steps of a run.
struct ErrorStatistics {
  double max = 0.0;
  double squares = 0.0;  ///< Their sum.
  long count = 0;

  void Add(double size, double square);
  [[nodiscard]] double rms() const;
};

/// Statistics of the tracking errors.
struct TrackingStatistics {
  ErrorStatistics position;     ///< Of the object, m.
  ErrorStatistics orientation;  ///< rad.
  ErrorStatistics joints;       ///< Of the joint that is farthest off, rad or m.
  VectorXd of_joints;           ///< Largest of each joint that follows a motion, rad or m.

  void Add(const TrackingError& error);
};

/// Torque that a motor's limit cut off.
struct LimitedTorque {
  double time = 0.0;   ///< Total duration, s.
  double first = 0.0;  ///< Time of its beginning, s.
  double most = 0.0;   ///< N m, N.
};

/// A finished run, or a run up to its failure.
struct RunResult {
  Verdict verdict = Verdict::kPass;
  std::string failure;             ///< Reason of an early end; empty when there was none.
  bool interrupted = false;        ///< Whether the user ended the run.
  bool grasp_lost = false;         ///< Whether it ended because a fingertip left the object.
  bool controller_failed = false;  ///< Whether it ended because a controller of the user's own failed.
  TrackingStatistics tracking;
  double peak_effort = 0.0;             ///< Largest |tau'| sent over its motor's limit.
  std::string busiest_motor;            ///< Motor with that effort.
  std::vector<LimitedTorque> limited;   ///< By entry of tau'; empty where torques arrive as they are sent.
  std::optional<JointMargins> margins;  ///< Margins of a motion of joints, after JudgeGains.
  std::string gain_card;                ///< Gains as TOML, after JudgeGains.
  AttributionResult attribution;
  Causes causes;  ///< Causes that explain the residuals, and the facts that checks observed.
  double recording_seconds = 0.0;
  double wall_seconds = 0.0;  ///< Time of all steps, recording included.
};

/// Adds a step of dt (s).
void AddLimits(const StepRecord& step, double dt, std::vector<LimitedTorque>* limited);

/// Sets the verdict and its attribution. Call when the last step is done.
void Judge(const Setup& setup, const ClosedLoop& loop, const SearchOptions& search, RunResult* result);

/// Returns the summary with the keys that README.md lists for summary.json; lengths m, angles rad.
nlohmann::ordered_json MakeSummary(const Setup& setup, const ClosedLoop& loop, const RunResult& result);

/// Returns a run's verdict with its causes, numbered in the order of the summary, and the evidence.
/// @param summary as summary.json has it, of this or an older version. @param checks all that were made; none
/// of a run that was not checked.
Answer MakeRunAnswer(const nlohmann::ordered_json& summary, std::span<const CheckRecord> checks);

/// One run from the first contact to its verdict. Errors of the simulation end the run and become part of the
/// result; errors of the input are thrown.
class Runner {
 public:
  /// @throws InputError as ClosedLoop.
  Runner(const Setup& setup, bool check) : setup_(&setup), loop_(setup, check) {}
  /// Makes a run with other parts than the scenario's own.
  Runner(const Setup& setup, bool check, LoopParts parts)
      : setup_(&setup), search_(parts.search), loop_(setup, check, std::move(parts)) {}

  [[nodiscard]] const ClosedLoop& loop() const { return loop_; }
  [[nodiscard]] const RunResult& result() const { return result_; }

  /// Settles, steps to the end or to a failure, and judges.
  /// @param after_step called with each step's record once its checks are made (ClosedLoop::SetObserver),
  /// also after one that failed; its time counts as recording.
  /// @param should_stop asked before each step, of settling too; true ends the run as interrupted.
  template <typename AfterStep, typename ShouldStop>
  const RunResult& Run(const AfterStep& after_step, const ShouldStop& should_stop) {
    Guard(
        [&] {
          if (!loop_.Settle(should_stop)) Interrupt();
        },
        /*settling=*/true);
    loop_.SetObserver([&](const StepRecord& step) {
      if (step.command.tracks || step.command.joints.q.size() > 0) result_.tracking.Add(step.error);
      const VectorXd& q_d = step.command.joints.q;
      if (q_d.size() > 0 && result_.tracking.of_joints.size() != q_d.size())
        result_.tracking.of_joints = VectorXd::Zero(q_d.size());
      if (q_d.size() > 0)
        result_.tracking.of_joints =
            result_.tracking.of_joints.cwiseMax((q_d - step.reading.state.q.tail(q_d.size())).cwiseAbs());
      if (step.drive.effort > result_.peak_effort) {
        result_.peak_effort = step.drive.effort;
        result_.busiest_motor = loop_.motors()[static_cast<size_t>(step.drive.busiest_motor)].name;
      }
      AddLimits(step, setup_->scenario().plant.time_step, &result_.limited);
      const Clock::time_point recording = Clock::now();
      after_step(step);
      result_.recording_seconds += SecondsSince(recording);
    });
    const Clock::time_point begin = Clock::now();
    while (result_.failure.empty() && !loop_.is_finished()) {
      if (should_stop()) {
        Interrupt();
        break;
      }
      Guard([&] { loop_.Step(); }, /*settling=*/false);
    }
    result_.wall_seconds = SecondsSince(begin);
    Judge(*setup_, loop_, search_, &result_);
    return result_;
  }

 private:
  using Clock = std::chrono::steady_clock;
  static double SecondsSince(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  }

  void Interrupt() {
    result_.interrupted = true;
    result_.failure = "interrupted";
  }

  void EndBy(const std::exception& error, bool settling) {
    result_.failure = error.what() + (settling ? std::string(" while settling")
                                               : " at t = " + FormatNumber(loop_.record().time, 6) + " s");
  }

  template <typename Work>
  void Guard(const Work& work, bool settling) {
    try {
      work();
    } catch (const InputError&) {
      throw;
    } catch (const Error& error) {
      result_.controller_failed = dynamic_cast<const ControllerFailure*>(&error) != nullptr;
      result_.grasp_lost = dynamic_cast<const GraspLost*>(&error) != nullptr;
      EndBy(error, settling);
    } catch (const std::invalid_argument& error) {
      EndBy(error, settling);  // a number of the plant is not a number
    }
  }

  const Setup* setup_;
  SearchOptions search_;
  ClosedLoop loop_;
  RunResult result_;
};

/// Repeats the run without the declared imperfections of the plant, up to the time of the check's worst
/// value, at most for 10 s, when nothing but an expectation, or the error's own dynamics, fails. The
/// imperfections are the cause where they explain half of the error or more, and the evidence says how much.
/// A scenario with a controller of the user's own is not repeated.
/// @param setup, loop, result of the run, which is judged. @param robot, mjcf its files. @param should_stop
/// asked before each step; a stopped repetition adds nothing.
void WeighDeclared(const Setup& setup, const ClosedLoop& loop, const std::filesystem::path& robot,
                   const std::filesystem::path& mjcf, const std::function<bool()>& should_stop,
                   RunResult* result);

}  // namespace dexcheck
