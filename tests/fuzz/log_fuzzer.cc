// LogReader: a log that is damaged at any places and sealed again is read or refused with an InputError that
// names it. An input is a list of changes: four bytes for the place, one for the value.

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "controller/common/errors.h"
#include "harness/log/log_reader.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/harness/log/sample_log.h"

namespace dexcheck::fuzz {
namespace {

class Log {
 public:
  Log()
      : folder_(std::filesystem::temp_directory_path() /
                ("dexcheck-fuzz-log-" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
    testing::WriteSampleLog(path(), kRows, kRows);
    std::ifstream file(path(), std::ios::binary);
    good_.assign(std::istreambuf_iterator<char>(file), {});
    const size_t line = good_.find("variable ");
    Expect(line != std::string::npos &&
               std::sscanf(good_.c_str() + line, "variable %llu %llu", &variable_begin_, &variable_end_) == 2,
           "the sample log has no seal");
  }
  ~Log() { std::filesystem::remove_all(folder_); }
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  [[nodiscard]] std::filesystem::path path() const { return folder_ / "log.h5"; }

  /// Changes bytes beyond the seal.
  void Damage(const std::uint8_t* data, std::size_t size) {
    constexpr std::size_t kChange = 5;
    std::string bytes = good_;
    for (std::size_t at = 0; at + kChange <= size; at += kChange) {
      std::size_t place = 0;
      for (std::size_t k = 0; k + 1 < kChange; ++k) place = place << 8 | data[at + k];
      bytes[kSealSize + place % (bytes.size() - kSealSize)] = static_cast<char>(data[at + kChange - 1]);
    }
    std::ofstream(path(), std::ios::binary) << bytes;
    const FileDescriptor file(::open(path().c_str(), O_RDWR | O_CLOEXEC));
    Expect(file.is_open() && WriteSeal(file.get(), variable_begin_, variable_end_) == 0,
           "the log cannot be sealed");
  }

  void ReadAll() const {
    const LogReader log(path());
    for (const SignalInfo& signal : log.signals()) (void)log.ReadSignal(signal.name);
    for (const std::string& text : log.ListTexts()) (void)log.ReadText(text);
    std::filesystem::remove_all(folder_ / "unpacked");
    log.ExtractFiles("inputs", folder_ / "unpacked");
  }

 private:
  static constexpr long kRows = 5;
  std::filesystem::path folder_;
  std::string good_;
  unsigned long long variable_begin_ = 0;
  unsigned long long variable_end_ = 0;
};

}  // namespace
}  // namespace dexcheck::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck::fuzz;
  static Log log;
  log.Damage(data, size);
  try {
    log.ReadAll();
  } catch (const dexcheck::InputError& error) {
    ExpectGoodMessage(error.what(), log.path().string() + ": ");
  }
  return 0;
}
