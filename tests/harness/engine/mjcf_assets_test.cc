// Meshes and textures that are missing or damaged.

#include <gmock/gmock.h>

#include <cstring>

#include "controller/common/errors.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_passes.h"
#include "tests/common/files.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::mjcf_assets_test {
namespace {

/// A tetrahedron's corners, and its faces with their normals outwards.
constexpr float kCorners[4][3] = {{0, 0, 0}, {0.1F, 0, 0}, {0, 0.1F, 0}, {0, 0, 0.1F}};
constexpr int kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

template <typename T>
void Append(const T& value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string MakeStl() {
  std::string bytes(80, ' ');
  Append(std::uint32_t{4}, &bytes);
  for (const auto& face : kFaces) {
    for (int i = 0; i < 3; ++i) Append(0.0F, &bytes);
    for (const int corner : face) Append(kCorners[corner], &bytes);
    Append(std::uint16_t{0}, &bytes);
  }
  return bytes;
}

std::string MakeMsh() {
  std::string bytes;
  for (const int count : {4, 0, 0, 4}) Append(count, &bytes);
  Append(kCorners, &bytes);
  Append(kFaces, &bytes);
  return bytes;
}

std::string MakeObj() {
  std::string text;
  for (const auto& corner : kCorners) {
    text += "v";
    for (const float x : corner) text += " " + std::to_string(x);
    text += "\n";
  }
  for (const auto& face : kFaces) {
    text += "f";
    for (const int corner : face) text += " " + std::to_string(corner + 1);
    text += "\n";
  }
  return text;
}

/// A link whose geom has attributes and whose mesh is in a file.
std::string WriteMjcf(const std::string& file, const std::string& geom, const std::string& in_body) {
  return "<mujoco>\n<asset><mesh name=\"shell\" file=\"" + file +
         "\"/></asset>\n<worldbody><body name=\"link\"><joint axis=\"0 1 0\"/>\n" + in_body +
         R"(<geom name="cover" type="mesh" mesh="shell" )" + geom + "/></body></worldbody></mujoco>\n";
}

constexpr const char* kInertial = R"(<inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.01"/>)";
constexpr const char* kLooks = R"(contype="0" conaffinity="0")";

struct Format {
  const char* file;
  std::string (*make)();
};
constexpr Format kFormats[] = {{"shell.stl", MakeStl}, {"shell.msh", MakeMsh}, {"shell.obj", MakeObj}};

/// Each bit of a mesh's file, flipped: it is read, or refused in one line; the engine's reader is never led
/// beyond the file, which would end this test.
TEST(MjcfAssets, DamagedMeshesAreReadOrRefused) {
  for (const Format& format : kFormats) {
    const TempFolder folder;
    const std::filesystem::path mesh = folder.path() / format.file;
    WriteText(folder.path() / "robot.xml", WriteMjcf(format.file, "", kInertial));
    const std::string good = format.make();
    WriteText(mesh, good);
    EXPECT_EQ(FindMeshFault(mesh), "");
    EXPECT_EQ(LoadMjcf(folder.path() / "robot.xml")->nmesh, 1);
    int refused = 0;
    for (size_t bit = 0; bit < good.size() * 8; ++bit) {
      std::string bad = good;
      bad[bit / 8] = static_cast<char>(bad[bit / 8] ^ (1 << bit % 8));
      WriteText(mesh, bad);
      try {
        LoadMjcf(folder.path() / "robot.xml");
      } catch (const InputError& error) {
        ++refused;
        EXPECT_EQ(std::strchr(error.what(), '\n'), nullptr) << error.what();
      }
      if (!FindMeshFault(mesh).empty()) ++refused;
    }
    EXPECT_GT(refused, 0);
    for (size_t size = 0; size < good.size(); size += 7) {
      WriteText(mesh, good.substr(0, size));
      try {
        LoadMjcf(folder.path() / "robot.xml");
      } catch (const InputError&) {
      }
    }
  }
}

/// A mesh that is missing takes with it what is seen and what touches, nothing of the dynamics.
TEST(MjcfAssets, AMissingMeshIsLeftOut) {
  const TempFolder folder;
  for (const char* geom : {kLooks, ""}) {
    WriteText(folder.path() / "robot.xml", WriteMjcf("no.stl", geom, kInertial));
    const MjModelPtr model = LoadMjcf(folder.path() / "robot.xml");
    EXPECT_EQ(model->nmesh, 0);
    EXPECT_EQ(model->body_mass[1], 1.0);
    EXPECT_EQ(model->nv, 1);
  }
}

TEST(MjcfAssets, AMissingMeshThatHasMassIsNamed) {
  const TempFolder folder;
  WriteText(folder.path() / "robot.xml", WriteMjcf("no.stl", "", ""));
  EXPECT_TRUE(Throws<InputError>([&] { LoadMjcf(folder.path() / "robot.xml"); }, "no.stl"));
}

// A file that is included in one that is included, and its mesh, are found from the folder that is loaded, or
// else beside the file that names them.
TEST(MjcfAssets, LieBesideTheFileThatNamesThem) {
  const TempFolder folder;
  const std::filesystem::path parts = folder.path() / "parts";
  std::filesystem::create_directories(parts / "links");
  WriteText(folder.path() / "robot.xml", R"(<mujoco><include file="parts/arm.xml"/></mujoco>)");
  WriteText(parts / "arm.xml", R"(<mujoco><include file="links/link.xml"/></mujoco>)");
  const auto write = [&](const std::string& mesh) {
    WriteText(parts / "links/link.xml", WriteMjcf(mesh, "", ""));
  };
  WriteText(parts / "shell.stl", MakeStl());
  write("../shell.stl");
  const double mass = LoadMjcf(folder.path() / "robot.xml")->body_mass[1];
  EXPECT_GT(mass, 0.1);
  EXPECT_THAT(
      ListMjcfFiles(folder.path() / "robot.xml"),
      ::testing::ElementsAre("robot.xml", "parts/arm.xml", "parts/links/link.xml", "parts/shell.stl"));
  write("parts/shell.stl");
  EXPECT_EQ(LoadMjcf(folder.path() / "robot.xml")->body_mass[1], mass);
  write("shell.stl");
  EXPECT_TRUE(Throws<InputError>([&] { LoadMjcf(folder.path() / "robot.xml"); },
                                 "parts/links/link.xml:4: mesh \"shell.stl\": does not exist"));
}

}  // namespace
}  // namespace dexcheck::testing::mjcf_assets_test
