// Refusals of the engine's terms, and their friction with tendons. adapter_test.cc compares all terms with
// the analytic model's.

#include "harness/engine/engine_terms.h"

#include <gtest/gtest.h>

#include <memory>

#include "controller/common/errors.h"
#include "controller/dynamics/model_terms.h"
#include "harness/engine/mujoco_release.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paper_robot.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::engine_terms_test {
namespace {

// Measured below 2e-13 relative to the largest entry on robots of 20 joints that reach about 2 m.
constexpr double kRounding = 2e-12;

TEST(EngineTerms, NeedsAnObjectAndSpheresThatTouch) {
  const RobotModel model = ReadPaperRobot();
  RobotSpec spec = model.spec();
  spec.object.reset();
  const RobotModel alone(spec);
  const MjModelPtr robot = LoadMjcf(SourcePath("/mjcf/robot.xml"));
  const Adapter without_object(alone, *robot, "robot.xml");
  EXPECT_THROW(EngineTerms(without_object, std::span<const int>(model.fingertips())), InputError);

  const MjModelPtr scene = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  const Adapter adapter(model, *scene, "scene.xml");
  const std::vector<int> palm = {model.FindFrame("r_palm_frame")};
  EXPECT_THROW(EngineTerms(adapter, std::span<const int>(palm)), InputError);
  for (int pair = 0; pair < scene->npair; ++pair) {  // of the floor with itself
    scene->pair_geom1[pair] = 0;
    scene->pair_geom2[pair] = 0;
  }
  EXPECT_THROW(EngineTerms(adapter, std::span<const int>(model.fingertips())), InputError);
}

/// A tree on a fixed base, with something besides in its MJCF, and the engine's whole pipeline beside the
/// terms.
class TreeWithTendons {
 public:
  TreeWithTendons(int joints, const std::string& besides, std::mt19937* random)
      : model_(MakeRandomRobot({.base = BaseType::kFixed, .joints = joints}, random)) {
    std::string text = WriteMjcf(model_.spec());
    text.insert(text.rfind("</mujoco>"), besides);
    engine_ = LoadMjcfText(text, "text");
    adapter_ = std::make_unique<Adapter>(model_, *engine_, "text");
    terms_ = std::make_unique<EngineTerms>(*adapter_, Coordinates::kReduced);
    data_ = MakeData(*engine_);
  }
  /// qfrc_passive of the joints by mj_forward, which the terms' friction must be the opposite of.
  VectorXd CalcPassiveForces(const VectorXd& q, const VectorXd& xi) {
    terms_->SetState(q, xi);
    adapter_->SetPositions(q, data_->qpos);
    const std::vector<int>& dofs = adapter_->joint_dofs();
    for (size_t i = 0; i < dofs.size(); ++i) data_->qvel[dofs[i]] = xi[static_cast<Eigen::Index>(i)];
    mj_forward(engine_.get(), data_.get());
    VectorXd passive(xi.size());
    for (size_t i = 0; i < dofs.size(); ++i)
      passive[static_cast<Eigen::Index>(i)] = data_->qfrc_passive[dofs[i]];
    constexpr double kScale = 1000.0;  // N m, of springs of 300 N m/rad, or some metres of 100 N/m on metres
    EXPECT_TRUE(MatrixNear(terms_->friction(), -passive, kRounding * kScale));
    return passive;
  }
  [[nodiscard]] const RobotModel& model() const { return model_; }
  [[nodiscard]] const mjModel& engine() const { return *engine_; }
  [[nodiscard]] const mjData& data() const { return *data_; }

 private:
  RobotModel model_;
  MjModelPtr engine_;
  std::unique_ptr<Adapter> adapter_;
  std::unique_ptr<EngineTerms> terms_;
  MjDataPtr data_;
};

// Springs and dampers of tendons are among the engine's passive forces, however its Jacobians are stored.
TEST(EngineTerms, FrictionHasTheForcesOfTendons) {
  for (const std::string jacobian : {"dense", "sparse"}) {
    std::mt19937 random(20162);
    TreeWithTendons tree(6, R"(<option jacobian=")" + jacobian + R"("/><tendon>
        <fixed stiffness="300" springlength="0.1"><joint joint="joint_1" coef="1"/>
          <joint joint="joint_3" coef="-2"/></fixed>
        <fixed damping="7"><joint joint="joint_2" coef="1.5"/><joint joint="joint_5" coef="1"/></fixed>
      </tendon>)",
                         &random);
    ASSERT_EQ(tree.engine().ntendon, 2);
    for (int trial = 0; trial < 5; ++trial) {
      const VectorXd q = DrawPositions(tree.model(), &random);
      const VectorXd xi = DrawVelocities(tree.model().num_velocities(), &random);
      VectorXd own = tree.CalcPassiveForces(q, xi);  // less the joints'
      for (int i = 0; i < tree.model().num_joints(); ++i) own[i] += tree.model().joint(i).damping * xi[i];
      EXPECT_GT(own.cwiseAbs().maxCoeff(), 1.0);
    }
  }
}

// A string around a post pulls the robot as the engine's own pipeline has it, which places the post.
TEST(EngineTerms, FrictionHasTheForcesOfTendonsAroundGeoms) {
  std::mt19937 random(20163);
  TreeWithTendons tree(4, R"(<worldbody><site name="hook" pos="3 0 0"/>
        <geom name="post" type="sphere" size="0.6" pos="1.5 0 0" contype="0" conaffinity="0"/></worldbody>
      <tendon><spatial stiffness="100" springlength="0.1"><site site="hook"/><geom geom="post"/>
        <site site="tip_3"/></spatial></tendon>)",
                       &random);
  int wrapped = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const VectorXd q = DrawPositions(tree.model(), &random);
    const VectorXd at_rest = VectorXd::Zero(tree.model().num_velocities());
    EXPECT_GT(tree.CalcPassiveForces(q, at_rest).norm(), 1.0);
    wrapped += tree.data().ten_wrapnum[0] == 4 ? 1 : 0;  // hook, two points on the post, tip
  }
  EXPECT_GT(wrapped, 3);
}

}  // namespace
}  // namespace dexcheck::testing::engine_terms_test
