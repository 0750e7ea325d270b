#pragma once

#include <map>
#include <string>
#include <string_view>

namespace dexcheck {

/// The members of a .npz file (numpy.savez, numpy.savez_compressed), which is a ZIP archive: bytes by name.
/// @throws InputError, one line that names `source`, for archives that are damaged, encrypted, larger than 4
/// GB or compressed in another way.
std::map<std::string, std::string> ReadNpz(std::string_view bytes, const std::string& source);

}  // namespace dexcheck
