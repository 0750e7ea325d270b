#pragma once

// A study of six trials for the tests of `dexcheck study`, and its rows as text.

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "harness/study/study_store.h"
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

/// An open database that may be changed.
inline SQLite::Database OpenDatabase(const std::filesystem::path& path) {
  constexpr int kPatience = 10000;  // ms, with a program that writes
  return SQLite::Database(path, SQLite::OPEN_READWRITE, kPatience);
}

/// Every value of the tables that make up a study, with its type, row by row.
inline std::string Dump(const std::filesystem::path& path) {
  const SQLite::Database database = OpenDatabase(path);
  std::string text;
  for (const char* sql :
       {"SELECT * FROM study", "SELECT * FROM trials ORDER BY trial", "PRAGMA integrity_check"}) {
    SQLite::Statement select(database, sql);
    while (select.executeStep()) {
      for (int i = 0; i < select.getColumnCount(); ++i) {
        const SQLite::Column value = select.getColumn(i);
        text += (value.isFloat() ? fmt::format("{:a}", value.getDouble()) : value.getString()) + '|';
      }
      text += '\n';
    }
  }
  return text;
}

class StudyCommand : public CommandTest {
 protected:
  StudyCommand() { Write("tiny.toml", kStudy); }

  /// Words that make the study's rows, in whatever folder.
  [[nodiscard]] Words RunArguments(const std::string& database, const Words& more = {}) const {
    return Words{"study", "run", Path("tiny.toml"), "--db", Path(database)} + more;
  }
  ProgramResult Make(const std::string& database, const Words& more = {}) const {
    return Expect(0, RunArguments(database, more));
  }
  [[nodiscard]] std::string Dump(const std::string& file) const { return testing::Dump(Path(file)); }
  [[nodiscard]] std::vector<TrialRow> ReadRows(const std::string& file) const {
    return StudyStore::Open(Path(file)).ReadRows();
  }
  [[nodiscard]] long CountRows(const std::string& file) const {
    if (!Has(file)) return 0;
    SQLite::Database database = OpenDatabase(Path(file));
    if (!database.tableExists("trials")) return 0;
    return database.execAndGet("SELECT count(*) FROM trials");
  }

  /// Rows of the uninterrupted study, made once.
  const std::string& Reference() {
    static const auto reference = std::make_unique<std::string>();
    if (reference->empty()) {
      EXPECT_THAT(Make("reference.sqlite").out, HasSubstr("tiny: 6 of 6 trials"));
      *reference = Dump("reference.sqlite");
    }
    return *reference;
  }
};

}  // namespace dexcheck::testing
