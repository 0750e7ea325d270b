// Controllers that the user brings along in every command that makes runs, and their own parameters.

#include <cstdlib>

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::own_controller_commands_test {
namespace {

const std::string kNumPyLaw = SourcePath("/harness/examples/numpy_joint_law.py");

/// A scenario of an arm with the controller in it, in a folder of its own.
class OwnControllerCommands : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    ::setenv("DEXCHECK_PYTHON", "/usr/bin/python3", /*replace=*/1);
    WriteScenario("own.toml", JOINT_LAW, "");
  }

  void WriteScenario(const std::string& file, const std::string& run, const std::string& parameters) const {
    const std::string source = SourcePath("");
    WriteText(Path(file),
              "name = \"own\"\nduration = 0.5\nsettle = 0.1\nstart = \"rest\"\n[model]\nfile = \"" + source +
                  "/controller/parameters/panda.toml\"\n[plant]\nmjcf = \"" + source +
                  "/mjcf/panda_scene.xml\"\n" + kRest + "[controller]\nrun = '" + run + "'\n" + parameters);
  }

  [[nodiscard]] double RunError(const Words& more) const {
    return RunJson(0, Words("run own.toml --no-log") + more)["tracking"]["joint_error_max_rad"].get<double>();
  }

  static constexpr const char* kRest = R"(
[joint_motion]
start_deg = { panda_joint2 = -45, panda_joint4 = -135, panda_joint6 = 90 }
oscillations = [{ joint = "panda_joint1", amplitude_deg = 2, frequency = 1, ramp_time = 0.3 }]
[control]
law = "computed_torque"
natural_frequency = 20
damping_ratio = 1
[sensing]
joint_counts = 4096
[actuation]
delay = 0.001
[expect]
joints = 0.1
)";
};

/// The controller of a scenario is that of each command, without an option.
TEST_F(OwnControllerCommands, AScenarioNamesItAndALogKnowsIt) {
  const Json checks = RunJson(0, "run own.toml --no-report --out run")["checks"];
  EXPECT_LE(checks["law_torque"]["max"], 1e-13);
  EXPECT_GT(checks["law_torque"]["max"], 0.0);
  EXPECT_THAT(Expect(0, Words("run --replay run --controller") + Words{JOINT_LAW}).out,
              HasSubstr("IDENTICAL"));
  // Another one in its place is another run; the same file under another name is not what the log names.
  std::filesystem::copy_file(JOINT_LAW, Path("copy.so"));
  EXPECT_THAT(Expect(0, "run --replay run --controller ./copy.so").out, HasSubstr("IDENTICAL"));
  Expect(1, Words("run --replay run --controller") + Words{JOINT_PD});
  // Two files that are the same differ in the name only; a changed one differs in the hash too.
  WriteScenario("copied.toml", "copy.so", "");
  Expect(0, "run copied.toml --no-report --out copied");
  const std::string same = Expect(0, "compare run copied").out;
  EXPECT_THAT(same, HasSubstr("copy.so"));
  EXPECT_THAT(same, Not(HasSubstr("controller_hash")));
  std::filesystem::copy_file(JOINT_PD, Path("copy.so"), std::filesystem::copy_options::overwrite_existing);
  const ProgramResult changed = Run("run --replay copied --controller ./copy.so");
  EXPECT_EQ(changed.exit_code, 1);
  EXPECT_THAT(changed.err, HasSubstr("is not the file that made the run"));
  std::filesystem::remove(Path("copy.so"));
  EXPECT_TRUE(IsRefused(Run("run --replay copied --controller ./copy.so"), {"copy.so"}));
  // A log starts nothing, whatever it names: a library, or a command of its scenario.
  EXPECT_TRUE(IsRefused(Run("run --replay copied"), {"copied/log.h5", "--controller", "copy.so"}));
  WriteScenario("command.toml", "touch started; false", "");
  static_cast<void>(Run("run command.toml --no-report --out command"));
  std::filesystem::remove(Path("started"));
  static_cast<void>(Run("run --replay command"));
  EXPECT_FALSE(Has("started"));
}

TEST_F(OwnControllerCommands, ComparedRunsSayWhichControllerTheyHad) {
  Expect(0, "run own.toml --no-report --out a");
  Expect(0, Words("run own.toml --no-report --out b --controller") + Words{kNumPyLaw});
  const std::string out = Expect(0, "compare a b").out;
  EXPECT_THAT(out, HasSubstr("  controller\n"));
  EXPECT_THAT(out, HasSubstr("joint_law.so"));
  EXPECT_THAT(out, HasSubstr("numpy_joint_law.py"));
}

/// In a budget and a campaign the law rewritten outside is the law.
class OwnLawEverywhere : public OwnControllerCommands, public ::testing::WithParamInterface<std::string> {
 protected:
  [[nodiscard]] Words Own() const { return {"--controller", GetParam()}; }
};

TEST_P(OwnLawEverywhere, HasABudget) {
  WriteScenario("built-in.toml", "", "");
  const Json own = RunJson(0, Words("budget own.toml --jobs 2") + Own());
  const Json right = RunJson(0, "budget built-in.toml --unset controller --jobs 2");
  ASSERT_EQ(own["sources"].size(), 2U);
  EXPECT_GT(own["all"]["rms"], 0.0);
  for (const char* error : {"ideal", "all", "sum", "predicted"})
    EXPECT_NEAR(own[error]["rms"], right[error]["rms"], 1e-6 * right[error]["rms"].get<double>()) << error;
  // The torques of a law without a name are not predicted.
  const Json unnamed = RunJson(0, Words("budget own.toml --jobs 2 --unset control.law") + Own());
  EXPECT_TRUE(unnamed["predicted"]["rms"].is_null());
  EXPECT_NEAR(unnamed["all"]["rms"], own["all"]["rms"], 1e-12);
  EXPECT_THAT(Expect(0, Words("budget own.toml --jobs 2 --unset control.law") + Own()).out,
              HasSubstr("  - "));
}

TEST_P(OwnLawEverywhere, IsWhereFaultsAreMade) {
  const Words mutate =
      "mutate own.toml --duration 0.2 --numbers 2 --jobs 2 --unset sensing --unset actuation";
  const Json own = RunJson(0, mutate + Own());
  EXPECT_GT(own["faults"].size(), 2U);
  const Json unnamed = RunJson(0, mutate + Words("--unset control.law --kinds motor --draws 2") + Own());
  EXPECT_EQ(unnamed["faults"].size(), 2U);
  EXPECT_TRUE(IsRefused(Run(mutate + Words("--unset control.law --kinds law --draws 2") + Own()),
                        {"--kinds", "law"}));
}

INSTANTIATE_TEST_SUITE_P(OwnControllerCommands, OwnLawEverywhere, ::testing::Values(JOINT_LAW, kNumPyLaw),
                         [](const auto& info) { return info.index == 0 ? "Library" : "NumPy"; });

// In a study what a controller does wrong costs its trial, and no other; its process is of no use any more.
TEST_F(OwnControllerCommands, AFailureCostsItsTrial) {
  WriteText(Path("law.py"),
            "import dexcheck\nclass Law(dexcheck.Controller):\n  parameters = {'danger': 0.0}\n"
            "  def step(self, s):\n    if self.danger and s.t > 0.01: raise ValueError('ouch')\n"
            "    return s.gravity\n");
  WriteText(Path("study.toml"),
            "name = \"study\"\nscenario = \"own.toml\"\ncontroller = \"law.py\"\n[[vary]]\nkey = "
            "\"controller.danger\"\nvalues = [0, 1, 0]\n");
  Expect(0, "study run study.toml --db study.sqlite --quiet --jobs 1");
  for (const char* trial : {"0", "2"})
    EXPECT_EQ(RunJson(0, Words("study show study.sqlite") + Words{trial})["failure"], "") << trial;
  const Json failed = RunJson(0, "study show study.sqlite 1");
  EXPECT_EQ(failed["outcome"], "crashed");
  EXPECT_THAT(failed["failure"].get<std::string>(),
              HasSubstr("controller law.py: ValueError: ouch (law.py:5)"));
  EXPECT_THAT(Expect(0, "study slurm study.toml --tasks 2 --controller law.py").out,
              HasSubstr("--controller " + Path("law.py").string()));
}

/// A library in C++, one in C and a Python file, each with a parameter of its own.
struct OwnParameter {
  const char* name;
  std::string controller, parameter;
  double soft, stiff;

  friend void PrintTo(const OwnParameter& one, std::ostream* out) { *out << one.name; }
};

class OwnParameters : public OwnControllerCommands, public ::testing::WithParamInterface<OwnParameter> {
 protected:
  [[nodiscard]] Words With(double value) const {
    return Words{"--controller", GetParam().controller,
                 "--set",        GetParam().parameter + "=" + std::to_string(value),
                 "--unset",      "control.law",
                 "--unset",      "sensing",
                 "--unset",      "actuation"};
  }
};

TEST_P(OwnParameters, ReachTheController) {
  const double soft = RunError(With(GetParam().soft));
  const double stiff = RunError(With(GetParam().stiff));
  EXPECT_GT(soft, 2.0 * stiff);
  EXPECT_GT(stiff, 0.0);
}

TEST_P(OwnParameters, OfAnUnknownNameAreRefused) {
  EXPECT_TRUE(IsRefused(Run(Words("run own.toml --no-log --set controller.stifness=3 --controller") +
                            Words{GetParam().controller}),
                        {"controller.stifness", GetParam().parameter.substr(sizeof("controller.") - 1)}));
}

TEST_P(OwnParameters, AreKeysOfAStudy) {
  WriteText(
      Path("gains.toml"),
      "name = \"gains\"\nscenario = \"own.toml\"\nset = [\"sensing-=\", \"actuation-=\"]\ncontroller = '" +
          GetParam().controller + "'\nobjective = [{ minimize = \"joint_error_rms\" }]\n[[vary]]\nkey = \"" +
          GetParam().parameter + "\"\nvalues = [" + std::to_string(GetParam().soft) + ", " +
          std::to_string(GetParam().stiff) + "]\n");
  Expect(0, "study run gains.toml --db gains.sqlite --quiet --jobs 2");
  const Json first = RunJson(0, "study show gains.sqlite 0"), last = RunJson(0, "study show gains.sqlite 1");
  const double soft = first["metrics"]["joint_error_rms"], stiff = last["metrics"]["joint_error_rms"];
  EXPECT_GT(soft, 2.0 * stiff);
  EXPECT_GT(stiff, 0.0);
  EXPECT_THAT(first["command"].get<std::string>(), HasSubstr("--controller"));
  Expect(0, "study report gains.sqlite --page gains.html");
  // The rows belong to this controller: to its name, and to its file.
  const std::filesystem::path own = GetParam().controller;
  const std::string copy = "copy" + own.extension().string();
  std::filesystem::copy_file(own, Path(copy));
  const Words other = Words("study run gains.toml --db gains.sqlite --controller") + Words{copy};
  EXPECT_TRUE(IsRefused(Run(other), {"gains.sqlite", "controller"}));
  Expect(0, "study run gains.toml --db gains.sqlite --quiet");
}

INSTANTIATE_TEST_SUITE_P(
    OwnControllerCommands, OwnParameters,
    ::testing::Values(OwnParameter{"Cpp", JOINT_LAW, "controller.natural_frequency", 5, 40},
                      OwnParameter{"C", JOINT_PD, "controller.stiffness", 400, 4000},
                      OwnParameter{"Python", kNumPyLaw, "controller.natural_frequency", 5, 40}),
    [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace dexcheck::testing::own_controller_commands_test
