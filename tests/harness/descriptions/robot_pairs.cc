#include "tests/harness/descriptions/robot_pairs.h"

#include <random>

#include "harness/descriptions/mjcf_reader.h"
#include "harness/descriptions/read_description.h"
#include "harness/engine/engine.h"
#include "tests/common/legged_robots.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"
#include "tests/common/urdf_text.h"
#include "tests/harness/descriptions/panda_urdf.h"

namespace dexcheck::testing {
namespace {

RobotPair MakeRandomPair(int seed, BaseType base) {
  std::mt19937 random(static_cast<unsigned>(seed));
  RandomRobotOptions options;
  options.base = base;
  options.joints = 6;
  options.branching = 0.2;
  options.prismatic = 0.1;
  RobotSpec spec = MakeRandomRobot(options, &random);
  RobotDescription a = ParseUrdf(WriteUrdf(&spec, &random), "a.urdf");
  return {"random" + std::to_string(seed), a,
          ReadMjcfDescription(*LoadMjcfText(WriteMjcf(spec), "b.xml"), "b.xml")};
}

}  // namespace

const std::vector<RobotPair>& ListRobotPairs() {
  static const std::vector<RobotPair> robots = [] {
    const std::vector<LeggedLink> humanoid = ListHumanoid();
    std::vector<RobotPair> list;
    list.push_back(
        {"panda", ParseUrdf(MakePandaUrdf(), "panda.urdf"), ReadDescription(SourcePath("/mjcf/panda.xml"))});
    list.push_back({"humanoid", ParseUrdf(WriteLeggedUrdf("humanoid", humanoid), "humanoid.urdf"),
                    ReadMjcfDescription(*LoadMjcfText(WriteLeggedMjcf("humanoid", humanoid), "humanoid.xml"),
                                        "humanoid.xml")});
    list.push_back(MakeRandomPair(1730, BaseType::kFixed));
    list.push_back(MakeRandomPair(1731, BaseType::kFloating));
    return list;
  }();
  return robots;
}

}  // namespace dexcheck::testing
