#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>

#include "controller/common/text.h"
#include "harness/run/own_controller.h"
#include "harness/run/run_summary.h"

namespace dexcheck {

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
    Guard([&] { loop_.Finish(); }, /*settling=*/false);
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
