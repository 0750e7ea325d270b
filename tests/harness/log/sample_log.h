#pragma once

// A small log whose every number follows from its place, so that any part of it can be checked.

#include <gtest/gtest.h>

#include <filesystem>
#include <iterator>
#include <string>

#include "harness/log/log_reader.h"
#include "harness/log/log_writer.h"
#include "tests/common/files.h"

namespace dexcheck::testing {

inline constexpr int kSampleSignals = 3;  ///< Besides time.
inline constexpr double kTimeStep = 1e-3;

/// Row `row` of number `k` of signal `signal` (1 to kSampleSignals).
inline double SampleNumber(long row, int signal, int k) {
  return static_cast<double>(row) + 1e-3 * k + 0.1 * signal + 1.0 / 3.0;
}

inline const std::string kSampleText = "zeile \xc3\xa4\nname = \"x\"\n";
inline const std::string kSampleBytes("\x00\x01\xff\r\n\x00", 6);

/// Adds the signals, a text and files, and starts the rows.
inline void StartSample(LogWriter* log) {
  log->AddSignal({"object/X_o",
                  "m, m, m, rad, rad, rad",
                  "Pose of the object",
                  6,
                  {"x", "y", "z", "phi", "theta", "psi"},
                  {}});
  log->AddSignal({"check/M_bar", "1", "Worst error of M_bar", 1, {}, {{"bound", 1e-10}, {"kind", 2.0}}});
  log->AddSignal({"contact/force", "N", "Forces, fingertip by fingertip", 4, {}, {}});
  log->SetText("scenario", kSampleText);
  log->SetText("empty", "");
  log->EmbedFile("inputs", "mjcf/assets/torus.msh", kSampleBytes);
  log->EmbedFile("inputs", "scenario.toml", kSampleText);
  log->EmbedFile("inputs", "empty", "");
  log->StartRows();
}

inline constexpr int kSampleWidths[kSampleSignals] = {6, 1, 4};

/// Writes the next row.
inline void WriteSampleRow(LogWriter* log) {
  const long row = log->rows();
  log->Row(LogWriter::kTime)[0] = kTimeStep * static_cast<double>(row);
  for (int signal = 1; signal <= kSampleSignals; ++signal) {
    const std::span<double> numbers = log->Row(signal);
    for (int k = 0; k < kSampleWidths[signal - 1]; ++k) {
      numbers[static_cast<size_t>(k)] = SampleNumber(row, signal, k);
    }
  }
  log->EndRow();
}

inline void WriteSampleRows(long rows, LogWriter* log) {
  for (long row = 0; row < rows; ++row) WriteSampleRow(log);
}

/// A log with so many rows.
class SampleLog : public LogWriter {
 public:
  SampleLog(const std::filesystem::path& path, long max_rows, long rows_per_flush, long rows = 0)
      : LogWriter(path, max_rows, rows_per_flush) {
    StartSample(this);
    WriteSampleRows(rows, this);
  }
};

/// A whole log.
inline void WriteSampleLog(const std::filesystem::path& path, long rows, long max_rows) {
  SampleLog(path, max_rows, 7, rows).Close();
}

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
