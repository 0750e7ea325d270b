// Other libraries' ways to write a floating base: terms are led back, by a route of the test's own, and a
// side that speaks another convention than it says is recognised.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "harness/comparison/consistency.h"
#include "harness/descriptions/term_results.h"
#include "harness/descriptions/urdf_reader.h"
#include "harness/log/npy_file.h"
#include "tests/common/evaluate_terms.h"
#include "tests/common/legged_robots.h"
#include "tests/common/matrix_near.h"

namespace dexcheck::testing::base_convention_test {
namespace {

// Forces of some 100 N over lengths of a metre.
constexpr double kRounding = 1e-11;

RobotDescription ReadQuadruped() {
  UrdfOptions options;
  options.floating = true;
  return ParseUrdf(WriteLeggedUrdf("quadruped", ListQuadruped()), "robot.urdf", options);
}

/// Draws the first state.
void DrawState(const RobotDescription& robot, VectorXd* q, VectorXd* xi) {
  const RobotModel model(robot.spec);
  *q = VectorXd::Zero(model.num_positions());
  *xi = VectorXd::Zero(model.num_velocities());
  StateSource source(model, {}, 1);
  source.DrawPositions(q);
  source.DrawVelocity(xi);
}

TEST(BaseConvention, ListsAllOnce) {
  const std::vector<BaseConvention> all = ListBaseConventions();
  EXPECT_EQ(all.size(), 24U);
  EXPECT_EQ(all[0], BaseConvention());
  std::vector<std::string> names;
  for (const BaseConvention& convention : all) names.push_back(Describe(convention));
  std::ranges::sort(names);
  EXPECT_EQ(std::unique(names.begin(), names.end()), names.end());
}

TEST(BaseConvention, QuaternionsChangePlaces) {
  VectorXd q(8);
  q << 1, 2, 3, 0.5, 0.6, 0.7, 0.8, 9;
  BaseConvention convention;
  convention.position = BaseConvention::Position::kXyzXyzw;
  VectorXd pinocchio(8);
  pinocchio << 1, 2, 3, 0.6, 0.7, 0.8, 0.5, 9;
  EXPECT_EQ(BaseConversion(convention).ConvertPositions(q), pinocchio);
  convention.position = BaseConvention::Position::kWxyzXyz;
  VectorXd drake(8);
  drake << 0.5, 0.6, 0.7, 0.8, 1, 2, 3, 9;
  EXPECT_EQ(BaseConversion(convention).ConvertPositions(q), drake);
}

// At xi_dot along a motion, with v' = B(q) xi:  M' v'_dot + bias' = B^-T (M xi_dot + bias), v'_dot by
// differences of v' along the motion, whose error is a few 1e-9.
TEST(BaseConvention, ForcesAreThoseOfTheMotion) {
  constexpr double kDifference = 1e-6;
  const RobotDescription robot = ReadQuadruped();
  VectorXd q, xi;
  DrawState(robot, &q, &xi);
  AnalyticProvider model(robot.spec, "model");
  const TermResults terms = EvaluateTerms(&model, q, xi);
  const VectorXd xi_dot = VectorXd::LinSpaced(xi.size(), -1.0, 2.0);
  const VectorXd force = terms.M * xi_dot + terms.bias;
  const auto move = [&](double h) {
    VectorXd moved = q;
    const Vector3d turn = h * xi.segment<3>(3);
    const Eigen::Quaterniond before(q[3], q[4], q[5], q[6]);
    const Eigen::Quaterniond after = before * Eigen::AngleAxisd(turn.norm(), turn.normalized());
    moved.segment<4>(3) << after.w(), after.x(), after.y(), after.z();
    return moved;
  };
  int moved_forces = 0;
  for (const BaseConvention& convention : ListBaseConventions()) {
    const BaseConversion conversion(convention);
    constexpr double kStep = 1e-5;
    const VectorXd rate = (conversion.ConvertVelocities(move(kStep), xi + kStep * xi_dot) -
                           conversion.ConvertVelocities(move(-kStep), xi - kStep * xi_dot)) /
                          (2.0 * kStep);
    TermResults other = terms;
    conversion.Apply(q, xi, &other);
    TermResults of_force;
    of_force.M = terms.M;
    of_force.gravity = force;  // led over as a force
    conversion.Apply(q, xi, &of_force);
    EXPECT_TRUE(MatrixNear(other.M * rate + other.bias, of_force.gravity, kDifference * force.norm()))
        << Describe(convention);
    // Power and energy stay the same, and the way back leads back.
    const VectorXd v = conversion.ConvertVelocities(q, xi);
    EXPECT_NEAR(v.dot(other.M * v), xi.dot(terms.M * xi), kRounding * xi.dot(terms.M * xi));
    EXPECT_NEAR(v.dot(other.gravity), xi.dot(terms.gravity), kRounding * 1e3);
    if ((other.bias - terms.bias).norm() > 1.0) ++moved_forces;
    conversion.Restore(q, xi, &other);
    EXPECT_TRUE(MatrixNear(other.M, terms.M, kRounding));
    EXPECT_TRUE(MatrixNear(other.bias, terms.bias, 1e2 * kRounding));
    EXPECT_TRUE(MatrixNear(other.coriolis, terms.coriolis, 1e2 * kRounding));
    EXPECT_TRUE(MatrixNear(other.gravity, terms.gravity, 1e2 * kRounding));
  }
  EXPECT_GE(moved_forces, 20);
}

/// A program that speaks one convention, whatever it says.
class Stubborn : public LayoutProvider {
 public:
  Stubborn(const RobotDescription& robot, const BaseConvention& spoken)
      : LayoutProvider(ProgramLayout(robot)), model_(robot.spec, "model"), spoken_(spoken) {}
  [[nodiscard]] const std::string& name() const override { return model_.name(); }

  TermResults Evaluate(long, const VectorXd& q, const VectorXd& xi) override {
    // The provider gets numbers in the convention that it is taken to use.
    const VectorXd positions = layout().WritePositions(q);
    const VectorXd velocities = layout().WriteVelocities(q, xi);
    VectorXd own_q = positions;
    using Position = BaseConvention::Position;
    if (spoken_.position == Position::kXyzXyzw)
      own_q.segment<4>(3) << positions[6], positions[3], positions[4], positions[5];
    if (spoken_.position == Position::kWxyzXyz)
      own_q.head<7>() << positions.segment<3>(4), positions.head<4>();
    const Matrix3d R =
        Eigen::Quaterniond(own_q[3], own_q[4], own_q[5], own_q[6]).normalized().toRotationMatrix();
    Vector3d linear = spoken_.angular_first ? velocities.segment<3>(3) : velocities.head<3>();
    Vector3d angular = spoken_.angular_first ? velocities.head<3>() : velocities.segment<3>(3);
    if (spoken_.linear_in_base) linear = R * linear;
    if (spoken_.angular_in_world) angular = R.transpose() * angular;
    VectorXd own_xi = velocities;
    own_xi.head<6>() << linear, angular;
    TermResults terms = EvaluateTerms(&model_, own_q, own_xi);
    BaseConversion(spoken_).Apply(own_q, own_xi, &terms);
    layout().ReadTerms(q, xi, &terms);
    return terms;
  }

 private:
  AnalyticProvider model_;
  BaseConvention spoken_;
};

TEST(BaseConvention, OfAProgramIsRecognised) {
  const RobotDescription robot = ReadQuadruped();
  const RobotModel model(robot.spec);
  for (const BaseConvention& spoken : ListBaseConventions()) {
    AnalyticProvider reference(model, "robot.urdf");
    Stubborn program(robot, spoken);
    ConsistencyOptions options;
    options.samples = 5;
    const auto make_feed = [&] { return FeedRandomStates(model, options); };
    const ConsistencyResult result =
        CompareProviders(model, &reference, &program, make_feed(), [](long) { return true; });
    EXPECT_TRUE(result.not_compared.empty());
    EXPECT_EQ(result.Agrees(), spoken == BaseConvention());
    if (!result.Agrees()) EXPECT_EQ(FindOtherConvention(model, &reference, &program, make_feed), spoken);
  }
}

TEST(NpyFile, IsReadBack) {
  const NpyArray array{{2, 3}, {1, 2, 3, 4, 5, 6}};
  const std::string bytes = WriteNpy(array);
  EXPECT_EQ(bytes.size() % 64, 48U);  // six numbers behind a multiple of 64
  const NpyArray back = ParseNpy(bytes, "a.npy");
  EXPECT_EQ(back.shape, array.shape);
  EXPECT_EQ(back.values, array.values);
  std::string fortran = bytes;
  fortran.replace(fortran.find("False"), 5, "True ");
  EXPECT_EQ(ParseNpy(fortran, "a.npy").values, (std::vector<double>{1, 3, 5, 2, 4, 6}));
  EXPECT_EQ(ParseNpy(WriteNpy({{1}, {7}}), "a.npy").shape, (std::vector<size_t>{1}));
  EXPECT_THROW(ParseNpy("", "a.npy"), InputError);
  for (size_t size = 0; size < bytes.size(); ++size)
    EXPECT_THROW(ParseNpy(bytes.substr(0, size), "a.npy"), InputError);
  std::string huge = bytes;
  huge.replace(huge.find("(2, 3)"), 6, "(9999999999999999999, 9999999999)");
  EXPECT_THROW(ParseNpy(huge, "a.npy"), InputError);
}

}  // namespace
}  // namespace dexcheck::testing::base_convention_test
