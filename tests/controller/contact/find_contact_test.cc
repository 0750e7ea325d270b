#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "controller/contact/contact_geometry.h"
#include "tests/common/matrix_near.h"
#include "tests/common/throws.h"
#include "tests/controller/contact/contact_fixtures.h"

namespace dexcheck::testing::find_contact_test {
namespace {

constexpr int kSamples = 100;
// Newton's stopping bound, 1e-13 relative; measured 9.1e-14.
constexpr double kConverged = 9e-13;

struct Placement {
  ContactCoordinates kappa;
  double gap;
  Pose X_OF;
};

// Bodies `gap` apart, or overlapping, at contact coordinates known beforehand.
Placement DrawPlacement(std::mt19937& random, const SurfacePair& pair, double max_gap) {
  const Surface& fingertip = *pair.first.surface;
  const Surface& object = *pair.second.surface;
  Placement placement;
  placement.kappa = NormalizeContact(
      fingertip, object,
      {DrawPoint(random, pair.first, 0), DrawPoint(random, pair.second, object.num_charts() - 1),
       DrawUniform(random, -3.1, 3.1)});
  placement.gap = DrawUniform(random, -0.001, max_gap);
  placement.X_OF = CalcTouchingPose(fingertip, object, placement.kappa, placement.gap);
  return placement;
}

void ExpectSameContact(const FoundContact& found, const Placement& placement, const SurfacePair& pair) {
  EXPECT_NEAR(found.gap, placement.gap, kConverged);
  const Surface& fingertip = *pair.first.surface;
  const Surface& object = *pair.second.surface;
  EXPECT_TRUE(MatrixNear(fingertip.Evaluate(found.kappa.alpha_f).p,
                         fingertip.Evaluate(placement.kappa.alpha_f).p, kConverged));
  EXPECT_TRUE(MatrixNear(object.Evaluate(found.kappa.alpha_o).p, object.Evaluate(placement.kappa.alpha_o).p,
                         kConverged));
  EXPECT_TRUE(MatrixNear(CalcTouchingPose(fingertip, object, found.kappa, found.gap).matrix(),
                         placement.X_OF.matrix(), kConverged));
}

/// Calls check(pair, placement, generator) for contacts at random of all pairs of surfaces.
template <typename Check>
void ForEachContact(unsigned seed, const Check& check) {
  std::mt19937 random(seed);
  for (const SurfacePair& pair : MakeAllPairs()) {
    SCOPED_TRACE(pair.first.name + " on " + pair.second.name);
    for (int sample = 0; sample < kSamples; ++sample) check(pair, DrawPlacement(random, pair, 0.002), random);
  }
}

TEST(FindContactTest, FindsKnownContactsWithoutAGuess) {
  ForEachContact(41, [](const SurfacePair& pair, const Placement& placement, std::mt19937& /*random*/) {
    ExpectSameContact(FindContact(*pair.first.surface, *pair.second.surface, placement.X_OF), placement,
                      pair);
  });
}

TEST(FindContactTest, FindsKnownContactsFromANearbyGuess) {
  ForEachContact(42, [](const SurfacePair& pair, const Placement& placement, std::mt19937& random) {
    Vector5d offset = 0.05 * DrawVector(random, 5);
    if (pair.second.name == "plane") offset.segment<2>(2) *= 0.01;
    if (pair.second.name == "cylinder") offset(3) *= 0.01;
    const ContactCoordinates guess = Displace(placement.kappa, offset);
    ExpectSameContact(FindContact(*pair.first.surface, *pair.second.surface, placement.X_OF, guess),
                      placement, pair);
  });
}

TEST(FindContactTest, ImpossibleInputIsAClearError) {
  const Sphere ball(0.01);
  const Plane plane;
  Pose X_OF = Pose::Identity();
  X_OF.translation() = Vector3d(0.0, 0.0, 0.012);
  const FoundContact hovering = FindContact(ball, plane, X_OF);
  EXPECT_NEAR(hovering.gap, 0.002, kConverged);
  // Parallel planes have no closest pair; a ball whose start is its far side meets the wrong normals.
  EXPECT_TRUE(Throws<SingularityError>(
      [&] {
        Pose tilted = X_OF;
        tilted.linear() = Eigen::AngleAxisd(3.0, Vector3d::UnitX()).toRotationMatrix();
        return FindContact(plane, plane, tilted, {});
      },
      "no contact found"));
  const ContactCoordinates far_side = {{0.0, kPi / 2.0 - 1e-3, 0}, {0.0, 0.0, 0}, 0.0};
  EXPECT_TRUE(
      Throws<SingularityError>([&] { return FindContact(ball, plane, X_OF, far_side); }, "no contact found"));
}

}  // namespace
}  // namespace dexcheck::testing::find_contact_test
