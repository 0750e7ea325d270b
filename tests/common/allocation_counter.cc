#include "tests/common/allocation_counter.h"

#include <atomic>
#include <cstddef>

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define DEXCHECK_SANITIZED
#endif
#endif
#if defined(__SANITIZE_ADDRESS__)
#define DEXCHECK_SANITIZED
#endif

namespace {

std::atomic<long> allocation_count{0};

}  // namespace

#if defined(__GLIBC__) && !defined(DEXCHECK_SANITIZED)

// Eigen calls malloc, not operator new, so malloc itself is counted.
extern "C" void* __libc_malloc(std::size_t size);  // NOLINT(bugprone-reserved-identifier)

extern "C" void* malloc(std::size_t size) {
  ++allocation_count;
  return __libc_malloc(size);
}

bool dexcheck::testing::CanCountAllocations() { return true; }

#else

bool dexcheck::testing::CanCountAllocations() { return false; }

#endif

long dexcheck::testing::CountAllocations() { return allocation_count; }
