// Hemispherical fingertips end at a rim: a start past it is refused, a contact that rolls past it is found.

#include "controller/contact/fingertip_rim.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "harness/engine/engine.h"
#include "tests/common/paper_robot.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing {
namespace {

using ::testing::HasSubstr;

TEST(FingertipRim, IsAQuarterTurnFromThePole) {
  Frame tip;
  tip.sphere_radius = 0.01;
  EXPECT_EQ(CalcRimDistance(tip, Vector3d(0.0, 0.0, 0.01)), std::numeric_limits<double>::infinity());
  tip.hemisphere = Vector3d::UnitX();
  EXPECT_DOUBLE_EQ(CalcRimDistance(tip, Vector3d(0.01, 0.0, 0.0)), 0.01 * kPi / 2.0);
  EXPECT_DOUBLE_EQ(CalcRimDistance(tip, Vector3d(0.0, 0.0, 0.01)), 0.0);
  EXPECT_DOUBLE_EQ(CalcRimDistance(tip, Vector3d(-0.01, 0.01, 0.0)), -0.01 * kPi / 4.0);
  // Chart 0 of the sphere is the hemisphere's: regular all over it, c_u x c_v outward.
  const Sphere sphere(0.01);
  for (const double u : {-1.5, 0.0, 1.5}) {
    for (const double v : {-1.5, 0.0, 1.5}) {
      const SurfaceGeometry at = sphere.Evaluate({u, v, 0});
      EXPECT_GT(CalcRimDistance(tip, at.p), 0.0);
      EXPECT_GT(at.M.determinant(), 0.0);
      EXPECT_GT(at.R.col(2).dot(at.p), 0.0);
    }
  }
}

/// `reorient`, whose fingers roll, with one hemispherical fingertip.
struct RimRun {
  RimRun(const Scenario& scenario, const Vector3d& pole) {
    RobotSpec spec = ReadPaperRobot().spec();
    for (Frame& frame : spec.frames) {
      if (frame.name == "rf2_tip") frame.hemisphere = pole;
    }
    const std::string scene = SourcePath("/mjcf/scene.xml");
    setup = std::make_unique<Setup>(scenario, RobotModel(spec), scene, LoadMjcf(scene));
    runner = std::make_unique<Runner>(*setup, /*check=*/true);
  }
  const RunResult& Run() {
    return runner->Run([](const StepRecord&) {}, [] { return false; });
  }
  std::unique_ptr<Setup> setup;
  std::unique_ptr<Runner> runner;
};

const std::vector<std::string> kRoll = {"duration=0.6", "settle=0.3"};

TEST(FingertipRim, AContactThatRollsPastItIsNamedWithItsTime) {
  // Where the contact begins and ends on the whole sphere, as directions.
  ShippedRun whole("reorient", kRoll);
  const auto find_direction = [&]() -> Vector3d {
    const GraspTerms& grasp = whole.step().model->grasp();
    return grasp.tip(1).Evaluate(whole.step().reading.state.kappa[1].alpha_f).p.normalized();
  };
  Vector3d begin = Vector3d::Zero();
  whole.Run([&] {
    if (begin.isZero(0.0)) begin = find_direction();
  });
  const Vector3d end = find_direction();
  ASSERT_GT((end - begin).norm(), 1e-4);
  const Scenario scenario = ReadShippedScenario("reorient", kRoll);

  // The rim lies halfway.
  RimRun passes(scenario, (begin - end).normalized());
  const RunResult& result = passes.Run();
  EXPECT_EQ(result.verdict, Verdict::kDisagreement);
  EXPECT_STREQ(NameOf(result.attribution.cause), "fingertip rim");
  EXPECT_THAT(result.attribution.evidence, HasSubstr("fingertip \"rf2_tip\""));
  const CheckRecord& check = passes.runner->loop().checks().Find("fingertip_rim");
  EXPECT_GT(check.failed_at, 0.01);
  EXPECT_LT(check.failed_at, 0.6);
  EXPECT_NEAR(check.worst, 0.009 * 0.5 * (end - begin).norm(), 0.2 * check.worst);

  // The other way round it begins past the rim: such a start is refused.
  try {
    RimRun refused(scenario, (end - begin).normalized());
    ADD_FAILURE() << "is accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("grasp.contacts_deg: the contact of \"rf2_tip\" lies"));
    EXPECT_THAT(error.what(), HasSubstr("mm past the rim of its hemisphere"));
  }
}

TEST(FingertipRim, IsNotAskedOfWholeSpheres) {
  ShippedRun run("reorient", {"duration=0.002", "settle=0.2"});
  run.Run();
  const bool has_rims =
      run.setup().model().frames()[static_cast<size_t>(run.setup().fingertips()[0])].hemisphere.has_value();
  EXPECT_EQ(run.loop().checks().Find("fingertip_rim").applies, has_rims);
}

}  // namespace
}  // namespace dexcheck::testing
