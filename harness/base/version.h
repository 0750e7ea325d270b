#pragma once

namespace dexcheck {

/// This program's version, as in "0.1.0".
const char* Version();

/// `git describe --always --dirty` of the sources when they were built; empty outside a repository.
extern const char* const kGitRevision;

}  // namespace dexcheck
