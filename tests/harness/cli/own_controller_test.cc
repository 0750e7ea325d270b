// Controllers that the user brings along: a library and programs, sound ones and each way to fail.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::own_controller_test {
namespace {

const std::vector<std::string> kShort = {"run",          "curve", "--no-report", "--set",
                                         "duration=0.3", "--set", "settle=0.2"};

ProgramResult RunWith(const std::string& controller, std::vector<std::string> more = {},
                      const ProgramOptions& options = {}) {
  std::vector<std::string> arguments = kShort;
  arguments.insert(arguments.end(), {"--controller", controller});
  if (std::find(more.begin(), more.end(), "--out") == more.end()) arguments.push_back("--no-log");
  arguments.insert(arguments.end(), more.begin(), more.end());
  return RunDexcheck(arguments, options);
}

nlohmann::json ReadSummary(const std::filesystem::path& run) {
  return nlohmann::json::parse(ReadText(run / "summary.json"));
}

/// Success when the run ended with exit code 3 and a verdict that has these words.
::testing::AssertionResult HasFailed(const ProgramResult& result, const std::string& words) {
  const std::string all = result.out + result.err;
  if (result.exit_code != 3) {
    return ::testing::AssertionFailure() << "exit code " << result.exit_code << ": " << all;
  }
  if (all.find(words) != std::string::npos) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "\"" << words << "\" is missing in: " << all;
}

/// The law rewritten outside, and its own: the same verdict, and torques that the check of the law finds
/// right.
void ExpectThePapersLaw(const std::string& controller) {
  const TempFolder folder;
  const std::filesystem::path own = folder.path() / "own";
  const ProgramResult result =
      RunWith(controller, {"--out", own.string(), "--set", "control.law=computed_torque"});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  const nlohmann::json summary = ReadSummary(own);
  EXPECT_EQ(summary["verdict"], "pass");
  for (const char* check :
       {"law_torque", "law_demand", "grasp_null_space", "grasp_cone", "grasp_optimality", "error_dynamics"}) {
    ASSERT_TRUE(summary["checks"].contains(check)) << check;
    EXPECT_TRUE(summary["checks"][check]["pass"]) << check;
  }
  EXPECT_GT(summary["checks"]["law_torque"]["max"], 0.0);
}

TEST(OwnController, TheLawRewrittenAsALibraryIsTheLaw) { ExpectThePapersLaw(PAPER_LAW_LIBRARY); }

TEST(OwnController, TheLawRewrittenInNumPyIsTheLaw) {
  ExpectThePapersLaw("/usr/bin/python3 " + testing::SourcePath("/controller/examples/numpy_law.py"));
}

/// The law of the joints rewritten outside, with gains that differ from joint to joint.
class OwnJointLaw : public ::testing::TestWithParam<std::string> {};

TEST_P(OwnJointLaw, IsTheLaw) {
  constexpr double kRounding = 1e-13;  // measured 1.3e-15
  const TempFolder folder;
  const std::filesystem::path own = folder.path() / "own";
  const std::vector<std::string> reach = {
      "run",        "panda-reach",  "--no-report",
      "--set",      "duration=0.3", "--set",
      "settle=0.1", "--set",        "control.natural_frequency={ all = 20, panda_joint4 = 30 }"};
  std::vector<std::string> arguments = reach;
  arguments.insert(arguments.end(), {"--controller", GetParam(), "--out", own.string()});
  const ProgramResult result = RunDexcheck(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  const nlohmann::json summary = ReadSummary(own);
  EXPECT_EQ(summary["verdict"], "pass");
  const nlohmann::json& checks = summary["checks"];
  EXPECT_LE(checks["law_torque"]["max"], kRounding);
  EXPECT_GT(checks["law_torque"]["max"], 0.0);
  EXPECT_TRUE(checks["joint_dynamics"]["pass"]);
  EXPECT_TRUE(checks["expect_joints"]["pass"]);
  // The scenario's law is another: the same torques are not its.
  arguments = reach;
  arguments.insert(arguments.end(), {"--controller", GetParam(), "--no-log", "--set",
                                     "control.law=feedforward_pd", "--set", "expect.joints=0.01"});
  const ProgramResult other = RunDexcheck(arguments);
  EXPECT_EQ(other.exit_code, 1) << other.out << other.err;
  EXPECT_NE(other.out.find("control law"), std::string::npos) << other.out;
}

INSTANTIATE_TEST_SUITE_P(OwnController, OwnJointLaw,
                         ::testing::Values(JOINT_LAW_LIBRARY,
                                           "/usr/bin/python3 " +
                                               SourcePath("/controller/examples/numpy_joint_law.py")),
                         [](const auto& info) { return info.index == 0 ? "Library" : "NumPy"; });

TEST(OwnController, AJointLawIsNoneForAGrasp) {
  EXPECT_TRUE(HasFailed(RunWith(JOINT_LAW_LIBRARY), "this law is for a [joint_motion]"));
}

TEST(OwnController, AnUnknownLawIsNotAsked) {
  const TempFolder folder;
  const std::filesystem::path own = folder.path() / "own";
  EXPECT_EQ(RunWith(PAPER_LAW_LIBRARY, {"--out", own.string()}).exit_code, 0);
  const nlohmann::json checks = ReadSummary(own)["checks"];
  for (const char* check : {"law_torque", "law_demand", "grasp_null_space", "grasp_cone", "grasp_optimality",
                            "closed_loop_spectral_radius", "error_dynamics"}) {
    EXPECT_FALSE(checks.contains(check)) << check;
  }
  for (const char* check :
       {"measurement", "torque_applied", "expect_position", "inverse_dynamics_robot", "contact_force"}) {
    EXPECT_TRUE(checks.contains(check)) << check;
  }
  // The log does not hold the library.
  EXPECT_TRUE(IsRefused(RunDexcheck({"run", "--replay", own.string()}), {"--controller", "paper_law"}));
  const ProgramResult replay =
      RunDexcheck({"run", "--replay", own.string(), "--controller", PAPER_LAW_LIBRARY});
  EXPECT_EQ(replay.exit_code, 0) << replay.out << replay.err;
}

TEST(OwnController, WhatALibraryThrowsEndsTheRunWithItsWords) {
  const auto run = [](const std::string& fault) {
    return RunWith(FAULTY_LIBRARY, {}, {.environment = {{"FAULT", fault}}});
  };
  EXPECT_EQ(run("none").exit_code, 0);
  EXPECT_TRUE(HasFailed(run("throw"), "the widget is out of cheese at t = 0.01 s"));
  EXPECT_TRUE(HasFailed(run("throw_number"), "threw something that is no std::exception at t = 0.01 s"));
  EXPECT_TRUE(HasFailed(run("nan"), "sent a torque that is not a number at t = 0.01 s"));
  EXPECT_TRUE(HasFailed(run("size"), "sent 3 torques, must be 50 at t = 0.01 s"));
}

// And leaves a log that ends before it, and nothing else.
TEST(OwnController, ACrashOrAHangOfALibraryEndsTheRunInOneLine) {
  const TempFolder folder;
  const auto run = [&](const std::string& fault) {
    return RunWith(FAULTY_LIBRARY,
                   {"--controller-time-limit", "0.4", "--out", (folder.path() / fault).string()},
                   {.environment = {{"FAULT", fault}}});
  };
  EXPECT_TRUE(HasFailed(run("crash"), "crashed (Segmentation fault) at t = 0.01 s"));
  EXPECT_TRUE(HasFailed(run("abort"), "crashed (Aborted) at t = 0.01 s"));
  EXPECT_TRUE(HasFailed(run("overflow"), "crashed (Segmentation fault) at t = 0.01 s"));
  EXPECT_TRUE(HasFailed(run("hang"), "did not return within 0.4 s at t = 0.01 s"));
  for (const char* fault : {"crash", "abort", "overflow", "hang"}) {
    EXPECT_EQ(ReadSummary(folder.path() / fault)["speed"]["steps"], 10) << fault;
    EXPECT_TRUE(std::filesystem::exists(folder.path() / fault / "log.h5")) << fault;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path() / fault)) {
      EXPECT_NE(entry.path().extension(), ".partial") << entry.path();
    }
  }
}

TEST(OwnController, LibrariesThatAreNoneAreRefused) {
  const TempFolder folder;
  EXPECT_TRUE(IsRefused(RunWith("/nowhere/law.so"), {"--controller", "/nowhere/law.so"}));
  EXPECT_TRUE(IsRefused(RunWith(OTHER_INTERFACE_LIBRARY), {"was built for interface", "0, of another time"}));
  EXPECT_TRUE(IsRefused(RunWith(NO_CONTROLLER_LIBRARY), {"names no controller"}));
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"run", "lift", "--no-log", "--controller", PAPER_LAW_LIBRARY}), {"task"}));
}

/// A program in Python without NumPy: it greets, answers `good` steps with torques of zero, and then does
/// `then`.
std::string WriteProgram(const TempFolder& folder, int good, const std::string& then) {
  const std::filesystem::path file = folder.path() / "law.py";
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

TEST(OwnController, EachFailureOfAProgramIsOneClearLine) {
  const TempFolder folder;
  const auto run = [&](const std::string& then) {
    return RunWith(WriteProgram(folder, 5, then), {"--controller-time-limit", "0.5"});
  };
  EXPECT_TRUE(HasFailed(run("sys.exit(4)"), "ended with exit code 4"));
  EXPECT_TRUE(HasFailed(run("os.kill(os.getpid(), signal.SIGSEGV)"), "was killed by signal 11"));
  EXPECT_TRUE(HasFailed(run("time.sleep(100)"), "did not answer within 0.5 s"));
  EXPECT_TRUE(HasFailed(run("write(struct.pack('=II', 1, 3) + bytes(24)); time.sleep(9)"),
                        "answered with message 1 of 3 numbers, must be 1 of 50"));
  EXPECT_TRUE(HasFailed(run("write(struct.pack('=II50d', 1, 50, *[float('nan')] * 50)); time.sleep(9)"),
                        "sent a torque that is not a number"));
  EXPECT_TRUE(HasFailed(run("os.close(1); os.close(0); time.sleep(9)"), "closed its standard"));
}

TEST(OwnController, ProgramsThatDoNotSpeakAreRefusedAtOnce) {
  EXPECT_TRUE(HasFailed(RunWith("/nowhere/law"), "ended with exit code 127"));
  EXPECT_TRUE(HasFailed(RunWith("sh -c 'echo I know nothing of your protocol; sleep 9'"),
                        "does not speak the protocol"));
  EXPECT_TRUE(HasFailed(RunWith("sleep 9", {"--controller-time-limit", "0.2"}), "did not answer within 2 s"));
  EXPECT_EQ(RunWith("true", {"--controller-time-limit", "0"}).exit_code, 2);
}

// With no torque the robot falls: the transport works, and the run ends as it does with any bad controller.
TEST(OwnController, TheEchoAnswersAndTheRobotFalls) {
  EXPECT_TRUE(HasFailed(RunWith(ECHO_PROGRAM), "while settling"));
}

}  // namespace
}  // namespace dexcheck::testing::own_controller_test
