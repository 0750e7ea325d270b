#pragma once

#include <filesystem>

#include "harness/report/recorded_frames.h"
#include "harness/view/frame_source.h"

namespace dexcheck {

/// A recorded run.
class Recording : public FrameSource {
 public:
  /// @throws InputError as ReadRecordedFrames.
  explicit Recording(const std::filesystem::path& run_dir);

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
