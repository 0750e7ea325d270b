// dexcheck plan: what it prints holds the object in the engine, and what it cannot do it says.

#include "controller/dynamics/model_terms.h"
#include "controller/object/euler_zyz.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paper_robot.h"
#include "tests/common/refused_text.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::plan_command_test {
namespace {

/// The shipped scenario `hold` with another [grasp].
std::string MakeScenario(const std::string& grasp, bool is_singular) {
  std::string text = ReadText(SourcePath("/harness/shipped/scenarios/hold.toml"));
  const size_t begin = text.find("[grasp]");
  text.replace(begin, text.find("[trajectory]") - begin, grasp + "\n");
  return is_singular ? ReplaceOnce(text, "[control]\n", "[control]\norientation = \"rotation\"\n") : text;
}

class PlanCommand : public CommandTest {
 protected:
  /// The plan, or why there is none: then one line says it, too.
  [[nodiscard]] Json Plan(int exit_code, const Words& request) const {
    const ProgramResult result =
        Expect(exit_code, Words("plan --contacts --json plan.json --object-xyz") + request);
    const Json json = ReadJson("plan.json");
    EXPECT_EQ(json["found"], exit_code != 3);
    EXPECT_EQ(json.contains("grasp"), exit_code != 3);
    if (exit_code == 3) {
      EXPECT_EQ(result.out, "");
      EXPECT_TRUE(IsOneLineWith(result.err, {"dexcheck: no plan: ", json["problem"]}));
    }
    return json;
  }
};

TEST_F(PlanCommand, PrintsAGraspThatHoldsTheTorus) {
  const std::pair<const char*, bool> requests[] = {
      {"0.3 -0.5 0.631 --support-height 0.62", true},
      {"0.35 0.25 0.85 --object-zyz-deg 20 70 -30 --hand left --hemisphere 1 0 0", false}};
  for (const auto& [request, is_flat] : requests) {
    const ProgramResult plan = Expect(0, Words("plan --contacts --object-xyz") + request);
    EXPECT_EQ(plan.err, "");
    EXPECT_EQ(plan.out.find("orientation = \"rotation\"") != std::string::npos, is_flat);
    Write("planned.toml", MakeScenario(plan.out, is_flat));
    EXPECT_EQ(RunJson(0, "run planned.toml --no-log --set duration=0.1 --set settle=0.3")["verdict"], "pass");
  }
}

TEST_F(PlanCommand, WritesThePlanAsJson) {
  const Json json = Plan(0, "0.3 -0.5 0.631 --support-height 0.62");
  // Contacts at 125, 90, 55, -90 degrees, picked by hand, have this.
  EXPECT_GT(json["margin"].get<double>(), 0.145);
  EXPECT_GE(json["joint_margin"].get<double>(), 0.05 - 1e-9);
  EXPECT_EQ(json["grasp"]["contacts_deg"].size(), 4U);

  // Frame, place and posture together put the object where it was said to be.
  const RobotModel model = ReadPaperRobot();
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

// From above a table, with the halves of the fingertips that point back along the fingers: fingertips, 9 mm
// and 3 mm above the table, stand higher than the middle of the tube, 11 mm, and so touch it with their lower
// halves, unless a finger comes from over the torus and leans outward. With the other halves it is held.
TEST_F(PlanCommand, SaysWhyThereIsNoPlan) {
  const auto why = [&](const Words& request) { return Plan(3, request)["problem"].get<std::string>(); };
  EXPECT_THAT(why("3 0 1"), HasSubstr("does not reach"));
  EXPECT_THAT(why("0.35 -0.25 0.85 --mu 0.001"), AllOf(HasSubstr("force closure"), HasSubstr("mu = 0.001")));
  EXPECT_THAT(why("0.3 -0.5 0.631 --support-height 0.62 --hemisphere -1 0 0"), HasSubstr("rims"));
}

// The hand comes from above onto a table, and through one that is 10 cm higher.
TEST_F(PlanCommand, ReportsWhichBodiesMeet) {
  std::filesystem::copy(SourcePath("/mjcf"), Path("mjcf"), std::filesystem::copy_options::recursive);
  const std::string scene = "mjcf/bench_scene.xml";
  const Words request = "0.3 -0.5 0.631 --support-height 0.62 --mjcf mjcf/bench_scene.xml";
  EXPECT_GT(Plan(0, request)["clearance"]["robot_surroundings"]["smallest_m"].get<double>(), 1e-3);
  WriteChanged(scene, Read(scene), "pos=\"0.9 -0.62 0\"", "pos=\"0.9 -0.62 0.1\"");
  const Json meets = Plan(1, request)["clearance"]["robot_surroundings"];
  EXPECT_LT(meets["smallest_m"].get<double>(), -1e-2);
  EXPECT_THAT(meets["bodies"].get<std::string>(), HasSubstr("bench"));
}

}  // namespace
}  // namespace dexcheck::testing::plan_command_test
