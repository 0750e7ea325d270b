#include <sqlite3.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

#include "controller/common/text.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/base/interrupts.h"
#include "harness/study/study_store.h"

namespace dexcheck {
namespace {

/// Waits while another program has the file: others write some rows, or read it for as long as they like.
/// @param file the database. @param count how often this was called for one lock. @returns whether to try
/// again.
int WaitForOthers(void* file, int count) {
  constexpr int kPause = 50, kSilent = 5000;  // ms
  if (IsInterrupted()) return 0;
  if (count == kSilent / kPause)
    Warn(static_cast<const SqliteFile*>(file)->getFilename() +
         ": another program uses it; waiting until it ends");
  ::usleep(1000 * kPause);
  return 1;
}

/// Changes with every boot.
std::string ReadMachine() {
  std::string boot;
  std::ifstream("/proc/sys/kernel/random/boot_id") >> boot;
  char host[256] = "";
  ::gethostname(host, sizeof(host) - 1);
  return std::string(host) + "/" + boot;
}

/// Start of a living process in ticks since boot; empty when there is none.
std::string ReadStart(const std::string& pid) {
  std::ifstream file("/proc/" + pid + "/stat");
  std::stringstream text;
  text << file.rdbuf();
  // The second field, in parentheses, may hold anything; the start is the 22nd, the state the third.
  const std::string all = text.str();
  const size_t after = all.rfind(')');
  if (after == std::string::npos) return "";
  std::istringstream rest(all.substr(after + 1));
  constexpr int kFieldsToStart = 20;
  std::string field;
  for (int i = 0; i < kFieldsToStart; ++i) {
    rest >> field;
    if (i == 0 && (field == "Z" || field == "X")) return "";
  }
  return field;
}

}  // namespace

std::string Explain(const SQLite::Exception& error) {
  switch (error.getErrorCode()) {
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      return std::string("is not a usable database: ") + error.what();
    case -1:  // SQLiteCpp's own, about its calls
      return "is not a usable database: it lacks a row or a column";
    case SQLITE_CANTOPEN:
      return "cannot be opened";
    case SQLITE_READONLY:
      return "cannot be written: it is read-only";
    case SQLITE_FULL:
    case SQLITE_IOERR:
      return std::string("cannot be written: ") + error.what();
    case SQLITE_BUSY:
      return "is locked by another program; the same command goes on where this one ended";
    default:
      return error.what();
  }
}

/// SQLite gives empty names, those that begin with a colon and URIs a meaning of their own: databases in
/// memory, or temporary ones.
const std::string& RequirePlainFile(const std::string& name) {
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
  return name;
}

SqliteFile::SqliteFile(const std::string& name, int flags) try : SQLite
  ::Database(RequirePlainFile(name), flags) {
    sqlite3_busy_handler(getHandle(), WaitForOthers, this);
    NoteInput(name);
  }
catch (const SQLite::Exception& error) {
  throw InputError(name + ": " + Explain(error));
}

std::string NameThisProcess() {
  const std::string pid = std::to_string(::getpid());
  return ReadMachine() + "/" + pid + "/" + ReadStart(pid);
}

bool IsRunningHere(const std::string& process) {
  const std::string machine = ReadMachine() + "/";
  if (!process.starts_with(machine)) return false;
  const size_t slash = process.find('/', machine.size());
  if (slash == std::string::npos) return false;
  const std::string start = ReadStart(process.substr(machine.size(), slash - machine.size()));
  return !start.empty() && process.substr(slash + 1) == start;
}

}  // namespace dexcheck
