#pragma once

// Content of a log except its rows: the signals, texts and files, as plain data.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "harness/base/files.h"

namespace dexcheck {

/// One recorded quantity: a row of numbers at each step.
struct SignalInfo {
  std::string name;                          ///< Path in the log: "object/X_o", "check/M_bar".
  std::string unit;                          ///< "m", "N m", "1"; a row may mix units: "m, rad".
  std::string description;                   ///< One sentence.
  int width = 1;                             ///< Numbers in a row.
  std::vector<std::string> columns;          ///< Names of the columns: none, or one for each.
  std::map<std::string, double> attributes;  ///< Further numbers, such as {"bound", 1e-10}.
};

/// A file kept in the log with all its bytes.
struct EmbeddedFile {
  std::string path;  ///< Group and relative name: "inputs/mjcf/assets/torus.msh".
  std::string bytes;
};

/// Everything but the rows.
struct LogContent {
  std::vector<SignalInfo> signals;  ///< The first is time.
  std::map<std::string, std::string> texts;
  std::vector<EmbeddedFile> files;
};

/// The unit of each column, where the signal's unit names one unit or as many as there are columns ("m, m,
/// rad"); otherwise the whole text for each.
std::vector<std::string> ListUnits(const SignalInfo& signal);
/// "object/X_o.x", "tau.0" without names of columns, "time" of one number.
std::string NameColumn(const SignalInfo& signal, size_t column);

/// Whether a name is a relative path of plain components, which stays below its folder: no empty ones, no "."
/// or "..", no backslashes or control characters.
bool IsPlainPath(std::string_view name);

// The names in logs of format 1 that are others today. Whoever renames a signal, a check, a key of the
// summary or of a scenario adds a row to the table.

struct OldName {
  enum class Of {
    kCheck,     ///< A check: "check/OLD" among the signals, OLD in the summary.
    kSignal,    ///< Any other signal.
    kWord,      ///< A key of the summary, or a text in it that is this word alone.
    kKey,       ///< Of a scenario or a robot, also in overrides.
    kReplaced,  ///< A signal in whose place others came: they are other quantities and are not compared.
  };
  Of of;
  std::string_view old;
  std::string_view now;
};

/// The table.
const std::vector<OldName>& ListOldNames();

/// Today's name of a signal; the same for one that has not changed.
std::string RenameSignal(const std::string& name);

/// A summary with today's keys and words. Text that is no JSON stays as it is.
std::string RenameSummary(const std::string& summary);

/// A scenario, a robot, or overrides with today's keys.
std::string RenameKeys(const std::string& toml);

// The log as bytes in a file. HDF5 writes everything but the numbers once and closes the file; after that
// only these are written, in place, so that a process that dies cannot leave a file that HDF5 does not open.

/// @throws InputError "PATH: cannot be written: reason", the reason from the system's error number.
[[noreturn]] void FailToWrite(const std::filesystem::path& path, int error);
/// @throws InputError "PATH: cannot be read: reason".
[[noreturn]] void FailToRead(const std::filesystem::path& path, int error);

/// Writes all bytes at the offset. @throws InputError as FailToWrite of this name.
void WriteAt(const std::string& name, int descriptor, const void* bytes, size_t count, std::uint64_t offset);

/// Copies bytes between files. @throws InputError when that fails.
void CopyBytes(const std::string& name, int from, std::uint64_t from_offset, int to, std::uint64_t to_offset,
               size_t count);

/// The root's attribute that says how a log is laid out and which names it uses; logs of format 1 have none.
inline constexpr const char* kFormatAttribute = "format";
inline constexpr const char* kLogFormat = "dexcheck log 2";

/// A log's file, open for reading and writing.
struct LogFile : FileDescriptor {
  std::vector<std::uint64_t> offsets;  ///< Of each signal's first row, from the file's begin; 0 without rows.
};

/// Writes a log with room for `rows` rows of each signal; times are NaN, which marks rows not written, other
/// numbers zero. `path` must exist.
/// @param name in messages.
/// @throws InputError when the file cannot be written.
LogFile WriteLogFile(const std::filesystem::path& path, const std::string& name, const LogContent& content,
                     long rows);

}  // namespace dexcheck
