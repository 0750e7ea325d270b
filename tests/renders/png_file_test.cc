#include "renders/png_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "controller/common/errors.h"
#include "tests/common/files.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::png_file_test {
namespace {

namespace fs = std::filesystem;

TEST(PngFile, ReadsBackWhatItWrote) {
  std::mt19937 random(1);
  Image image(37, 23);
  for (std::uint8_t& value : image.rgb) value = static_cast<std::uint8_t>(random());
  const TempFolder folder;
  WritePng(folder.path() / "a.png", image);
  const Image read = ReadPng(folder.path() / "a.png");
  EXPECT_EQ(read.width, 37);
  EXPECT_EQ(read.height, 23);
  EXPECT_EQ(read.rgb, image.rgb);
}

TEST(PngFile, ReplacesAnExistingFileWhole) {
  const TempFolder folder;
  testing::WriteText(folder.path() / "a.png", "old");
  WritePng(folder.path() / "a.png", Image(3, 3));
  EXPECT_EQ(ReadPng(folder.path() / "a.png").width, 3);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

TEST(PngFile, NamesTheFileThatCannotBeWritten) {
  const TempFolder folder;
  EXPECT_TRUE(
      Throws<InputError>([&] { WritePng(folder.path(), Image(2, 2)); }, "cannot be written: Is a directory"));
  EXPECT_TRUE(Throws<InputError>([&] { WritePng(folder.path() / "no/a.png", Image(2, 2)); },
                                 "no/a.png: cannot be written: No such file or directory"));
  EXPECT_TRUE(
      Throws<InputError>([&] { WritePng("/dev/null", Image(2, 2)); }, "/dev/null: cannot be written"));
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(PngFile, NamesTheFileThatIsNoPicture) {
  EXPECT_TRUE(Throws<InputError>([] { ReadPng("/nowhere/a.png"); }, "/nowhere/a.png: cannot be read"));
  const TempFolder folder;
  WritePng(folder.path() / "a.png", Image(30, 30));
  const std::string text = testing::ReadText(folder.path() / "a.png");
  testing::WriteText(folder.path() / "a.png", text.substr(0, text.size() / 2));
  EXPECT_TRUE(Throws<InputError>([&] { ReadPng(folder.path() / "a.png"); }, "a.png: cannot be read"));
}

}  // namespace
}  // namespace dexcheck::testing::png_file_test
