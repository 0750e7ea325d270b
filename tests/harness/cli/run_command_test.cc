// dexcheck run, as its users run it.

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "harness/log/log_reader.h"
#include "harness/log/log_writer.h"
#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/log/forge.h"

namespace dexcheck::testing::run_command_test {
namespace {

nlohmann::json ReadSummary(const std::filesystem::path& folder) {
  return nlohmann::json::parse(ReadText(folder / "summary.json"));
}

TEST(RunCommand, SaysThatARunWithoutStepsHasNoVideo) {
  const TempFolder folder;
  const std::filesystem::path out = folder.path() / "run";
  const ProgramResult result =
      RunDexcheck({"run", "offset", "--set", "control.K_p=1e7", "--set", "control.K_v=600", "--no-check",
                   "--video", "--out", out.string()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.out, HasSubstr("while settling"));
  EXPECT_THAT(result.out, HasSubstr("\nlog and summary in "));
  EXPECT_THAT(result.err, HasSubstr("dexcheck: no video: the run ended before its first step\n"));
  EXPECT_THAT(result.err, HasSubstr("while settling\n")) << "a failure has its line, whatever is printed";
  EXPECT_TRUE(IsRefused(RunDexcheck({"run", "--replay", out.string()}), {"run/log.h5", "first step"}));
  const ProgramResult table = RunDexcheck({"export", out.string(), "--csv", "-"});
  EXPECT_EQ(table.exit_code, 0);
  EXPECT_EQ(std::count(table.out.begin(), table.out.end(), '\n'), 1) << "the header";
  EXPECT_THAT(table.err, HasSubstr("first step"));
  EXPECT_FALSE(std::filesystem::exists(out / "video.mp4"));
  EXPECT_FALSE(std::filesystem::exists(out / "report.html"));
}

TEST(RunCommand, WritesAFolderThatTellsAll) {
  const TempFolder folder;
  const std::filesystem::path out = folder.path() / "run";
  const ProgramResult result =
      RunDexcheck({"run", "curve", "--set", "duration=0.2", "--out", out.string(), "--seed", "3"});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("PASS"));

  const nlohmann::json summary = ReadSummary(out);
  EXPECT_EQ(summary["scenario"], "curve");
  EXPECT_EQ(summary["verdict"], "pass");
  EXPECT_EQ(summary["seed"], 3);
  EXPECT_LT(summary["tracking"]["position_error_max_m"].get<double>(), 1e-6);
  EXPECT_GT(summary["tracking"]["position_error_rms_m"].get<double>(), 0.0);
  EXPECT_TRUE(summary["tracking"].contains("orientation_error_max_rad"));
  for (const char* check : {"M_bar", "inverse_dynamics_robot", "reduced_acceleration", "wheel_slip"}) {
    const nlohmann::json& entry = summary["checks"][check];
    for (const char* key : {"kind", "max", "rms", "bound", "at_time_s", "pass"}) {
      EXPECT_TRUE(entry.contains(key)) << check << " " << key;
    }
    EXPECT_TRUE(entry["pass"].get<bool>());
  }
  EXPECT_EQ(summary["checks"]["M_bar"]["kind"], "model");
  EXPECT_EQ(summary["checks"]["wheel_slip"]["kind"], "assumption");
  for (const char* key : {"fingertip_slip_max_m", "wheel_slip_max_m", "base_tilt_max_rad", "cone_margin_min",
                          "contacts_lost"}) {
    EXPECT_TRUE(summary["assumptions"].contains(key)) << key;
  }
  EXPECT_EQ(summary["speed"]["steps"], 200);
  for (const char* key : {"real_time_factor", "plant_us_per_step", "controller_us_per_step",
                          "cross_check_us_per_step", "grasp_force_us_per_solve"}) {
    EXPECT_GT(summary["speed"][key].get<double>(), 0.0) << key;
  }

  const LogReader log(out / "log.h5");
  EXPECT_EQ(log.rows(), 200);
  EXPECT_EQ(log.ReadText("seed"), "3");
  EXPECT_THAT(log.ReadText("command"), HasSubstr("run curve --set duration=0.2"));
  EXPECT_EQ(nlohmann::json::parse(log.ReadText("summary")), summary);
  const RowMatrixXd qpos = log.ReadSignal("engine/qpos");
  EXPECT_EQ(qpos.cols(), 7 + 50 + 7);
  EXPECT_NE(qpos.row(0), qpos.row(199));

  // The same again from the log alone.
  const ProgramResult replay = RunDexcheck({"run", "--replay", out.string()});
  EXPECT_EQ(replay.exit_code, 0) << replay.out << replay.err;
  EXPECT_THAT(replay.out, HasSubstr("IDENTICAL: 200 steps"));

  // Nothing that is there is overwritten.
  const std::string before = ReadText(out / "summary.json");
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"run", "hold", "--out", out.string()}), {out.string(), "already holds files"}));
  EXPECT_EQ(ReadText(out / "summary.json"), before);
}

/// Writes a log again, with one number of its last row changed.
/// @param lost rows at its end, and with them the summary: the log of a run that was killed.
void CopyLog(const std::filesystem::path& from, const std::filesystem::path& to, const std::string& changed,
             double change, long lost = 0) {
  const LogReader log(from);
  LogWriter copy(to, log.rows());
  for (const std::string& text : log.ListTexts())
    copy.SetText(text, lost > 0 && text == "summary" ? "" : log.ReadText(text));
  for (const std::string& file : log.ListFiles("inputs")) {
    copy.EmbedFile("inputs", file, log.ReadFile("inputs", file));
  }
  std::vector<std::pair<int, RowMatrixXd>> signals;
  for (const SignalInfo& signal : log.signals()) {
    RowMatrixXd values = log.ReadSignal(signal.name);
    if (signal.name == changed) values(log.rows() - 1, 0) += change;
    signals.emplace_back(signal.name == "time" ? LogWriter::kTime : copy.AddSignal(signal), values);
  }
  copy.StartRows();
  for (long row = 0; row < log.rows() - lost; ++row) {
    for (const auto& [signal, values] : signals) {
      std::copy_n(values.row(row).data(), values.cols(), copy.Row(signal).data());
    }
    copy.EndRow();
  }
  copy.Close();
}

TEST(RunCommand, WhatWasCutOffIsToldAndComparedByItsLength) {
  const TempFolder folder;
  const std::string whole = (folder.path() / "whole").string();
  ASSERT_EQ(RunDexcheck({"run", "hold", "--set", "duration=0.02", "--set", "settle=0.1", "--no-report",
                         "--out", whole})
                .exit_code,
            0);
  std::vector<std::string> cut;
  for (const long lost : {5, 10}) {
    cut.push_back((folder.path() / ("cut" + std::to_string(lost))).string());
    std::filesystem::create_directory(cut.back());
    CopyLog(whole + "/log.h5", cut.back() + "/log.h5", "", 0.0, lost);
  }
  const ProgramResult replay = RunDexcheck({"run", "--replay", cut[0]});
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  EXPECT_THAT(replay.out, HasSubstr("cut off after 15 steps"));
  EXPECT_THAT(RunDexcheck({"run", "--replay", whole}).out, ::testing::Not(HasSubstr("cut off")));
  EXPECT_THAT(RunDexcheck({"export", cut[0], "--list"}).err, HasSubstr("cut off after 15 steps"));
  const auto compare = [](std::vector<std::string> more) {
    more.insert(more.begin(), "compare");
    more.insert(more.end(), {"--tolerance", "0"});
    return RunDexcheck(more).exit_code;
  };
  EXPECT_EQ(compare({cut[0], cut[0]}), 0);
  EXPECT_EQ(compare({cut[0], cut[1]}), 1) << "not as long";
  EXPECT_EQ(compare({cut[0], whole}), 1);
  EXPECT_EQ(compare({whole, whole, "--signals", "time"}), 2) << "nothing was compared";
}

TEST(RunCommand, AWordThatIsSetReplacesTheFilesAndKeysCanBeRemoved) {
  const auto run = [](std::vector<std::string> more) {
    more.insert(more.begin(),
                {"run", "hold", "--no-log", "--json", "--set", "duration=0.01", "--set", "settle=0.1"});
    return RunDexcheck(more);
  };
  // The file has a natural frequency of 20 rad/s and a damping ratio of 1: K_p = 400, K_v = 40.
  const auto motion = [](const ProgramResult& result) {
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out)["tracking"];
  };
  const nlohmann::json as_written = motion(run({}));
  for (const char* same : {"control.K_v=40", "control.K_p=400"}) {
    const ProgramResult result = run({"--set", same});
    EXPECT_EQ(motion(result), as_written) << same;
    EXPECT_THAT(result.err, HasSubstr("hold.toml:")) << same;
  }
  EXPECT_NE(motion(run({"--set", "control.K_v=10"})), as_written);
  EXPECT_EQ(
      motion(run({"--unset", "description", "--unset", "control.damping_ratio", "--set", "control.K_v=40"})),
      as_written);
  EXPECT_TRUE(IsRefused(run({"--unset", "control.K_x"}), {"--unset control.K_x", "not there"}));
  EXPECT_TRUE(IsRefused(run({"--unset", "control.K_v=1"}), {"--unset", "control.K_v=1"}));
  for (const char* file : {"model.file", "plant.mjcf"}) {
    EXPECT_TRUE(IsRefused(run({"--set", std::string(file) + "=nowhere"}), {"hold.toml", file, "nowhere"}));
  }
}

// The C library's mathematics without fused multiply-add has other last bits: another machine.
/// A log from before a check was split has a signal that nothing records any more.
TEST(RunCommand, AReplayLeavesOutASignalThatWasReplaced) {
  const testing::TempFolder folder;
  const std::filesystem::path out = folder.path() / "run";
  ASSERT_EQ(RunDexcheck({"run", "hold", "--set", "duration=0.01", "--out", out.string()}).exit_code, 0);
  testing::ForgeStructure(out / "log.h5", [](hid_t file) {
    ASSERT_GE(H5Lmove(file, "check/grasp_cone", file, "check/grasp_force", H5P_DEFAULT, H5P_DEFAULT), 0);
    const hid_t attribute = H5Aopen(file, "signals", H5P_DEFAULT);
    const hid_t type = H5Aget_type(attribute);
    const hid_t space = H5Aget_space(attribute);
    std::vector<char*> names(static_cast<size_t>(H5Sget_simple_extent_npoints(space)));
    ASSERT_GE(H5Aread(attribute, type, names.data()), 0);
    std::string old = "check/grasp_force";
    *std::find(names.begin(), names.end(), std::string_view("check/grasp_cone")) = old.data();
    ASSERT_GE(H5Awrite(attribute, type, names.data()), 0);
    H5Sclose(space);
    H5Tclose(type);
    H5Aclose(attribute);
  });
  const ProgramResult replay = RunDexcheck({"run", "--replay", out.string()});
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  EXPECT_THAT(replay.out, HasSubstr("Not compared: check/grasp_force"));
  EXPECT_THAT(replay.out, HasSubstr("IDENTICAL"));
}

TEST(RunCommand, AReplayTellsAnotherMachineFromAnotherRun) {
  const TempFolder folder;
  const std::filesystem::path out = folder.path() / "run";
  ASSERT_EQ(RunDexcheck({"run", "hold", "--set", "duration=0.05", "--set", "settle=0.2", "--no-report",
                         "--out", out.string()})
                .exit_code,
            0);
  const std::string machine = LogReader(out / "log.h5").ReadText("machine");
  EXPECT_EQ(ReadSummary(out)["machine"], machine);
  EXPECT_THAT(machine, HasSubstr("; glibc 2."));
  if (machine.find(" FMA") == std::string::npos) GTEST_SKIP() << "this machine has no fused multiply-add";

  testing::ProgramOptions other;
  other.environment = {{"GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX2,-FMA"}};
  const auto replay = [&](const char* name, bool elsewhere) {
    return RunDexcheck({"run", "--replay", (folder.path() / name).string()},
                       elsewhere ? other : testing::ProgramOptions{});
  };
  EXPECT_THAT(replay("run", false).out, HasSubstr("IDENTICAL"));
  const ProgramResult there = replay("run", true);
  EXPECT_EQ(there.exit_code, 0);
  EXPECT_THAT(there.out, HasSubstr("DIFFERENT MACHINE: "));
  EXPECT_THAT(there.out, HasSubstr("written on:  " + machine));

  // Less than rounding on the same machine is a difference; more than rounding on another one is, too.
  for (const auto& [name, change] : {std::pair("slightly", 1e-15), {"much", 1e-6}}) {
    std::filesystem::create_directory(folder.path() / name);
    CopyLog(out / "log.h5", folder.path() / name / "log.h5", "object/X_o", change);
    const ProgramResult here = replay(name, false);
    EXPECT_EQ(here.exit_code, 1) << name;
    EXPECT_THAT(here.out, HasSubstr("DIFFERENT: object/X_o at t = 0.049 s")) << name;
    const ProgramResult elsewhere = replay(name, true);
    const bool much = change > 1e-9;
    EXPECT_EQ(elsewhere.exit_code, much ? 1 : 0) << name << elsewhere.out;
    EXPECT_THAT(elsewhere.out, HasSubstr(much ? "Rounding alone does not explain" : "DIFFERENT MACHINE: "));
  }
}

TEST(RunCommand, DisagreementIsExitCodeOneAndNamesTheCause) {
  const ProgramResult result = RunDexcheck({"run", "paper-rest", "--set", "duration=0.3", "--no-log"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr("DISAGREEMENT"));
  EXPECT_THAT(result.out, HasSubstr("cause: wheel slip"));
}

TEST(RunCommand, FailureIsExitCodeThreeAndKeepsTheRecords) {
  const TempFolder folder;
  const std::filesystem::path out = folder.path() / "run";
  const ProgramResult result = RunDexcheck({"run", "paper-ramp", "--set", "duration=2", "--set",
                                            "plant.floor_friction=0.1", "--out", out.string()});
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.out, HasSubstr("FAILED"));
  const nlohmann::json summary = ReadSummary(out);
  EXPECT_EQ(summary["verdict"], "failed");
  EXPECT_FALSE(summary["failure"].get<std::string>().empty());
  const LogReader log(out / "log.h5");
  EXPECT_GT(log.rows(), 300);
  EXPECT_LT(log.rows(), 2000);
}

TEST(RunCommand, CtrlCWritesWhatThereIs) {
  const TempFolder folder;
  const std::filesystem::path out = folder.path() / "run";
  Program program(testing::DexcheckCommand({"run", "hold", "--set", "duration=1000", "--out", out.string()}),
                  {});
  for (int i = 0; i < 300 && !std::filesystem::exists(out / "log.h5"); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  std::this_thread::sleep_for(std::chrono::seconds(2));
  program.Signal(SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 3) << result.err;
  const nlohmann::json summary = ReadSummary(out);
  EXPECT_TRUE(summary["interrupted"].get<bool>());
  EXPECT_EQ(LogReader(out / "log.h5").rows(), summary["speed"]["steps"].get<long>());
}

TEST(RunCommand, CtrlCEndsSettlingToo) {
  // The second settles twice, the second time while it moves: as short before as the test can tell.
  for (const std::vector<std::string>& settings :
       {std::vector<std::string>{"hold", "--set", "settle=100"},
        {"paper", "--set", "settle=0.01", "--set", "plant.time_step=1e-5", "--set", "duration=1e-3"}}) {
    const TempFolder folder;
    const std::filesystem::path out = folder.path() / "run";
    std::vector<std::string> arguments = {"run"};
    arguments.insert(arguments.end(), settings.begin(), settings.end());
    arguments.insert(arguments.end(), {"--out", out.string()});
    Program program(testing::DexcheckCommand(arguments), {});
    for (int i = 0; i < 300 && !std::filesystem::exists(out / "log.h5"); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    std::this_thread::sleep_for(std::chrono::seconds(1));
    program.Signal(SIGINT);
    const auto begin = std::chrono::steady_clock::now();
    const ProgramResult result = program.Wait();
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_THAT(result.out, HasSubstr("interrupted"));
    const nlohmann::json summary = ReadSummary(out);
    EXPECT_TRUE(summary["interrupted"].get<bool>());
    EXPECT_EQ(summary["speed"]["steps"], 0);
  }
}

TEST(RunCommand, AKilledRunLeavesAReadableLog) {
  const TempFolder folder;
  const std::filesystem::path out = folder.path() / "run";
  {
    Program program(
        testing::DexcheckCommand({"run", "hold", "--set", "duration=1000", "--out", out.string()}), {});
    for (int i = 0; i < 600; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      if (std::filesystem::exists(out / "log.h5") && LogReader(out / "log.h5").rows() >= 200) break;
    }
    program.Signal(SIGKILL);
    program.Wait();
  }
  const LogReader log(out / "log.h5");
  ASSERT_GE(log.rows(), 200);
  EXPECT_TRUE(log.ReadSignal("engine/qpos").allFinite());
  const ProgramResult csv =
      RunDexcheck({"export", out.string(), "--csv", "-", "--signals", "time,object/X_o"});
  EXPECT_EQ(csv.exit_code, 0) << csv.err;
}

TEST(RunCommand, ListsScenarios) {
  const ProgramResult result = RunDexcheck({"run", "--list"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* name : {"paper ", "paper-ramp", "paper-rest", "curve", "reorient", "two-hands", "hold"}) {
    EXPECT_THAT(result.out, HasSubstr(name));
  }
}

// The program beside a copy of the scenarios, one of them broken: the others run, and it is listed as what it
// is.
TEST(RunCommand, ABrokenShippedScenarioStopsNoOther) {
  const TempFolder folder;
  const std::filesystem::path shipped = folder.path() / "share/dexcheck/harness/shipped/scenarios";
  std::filesystem::create_directories(folder.path() / "bin");
  std::filesystem::create_directories(shipped);
  const std::filesystem::path program = folder.path() / "bin/dexcheck";
  std::filesystem::copy_file(testing::ProgramPath(), program);
  std::filesystem::copy_file(testing::SourcePath("/harness/shipped/scenarios/hold.toml"),
                             shipped / "hold.toml");
  WriteText(shipped / "broken.toml", "name = [");

  const ProgramResult run =
      testing::RunProgram({program.string(), "run", "hold", "--set", "duration=0.002", "--set",
                           "settle=0.002", "--no-check", "--no-log", "--quiet"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(IsRefused(testing::RunProgram({program.string(), "run", "broken"}), {"broken.toml:1"}));
  EXPECT_TRUE(
      IsRefused(testing::RunProgram({program.string(), "run", "brokem"}), {"did you mean \"broken\"?"}));
  const ProgramResult list = testing::RunProgram({program.string(), "run", "--list"});
  EXPECT_EQ(list.exit_code, 0);
  EXPECT_THAT(list.out, HasSubstr("unreadable: "));
  EXPECT_THAT(list.out, HasSubstr("hold "));
  EXPECT_THAT(list.out, HasSubstr("\n  cp "));
}

// Equations (46) to (57) are of a robot that holds an object.
TEST(RunCommand, AnArmsPageHasNoEquationOfThePaper) {
  const TempFolder folder;
  const std::filesystem::path out = folder.path() / "out";
  ASSERT_EQ(RunDexcheck({"run", "panda-reach", "--set", "duration=0.02", "--quiet", "--out", out.string()})
                .exit_code,
            0);
  const std::string page = testing::ReadText(out / "report.html");
  const std::string list = RunDexcheck({"export", out.string(), "--list"}).out;
  EXPECT_THAT(page, HasSubstr("law_torque"));
  for (const char* equation : {"(46)", "(47)", "(48)", "(53)", "(55)", "(57)"}) {
    EXPECT_THAT(page, ::testing::Not(HasSubstr(equation)));
    EXPECT_THAT(list, ::testing::Not(HasSubstr(equation)));
  }
}

TEST(RunCommand, RefusesBadInputInOneLine) {
  const TempFolder folder;
  EXPECT_TRUE(IsRefused(RunDexcheck({"run"}), {"SCENARIO"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"run", "papper"}), {"\"papper\"", "did you mean \"paper\"?"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"run", "missing.toml"}), {"missing.toml", "cannot be read"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"run", "paper", "--seed", "-1"}), {"-1"}));
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"run", "paper", "--set", "duration=x", "--out", (folder.path() / "a").string()}),
                {"--set duration=x: duration: must be a number"}));
  EXPECT_TRUE(IsRefused(
      RunDexcheck({"run", "paper", "--set", "bounds.slip=1", "--out", (folder.path() / "a").string()}),
      {"bounds.slip"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"run", "paper", "--set", "trajectory.velocity=[0, 1, 0]", "--out",
                                     (folder.path() / "a").string()}),
                        {"start", "straight ahead"}));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a"));
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"run", "paper", "--out", "/proc/run"}), {"/proc/run", "cannot be made"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"run", "--replay", folder.path().string()}), {"log.h5"}));
}

}  // namespace
}  // namespace dexcheck::testing::run_command_test
