#pragma once

// What the window shows: a recorded run, or one that is going on.

#include <mujoco/mujoco.h>

#include <filesystem>
#include <vector>

#include "harness/base/check_record.h"
#include "harness/report/recorded_frames.h"
#include "renders/run_frames.h"

namespace dexcheck {

/// One instant.
struct ViewFrame {
  RunFrames frame;                         ///< One row.
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
  explicit RecordedFrameSource(const std::filesystem::path& run_dir);

  [[nodiscard]] const mjModel& model() const override { return *run_.model; }
  [[nodiscard]] long rows() const override { return run_.frames.rows(); }
  [[nodiscard]] double TimeAt(long row) const override { return run_.frames.times[static_cast<size_t>(row)]; }
  [[nodiscard]] double end() const override { return run_.frames.times.back(); }
  [[nodiscard]] ViewFrame Read(long row) const override;

 private:
  RecordedFrames run_;
  CheckHistory checks_;
};

}  // namespace dexcheck
