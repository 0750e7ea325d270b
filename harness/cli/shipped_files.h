#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace dexcheck::cli {

/// Path of a file that comes with the program, such as "mjcf/scene.xml": in ../share/dexcheck beside the
/// executable when it is there (an installed program, wherever its tree was moved), otherwise in the folder
/// that the program was built from. @throws InputError when it is in neither.
std::filesystem::path FindShippedFile(const std::filesystem::path& name);

/// A kind of TOML files of which some are shipped, in one folder, and are named without .toml.
struct ShippedKind {
  const char* name;    ///< "scenario".
  const char* folder;  ///< As FindShippedFile takes it.
  const char* listed;  ///< What a message points to for their names; the names themselves when empty.

  /// In alphabetic order. None is read.
  [[nodiscard]] std::vector<std::string> ListNames() const;
  /// A shipped one by its name, or the file that is named. @throws InputError with the nearest name.
  [[nodiscard]] std::filesystem::path Find(const std::string& name_or_file) const;
};
inline constexpr ShippedKind kScenarios = {"scenario", "harness/shipped/scenarios", "dexcheck run --list"};
inline constexpr ShippedKind kStudies = {"study", "harness/shipped/studies", ""};

/// Whether this names a file, and nothing that is shipped.
bool IsTomlFile(const std::string& name);

}  // namespace dexcheck::cli
