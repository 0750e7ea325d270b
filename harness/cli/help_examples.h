#pragma once

#include <span>
#include <string>

namespace dexcheck::cli {

/// Two lines that a command's help shows.
struct CommandExamples {
  const char* command;  ///< "study run"
  const char* first;    ///< A line to type,
  const char* second;   ///< and another one.
};
/// Returns "Examples:" and the lines of a command, one below the other; an empty text without any.
std::string FindExamples(const std::string& command);

}  // namespace dexcheck::cli
