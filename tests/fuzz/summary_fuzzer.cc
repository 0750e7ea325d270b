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

std::filesystem::path Folder() {
  return std::filesystem::temp_directory_path() / ("dexcheck-fuzz-" + std::to_string(::getpid()));
}

/// A folder of its own, as long as the program runs.
struct OwnFolder {
  OwnFolder() { std::filesystem::create_directories(Folder()); }
  ~OwnFolder() { std::filesystem::remove_all(Folder()); }
};

/// Writes a log of a few rows.
void WriteLog(const std::string& summary) {
  constexpr long kRows = 3;
  std::filesystem::remove(Folder() / "log.h5");
  LogWriter writer(Folder() / "log.h5", kRows);
  writer.SetText("scenario", "sample");
  writer.SetText("summary", summary);
  writer.EmbedFile("inputs", "scenario.toml", "name = \"sample\"\n");
  writer.StartRows();
  for (long row = 0; row < kRows; ++row) {
    writer.Row(LogWriter::kTime)[0] = 1e-3 * static_cast<double>(row);
    writer.EndRow();
  }
  writer.Close();
}

size_t Count(const std::string& text, std::string_view part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

std::string MakePageOf(const std::string& summary) {
  WriteLog(summary);
  return MakePage(RunData(Folder()), {});
}

}  // namespace
}  // namespace dexcheck::testing::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck::testing::fuzz;
  static const OwnFolder folder;
  static const size_t scripts = Count(MakePageOf(""), "<script");
  std::string text(AsText(data, std::min(size, kLongest)));
  // A log has no zero bytes in its texts, and no empty summary.
  std::replace(text.begin(), text.end(), '\0', ' ');
  try {
    const std::string page = MakePageOf(text.empty() ? " " : text);
    Expect(page.ends_with("</html>\n"), "the page is not whole");
    Expect(Count(page, "<script") == scripts, "markup comes from the summary", text);
  } catch (const dexcheck::InputError& error) {
    ExpectGoodMessage(error.what(), (Folder() / "log.h5").string() + ": summary: ");
  }
  return 0;
}
