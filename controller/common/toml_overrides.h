#pragma once

#include <string>
#include <vector>

namespace dexcheck {

/// TOML text with assignments made in it, as TomlDocument::Override makes them; its comments are lost. The
/// same text when there are none.
/// @param source the text's file, for messages. @throws InputError as TomlDocument.
std::string ApplyOverrides(const std::string& text, const std::string& source,
                           const std::vector<std::string>& overrides);

}  // namespace dexcheck
