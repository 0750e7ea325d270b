// The forces of all rows of the engine's constraints against the law's, over falls, slides and blows of
// random robots, and with each number of the parameters a little off.

#include "harness/checks/constraint_law.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <ostream>

#include "harness/base/worst.h"
#include "harness/engine/engine.h"
#include "harness/plant/observer.h"
#include "tests/common/allocation_counter.h"
#include "tests/common/files.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::constraint_law_test {
namespace {

constexpr BaseType kFixed = BaseType::kFixed, kDrive = BaseType::kDifferentialDrive;
constexpr BaseType kFloating = BaseType::kFloating, kPlanar = BaseType::kPlanar;

struct Case {
  const char* name;
  BaseType base;
  bool torus = true;         ///< Else the object is a sphere.
  const char* option = "";   ///< Attributes of <option>.
  const char* contact = "";  ///< Attributes of all geoms for contacts.
  double ball = 0.0;
  bool free_joint = true;
};
void PrintTo(const Case& one, std::ostream* stream) { *stream << one.name; }

const Case kCases[] = {
    {"Fixed", kFixed},
    {"FixedWithBallJoints", kFixed, true, "", "", 0.4},
    {"Floating", kFloating},
    {"FloatingSphere", kFloating, false},
    {"Planar", kPlanar},
    {"PlanarBySlides", kPlanar, true, "", "", 0.0, false},
    {"Drive", kDrive},
    {"DriveOnPyramids", kDrive, true, "cone='pyramidal' impratio='7'"},
    {"PyramidsThatSpinAndRoll", kFloating, true, "cone='pyramidal'", "condim='6'"},
    {"DriveWithStiffTangents", kDrive, false, "impratio='100'"},
    {"ShortSteps", kDrive, true, "timestep='0.00025'", "solref='0.0001 0.7'"},
    {"UnsafeSteps", kFloating, true, "timestep='0.001'", "solref='0.004 1.3' solimp='0.9 0.999 0.01 0.3 3'"},
    {"LinearImpedance", kFloating, false, "", "solimp='0.2 0.8 0.02 0.5 1'"},
    {"NegativeReference", kDrive, true, "", "solref='-3000 -60'"},
    {"OtherWidth", kFixed, false, "", "margin='0.01' gap='0.004' solimp='0.6 0.6 0.001 0.5 2'"},
    {"WithSpin", kFloating, true, "", "condim='4' friction='0.6 0.02 0.001'"},
    {"WithRolling", kDrive, false, "impratio='3'", "condim='6' friction='0.4 0.05 0.02'"},
    {"Slippery", kDrive, true, "", "friction='0.05 0.005 0.0001'"},
    {"Frictionless", kFloating, true, "", "condim='1'"},
    {"ByConjugateGradients", kDrive, true, "solver='CG' iterations='30'"},
    {"BySparseRows", kDrive, true, "jacobian='sparse'"},
};

constexpr double kDryFriction = 0.3;

struct Scene {
  RobotSpec spec;
  MjModelPtr engine;
};

std::string WriteSphere(const Frame& frame, int k) {
  const Vector3d p = frame.X_LF.translation();
  // Every third one is no sphere that the parameters know.
  if (k % 3 == 2)
    return fmt::format("<geom type='capsule' size='0.03 0.06' pos='{} {} {}'/>", p.x(), p.y(), p.z());
  return fmt::format("<geom type='sphere' size='{:.17g}' pos='{:.17g} {:.17g} {:.17g}'/>",
                     *frame.sphere_radius, p.x(), p.y(), p.z());
}

Scene MakeScene(const Case& one, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> draw(0.02, 0.06);
  RandomRobotOptions options;
  options.base = one.base;
  options.joints = 9;
  options.ball = one.ball;
  Scene scene;
  RobotSpec& spec = scene.spec;
  spec = MakeRandomRobot(options, &random);
  for (Frame& frame : spec.frames) frame.sphere_radius = draw(random);
  for (Joint& joint : spec.joints) {
    if (joint.type != JointType::kBall) joint.dry_friction = kDryFriction;
  }
  const double ring = draw(random) + 0.15, tube = draw(random), radius = 0.1 + draw(random);
  const Vector3d moments(0.002, 0.003, 0.004);
  spec.object = ObjectModel{"thing", SolidSphere{radius}, {0.7, Vector3d::Zero(), moments.asDiagonal()}, 0.5};
  if (one.torus) spec.object->shape = SolidTorus{ring, tube};

  std::string text = WriteMjcf(spec, one.free_joint);
  int k = 0;
  for (Frame& frame : spec.frames) {
    const size_t at = text.find("<site name=\"" + frame.name);
    text.insert(at, WriteSphere(frame, k));
    if (k++ % 3 == 2) frame.sphere_radius.reset();
  }
  for (const Joint& joint : spec.joints) {
    if (joint.type == JointType::kBall) continue;
    text = ReplaceOnce(text, "<joint name=\"" + joint.name + "\"",
                       fmt::format("<joint name=\"{}\" frictionloss='{}'", joint.name, kDryFriction));
  }
  while (text.find(" contype=\"0\" conaffinity=\"0\"") != std::string::npos)
    text = ReplaceFirst(text, " contype=\"0\" conaffinity=\"0\"", "");
  text = ReplaceOnce(text, "<option ",
                     fmt::format("<option {} ", std::string(one.option).find("cone") == std::string::npos
                                                    ? std::string("cone='elliptic' ") + one.option
                                                    : one.option));
  const double reach = ring + tube;
  text = ReplaceOnce(
      text, "<worldbody>",
      fmt::format(
          "<size nuser_geom='2' njmax='2000' nconmax='500'/><default><geom {0}/></default>"
          "<asset><mesh name='hull' vertex='{1} {1} {2} -{1} {1} -{2} {1} -{1} -{2} -{1} -{1} {2}'/></asset>"
          "<worldbody><geom name='floor' type='plane' size='9 9 1' pos='0 0 -0.1' euler='0.05 -0.02 0'/>"
          "<geom name='bench' type='box' size='0.3 0.3 0.3' pos='0.4 0.3 -0.2'/>",
          one.contact, reach, tube));
  text = ReplaceOnce(
      text, "</worldbody>",
      fmt::format(
          "<body name='thing' pos='0.3 0.2 0.4'><freejoint/><inertial pos='0 0 0' mass='0.7' "
          "diaginertia='0.002 0.003 0.004'/>{}</body></worldbody>"
          "<equality><connect body1='{}' body2='thing' anchor='0.03 0.1 -0.05' "
          "solref='0.03 1'/></equality>"
          "<contact><pair geom1='floor' geom2='thing' friction='0.7 0.5 0.01 0.001 0.001' "
          "solref='0.03 0.8' margin='0.002' gap='0.001'/></contact>",
          one.torus
              ? fmt::format("<geom name='thing' type='mesh' mesh='hull' user='{:.17g} {:.17g}'/>", ring, tube)
              : fmt::format("<geom name='thing' type='sphere' size='{:.17g}'/>", radius),
          spec.joints.back().link));
  scene.engine = LoadMjcfText(text, "text");
  return scene;
}

/// Results of some steps.
struct Shown {
  double worst = 0.0;
  std::string where;
  std::map<std::string, int> kinds;  ///< How many rows of each, of those whose force is not zero.
  std::int64_t allocations = 0;
};

const char* KindOf(const ConstraintRow& row, const RowForce& force) {
  if (!force.is_predicted) return "none";
  if (row.type == mjCNSTR_EQUALITY) return "joined points";
  if (row.type == mjCNSTR_FRICTION_DOF) return "dry friction";
  if (row.type == mjCNSTR_LIMIT_JOINT) return "limit";
  return force.has_own_place ? "contact" : "contact at the engine's place";
}

using Change = std::function<void(RobotSpec* spec, PlantResponse* response)>;

/// Throws the scene about, and predicts its forces with parameters, or contacts, that are changed.
/// @param simulated what moves, where that is not the scene's own.
Shown Predict(const Scene& scene, unsigned seed, const Change& change, const mjModel* simulated = nullptr) {
  PlantResponse response;
  RobotSpec spec = scene.spec;
  change(&spec, &response);
  const RobotModel model(std::move(spec));
  const mjModel& m = simulated == nullptr ? *scene.engine : *simulated;
  const Adapter adapter(model, *scene.engine, "text");
  WholeRobot whole(model, &model.object()->body, adapter);
  ConstraintLaw law(model, &*model.object(), adapter, whole);
  const MjDataPtr data = MakeData(m);
  std::mt19937 random(seed);
  std::normal_distribution<double> draw;
  Shown shown;
  RobotSpec unused = scene.spec;
  for (int step = 0; step < 400; ++step) {
    if (step % 100 == 0) {
      mj_resetData(&m, data.get());
      for (int i = 0; i < m.nv; ++i) data->qvel[i] = 0.3 * draw(random);
      mj_integratePos(&m, data->qpos, data->qvel, 0.5);
    }
    if (step % 20 == 0) {
      for (int i = 0; i < m.nv; ++i) data->qfrc_applied[i] = 2.0 * draw(random);
    }
    const VectorXd qpos = Eigen::Map<const VectorXd>(data->qpos, m.nq);
    const VectorXd qvel = Eigen::Map<const VectorXd>(data->qvel, m.nv);
    mj_step(&m, data.get());
    response.qacc = Eigen::Map<const VectorXd>(data->qacc, m.nv);
    ReadConstraints(*data, &response);
    change(&unused, &response);
    const AllocationCounter counter;
    whole.SetState(qpos.data(), qvel.data());
    law.SetStep(qpos.data(), qvel.data(), response);
    const auto [worst, row] = law.FindWorst();
    shown.allocations += counter.count();
    for (size_t i = 0; i < response.rows.size(); ++i) {
      if (response.rows[i].force != 0.0) ++shown.kinds[KindOf(response.rows[i], law.forces()[i])];
    }
    if (!IsWorse(worst, shown.worst)) continue;
    const auto at = static_cast<size_t>(row);
    shown.worst = worst;
    shown.where =
        fmt::format("{} at step {}: {} in the engine, {} by the law, bound {}", law.DescribeRow(row), step,
                    response.rows[at].force, law.forces()[at].law, law.forces()[at].bound);
  }
  return shown;
}

class ConstraintLawTest : public ::testing::TestWithParam<Case> {};

// Measured 0.05 at most. Limits of ball joints alone are not predicted, which no run has.
TEST_P(ConstraintLawTest, PredictsEveryRow) {
  std::map<std::string, int> kinds;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Shown shown = Predict(MakeScene(GetParam(), seed), seed, [](auto*, auto*) {});
    EXPECT_LT(shown.worst, 0.2) << shown.where;
    EXPECT_EQ(shown.allocations, 0);
    for (const auto& [kind, count] : shown.kinds) kinds[kind] += count;
  }
  EXPECT_EQ(kinds["none"] > 0, GetParam().ball > 0.0);
  for (const char* kind : {"joined points", "dry friction", "limit", "contact at the engine's place"})
    EXPECT_GT(kinds[kind], 10) << kind;
  // A base on slides does not fall.
  if (GetParam().free_joint) EXPECT_GT(kinds["contact"], 10);
}

INSTANTIATE_TEST_SUITE_P(Cases, ConstraintLawTest, ::testing::ValuesIn(kCases),
                         [](const auto& info) { return info.param.name; });

struct Fault {
  const char* name;
  const char* part;  ///< Found there.
  Change change;
};
void PrintTo(const Fault& fault, std::ostream* stream) { *stream << fault.name; }

constexpr double kOff = 1e-9;  // m, rad, or relative

const Fault kFaults[] = {
    {"WheelRadius", "wheel", [](RobotSpec* spec, auto*) { spec->base.wheel_radius += kOff; }},
    {"WheelDistance", "wheel", [](RobotSpec* spec, auto*) { spec->base.wheel_distance += kOff; }},
    {"FingertipRadius", "tip",
     [](RobotSpec* spec, auto*) {
       for (Frame& frame : spec->frames)
         if (frame.sphere_radius) *frame.sphere_radius += kOff;
     }},
    {"TubeRadius", "thing",
     [](RobotSpec* spec, auto*) { std::get<SolidTorus>(spec->object->shape).tube_radius += kOff; }},
    {"RingRadius", "thing",
     [](RobotSpec* spec, auto*) { std::get<SolidTorus>(spec->object->shape).ring_radius += kOff; }},
    {"LinkLength", "", [](RobotSpec* spec, auto*) { spec->joints[2].mdh.a += kOff; }},
    {"JointLimit", "limit",
     [](RobotSpec* spec, auto*) {
       for (Joint& joint : spec->joints) joint.upper += kOff, joint.lower += kOff;
     }},
    {"DryFriction", "dry friction",
     [](RobotSpec* spec, auto*) {
       for (Joint& joint : spec->joints) joint.dry_friction *= 1.0 + kOff;
     }},
    {"Armature", "", [](RobotSpec* spec, auto*) { spec->joints[1].armature *= 1.0 + kOff; }},
    {"LinkMass", "", [](RobotSpec* spec, auto*) { spec->joints[4].body.mass *= 1.0 + kOff; }},
    {"LinkCentre", "", [](RobotSpec* spec, auto*) { spec->joints[4].body.com.x() += kOff; }},
    {"ObjectMass", "thing", [](RobotSpec* spec, auto*) { spec->object->body.mass *= 1.0 + kOff; }},
    {"FrictionCoefficient", "contact",
     [](auto*, PlantResponse* response) {
       for (EngineContact& contact : response->engine_contacts) contact.friction[0] *= 1.0 + kOff;
     }},
    {"EnginesNormal", "engine's place",
     [](auto*, PlantResponse* response) {
       for (EngineContact& contact : response->engine_contacts)
         contact.frame *= Eigen::AngleAxisd(kOff, Vector3d(1.0, 2.0, 3.0).normalized()).toRotationMatrix();
     }},
    {"Force", "",
     [](auto*, PlantResponse* response) {
       for (ConstraintRow& row : response->rows) row.force *= 1.0 + kOff;
     }},
};

class ConstraintLawFault : public ::testing::TestWithParam<Fault> {};

TEST_P(ConstraintLawFault, IsFound) {
  const Scene scene = MakeScene({"Drive", kDrive}, 3);
  const Shown shown = Predict(scene, 3, GetParam().change);
  EXPECT_GT(shown.worst, 1.0);
  EXPECT_NE(shown.where.find(GetParam().part), std::string::npos) << shown.where;
}

INSTANTIATE_TEST_SUITE_P(All, ConstraintLawFault, ::testing::ValuesIn(kFaults),
                         [](const auto& info) { return info.param.name; });

TEST(ConstraintLaw, HasThePairsOwnParameters) {
  const Scene scene = MakeScene({"Drive", kDrive}, 3);
  for (mjtNum* mjModel::*values : {&mjModel::pair_friction, &mjModel::pair_solref, &mjModel::pair_margin}) {
    const MjModelPtr other(mj_copyModel(nullptr, scene.engine.get()));
    ((*other).*values)[0] *= 1.0 + kOff;
    const Shown shown = Predict(
        scene, 3, [](auto*, auto*) {}, other.get());
    EXPECT_GT(shown.worst, 1.0);
    EXPECT_NE(shown.where.find("contact of floor and thing"), std::string::npos) << shown.where;
  }
}

TEST(ConstraintLaw, SaysWhereItDoesNotApply) {
  const Scene scene = MakeScene({"Fixed", kFixed}, 1);
  mjModel& m = *scene.engine;
  EXPECT_TRUE(ConstraintLaw::Applies(m));
  m.opt.noslip_iterations = 1;
  EXPECT_FALSE(ConstraintLaw::Applies(m));
  m.opt.noslip_iterations = 0;
  m.opt.solver = mjSOL_PGS;
  EXPECT_FALSE(ConstraintLaw::Applies(m));
}

}  // namespace
}  // namespace dexcheck::testing::constraint_law_test
