#include "harness/study/sqlite.h"

#include <cmath>
#include <limits>
#include <system_error>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

/// Others hold the lock for one trial's row; on a slow disk or network that may take a while.
constexpr int kBusyTimeout = 60000;  // ms

/// For reading too the file has to be written: what a killed process left half done must be undone.
int FlagsOf(Database::Mode mode) {
  return SQLITE_OPEN_READWRITE | (mode == Database::Mode::kCreate ? SQLITE_OPEN_CREATE : 0);
}

std::string Explain(int code, const char* message) {
  switch (code & 0xff) {
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      return std::string("is not a usable database: ") + message;
    case SQLITE_CANTOPEN:
      return "cannot be opened";
    case SQLITE_READONLY:
      return "cannot be written: it is read-only";
    case SQLITE_FULL:
    case SQLITE_IOERR:
      return std::string("cannot be written: ") + message;
    case SQLITE_BUSY:
      return "is locked by another program";
    default:
      return message;
  }
}

}  // namespace

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

Database::Database(const std::filesystem::path& path, Mode mode) : name_(path.string()) {
  RequirePlainFile(name_);
  const int code = sqlite3_open_v2(name_.c_str(), &handle_, FlagsOf(mode), nullptr);
  if (code != SQLITE_OK) {
    const std::string why = Explain(code, sqlite3_errmsg(handle_));
    sqlite3_close(handle_);
    throw InputError(name_ + ": " + why);
  }
  sqlite3_busy_timeout(handle_, kBusyTimeout);
}

Database::~Database() { sqlite3_close(handle_); }

void Database::Execute(const std::string& sql) {
  const int code = sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) Fail(code);
}

void Database::Fail(int code) const {
  throw InputError(name_ + ": " + Explain(code, sqlite3_errmsg(handle_)));
}

Statement::Statement(Database* database, const std::string& sql) : database_(database) {
  const int code = sqlite3_prepare_v2(database->handle(), sql.c_str(), -1, &handle_, nullptr);
  if (code != SQLITE_OK) database->Fail(code);
}

Statement::~Statement() { sqlite3_finalize(handle_); }

void Statement::Bind(int parameter, long long value) { sqlite3_bind_int64(handle_, parameter, value); }

void Statement::Bind(int parameter, double value) { sqlite3_bind_double(handle_, parameter, value); }

void Statement::Bind(int parameter, std::string_view text) {
  sqlite3_bind_text(handle_, parameter, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
}

bool Statement::Step() {
  const int code = sqlite3_step(handle_);
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) database_->Fail(code);
  sqlite3_reset(handle_);
  return false;
}

void Statement::Reset() { sqlite3_reset(handle_); }

long long Statement::GetWhole(int column) const { return sqlite3_column_int64(handle_, column); }

double Statement::GetNumber(int column) const {
  if (sqlite3_column_type(handle_, column) == SQLITE_NULL) return std::numeric_limits<double>::quiet_NaN();
  return sqlite3_column_double(handle_, column);
}

std::string Statement::GetText(int column) const {
  const unsigned char* const text = sqlite3_column_text(handle_, column);
  if (text == nullptr) return "";
  return {reinterpret_cast<const char*>(text), static_cast<size_t>(sqlite3_column_bytes(handle_, column))};
}

bool Statement::IsNumber(int column) const {
  const int type = sqlite3_column_type(handle_, column);
  return type == SQLITE_INTEGER || type == SQLITE_FLOAT;
}

bool Statement::IsNull(int column) const { return sqlite3_column_type(handle_, column) == SQLITE_NULL; }

Transaction::~Transaction() {
  if (open_) sqlite3_exec(database_->handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::Commit() {
  database_->Execute("COMMIT");
  open_ = false;
}

}  // namespace dexcheck
