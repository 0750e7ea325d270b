#include "tests/harness/descriptions/robot_pairs.h"

#include <random>

#include "controller/model/rigid_body.h"
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

bool SpoilLink(const ConventionFault& fault, size_t i, RobotDescription* robot) {
  Joint& joint = robot->spec.joints[i];
  const Pose X_iL = robot->joints[i].X_iL;
  const Pose X_PiP =
      (joint.parent < 0 ? Pose::Identity() : robot->joints[static_cast<size_t>(joint.parent)].X_iL) *
      robot->joints[i].X_PW;
  StatedLink link{ExpressIn(joint.body, X_iL.inverse()), X_PiP.inverse() * joint.X_PB * X_iL};
  link.axis = X_iL.linear().row(2).transpose();
  std::vector<DescribedPart*> parts;
  for (DescribedPart& part : robot->parts) {
    if (part.joint == static_cast<int>(i) && part.states_inertial) parts.push_back(&part);
  }
  if (parts.size() == 1) link.R_LC = parts[0]->X_LC.linear();
  const StatedLink right = link;
  fault.make(&link);
  if (parts.size() == 1) parts[0]->X_LC.linear() = link.R_LC;
  joint.body = ExpressIn(link.body, X_iL);
  joint.X_PB = X_PiP * link.X_PL * X_iL.inverse();
  constexpr double kVisible = 1e-3;
  return std::abs(link.body.mass - right.body.mass) > kVisible * right.body.mass ||
         (link.body.com - right.body.com).norm() > kVisible ||
         (link.body.inertia - right.body.inertia).norm() > kVisible * right.body.inertia.trace() ||
         (link.X_PL.matrix() - right.X_PL.matrix()).norm() > kVisible;
}

}  // namespace dexcheck::testing
