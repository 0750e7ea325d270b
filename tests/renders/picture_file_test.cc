#include <gtest/gtest.h>

#include <filesystem>

#include "controller/common/errors.h"
#include "renders/video_writer.h"
#include "tests/common/files.h"
#include "tests/common/run_program.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::picture_file_test {
namespace {

namespace fs = std::filesystem;

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

TEST(PictureFile, AJpegDecodesToThePicture) {
  const TempFolder folder;
  const fs::path path = folder.path() / "a.jpg";
  const Image picture = MakePicture();
  WritePicture(path, picture);
  const testing::ProgramResult decoded = testing::RunProgram(
      {DEXCHECK_FFMPEG, "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"});
  ASSERT_EQ(decoded.exit_code, 0) << decoded.err;
  ASSERT_EQ(decoded.out.size(), picture.rgb.size());
  // Quantisation at the quality that is used; measured 6.
  constexpr int kLevels = 12;
  for (size_t i = 0; i < picture.rgb.size(); ++i) {
    ASSERT_NEAR(static_cast<unsigned char>(decoded.out[i]), picture.rgb[i], kLevels) << i;
  }
}

TEST(PictureFile, WritesWhatTheNameSaysOrNothing) {
  const TempFolder folder;
  WritePicture(folder.path() / "a.PNG", MakePicture());
  EXPECT_EQ(ReadPng(folder.path() / "a.PNG").rgb, MakePicture().rgb);
  for (const char* name : {"a.gif", "a", "jpg", "a.jpg.txt"}) {
    EXPECT_TRUE(Throws<InputError>([&] { WritePicture(folder.path() / name, MakePicture()); },
                                   "a picture's name must end in .png, .jpg or .jpeg"));
  }
  EXPECT_TRUE(Throws<InputError>([&] { WritePicture("/nowhere/a.jpg", MakePicture()); },
                                 "/nowhere/a.jpg: cannot be written: No such file"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
}

TEST(PictureFile, ReplacesAnExistingFileWhole) {
  const TempFolder folder;
  testing::WriteText(folder.path() / "a.png", "old");
  WritePicture(folder.path() / "a.png", Image(3, 3));
  EXPECT_EQ(ReadPng(folder.path() / "a.png").width, 3);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

TEST(PictureFile, NamesTheFileThatIsNoPicture) {
  EXPECT_TRUE(Throws<InputError>([] { ReadPng("/nowhere/a.png"); }, "/nowhere/a.png: cannot be read"));
  const TempFolder folder;
  WritePicture(folder.path() / "a.png", MakePicture());
  const std::string text = testing::ReadText(folder.path() / "a.png");
  testing::WriteText(folder.path() / "a.png", text.substr(0, text.size() / 2));
  EXPECT_TRUE(Throws<InputError>([&] { ReadPng(folder.path() / "a.png"); }, "a.png: cannot be read"));
}

}  // namespace
}  // namespace dexcheck::testing::picture_file_test
