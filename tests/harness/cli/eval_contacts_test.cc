// dexcheck eval with contacts: G against wrenches worked by hand, J_B against the fingertips' velocities, bad
// contacts.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <ostream>

#include "controller/common/types.h"
#include "tests/common/matrix_near.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck {
namespace {

using Json = nlohmann::json;
using testing::IsRefused;
using testing::MatrixNear;
using testing::ProgramResult;
using testing::RunDexcheck;
using testing::TempFolder;
using testing::WriteText;

// Lengths of some 0.05 m and unit vectors, a few operations each.
constexpr double kRounding = 1e-15;

Json MakeState() {
  std::vector<double> q(51);
  std::vector<double> xi(50);
  for (size_t i = 0; i < q.size(); ++i) q[i] = 0.3 * std::sin(1.0 + static_cast<double>(i));
  for (size_t i = 0; i < xi.size(); ++i) xi[i] = 0.4 * std::cos(2.0 + static_cast<double>(i));
  return {
      {"q", q},
      {"xi", xi},
      {"object", {{"X_o", {0.4, -0.2, 0.7, 0.3, 1.1, -0.5}}, {"X_o_dot", {0.1, 0.2, -0.3, 0.4, 0.5, 0.6}}}}};
}

/// Four points on the outer equator of the shipped torus (R + r = 46 mm).
Json EquatorPoints() {
  return {{0.046, 0.0, 0.0}, {0.0, 0.046, 0.0}, {-0.046, 0.0, 0.0}, {0.0, -0.046, 0.0}};
}

MatrixXd ToMatrix(const Json& rows) {
  MatrixXd matrix(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(rows.front().size()));
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      matrix(i, j) = rows.at(static_cast<size_t>(i)).at(static_cast<size_t>(j));
    }
  }
  return matrix;
}

class EvalContacts : public ::testing::Test {
 protected:
  ProgramResult Run(const Json& state) {
    WriteText(folder_.path() / "state.json", state.dump());
    return RunDexcheck({"eval", "--state", "state.json"}, {folder_.path()});
  }
  Json Evaluate(const Json& state) {
    const ProgramResult result = Run(state);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(result.out);
  }
  TempFolder folder_;
};

TEST_F(EvalContacts, GraspMapOfTheEquator) {
  Json state = MakeState();
  state["contact_points"] = EquatorPoints();
  const Json terms = Evaluate(state);
  const MatrixXd G = ToMatrix(terms.at("G"));
  ASSERT_EQ(G.rows(), 6);
  ASSERT_EQ(G.cols(), 12);
  const MatrixXd points = ToMatrix(EquatorPoints());
  for (int i = 0; i < 4; ++i) {
    // A unit normal force pushes inward through the centre: [-n; 0]. Any force has the moment p x f.
    const Vector3d p = points.row(i);
    EXPECT_TRUE(MatrixNear(G.col(3 * i + 2).head<3>(), -p.normalized(), kRounding));
    EXPECT_TRUE(MatrixNear(G.col(3 * i + 2).tail<3>(), Vector3d::Zero(), kRounding));
    for (int k = 0; k < 3; ++k) {
      const Vector3d force = G.col(3 * i + k).head<3>();
      EXPECT_TRUE(MatrixNear(G.col(3 * i + k).tail<3>(), p.cross(force), kRounding));
    }
  }
}

TEST_F(EvalContacts, ContactJacobianTurnsFingertipVelocityToTheContact) {
  Json state = MakeState();
  state["contact_points"] = EquatorPoints();
  state["fingers"] = {"rf2_tip", "lf1_tip", "rf4_tip", "lf3_tip"};
  const Json terms = Evaluate(state);
  const MatrixXd J_B = ToMatrix(terms.at("J_B"));
  ASSERT_EQ(J_B.rows(), 12);
  ASSERT_EQ(J_B.cols(), 50);
  for (size_t i = 0; i < 4; ++i) {
    const Json& contact = terms.at("contacts").at(i);
    EXPECT_EQ(contact.at("finger"), state["fingers"].at(i));
    const MatrixXd J_f = ToMatrix(terms.at("frames").at(contact.at("finger").get<std::string>()).at("J_f"));
    const MatrixXd g_f_cf = ToMatrix(contact.at("g_f_cf"));
    const Matrix3d R = g_f_cf.topLeftCorner<3, 3>();
    const Vector3d p = g_f_cf.topRightCorner<3, 1>();
    EXPECT_NEAR(p.norm(), 0.009, kRounding);
    const MatrixXd expected = R.transpose() * (J_f.topRows<3>() - Skew(p) * J_f.bottomRows<3>());
    EXPECT_TRUE(MatrixNear(J_B.middleRows(3 * static_cast<Eigen::Index>(i), 3), expected, 10.0 * kRounding));
  }
}

TEST_F(EvalContacts, CoordinatesGiveTheSameTermsAsPoints) {
  Json by_points = MakeState();
  by_points["contact_points"] = EquatorPoints();
  const Json expected = Evaluate(by_points);
  Json by_kappa = MakeState();
  for (const Json& contact : expected.at("contacts")) {
    ASSERT_EQ(contact.at("charts"), Json({0, 0}));
    by_kappa["kappa"].push_back(contact.at("kappa"));
  }
  const Json actual = Evaluate(by_kappa);
  for (const char* name : {"G", "G_dot", "J_B", "J_B_dot"}) {
    const MatrixXd matrix = ToMatrix(expected.at(name));
    ASSERT_GT(matrix.norm(), 1e-3);
    EXPECT_TRUE(MatrixNear(ToMatrix(actual.at(name)), matrix, 10.0 * kRounding * (1.0 + matrix.norm())))
        << name;
  }
}

TEST_F(EvalContacts, ForceClosureNeedsFriction) {
  Json state = MakeState();
  state["contact_points"] = EquatorPoints();
  state["mu"] = 0.8;
  const Json closed = Evaluate(state).at("force_closure");
  EXPECT_EQ(closed.at("closed"), true);
  EXPECT_GT(closed.at("margin_lower"), 0.01);
  EXPECT_GE(closed.at("margin"), closed.at("margin_lower"));
  // All four contacts on one half of the ring: nothing pulls the torus back.
  const double s = 0.046 * std::sqrt(0.5);
  state["contact_points"] = {{0.046, 0.0, 0.0}, {s, s, 0.0}, {s, -s, 0.0}, {0.035, 0.0, 0.011}};
  state["mu"] = 0.2;
  const Json open = Evaluate(state).at("force_closure");
  EXPECT_EQ(open.at("closed"), false);
  EXPECT_EQ(open.at("weakest_wrench").size(), 6U);
}

TEST_F(EvalContacts, RefusesImpossibleContacts) {
  const auto expect_refused = [&](const Json& change, const std::string& message) {
    Json state = MakeState();
    state["contact_points"] = EquatorPoints();
    state.merge_patch(change);
    EXPECT_TRUE(IsRefused(Run(state), {message}));
  };
  expect_refused({{"contact_points", {{0.046, 0, 0}, {0, 0.046, 0}, {-0.046, 0, 0}, {0, -0.046, 0.001}}}},
                 "contact_points[3]: distance of the contact point from the surface [m]");
  expect_refused({{"contact_points", {{0.046, 0, 0}, {0, 0.046, 0}}}},
                 "contact_points: must be a list of 3 to 8 lists");
  const Json row = {0.1, 0.2, 0.3, 0.4, 0.5};
  expect_refused({{"contact_points", nullptr}, {"kappa", {row, row}}},
                 "kappa: must be a list of 3 to 8 lists, one for each");
  expect_refused({{"contact_points", nullptr}, {"kappa", {row, {0.1, 0.2, 0.3, 0.4}, row}}},
                 "kappa[1]: must be a list of 5 numbers, got 4");
  expect_refused({{"kappa", {row, row, row}}}, "kappa: give kappa or contact_points, not both");
  expect_refused({{"mu", 0}}, "mu: must be a positive number, got 0");
  expect_refused({{"mu", -0.5}}, "mu: must be a positive number, got -0.5");
  expect_refused({{"fingers", {"rf1_tip", "rf1_tip", "rf2_tip", "rf3_tip"}}},
                 "fingers[1]: names a fingertip again");
  expect_refused({{"fingers", {"rf1_tip", "nose", "rf2_tip", "rf3_tip"}}},
                 "fingers[1]: must name a fingertip");
  expect_refused({{"object", nullptr}}, "contact_points: needs object");
  expect_refused({{"contact_points", nullptr}, {"mu", 0.5}}, "mu: needs kappa or contact_points");
}

}  // namespace
}  // namespace dexcheck
