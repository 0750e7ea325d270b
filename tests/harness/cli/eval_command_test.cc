// dexcheck eval: state files, names and shapes of the terms, all digits of their values, and the engine's
// side; with contacts G against wrenches worked by hand, J_B against the fingertips' velocities, the law.

#include <random>

#include "controller/common/types.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "tests/common/linear_algebra.h"
#include "tests/common/matrix_near.h"
#include "tests/common/random_robot.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::eval_command_test {
namespace {

std::vector<double> ToList(const VectorXd& vector) { return {vector.begin(), vector.end()}; }

/// A state of the shipped robot or of another one, with an object where asked for.
Json MakeState(const RobotModel& model, bool with_object) {
  std::mt19937 random(4711);
  Json state = {{"q", ToList(DrawPositions(model, &random))},
                {"xi", ToList(DrawVelocities(model.num_velocities(), &random))}};
  if (with_object) {
    state["object"] = {{"X_o", {0.4, -0.2, 0.7, 0.3, 1.1, -0.5}},
                       {"X_o_dot", {1.0, 0.1, -0.2, 0.3, 0.4, 0.5}}};
  }
  return state;
}

MatrixXd ToMatrix(const Json& rows) {
  const bool is_vector = !rows.front().is_array();
  const auto cols = static_cast<Eigen::Index>(is_vector ? 1 : rows.front().size());
  MatrixXd matrix(static_cast<Eigen::Index>(rows.size()), cols);
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    const Json& row = rows.at(static_cast<size_t>(i));
    EXPECT_EQ(is_vector ? 1U : row.size(), static_cast<size_t>(cols));
    for (Eigen::Index j = 0; j < cols; ++j) matrix(i, j) = is_vector ? row : row.at(static_cast<size_t>(j));
  }
  return matrix;
}

class EvalCommand : public CommandTest {
 protected:
  /// Returns the output of eval for this state.
  [[nodiscard]] Json Evaluate(const Json& state, const Words& options = "--out -") const {
    Write("state.json", state.dump());
    const ProgramResult result = Expect(0, Words("eval --state state.json") + options);
    EXPECT_EQ(result.err, "");
    return Json::parse(result.out);
  }
};

struct Shape {
  const char* name;
  Eigen::Index rows;
  Eigen::Index cols;
};

void ExpectShapes(const Json& terms, const std::vector<Shape>& shapes) {
  for (const Shape& shape : shapes) {
    SCOPED_TRACE(shape.name);
    ASSERT_TRUE(terms.contains(shape.name));
    const MatrixXd matrix = ToMatrix(terms.at(shape.name));
    EXPECT_EQ(matrix.rows(), shape.rows);
    EXPECT_EQ(matrix.cols(), shape.cols);
    EXPECT_TRUE(matrix.allFinite());
    EXPECT_GT(matrix.cwiseAbs().maxCoeff(), 0.0);
  }
}

TEST_F(EvalCommand, ShippedRobotHasEveryTerm) {
  const RobotModel model = ReadRobotModel(kParameters + "assistant_robot.toml");
  const Json terms = Evaluate(MakeState(model, true));
  EXPECT_EQ(terms.at("robot"), "personal assistant robot");
  ExpectShapes(terms, {{"q", 51, 1},        {"xi", 50, 1},
                       {"M_bar", 50, 50},   {"C_bar", 50, 50},
                       {"C_bar_xi", 50, 1}, {"gravity", 50, 1},
                       {"friction", 50, 1}, {"F_bar", 50, 1},
                       {"bias", 50, 1},     {"M", 51, 51},
                       {"C", 51, 51},       {"F", 51, 1},
                       {"A_v", 1, 3},       {"S_v", 3, 2},
                       {"S_v_dot", 3, 2},   {"E_v", 3, 2},
                       {"S_v_T_E_v", 2, 2}, {"linear_momentum", 3, 1},
                       {"P", 6, 6},         {"P_inv", 6, 6},
                       {"P_inv_dot", 6, 6}, {"V_o", 6, 1},
                       {"M_o", 6, 6},       {"C_o", 6, 6},
                       {"N_o", 6, 1},       {"angular_momentum", 3, 1}});
  EXPECT_GT(terms.at("kinetic_energy"), 0.0);
  EXPECT_GT(terms.at("potential_energy"), 0.0);
  ASSERT_EQ(terms.at("fingertip_pose").size(), 8U);
  for (size_t tip = 0; tip < 8; ++tip) {
    const std::string frame = std::string(tip < 4 ? "rf" : "lf") + std::to_string(tip % 4 + 1) + "_tip";
    EXPECT_EQ(terms.at("fingertip_pose").at(tip), terms.at("frames").at(frame).at("pose"));
  }
  ASSERT_EQ(terms.at("frames").size(), 11U);  // fingertips, palms, base
  for (const auto& [name, frame] : terms.at("frames").items()) {
    SCOPED_TRACE(name);
    ExpectShapes(frame, {{"pose", 4, 4}, {"J_f", 6, 50}});
    if (name == "base_frame") continue;  // its Jacobian in its own axes is constant
    ExpectShapes(frame, {{"J_f_dot", 6, 50}, {"J_f_dot_xi", 6, 1}});
  }
  EXPECT_TRUE(ToMatrix(terms.at("frames").at("base_frame").at("J_f_dot")).isZero(0.0));
  EXPECT_FALSE(terms.contains("engine"));
}

TEST_F(EvalCommand, PandaHasEveryTerm) {
  const RobotModel model = ReadRobotModel(kPandaToml);
  const Json terms = Evaluate(MakeState(model, false), {"--robot", kPandaToml});
  ExpectShapes(terms,
               {{"q", 7, 1}, {"xi", 7, 1}, {"M_bar", 7, 7}, {"C_bar", 7, 7}, {"bias", 7, 1}, {"M", 7, 7}});
  ExpectShapes(terms.at("frames").at("panda_flange"), {{"pose", 4, 4}, {"J_f", 6, 7}});
  EXPECT_TRUE(terms.at("fingertip_pose").empty());
  for (const char* name : {"S_v", "M_o", "P"}) EXPECT_FALSE(terms.contains(name)) << name;
}

TEST_F(EvalCommand, ValuesKeepAllTheirDigits) {
  const RobotModel model = ReadRobotModel(kParameters + "assistant_robot.toml");
  const Json state = MakeState(model, false);
  const Json terms = Evaluate(state);
  EXPECT_EQ(terms.at("q"), state.at("q"));
  EXPECT_EQ(terms.at("xi"), state.at("xi"));
  ModelTerms expected(model);
  expected.SetState(ToMatrix(state.at("q")), ToMatrix(state.at("xi")));
  expected.CalcDynamics();
  // To the last bit.
  EXPECT_EQ(ToMatrix(terms.at("M_bar")), expected.M());
  EXPECT_EQ(ToMatrix(terms.at("C_bar")), expected.C());
  EXPECT_EQ(ToMatrix(terms.at("gravity")), expected.gravity());
  EXPECT_EQ(ToMatrix(terms.at("friction")), expected.friction());
  EXPECT_EQ(ToMatrix(terms.at("fingertip_pose").at(0)),
            expected.CalcFramePose(model.fingertips().front()).matrix());
}

TEST_F(EvalCommand, WritesTheSameToAFile) {
  const RobotModel model = ReadRobotModel(kPandaToml);
  const Words robot = {"--robot", kPandaToml};
  const Json printed = Evaluate(MakeState(model, false), robot);
  const ProgramResult result = Expect(0, Words("eval --state state.json --out out.json") + robot);
  EXPECT_EQ(result.out + result.err, "");
  EXPECT_EQ(ReadJson("out.json"), printed);
}

// Measured at most 8e-15 on both robots.
constexpr double kRounding = 5e-14;

/// Largest difference between the model's and the engine's value of a term, relative to the engine's largest
/// entry, or to 1 where that is smaller.
double CompareTerm(const Json& model, const Json& engine, const char* name) {
  const MatrixXd expected = ToMatrix(engine.at(name));
  const double scale = std::max(expected.cwiseAbs().maxCoeff(), 1.0);
  return (ToMatrix(model.at(name)) - expected).cwiseAbs().maxCoeff() / scale;
}

const std::vector<const char*> kCommonTerms = {"M_bar", "C_bar_xi", "gravity",         "friction",
                                               "F_bar", "bias",     "linear_momentum", "angular_momentum"};

class EvalWithEngine : public EvalCommand,
                       public ::testing::WithParamInterface<std::pair<const char*, const char*>> {};

TEST_P(EvalWithEngine, BothSidesAgreeTermByTerm) {
  const std::string robot = kParameters + GetParam().first;
  const Json terms = Evaluate(MakeState(ReadRobotModel(robot), false),
                              {"--robot", robot, "--mjcf", kMjcf + GetParam().second});
  const Json& engine = terms.at("engine");
  for (const char* name : kCommonTerms) {
    EXPECT_GT(ToMatrix(engine.at(name)).norm(), 0.0) << name;
    EXPECT_LT(CompareTerm(terms, engine, name), kRounding) << name;
  }
  for (const char* name : {"kinetic_energy", "potential_energy"}) {
    EXPECT_NEAR(terms.at(name), engine.at(name), kRounding * engine.at(name).get<double>()) << name;
  }
  EXPECT_EQ(engine.at("fingertip_pose").size(), terms.at("fingertip_pose").size());
  ASSERT_EQ(engine.at("frames").size(), terms.at("frames").size());
  for (const auto& [name, frame] : engine.at("frames").items()) {
    for (const char* term : {"pose", "J_f", "J_f_dot_xi"}) {
      EXPECT_LT(CompareTerm(terms.at("frames").at(name), frame, term), kRounding) << name << " " << term;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, EvalWithEngine,
                         ::testing::Values(std::pair("assistant_robot.toml", "scene.xml"),
                                           std::pair("panda.toml", "panda.xml")),
                         [](const auto& info) { return info.index == 0 ? "Assistant" : "Panda"; });

TEST_F(EvalCommand, EngineKnowsNothingOfTheParameters) {
  const std::string panda = ReadText(kPandaToml);
  WriteChanged("bad.toml", panda, "mass = 3.228604", "mass = 3.3");
  const Json state = MakeState(ReadRobotModel(kPandaToml), false);
  const std::string mjcf = kPandaXml;
  const Json good = Evaluate(state, {"--robot", kPandaToml, "--mjcf", mjcf});
  const Json bad = Evaluate(state, {"--robot", "bad.toml", "--mjcf", mjcf});
  EXPECT_EQ(bad.at("engine"), good.at("engine"));
  EXPECT_GT(CompareTerm(bad, bad.at("engine"), "M_bar"), 1e-4);
  EXPECT_GT(CompareTerm(bad, bad.at("engine"), "gravity"), 1e-4);
  EXPECT_LT(CompareTerm(bad, bad.at("engine"), "friction"), kRounding);
}

// A ball joint has four positions and three velocities; model and engine have the same terms there.
TEST_F(EvalCommand, BallJointsHaveQuaternions) {
  Write("arm.xml",
        R"(<mujoco model="arm"><compiler angle="radian"/><worldbody><body name="stand">
<body name="upper" pos="0 0 1"><joint name="shoulder" type="ball" damping="0.2" armature="0.01" limited="true" range="0 1.5"/>
<inertial pos="0.1 0.02 0" mass="2" diaginertia="0.01 0.02 0.025"/>
<body name="lower" pos="0.3 0 0"><joint name="elbow" axis="0 1 0"/>
<inertial pos="0.1 0 0.01" mass="1" diaginertia="0.004 0.006 0.008"/></body></body></body></worldbody></mujoco>)");
  Expect(0, "import arm.xml --out arm.toml");
  const Words files = "--robot arm.toml --mjcf arm.xml";
  const Json terms = Evaluate({{"q", {0.8, 0.3, -0.4, 0.2, 0.7}}, {"xi", {1.0, -2.0, 0.5, 1.5}}}, files);
  const Json& engine = terms.at("engine");
  constexpr double kRounding = 1e-14;  // of 2 kg over 1 m
  EXPECT_TRUE(MatrixNear(ToMatrix(terms.at("M_bar")), ToMatrix(engine.at("M_bar")), kRounding));
  for (const char* force : {"C_bar_xi", "gravity", "friction", "bias"}) {
    const MatrixXd values = ToMatrix(terms.at(force));
    EXPECT_GT(values.topRows(3).cwiseAbs().maxCoeff(), 0.01) << force;
    EXPECT_TRUE(MatrixNear(values, ToMatrix(engine.at(force)), 100.0 * kRounding)) << force;
  }
  for (const auto& [q, parts] : std::vector<std::pair<Json, std::vector<std::string>>>{
           {{0.1, 0.2}, {"state.json: q: ", "5 numbers", "ball joint, \"shoulder\"", "got 2"}},
           {{0, 0, 0, 0, 0.7}, {"state.json: q[0..3]: ", "quaternion", "joint \"shoulder\""}}}) {
    Write("state.json", Json({{"q", q}, {"xi", {1.0, -2.0, 0.5, 1.5}}}).dump());
    EXPECT_TRUE(Refused(Words("eval --state state.json") + files, parts));
  }
}

// Lengths of some 0.05 m and unit vectors, a few operations each.
constexpr double kUnitRounding = 1e-15;

/// files/grasp.json: four fingertips at points on the outer equator of the shipped torus (R + r = 46 mm).
class EvalContacts : public EvalCommand {
 protected:
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
    EXPECT_TRUE(MatrixNear(G.col(3 * i + 2).head<3>(), -p.normalized(), kUnitRounding));
    EXPECT_TRUE(MatrixNear(G.col(3 * i + 2).tail<3>(), Vector3d::Zero(), kUnitRounding));
    for (int k = 0; k < 3; ++k) {
      const Vector3d force = G.col(3 * i + k).head<3>();
      EXPECT_TRUE(MatrixNear(G.col(3 * i + k).tail<3>(), p.cross(force), kUnitRounding));
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
    EXPECT_NEAR(p.norm(), 0.009, kUnitRounding);
    const MatrixXd expected = R.transpose() * (J_f.topRows<3>() - Skew(p) * J_f.bottomRows<3>());
    EXPECT_TRUE(
        MatrixNear(J_B.middleRows(3 * static_cast<Eigen::Index>(i), 3), expected, 10.0 * kUnitRounding));
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
    EXPECT_TRUE(MatrixNear(ToMatrix(actual.at(name)), matrix, 10.0 * kUnitRounding * (1.0 + matrix.norm())))
        << name;
  }
}

// Sections 4.4 and 5 as they are printed, from the other terms.
TEST_F(EvalContacts, LawIsThePrintedOne) {
  const Json terms = Evaluate(state_);
  const Json& law = terms.at("law");
  const auto expect_near = [](const MatrixXd& actual, const MatrixXd& expected, const char* what) {
    ASSERT_GT(expected.norm(), 1e-3) << what;
    // Gram matrices have the square of a condition number of some hundreds.
    EXPECT_TRUE(MatrixNear(actual, expected, 1e-9 * expected.norm())) << what;
  };
  const MatrixXd J = ToMatrix(terms.at("J_B")), G = ToMatrix(terms.at("G")),
                 P_inv = ToMatrix(terms.at("P_inv"));
  const MatrixXd M_o = ToMatrix(terms.at("M_o")), M_bar = ToMatrix(terms.at("M_bar"));
  const MatrixXd J_pinv = J.transpose() * CalcInverse(J * J.transpose());
  const MatrixXd N = MatrixXd::Identity(50, 50) - J_pinv * J;
  expect_near(ToMatrix(law.at("J_B_pinv")), J_pinv, "J_B_pinv");
  expect_near(ToMatrix(law.at("N")), N, "N");

  const Json& given = state_.at("law");
  const VectorXd X_o = ToMatrix(state_.at("object").at("X_o")),
                 X_o_dot = ToMatrix(state_.at("object").at("X_o_dot"));
  const VectorXd V_o = P_inv * X_o_dot, xi = ToMatrix(state_.at("xi"));
  // (55): X_o_ddot = X_d_ddot + K_v E_dot + K_p E
  const VectorXd X_o_ddot = ToMatrix(given.at("X_d_ddot")) +
                            ToMatrix(given.at("K_v")).cwiseProduct(ToMatrix(given.at("X_d_dot")) - X_o_dot) +
                            ToMatrix(given.at("K_p")).cwiseProduct(ToMatrix(given.at("X_d")) - X_o);
  const VectorXd V_o_dot = P_inv * X_o_ddot + ToMatrix(terms.at("P_inv_dot")) * X_o_dot;
  expect_near(ToMatrix(law.at("V_o_dot")), V_o_dot, "V_o_dot");
  const VectorXd xi_c = J_pinv * G.transpose() * V_o + N * xi;
  expect_near(ToMatrix(law.at("xi_c")), xi_c, "xi_c");
  const VectorXd xi_dot_d = J_pinv * (ToMatrix(terms.at("G_dot")).transpose() * V_o +
                                      G.transpose() * V_o_dot - ToMatrix(terms.at("J_B_dot")) * xi_c) +
                            N * ToMatrix(given.at("sigma_prime"));
  expect_near(ToMatrix(law.at("xi_dot_d")), xi_dot_d, "xi_dot_d");
  // (19), in X_o
  const VectorXd F_o = M_o * X_o_ddot + ToMatrix(terms.at("C_o")) * X_o_dot + ToMatrix(terms.at("N_o"));
  expect_near(ToMatrix(law.at("F_o")), F_o, "F_o");
  const VectorXd f_c = ToMatrix(law.at("f_c")), F_N = ToMatrix(law.at("F_N"));
  expect_near(G * f_c, F_o, "G f_c");
  EXPECT_LE((G * F_N).norm(), 1e-9 * f_c.norm());
  EXPECT_GT(F_N.norm(), 1.0);
  for (Eigen::Index i = 0; i < f_c.size(); i += 3)
    EXPECT_LT(std::hypot(f_c[i], f_c[i + 1]), 0.8 * f_c[i + 2]) << i;
  VectorXd force = M_bar * xi_dot_d + ToMatrix(terms.at("C_bar")) * xi_c + ToMatrix(terms.at("F_bar")) +
                   J.transpose() * f_c;
  const MatrixXd S_v_T_E_v = ToMatrix(terms.at("S_v_T_E_v"));
  const VectorXd wheels = S_v_T_E_v.inverse() * force.head<2>();
  force.head<2>() = wheels;
  expect_near(ToMatrix(law.at("tau")), force, "tau");
  const MatrixXd G_pinv = G.transpose() * CalcInverse(G * G.transpose());
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
}  // namespace dexcheck::testing::eval_command_test
