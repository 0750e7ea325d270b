// GraspForceSolver::Solve allocates nothing. Counts every call of malloc in this program, so it stands alone.

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "controller/grasp/grasp_force.h"
#include "tests/controller/grasp/random_grasp.h"

#if defined(__SANITIZE_ADDRESS__) || (defined(__has_feature) && __has_feature(address_sanitizer))
#define DEXCHECK_COUNTS_ALLOCATIONS 0
#else
#define DEXCHECK_COUNTS_ALLOCATIONS 1
#endif

#if DEXCHECK_COUNTS_ALLOCATIONS
namespace {
thread_local long allocations = 0;
}
extern "C" {
void* __libc_malloc(std::size_t size);
void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
}

namespace dexcheck::testing::grasp_force_allocation_test {
namespace {

long CountAllocations(GraspForceSolver& solver, const std::vector<GraspForceProblem>& problems) {
  const long before = allocations;
  for (const GraspForceProblem& problem : problems) solver.Solve(problem);
  return allocations - before;
}

TEST(GraspForceAllocation, SolveDoesNone) {
  const long before = allocations;
  void* volatile block = ::operator new(1000);
  ::operator delete(block);
  ASSERT_EQ(allocations, before + 1) << "the count does not work";

  std::mt19937_64 random(1);
  for (const int num_contacts : {4, 8, 11}) {
    std::vector<GraspForceProblem> problems;
    for (int sample = 0; sample < 20; ++sample) {
      problems.push_back(MakeRandomGraspForceProblem(random, num_contacts));
      problems.push_back(problems.back());  // a warm start, if feasible
    }
    GraspForceSolver solver(num_contacts);
    EXPECT_EQ(CountAllocations(solver, problems), 0) << num_contacts << " contacts";
  }
}

}  // namespace
}  // namespace dexcheck::testing::grasp_force_allocation_test
#endif
