#pragma once

// A run that goes on in a thread of its own, at the pace that the window requests.

#include <condition_variable>
#include <deque>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "harness/run/run_recorder.h"
#include "harness/run/runner.h"
#include "harness/scenario/scenario.h"
#include "harness/view/controls.h"
#include "harness/view/frame_source.h"

namespace dexcheck {

/// A force with which the mouse pulls at a body.
struct MouseForce {
  std::string body;                   ///< A link, or "object".
  Vector3d at = Vector3d::Zero();     ///< Where, in its frame, m.
  Vector3d force = Vector3d::Zero();  ///< World, N.
};

/// The same loop as `dexcheck run`. Undisturbed it makes the same numbers, however often it is paused; forces
/// of the mouse become disturbances that the checks know, constant for a while each.
class LiveRun : public FrameSource {
 public:
  /// How long a force stays as it is, s; the loop's step where that is longer.
  static constexpr double kForceTime = 0.02;

  /// Starts. @param log file to record to; empty for none. @param speed of simulated against real time.
  /// @throws InputError as ClosedLoop and RunRecorder.
  LiveRun(std::unique_ptr<Setup> setup, const RunInputs& inputs, const std::filesystem::path& log,
          double speed);
  /// Ends it where it is.
  ~LiveRun() override;

  /// With its looks, which the loop steps without: the same bodies and positions.
  [[nodiscard]] const mjModel& model() const override { return *looks_; }
  [[nodiscard]] long rows() const override;
  [[nodiscard]] double TimeAt(long row) const override;
  [[nodiscard]] double end() const override { return setup_->scenario().duration; }
  [[nodiscard]] ViewFrame Read(long row) const override;
  [[nodiscard]] const Setup& setup() const { return *setup_; }

  void SetPaused(bool paused);
  /// One step while paused.
  void Advance();
  void SetSpeed(double speed);
  /// From now on; none lets go.
  void SetForce(const std::optional<MouseForce>& pull);
  /// Ends the run where it is, if it is still going on, and waits for it. @throws what the input is wrong
  /// with.
  void Finish();
  [[nodiscard]] bool is_finished() const;

  [[nodiscard]] bool was_disturbed() const;
  /// Once finished.
  [[nodiscard]] const Runner& runner() const { return *runner_; }
  /// The scenario's overrides and the mouse's forces so far, each as an assignment that a scenario takes.
  [[nodiscard]] std::vector<std::string> ListOverrides() const;

 private:
  void Run();
  /// Before a step: waits until it is due. @returns whether to stop.
  bool Wait();
  void Record(const StepRecord& step);
  void Disturb();
  /// Changes what the run waits for.
  void Change(const std::function<void()>& change);

  std::unique_ptr<Setup> setup_;
  MjModelPtr looks_;
  std::unique_ptr<Runner> runner_;
  std::optional<RunRecorder> recorder_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<ViewFrame> frames_;
  bool paused_ = false;
  bool quit_ = false;
  bool finished_ = false;
  long granted_ = 0;  // single steps
  double speed_;
  std::optional<MouseForce> force_;
  double held_until_ = 0.0;
  std::vector<std::string> forces_;
  std::exception_ptr problem_;
  std::chrono::steady_clock::time_point due_;
  bool is_paced_ = false;  // due_ means something
  std::thread thread_;
};

// The sliders of a live run: factors of a scenario's gains.

/// Of K_p, K_v and, where an object is held, f_min, each at the scenario's own.
std::vector<Slider> MakeGainSliders(const Scenario& scenario);

/// Assignments that multiply a scenario's gains. @param sliders as MakeGainSliders made them, moved since.
std::vector<std::string> MakeGainOverrides(const Scenario& scenario, const std::vector<Slider>& sliders);

/// A scenario as a file that stands anywhere: its text with assignments made in it, files with their whole
/// paths, and a name of its own.
/// @throws InputError when the assignments do not fit.
std::string MakeScenarioText(const Scenario& scenario, const std::vector<std::string>& overrides,
                             const std::string& name);

}  // namespace dexcheck
