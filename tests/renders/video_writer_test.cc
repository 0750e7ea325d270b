// Videos and pictures as ffprobe and ffmpeg see them.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "controller/common/errors.h"
#include "renders/video.h"
#include "tests/common/files.h"
#include "tests/common/full_disk.h"
#include "tests/common/run_program.h"
#include "tests/common/throws.h"
#include "tests/renders/decode.h"
#include "tests/renders/read_png.h"

namespace dexcheck::testing::video_writer_test {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 128;
constexpr int kHeight = 72;

EncodingOptions MakeOptions() {
  EncodingOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.fps = 25;
  return options;
}

/// A picture of one colour, which changes from frame to frame.
Image MakeFrame(int number) {
  Image image(kWidth, kHeight);
  for (size_t i = 0; i < image.rgb.size(); i += 3) {
    image.rgb[i] = static_cast<std::uint8_t>(20 + 8 * number);
    image.rgb[i + 1] = 120;
    image.rgb[i + 2] = static_cast<std::uint8_t>(220 - 8 * number);
  }
  return image;
}

void WriteVideo(const fs::path& path, int frames) {
  VideoWriter video(path, MakeOptions());
  for (int k = 0; k < frames; ++k) video.Write(MakeFrame(k));
  EXPECT_FALSE(fs::exists(path)) << "the name appears when the file is complete";
  video.Finish();
  EXPECT_EQ(video.frames(), frames);
}

/// ffprobe's description of a file with one stream.
nlohmann::json Probe(const fs::path& path) {
  const ProgramResult probe = RunProgram({DEXCHECK_FFPROBE, "-v", "error", "-count_frames", "-show_streams",
                                          "-show_format", "-of", "json", path.string()});
  EXPECT_EQ(probe.exit_code, 0) << probe.err;
  EXPECT_EQ(probe.err, "");
  const nlohmann::json json = nlohmann::json::parse(probe.out);
  EXPECT_EQ(json["streams"].size(), 1U);
  return json;
}

TEST(VideoWriter, WritesWhatBrowsersPlay) {
  // Plain colours survive chroma subsampling; conversion to 8-bit YUV and quantisation cost a few levels.
  // With the matrix of standard definition the green of these frames would be off by ten levels and more.
  constexpr int kLevels = 6;
  constexpr size_t kFrame = 3UL * kWidth * kHeight;
  const TempFolder folder;
  const fs::path path = folder.path() / "A video.MP4";
  WriteVideo(path, 20);
  const nlohmann::json json = Probe(path);
  const nlohmann::json& stream = json["streams"][0];
  EXPECT_EQ(stream["codec_name"], "h264");
  EXPECT_EQ(json["format"]["format_name"].get<std::string>().find("mov,mp4"), 0U);
  EXPECT_EQ(stream["width"], kWidth);
  EXPECT_EQ(stream["height"], kHeight);
  EXPECT_EQ(stream["nb_read_frames"], "20");
  EXPECT_EQ(stream["avg_frame_rate"], "25/1");
  EXPECT_NEAR(std::stod(json["format"]["duration"].get<std::string>()), 20.0 / 25.0, 1e-3);
  EXPECT_EQ(stream["pix_fmt"], "yuv420p");
  EXPECT_EQ(stream["color_space"], "bt709");
  EXPECT_EQ(stream["color_range"], "tv");
  const std::string decoded = Decode(path);
  ASSERT_EQ(decoded.size(), 20 * kFrame);
  for (size_t k = 0; k < 20; ++k) {
    const Image expected = MakeFrame(static_cast<int>(k));
    for (const size_t i : {size_t{0}, kFrame / 2, kFrame - 3}) {
      for (size_t c = i; c < i + 3; ++c) {
        const int value = static_cast<unsigned char>(decoded[k * kFrame + c]);
        EXPECT_NEAR(value, expected.rgb[c], kLevels) << "frame " << k << ", byte " << c;
      }
    }
  }
}

TEST(VideoWriter, RefusesNamesOfOtherFormats) {
  const TempFolder folder;
  for (const char* name : {"a.avi", "a.png", "a", "mp4", "a.mp4.txt"}) {
    EXPECT_TRUE(Throws<InputError>([&] { VideoWriter video(folder.path() / name, MakeOptions()); },
                                   "the name must end in .mp4"));
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(VideoWriter, LeavesNothingUnlessFinished) {
  const TempFolder folder;
  WriteText(folder.path() / "old.mp4", "old");
  {
    VideoWriter video(folder.path() / "old.mp4", MakeOptions());
    for (int k = 0; k < 10; ++k) video.Write(MakeFrame(k));
  }
  EXPECT_EQ(ReadText(folder.path() / "old.mp4"), "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

TEST(VideoWriter, RefusesAVideoWithoutFrames) {
  const TempFolder folder;
  {
    VideoWriter video(folder.path() / "a.mp4", MakeOptions());
    EXPECT_TRUE(Throws<InputError>([&] { video.Finish(); }, "a.mp4: cannot be written: there are no frames"));
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(VideoWriter, NamesThePathThatCannotBeWritten) {
  const TempFolder folder;
  const auto open = [](const fs::path& path) { return [path] { VideoWriter video(path, MakeOptions()); }; };
  EXPECT_TRUE(Throws<InputError>(open(folder.path()), "cannot be written: Is a directory"));
  EXPECT_TRUE(Throws<InputError>(open("/nowhere/a.mp4"), "/nowhere/a.mp4: cannot be written: No such file"));
  EXPECT_TRUE(Throws<InputError>(open("/dev/full"), "/dev/full: cannot be written: not a regular file"));
  EXPECT_TRUE(Throws<InputError>(open(""), "cannot be written: the name is empty"));
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(VideoWriter, AFullDiskLeavesNothing) {
  const TempFolder folder;
  {
    const FullDisk full(1000);
    EXPECT_TRUE(Throws<InputError>([&] { WriteVideo(folder.path() / "a.mp4", 60); },
                                   "a.mp4: cannot be written: File size limit exceeded"));
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

/// Colours that change smoothly over the picture; odd sizes, as a user may want.
Image MakePicture() {
  Image image(51, 33);
  for (int row = 0; row < image.height; ++row) {
    for (int col = 0; col < image.width; ++col) {
      std::uint8_t* const rgb = &image.rgb[static_cast<size_t>(3 * (row * image.width + col))];
      rgb[0] = static_cast<std::uint8_t>(5 * col);
      rgb[1] = static_cast<std::uint8_t>(7 * row);
      rgb[2] = static_cast<std::uint8_t>(200 - 3 * col);
    }
  }
  return image;
}

TEST(PictureFile, WritesAPngOrNothing) {
  const TempFolder folder;
  WritePng(folder.path() / "a.PNG", MakePicture());
  EXPECT_EQ(ReadPng(folder.path() / "a.PNG").rgb, MakePicture().rgb);
  for (const char* name : {"a.gif", "a", "png", "a.png.txt"}) {
    EXPECT_TRUE(Throws<InputError>([&] { WritePng(folder.path() / name, MakePicture()); },
                                   "the name must end in .png"));
  }
  EXPECT_TRUE(Throws<InputError>([&] { WritePng("/nowhere/a.png", MakePicture()); },
                                 "/nowhere/a.png: cannot be written: No such file"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
}

}  // namespace
}  // namespace dexcheck::testing::video_writer_test
