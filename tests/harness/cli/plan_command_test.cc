// dexcheck plan: what it prints holds the object in the engine, and what it cannot do it says.

#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "controller/dynamics/model_terms.h"
#include "controller/object/euler_zyz.h"
#include "tests/common/matchers.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paper_robot.h"
#include "tests/common/paths.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::plan_command_test {
namespace {

using Json = nlohmann::json;

/// The shipped scenario `hold` with another [grasp].
std::string MakeScenario(const std::string& grasp, bool is_singular) {
  std::string text = ReadText(testing::SourcePath("/harness/shipped/scenarios/hold.toml"));
  const size_t begin = text.find("[grasp]");
  const size_t end = text.find("[trajectory]");
  text.replace(begin, end - begin, grasp + "\n");
  return is_singular ? ReplaceOnce(text, "[control]\n", "[control]\norientation = \"rotation\"\n") : text;
}

std::vector<std::string> PlanArguments(std::vector<std::string> more) {
  std::vector<std::string> arguments = {"plan", "--contacts"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

TEST(PlanCommand, PrintsAGraspThatHoldsTheTorus) {
  const std::vector<std::vector<std::string>> requests = {
      {"--object-xyz", "0.3", "-0.5", "0.631", "--support-height", "0.62"},
      {"--object-xyz", "0.35", "0.25", "0.85", "--object-zyz-deg", "20", "70", "-30", "--hand", "left",
       "--hemisphere", "1", "0", "0"}};
  for (const std::vector<std::string>& request : requests) {
    const TempFolder folder;
    const bool is_flat = request.size() == 6;
    const ProgramResult plan = RunDexcheck(PlanArguments(request));
    ASSERT_EQ(plan.exit_code, 0) << plan.err;
    EXPECT_EQ(plan.err, "");
    EXPECT_THAT(plan.out, HasSubstr("margin of force closure"));
    EXPECT_THAT(plan.out, HasSubstr("contacts at 125, 90, 55, -90 degrees have 0.145"));
    EXPECT_EQ(plan.out.find("orientation = \"rotation\"") != std::string::npos, is_flat);

    const std::filesystem::path file = folder.path() / "planned.toml";
    WriteText(file, MakeScenario(plan.out, is_flat));
    const ProgramResult run =
        RunDexcheck({"run", file.string(), "--no-log", "--set", "duration=0.1", "--set", "settle=0.3"});
    EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
    EXPECT_THAT(run.out, HasSubstr("PASS"));
  }
}

TEST(PlanCommand, WritesThePlanAsJson) {
  const ProgramResult result = RunDexcheck(
      PlanArguments({"--object-xyz", "0.3", "-0.5", "0.631", "--support-height", "0.62", "--json", "-"}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_TRUE(json["found"].get<bool>());
  EXPECT_GT(json["margin"].get<double>(), json["hand_picked_margin"].get<double>());
  EXPECT_GE(json["joint_margin"].get<double>(), 0.05 - 1e-9);
  EXPECT_EQ(json["grasp"]["contacts_deg"].size(), 4U);

  // Frame, place and posture together put the object where it was said to be.
  const RobotModel model = testing::ReadPaperRobot();
  ModelTerms terms(model);
  const std::vector<double> q = json["q"];
  terms.SetState(Eigen::Map<const VectorXd>(q.data(), static_cast<Eigen::Index>(q.size())),
                 VectorXd::Zero(terms.size()));
  const std::vector<double> xyz = json["grasp"]["xyz"];
  const std::vector<double> zyz = json["grasp"]["zyz_deg"];
  Pose X_Po = Pose::Identity();
  X_Po.translation() << xyz[0], xyz[1], xyz[2];
  X_Po.linear() = CalcRotationZyz({DegToRad(zyz[0]), DegToRad(zyz[1]), DegToRad(zyz[2])});
  Pose X_Bo = Pose::Identity();
  X_Bo.translation() << 0.3, -0.5, 0.631;
  // The arm's search ends at 1e-12.
  EXPECT_TRUE(MatrixNear((terms.CalcFramePose(model.FindFrame("r_palm_frame")) * X_Po).matrix(),
                         X_Bo.matrix(), 1e-11));
  for (const auto& [name, degrees] : json["grasp"]["joints_deg"].items()) {
    EXPECT_NEAR(DegToRad(degrees.get<double>()), q[static_cast<size_t>(3 + model.FindJoint(name))], 1e-14);
  }
}

TEST(PlanCommand, SaysWhyThereIsNoPlan) {
  const TempFolder folder;
  const std::filesystem::path file = folder.path() / "plan.json";
  const ProgramResult far =
      RunDexcheck(PlanArguments({"--object-xyz", "3", "0", "1", "--json", file.string()}));
  EXPECT_EQ(far.exit_code, 3);
  EXPECT_EQ(far.out, "");
  EXPECT_THAT(far.err, HasSubstr("dexcheck: no plan: the arm does not reach the object: the palm stays"));
  const Json json = Json::parse(ReadText(file));
  EXPECT_FALSE(json["found"].get<bool>());
  EXPECT_THAT(json["problem"].get<std::string>(), HasSubstr("does not reach"));
  EXPECT_FALSE(json.contains("grasp"));

  const ProgramResult slippery =
      RunDexcheck(PlanArguments({"--object-xyz", "0.35", "-0.25", "0.85", "--mu", "0.001"}));
  EXPECT_EQ(slippery.exit_code, 3);
  EXPECT_THAT(slippery.err, HasSubstr("no force closure with mu = 0.001"));
}

// From above a table, with the halves of the fingertips that point back along the fingers: fingertips, 9 mm
// and 3 mm above the table, stand higher than the middle of the tube, 11 mm, and so touch it with their lower
// halves, unless a finger comes from over the torus and leans outward. With the other halves it is held.
TEST(PlanCommand, SaysThatNoPlaceIsWithinTheRims) {
  const TempFolder folder;
  const std::filesystem::path file = folder.path() / "plan.json";
  const ProgramResult back =
      RunDexcheck(PlanArguments({"--object-xyz", "0.3", "-0.5", "0.631", "--support-height", "0.62",
                                 "--hemisphere", "-1", "0", "0", "--json", file.string()}));
  EXPECT_EQ(back.exit_code, 3);
  EXPECT_EQ(back.out, "");
  EXPECT_EQ(std::count(back.err.begin(), back.err.end(), '\n'), 1) << back.err;
  const char* const reason =
      "not all fingertips find a place on the object within the rims of their hemispheres";
  EXPECT_THAT(back.err, HasSubstr(std::string("dexcheck: no plan: ") + reason));
  const Json json = Json::parse(ReadText(file));
  EXPECT_FALSE(json["found"].get<bool>());
  EXPECT_THAT(json["problem"].get<std::string>(), HasSubstr(reason));
  EXPECT_FALSE(json.contains("grasp"));
}

TEST(PlanCommand, RefusesWhatCannotBeUsed) {
  const auto plan = [](std::vector<std::string> more) {
    more.insert(more.begin(), {"--object-xyz", "0.3", "-0.3", "0.8"});
    return RunDexcheck(PlanArguments(more));
  };
  EXPECT_TRUE(IsRefused(RunDexcheck({"plan"}), {"--contacts is required"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"plan", "--contacts"}), {"--object-xyz is required"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"plan", "--contacts", "--object-xyz", "0", "0", "nan"}),
                        {"--object-xyz", "must be finite"}));
  EXPECT_TRUE(IsRefused(plan({"--mu", "0"}), {"mu: must be positive, got 0"}));
  EXPECT_TRUE(IsRefused(plan({"--joint-margin", "-1"}), {"joint_margin: must not be negative, got -1"}));
  EXPECT_TRUE(IsRefused(plan({"--support-height", "inf"}), {"support: must be finite, got inf"}));
  EXPECT_TRUE(IsRefused(plan({"--lift", "0", "0", "nan"}), {"reaches: must be finite, got nan"}));
  EXPECT_TRUE(IsRefused(plan({"--hemisphere", "0", "0", "0"}), {"--hemisphere: must be a direction"}));
  EXPECT_TRUE(IsRefused(plan({"--hand", "up"}), {"--hand", "up"}));
  EXPECT_TRUE(IsRefused(plan({"--palm", "hand"}), {"--palm: \"hand\" is no frame of the model"}));
  EXPECT_TRUE(IsRefused(plan({"--palm", "base_frame"}), {"--palm: no joint moves \"base_frame\" alone"}));
  EXPECT_TRUE(IsRefused(plan({"--palm", "rf1_tip"}), {"carries 1 fingertips, at least three are needed"}));
  EXPECT_TRUE(IsRefused(plan({"--arm-joints", "l_elbow"}), {"each must move frame r_palm_frame"}));
  EXPECT_TRUE(
      IsRefused(plan({"--arm-joints", "elbow"}), {"--arm-joints: \"elbow\" is no joint of the model"}));
  EXPECT_TRUE(
      IsRefused(plan({"--joints-deg", "r_elbow"}), {"--joints-deg: must be NAME=DEGREES, got \"r_elbow\""}));
  EXPECT_TRUE(IsRefused(plan({"--joints-deg", "r_elbow=x"}), {"must be NAME=DEGREES"}));
  EXPECT_TRUE(IsRefused(plan({"--joints-deg", "r_elbow=200"}), {"r_elbow=200 is outside of the range"}));
  EXPECT_TRUE(
      IsRefused(plan({"--robot", testing::kParameters + "panda.toml"}), {"panda.toml: object: is missing"}));
  EXPECT_TRUE(IsRefused(plan({"--json", "/nowhere/plan.json"}), {"/nowhere/plan.json: cannot be written"}));
}

// The hand comes from above onto a table, and through one that is 10 cm higher.
TEST(PlanCommand, TellsWhichBodiesMeet) {
  const TempFolder folder;
  std::filesystem::copy(testing::SourcePath("/mjcf"), folder.path() / "mjcf",
                        std::filesystem::copy_options::recursive);
  const std::filesystem::path scene = folder.path() / "mjcf/bench_scene.xml";
  const auto plan = [&] {
    return RunDexcheck(
        PlanArguments({"--object-xyz", "0.3", "-0.5", "0.631", "--support-height", "0.62", "--mjcf",
                       scene.string(), "--json", (folder.path() / "plan.json").string()}));
  };
  const ProgramResult clear = plan();
  EXPECT_EQ(clear.exit_code, 0) << clear.err;
  EXPECT_THAT(clear.out, HasSubstr("mm apart"));
  const auto read = [&] { return Json::parse(ReadText(folder.path() / "plan.json"))["clearance"]; };
  EXPECT_GT(read()["robot_surroundings"]["smallest_m"].get<double>(), 1e-3);

  WriteText(scene, ReplaceOnce(ReadText(scene), "pos=\"0.9 -0.62 0\"", "pos=\"0.9 -0.62 0.1\""));
  const ProgramResult meets = plan();
  EXPECT_EQ(meets.exit_code, 1) << meets.out;
  EXPECT_THAT(meets.out, HasSubstr("mm into each other"));
  EXPECT_LT(read()["robot_surroundings"]["smallest_m"].get<double>(), -1e-2);
  EXPECT_THAT(read()["robot_surroundings"]["bodies"].get<std::string>(), HasSubstr("bench"));
}

}  // namespace
}  // namespace dexcheck::testing::plan_command_test
