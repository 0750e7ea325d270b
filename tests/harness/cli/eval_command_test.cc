// dexcheck eval: state files, names and shapes of the terms, all digits of their values, and the engine's
// side.

#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>
#include <random>

#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "tests/common/matrix_near.h"
#include "tests/common/random_robot.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::eval_command_test {
namespace {

using Json = nlohmann::json;

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

class EvalCommand : public ::testing::Test {
 protected:
  /// Runs eval in the folder on this state and parses what it prints.
  Json Evaluate(const Json& state, const std::vector<std::string>& options = {}) {
    WriteText(folder_.path() / "state.json", state.dump());
    std::vector<std::string> arguments = {"eval", "--state", "state.json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const ProgramResult result = RunDexcheck(arguments, {folder_.path()});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    return Json::parse(result.out);
  }

  TempFolder folder_;
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
  const RobotModel model = ReadRobotModel(testing::kParameters + "assistant_robot.toml");
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
  const RobotModel model = ReadRobotModel(testing::kParameters + "panda.toml");
  const Json terms = Evaluate(MakeState(model, false), {"--robot", testing::kParameters + "panda.toml"});
  ExpectShapes(terms,
               {{"q", 7, 1}, {"xi", 7, 1}, {"M_bar", 7, 7}, {"C_bar", 7, 7}, {"bias", 7, 1}, {"M", 7, 7}});
  ExpectShapes(terms.at("frames").at("panda_flange"), {{"pose", 4, 4}, {"J_f", 6, 7}});
  EXPECT_TRUE(terms.at("fingertip_pose").empty());
  for (const char* name : {"S_v", "M_o", "P"}) EXPECT_FALSE(terms.contains(name)) << name;
}

TEST_F(EvalCommand, ValuesKeepAllTheirDigits) {
  const RobotModel model = ReadRobotModel(testing::kParameters + "assistant_robot.toml");
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
  const RobotModel model = ReadRobotModel(testing::kParameters + "panda.toml");
  const std::vector<std::string> robot = {"--robot", testing::kParameters + "panda.toml"};
  const Json printed = Evaluate(MakeState(model, false), robot);
  const ProgramResult result = RunDexcheck(
      {"eval", "--state", "state.json", robot[0], robot[1], "--out", "out.json"}, {folder_.path()});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out + result.err, "");
  EXPECT_EQ(Json::parse(ReadText(folder_.path() / "out.json")), printed);
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
  const std::string robot = testing::kParameters + GetParam().first;
  const Json terms = Evaluate(MakeState(ReadRobotModel(robot), false),
                              {"--robot", robot, "--mjcf", testing::kMjcf + GetParam().second});
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
  const std::string panda = ReadText(testing::kParameters + "panda.toml");
  WriteText(folder_.path() / "bad.toml", ReplaceOnce(panda, "mass = 3.228604", "mass = 3.3"));
  const Json state = MakeState(ReadRobotModel(testing::kParameters + "panda.toml"), false);
  const std::string mjcf = testing::kMjcf + "panda.xml";
  const Json good = Evaluate(state, {"--robot", testing::kParameters + "panda.toml", "--mjcf", mjcf});
  const Json bad = Evaluate(state, {"--robot", "bad.toml", "--mjcf", mjcf});
  EXPECT_EQ(bad.at("engine"), good.at("engine"));
  EXPECT_GT(CompareTerm(bad, bad.at("engine"), "M_bar"), 1e-4);
  EXPECT_GT(CompareTerm(bad, bad.at("engine"), "gravity"), 1e-4);
  EXPECT_LT(CompareTerm(bad, bad.at("engine"), "friction"), kRounding);
}

struct BadState {
  const char* name;
  std::string text;
  std::vector<std::string> parts;
};
void PrintTo(const BadState& bad, std::ostream* stream) { *stream << bad.name; }

class BadStates : public ::testing::TestWithParam<BadState> {};

TEST_P(BadStates, AreRefusedInOneLine) {
  const TempFolder folder;
  WriteText(folder.path() / "robot.toml",
            testing::kTwoLinksToml +
                "[object]\nbody = \"ball\"\nshape = \"sphere\"\nradius = 0.1\nmass = 0.2\nfriction = 0.5\n");
  WriteText(folder.path() / "state.json", GetParam().text);
  WriteText(folder.path() / "out.json", "before");
  const ProgramResult result = RunDexcheck(
      {"eval", "--robot", "robot.toml", "--state", "state.json", "--out", "out.json"}, {folder.path()});
  std::vector<std::string> parts = GetParam().parts;
  parts.emplace_back("state.json: ");
  EXPECT_TRUE(IsRefused(result, parts));
  EXPECT_EQ(ReadText(folder.path() / "out.json"), "before");
}

const std::string kGoodStart = R"({"q": [0, 1], "xi": [0, 1], )";

INSTANTIATE_TEST_SUITE_P(
    States, BadStates,
    ::testing::ValuesIn(std::vector<BadState>{
        {"TooShort", R"({"q": [0], "xi": [0, 1]})", {"q: must be a list of 2 numbers, got 1"}},
        {"TooLong", R"({"q": [0, 1], "xi": [0, 1, 2]})", {"xi: must be a list of 2 numbers, got 3"}},
        {"TextForNumber", R"({"q": [0, "one"], "xi": [0, 1]})", {"q[1]: must be a number, got \"one\""}},
        {"TextForList", R"({"q": "0 1", "xi": [0, 1]})", {"q: must be a list of 2 numbers, got \"0 1\""}},
        {"Null", R"({"q": [0, null], "xi": [0, 1]})", {"q[1]: must be a number, got null"}},
        {"NotANumber",
         R"({"q": [0, NaN], "xi": [0, 1]})",
         {"not valid JSON: ", "line 1, column 11", "last read: '0, N'"}},
        {"Infinite",
         R"({"q": [0, 1e999], "xi": [0, 1]})",
         {"not valid JSON: number overflow parsing '1e999'"}},
        {"MissingKey", R"({"q": [0, 1]})", {"xi: missing key"}},
        {"UnknownKey",
         kGoodStart + R"("qdot": [0, 1]})",
         {"qdot: unknown key, known here are q, xi, object, kappa, contact_points, fingers, mu, law"}},
        {"NotAnObject", "[0, 1]", {"must be a JSON object, got [0,1]"}},
        {"NotJson", "q = [0, 1]\n", {"not valid JSON: ", "line 1, column 1"}},
        {"Empty", "", {"not valid JSON: ", "unexpected end of input"}},
        {"Binary", std::string("\0\xff\n\n", 4), {"not valid JSON: "}},
        {"NestedDeeply",
         std::string(500000, '[') + std::string(500000, ']'),
         {"nested too deeply, more than 32 brackets"}},
        {"LongValue",
         R"({"q": ")" + std::string(5000, 'x') + R"(", "xi": [0, 1]})",
         {"q: must be a list", "xxx..."}},
        {"ObjectIsList", kGoodStart + R"("object": []})", {"object: must be a JSON object, got []"}},
        {"ObjectMissingKey",
         kGoodStart + R"("object": {"X_o": [0, 0, 0, 0, 1, 0]}})",
         {"object.X_o_dot: missing key"}},
        {"ObjectUnknownKey",
         kGoodStart + R"("object": {"X_0": []}})",
         {"object.X_0: unknown key, known here are X_o, X_o_dot"}},
        {"Singular",
         kGoodStart + R"("object": {"X_o": [0, 0, 0, 0, 0, 0], "X_o_dot": [0, 0, 0, 0, 0, 0]}})",
         {"object.X_o: ", "singular", "beta = 0 rad"}},
        {"KappaWithoutFingertips",
         kGoodStart + R"("kappa": [[0, 0, 0, 0, 0]]})",
         {"has 0 fingertips, needed are 3"}},
    }),
    [](const auto& info) { return info.param.name; });

TEST_F(EvalCommand, RefusesAnObjectThatTheRobotDoesNotKnow) {
  const RobotModel model = ReadRobotModel(testing::kParameters + "panda.toml");
  WriteText(folder_.path() / "state.json", MakeState(model, true).dump());
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"eval", "--state", "state.json", "--robot", testing::kParameters + "panda.toml"},
                            {folder_.path()}),
                {"state.json: object: ", "panda.toml has no [object]"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"eval", "--state", "no.json"}, {folder_.path()}),
                        {"no.json: cannot be read: No such file or directory"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"eval", "--state", "."}, {folder_.path()}),
                        {".: cannot be read: is a directory"}));
}

// A ball joint has four positions and three velocities; model and engine have the same terms there.
TEST_F(EvalCommand, BallJointsHaveQuaternions) {
  WriteText(folder_.path() / "arm.xml",
            R"(<mujoco model="arm"><compiler angle="radian"/><worldbody><body name="stand">
<body name="upper" pos="0 0 1"><joint name="shoulder" type="ball" damping="0.2" armature="0.01" limited="true" range="0 1.5"/>
<inertial pos="0.1 0.02 0" mass="2" diaginertia="0.01 0.02 0.025"/>
<body name="lower" pos="0.3 0 0"><joint name="elbow" axis="0 1 0"/>
<inertial pos="0.1 0 0.01" mass="1" diaginertia="0.004 0.006 0.008"/></body></body></body></worldbody></mujoco>)");
  ASSERT_EQ(RunDexcheck({"import", "arm.xml", "--out", "arm.toml"}, {folder_.path()}).exit_code, 0);
  const std::vector<std::string> files = {"--robot", "arm.toml", "--mjcf", "arm.xml"};
  const Json terms = Evaluate({{"q", {0.8, 0.3, -0.4, 0.2, 0.7}}, {"xi", {1.0, -2.0, 0.5, 1.5}}}, files);
  const Json& engine = terms.at("engine");
  constexpr double kRounding = 1e-14;  // of 2 kg over 1 m
  EXPECT_TRUE(MatrixNear(ToMatrix(terms.at("M_bar")), ToMatrix(engine.at("M_bar")), kRounding));
  for (const char* force : {"C_bar_xi", "gravity", "friction", "bias"}) {
    const MatrixXd values = ToMatrix(terms.at(force));
    EXPECT_GT(values.topRows(3).cwiseAbs().maxCoeff(), 0.01) << force;
    EXPECT_TRUE(MatrixNear(values, ToMatrix(engine.at(force)), 100.0 * kRounding)) << force;
  }
  const auto refuse = [&](const Json& state, const std::vector<std::string>& parts) {
    WriteText(folder_.path() / "state.json", state.dump());
    std::vector<std::string> arguments = {"eval", "--state", "state.json"};
    arguments.insert(arguments.end(), files.begin(), files.end());
    EXPECT_TRUE(IsRefused(RunDexcheck(arguments, {folder_.path()}), parts));
  };
  refuse({{"q", {0.1, 0.2}}, {"xi", {1.0, -2.0, 0.5, 1.5}}},
         {"state.json: q: must be a list of 5 numbers", "ball joint, \"shoulder\", has four", "got 2"});
  refuse({{"q", {0, 0, 0, 0, 0.7}}, {"xi", {1.0, -2.0, 0.5, 1.5}}},
         {"state.json: q[0..3]: must be a quaternion", "joint \"shoulder\""});
}

}  // namespace
}  // namespace dexcheck::testing::eval_command_test
