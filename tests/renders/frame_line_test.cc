#include "renders/frame_line.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <new>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>

#include "controller/common/errors.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::frame_line_test {
namespace {

constexpr int kWidth = 6;
constexpr int kHeight = 4;

/// A picture of one colour.
Image Fill(long red, long green, long blue) {
  Image image(kWidth, kHeight);
  for (size_t i = 0; i < image.rgb.size(); i += 3) {
    image.rgb[i] = static_cast<std::uint8_t>(red);
    image.rgb[i + 1] = static_cast<std::uint8_t>(green);
    image.rgb[i + 2] = static_cast<std::uint8_t>(blue);
  }
  return image;
}

/// A line of which every process draws frames with the same function.
FrameLine MakeLine(const FrameLine::Painter& paint, long frames, int workers) {
  return {[&] { return paint; }, frames, workers, kWidth, kHeight};
}

/// Numbers that all processes see.
class SharedCounter {
 public:
  SharedCounter()
      : count_(new (::mmap(nullptr, sizeof(*count_), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1,
                           0)) std::atomic<long>(0)) {}
  ~SharedCounter() { ::munmap(count_, sizeof(*count_)); }
  SharedCounter(const SharedCounter&) = delete;
  SharedCounter& operator=(const SharedCounter&) = delete;
  std::atomic<long>& operator*() { return *count_; }

 private:
  std::atomic<long>* count_;
};

bool HasChildren() { return ::waitpid(-1, nullptr, WNOHANG) >= 0 || errno != ECHILD; }

TEST(FrameLineTest, HandsFramesOverInOrder) {
  for (const int workers : {1, 2, 3, 7}) {
    SCOPED_TRACE(workers);
    constexpr long kFrames = 20;
    std::set<int> processes;
    {
      // Every fifth frame takes longer. The process shows in the picture.
      FrameLine line = MakeLine(
          [](long frame) {
            std::this_thread::sleep_for(std::chrono::milliseconds(frame % 5 == 0 ? 10 : 1));
            return Fill(frame, ::getpid() / 256 % 256, ::getpid() % 256);
          },
          kFrames, workers);
      for (long frame = 0; frame < kFrames; ++frame) {
        const Image image = line.Take();
        ASSERT_EQ(image.rgb, Fill(frame, image.rgb[1], image.rgb[2]).rgb);
        processes.insert(256 * image.rgb[1] + image.rgb[2]);
      }
      EXPECT_TRUE(Throws<std::invalid_argument>([&] { line.Take(); }, "frame: must be one of the video's"));
    }
    EXPECT_EQ(processes.size(), static_cast<size_t>(workers));
    EXPECT_FALSE(processes.contains(::getpid() % 65536));
    EXPECT_FALSE(HasChildren());
  }
}

TEST(FrameLineTest, HasNoMoreProcessesThanFrames) {
  SharedCounter made;
  FrameLine line(
      [&] {
        ++*made;
        return [](long frame) { return Fill(frame, 0, 0); };
      },
      2, 5, kWidth, kHeight);
  line.Take();
  line.Take();
  EXPECT_EQ(*made, 2);
}

TEST(FrameLineTest, FewFramesWaitToBeTaken) {
  SharedCounter drawn;
  constexpr int kWorkers = 2;
  constexpr int kLarge = 1000;  // pixels: one picture fills a channel
  FrameLine line(
      [&] {
        return [&](long) {
          ++*drawn;
          return Image(kLarge, kLarge);
        };
      },
      100, kWorkers, kLarge, kLarge);
  const auto settle = [&](long expected) {
    for (int k = 0; k < 1000 && *drawn < expected; ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return (*drawn).load();
  };
  EXPECT_EQ(settle(kWorkers), kWorkers);
  line.Take();
  EXPECT_EQ(settle(kWorkers + 1), kWorkers + 1);
}

TEST(FrameLineTest, ErrorsReachTheCaller) {
  const auto take = [](const FrameLine::Painter& paint) {
    return [&paint] {
      FrameLine line = MakeLine(paint, 5, 2);
      for (int frame = 0; frame < 5; ++frame) EXPECT_EQ(line.Take().rgb, Fill(frame, 0, 0).rgb);
    };
  };
  const auto fail_at_3 = [](const auto& fail) {
    return [fail](long frame) {
      if (frame == 3) fail();
      return Fill(frame, 0, 0);
    };
  };
  EXPECT_TRUE(Throws<InputError>(take(fail_at_3([] { throw InputError("a.h5: time: is odd"); })),
                                 "a.h5: time: is odd"));
  EXPECT_TRUE(Throws<std::invalid_argument>(take(fail_at_3([] { Require(false, "size", "must be 2", 3); })),
                                            "size: must"));
  EXPECT_TRUE(Throws<Error>(take(fail_at_3([] { throw std::bad_alloc(); })), "drawing: std::bad_alloc"));
  EXPECT_TRUE(Throws<Error>(take(fail_at_3([] { throw 3; })), "drawing: unknown error"));
  EXPECT_TRUE(
      Throws<Error>(take(fail_at_3([] { ::kill(::getpid(), SIGKILL); })), "drawing: a process died: Killed"));
  EXPECT_TRUE(
      Throws<Error>(take(fail_at_3([] { ::_exit(0); })), "drawing: a process died: it ended too early"));
  EXPECT_TRUE(Throws<std::invalid_argument>(take([](long) { return Image(kWidth, kHeight + 1); }),
                                            "frame height: must be the video's, got 5"));
  EXPECT_FALSE(HasChildren());
}

TEST(FrameLineTest, ErrorsOfTheBeginningReachTheCaller) {
  FrameLine line([]() -> FrameLine::Painter { throw InputError("camera: no such"); }, 5, 2, kWidth, kHeight);
  EXPECT_TRUE(Throws<InputError>([&] { line.Take(); }, "camera: no such"));
  EXPECT_TRUE(Throws<Error>([&] { line.Take(); }, "drawing: a process died")) << "no second answer";
}

TEST(FrameLineTest, EndsProcessesThatStillDraw) {
  const auto start = std::chrono::steady_clock::now();
  {
    FrameLine line = MakeLine(
        [](long frame) {
          if (frame > 0) ::pause();
          return Fill(frame, 0, 0);
        },
        5, 3);
    line.Take();
  }
  EXPECT_FALSE(HasChildren());
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(30));
}

TEST(FrameLineTest, ProcessesEndWithTheirParent) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const pid_t parent = ::fork();
  if (parent == 0) {
    ::close(ends[0]);
    FrameLine line = MakeLine(
        [](long frame) {
          if (frame > 1) ::pause();
          return Fill(frame, 0, 0);
        },
        5, 2);
    line.Take();
    line.Take();
    ::kill(::getpid(), SIGKILL);
  }
  ::close(ends[1]);
  // The end of the pipe comes when no process is left that could write.
  char byte = 0;
  EXPECT_EQ(::read(ends[0], &byte, 1), 0);
  ::close(ends[0]);
  ::waitpid(parent, nullptr, 0);
}

TEST(FrameLineTest, RefusesWhatCannotBeDrawn) {
  const FrameLine::Painter paint = [](long frame) { return Fill(frame, 0, 0); };
  EXPECT_TRUE(Throws<std::invalid_argument>([&] { MakeLine(paint, 0, 2); }, "frames: must be positive"));
  EXPECT_TRUE(Throws<std::invalid_argument>([&] { MakeLine(paint, 2, 0); }, "workers: must be positive"));
}

}  // namespace
}  // namespace dexcheck::testing::frame_line_test
