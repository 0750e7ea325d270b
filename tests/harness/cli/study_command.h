#pragma once

// A study of six trials for the tests of `dexcheck study`, and its rows as text.

#include <gmock/gmock.h>
#include <sqlite3.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "harness/study/study_store.h"
#include "tests/common/paths.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing {

// Six trials, one of which diverges.
inline const std::string kStudy = R"(name = "tiny"
scenario = "offset"
set = ["duration=0.02", "settle=0.3", "start_error.xyz=[1e-6, 0, 0]"]
[[vary]]
key = "control.K_p"
values = [100, 1e4]
[[vary]]
key = "control.K_v"
values = [20, 200, 2100]
)";
constexpr size_t kNumTrials = 6;

/// Every value of the tables that make up a study, with its type, row by row.
inline std::string Dump(const std::filesystem::path& path) {
  Database database(path, Database::Mode::kExisting);
  std::string text;
  for (const char* sql :
       {"SELECT * FROM study", "SELECT * FROM trials ORDER BY trial", "PRAGMA integrity_check"}) {
    sqlite3_stmt* statement = nullptr;
    EXPECT_EQ(sqlite3_prepare_v2(database.handle(), sql, -1, &statement, nullptr), SQLITE_OK);
    while (sqlite3_step(statement) == SQLITE_ROW) {
      for (int i = 0; i < sqlite3_column_count(statement); ++i) {
        const void* const bytes = sqlite3_column_type(statement, i) == SQLITE_FLOAT ? nullptr : "";
        if (bytes == nullptr) {
          char number[64];
          std::snprintf(number, sizeof(number), "%a", sqlite3_column_double(statement, i));
          text += number;
        } else if (sqlite3_column_type(statement, i) != SQLITE_NULL) {
          text += reinterpret_cast<const char*>(sqlite3_column_text(statement, i));
        }
        text += '|';
      }
      text += '\n';
    }
    sqlite3_finalize(statement);
  }
  return text;
}

class StudyCommand : public ::testing::Test {
 protected:
  StudyCommand() { WriteText(folder_.path() / "tiny.toml", kStudy); }

  [[nodiscard]] std::vector<std::string> RunArguments(const std::string& database,
                                                      std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {"study", "run", Path("tiny.toml"), "--db", Path(database)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  [[nodiscard]] std::string Path(const std::string& file) const { return folder_.path() / file; }

  [[nodiscard]] long CountRows(const std::string& file) const {
    if (!std::filesystem::exists(Path(file))) return 0;
    Database database(Path(file), Database::Mode::kExisting);
    Statement tables(&database, "SELECT count(*) FROM sqlite_master WHERE name = 'trials'");
    tables.Step();
    if (tables.GetWhole(0) == 0) return 0;
    Statement rows(&database, "SELECT count(*) FROM trials");
    rows.Step();
    return static_cast<long>(rows.GetWhole(0));
  }

  /// Rows of the uninterrupted study, made once.
  const std::string& Reference() {
    static const auto reference = std::make_unique<std::string>();
    if (reference->empty()) {
      const ProgramResult result = RunDexcheck(RunArguments("reference.sqlite"));
      EXPECT_EQ(result.exit_code, 0) << result.err;
      EXPECT_THAT(result.out, ::testing::HasSubstr("tiny: 6 of 6 trials"));
      *reference = Dump(Path("reference.sqlite"));
    }
    return *reference;
  }

  TempFolder folder_;
};

}  // namespace dexcheck::testing
