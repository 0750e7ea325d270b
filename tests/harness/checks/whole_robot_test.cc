// The whole robot's equations against the engine's at states that no assumption of the paper holds at: its
// base tilts, its wheels turn as they like, and forces act anywhere. The engine's numbers are read from
// mjData.

#include "harness/checks/whole_robot.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <ostream>

#include "harness/engine/engine.h"
#include "tests/common/files.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::whole_robot_test {
namespace {

struct Case {
  const char* name;
  BaseType base;
  bool free_joint = true;
  bool displaced = false;  ///< The body of the base has another frame than Sigma_0.
  double ball = 0.0;
  const char* from = "";  ///< Replaced in the MJCF,
  const char* to = "";    ///< by this.
};
void PrintTo(const Case& one, std::ostream* stream) { *stream << one.name; }

constexpr BaseType kDrive = BaseType::kDifferentialDrive, kPlanar = BaseType::kPlanar;
const Case kCases[] = {
    {"Fixed", BaseType::kFixed},
    {"FixedWithBallJoints", BaseType::kFixed, true, false, 0.4},
    {"Floating", BaseType::kFloating},
    {"FloatingWithBallJoints", BaseType::kFloating, true, false, 0.4},
    {"PlanarByFreeJoint", kPlanar, true, true},
    {"PlanarBySlides", kPlanar, false, true},
    {"PlanarByReversedHinge", kPlanar, false, true, 0.0, R"(<joint axis="0 0 1"/>)",
     R"(<joint axis="0 0 -1" ref="0.2"/>)"},
    {"PlanarByReversedSlide", kPlanar, false, true, 0.0, R"(type="slide" axis="0 1 0")",
     R"(type="slide" axis="0 -1 0" ref="0.4")"},
    {"Drive", kDrive},
    {"DriveDisplaced", kDrive, true, true},
    {"DriveBySlides", kDrive, false, true},
    {"DriveWithReversedWheel", kDrive, false, true, 0.0, R"(<joint name="wheel_left" axis="0 1 0")",
     R"(<joint name="wheel_left" axis="0 -1 0")"},
};

class WholeRobotTest : public ::testing::TestWithParam<Case> {
 protected:
  WholeRobotTest() {
    const Case& one = GetParam();
    RandomRobotOptions options;
    options.base = one.base;
    options.joints = 9;
    options.ball = one.ball;
    RobotSpec spec = MakeRandomRobot(options, &random_);
    Pose X_0b = Pose::Identity();
    if (one.displaced) {
      X_0b.translation() = Vector3d(0.2, -0.1, 0.3);
      const Vector3d axis = one.free_joint ? Vector3d(1.0, -2.0, 0.5).normalized() : Vector3d::UnitZ();
      X_0b.linear() = Eigen::AngleAxisd(0.8, axis).toRotationMatrix();
    }
    std::string text = WriteMjcf(spec, one.free_joint, X_0b);
    if (*one.from != '\0') text = ReplaceOnce(text, one.from, one.to);
    const Vector3d moments(0.002, 0.003, 0.004);
    spec.object = ObjectModel{"thing", SolidSphere{0.05}, {0.7, Vector3d::Zero(), moments.asDiagonal()}, 0.5};
    text = ReplaceOnce(text, "</worldbody>",
                       "<body name='thing'><freejoint/><inertial pos='0 0 0' mass='0.7' "
                       "diaginertia='0.002 0.003 0.004'/></body></worldbody>");
    engine_ = LoadMjcfText(text, "text");
    data_ = MakeData(*engine_);
    model_ = std::make_unique<RobotModel>(std::move(spec));
    adapter_ = std::make_unique<Adapter>(*model_, *engine_, "text");
    whole_ = std::make_unique<WholeRobot>(*model_, &model_->object()->body, *adapter_);
    DrawState();
  }

  void DrawState() {
    std::uniform_real_distribution<double> draw(-1.0, 1.0);
    for (int i = 0; i < engine_->nq; ++i) data_->qpos[i] = engine_->qpos0[i] + draw(random_);
    mj_normalizeQuat(engine_.get(), data_->qpos);
    for (int i = 0; i < engine_->nv; ++i) data_->qvel[i] = draw(random_);
    mj_forward(engine_.get(), data_.get());
    whole_->SetState(data_->qpos, data_->qvel);
  }

  /// Converts an nv-vector to nu.
  [[nodiscard]] VectorXd Read(const mjtNum* rates) const {
    VectorXd nu(whole_->size());
    whole_->ReadRates(rates, &nu);
    return nu;
  }

  std::mt19937 random_{7};
  MjModelPtr engine_;
  MjDataPtr data_;
  std::unique_ptr<RobotModel> model_;
  std::unique_ptr<Adapter> adapter_;
  std::unique_ptr<WholeRobot> whole_;
};

constexpr double kRounding = 1e-12;

TEST_P(WholeRobotTest, HasTheEnginesInertia) {
  ASSERT_EQ(whole_->size(), engine_->nv);
  VectorXd product(engine_->nv);
  for (int i = 0; i < engine_->nv; ++i) {
    const VectorXd unit = VectorXd::Unit(engine_->nv, i);
    mj_mulM(engine_.get(), data_.get(), product.data(), unit.data());
    VectorXd own = VectorXd::Zero(engine_->nv);
    whole_->AddInertia(Read(unit.data()), &own);
    EXPECT_LT((own - Read(product.data())).norm(), kRounding * product.norm()) << i;
  }
}

TEST_P(WholeRobotTest, HasTheEnginesBias) {
  const VectorXd bias = Eigen::Map<const VectorXd>(data_->qfrc_bias, engine_->nv) -
                        Eigen::Map<const VectorXd>(data_->qfrc_passive, engine_->nv);
  EXPECT_LT((whole_->bias() - Read(bias.data())).norm(), kRounding * bias.norm());
}

TEST_P(WholeRobotTest, ProjectsForcesOnEveryBodyAsTheEngine) {
  std::uniform_real_distribution<double> draw(-1.0, 1.0);
  const auto vector = [&] { return Vector3d(draw(random_), draw(random_), draw(random_)); };
  VectorXd expected = VectorXd::Zero(engine_->nv);
  whole_->ClearForces();
  for (int body = 1; body < engine_->nbody; ++body) {
    const BodyForce one{body, vector(), vector(), vector()};
    mj_applyFT(engine_.get(), data_.get(), one.force.data(), one.torque.data(), one.point.data(), body,
               expected.data());
    whole_->AddForce(one);
  }
  VectorXd own = VectorXd::Zero(engine_->nv), size = own;
  whole_->ProjectForces(&own, &size);
  EXPECT_LT((own - Read(expected.data())).norm(), kRounding * expected.norm());
  EXPECT_TRUE((own.array().abs() <= size.array()).all());
  VectorXd back(engine_->nv);
  whole_->WriteForces(own, &back);
  const Eigen::Index n = whole_->robot_size();
  EXPECT_LT((Read(back.data()) - own).head(n).norm(), kRounding * own.norm());
}

INSTANTIATE_TEST_SUITE_P(Bases, WholeRobotTest, ::testing::ValuesIn(kCases),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace dexcheck::testing::whole_robot_test
