// A program, or arrays that it wrote, as one side of consistency; dexcheck states; dexcheck audit.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/common/legged_robots.h"
#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::answers_command_test {
namespace {

using Json = nlohmann::json;

const std::string kExamples = testing::SourcePath("/harness/descriptions/examples/");
const std::string kPython = DEXCHECK_PYTHON;

class Answers : public ::testing::Test {
 protected:
  [[nodiscard]] ProgramResult Run(const std::vector<std::string>& arguments) const {
    return RunDexcheck(arguments, {folder_.path()});
  }

  TempFolder folder_;
  std::string urdf_ = kExamples + "arm.urdf";
};

TEST_F(Answers, OfAnArmInNumPyAgree) {
  const ProgramResult result = Run({"consistency", urdf_, "--program", kPython + " " + kExamples + "arm.py",
                                    "--samples", "100", "--json", "out.json"});
  EXPECT_EQ(result.exit_code, 0) << result.err << result.out;
  EXPECT_THAT(
      result.out,
      HasSubstr("AGREE: the description and the answers agree to rounding in all 4 terms; 1 not compared"));
  const Json checks = Json::parse(ReadText(folder_.path() / "out.json")).at("checks");
  for (const std::string term : {"M_bar", "C_bar_xi", "gravity", "bias"}) {
    EXPECT_EQ(checks.at(term).at("pass"), true) << term;
    EXPECT_GE(checks.at(term).at("compared"), 300) << term;
  }
}

TEST_F(Answers, FaultsOfTheProgramAreFound) {
  const std::string program = ReadText(kExamples + "arm.py");
  const auto expect = [&](const std::string& original, const std::string& changed, const std::string& found,
                          const std::string& right) {
    WriteText(folder_.path() / "wrong.py", ReplaceOnce(program, original, changed));
    const ProgramResult result =
        Run({"consistency", urdf_, "--program", kPython + " wrong.py", "--samples", "20"});
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_THAT(result.out, HasSubstr(" " + found + ": nearest the base: "));
    EXPECT_THAT(result.out, Not(HasSubstr(" " + right + ": nearest the base: ")));
  };
  expect("np.cross(omega, I @ omega))", "0 * omega)", "C_bar_xi", "M_bar");
  expect("-9.81", "9.81", "gravity", "C_bar_xi");
  expect("R @ inertia @ R.T", "inertia", "M_bar", "gravity");
}

TEST_F(Answers, OfFilesAgree) {
  const ProgramResult states = Run({"states", urdf_, "--count", "50", "--out", "states"});
  EXPECT_EQ(states.exit_code, 0) << states.err;
  const std::filesystem::path folder = folder_.path() / "states";
  const Json layout = Json::parse(ReadText(folder / "layout.json"));
  EXPECT_EQ(layout.at("joints"), Json({"yaw", "shoulder", "elbow"}));
  const std::string lines = ReadText(folder / "states.jsonl");
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 50);
  EXPECT_EQ(Json::parse(lines.substr(0, lines.find('\n'))).at("v").size(), 3U);

  EXPECT_THAT(Run({"consistency", urdf_, "--answers", "states"}).err, HasSubstr("must have answers: M.npy"));
  const ProgramResult python =
      testing::RunProgram({kPython, kExamples + "arm.py", "states"}, {folder_.path()});
  ASSERT_EQ(python.exit_code, 0) << python.err;
  const ProgramResult result = Run({"consistency", urdf_, "--answers", "states"});
  EXPECT_EQ(result.exit_code, 0) << result.err << result.out;
  EXPECT_THAT(result.out, HasSubstr("50 random states"));
  EXPECT_THAT(result.out, HasSubstr("agree to rounding in all 4 terms; 1 not compared"));

  const std::string M = ReadText(folder / "M.npy");
  WriteText(folder / "M.npy", M.substr(0, M.size() - 8));
  EXPECT_TRUE(testing::IsRefused(Run({"consistency", urdf_, "--answers", "states"}),
                                 {"states/M.npy: must have 450 numbers as its shape says, got 3592 bytes"}));
  WriteText(folder / "M.npy", ReplaceOnce(M, "'<f8'", "'<f4'"));
  EXPECT_TRUE(testing::IsRefused(Run({"consistency", urdf_, "--answers", "states"}),
                                 {"must have numbers of type float64 ('<f8'), got \"'<f4'\""}));
  WriteText(folder / "M.npy", ReadText(folder / "c.npy"));
  EXPECT_TRUE(testing::IsRefused(Run({"consistency", urdf_, "--answers", "states"}),
                                 {"states/M.npy: must be 50 x 3 x 3, got 50 x 3"}));
}

/// The same answers as lines of JSON in any order; an archive is refused with what to do.
TEST_F(Answers, OfLinesAgreeAndOfAnArchiveAreRefused) {
  ASSERT_EQ(Run({"states", urdf_, "--count", "20", "--out", "states"}).exit_code, 0);
  ASSERT_EQ(testing::RunProgram({kPython, kExamples + "arm.py", "states"}, {folder_.path()}).exit_code, 0);
  const std::string script = R"(
import json, os, numpy as np
os.chdir("states")
terms = {name: np.load(name + ".npy") for name in ("M", "c", "g")}
for name in terms: os.remove(name + ".npy")
with open("answers.jsonl", "w") as file:
  for i in reversed(range(20)):
    file.write(json.dumps({"id": i, **{name: term[i].tolist() for name, term in terms.items()}}) + "\n")
)";
  ASSERT_EQ(testing::RunProgram({kPython, "-c", script}, {folder_.path()}).exit_code, 0);
  const std::filesystem::path folder = folder_.path() / "states";
  const std::vector<std::string> command = {"consistency", urdf_, "--answers", "states"};
  const ProgramResult result = Run(command);
  EXPECT_EQ(result.exit_code, 0) << result.err << result.out;
  EXPECT_THAT(result.out, HasSubstr("agree to rounding in all 4 terms; 1 not compared"));
  const std::string lines = ReadText(folder / "answers.jsonl");
  WriteText(folder / "answers.jsonl", lines.substr(0, lines.size() / 2));
  EXPECT_TRUE(IsRefused(Run(command), {"answers.jsonl"}));
  std::filesystem::remove(folder / "answers.jsonl");
  EXPECT_TRUE(IsRefused(Run(command), {"must have answers"}));
}

/// A command that is no program of the protocol, and what is said of it.
struct BadProgram {
  std::string name;
  std::string command;
  int exit_code;
  std::string message;
};

class BadPrograms : public ::testing::TestWithParam<BadProgram> {};

TEST_P(BadPrograms, AreNamedInOneLine) {
  const ProgramResult result =
      RunDexcheck({"consistency", kExamples + "arm.urdf", "--program", GetParam().command, "--samples", "5",
                   "--time-limit", "2", "--quiet"});
  EXPECT_EQ(result.exit_code, GetParam().exit_code);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, ::testing::StartsWith("dexcheck: program \""));
  EXPECT_THAT(result.err, HasSubstr(GetParam().message));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

const std::string kHello = "read a; echo '{\"dexcheck_protocol\":1}'; read a; ";

INSTANTIATE_TEST_SUITE_P(
    Answers, BadPrograms,
    ::testing::Values(
        BadProgram{"Missing", "no_such_program_of_anybody", 2, "cannot be run, its last words"},
        BadProgram{"Dies", "echo oh no >&2; exit 3", 3,
                   "ended with exit code 3 before its first answer, its last words: \"oh no\""},
        BadProgram{"IsKilled", "kill -9 $$", 3, "was killed by signal 9"},
        BadProgram{"DiesLater", kHello + "exit 4", 3, "ended with exit code 4 after 1 answers"},
        BadProgram{"Hangs", "sleep 60", 3, "gave no answer within 2 s (--time-limit)"},
        BadProgram{"HangsLater", kHello + "sleep 60", 3, "gave no answer within 2 s"},
        BadProgram{"ClosesItsOutput", "exec >&-; sleep 60", 3, "closed its standard output"},
        BadProgram{"NeverEndsALine", "cat /dev/zero", 3, "answers without end"},
        BadProgram{"SaysNoJson", "yes", 2, "must answer with a JSON object on one line"},
        BadProgram{"OtherVersion", "read a; echo '{\"dexcheck_protocol\":2}'; read a", 2,
                   "dexcheck_protocol: must be 1, got 2"},
        BadProgram{"WrongJoint",
                   "read a; echo '{\"dexcheck_protocol\":1,\"joints\":[\"yaw\",\"elbo\"]}'; read a", 2,
                   "joints[1]: must be a joint of"},
        BadProgram{"JointLeftOut",
                   "read a; echo '{\"dexcheck_protocol\":1,\"joints\":[\"yaw\",\"elbow\"]}'; read a", 2,
                   "joints: must be all joints, or all that follow no other; missing: shoulder"},
        BadProgram{"JointTwice",
                   "read a; echo '{\"dexcheck_protocol\":1,\"joints\":[\"yaw\",\"elbow\",\"yaw\"]}'; read a",
                   2, "joints[2]: must be named once"},
        BadProgram{"BaseOfAFixedRobot", "read a; echo '{\"dexcheck_protocol\":1,\"base\":{}}'; read a", 2,
                   "base: must not be given, the base is fixed"},
        BadProgram{"LiesAboutSizes", kHello + "echo '{\"id\":0,\"M\":[[1,2],[3,4]]}'; read a", 2,
                   "state 0: M: must be a list of 3 rows, got 2"},
        BadProgram{"LiesAboutARow", kHello + "echo '{\"id\":0,\"M\":[[1,2,3],[3,4],[1,2,3]]}'; read a", 2,
                   "state 0: M[1]: must be a list of 3 numbers, got 2"},
        BadProgram{"SaysNaN", kHello + "echo '{\"id\":0,\"g\":[1,NaN,2]}'; read a", 2,
                   "NaN and Infinity are none"},
        BadProgram{"SaysText", kHello + "echo '{\"id\":0,\"g\":[1,\"2\",3]}'; read a", 2,
                   "state 0: g[1]: must be a number, got \"2\""},
        BadProgram{"SaysNothing", kHello + "echo '{\"id\":0}'; read a", 2, "must have M, C, c, g, h"},
        BadProgram{"AnswersAnother", kHello + "echo '{\"id\":7,\"g\":[1,2,3]}'; read a", 2,
                   "state 0: id: must be 0, got 7"},
        BadProgram{"HasAnError", kHello + "echo '{\"error\":\"out of range\"}'; read a", 3,
                   "says: out of range"}),
    [](const auto& named) { return named.param.name; });

TEST_F(Answers, AreAskedForInOneWay) {
  EXPECT_TRUE(testing::IsRefused(Run({"consistency", "--program", "true"}),
                                 {"one file must be given beside --program"}));
  EXPECT_TRUE(testing::IsRefused(Run({"consistency", urdf_, urdf_, "--program", "true"}), {"got two"}));
  EXPECT_EQ(Run({"consistency", urdf_, "--program", "true", "--answers", "x"}).exit_code, 2);
  EXPECT_EQ(Run({"consistency", urdf_, "--program", "true", "--time-limit", "0"}).exit_code, 2);
}

TEST_F(Answers, AuditExitsByWhatItFinds) {
  const ProgramResult good = Run({"audit", urdf_, "--json", "audit.json"});
  EXPECT_EQ(good.exit_code, 0) << good.out;
  EXPECT_THAT(good.out, HasSubstr("\nGOOD: "));
  EXPECT_EQ(Json::parse(ReadText(folder_.path() / "audit.json")).at("verdict"), "pass");
  WriteText(folder_.path() / "odd.urdf", ReplaceOnce(ReadText(urdf_), "izz=\"0.008\"", "izz=\"0.8\""));
  const ProgramResult odd = Run({"audit", "odd.urdf", "--json", "audit.json"});
  EXPECT_EQ(odd.exit_code, 1);
  EXPECT_THAT(odd.out, HasSubstr("impossible odd.urdf:5: link column has principal moments"));
  EXPECT_THAT(odd.out, HasSubstr("with a plausible body"));
  EXPECT_THAT(odd.out, HasSubstr("\nFOUND: 1 thing that a robot cannot have or that looks like a fault."));
  const Json json = Json::parse(ReadText(folder_.path() / "audit.json"));
  EXPECT_EQ(json.at("verdict"), "disagreement");
  EXPECT_EQ(json.at("findings").at(0).at("level"), "impossible");
  EXPECT_EQ(json.at("findings").at(0).at("line"), 5);
  EXPECT_EQ(Run({"audit", testing::kParameters + "panda.toml", "--quiet"}).exit_code, 0);
  // The published inertia of this link was identified, and is that of something much longer than the link.
  const ProgramResult panda = Run({"audit", testing::kMjcf + "panda.xml"});
  EXPECT_EQ(panda.exit_code, 1);
  EXPECT_THAT(panda.out, HasSubstr("suspicious panda.xml: link panda_link1 has a principal moment of 0.70"));
  WriteText(folder_.path() / "broken.urdf", "<robot name=\"x\"><link name=\"a\"></robot>");
  EXPECT_TRUE(testing::IsRefused(Run({"audit", "broken.urdf"}), {"broken.urdf:1: is not XML"}));
}

TEST_F(Answers, FloatingBasesSayTheirConvention) {
  const std::vector<testing::LeggedLink> links = testing::ListQuadruped();
  WriteText(folder_.path() / "robot.urdf", testing::WriteLeggedUrdf("quadruped", links));
  WriteText(folder_.path() / "robot.xml", testing::WriteLeggedMjcf("quadruped", links));
  const ProgramResult result = Run({"consistency", "robot.urdf", "robot.xml", "--samples", "20"});
  EXPECT_EQ(result.exit_code, 0) << result.err << result.out;
  EXPECT_THAT(result.out, HasSubstr("q = [x y z, qw qx qy qz, joints from q[7]]"));
  EXPECT_THAT(result.out, HasSubstr("in Pinocchio's convention"));
  ASSERT_EQ(Run({"import", "robot.xml", "--out", "robot.toml"}).exit_code, 0);
  const ProgramResult table =
      Run({"consistency", "robot.toml", "robot.xml", "--samples", "20", "--tolerance", "1e-12"});
  EXPECT_EQ(table.exit_code, 0) << table.err << table.out;
  // Turned about x by an angle with cosine 0.28 and sine 0.96.
  std::vector<double> q = {1.0, 2.0, 0.3, 0.8, 0.6, 0.0, 0.0};
  q.resize(19, 0.1);
  std::vector<double> xi = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  xi.resize(18, 0.2);
  WriteText(folder_.path() / "state.json", Json{{"q", q}, {"xi", xi}}.dump());
  const ProgramResult eval = Run({"eval", "--robot", "robot.toml", "--mjcf", "robot.xml", "--state",
                                  "state.json", "--out", "eval.json"});
  ASSERT_EQ(eval.exit_code, 0) << eval.err;
  const Json model = Json::parse(ReadText(folder_.path() / "eval.json"));
  const Json& pinocchio = model.at("pinocchio");
  EXPECT_EQ(pinocchio.at("q").get<std::vector<double>>()[3], 0.6);
  EXPECT_EQ(pinocchio.at("q").get<std::vector<double>>()[6], 0.8);
  const std::vector<double> v = pinocchio.at("v").get<std::vector<double>>();
  EXPECT_NEAR(v[1], 0.28 * 0.2 + 0.96 * 0.3, 1e-12);
  EXPECT_NEAR(v[2], -0.96 * 0.2 + 0.28 * 0.3, 1e-12);
  EXPECT_NE(pinocchio.at("nle").at(1), model.at("bias").at(1));

  WriteText(folder_.path() / "floating.toml",
            ReadText(testing::SourcePath("/harness/shipped/scenarios/hold.toml")) + "\n[model]\nfile = \"" +
                (folder_.path() / "robot.toml").string() + "\"\n");
  const ProgramResult run = Run({"run", "floating.toml", "--out", "run"});
  EXPECT_TRUE(testing::IsRefused(run, {"robot.toml: base.type: must not be \"floating\" in a run"}));
}

// A body on a ball joint at the world's origin, as a program and as files: M = I - m c x c x, C w = w x M w
// and gravity -c x R^T m g along the body's axes.
TEST_F(Answers, OfABallJointAgree) {
  WriteText(folder_.path() / "top.xml", R"(<mujoco model="top"><worldbody><body name="stand"><body name="top">
<joint name="pivot" type="ball"/><inertial pos="0.1 0.2 0.3" mass="2" diaginertia="0.04 0.05 0.06"/>
</body></body></worldbody></mujoco>)");
  const std::string program = R"(import json, sys
m, c, I, g = 2.0, [0.1, 0.2, 0.3], [0.04, 0.05, 0.06], [0.0, 0.0, -9.81]
cross = lambda a, b: [a[1]*b[2] - a[2]*b[1], a[2]*b[0] - a[0]*b[2], a[0]*b[1] - a[1]*b[0]]
M = [[m*(sum(x*x for x in c)*(i == j) - c[i]*c[j]) + (I[i] if i == j else 0.0) for j in range(3)] for i in range(3)]
def answer(q, v):
  w, x, y, z = q
  down = [2*(x*z - w*y)*m*g[2], 2*(y*z + w*x)*m*g[2], (w*w - x*x - y*y + z*z)*m*g[2]]  # R^T m g
  momentum = [sum(M[i][j]*v[j] for j in range(3)) for i in range(3)]
  return {"M": M, "c": cross(v, momentum), "g": [-f for f in cross(c, down)]}
if len(sys.argv) > 1:
  with open(sys.argv[1] + "/states.jsonl") as states, open(sys.argv[1] + "/answers.jsonl", "w") as answers:
    for line in states:
      state = json.loads(line)
      answers.write(json.dumps({"id": state["id"], **answer(state["q"], state["v"])}) + "\n")
  sys.exit()
for line in sys.stdin:
  r = json.loads(line)
  if r["request"] == "hello":
    assert r["layout"] == {"joints": ["pivot"], "balls": ["pivot"]} and r["robot"]["joints"][0]["type"] == "ball"
    print(json.dumps({"dexcheck_protocol": 1, "name": "top"}), flush=True)
  else:
    print(json.dumps({"id": r["id"], **answer(r["q"], r["v"])}), flush=True)
)";
  WriteText(folder_.path() / "top.py", program);
  const std::vector<std::string> compare = {"consistency",       "top.xml",   "--program",
                                            kPython + " top.py", "--samples", "50"};
  const ProgramResult asked = Run(compare);
  EXPECT_EQ(asked.exit_code, 0) << asked.err << asked.out;
  EXPECT_THAT(asked.out, HasSubstr("agree to rounding in all 4 terms; 1 not compared"));
  EXPECT_THAT(asked.out, HasSubstr("\"pivot\" has q[0..3] and xi[0..2]"));

  ASSERT_EQ(Run({"states", "top.xml", "--count", "20", "--out", "states"}).exit_code, 0);
  const Json layout = Json::parse(ReadText(folder_.path() / "states/layout.json"));
  EXPECT_EQ(layout.at("balls"), Json({"pivot"}));
  ASSERT_EQ(testing::RunProgram({kPython, "top.py", "states"}, {folder_.path()}).exit_code, 0);
  const ProgramResult written = Run({"consistency", "top.xml", "--answers", "states"});
  EXPECT_EQ(written.exit_code, 0) << written.err << written.out;

  // The angular velocity along the parent's axes is what others have.
  WriteText(folder_.path() / "top.py", ReplaceOnce(program, "2*(x*z - w*y)", "2*(x*z + w*y)"));
  EXPECT_EQ(Run(compare).exit_code, 1);
  // Another number of entries is refused by name.
  WriteText(folder_.path() / "top.py", ReplaceOnce(program, "cross(v, momentum)", "momentum + [0.0]"));
  EXPECT_TRUE(IsRefused(Run(compare), {"c: must be a list of 3 numbers, got 4"}));
}

}  // namespace
}  // namespace dexcheck::testing::answers_command_test
