// A program, or arrays that it wrote, as one side of consistency; eval --states; dexcheck audit.

#include "tests/common/legged_robots.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::results_command_test {
namespace {

const std::string kExamples = SourcePath("/harness/descriptions/examples/");
const std::string kPython = DEXCHECK_PYTHON;

class Results : public CommandTest {
 protected:
  /// All terms that the results have agree, each in so many numbers at least.
  static void ExpectAgreement(const Json& results, long numbers) {
    EXPECT_EQ(results.at("verdict"), "pass");
    for (const char* term : {"M_bar", "C_bar_xi", "gravity", "bias"}) {
      EXPECT_EQ(results.at("checks").at(term).at("pass"), true) << term;
      EXPECT_GE(results.at("checks").at(term).at("compared"), numbers) << term;
    }
  }
  [[nodiscard]] Words WithProgram(const std::string& program) const {
    return {"consistency", urdf_, "--program", kPython + " " + program};
  }

  std::string urdf_ = kExamples + "arm.urdf";
};

TEST_F(Results, OfAnArmInNumPyAgree) {
  ExpectAgreement(RunJson(0, WithProgram(kExamples + "arm.py") + "--samples 100"), 300);
}

TEST_F(Results, FaultsOfTheProgramAreFound) {
  const std::string program = ReadText(kExamples + "arm.py");
  const auto expect = [&](const Edit& edit, const std::string& found, const std::string& right) {
    WriteChanged("wrong.py", program, edit.from, edit.to);
    const Json checks = RunJson(1, WithProgram("wrong.py") + "--samples 20").at("checks");
    EXPECT_EQ(checks.at(found).at("pass"), false);
    EXPECT_EQ(checks.at(right).at("pass"), true);
  };
  expect({"np.cross(omega, I @ omega))", "0 * omega)"}, "C_bar_xi", "M_bar");
  expect({"-9.81", "9.81"}, "gravity", "C_bar_xi");
  expect({"R @ inertia @ R.T", "inertia"}, "M_bar", "gravity");
}

TEST_F(Results, OfFilesAgree) {
  Expect(0, {"eval", "--robot", urdf_, "--states", "50", "--out", "states"});
  EXPECT_EQ(ReadJson("states/layout.json").at("joints"), Json({"yaw", "shoulder", "elbow"}));
  const std::string lines = Read("states/states.jsonl");
  EXPECT_EQ(std::ranges::count(lines, '\n'), 50);
  EXPECT_EQ(Json::parse(lines.substr(0, lines.find('\n'))).at("v").size(), 3U);

  const Words command = {"consistency", urdf_, "--results", "states"};
  EXPECT_THAT(Run(command).err, HasSubstr("M.npy"));
  ASSERT_EQ(RunProgram({kPython, kExamples + "arm.py", "states"}, {folder_.path()}).exit_code, 0);
  const Json results = RunJson(0, command);
  EXPECT_EQ(results.at("samples"), 50);
  ExpectAgreement(results, 150);

  const std::string M = Read("states/M.npy");
  Write("states/M.npy", M.substr(0, M.size() - 8));
  EXPECT_TRUE(Refused(command, {"states/M.npy", "450", "3592 bytes"}));
  WriteChanged("states/M.npy", M, "'<f8'", "'<f4'");
  EXPECT_TRUE(Refused(command, {"states/M.npy", "'<f8'", "'<f4'"}));
  Write("states/M.npy", Read("states/c.npy"));
  EXPECT_TRUE(Refused(command, {"states/M.npy", "50 x 3 x 3", "50 x 3"}));
}

/// Results as lines of JSON in any order agree; an archive is refused with a remedy.
TEST_F(Results, OfLinesAgreeAndOfAnArchiveAreRefused) {
  Expect(0, {"eval", "--robot", urdf_, "--states", "20", "--out", "states"});
  ASSERT_EQ(RunProgram({kPython, kExamples + "arm.py", "states"}, {folder_.path()}).exit_code, 0);
  const std::string script = R"(
import json, os, numpy as np
os.chdir("states")
terms = {name: np.load(name + ".npy") for name in ("M", "c", "g")}
for name in terms: os.remove(name + ".npy")
with open("results.jsonl", "w") as file:
  for i in reversed(range(20)):
    file.write(json.dumps({"id": i, **{name: term[i].tolist() for name, term in terms.items()}}) + "\n")
)";
  ASSERT_EQ(RunProgram({kPython, "-c", script}, {folder_.path()}).exit_code, 0);
  const Words command = {"consistency", urdf_, "--results", "states"};
  ExpectAgreement(RunJson(0, command), 60);
  const std::string lines = Read("states/results.jsonl");
  Write("states/results.jsonl", lines.substr(0, lines.size() / 2));
  EXPECT_TRUE(Refused(command, {"results.jsonl"}));
  std::filesystem::remove(Path("states/results.jsonl"));
  EXPECT_TRUE(Refused(command, {"must have results"}));
}

TEST_F(Results, AuditExitsByWhatItFinds) {
  EXPECT_EQ(RunJson(0, {"audit", urdf_}).at("verdict"), "pass");
  EXPECT_EQ(RunJson(0, {"audit", kPandaToml}).at("verdict"), "pass");
  WriteChanged("odd.urdf", ReadText(urdf_), "izz=\"0.008\"", "izz=\"0.8\"");
  const Json odd = RunJson(1, "audit odd.urdf");
  EXPECT_EQ(odd.at("verdict"), "disagreement");
  ASSERT_EQ(odd.at("findings").size(), 1U);
  EXPECT_EQ(odd.at("findings").at(0).at("level"), "impossible");
  EXPECT_EQ(odd.at("findings").at(0).at("where"), "link column");
  EXPECT_EQ(odd.at("findings").at(0).at("line"), 5);
  EXPECT_LT(odd.at("findings").at(0).at("condition_number_without"), odd.at("condition_number"));
  // The published inertia of this link was identified, and is that of something much longer than the link.
  const Json findings = RunJson(1, {"audit", kPandaXml}).at("findings");
  EXPECT_TRUE(std::ranges::any_of(findings, [](const Json& finding) {
    return finding.at("level") == "suspicious" && finding.at("where") == "link panda_link1";
  })) << findings;
}

TEST_F(Results, FloatingBasesSayTheirConvention) {
  const std::vector<LeggedLink> links = ListQuadruped();
  Write("robot.urdf", WriteLeggedUrdf("quadruped", links));
  Write("robot.xml", WriteLeggedMjcf("quadruped", links));
  Expect(0, "consistency robot.urdf robot.xml --samples 20");
  Expect(0, "import robot.xml --out robot.toml");
  // Another program's coordinates may be different here.
  Expect(0, "eval robot.toml --states 1 --out states");
  Write("states/results.jsonl", Json{{"id", 0}, {"g", std::vector<double>(18, 1.0)}}.dump() + "\n");
  const Json notes = RunJson(1, "consistency robot.toml --results states").at("notes");
  EXPECT_THAT(notes, ::testing::IsSupersetOf({HasSubstr("[x y z, qw qx qy qz"), HasSubstr("Pinocchio")}));
  Expect(0, "consistency robot.toml robot.xml --samples 20 --tolerance 1e-12");
  // Turned about x by an angle with cosine 0.28 and sine 0.96.
  std::vector<double> q = {1.0, 2.0, 0.3, 0.8, 0.6, 0.0, 0.0};
  q.resize(19, 0.1);
  std::vector<double> xi = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  xi.resize(18, 0.2);
  Write("state.json", Json{{"q", q}, {"xi", xi}}.dump());
  const Json model = Json::parse(Expect(0, "eval robot.toml robot.xml --state state.json").out);
  const Json& pinocchio = model.at("pinocchio");
  EXPECT_EQ(pinocchio.at("q").get<std::vector<double>>()[3], 0.6);
  EXPECT_EQ(pinocchio.at("q").get<std::vector<double>>()[6], 0.8);
  const std::vector<double> v = pinocchio.at("v").get<std::vector<double>>();
  EXPECT_NEAR(v[1], 0.28 * 0.2 + 0.96 * 0.3, 1e-12);
  EXPECT_NEAR(v[2], -0.96 * 0.2 + 0.28 * 0.3, 1e-12);
  EXPECT_NE(pinocchio.at("nle").at(1), model.at("bias").at(1));

  Write("floating.toml",
        ReadText(SourcePath("/harness/shipped/scenarios/hold.toml")) + "\n[model]\nfile = \"robot.toml\"\n");
  EXPECT_TRUE(Refused("run floating.toml --out run", {"robot.toml", "base.type", "\"floating\""}));
}

// A body on a ball joint at the world's origin, as a program and as files: M = I - m c x c x, C w = w x M w
// and gravity -c x R^T m g along the body's axes.
TEST_F(Results, OfABallJointAgree) {
  Write("top.xml", R"(<mujoco model="top"><worldbody><body name="stand"><body name="top">
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
  with open(sys.argv[1] + "/states.jsonl") as states, open(sys.argv[1] + "/results.jsonl", "w") as answers:
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
  Write("top.py", program);
  const Words compare = {"consistency", "top.xml", "--program", kPython + " top.py", "--samples", "50"};
  ExpectAgreement(RunJson(0, compare), 150);

  Expect(0, "eval top.xml --states 20 --out states");
  EXPECT_EQ(ReadJson("states/layout.json").at("balls"), Json({"pivot"}));
  ASSERT_EQ(RunProgram({kPython, "top.py", "states"}, {folder_.path()}).exit_code, 0);
  Expect(0, "consistency top.xml --results states");

  // The angular velocity along the parent's axes is what others have.
  WriteChanged("top.py", program, "2*(x*z - w*y)", "2*(x*z + w*y)");
  Expect(1, compare);
  // Another number of entries is refused by name.
  WriteChanged("top.py", program, "cross(v, momentum)", "momentum + [0.0]");
  EXPECT_TRUE(Refused(compare, {"top.py", "c: ", "3", "got 4"}));
}

}  // namespace
}  // namespace dexcheck::testing::results_command_test
