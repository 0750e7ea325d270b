#include "controller/model/rigid_body.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "tests/common/matrix_near.h"

namespace dexcheck::testing::rigid_body_test {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();
// Some ten roundings of numbers that are at most 1.
constexpr double kRounding = 32.0 * kEps;
// Simpson's rule on 2000 intervals errs by about h^4 / 60 times the fourth derivative, some 1e-12 for these
// profiles of unit size; measured 2.3e-13.
constexpr double kQuadrature = 2e-12;

/// A piece of a solid of revolution as a stack of rings: ring t lies at height z, between two radii.
struct Ring {
  double z;
  double dz;  ///< dz/dt
  double inner;
  double outer;
};
struct Piece {
  double begin;
  double end;
  std::function<Ring(double)> ring;
};

double Integrate(const Piece& piece, const std::function<double(const Ring&)>& density) {
  constexpr int kIntervals = 2000;
  const double h = (piece.end - piece.begin) / kIntervals;
  double sum = 0.0;
  for (int i = 0; i <= kIntervals; ++i) {
    const double weight = (i == 0 || i == kIntervals) ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0);
    const Ring ring = piece.ring(piece.begin + i * h);
    sum += weight * density(ring) * ring.dz;
  }
  return sum * h / 3.0;
}

/// Inertia of unit mass about the origin: dm ~ (R^2 - r^2) dz, dI_z = (R^2 + r^2)/2 dm, dI_x = dI_z/2 + z^2
/// dm.
Matrix3d IntegrateInertia(const std::vector<Piece>& pieces) {
  const auto dm = [](const Ring& s) { return s.outer * s.outer - s.inner * s.inner; };
  const auto k2 = [](const Ring& s) { return (s.outer * s.outer + s.inner * s.inner) / 2.0; };
  double m = 0.0;
  double Ix = 0.0;
  double Iz = 0.0;
  for (const Piece& piece : pieces) {
    m += Integrate(piece, dm);
    Iz += Integrate(piece, [&](const Ring& s) { return k2(s) * dm(s); });
    Ix += Integrate(piece, [&](const Ring& s) { return (k2(s) / 2.0 + s.z * s.z) * dm(s); });
  }
  return Vector3d(Ix / m, Ix / m, Iz / m).asDiagonal();
}

Piece MakeCylinder(double r, double l) {
  return {-l / 2.0, l / 2.0, [=](double z) { return Ring{z, 1.0, 0.0, r}; }};
}

/// The part of a ball about (0, 0, z_0) between two latitudes.
Piece MakeBall(double r, double z_0, double south, double north) {
  return {south, north, [=](double t) {
            return Ring{z_0 + r * std::sin(t), r * std::cos(t), 0.0, r * std::cos(t)};
          }};
}

TEST(UniformInertia, OfRevolutionMatchesQuadrature) {
  const double mass = 2.5;
  EXPECT_TRUE(MatrixNear(CalcUniformInertia(SolidSphere{0.7}, mass),
                         mass * IntegrateInertia({MakeBall(0.7, 0.0, -kPi / 2.0, kPi / 2.0)}), kQuadrature));
  EXPECT_TRUE(MatrixNear(CalcUniformInertia(SolidCylinder{0.4, 1.1}, mass),
                         mass * IntegrateInertia({MakeCylinder(0.4, 1.1)}), kQuadrature));
  const Piece torus{-kPi / 2.0, kPi / 2.0, [](double t) {
                      const double half_width = 0.2 * std::cos(t);
                      return Ring{0.2 * std::sin(t), 0.2 * std::cos(t), 0.6 - half_width, 0.6 + half_width};
                    }};
  EXPECT_TRUE(MatrixNear(CalcUniformInertia(SolidTorus{0.6, 0.2}, mass), mass * IntegrateInertia({torus}),
                         kQuadrature));
}

TEST(UniformInertia, OfCapsuleMatchesItsCylinderAndHalfSpheres) {
  const double r = 0.3;
  const double l = 0.9;
  const Matrix3d expected = IntegrateInertia(
      {MakeCylinder(r, l), MakeBall(r, l / 2.0, 0.0, kPi / 2.0), MakeBall(r, -l / 2.0, -kPi / 2.0, 0.0)});
  EXPECT_TRUE(MatrixNear(CalcUniformInertia(SolidCapsule{r, l}, 1.0), expected, kQuadrature));
  // A cylinder of the capsule's whole length is not a capsule.
  EXPECT_FALSE(MatrixNear(CalcUniformInertia(SolidCylinder{r, l + 2.0 * r}, 1.0), expected, 1e-2));
}

TEST(UniformInertia, OfBoxByHand) {
  // m/12 (s_y^2 + s_z^2) = 12/12 (4 + 9), and cyclic.
  EXPECT_TRUE(MatrixNear(CalcUniformInertia(SolidBox{{1.0, 2.0, 3.0}}, 12.0),
                         Matrix3d(Vector3d(13.0, 10.0, 5.0).asDiagonal()), 16.0 * kRounding));
}

TEST(MassProperties, RotateWithTheShape) {
  Pose X_BS = Pose::Identity();
  X_BS.translation() << 0.1, 0.2, 0.3;
  // A quarter turn about x carries the cylinder's axis from z to -y.
  X_BS.linear() = Eigen::AngleAxisd(kPi / 2.0, Vector3d::UnitX()).toRotationMatrix();
  const MassProperties body = CalcMassProperties(SolidCylinder{1.0, 2.0}, 12.0, X_BS);
  EXPECT_EQ(body.mass, 12.0);
  EXPECT_EQ(body.com, Vector3d(0.1, 0.2, 0.3));
  // I_x = 12 (1/4 + 4/12) = 7, I_axis = 12/2 = 6.
  EXPECT_TRUE(MatrixNear(body.inertia, Matrix3d(Vector3d(7.0, 6.0, 7.0).asDiagonal()), 16.0 * kRounding));
}

TEST(Combine, TwoHalvesMakeTheWhole) {
  Pose X_BS = Pose::Identity();
  X_BS.translation() << 0.3, -0.2, 0.5;
  X_BS.linear() = (Eigen::AngleAxisd(0.7, Vector3d(1.0, 2.0, -2.0) / 3.0)).toRotationMatrix();
  const Pose left = X_BS * Eigen::Translation3d(-0.25, 0.0, 0.0);
  const Pose right = X_BS * Eigen::Translation3d(0.25, 0.0, 0.0);
  const Shape half = SolidBox{{0.5, 0.6, 0.4}};

  const MassProperties whole = CalcMassProperties(SolidBox{{1.0, 0.6, 0.4}}, 2.0, X_BS);
  const MassProperties halves =
      Combine({CalcMassProperties(half, 1.0, left), CalcMassProperties(half, 1.0, right)});
  EXPECT_EQ(halves.mass, 2.0);
  EXPECT_TRUE(MatrixNear(halves.com, whole.com, kRounding));
  EXPECT_TRUE(MatrixNear(halves.inertia, whole.inertia, kRounding));
  // Without the parallel-axis term it would not be.
  EXPECT_FALSE(MatrixNear(2.0 * CalcMassProperties(half, 1.0, left).inertia, whole.inertia, 1e-2));
}

TEST(Combine, NothingWeighsNothing) {
  EXPECT_EQ(Combine({}).mass, 0.0);
  EXPECT_EQ(FindPhysicalInconsistency(Combine({})), "");
  EXPECT_EQ(FindPhysicalInconsistency(Combine({MassProperties{}, MassProperties{}})), "");
}

MassProperties MakeBody(const Vector3d& moments) { return {1.0, Vector3d::Zero(), moments.asDiagonal()}; }

// A point mass whose inertia was moved to its centre of mass: what rounding leaves may be negative.
TEST(PhysicalInconsistency, ForgivesWhatMovingAnInertiaLeaves) {
  MassProperties body{0.526, Vector3d(0.0, 0.0, 0.03), Matrix3d::Zero()};
  body.inertia.diagonal() = Vector3d(-5.42101e-20, -5.42101e-20, 0.0);
  EXPECT_EQ(FindPhysicalInconsistency(body), "");
  body.inertia *= 1e4;
  EXPECT_NE(FindPhysicalInconsistency(body), "");
}

TEST(PhysicalInconsistency, NamesWhatIsWrong) {
  MassProperties body = MakeBody({1.0, 2.0, 2.5});
  EXPECT_EQ(FindPhysicalInconsistency(body), "");
  body.mass = -1.0;
  EXPECT_EQ(FindPhysicalInconsistency(body), "mass must be finite and not negative, got -1");
  body.mass = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(FindPhysicalInconsistency(body), "mass must be finite and not negative, got nan");
  body.mass = 0.0;
  EXPECT_EQ(FindPhysicalInconsistency(body), "a massless body has no inertia, got [1, 2, 2.5]");
  body = MakeBody({1.0, 2.0, 2.5});
  body.com.y() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(FindPhysicalInconsistency(body), "centre of mass must be finite, got [0, inf, 0]");
  body = MakeBody({1.0, 2.0, 2.5});
  body.inertia(0, 1) = 0.25;
  EXPECT_EQ(FindPhysicalInconsistency(body),
            "inertia must be symmetric, got [1, 0.25, 0, 0, 2, 0, 0, 0, 2.5]");
  body.inertia(0, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(FindPhysicalInconsistency(body), "inertia must be finite, got [1, nan, 0, 0, 2, 0, 0, 0, 2.5]");
  EXPECT_EQ(FindPhysicalInconsistency(MakeBody({2.0, -1.0, 2.0})),
            "principal moments of inertia must not be negative, got [-1, 2, 2]");
  EXPECT_EQ(FindPhysicalInconsistency(MakeBody({1.0, 4.0, 2.0})),
            "principal moments of inertia must satisfy the triangle inequality, got [1, 2, 4]");
  EXPECT_EQ(FindUndefinedDynamics(MakeBody({1.0, 4.0, 2.0})), "");
  EXPECT_NE(FindUndefinedDynamics(MakeBody({2.0, -1.0, 2.0})), "");
}

TEST(PhysicalInconsistency, SeesThePrincipalMoments) {
  // The diagonal alone would pass; the eigenvalues are 0.5, 3.5 and 2.
  MassProperties body = MakeBody({2.0, 2.0, 2.0});
  body.inertia(0, 1) = body.inertia(1, 0) = 1.5;
  EXPECT_THAT(FindPhysicalInconsistency(body), ::testing::HasSubstr("triangle inequality"));
}

TEST(PhysicalInconsistency, AllowsForRoundingAndNoMore) {
  // Rods and plates meet the inequalities with equality, however they are turned and joined.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 1000; ++i) {
    std::vector<MassProperties> rod;
    const Vector3d direction(uniform(random), uniform(random), uniform(random));
    for (int k = 0; k < 5; ++k)
      rod.push_back({1.0 + uniform(random), direction * uniform(random), Matrix3d::Zero()});
    EXPECT_EQ(FindPhysicalInconsistency(Combine(rod)), "");

    const Eigen::Quaterniond R = Eigen::Quaterniond(uniform(random), uniform(random), uniform(random), 1.0);
    MassProperties plate = MakeBody({0.1, 1.0, 1.1});
    plate.inertia =
        R.normalized().toRotationMatrix() * plate.inertia * R.normalized().toRotationMatrix().transpose();
    EXPECT_EQ(FindPhysicalInconsistency(plate), "");
  }
  EXPECT_NE(FindPhysicalInconsistency(MakeBody({0.1, 1.0, 1.1 + 1e-12})), "");
}

}  // namespace
}  // namespace dexcheck::testing::rigid_body_test
