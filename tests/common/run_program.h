#pragma once

// Runs a program as its users do: arguments in; output, messages and exit code out.

#include <sys/resource.h>
#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/common/files.h"

namespace dexcheck::testing {

struct ProgramResult {
  int exit_code = -1;  ///< -1 when a signal ended the program.
  std::string out;     ///< Standard output.
  std::string err;     ///< Standard error.
};

struct ProgramOptions {
  std::filesystem::path folder;  ///< Working folder; this process's unless given.
  std::vector<std::pair<std::string, std::string>> environment = {};  ///< Added to this process's.
  std::optional<rlim_t> largest_file = {};  ///< Bytes; more in one file is SIGXFSZ, as after `ulimit -f`.
  std::optional<std::filesystem::path> out = {};  ///< Standard output goes into this file instead.
  std::optional<std::filesystem::path> err = {};  ///< Standard error goes into this file instead.
  std::vector<int> closed = {};                   ///< Standard streams that it finds closed.
  unsigned seconds = 1200;  ///< It hangs when it needs more, on any machine, and is ended by force.
};

/// A running program.
class Program {
 public:
  /// @param command the program and its arguments; the program by path, or looked up in PATH.
  Program(const std::vector<std::string>& command, const ProgramOptions& options);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void Signal(int signal) const;
  ProgramResult Wait();

 private:
  TempFolder captured_;
  pid_t pid_ = -1;
};

/// Runs a program to its end.
ProgramResult RunProgram(const std::vector<std::string>& command, const ProgramOptions& options = {});

}  // namespace dexcheck::testing
