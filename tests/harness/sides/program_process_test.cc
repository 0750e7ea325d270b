// A program that cannot be started costs nothing.

#include "harness/sides/program_process.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>

namespace dexcheck::testing::program_process_test {
namespace {

long CountDescriptors() {
  const std::filesystem::directory_iterator open("/proc/self/fd");
  return std::distance(begin(open), end(open));
}

// A socket pair and two pipes are six descriptors: with room for fewer, each of the three calls fails once.
TEST(ProgramProcess, LeavesNoDescriptorWhenItCannotStart) {
  const long before = CountDescriptors();
  rlimit limit = {};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
  for (const rlim_t room : {1U, 3U, 5U}) {
    // The count has the directory's own descriptor in it.
    const rlimit low = {static_cast<rlim_t>(before) - 1 + room, limit.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &low), 0);
    EXPECT_THROW(ProgramProcess("cat", 1.0), ProgramError) << room;
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &limit), 0);
    EXPECT_EQ(CountDescriptors(), before) << room;
  }
  EXPECT_EQ(ProgramProcess("cat", 60.0).Ask("line"), "line");
  EXPECT_EQ(CountDescriptors(), before);
}

}  // namespace
}  // namespace dexcheck::testing::program_process_test
