#pragma once

// Standard output and standard error, which may be closed, full or gone.

#include <string>

namespace dexcheck {

/// To be called first thing in main. A standard stream that is closed gets a descriptor that takes nothing:
/// otherwise the next file to be opened, such as a log, would get its number and what is printed.
void OccupyStandardStreams();

/// From now on, lines of Warn show a file of this folder as one of `name`, "NAME: FILE": files of a log are
/// unpacked where nobody looks for them.
void ShowFolderAs(const std::string& folder, const std::string& name);

/// One line on standard error, "dexcheck: " and the text, whatever control characters stand in file names;
/// words longer than any file name (4095 bytes) are shortened. Whether it can be written does not matter.
void Warn(const std::string& text);

/// Writes what was printed. @throws InputError "standard output: cannot be written: reason".
void FlushOutput();

/// The text as one word of a POSIX shell: in single quotes, unless it needs none.
std::string QuoteForShell(const std::string& text);

}  // namespace dexcheck
