#pragma once

#include <filesystem>
#include <string>

namespace dexcheck::cli {

/// Copies a shipped scenario with its robot into a folder of its own. @param out empty: named after it.
/// @returns the exit code. @throws InputError when there is none of that name, or files cannot be written.
int CopyScenario(const std::string& name, const std::string& out);

/// Writes a file, whole or not at all.
void WriteFile(const std::filesystem::path& path, const std::string& text);

/// Copies a file, and makes the folder that it goes to.
void CopyInto(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace dexcheck::cli
