#pragma once

#include <filesystem>

#include "harness/engine/joined_mjcf.h"

namespace dexcheck {

/// Leaves out of an MJCF what its missing or broken files (meshes, height fields, skins, textures) and
/// missing materials take with them: looks, and the contacts of geoms that have no mesh.
/// @param folder from which the MJCF's files are found.
/// @throws InputError "FILE:LINE: mesh "no.stl": does not exist; ..." where a body's mass follows from the
/// mesh.
void LeaveOutAssets(const std::filesystem::path& folder, JoinedMjcf* mjcf);

/// Makes an MJCF one that this program's engine reads: CheckNumbers, LeaveOutNewerWords, LeaveOutAssets.
void AdaptMjcf(const std::filesystem::path& folder, JoinedMjcf* mjcf);

}  // namespace dexcheck
