#pragma once

// What the window shows: a recorded run, or one that is going on.

#include <mujoco/mujoco.h>

#include <filesystem>
#include <memory>
#include <vector>

#include "harness/base/check_record.h"
#include "harness/report/run_data.h"
#include "renders/run_frames.h"

namespace dexcheck {

/// One instant.
struct ViewFrame {
  std::shared_ptr<const RunFrames> run;
  long row = 0;                            ///< Of it.
  std::vector<CategoryStatus> categories;  ///< Up to this instant.
  VectorXd q;                              ///< Of a live run: q' of the robot, and
  Pose X_Bo = Pose::Identity();            ///< the object.
};

/// Instants of a run by number. For several threads.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;

  [[nodiscard]] virtual const mjModel& model() const = 0;
  /// So far.
  [[nodiscard]] virtual long rows() const = 0;
  [[nodiscard]] virtual double TimeAt(long row) const = 0;
  /// Time of the last row that there will be, s.
  [[nodiscard]] virtual double end() const = 0;
  [[nodiscard]] virtual ViewFrame Read(long row) const = 0;

 protected:
  FrameSource() = default;
};

/// A recorded run.
class RecordedFrameSource : public FrameSource {
 public:
  /// @throws InputError as ReadRecordedFrames.
  explicit RecordedFrameSource(const std::filesystem::path& run_dir)
      : run_(ReadRecordedFrames(run_dir)),
        frames_(std::make_shared<RunFrames>(std::move(run_.frames))),
        checks_(*frames_) {}

  [[nodiscard]] const mjModel& model() const override { return *run_.model; }
  [[nodiscard]] long rows() const override { return frames_->rows(); }
  [[nodiscard]] double TimeAt(long row) const override { return frames_->times[static_cast<size_t>(row)]; }
  [[nodiscard]] double end() const override { return frames_->times.back(); }
  [[nodiscard]] ViewFrame Read(long row) const override {
    return {.run = frames_, .row = row, .categories = checks_.ListCategories(row)};
  }

 private:
  RecordedFrames run_;  // but for its frames
  std::shared_ptr<const RunFrames> frames_;
  CheckHistory checks_;
};

}  // namespace dexcheck
