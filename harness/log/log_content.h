#pragma once

// What a log holds besides its rows: the signals, texts and files, as plain data.

#include <map>
#include <string>
#include <string_view>
#include <vector>

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

/// Whether a name is a relative path of plain components, which stays below its folder: no empty ones, no "."
/// or "..", no backslashes or control characters.
bool IsPlainPath(std::string_view name);

}  // namespace dexcheck
