// A run's summary as the report reads it from the log: any text gives a whole page, in which nothing of the
// text is markup, or an InputError that names the log.

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "controller/common/errors.h"
#include "harness/log/log_writer.h"
#include "harness/report/page.h"
#include "tests/fuzz/fuzz_target.h"

namespace dexcheck::testing::fuzz {
namespace {

constexpr size_t kLongest = 1 << 14;

/// A log of a few rows, in a folder of its own, whose summary is replaced in place.
class Log {
 public:
  Log() : writer_(MakeFolder() / "log.h5", kRows) {
    writer_.SetText("scenario", "sample");
    writer_.ReserveText("summary", kLongest);
    writer_.EmbedFile("inputs", "scenario.toml", "name = \"sample\"\n");
    writer_.StartRows();
    for (long row = 0; row < kRows; ++row) {
      writer_.Row(LogWriter::kTime)[0] = 1e-3 * static_cast<double>(row);
      writer_.EndRow();
    }
    writer_.Flush();
  }
  ~Log() { std::filesystem::remove_all(Folder()); }
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  static std::filesystem::path Folder() {
    return std::filesystem::temp_directory_path() / ("dexcheck-fuzz-" + std::to_string(::getpid()));
  }
  void SetSummary(const std::string& text) { writer_.SetText("summary", text); }

 private:
  static constexpr long kRows = 3;
  static std::filesystem::path MakeFolder() {
    std::filesystem::create_directories(Folder());
    return Folder();
  }

  LogWriter writer_;
};

size_t Count(const std::string& text, std::string_view part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

std::string MakePageOfLog() { return MakePage(RunData(Log::Folder()), {}); }

}  // namespace
}  // namespace dexcheck::testing::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck::testing::fuzz;
  static Log log;
  static const size_t scripts = Count(MakePageOfLog(), "<script");
  std::string text(AsText(data, std::min(size, kLongest)));
  // A log has no zero bytes in its texts, and no empty summary.
  std::replace(text.begin(), text.end(), '\0', ' ');
  log.SetSummary(text.empty() ? " " : text);
  try {
    const std::string page = MakePageOfLog();
    Expect(page.ends_with("</html>\n"), "the page is not whole");
    Expect(Count(page, "<script") == scripts, "markup comes from the summary", text);
  } catch (const dexcheck::InputError& error) {
    ExpectGoodMessage(error.what(), (Log::Folder() / "log.h5").string() + ": summary: ");
  }
  return 0;
}
