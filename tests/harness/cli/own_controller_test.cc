// Controllers that the user brings along: a library and programs, sound ones and each way to fail.

#include <algorithm>
#include <cstdlib>

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::own_controller_test {
namespace {

/// Runs of 0.3 s with a controller of the user's own.
class OwnController : public CommandTest {
 protected:
  OwnController() { ::setenv("DEXCHECK_PYTHON", "/usr/bin/python3", /*replace=*/1); }

  [[nodiscard]] ProgramResult RunWith(const std::string& controller, const Words& more = "--out run",
                                      const ProgramOptions& options = {}) const {
    return Run(Words("run curve --no-report --set duration=0.3 --set settle=0.2 --controller") +
                   Words{controller} + more,
               options);
  }
  [[nodiscard]] Json ReadSummary(const std::string& run = "run") const {
    return ReadJson(run + "/summary.json");
  }
  [[nodiscard]] Json ReadChecks() const { return ReadSummary()["checks"]; }

  /// Success when the run into this folder ended with exit code 3 and a verdict that has these words.
  [[nodiscard]] ::testing::AssertionResult HasFailed(const ProgramResult& result, const std::string& words,
                                                     const std::string& run = "run") const {
    const std::string all = result.out + result.err;
    if (result.exit_code != 3)
      return ::testing::AssertionFailure() << "exit code " << result.exit_code << ": " << all;
    const bool has_summary = Has(run + "/summary.json");
    const std::string failure = has_summary ? ReadSummary(run)["failure"].get<std::string>() : all;
    if (has_summary && ReadSummary(run)["verdict"] != "failed")
      return ::testing::AssertionFailure() << "the verdict";
    std::filesystem::remove_all(Path(run));
    if (failure.find(words) != std::string::npos) return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << "\"" << words << "\" is missing in: " << failure;
  }

  /// The law rewritten outside, and its own: the same verdict, and torques that the check of the law finds
  /// right.
  void ExpectThePapersLaw(const std::string& controller) const {
    const ProgramResult result = RunWith(controller, "--out run --set control.law=computed_torque");
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    const Json checks = ReadChecks();
    for (const char* check : {"law_torque", "law_demand", "grasp_null_space", "grasp_cone",
                              "grasp_optimality", "error_dynamics"}) {
      ASSERT_TRUE(checks.contains(check)) << check;
      EXPECT_EQ(checks[check]["pass"], true) << check;
    }
    EXPECT_GT(checks["law_torque"]["max"], 0.0);
  }
};

TEST_F(OwnController, TheLawRewrittenAsALibraryIsTheLaw) { ExpectThePapersLaw(PAPER_LAW); }

TEST_F(OwnController, TheLawRewrittenInNumPyIsTheLaw) {
  ExpectThePapersLaw(SourcePath("/harness/examples/numpy_law.py"));
}

// A python3 of the user's own that finds no NumPy gives way to the system's, unless it is asked for.
TEST_F(OwnController, APythonWithoutNumPyGivesWay) {
  const std::string path = std::getenv("PATH");
  std::filesystem::create_directory(Path("own"));
  std::filesystem::copy_file(std::filesystem::canonical("/usr/bin/python3"), Path("own/python"));
  Write("own/python3", "#!/bin/sh\nexec \"$(dirname \"$0\")/python\" -S \"$@\"\n");
  std::filesystem::permissions(Path("own/python3"), std::filesystem::perms::owner_all);
  ::setenv("PATH", (Path("own").string() + ":" + path).c_str(), /*replace=*/1);
  const std::string law = SourcePath("/harness/examples/numpy_law.py");
  ::unsetenv("DEXCHECK_PYTHON");
  EXPECT_EQ(RunWith(law).exit_code, 0);
  ::setenv("DEXCHECK_PYTHON", "python3", /*replace=*/1);
  EXPECT_THAT(RunWith(law, "--out asked").err, HasSubstr("need NumPy"));
  ::setenv("PATH", path.c_str(), /*replace=*/1);
}

/// The law of the joints rewritten outside, with gains that differ from joint to joint.
class OwnJointLaw : public OwnController, public ::testing::WithParamInterface<std::string> {};

TEST_P(OwnJointLaw, IsTheLaw) {
  constexpr double kRounding = 1e-13;  // measured 1.3e-15
  const Words reach = Words(
                          "run panda-reach --no-report --set duration=0.3 --set settle=0.1 --set "
                          "'control.natural_frequency={ all = 20, panda_joint4 = 30 }' --controller") +
                      Words{GetParam()};
  const Json checks = RunJson(0, reach + "--no-log")["checks"];
  EXPECT_LE(checks["law_torque"]["max"], kRounding);
  EXPECT_GT(checks["law_torque"]["max"], 0.0);
  EXPECT_EQ(checks["joint_dynamics"]["pass"], true);
  EXPECT_EQ(checks["expect_joints"]["pass"], true);
  // The scenario's law is another: the same torques are not its.
  const Json other = RunJson(1, reach + "--no-log --set control.law=feedforward_pd --set expect.joints=0.01");
  EXPECT_EQ(other["attribution"]["cause"], "control law");
}

INSTANTIATE_TEST_SUITE_P(OwnController, OwnJointLaw,
                         ::testing::Values(JOINT_LAW, SourcePath("/harness/examples/numpy_joint_law.py")),
                         [](const auto& info) { return info.index == 0 ? "Library" : "NumPy"; });

TEST_F(OwnController, TorquesAreHeldForAControlStep) {
  const Words reach = Words(
      "run panda-reach --no-report --no-log --set duration=0.3 --set settle=0.1 --set "
      "plant.control_step=0.004 "
      "--controller");
  const Words law = Words{SourcePath("/harness/examples/numpy_joint_law.py")};
  const Json checks = RunJson(0, reach + law)["checks"];
  const Json own =
      RunJson(0, Words("run panda-reach --no-report --no-log --set duration=0.3 --set settle=0.1 "
                       "--set plant.control_step=0.004"))["checks"];
  // Both move alike, and not as with a torque at each step.
  EXPECT_NEAR(checks["expect_joints"]["max"].get<double>(), own["expect_joints"]["max"].get<double>(), 1e-9);
  const Json free =
      RunJson(0, Words("run panda-reach --no-report --no-log --set duration=0.3 --set settle=0.1"))["checks"];
  EXPECT_GT(own["expect_joints"]["max"].get<double>(), 1.1 * free["expect_joints"]["max"].get<double>());
  const ProgramResult library = Run(reach + Words{JOINT_LAW});
  EXPECT_EQ(library.exit_code, 3);
  EXPECT_THAT(library.err, HasSubstr("changed its torques within plant.control_step (0.004 s)"));
}

TEST_F(OwnController, AJointLawIsNoneForAGrasp) {
  EXPECT_TRUE(IsRefused(RunWith(JOINT_LAW), {"joint_law.so", "[joint_motion]"}));
}

TEST_F(OwnController, AnUnknownLawIsNotChecked) {
  const ProgramResult result = RunWith(PAPER_LAW);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out,
              HasSubstr("PASS: model, motors and sensors, inverse and forward dynamics, assumptions hold\n"
                        "  at every step; not judged: law."));
  const Json checks = ReadChecks();
  for (const char* check : {"law_torque", "law_demand", "grasp_null_space", "grasp_cone", "grasp_optimality",
                            "closed_loop_spectral_radius", "error_dynamics"})
    EXPECT_FALSE(checks.contains(check)) << check;
  for (const char* check :
       {"measurement", "torque_applied", "expect_position", "inverse_dynamics_robot", "contact_force"})
    EXPECT_TRUE(checks.contains(check)) << check;
  // A log is data: it starts nothing.
  EXPECT_TRUE(IsRefused(Run("run --replay run"), {"run/log.h5", "--controller", "paper_law.so"}));
  Expect(0, Words("run --replay run --controller") + Words{PAPER_LAW});
}

// A log that ends before it, and nothing else, is left.
TEST_F(OwnController, WhatALibraryDoesWrongEndsTheRunInOneLine) {
  const auto run = [&](const std::string& fault) {
    return RunWith(FAULTY_CONTROLLER, {"--controller-time-limit", "0.4", "--out", fault},
                   {.environment = {{"FAULT", fault}}});
  };
  EXPECT_EQ(run("none").exit_code, 0);
  for (const auto& [fault, words] : {std::pair("throw", "the widget is out of cheese at t = 0.01 s"),
                                     {"throw_number", "std::exception at t = 0.01 s"},
                                     {"nan", "not a number at t = 0.01 s"},
                                     {"size", "3 torques, must be 50 at t = 0.01 s"}}) {
    const ProgramResult result = run(fault);
    EXPECT_EQ(ReadSummary(fault)["speed"]["steps"], 10) << fault;
    EXPECT_EQ(CountFiles(fault), 2) << fault << ": log and summary";
    EXPECT_TRUE(HasFailed(result, words, fault)) << fault;
  }
}

// Whatever ends the process that has the library in it: exit code 3 and one line that names it.
TEST_F(OwnController, WhatALibraryEndsIsNeverGood) {
  for (const auto& [fault, words] : {std::pair("exit", "ended the program (exit code 0)"),
                                     {"_exit", "ended the program (exit code 0)"},
                                     {"quick_exit", "ended the program (exit code 0)"},
                                     {"kill", "ended the program (Killed)"},
                                     {"load", "ended the program (Aborted)"},
                                     {"crash", "ended the program (Segmentation fault)"},
                                     {"abort", "ended the program (Aborted)"},
                                     {"overflow", "ended the program (Segmentation fault)"},
                                     {"hang", "did not return in time (0.4 s for a step)"}}) {
    const ProgramResult result = RunWith(FAULTY_CONTROLLER, "--controller-time-limit 0.4 --no-log",
                                         {.environment = {{"FAULT", fault}}});
    EXPECT_EQ(result.exit_code, 3) << fault << result.out;
    EXPECT_THAT(result.err, HasSubstr("faulty_controller.so")) << fault;
    EXPECT_THAT(result.err, HasSubstr(words)) << fault;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << fault << result.err;
    EXPECT_THAT(result.out, Not(HasSubstr("PASS"))) << fault;
  }
  for (const char* fault : {"exit", "text", "beyond"}) {
    const ProgramResult result =
        RunWith(FAULTY_C_CONTROLLER, "--no-log", {.environment = {{"FAULT", fault}}});
    EXPECT_EQ(result.exit_code, 3) << fault << result.out;
    EXPECT_THAT(result.out + result.err, HasSubstr("faulty_c_controller.so")) << fault;
  }
}

// In a study they cost their trial.
TEST_F(OwnController, WhatALibraryEndsCostsItsTrial) {
  WriteText(Path("study.toml"),
            std::string("name = \"study\"\nscenario = \"hold\"\ncontroller = \"") + FAULTY_CONTROLLER +
                "\"\nset = [\"controller.time_limit=0.4\", \"duration=0.02\", \"settle=0.2\"]\n"
                "[[vary]]\nkey = \"plant.impratio\"\nvalues = [100]\n");
  for (const auto& [fault, words] :
       {std::pair("crash", "the process died: Segmentation fault"), {"hang", "did not return in time"}}) {
    const std::string database = std::string(fault) + ".sqlite";
    static_cast<void>(Run(Words("study run study.toml --quiet --db") + Words{database},
                          {.environment = {{"FAULT", fault}}}));
    const Json trial = RunJson(0, Words{"study", "show", database, "0"});
    EXPECT_EQ(trial["outcome"], "crashed") << fault;
    EXPECT_THAT(trial["failure"].get<std::string>(), HasSubstr(words)) << fault;
  }
}

TEST_F(OwnController, LibrariesThatAreNoneAreRefused) {
  EXPECT_TRUE(IsRefused(RunWith(OTHER_INTERFACE), {"interface", "0, of another time"}));
  EXPECT_TRUE(IsRefused(RunWith(OTHER_MUJOCO_VERSION), {"no controller"}));
  // A library of the interface before there were parameters works, without them.
  EXPECT_EQ(RunWith(OLD_INTERFACE).exit_code, 0);
  EXPECT_TRUE(IsRefused(RunWith(OLD_INTERFACE, "--no-log --set controller.gain=3"),
                        {"old_interface.so", "controller.gain", "asks for no parameters"}));
  EXPECT_TRUE(Refused({"run", "lift", "--no-log", "--controller", PAPER_LAW}, {"task"}));
}

TEST_F(OwnController, WhatALibraryInCDoesWrongIsOneLine) {
  const auto run = [&](const std::string& fault, const Words& more) {
    return RunWith(FAULTY_C_CONTROLLER, more, {.environment = {{"FAULT", fault}}});
  };
  EXPECT_TRUE(
      IsRefused(run("protocol", "--no-log"), {"faulty_c_controller.so", "protocol 7", "this program of 1"}));
  EXPECT_TRUE(IsRefused(run("open", "--no-log"), {"faulty_c_controller.so", "made no controller"}));
  EXPECT_TRUE(IsRefused(run("none", "--no-log --set controller.gain=3"), {"controller.gain", "takes none"}));
  EXPECT_TRUE(HasFailed(run("step", "--out run"), "the widget is out of cheese while settling"));
  EXPECT_TRUE(HasFailed(run("crash", "--out run"), "ended the program (Aborted)"));
  EXPECT_TRUE(HasFailed(run("none", "--out run"), "while settling"));
}

/// A Python file with this law, in a class or as it is.
class OwnPythonFile : public OwnController {
 protected:
  [[nodiscard]] ProgramResult RunLaw(const std::string& text) const {
    WriteText(Path("law.py"), text);
    return Run(
        "run panda-reach --no-report --set duration=0.1 --set settle=0.1 --controller law.py "
        "--controller-time-limit 0.5 --out run");
  }
  [[nodiscard]] ProgramResult RunStep(const std::string& body) const {
    return RunLaw(
        "import os, time\nimport dexcheck\nimport numpy as np\nclass Law(dexcheck.Controller):\n"
        "  def step(self, s):\n    if s.t < 0.01: return s.gravity\n    " +
        body + "\n");
  }
};

TEST_F(OwnPythonFile, EachFailureIsOneClearLine) {
  EXPECT_TRUE(
      HasFailed(RunStep("raise KeyError('cheese')"), "controller law.py: KeyError: 'cheese' (law.py:7)"));
  EXPECT_TRUE(HasFailed(RunStep("return np.zeros(3)"),
                        "ValueError: step must return 7 torques, got an array of shape (3,)"));
  EXPECT_TRUE(HasFailed(RunStep("return s.q[99]"), "IndexError: index 99 is out of bounds"));
  EXPECT_TRUE(HasFailed(RunStep("return None"), "step must return 7 torques"));
  EXPECT_TRUE(HasFailed(RunStep("return np.full(7, np.nan)"), "not a number"));
  EXPECT_TRUE(HasFailed(RunStep("time.sleep(9)"), "within 0.5 s"));
  EXPECT_TRUE(HasFailed(RunStep("os._exit(4)"), "exit code 4"));
}

TEST_F(OwnPythonFile, WhatARunDoesNotReachIsNotGood) {
  const ProgramResult result = RunLaw(
      "import dexcheck\nclass Law(dexcheck.Controller):\n  def step(self, s): raise KeyError('cheese')\n");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.out, HasSubstr("0.000 of 0.100 s simulated"));
  const Json checks = ReadChecks();
  for (const char* check : {"law_torque", "inverse_dynamics_robot", "joint_limit"}) {
    EXPECT_EQ(checks[check]["reached"], false) << check;
    EXPECT_FALSE(checks[check].contains("pass")) << check;
  }
}

TEST_F(OwnPythonFile, WithoutAControllerIsRefused) {
  EXPECT_TRUE(IsRefused(RunLaw("x = 3\n"), {"law.py", "dexcheck.Controller", "step(state)"}));
  EXPECT_TRUE(IsRefused(RunLaw("def step(s:\n"), {"law.py", "SyntaxError"}));
  EXPECT_TRUE(IsRefused(RunLaw("import no_such_module\n"), {"law.py", "no_such_module", "(law.py:1)"}));
  EXPECT_TRUE(IsRefused(RunWith("none.py", "--no-log"), {"controller none.py", "cannot be read"}));
}

/// A program in Python without NumPy: it greets, answers `good` steps with torques of zero, and then does
/// `then`.
std::string WriteProgram(const std::filesystem::path& file, int good, const std::string& then) {
  WriteText(file, R"(import os, signal, struct, sys, time
def read(n):
    data = sys.stdin.buffer.read(n)
    if len(data) < n: sys.exit(0)
    return data
def write(data):
    sys.stdout.buffer.write(data); sys.stdout.buffer.flush()
hello = struct.unpack("=8s6I17d", read(168))
read(hello[5] + hello[6])
write(struct.pack("=8sII", b"DEXCTRL\0", 1, 0))
n, count = hello[3], 0
while True:
    kind, doubles = struct.unpack("=II", read(8))
    if kind == 3: sys.exit(0)
    if kind == 2: continue
    read(8 * doubles)
    count += 1
    if count > )" + std::to_string(good) +
                      ":\n        " + then + R"(
    write(struct.pack("=II", 1, n) + bytes(8 * n))
)");
  return "/usr/bin/python3 " + file.string();
}

TEST_F(OwnController, EachFailureOfAProgramIsOneClearLine) {
  const auto fails = [&](const std::string& then, const std::string& words) {
    return HasFailed(RunWith(WriteProgram(Path("law.py"), 5, then), "--controller-time-limit 0.5 --out run"),
                     words);
  };
  EXPECT_TRUE(fails("sys.exit(4)", "exit code 4"));
  EXPECT_TRUE(fails("os.kill(os.getpid(), signal.SIGSEGV)", "signal 11"));
  EXPECT_TRUE(fails("time.sleep(100)", "within 0.5 s"));
  EXPECT_TRUE(fails("write(struct.pack('=II', 1, 3) + bytes(24)); time.sleep(9)",
                    "message 1 of 3 numbers, must be 1 of 50"));
  EXPECT_TRUE(
      fails("write(struct.pack('=II50d', 1, 50, *[float('nan')] * 50)); time.sleep(9)", "not a number"));
  EXPECT_TRUE(fails("os.close(1); os.close(0); time.sleep(9)", "closed its standard"));
}

TEST_F(OwnController, ProgramsThatDoNotSpeakAreRefusedAtOnce) {
  EXPECT_TRUE(HasFailed(RunWith("/nowhere/law"), "exit code 127"));
  EXPECT_TRUE(IsRefused(RunWith(ECHO_CONTROLLER, "--no-log --set controller.gain=3"),
                        {"controller.gain", "takes none"}));
  WriteProgram(Path("law.py"), 5, "pass");
  std::string text = Read("law.py");
  text.replace(text.find("0\", 1, 0)"), sizeof("0\", 1, 0)") - 1, "0\", 7, 0)");
  WriteText(Path("law.py"), text);
  EXPECT_TRUE(IsRefused(RunWith("/usr/bin/python3 law.py", "--no-log"),
                        {"controller /usr/bin/python3 law.py", "protocol 7", "this program 1"}));
  EXPECT_TRUE(HasFailed(RunWith("sh -c 'echo I know nothing of your protocol; sleep 9'"), "protocol"));
  EXPECT_TRUE(HasFailed(RunWith("sleep 9", "--controller-time-limit 0.2 --out run"), "within 2 s"));
}

// With no torque the robot falls: the transport works, and the run ends as it does with any bad controller.
TEST_F(OwnController, TheEchoAnswersAndTheRobotFalls) {
  EXPECT_TRUE(HasFailed(RunWith(ECHO_CONTROLLER), "while settling"));
}

}  // namespace
}  // namespace dexcheck::testing::own_controller_test
