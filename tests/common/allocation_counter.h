#pragma once

// Counts calls of malloc and its kin, whoever makes them: operator new, Eigen, the C library. Link
// dexcheck_allocation_counter; nothing else in the program needs to be prepared.

#include <cstdint>

namespace dexcheck::testing {

/// Allocations by this thread since construction.
class AllocationCounter {
 public:
  AllocationCounter();
  [[nodiscard]] std::int64_t count() const;

 private:
  std::int64_t start_;
};

}  // namespace dexcheck::testing
