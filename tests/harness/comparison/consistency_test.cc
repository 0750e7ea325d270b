// The comparison of all terms on random robots: it agrees on right models, within bounds that stay small, and
// finds wrong ones.

#include "harness/comparison/consistency.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "controller/model/parameter_reader.h"
#include "harness/descriptions/engine_provider.h"
#include "harness/engine/engine.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::consistency_test {
namespace {

constexpr double kLargestBound = 1e-11;

const auto kGoOn = [](long) { return true; };

ConsistencyResult Compare(const RobotSpec& spec, const MjModelPtr& engine, long samples,
                          std::uint64_t seed = 1) {
  const RobotModel model(spec);
  ConsistencyOptions options;
  options.samples = samples;
  options.seed = seed;
  return CheckConsistency(Adapter(model, *engine, "text"), options, kGoOn);
}

/// A chain's MJCF from files that include each other, since the engine's XML reader takes at most a hundred
/// nested elements of one file.
MjModelPtr LoadLongChain(const RobotSpec& spec) {
  constexpr size_t kLinksPerFile = 80;
  const std::string kEnd = "</body>\n";
  const TempFolder folder;
  std::string text = WriteMjcf(spec);
  const size_t count = spec.joints.size();
  for (size_t link = (count - 1) / kLinksPerFile * kLinksPerFile; link > 0; link -= kLinksPerFile) {
    // From this link's body to the end of it: in a chain all bodies end together.
    const std::string file = fmt::format("from_{}.xml", link);
    const size_t begin = text.find(fmt::format(R"(<body name="link_{}")", link));
    const size_t end = text.find(kEnd, begin) + (std::min(count - link, kLinksPerFile)) * kEnd.size();
    WriteText(folder.path() / file, "<mujoco>" + text.substr(begin, end - begin) + "</mujoco>");
    text.replace(begin, end - begin, fmt::format("<include file=\"{}\"/>\n", file));
  }
  WriteText(folder.path() / "chain.xml", text);
  return LoadMjcf(folder.path() / "chain.xml");
}

/// The checks that failed, and the largest fraction of its bound that any other used.
std::string ListFailures(const ConsistencyResult& result, double* fraction) {
  std::string failures;
  for (const std::vector<CheckRecord>* records : {&result.constants.records, &result.terms}) {
    for (const CheckRecord& record : *records) {
      EXPECT_LT(record.bound, kLargestBound) << record.name;
      if (record.failed) failures += record.name + " ";
      *fraction = std::max(*fraction, record.worst / record.bound);
    }
  }
  return failures;
}

/// All kinds of base, half of them with the base's body displaced, and of joint and branching.
RandomRobotOptions MakeOptions(int index) {
  RandomRobotOptions options;
  constexpr BaseType kBases[] = {BaseType::kFixed, BaseType::kPlanar, BaseType::kDifferentialDrive};
  options.base = kBases[index % 3];
  options.velocity = index % 2 == 0 ? DriveVelocity::kTwist : DriveVelocity::kWheelRates;
  options.joints = 1 + index % 24;
  options.branching = 0.1 * (index % 10);
  options.prismatic = 0.1 * (index % 5);
  return options;
}

TEST(Consistency, HoldsOnTwoHundredRandomRobots) {
  std::mt19937 random(300);
  double fraction = 0.0;
  for (int index = 0; index < 200; ++index) {
    const RobotSpec spec = MakeRandomRobot(MakeOptions(index), &random);
    const bool free_joint = index % 4 < 2;
    Pose X_0b = Pose::Identity();
    if (index % 8 >= 4) {
      const Vector3d axis = free_joint ? Vector3d(1.0, -2.0, 0.5).normalized() : Vector3d::UnitZ();
      X_0b.linear() = Eigen::AngleAxisd(0.7, axis).toRotationMatrix();
      X_0b.translation() = Vector3d(0.1, -0.2, 0.15);
    }
    const ConsistencyResult result = Compare(spec, LoadMjcfText(WriteMjcf(spec, free_joint, X_0b), "text"), 5,
                                             static_cast<std::uint64_t>(index));
    EXPECT_EQ(result.samples, 5);
    EXPECT_EQ(ListFailures(result, &fraction), "") << "robot " << index;
  }
  RecordProperty("largest fraction of a bound", std::to_string(fraction));
  EXPECT_GT(fraction, 1e-3);  // bounds that no error comes near would prove nothing
}

TEST(Consistency, BoundsStaySmallOnLongChains) {
  std::mt19937 random(301);
  for (const int joints : {50, 100, 200}) {
    RandomRobotOptions options;
    options.joints = joints;
    options.branching = 0.0;
    const RobotSpec spec = MakeRandomRobot(options, &random);
    double fraction = 0.0;
    EXPECT_EQ(ListFailures(Compare(spec, LoadLongChain(spec), 2), &fraction), "") << joints << " joints";
    EXPECT_GT(fraction, 1e-4);
  }
}

// One of a few joints' random velocities is now and then far smaller than the others.
TEST(Consistency, HoldsForVelocitiesOfDifferentSize) {
  std::mt19937 random(304);
  for (int index = 0; index < 12; ++index) {
    const RobotSpec spec = MakeRandomRobot(MakeOptions(index), &random);
    const RobotModel model(spec);
    const MjModelPtr engine = LoadMjcfText(WriteMjcf(spec), "text");
    const Adapter adapter(model, *engine, "text");
    std::uint64_t seed = 5;
    for (const double ratio : {1e-6, 1e-3, 1e3, 1e6}) {
      AnalyticProvider analytic(model, "model");
      EngineProvider provider(adapter, "engine");
      TermComparison comparison(model, kAskedByConsistency, {&analytic, &provider});
      const StateFeed drawn = FeedRandomStates(model, 1, {}, seed++, /*second_velocity=*/true);
      const StateFeed feed = [&](DynamicsState* state) {
        const bool is_new = drawn(state);
        state->w *= ratio;
        return is_new;
      };
      CompareAtStates(
          feed, [](long) { return true; }, &comparison);
      for (const CheckRecord& record : comparison.records()) {
        EXPECT_FALSE(record.failed) << record.name << " of robot " << index << ": " << record.worst;
      }
    }
  }
}

// One number of a random joint by 0.1 %.
TEST(Consistency, FindsSmallErrorsOnRandomRobots) {
  std::mt19937 random(302);
  for (int index = 0; index < 24; ++index) {
    const RobotSpec spec = MakeRandomRobot(MakeOptions(index), &random);
    RobotSpec wrong = spec;
    Joint& joint = wrong.joints[random() % wrong.joints.size()];
    double* const numbers[] = {&joint.body.mass, &joint.body.com.x(), &joint.mdh.alpha, &joint.mdh.a,
                               &joint.mdh.q,     &joint.mdh.d,        &joint.damping,   &joint.armature};
    *numbers[index % 8] *= 1.001;
    EXPECT_FALSE(Compare(wrong, LoadMjcfText(WriteMjcf(spec), "text"), 3).Agrees()) << "robot " << index;
  }
}

// The shipped robot with the larger ring of its two-hand scenario.
TEST(Consistency, HoldsOnTheRingScene) {
  const Scenario scenario = ReadShippedScenario("two-hands");
  const std::string robot = SourcePath("/controller/parameters/assistant_robot.toml");
  const RobotModel model = ParseRobotModel(ReadText(robot), robot, scenario.model_overrides);
  const MjModelPtr engine = LoadMjcf(scenario.mjcf_file);
  ConsistencyOptions options;
  options.samples = 100;
  double fraction = 0.0;
  const ConsistencyResult result =
      CheckConsistency(Adapter(model, *engine, "ring_scene.xml"), options, kGoOn);
  EXPECT_EQ(result.samples, 100);
  EXPECT_EQ(ListFailures(result, &fraction), "");
  EXPECT_TRUE(result.constants.findings.empty());
  EXPECT_GT(fraction, 1e-3);
}

TEST(Consistency, StopsWhenToldTo) {
  std::mt19937 random(303);
  const RobotSpec spec = MakeRandomRobot(MakeOptions(0), &random);
  const RobotModel model(spec);
  const MjModelPtr engine = LoadMjcfText(WriteMjcf(spec), "text");
  const Adapter adapter(model, *engine, "text");
  ConsistencyOptions options;
  options.samples = 1000;
  long last = 0;
  const ConsistencyResult result = CheckConsistency(adapter, options, [&](long done) {
    last = done;
    return done < 3;
  });
  EXPECT_EQ(result.samples, 3);
  EXPECT_EQ(last, 3);
  EXPECT_TRUE(result.Agrees());
}

}  // namespace
}  // namespace dexcheck::testing::consistency_test
