#pragma once

namespace dexcheck::testing {

/// False where the counter cannot work, because a sanitizer replaces the allocator.
bool CanCountAllocations();

/// Number of heap allocations of this process so far.
long CountAllocations();

}  // namespace dexcheck::testing
