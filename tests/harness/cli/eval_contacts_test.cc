// dexcheck eval with contacts: G against wrenches worked by hand, J_B against the fingertips' velocities, bad
// contacts.

#include "controller/common/types.h"
#include "tests/common/linear_algebra.h"
#include "tests/common/matrix_near.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::eval_contacts_test {
namespace {

// Lengths of some 0.05 m and unit vectors, a few operations each.
constexpr double kRounding = 1e-15;

MatrixXd ToMatrix(const Json& rows) {
  MatrixXd matrix(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(rows.front().size()));
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      matrix(i, j) = rows.at(static_cast<size_t>(i)).at(static_cast<size_t>(j));
    }
  }
  return matrix;
}

/// files/grasp.json: four fingertips at points on the outer equator of the shipped torus (R + r = 46 mm).
class EvalContacts : public CommandTest {
 protected:
  [[nodiscard]] Json Evaluate(const Json& state) const {
    Write("state.json", state.dump());
    return Json::parse(Expect(0, "eval --state state.json").out);
  }

  Json state_ = Json::parse(ReadFixture("grasp.json"));
};

TEST_F(EvalContacts, GraspMapOfTheEquator) {
  const Json terms = Evaluate(state_);
  const MatrixXd G = ToMatrix(terms.at("G"));
  ASSERT_EQ(G.rows(), 6);
  ASSERT_EQ(G.cols(), 12);
  const MatrixXd points = ToMatrix(state_["contact_points"]);
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
  const Json terms = Evaluate(state_);
  const MatrixXd J_B = ToMatrix(terms.at("J_B"));
  ASSERT_EQ(J_B.rows(), 12);
  ASSERT_EQ(J_B.cols(), 50);
  for (size_t i = 0; i < 4; ++i) {
    const Json& contact = terms.at("contacts").at(i);
    EXPECT_EQ(contact.at("finger"), state_["fingers"].at(i));
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
  state_.erase("fingers");
  const Json expected = Evaluate(state_);
  Json by_kappa = state_;
  by_kappa.erase("contact_points");
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

// Sections 4.4 and 5 as they are printed, from the other terms.
TEST_F(EvalContacts, LawIsThePrintedOne) {
  const Json terms = Evaluate(state_);
  const Json& law = terms.at("law");
  const auto vector = [](const Json& list) {
    const std::vector<double> values = list;
    return VectorXd(Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())));
  };
  const auto expect_near = [](const MatrixXd& actual, const MatrixXd& expected, const char* what) {
    ASSERT_GT(expected.norm(), 1e-3) << what;
    // Gram matrices have the square of a condition number of some hundreds.
    EXPECT_TRUE(MatrixNear(actual, expected, 1e-9 * expected.norm())) << what;
  };
  const MatrixXd J = ToMatrix(terms.at("J_B")), G = ToMatrix(terms.at("G")),
                 P_inv = ToMatrix(terms.at("P_inv"));
  const MatrixXd M_o = ToMatrix(terms.at("M_o")), M_bar = ToMatrix(terms.at("M_bar"));
  const MatrixXd J_pinv = J.transpose() * testing::CalcInverse(J * J.transpose());
  const MatrixXd N = MatrixXd::Identity(50, 50) - J_pinv * J;
  expect_near(ToMatrix(law.at("J_B_pinv")), J_pinv, "J_B_pinv");
  expect_near(ToMatrix(law.at("N")), N, "N");

  const Json& given = state_.at("law");
  const VectorXd X_o = vector(state_.at("object").at("X_o")),
                 X_o_dot = vector(state_.at("object").at("X_o_dot"));
  const VectorXd V_o = P_inv * X_o_dot, xi = vector(state_.at("xi"));
  // (55): X_o_ddot = X_d_ddot + K_v E_dot + K_p E
  const VectorXd X_o_ddot = vector(given.at("X_d_ddot")) +
                            vector(given.at("K_v")).cwiseProduct(vector(given.at("X_d_dot")) - X_o_dot) +
                            vector(given.at("K_p")).cwiseProduct(vector(given.at("X_d")) - X_o);
  const VectorXd V_o_dot = P_inv * X_o_ddot + ToMatrix(terms.at("P_inv_dot")) * X_o_dot;
  expect_near(vector(law.at("V_o_dot")), V_o_dot, "V_o_dot");
  const VectorXd xi_c = J_pinv * G.transpose() * V_o + N * xi;
  expect_near(vector(law.at("xi_c")), xi_c, "xi_c");
  const VectorXd xi_dot_d = J_pinv * (ToMatrix(terms.at("G_dot")).transpose() * V_o +
                                      G.transpose() * V_o_dot - ToMatrix(terms.at("J_B_dot")) * xi_c) +
                            N * vector(given.at("sigma_prime"));
  expect_near(vector(law.at("xi_dot_d")), xi_dot_d, "xi_dot_d");
  // (19), in X_o
  const VectorXd F_o = M_o * X_o_ddot + ToMatrix(terms.at("C_o")) * X_o_dot + vector(terms.at("N_o"));
  expect_near(vector(law.at("F_o")), F_o, "F_o");
  const VectorXd f_c = vector(law.at("f_c")), F_N = vector(law.at("F_N"));
  expect_near(G * f_c, F_o, "G f_c");
  EXPECT_LE((G * F_N).norm(), 1e-9 * f_c.norm());
  EXPECT_GT(F_N.norm(), 1.0);
  for (Eigen::Index i = 0; i < f_c.size(); i += 3)
    EXPECT_LT(std::hypot(f_c[i], f_c[i + 1]), 0.8 * f_c[i + 2]) << i;
  VectorXd force =
      M_bar * xi_dot_d + ToMatrix(terms.at("C_bar")) * xi_c + vector(terms.at("F_bar")) + J.transpose() * f_c;
  const MatrixXd S_v_T_E_v = ToMatrix(terms.at("S_v_T_E_v"));
  const VectorXd wheels = S_v_T_E_v.inverse() * force.head<2>();
  force.head<2>() = wheels;
  expect_near(vector(law.at("tau")), force, "tau");
  const MatrixXd G_pinv = G.transpose() * testing::CalcInverse(G * G.transpose());
  expect_near(ToMatrix(law.at("A")), M_bar * J_pinv * G.transpose() * P_inv + J.transpose() * G_pinv * M_o,
              "A");
}

TEST_F(EvalContacts, ForceClosureNeedsFriction) {
  Json state = state_;
  state.erase("law");
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

}  // namespace
}  // namespace dexcheck::testing::eval_contacts_test
