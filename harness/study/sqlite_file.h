#pragma once

// A database of SQLite in a plain file.

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Exception.h>
#include <SQLiteCpp/Statement.h>
#include <SQLiteCpp/VariadicBind.h>

#include <string>

#include "controller/common/errors.h"

namespace dexcheck {

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

}  // namespace dexcheck
