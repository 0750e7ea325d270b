// The cross-check of a run's steps: agreement of the shipped robot, and every term seen to fail.

#include "harness/checks/step_model_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <set>

#include "harness/plant/engine_simulation.h"
#include "harness/plant/observer.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"
#include "tests/harness/checks/step_check_scene.h"

namespace dexcheck::testing::step_model_check_test {
namespace {

constexpr double kRingRadius = 0.035;
constexpr double kTubeRadius = 0.011;

// Largest error that the project accepts at every step.
constexpr double kModelLimit = 1e-10;

const CheckRecord& FindRecord(std::span<const CheckRecord> records, const std::string& name) {
  for (const CheckRecord& record : records) {
    if (record.name == name) return record;
  }
  throw std::invalid_argument(name);
}

Pose MakeTilt() {
  Pose offset = Pose::Identity();
  offset.linear() = Eigen::AngleAxisd(1e-3, Vector3d(0.6, 0.8, 0.0)).toRotationMatrix();
  offset.translation() = Vector3d(0.0, 0.0, -2e-4);
  return offset;
}

class StepModelCheckTest : public ::testing::TestWithParam<OrientationFeedback> {};

TEST_P(StepModelCheckTest, ShippedRobotAgreesAlongAWalk) {
  GraspWalk walk;
  CheckedController controller(walk.scene().model.spec(), Torus(kRingRadius, kTubeRadius),
                               walk.scene().fingertips, GetParam());
  constexpr int kSteps = 300;
  const double rates[] = {0.0, 1e-4, 1.0, 8.0};
  for (int step = 0; step < kSteps; ++step) {
    walk.Step(rates[step % 4]);
    controller.SetState(walk.q, walk.xi, walk.X_Bo, walk.V_Bo, step % 2 == 0 ? Pose::Identity() : MakeTilt());
    controller.Compare(step);
    for (const CheckRecord& record : controller.check.records()) {
      EXPECT_LT(record.last, kModelLimit) << record.name << ", step " << step;
    }
  }
  const std::span<const CheckRecord> records = controller.check.records();
  EXPECT_EQ(records.size(), GetParam() == OrientationFeedback::kAngles ? 25u : 21u);
  for (const CheckRecord& record : records) {
    EXPECT_FALSE(record.failed) << record.name << ": " << record.worst << " > " << record.bound << ", "
                                << Describe(record.where, controller.model, 2) << ", " << record.model_value
                                << " against " << record.engine_value << ", step " << record.at;
    EXPECT_EQ(record.kind, CheckCategory::kModel);
    EXPECT_GE(record.comparisons, kSteps);
  }
}

INSTANTIATE_TEST_SUITE_P(Orientation, StepModelCheckTest,
                         ::testing::Values(OrientationFeedback::kAngles, OrientationFeedback::kRotation));

/// Compares what the controller evaluates in a plant that tilts and sinks, with an upright robot's positions
/// and with the plant's own. @param is_taken whether the latter are used.
void ExpectAgreementInThePlant(const std::filesystem::path& scene, bool is_taken) {
  const RobotModel model = ReadPaperRobot();
  const MjModelPtr engine = LoadMjcf(scene);
  const Adapter adapter(model, *engine, "scene.xml");
  const Torus torus(kRingRadius, kTubeRadius);
  const std::span<const int> fingertips = std::span(model.fingertips()).first(4);
  EngineSimulation plant(adapter, /*implicit_damping=*/false);
  mj_resetDataKeyframe(engine.get(), &plant.data(), mj_name2id(engine.get(), mjOBJ_KEY, "grasp_ready"));
  const mjtNum axis[3] = {0.6, 0.8, 0.0};
  constexpr double kTilt = 1e-3;  // rad, of the base as the plant starts
  mju_axisAngle2Quat(plant.data().qpos + engine->jnt_qposadr[adapter.base_joints()[0]] + 3, axis, kTilt);
  Observer observer(adapter, fingertips, torus);
  GraspController controller(model, fingertips, model.object()->body, torus, GraspControllerOptions(model));
  StepModelCheck check(adapter, fingertips, controller.options().orientation);
  StepModelCheck of_plant(adapter, fingertips, controller.options().orientation);
  PlantReading reading;
  double tilt = 0.0;
  double speed = 0.0;
  constexpr int kSteps = 100;  // without torques, so that the robot sinks
  for (int step = 0; step < kSteps; ++step) {
    plant.BeginStep();
    observer.Read(plant, &reading);
    controller.SetState(reading.state);
    check.Compare(controller.robot(), controller.grasp(), reading.state, reading.X_W0, step);
    of_plant.Compare(controller.robot(), controller.grasp(), reading.state, reading.X_W0, step,
                     &plant.data());
    plant.EndStep();
    tilt = std::max(tilt, reading.departure.tilt);
    speed = std::max(speed, reading.state.xi.norm());
  }
  EXPECT_GT(tilt, 0.5 * kTilt);
  EXPECT_GT(speed, 0.1);
  EXPECT_EQ(of_plant.engine().terms().tilt().translation().norm() > 0.0, is_taken);
  for (const StepModelCheck* one : {&check, &of_plant}) {
    for (const CheckRecord& record : one->records()) {
      EXPECT_FALSE(record.failed) << record.name << ": " << record.worst << " > " << record.bound;
      EXPECT_LT(record.worst, kModelLimit) << record.name;
      EXPECT_GE(record.comparisons, kSteps) << record.name;
    }
  }
}

TEST(StepModelCheck, AgreesWithWhatTheControllerEvaluatesInThePlant) {
  ExpectAgreementInThePlant(SourcePath("/mjcf/scene.xml"), /*is_taken=*/true);
}

// The forces of a tendon need more than places of bodies: all positions are evaluated once more.
TEST(StepModelCheck, AgreesInAPlantWithATendon) {
  const TempFolder folder;
  std::filesystem::copy(SourcePath("/mjcf"), folder.path(), std::filesystem::copy_options::recursive);
  const std::filesystem::path scene = folder.path() / "scene.xml";
  WriteText(scene,
            ReplaceFirst(
                ReadText(scene), "</mujoco>",
                "<tendon><fixed name='cable'><joint joint='waist_yaw' coef='1'/></fixed></tendon></mujoco>"));
  ExpectAgreementInThePlant(scene, /*is_taken=*/false);
}

/// A change of the model, and what must come of it.
struct Mutation {
  const char* name;
  std::function<void(RobotSpec*, Torus*)> change;
  std::set<std::string> failing;   ///< Terms that must fail.
  std::set<std::string> agreeing;  ///< Terms that must not.
  const char* term;                ///< One of the failing ones, and a part that its first failure must name.
  const char* part;
};

Joint& FindJoint(RobotSpec* spec, const std::string& name) {
  for (Joint& joint : spec->joints) {
    if (joint.name == name) return joint;
  }
  throw std::invalid_argument(name);
}

void PrintTo(const Mutation& mutation, std::ostream* out) { *out << mutation.name; }

class MutatedModel : public ::testing::TestWithParam<Mutation> {};

TEST_P(MutatedModel, IsFoundAndNamed) {
  GraspWalk walk;
  RobotSpec spec = walk.scene().model.spec();
  Torus torus(kRingRadius, kTubeRadius);
  GetParam().change(&spec, &torus);
  CheckedController controller(spec, torus, walk.scene().fingertips);
  walk.Step(1.0);
  controller.SetState(walk.q, walk.xi, walk.X_Bo, walk.V_Bo);
  controller.Compare(0);
  const std::span<const CheckRecord> records = controller.check.records();
  for (const CheckRecord& record : records) {
    EXPECT_EQ(record.last, record.worst) << record.name;
    EXPECT_EQ(record.part.empty(), !record.failed) << record.name;
  }
  for (const std::string& name : GetParam().failing) EXPECT_TRUE(FindRecord(records, name).failed) << name;
  for (const std::string& name : GetParam().agreeing) EXPECT_FALSE(FindRecord(records, name).failed) << name;
  const std::string place = Describe(FindRecord(records, GetParam().term).first_failure, controller.model, 2);
  EXPECT_NE(place.find(GetParam().part), std::string::npos) << place;

  // A later step without the fault does not hide it.
  const double worst = FindRecord(records, GetParam().term).worst;
  walk.Step(0.0);
  controller.SetState(walk.q, walk.xi, walk.X_Bo, walk.V_Bo);
  controller.Compare(1);
  EXPECT_GE(FindRecord(controller.check.records(), GetParam().term).worst, worst);
  EXPECT_EQ(FindRecord(controller.check.records(), GetParam().term).failed_at, 0);
}

constexpr double kChange = 1.001;

const Mutation kMutations[] = {
    {"LinkMass",
     [](RobotSpec* spec, Torus*) { FindJoint(spec, "r_elbow").body.mass *= kChange; },
     {"M_bar", "C_bar_xi", "gravity", "kinetic_energy", "potential_energy", "linear_momentum",
      "angular_momentum"},
     {"frame_pose", "J", "J_dot_xi", "friction", "contact_frame", "G", "J_B", "J_B_dot_xi", "M_hat", "N_o"},
     "gravity",
     "waist_pitch"},
    {"Damping",
     [](RobotSpec* spec, Torus*) { FindJoint(spec, "r_elbow").damping *= kChange; },
     {"friction"},
     {"M_bar", "C_bar_xi", "gravity"},
     "friction",
     "r_elbow"},
    {"Gravity",
     [](RobotSpec* spec, Torus*) { spec->gravity *= kChange; },
     {"gravity", "potential_energy", "N_o", "object_potential_energy"},
     {"M_bar", "C_bar_xi", "friction", "C_hat_V", "kinetic_energy"},
     "N_o",
     "torus"},
    {"FingertipPlace",
     [](RobotSpec* spec, Torus*) {
       for (Frame& frame : spec->frames) {
         if (frame.name == "rf2_tip") frame.X_LF.translation().x() *= kChange;
       }
     },
     {"frame_pose", "J", "J_dot_xi", "contact_frame", "G", "J_B"},
     {"M_bar", "gravity", "C_bar_xi"},
     "J_B",
     "rf2_tip"},
    {"FingertipRadius",
     [](RobotSpec* spec, Torus*) {
       for (Frame& frame : spec->frames) {
         if (frame.name == "rf3_tip") *frame.sphere_radius *= kChange;
       }
     },
     {"contact_frame", "J_B", "G"},
     {"frame_pose", "J", "J_dot_xi", "M_bar"},
     "contact_frame",
     "rf3_tip"},
    {"TorusTube",
     [](RobotSpec*, Torus* torus) { *torus = Torus(kRingRadius, kTubeRadius * kChange); },
     {"contact_frame", "J_B", "G", "J_B_dot_xi", "G_dot_T_V"},
     {"frame_pose", "J", "M_hat", "N_o"},
     "contact_frame",
     "rf1_tip"},
    {"ObjectInertia",
     [](RobotSpec* spec, Torus*) { spec->object->body.inertia(2, 2) *= kChange; },
     {"M_hat", "C_hat_V", "M_o", "C_o_X_o_dot", "object_kinetic_energy"},
     {"N_o", "object_pose", "V_Bo", "M_bar", "object_potential_energy"},
     "M_hat",
     "torus"},
};

INSTANTIATE_TEST_SUITE_P(Changes, MutatedModel, ::testing::ValuesIn(kMutations),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(StepModelCheck, ObjectAndContactRatesFailWhenTheStateDiffers) {
  GraspWalk walk;
  CheckedController controller(walk.scene().model.spec(), Torus(kRingRadius, kTubeRadius),
                               walk.scene().fingertips);
  walk.Step(1.0);
  controller.SetState(walk.q, walk.xi, walk.X_Bo, walk.V_Bo);
  // The engine is told of another object than the controller was.
  controller.state.X_Bo.translation().z() += 1e-9;
  controller.state.V_Bo *= 1.0 + 1e-9;
  controller.Compare(0);
  const std::span<const CheckRecord> records = controller.check.records();
  for (const char* name : {"object_pose", "V_Bo", "contact_frame", "object_kinetic_energy", "C_hat_V"}) {
    EXPECT_TRUE(FindRecord(records, name).failed) << name;
  }
}

TEST(StepModelCheck, TiltThatTheCheckIsNotMeasuredOfFailsInTheContactsAlone) {
  GraspWalk walk;
  CheckedController controller(walk.scene().model.spec(), Torus(kRingRadius, kTubeRadius),
                               walk.scene().fingertips);
  walk.Step(1.0);
  controller.SetState(walk.q, walk.xi, walk.X_Bo, walk.V_Bo, MakeTilt());
  controller.X_W0 = controller.robot.CalcLinkPose(-1);
  controller.Compare(0);
  const std::set<std::string> contacts = {"contact_frame", "G", "J_B", "J_B_dot_xi", "G_dot_T_V"};
  for (const CheckRecord& record : controller.check.records()) {
    EXPECT_EQ(record.failed, contacts.contains(record.name)) << record.name;
  }
}

/// An identity matrix, or what a test makes of it.
class MatrixProvider : public MechanismProvider {
 public:
  explicit MatrixProvider(int size) : MechanismProvider("matrix"), M(MatrixXd::Identity(size, size)) {}
  void SetState(const DynamicsState&) override {}
  [[nodiscard]] bool Has(Term term) const override { return term == Term::kMBar; }
  void Read(Term, Eigen::Ref<MatrixXd> out) override { out = M; }
  MatrixXd M;
};

TEST(TermComparison, FindsWhatIsNotANumberAndWhatShouldBeZero) {
  const RobotModel model = ReadPaperRobot();
  for (const double value : {1e-9, std::nan(""), std::numeric_limits<double>::infinity()}) {
    MatrixProvider a(model.num_velocities());
    MatrixProvider b(model.num_velocities());
    TermComparison comparison(model, kAskedByRun, {&a, &b}, {});
    comparison.Compare(0);
    const CheckRecord& record = comparison.records().front();
    EXPECT_FALSE(record.failed);
    EXPECT_EQ(record.last, 0.0);
    a.M(2, 1) = value;
    comparison.Compare(1);
    EXPECT_TRUE(record.failed);
    EXPECT_EQ(record.failed_at, 1);
    EXPECT_EQ(record.first_failure.first, 2);
    EXPECT_EQ(record.first_failure.second, 1);
    EXPECT_EQ(std::isinf(record.last), !(value < 1.0));
    EXPECT_EQ(record.comparisons, 2 * a.M.size());
    a.M(2, 1) = 0.0;
    comparison.Compare(2);
    EXPECT_EQ(record.last, 0.0);
  }
}

// Names and factors are nowhere else, so the table itself must be sound.
TEST(TermTable, IsSound) {
  std::set<std::string> names;
  size_t place = 0;
  for (const TermEntry& term : ListTerms()) {
    EXPECT_TRUE(names.insert(term.name).second) << term.name << " is there twice";
    EXPECT_EQ(static_cast<size_t>(term.term), place++) << term.name;
    EXPECT_GT(term.factor, 0.0) << term.name;
    EXPECT_NE(term.askers, 0U) << term.name << " is asked by nobody";
    EXPECT_GT(CalcBound(term, 14), 0.0) << term.name;
    EXPECT_LT(CalcBound(term, 14), 1e-12) << term.name;
  }
}

}  // namespace
}  // namespace dexcheck::testing::step_model_check_test
