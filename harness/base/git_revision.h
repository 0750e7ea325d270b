#pragma once

namespace dexcheck {

/// `git describe --always --dirty` of the sources when they were built; empty outside a repository.
extern const char* const kGitRevision;

}  // namespace dexcheck
