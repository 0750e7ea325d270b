#pragma once

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Exception.h>
#include <SQLiteCpp/Statement.h>
#include <SQLiteCpp/VariadicBind.h>

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/errors.h"
#include "harness/study/study.h"
#include "harness/study/trial.h"

namespace dexcheck {

// A database of SQLite in a plain file.

/// Returns the name. @throws InputError when this cannot be that of a database file: it must be a regular
/// file, and nothing else that SQLite would take a name for (nothing that is gone when the process ends).
const std::string& RequirePlainFile(const std::string& name);

/// "is locked by another program", of what SQLite threw.
std::string Explain(const SQLite::Exception& error);

/// Everything that fails throws InputError "FILE: what: why".
class SqliteFile : public SQLite::Database {
 public:
  SqliteFile(const std::string& name, int flags);

  /// A statement with values for its marks.
  template <typename... Values>
  SQLite::Statement Prepare(const std::string& sql, const Values&... values) const {
    SQLite::Statement statement(*this, sql);
    SQLite::bind(statement, values...);
    return statement;
  }

  /// Calls a function, and makes InputError of what SQLite throws.
  template <typename Function>
  auto Do(const Function& function) const {
    try {
      return function();
    } catch (const SQLite::Exception& error) {
      throw InputError(getFilename() + ": " + Explain(error));
    }
  }
};

// Which of the processes that use it are alive.

/// Machine, process id and start of this process: no other process ever has the same.
std::string NameThisProcess();

/// Whether the process of that name runs on this machine; false for those of other machines.
bool IsRunningHere(const std::string& process);

// A study's database: table `study` says what the study is, table `trials` has a row for each finished trial.
// Each row is one transaction, so that the file is whole whenever a process is killed.

/// The identity of a study, column by column. Rows of studies that differ in any of them do not belong
/// together.
using StudyIdentity = std::vector<std::pair<std::string, std::string>>;

/// Version of a database's tables.
inline constexpr const char* kStudyLayout = "2";

/// @throws InputError when a file cannot be read.
StudyIdentity IdentifyStudy(const StudyInputs& inputs);

/// Rows and where they are from, for messages.
struct TrialSource {
  std::string name;
  /// Gives its rows one by one; called once, when its turn comes: not all need be in memory.
  std::function<void(const std::function<void(TrialRow&&)>& take)> read;
};

/// Whether this program gives the same rows as the one that made these.
using MakesSameRows = std::function<bool(const std::vector<TrialRow>&)>;

/// An open database. Everything that fails throws InputError "FILE: what: why". Rows with negative numbers,
/// which earlier versions set aside when a study was edited, count nowhere.
class StudyStore {
 public:
  /// Opens a study's database, or makes it when there is none. What no row depends on, a description for
  /// example, may have changed. Another revision of this program goes on with the rows when it makes the same
  /// ones.
  /// @param makes_same_rows called when the file was written by another revision; none for that it does not.
  /// @throws InputError, also when the file holds another study.
  static StudyStore OpenOrCreate(const std::filesystem::path& path, const StudyIdentity& identity,
                                 const Study& study, const MakesSameRows& makes_same_rows = {});
  /// Opens one that exists. @throws InputError.
  static StudyStore Open(const std::filesystem::path& path);

  /// The file, as it was named.
  [[nodiscard]] const std::string& name() const { return database_->getFilename(); }
  [[nodiscard]] const StudyIdentity& identity() const { return identity_; }
  [[nodiscard]] const std::string& Identify(const std::string& column) const;
  /// The study as the file has it.
  [[nodiscard]] const Study& study() const { return study_; }
  /// Throws InputError that names the first column, or key of the study, in which this study is another one.
  void RequireSame(const StudyIdentity& other) const;
  /// In words that its rows are of another revision of this program; empty when they are not.
  [[nodiscard]] const std::string& change() const { return change_; }

  /// By trial number. @param first number that is read. @param with_machine whether rows say which machine
  /// made them.
  [[nodiscard]] std::vector<TrialRow> ReadRows(long first = 0, bool with_machine = true) const;
  /// How many trials have a row, by outcome.
  [[nodiscard]] std::map<Outcome, long> CountOutcomes() const;
  /// Calls `take` with each row, by trial number.
  void ForEachRow(const std::function<void(TrialRow&&)>& take, long first = 0,
                  bool with_machine = true) const;
  [[nodiscard]] std::optional<TrialRow> FindRow(long trial) const;
  /// Numbers of the trials that have a row, ascending.
  [[nodiscard]] std::vector<long> ListNumbers() const;

  /// Takes trials on for this process. @return those of them that are not done, and that no other living
  /// process of this machine has.
  std::vector<long> Claim(const std::vector<long>& trials);
  /// Gives claimed trials back undone.
  void Release(const std::vector<long>& trials);
  /// Stores trials and ends their claims, in one transaction. A row that is already there stays.
  void Add(const std::vector<TrialRow>& rows);
  /// All rows in one transaction. Those that are the same as one that is there may be, and failed ones
  /// (IsFailed) give way to others. @throws InputError when one differs; then nothing is added.
  void AddAll(const std::vector<TrialSource>& sources);
  /// Forgets the trials that failed (IsFailed).
  void RemoveFailed();
  /// Forgets all trials from this number on.
  void RemoveFrom(long first);

 private:
  StudyStore(const std::filesystem::path& path, int flags);
  void Create(const StudyIdentity& identity, const Study& study);
  /// Columns that the program which wrote the file did not have: metrics, and which machine made a trial.
  void AddMissingColumns();
  void GoOn(const StudyIdentity& identity, const Study& study, const MakesSameRows& makes_same_rows);
  void Update(const std::string& column, const std::string& value);
  void Load();
  void Insert(const TrialRow& row);
  [[nodiscard]] TrialRow ReadRow(const SQLite::Statement& select, bool with_machine) const;

  std::unique_ptr<SqliteFile> database_;
  std::unique_ptr<SQLite::Statement> insert_;        // prepared once
  mutable std::unique_ptr<SQLite::Statement> find_;  // prepared once, too
  StudyIdentity identity_;
  Study study_;
  std::string change_;
};

}  // namespace dexcheck
