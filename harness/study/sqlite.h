#pragma once

// SQLite's handles as objects.

#include <sqlite3.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace dexcheck {

/// An open database file: a regular file, and nothing else that SQLite would take a name for (nothing that is
/// gone when the process ends). Everything that fails throws InputError "FILE: what: why".
class Database {
 public:
  enum class Mode { kExisting, kCreate };
  Database(const std::filesystem::path& path, Mode mode);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  /// Runs statements that give no rows.
  void Execute(const std::string& sql);
  /// Rows that the last statement changed.
  [[nodiscard]] int CountChanges() const { return sqlite3_changes(handle_); }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] sqlite3* handle() const { return handle_; }
  /// Throws for the last error.
  [[noreturn]] void Fail(int code) const;

 private:
  std::string name_;
  sqlite3* handle_ = nullptr;
};

/// @throws InputError when this cannot be the name of a database file.
void RequirePlainFile(const std::string& name);

/// A prepared statement. Parameters and columns count from 1 and 0, as SQLite's do.
class Statement {
 public:
  Statement(Database* database, const std::string& sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void Bind(int parameter, long long value);
  /// Not a number is NULL.
  void Bind(int parameter, double value);
  void Bind(int parameter, std::string_view text);
  /// True with a row, false at the end; then the statement can be used again.
  bool Step();
  /// Lets go of its row, so that it can be used again.
  void Reset();

  [[nodiscard]] long long GetWhole(int column) const;
  /// NaN for NULL.
  [[nodiscard]] double GetNumber(int column) const;
  [[nodiscard]] std::string GetText(int column) const;
  /// Whether a column holds a number; SQLite gives 0 for a text.
  [[nodiscard]] bool IsNumber(int column) const;
  [[nodiscard]] bool IsNull(int column) const;

 private:
  Database* database_;
  sqlite3_stmt* handle_ = nullptr;
};

/// A transaction that may write; undone unless committed.
class Transaction {
 public:
  explicit Transaction(Database* database) : database_(database) { database_->Execute("BEGIN IMMEDIATE"); }
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void Commit();

 private:
  Database* database_;
  bool open_ = true;
};

}  // namespace dexcheck
