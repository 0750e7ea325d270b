#pragma once

// A small log whose every number follows from its place, so that any part of it can be checked.

#include <filesystem>
#include <string>

#include "harness/log/log_writer.h"

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

/// A whole log.
inline void WriteSampleLog(const std::filesystem::path& path, long rows, long max_rows) {
  LogWriter log(path, max_rows, 7);
  StartSample(&log);
  WriteSampleRows(rows, &log);
  log.Close();
}

}  // namespace dexcheck::testing
