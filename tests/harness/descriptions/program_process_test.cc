// A program that cannot be started costs nothing.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>

#include "harness/descriptions/program_provider.h"

namespace dexcheck::testing::program_process_test {
namespace {

long CountDescriptors() {
  const std::filesystem::directory_iterator open("/proc/self/fd");
  return std::distance(begin(open), end(open));
}

/// The limit below which so many numbers of descriptors are free.
rlim_t FindLimit(int room) {
  int limit = 0;
  for (int free = 0; free < room; ++limit) free += ::fcntl(limit, F_GETFD) == -1 ? 1 : 0;
  return static_cast<rlim_t>(limit);
}

// A socket pair and two pipes are six descriptors: with room for fewer, each of the three calls fails once.
TEST(ProgramProcess, LeavesNoDescriptorWhenItCannotStart) {
  const long before = CountDescriptors();
  rlimit limit = {};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
  for (const int room : {1, 3, 5}) {
    const rlimit low = {FindLimit(room), limit.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &low), 0);
    EXPECT_THROW(ProgramProcess("cat", 1.0), ProgramError) << room;
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &limit), 0);
    EXPECT_EQ(CountDescriptors(), before) << room;
  }
  EXPECT_EQ(ProgramProcess("cat", 60.0).Query("line"), "line");
  EXPECT_EQ(CountDescriptors(), before);
}

}  // namespace
}  // namespace dexcheck::testing::program_process_test
