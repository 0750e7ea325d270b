// What recording costs: a run's rows through LogWriter, beside memcpy and write of the same bytes. One
// iteration is one whole run of 10000 rows of 900 numbers in 60 signals; "per_row" is the figure to read.

#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <unistd.h>

#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/log/log_reader.h"
#include "harness/log/log_writer.h"
#include "tests/common/files.h"

namespace dexcheck {
namespace {

constexpr long kRows = 10000;
constexpr int kSignals = 60;
constexpr int kWidth = 15;
constexpr size_t kRowNumbers = size_t{kSignals} * kWidth;

void ReportPerRow(benchmark::State& state) {
  using benchmark::Counter;
  state.counters["per_row"] =
      Counter(static_cast<double>(kRows), Counter::kIsIterationInvariantRate | Counter::kInvert);
}

void AddSignals(LogWriter* log) {
  for (int i = 0; i < kSignals; ++i) {
    log->AddSignal({"group/signal_" + std::to_string(i), "m", "A signal", kWidth, {}, {}});
  }
}

void WriteRows(const std::vector<double>& row, LogWriter* log) {
  log->StartRows();
  for (long i = 0; i < kRows; ++i) {
    log->Row(LogWriter::kTime)[0] = 1e-3 * static_cast<double>(i);
    for (int k = 1; k <= kSignals; ++k) {
      std::memcpy(log->Row(k).data(), row.data() + (k - 1) * kWidth, kWidth * sizeof(double));
    }
    log->EndRow();
  }
}

/// Everything, from the file's creation to its end. For a late text Close writes the whole file anew.
void Record(benchmark::State& state) {
  const testing::TempFolder folder;
  const std::vector<double> row(kRowNumbers, 1.5);
  const bool has_summary = state.range(1) != 0;
  for (auto _ : state) {
    LogWriter log(folder.path() / "log.h5", kRows, state.range(0));
    AddSignals(&log);
    WriteRows(row, &log);
    if (has_summary) log.SetText("summary", std::string(10000, 'x'));
    log.Close();
    state.PauseTiming();
    std::filesystem::remove(folder.path() / "log.h5");
    state.ResumeTiming();
  }
  ReportPerRow(state);
}
BENCHMARK(Record)
    ->ArgNames({"rows_per_flush", "late_text"})
    ->Args({10, 0})
    ->Args({100, 0})
    ->Args({1000, 0})
    ->Args({100, 1})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// The same bytes, row by row into a buffer, and the buffer to a file.
void CopyAndWrite(benchmark::State& state) {
  const testing::TempFolder folder;
  const std::filesystem::path path = folder.path() / "bytes";
  const std::vector<double> row(kRowNumbers + 1, 1.5);
  const size_t row_bytes = row.size() * sizeof(double);
  const auto rows_per_flush = static_cast<size_t>(state.range(0));
  std::vector<char> buffer(rows_per_flush * row_bytes);
  for (auto _ : state) {
    const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    for (size_t i = 0; i < static_cast<size_t>(kRows); ++i) {
      const size_t buffered = i % rows_per_flush;
      std::memcpy(buffer.data() + buffered * row_bytes, row.data(), row_bytes);
      benchmark::ClobberMemory();
      if (buffered + 1 < rows_per_flush) continue;
      if (::write(file, buffer.data(), buffer.size()) != static_cast<ssize_t>(buffer.size())) {
        throw std::runtime_error("cannot write");
      }
    }
    ::close(file);
    state.PauseTiming();
    std::filesystem::remove(path);
    state.ResumeTiming();
  }
  ReportPerRow(state);
}
BENCHMARK(CopyAndWrite)->ArgName("rows_per_flush")->Arg(100)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Opening a run's log and reading all signals.
void Read(benchmark::State& state) {
  const testing::TempFolder folder;
  {
    LogWriter log(folder.path() / "log.h5", kRows);
    AddSignals(&log);
    WriteRows(std::vector<double>(kRowNumbers, 1.5), &log);
    log.Close();
  }
  for (auto _ : state) {
    const LogReader log(folder.path() / "log.h5");
    for (const SignalInfo& signal : log.signals()) benchmark::DoNotOptimize(log.ReadSignal(signal.name));
  }
  ReportPerRow(state);
}
BENCHMARK(Read)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace dexcheck

BENCHMARK_MAIN();
