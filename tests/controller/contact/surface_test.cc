#include "controller/contact/surface.h"

#include <gtest/gtest.h>

#include <limits>

#include "controller/common/errors.h"
#include "controller/contact/shapes.h"
#include "tests/common/matrix_near.h"
#include "tests/common/throws.h"
#include "tests/controller/contact/contact_fixtures.h"

namespace dexcheck::testing::surface_test {
namespace {

constexpr int kSamples = 100;

// Rounding of a few dozen operations on numbers of order one.
constexpr double kRounding = 1e-14;
// Five-point differences, error h^4 f^(5) / 30 with h = 1e-3; measured 8.3e-11, near a latitude chart's pole.
constexpr double kDifference = 5e-10;

Vector3d CalcGradient(const std::function<double(const Vector3d&)>& F, const Vector3d& p, double length) {
  Vector3d gradient;
  for (int i = 0; i < 3; ++i) {
    const auto along = [&](double s) {
      return Eigen::Matrix<double, 1, 1>(F(p + s * length * Vector3d::Unit(i)));
    };
    gradient(i) = Differentiate(along)(0, 0) / length;
  }
  return gradient;
}

// Gauss frame, M, K, T by differences of the chart's points and axes only, scaled to order one by `length`.
struct DifferencedGeometry {
  Matrix3d R;
  Matrix2d M;
  Matrix2d K;
  Eigen::RowVector2d T;
};

DifferencedGeometry DifferenceGeometry(const Surface& surface, const SurfacePoint& alpha, double u_step,
                                       double v_step) {
  const auto at = [&](double du, double dv) {
    return surface.Evaluate({alpha.u + du, alpha.v + dv, alpha.chart});
  };
  const auto differentiate = [&](const auto& get) {
    Eigen::Matrix<double, 3, 2> d;
    d << Differentiate([&](double s) { return MatrixXd(get(at(s * u_step, 0.0))); }) / u_step,
        Differentiate([&](double s) { return MatrixXd(get(at(0.0, s * v_step))); }) / v_step;
    return d;
  };
  const Eigen::Matrix<double, 3, 2> c_uv = differentiate([](const SurfaceGeometry& g) { return g.p; });
  const Eigen::Matrix<double, 3, 2> n_uv =
      differentiate([](const SurfaceGeometry& g) -> Vector3d { return g.R.col(2); });
  const Eigen::Matrix<double, 3, 2> x_uv =
      differentiate([](const SurfaceGeometry& g) -> Vector3d { return g.R.col(0); });

  DifferencedGeometry result;
  const Vector3d x = c_uv.col(0).normalized();
  const Vector3d z = c_uv.col(0).cross(c_uv.col(1)).normalized();
  result.R << x, z.cross(x), z;
  result.M = result.R.leftCols<2>().transpose() * c_uv;
  result.K = result.R.leftCols<2>().transpose() * n_uv * result.M.inverse();
  result.T = result.R.col(1).transpose() * x_uv * result.M.inverse();
  return result;
}

TEST(SurfaceTest, FrameAndParametersMatchFiniteDifferencesInEveryChart) {
  std::mt19937 random(1);
  double largest_curvature = 0.0;
  double largest_torsion = 0.0;
  for (const NamedSurface& named : MakeAllSurfaces()) {
    for (int chart = 0; chart < named.surface->num_charts(); ++chart) {
      for (int sample = 0; sample < kSamples; ++sample) {
        const SurfacePoint alpha = DrawPoint(random, named, chart);
        SCOPED_TRACE(named.name + " chart " + std::to_string(chart) + " u " + std::to_string(alpha.u) +
                     " v " + std::to_string(alpha.v));
        const double u_step = named.name == "plane" ? named.length : 1.0;
        const double v_step = named.name == "plane" || named.name == "cylinder" ? named.length : 1.0;
        const SurfaceGeometry geometry = named.surface->Evaluate(alpha);
        const DifferencedGeometry expected = DifferenceGeometry(*named.surface, alpha, u_step, v_step);
        const double L = named.length;
        EXPECT_TRUE(MatrixNear(geometry.R, expected.R, kDifference));
        EXPECT_TRUE(MatrixNear(geometry.M, expected.M, kDifference));
        EXPECT_TRUE(MatrixNear(L * geometry.K, L * expected.K, kDifference));
        EXPECT_TRUE(MatrixNear(L * geometry.T, L * expected.T, kDifference));
        largest_curvature = std::max(largest_curvature, L * geometry.K.norm());
        largest_torsion = std::max(largest_torsion, L * geometry.T.norm());
      }
    }
  }
  EXPECT_GT(largest_curvature, 1.0);
  EXPECT_GT(largest_torsion, 1.0);
}

// The normal must point out of the body; the criterion is the implicit function, which knows no chart.
bool PointsOutward(const SurfaceGeometry& geometry, const NamedSurface& named) {
  return named.F(geometry.p + 1e-3 * named.length * geometry.R.col(2)) > 0.0 &&
         named.F(geometry.p - 1e-3 * named.length * geometry.R.col(2)) < 0.0;
}

TEST(SurfaceTest, PointsLieOnTheBodyAndNormalsPointOut) {
  std::mt19937 random(2);
  for (const NamedSurface& named : MakeAllSurfaces()) {
    for (int sample = 0; sample < kSamples; ++sample) {
      SCOPED_TRACE(named.name);
      const int chart = sample % named.surface->num_charts();
      const SurfaceGeometry geometry = named.surface->Evaluate(DrawPoint(random, named, chart));
      EXPECT_NEAR(named.F(geometry.p) / named.length, 0.0, kRounding);
      EXPECT_TRUE(PointsOutward(geometry, named));
      const Vector3d n = CalcGradient(named.F, geometry.p, named.length).normalized();
      EXPECT_TRUE(MatrixNear(geometry.R.col(2), n, kDifference));
      EXPECT_TRUE(MatrixNear(geometry.R.transpose() * geometry.R, Matrix3d::Identity(), kRounding));
      EXPECT_NEAR(geometry.R.determinant(), 1.0, kRounding);
    }
  }
}

// A sphere's chart in the usual order (latitude, longitude): the fault that the checks above must catch.
TEST(SurfaceTest, ExchangedChartOrderTurnsTheNormalInward) {
  constexpr double kU = 0.3;
  constexpr double kV = 0.4;
  const NamedSurface named = MakeSphere(1.0);
  const SurfaceJet swapped = {
      .c = {std::cos(kU) * std::cos(kV), std::cos(kU) * std::sin(kV), std::sin(kU)},
      .c_u = {-std::sin(kU) * std::cos(kV), -std::sin(kU) * std::sin(kV), std::cos(kU)},
      .c_v = {-std::cos(kU) * std::sin(kV), std::cos(kU) * std::cos(kV), 0.0},
      .c_uu = {-std::cos(kU) * std::cos(kV), -std::cos(kU) * std::sin(kV), -std::sin(kU)},
      .c_uv = {std::sin(kU) * std::sin(kV), -std::sin(kU) * std::cos(kV), 0.0},
      .c_vv = {-std::cos(kU) * std::cos(kV), -std::cos(kU) * std::sin(kV), 0.0}};
  const SurfaceGeometry geometry = CalcSurfaceGeometry(swapped);
  EXPECT_FALSE(PointsOutward(geometry, named));
  EXPECT_TRUE(MatrixNear(geometry.K, -Matrix2d::Identity(), kRounding));
}

TEST(SurfaceTest, ChartsAgreeOnThePointAndItsCurvatures) {
  std::mt19937 random(4);
  for (const NamedSurface& named : {MakeSphere(), MakeEllipsoid()}) {
    for (int sample = 0; sample < kSamples; ++sample) {
      SCOPED_TRACE(named.name);
      const Vector3d direction = DrawVector(random, 3);
      if (std::abs(direction.normalized().x()) > 0.99 || std::abs(direction.normalized().z()) > 0.99)
        continue;
      const SurfacePoint alpha_0 = named.surface->ToChart(named.surface->Project(direction).alpha, 0);
      const SurfacePoint alpha_1 = named.surface->ToChart(alpha_0, 1);
      const SurfaceGeometry g_0 = named.surface->Evaluate(alpha_0);
      const SurfaceGeometry g_1 = named.surface->Evaluate(alpha_1);
      EXPECT_EQ(alpha_1.chart, 1);
      EXPECT_TRUE(MatrixNear(g_0.p, g_1.p, kRounding));
      EXPECT_TRUE(MatrixNear(g_0.R.col(2), g_1.R.col(2), 10.0 * kRounding));
      // K is a tensor: it turns with the frame.
      const Matrix2d turn = g_0.R.leftCols<2>().transpose() * g_1.R.leftCols<2>();
      EXPECT_TRUE(MatrixNear(named.length * turn.transpose() * g_0.K * turn, named.length * g_1.K,
                             100.0 * kRounding));
      const SurfacePoint back = named.surface->ToChart(alpha_1, 0);
      EXPECT_NEAR(back.u, alpha_0.u, 10.0 * kRounding);
      EXPECT_NEAR(back.v, alpha_0.v, 10.0 * kRounding);
    }
  }
}

TEST(SurfaceTest, NormalizeKeepsThePointAndLeavesTheEdgeOfAChart) {
  std::mt19937 random(5);
  int changes = 0;
  for (const NamedSurface& named : MakeAllSurfaces()) {
    for (int sample = 0; sample < kSamples; ++sample) {
      SCOPED_TRACE(named.name);
      SurfacePoint alpha = DrawPoint(random, named, sample % named.surface->num_charts());
      const SurfacePoint normalized = named.surface->Normalize(alpha);
      changes += normalized.chart != alpha.chart ? 1 : 0;
      EXPECT_TRUE(
          MatrixNear(named.surface->Evaluate(normalized).p, named.surface->Evaluate(alpha).p, kRounding));
      if (named.surface->num_charts() > 1) EXPECT_LE(std::abs(normalized.v), 1.1);
    }
  }
  EXPECT_GT(changes, 10);
  // Coordinates carried over the pole (latitude above a right angle) and past the seam of a period.
  const Sphere sphere(1.0);
  const SurfacePoint over_pole = sphere.Normalize({0.2, kPi / 2.0 + 0.1, 0});
  EXPECT_TRUE(MatrixNear(
      sphere.Evaluate(over_pole).p,
      Vector3d(-std::sin(0.1) * std::cos(0.2), -std::sin(0.1) * std::sin(0.2), std::cos(0.1)), kRounding));
  const SurfacePoint wrapped = Torus(2.0, 1.0).Normalize({kPi + 0.1, -kPi - 0.2, 0});
  EXPECT_NEAR(wrapped.u, -kPi + 0.1, kRounding);
  EXPECT_NEAR(wrapped.v, kPi - 0.2, kRounding);
}

TEST(SurfaceTest, BadInputIsAClearError) {
  using Invalid = std::invalid_argument;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(Throws<Invalid>([] { return Sphere(0.0).radius(); }, "sphere radius"));
  EXPECT_TRUE(Throws<Invalid>([] { return Cylinder(-1.0).radius(); }, "cylinder radius"));
  EXPECT_TRUE(Throws<Invalid>([&] { return Ellipsoid({1.0, nan, 1.0}).num_charts(); }, "semi-axis"));
  EXPECT_TRUE(Throws<Invalid>([] { return Torus(0.01, 0.02).num_charts(); }, "ring radius"));
  EXPECT_TRUE(Throws<Invalid>([] { return Torus(0.01, 0.0).num_charts(); }, "tube radius"));
  const Sphere sphere(0.02);
  EXPECT_TRUE(Throws<Invalid>([&] { return sphere.Evaluate({0.0, 0.0, 2}); }, "chart"));
  EXPECT_TRUE(Throws<Invalid>([&] { return sphere.Evaluate({nan, 0.0, 0}); }, "u: must be finite"));
  EXPECT_TRUE(Throws<Invalid>([&] { return sphere.Evaluate({0.0, nan, 0}); }, "v: must be finite"));
  EXPECT_TRUE(Throws<SingularityError>([&] { return sphere.Evaluate({0.0, kPi / 2.0, 0}); }, "pole"));
  EXPECT_TRUE(Throws<Invalid>([&] { return sphere.ToChart({0.0, 0.0, 0}, -1); }, "chart"));
  EXPECT_TRUE(Throws<Invalid>([&] { return sphere.Locate({0.0, 0.0, 0.021}, 1e-4); }, "distance"));
  EXPECT_EQ(sphere.Locate({0.0, 0.0, 0.02001}, 1e-4).chart, 1);
}

// Parallel surfaces are those of contacts of bodies that overlap.
constexpr double kParallelRounding = 1e-13;
constexpr SurfacePoint kPoints[] = {{0.3, 0.2, 0}, {-1.1, 0.7, 0}, {2.0, -0.5, 0}};

void ExpectSame(const SurfaceGeometry& a, const SurfaceGeometry& b) {
  EXPECT_LE((a.p - b.p).norm(), kParallelRounding);
  EXPECT_LE((a.R - b.R).norm(), kParallelRounding);
  EXPECT_LE((a.M - b.M).norm(), kParallelRounding);
  EXPECT_LE((a.K - b.K).norm(), kParallelRounding * b.K.norm());
  EXPECT_LE((a.T - b.T).norm(), kParallelRounding * (1.0 + b.T.norm()));
}

TEST(ParallelSurface, OfATorusIsATorus) {
  const Torus torus(0.6, 0.2);
  const Torus thinner(0.6, 0.17);
  for (const SurfacePoint& at : kPoints) {
    ExpectSame(CalcParallelSurface(torus.Evaluate(at), -0.03), thinner.Evaluate(at));
  }
}

// K and M are full matrices, because the chart's lines are not lines of curvature.
TEST(ParallelSurface, OfAnEllipsoidMovesAsItsPointsDo) {
  const Ellipsoid ellipsoid(Vector3d(0.5, 0.7, 0.9));
  constexpr double kDistance = 0.05;
  constexpr double kStep = 1e-6;  // central differences: errors of 1e-12 / kStep
  for (const SurfacePoint& at : kPoints) {
    const SurfaceGeometry surface = CalcParallelSurface(ellipsoid.Evaluate(at), kDistance);
    EXPECT_GT(std::abs(ellipsoid.Evaluate(at).K(0, 1)), 1e-3);
    for (int k = 0; k < 2; ++k) {
      SurfacePoint ahead = at;
      SurfacePoint behind = at;
      (k == 0 ? ahead.u : ahead.v) += kStep;
      (k == 0 ? behind.u : behind.v) -= kStep;
      const SurfaceGeometry a = CalcParallelSurface(ellipsoid.Evaluate(ahead), kDistance);
      const SurfaceGeometry b = CalcParallelSurface(ellipsoid.Evaluate(behind), kDistance);
      const Vector2d rate = surface.M.col(k);
      const auto xy = surface.R.leftCols<2>();
      EXPECT_LE(((a.p - b.p) / (2.0 * kStep) - xy * rate).norm(), 1e-8);
      EXPECT_LE(((a.R.col(2) - b.R.col(2)) / (2.0 * kStep) - xy * (surface.K * rate)).norm(), 1e-8);
      const Vector3d x_dot = (a.R.col(0) - b.R.col(0)) / (2.0 * kStep);
      EXPECT_NEAR(surface.R.col(1).dot(x_dot), surface.T.dot(rate), 1e-8);
    }
  }
}

// A box: six flat charts that end at its edges.
TEST(BoxTest, HasAFlatChartOnEachFaceThatEndsAtItsEdges) {
  const Vector3d h(0.03, 0.04, 0.05);
  const Box box(h);
  std::mt19937 random(5);
  std::vector<Vector3d> normals;
  for (int chart = 0; chart < 6; ++chart) {
    SCOPED_TRACE(chart);
    for (int sample = 0; sample < kSamples; ++sample) {
      const SurfacePoint alpha{0.027 * DrawVector(random, 1)[0], 0.027 * DrawVector(random, 1)[0], chart};
      ASSERT_TRUE(box.Contains(alpha, 0.003));
      const SurfaceGeometry geometry = box.Evaluate(alpha);
      const Vector3d n = geometry.R.col(2);
      EXPECT_TRUE(MatrixNear(geometry.R.transpose() * geometry.R, Matrix3d::Identity().eval(), kRounding));
      EXPECT_NEAR(geometry.R.determinant(), 1.0, kRounding);
      EXPECT_NEAR((geometry.p.cwiseAbs() - h).maxCoeff(), 0.0, kRounding);
      EXPECT_NEAR(n.dot(geometry.p), n.cwiseAbs().dot(h), kRounding);
      EXPECT_TRUE(MatrixNear(geometry.M, Matrix2d::Identity().eval(), kRounding));
      EXPECT_TRUE(MatrixNear(geometry.K, Matrix2d::Zero().eval(), 0.0));
      EXPECT_EQ(geometry.T.norm(), 0.0);
      const Vector3d moved = box.Evaluate({alpha.u + 1e-3, alpha.v + 2e-3, chart}).p - geometry.p;
      EXPECT_TRUE(MatrixNear(Vector3d(geometry.R.transpose() * moved), Vector3d(1e-3, 2e-3, 0.0), kRounding));
      // Back from a point above and one below.
      for (const double height : {0.01, -0.001}) {
        const SurfaceProjection back = box.Project(geometry.p + height * n);
        EXPECT_EQ(back.alpha.chart, chart);
        EXPECT_NEAR(back.alpha.u, alpha.u, kRounding);
        EXPECT_NEAR(back.alpha.v, alpha.v, kRounding);
        EXPECT_NEAR(back.distance, height, kRounding);
      }
      if (sample == 0) normals.push_back(n);
    }
  }
  for (size_t i = 0; i < normals.size(); ++i) {
    for (size_t j = 0; j < i; ++j) EXPECT_LT(normals[i].dot(normals[j]), 0.5);
  }
  // Face +x is (u, v) = (y, z).
  EXPECT_TRUE(box.Contains({0.04, 0.05, 0}, 0.0));
  EXPECT_FALSE(box.Contains({0.04, 0.05, 0}, 1e-6));
  EXPECT_FALSE(box.Contains({0.041, 0.0, 0}, 0.0));
  EXPECT_NO_THROW((void)box.Evaluate({0.04, 0.05, 0}));
  EXPECT_TRUE(Throws<SingularityError>([&] { (void)box.Evaluate({0.041, 0.0, 0}); }, "beyond the edge"));
  EXPECT_TRUE(Throws<std::invalid_argument>([] { Box(Vector3d(0.1, 0.0, 0.1)); }, "box half length"));
  // Farther from an edge than from a face.
  EXPECT_NEAR(box.Project({0.06, 0.08, 0.0}).distance, 0.05, kRounding);
}

}  // namespace
}  // namespace dexcheck::testing::surface_test
