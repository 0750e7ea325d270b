#include "harness/study/sqlite_file.h"

#include <sqlite3.h>

#include <filesystem>
#include <system_error>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

/// Others hold the lock for some rows; on a slow disk or network that may take a while.
constexpr int kBusyTimeout = 60000;  // ms

const std::string& RequirePlain(const std::string& name) {
  RequirePlainFile(name);
  return name;
}

}  // namespace

std::string Explain(const SQLite::Exception& error) {
  switch (error.getErrorCode()) {
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      return std::string("is not a usable database: ") + error.what();
    case SQLITE_CANTOPEN:
      return "cannot be opened";
    case SQLITE_READONLY:
      return "cannot be written: it is read-only";
    case SQLITE_FULL:
    case SQLITE_IOERR:
      return std::string("cannot be written: ") + error.what();
    case SQLITE_BUSY:
      return "is locked by another program";
    default:
      return error.what();
  }
}

/// SQLite gives empty names, those that begin with a colon and URIs a meaning of their own: databases in
/// memory, or temporary ones.
void RequirePlainFile(const std::string& name) {
  const auto refuse = [&](const std::string& why) {
    throw InputError(Quote(name) + ": a database must be a plain file: " + why);
  };
  if (name.empty()) refuse("the name is empty");
  if (name.starts_with(':')) refuse("the name begins with a colon (a file of this name is ./" + name + ")");
  if (name.starts_with("file:")) refuse("this is a URI (a file of this name is ./" + name + ")");
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(name, error);
  if (std::filesystem::is_directory(status)) refuse("this is a folder");
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    refuse("this is a device, a pipe or a socket");
  }
}

SqliteFile::SqliteFile(const std::string& name, int flags) try : SQLite
  ::Database(RequirePlain(name), flags, kBusyTimeout) {}
catch (const SQLite::Exception& error) {
  throw InputError(name + ": " + Explain(error));
}

}  // namespace dexcheck
