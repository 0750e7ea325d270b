#include "tests/common/allocation_counter.h"

#include <cerrno>
#include <cstddef>

namespace {

// The allocator has no argument through which a counter could be passed.
thread_local std::int64_t allocations = 0;

}  // namespace

#if defined(__SANITIZE_ADDRESS__)
#define DEXCHECK_ADDRESS_SANITIZER
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define DEXCHECK_ADDRESS_SANITIZER
#endif
#endif

extern "C" {

#ifdef DEXCHECK_ADDRESS_SANITIZER

// The sanitizer has its own allocator, which calls these.
void __sanitizer_malloc_hook(const volatile void* /*pointer*/, size_t /*size*/) { ++allocations; }
void __sanitizer_free_hook(const volatile void* /*pointer*/) {}

#else

// The program's definitions take precedence over those of the C library, whose own names remain.
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* pointer, size_t size);
void* __libc_memalign(size_t alignment, size_t size);

void* malloc(size_t size) {
  ++allocations;
  return __libc_malloc(size);
}

void* calloc(size_t count, size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}

void* realloc(void* pointer, size_t size) {
  ++allocations;
  return __libc_realloc(pointer, size);
}

void* memalign(size_t alignment, size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(size_t alignment, size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** pointer, size_t alignment, size_t size) {
  ++allocations;
  *pointer = __libc_memalign(alignment, size);
  return *pointer == nullptr ? ENOMEM : 0;
}

#endif

}  // extern "C"

namespace dexcheck::testing {

AllocationCounter::AllocationCounter() : start_(allocations) {}

std::int64_t AllocationCounter::count() const { return allocations - start_; }

}  // namespace dexcheck::testing
