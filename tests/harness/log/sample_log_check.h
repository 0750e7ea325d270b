#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <iterator>

#include "harness/log/log_reader.h"
#include "tests/common/files.h"
#include "tests/harness/log/sample_log.h"

namespace dexcheck::testing {

/// A folder for one log.
class LogFileTest : public ::testing::Test {
 protected:
  [[nodiscard]] long CountFiles() const {
    const auto files = std::filesystem::directory_iterator(folder_.path());
    return std::distance(begin(files), end(files));
  }

  TempFolder folder_;
  std::filesystem::path path_ = folder_.path() / "log.h5";
};

/// Success when the log is the sample with this many rows: every number and all that comes with them.
inline ::testing::AssertionResult IsSample(const LogReader& log, long rows) {
  if (log.rows() != rows) {
    return ::testing::AssertionFailure() << log.rows() << " rows instead of " << rows;
  }
  const std::vector<SignalInfo>& signals = log.signals();
  if (signals.size() != kSampleSignals + 1) return ::testing::AssertionFailure() << "wrong signals";
  for (int signal = 0; signal <= kSampleSignals; ++signal) {
    const SignalInfo& info = signals[static_cast<size_t>(signal)];
    const RowMatrixXd numbers = log.ReadSignal(info.name);
    const int width = signal == 0 ? 1 : kSampleWidths[signal - 1];
    if (numbers.rows() != rows || numbers.cols() != width || info.width != width) {
      return ::testing::AssertionFailure() << info.name << ": wrong shape";
    }
    for (long row = 0; row < rows; ++row) {
      for (int k = 0; k < width; ++k) {
        const double expected =
            signal == 0 ? kTimeStep * static_cast<double>(row) : SampleNumber(row, signal, k);
        if (numbers(row, k) == expected) continue;
        return ::testing::AssertionFailure() << info.name << "(" << row << ", " << k
                                             << "): " << numbers(row, k) << " instead of " << expected;
      }
    }
  }
  if (log.ReadText("scenario") != kSampleText) return ::testing::AssertionFailure() << "wrong text";
  if (log.ReadFile("inputs", "mjcf/assets/torus.msh") != kSampleBytes) {
    return ::testing::AssertionFailure() << "wrong bytes";
  }
  return ::testing::AssertionSuccess();
}

}  // namespace dexcheck::testing
