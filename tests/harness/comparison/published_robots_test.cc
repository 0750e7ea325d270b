// Robots of the kinds that are published, each written as a URDF and as an MJCF from one list of numbers:
// arms, a hand, a gripper on an arm, a torso with two arms, walking robots that float. By URDF, by MJCF in
// the engine, and by the parameter file that is imported from either they are one robot; with one number
// changed they are not, and the link is named.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "harness/comparison/file_differences.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/read_description.h"
#include "tests/common/files.h"
#include "tests/common/legged_robots.h"
#include "tests/common/matchers.h"

namespace dexcheck::testing::published_robots_test {
namespace {

struct PublishedRobot {
  std::string name;
  bool floats = false;
  std::vector<LeggedLink> links;
};

void PrintTo(const PublishedRobot& robot, std::ostream* out) { *out << robot.name; }

/// A body of this mass whose moments grow with its length, not symmetric in anything.
LeggedLink MakeLink(const std::string& name, const std::string& parent, const std::string& xyz,
                    const std::string& rpy, const std::string& axis, double mass, double length) {
  const double I = mass * length * length / 10.0;
  const std::string moments =
      fmt::format("{:.8f} {:.8f} {:.8f}", 1.1 * I + 1e-6, 0.9 * I + 1e-6, 0.4 * I + 1e-6);
  const std::string com = fmt::format("{:.4f} {:.4f} {:.4f}", 0.05 * length, -0.03 * length, 0.45 * length);
  return {name, parent, xyz, rpy, axis, mass, com, "0.1 -0.2 0.3", moments};
}

LeggedLink MakeWelded(const std::string& name, const std::string& parent, const std::string& xyz,
                      double mass) {
  LeggedLink link = MakeLink(name, parent, xyz, "0.3 0.2 -0.1", "", mass, 0.05);
  link.has_joint = false;
  return link;
}

std::string Number(int i) { return std::to_string(i); }

/// Shoulder, upper arm, forearm and three wrist joints, with offsets and a tool.
void AddSixAxisArm(const std::string& prefix, const std::string& base, const std::string& xyz,
                   std::vector<LeggedLink>* links) {
  const std::string axes[] = {"0 0 1", "0 1 0", "0 1 0", "0 1 0", "0 0 1", "0 1 0"};
  const std::string places[] = {xyz,          "0 0.1358 0", "0.425 -0.1197 0",
                                "0.3922 0 0", "0 0.093 0",  "0.0946 0 0"};
  const double masses[] = {3.7, 8.393, 2.275, 1.219, 1.219, 0.1879};
  std::string parent = base;
  for (int i = 0; i < 6; ++i) {
    const std::string name = prefix + "link" + Number(i + 1);
    links->push_back(MakeLink(name, parent, places[i], i == 3 ? "0 1.570796326794897 0" : "0 0 0", axes[i],
                              masses[i], i < 3 ? 0.4 : 0.1));
    parent = name;
  }
  links->push_back(MakeWelded(prefix + "tool", parent, "0 0.08 0.01", 0.6));
}

void AddSevenAxisArm(const std::string& prefix, const std::string& base, const std::string& xyz,
                     std::vector<LeggedLink>* links) {
  std::string parent = base;
  for (int i = 0; i < 7; ++i) {
    const std::string name = prefix + "arm" + Number(i);
    const char* const turn = i == 0       ? "0 0 0"
                             : i % 2 == 1 ? "-1.570796326794897 0 0"
                                          : "1.570796326794897 0 0";
    links->push_back(MakeLink(name, parent,
                              i == 0       ? xyz
                              : i % 2 == 1 ? "0.01 0 0.1"
                                           : "0 -0.2 0",
                              turn, "0 0 1", 3.5 - 0.4 * i, 0.25));
    parent = name;
  }
}

/// Four joints, the first of which spreads.
void AddFinger(const std::string& prefix, const std::string& palm, const std::string& xyz,
               const std::string& rpy, std::vector<LeggedLink>* links) {
  std::string parent = palm;
  for (int i = 0; i < 4; ++i) {
    const std::string name = prefix + "phalanx" + Number(i);
    links->push_back(MakeLink(name, parent, i == 0 ? xyz : "0 0 0.0384", i == 0 ? rpy : "0 0.05 0",
                              i == 0 ? "0 0 1" : "0 1 0", 0.05 - 0.01 * i, 0.04));
    parent = name;
  }
  links->push_back(MakeWelded(prefix + "tip", parent, "0 0 0.0267", 0.017));
}

void AddLeg(const std::string& prefix, const std::string& xyz, const std::string& rpy,
            std::vector<LeggedLink>* links) {
  links->push_back(MakeLink(prefix + "coxa", "body", xyz, rpy, "0 0 1", 0.3, 0.06));
  links->push_back(MakeLink(prefix + "femur", prefix + "coxa", "0.06 0 0", "0 0.2 0", "0 1 0", 0.4, 0.1));
  links->push_back(MakeLink(prefix + "tibia", prefix + "femur", "0.1 0 0", "0 0.9 0", "0 1 0", 0.2, 0.15));
}

std::vector<PublishedRobot> ListPublishedRobots() {
  // A URDF has no place for its root.
  const LeggedLink stand = MakeLink("stand", "", "0 0 0", "0 0 0", "", 4.0, 0.2);
  std::vector<PublishedRobot> robots;
  robots.push_back({"SixAxisArm", false, {stand}});
  AddSixAxisArm("", "stand", "0 0 0.163", &robots.back().links);
  robots.push_back({"SevenAxisArm", false, {stand}});
  AddSevenAxisArm("", "stand", "0 0 0.33", &robots.back().links);
  robots.push_back({"Hand", false, {stand}});
  for (int i = 0; i < 4; ++i) {
    AddFinger("finger" + Number(i) + "_", "stand", fmt::format("{} 0.01 0.05", 0.03 * i),
              i == 3 ? "0 0 1.2" : "0.05 0 0", &robots.back().links);
  }
  robots.push_back({"ArmWithHand", false, {stand}});
  AddSevenAxisArm("", "stand", "0 0 0.33", &robots.back().links);
  AddFinger("left_", "arm6", "0 0.03 0.1", "0 0 0", &robots.back().links);
  AddFinger("right_", "arm6", "0 -0.03 0.1", "0 0 3.14", &robots.back().links);
  robots.push_back({"TorsoWithTwoArms", false, {stand}});
  robots.back().links.push_back(MakeLink("waist", "stand", "0 0 0.4", "0 0 0", "0 0 1", 6.0, 0.3));
  robots.back().links.push_back(MakeLink("chest", "waist", "0 0 0.3", "0 0.1 0", "0 1 0", 9.0, 0.4));
  AddSixAxisArm("left_", "chest", "0 0.2 0.3", &robots.back().links);
  AddSixAxisArm("right_", "chest", "0 -0.2 0.3", &robots.back().links);
  robots.push_back({"FloatingArm", true, {MakeLink("satellite", "", "0 0 0", "0 0 0", "", 80.0, 1.0)}});
  AddSixAxisArm("", "satellite", "0.4 0.1 0.5", &robots.back().links);
  robots.push_back({"Hexapod", true, {MakeLink("body", "", "0 0 0.2", "0 0 0", "", 3.0, 0.2)}});
  for (int i = 0; i < 6; ++i) {
    AddLeg("leg" + Number(i) + "_", fmt::format("{} {} 0", 0.1 - 0.1 * (i % 3), i < 3 ? 0.08 : -0.08),
           fmt::format("0 0 {}", i < 3 ? 1.4 : -1.4), &robots.back().links);
  }
  robots.push_back({"Quadruped", true, ListQuadruped()});
  robots.push_back({"Humanoid", true, ListHumanoid()});
  return robots;
}

class PublishedRobots : public ::testing::TestWithParam<PublishedRobot> {
 protected:
  void Write(const std::string& name, const std::vector<LeggedLink>& links) const {
    WriteText(folder_.path() / (name + ".urdf"), WriteLeggedUrdf(GetParam().name, links));
    WriteText(folder_.path() / (name + ".xml"),
              WriteLeggedMjcf(GetParam().name, links, GetParam().floats ? "<freejoint/>" : ""));
  }
  [[nodiscard]] Comparison Compare(const std::string& a, const std::string& b, long samples) const {
    ConsistencyOptions options;
    options.samples = samples;
    return CompareFiles(folder_.path() / a, folder_.path() / b, urdf(), options);
  }
  [[nodiscard]] UrdfOptions urdf() const {
    UrdfOptions options;
    options.floating = GetParam().floats;
    return options;
  }
  static std::string List(const Comparison& comparison) {
    std::string text;
    for (const std::string& line : ListDifferences(comparison)) text += line + "\n";
    return text;
  }

  TempFolder folder_;
};

TEST_P(PublishedRobots, AreTheSameInEachFormat) {
  Write("robot", GetParam().links);
  const std::filesystem::path urdf_file = folder_.path() / "robot.urdf";
  for (const std::string source : {"robot.urdf", "robot.xml"}) {
    const RobotDescription robot = ReadDescription(folder_.path() / source, urdf());
    EXPECT_EQ(robot.spec.base.type == BaseType::kFloating, GetParam().floats) << source;
    WriteText(folder_.path() / (source + ".toml"), WriteParameters(robot, source));
  }
  for (const auto& [a, b] :
       {std::pair("robot.urdf", "robot.xml"), std::pair("robot.urdf", "robot.urdf.toml"),
        std::pair("robot.xml.toml", "robot.urdf"), std::pair("robot.xml.toml", "robot.urdf.toml")}) {
    const Comparison comparison = Compare(a, b, 10);
    EXPECT_EQ(List(comparison), "") << a << " against " << b;
    EXPECT_TRUE(comparison.Agrees()) << a << " against " << b;
    EXPECT_GE(comparison.result.terms.size(), 12U);
  }
}

TEST_P(PublishedRobots, DifferWhenOneNumberDoes) {
  std::vector<LeggedLink> links = GetParam().links;
  Write("right", links);
  size_t changed = links.size() / 2;
  while (!links[changed].has_joint) ++changed;
  const LeggedLink& link = links[changed];
  links[changed].mass *= 1000.0;
  Write("wrong", links);
  const Comparison comparison = Compare("wrong.urdf", "right.xml", 5);
  EXPECT_FALSE(comparison.Agrees());
  EXPECT_THAT(List(comparison), HasSubstr("link " + link.name)) << link.name;
}

INSTANTIATE_TEST_SUITE_P(Sides, PublishedRobots, ::testing::ValuesIn(ListPublishedRobots()),
                         [](const auto& tried) { return tried.param.name; });

}  // namespace
}  // namespace dexcheck::testing::published_robots_test
