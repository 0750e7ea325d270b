// Hemispherical fingertips end at a rim: a start past it is refused, a contact that rolls past it is found.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "controller/contact/contact_geometry.h"
#include "tests/common/matchers.h"
#include "tests/common/refused_text.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::fingertip_rim_test {
namespace {

TEST(FingertipRim, IsAQuarterTurnFromThePole) {
  const Vector3d x = Vector3d::UnitX();
  EXPECT_DOUBLE_EQ(CalcRimDistance(0.01, x, Vector3d(0.01, 0.0, 0.0)), 0.01 * kPi / 2.0);
  EXPECT_DOUBLE_EQ(CalcRimDistance(0.01, x, Vector3d(0.0, 0.0, 0.01)), 0.0);
  EXPECT_DOUBLE_EQ(CalcRimDistance(0.01, x, Vector3d(-0.01, 0.01, 0.0)), -0.01 * kPi / 4.0);
  // Chart 0 of the sphere is the hemisphere's: regular all over it, c_u x c_v outward.
  const Sphere sphere(0.01);
  for (const double u : {-1.5, 0.0, 1.5}) {
    for (const double v : {-1.5, 0.0, 1.5}) {
      const SurfaceGeometry at = sphere.Evaluate({u, v, 0});
      EXPECT_GT(CalcRimDistance(0.01, x, at.p), 0.0);
      EXPECT_GT(at.M.determinant(), 0.0);
      EXPECT_GT(at.R.col(2).dot(at.p), 0.0);
    }
  }
}

const std::vector<std::string> kRoll = {"duration=0.6", "settle=0.3"};

/// Returns the direction of each contact on its fingertip.
std::vector<Vector3d> FindDirections(const StepRecord& step) {
  std::vector<Vector3d> directions;
  const GraspTerms& grasp = step.model->grasp();
  for (size_t i = 0; i < step.reading.state.kappa.size(); ++i) {
    const SurfacePoint& alpha = step.reading.state.kappa[i].alpha_f;
    directions.push_back(grasp.tip(static_cast<int>(i)).Evaluate(alpha).p.normalized());
  }
  return directions;
}

/// A pole around which all contacts begin within the rim, and one rolls past it; zero for none.
Vector3d FindPole(const std::vector<Vector3d>& begin, const std::vector<Vector3d>& end) {
  for (size_t i = 0; i < begin.size(); ++i) {
    // Poles that have the middle of its way on the rim, at angles around it.
    const Vector3d middle = (begin[i] + end[i]).normalized();
    const Vector3d a = (begin[i] - end[i]).normalized();
    for (double angle = -1.5; angle <= 1.5; angle += 0.1) {
      const Vector3d pole = std::cos(angle) * a + std::sin(angle) * middle.cross(a);
      const auto is_within = [&](const Vector3d& direction) { return pole.dot(direction) > 0.0; };
      if (std::all_of(begin.begin(), begin.end(), is_within) && !is_within(end[i])) return pole;
    }
  }
  return Vector3d::Zero();
}

TEST(FingertipRim, AContactThatRollsPastItIsNamedWithItsTime) {
  ShippedRun whole("reorient", kRoll);
  std::vector<Vector3d> begin;
  whole.Run([&] {
    if (begin.empty()) begin = FindDirections(whole.step());
  });
  const Vector3d pole = FindPole(begin, FindDirections(whole.step()));
  ASSERT_GT(pole.norm(), 0.0);

  const auto with_pole = [](const Vector3d& pole) {
    std::vector<std::string> overrides = kRoll;
    overrides.push_back(
        fmt::format("grasp.hemisphere=[{:.17g}, {:.17g}, {:.17g}]", pole.x(), pole.y(), pole.z()));
    return overrides;
  };
  ShippedRun passes("reorient", with_pole(pole));
  const RunResult& result = passes.Run();
  EXPECT_EQ(result.verdict, Verdict::kDisagreement);
  EXPECT_STREQ(NameOf(result.attribution.cause), "fingertip rim");
  EXPECT_THAT(result.attribution.evidence, HasSubstr("fingertip \"rf"));
  const CheckRecord& check = passes.loop().checks().Find("fingertip_rim");
  EXPECT_GT(check.failed_at, 0.0);
  EXPECT_LT(check.failed_at, 0.6);

  // The other way round it begins past the rim: such a start is refused.
  EXPECT_TRUE(IsRefused([&] { return ShippedRun("reorient", with_pole(-pole)); },
                        {"grasp.contacts_deg: the contact of \"rf", "mm past the rim of its hemisphere"}));
}

}  // namespace
}  // namespace dexcheck::testing::fingertip_rim_test
