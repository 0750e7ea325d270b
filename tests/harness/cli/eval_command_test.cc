// dexcheck eval: state files, names and shapes of the terms, all digits of their values, and the engine's
// side.

#include <random>

#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "tests/common/matrix_near.h"
#include "tests/common/random_robot.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::eval_command_test {
namespace {

std::vector<double> ToList(const VectorXd& vector) { return {vector.begin(), vector.end()}; }

/// A state of the shipped robot or of another one, with an object where asked for.
Json MakeState(const RobotModel& model, bool with_object) {
  std::mt19937 random(4711);
  Json state = {{"q", ToList(testing::DrawPositions(model, &random))},
                {"xi", ToList(testing::DrawVelocities(model.num_velocities(), &random))}};
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
  /// What eval says of this state.
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

}  // namespace
}  // namespace dexcheck::testing::eval_command_test
