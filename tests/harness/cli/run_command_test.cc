// dexcheck run, as its users run it.

#include <chrono>
#include <csignal>
#include <thread>

#include "harness/log/log_reader.h"
#include "harness/log/log_writer.h"
#include "tests/common/refused_text.h"
#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/log/change_log.h"

namespace dexcheck::testing::run_command_test {
namespace {

class RunCommand : public CommandTest {
 protected:
  [[nodiscard]] Json ReadSummary(const std::string& run = "run") const {
    return ReadJson(run + "/summary.json");
  }
  [[nodiscard]] LogReader ReadLog(const std::string& run = "run") const {
    return LogReader(Path(run + "/log.h5"));
  }
};

TEST_F(RunCommand, SaysThatARunWithoutStepsHasNoVideo) {
  const ProgramResult result =
      Expect(3, "run offset --set control.K_p=1e7 --set control.K_v=600 --no-check --video --out run");
  EXPECT_EQ(ReadSummary().at("verdict"), "failed");
  EXPECT_EQ(ReadSummary().at("speed").at("steps"), 0);
  // A failure has its line, whatever is printed.
  EXPECT_EQ(std::ranges::count(result.err, '\n'), 2) << result.err;
  EXPECT_THAT(result.err, HasSubstr("dexcheck: no video: "));
  EXPECT_THAT(result.err, HasSubstr(ReadSummary().at("failure").get<std::string>()));
  EXPECT_TRUE(Refused("run --replay run", {"run/log.h5", "first step"}));
  const ProgramResult table = Expect(0, "export run --csv -");
  EXPECT_EQ(std::ranges::count(table.out, '\n'), 1) << "the header";
  EXPECT_FALSE(Has("run/video.mp4"));
  EXPECT_FALSE(Has("run/report.html"));
}

TEST_F(RunCommand, WritesAFolderThatHoldsAll) {
  Expect(0, "run curve --set duration=0.2 --out run --seed 3");
  const Json summary = ReadSummary();
  EXPECT_EQ(summary["scenario"], "curve");
  EXPECT_EQ(summary["verdict"], "pass");
  EXPECT_EQ(summary["seed"], 3);
  EXPECT_LT(summary["tracking"]["position_error_max_m"].get<double>(), 1e-6);
  EXPECT_GT(summary["tracking"]["position_error_rms_m"].get<double>(), 0.0);
  EXPECT_TRUE(summary["tracking"].contains("orientation_error_max_rad"));
  for (const auto& [check, kind] : {std::pair("M_bar", "model"),
                                    {"inverse_dynamics_robot", "inverse_dynamics"},
                                    {"constraint_force", "forward_dynamics"},
                                    {"reduced_acceleration", "assumption"},
                                    {"wheel_slip", "assumption"}}) {
    const Json& entry = summary["checks"][check];
    for (const char* key : {"max", "rms", "bound", "at_time_s"})
      EXPECT_TRUE(entry.contains(key)) << check << key;
    EXPECT_EQ(entry["kind"], kind) << check;
    EXPECT_EQ(entry["pass"], true) << check;
  }
  for (const char* key :
       {"fingertip_slip_max_m", "wheel_slip_max_m", "base_tilt_max_rad", "cone_margin_min", "contacts_lost"})
    EXPECT_TRUE(summary["assumptions"].contains(key)) << key;
  EXPECT_EQ(summary["speed"]["steps"], 200);
  for (const char* key : {"real_time_factor", "plant_us_per_step", "controller_us_per_step",
                          "cross_check_us_per_step", "grasp_force_us_per_solve"})
    EXPECT_GT(summary["speed"][key].get<double>(), 0.0) << key;

  const LogReader log = ReadLog();
  EXPECT_EQ(log.rows(), 200);
  EXPECT_EQ(log.ReadText("seed"), "3");
  EXPECT_THAT(log.ReadText("command"), HasSubstr("run curve --set duration=0.2"));
  EXPECT_EQ(Json::parse(log.ReadText("summary")), summary);
  const RowMatrixXd qpos = log.ReadSignal("engine/qpos");
  EXPECT_EQ(qpos.cols(), 7 + 50 + 7);
  EXPECT_NE(qpos.row(0), qpos.row(199));

  // The log alone suffices to repeat the run.
  EXPECT_THAT(Expect(0, "run --replay run").out, StartsWith("IDENTICAL: 200 "));

  // Nothing that is there is overwritten.
  const std::string before = Read("run/summary.json");
  EXPECT_TRUE(Refused("run hold --out run", {"run", "already holds files"}));
  EXPECT_EQ(Read("run/summary.json"), before);
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

TEST_F(RunCommand, WhatWasCutOffIsReportedAndComparedByItsLength) {
  Expect(0, "run hold --set duration=0.02 --set settle=0.1 --no-report --out whole");
  for (const long lost : {5, 10}) {
    const std::string cut = "cut" + std::to_string(lost);
    std::filesystem::create_directory(Path(cut));
    CopyLog(Path("whole/log.h5"), Path(cut + "/log.h5"), "", 0.0, lost);
  }
  EXPECT_THAT(Expect(0, "run --replay cut5").out, HasSubstr("cut off after 15 steps"));
  EXPECT_THAT(Run("run --replay whole").out, Not(HasSubstr("cut off")));
  EXPECT_THAT(Run("export cut5 --list").err, HasSubstr("cut off after 15 steps"));
  Expect(0, "compare cut5 cut5 --tolerance 0");
  Expect(1, "compare cut5 cut10 --tolerance 0");  // not as long
  Expect(1, "compare cut5 whole --tolerance 0");
  Expect(2, "compare whole whole --signals time --tolerance 0");  // nothing was compared
}

TEST_F(RunCommand, AWordThatIsSetReplacesTheFilesAndKeysCanBeRemoved) {
  const auto motion = [&](const Words& more, const char* note) {
    const ProgramResult result =
        Expect(0, Words("run hold --no-log --json --set duration=0.01 --set settle=0.1") + more);
    EXPECT_THAT(result.err, HasSubstr(note));
    return Json::parse(result.out)["tracking"];
  };
  // The file has a natural frequency of 20 rad/s and a damping ratio of 1: K_p = 400, K_v = 40.
  const Json as_written = motion(Words{}, "");
  for (const char* same : {"--set control.K_v=40", "--set control.K_p=400"})
    EXPECT_EQ(motion(same, "hold.toml:"), as_written) << same;
  EXPECT_NE(motion("--set control.K_v=10", ""), as_written);
  EXPECT_EQ(motion("--unset description --unset control.damping_ratio --set control.K_v=40", ""), as_written);
}

/// A log from before a check was split has a signal that nothing records any more.
TEST_F(RunCommand, AReplayLeavesOutASignalThatWasReplaced) {
  Expect(0, "run hold --set duration=0.01 --no-report --out run");
  ChangeLog(Path("run/log.h5"), [](hid_t file) {
    ASSERT_GE(H5Lmove(file, "check/grasp_cone", file, "check/grasp_force", H5P_DEFAULT, H5P_DEFAULT), 0);
    const hid_t attribute = H5Aopen(file, "signals", H5P_DEFAULT);
    const hid_t type = H5Aget_type(attribute);
    const hid_t space = H5Aget_space(attribute);
    std::vector<char*> names(static_cast<size_t>(H5Sget_simple_extent_npoints(space)));
    ASSERT_GE(H5Aread(attribute, type, names.data()), 0);
    std::string old = "check/grasp_force";
    *std::ranges::find(names, std::string_view("check/grasp_cone")) = old.data();
    ASSERT_GE(H5Awrite(attribute, type, names.data()), 0);
    H5Sclose(space);
    H5Tclose(type);
    H5Aclose(attribute);
  });
  const ProgramResult replay = Expect(0, "run --replay run");
  EXPECT_THAT(replay.out, HasSubstr("check/grasp_force"));
  EXPECT_THAT(replay.out, HasSubstr("IDENTICAL: "));
}

// The C library's mathematics without fused multiply-add has other last bits: another machine.
TEST_F(RunCommand, AReplayDistinguishesAnotherMachineFromAnotherRun) {
  Expect(0, "run hold --set duration=0.05 --set settle=0.2 --no-report --out run");
  const std::string machine = ReadLog().ReadText("machine");
  EXPECT_EQ(ReadSummary()["machine"], machine);
  EXPECT_THAT(machine, HasSubstr("; glibc 2."));
  if (machine.find(" FMA") == std::string::npos) GTEST_SKIP() << "this machine has no fused multiply-add";

  const ProgramOptions elsewhere = {.environment = {{"GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX2,-FMA"}}};
  EXPECT_THAT(Expect(0, "run --replay run").out, HasSubstr("IDENTICAL: "));
  const ProgramResult there = Expect(0, "run --replay run", elsewhere);
  EXPECT_THAT(there.out, HasSubstr("DIFFERENT MACHINE: "));
  EXPECT_THAT(there.out, HasSubstr(machine));

  // Less than rounding on the same machine is a difference; more than rounding on another one is, too.
  for (const auto& [name, change] : {std::pair("slightly", 1e-15), {"much", 1e-6}}) {
    std::filesystem::create_directory(Path(name));
    CopyLog(Path("run/log.h5"), Path(name) / "log.h5", "object/X_o", change);
    const Words replay = {"run", "--replay", name};
    EXPECT_THAT(Expect(1, replay).out, HasSubstr("DIFFERENT: object/X_o at t = 0.049 s")) << name;
    const bool much = change > 1e-9;
    EXPECT_THAT(Expect(much ? 1 : 0, replay, elsewhere).out,
                HasSubstr(much ? "Rounding alone" : "DIFFERENT MACHINE: "));
  }
}

// The geometry of a wrong model is named as the comparison of the two files names it, and no force beside it.
TEST_F(RunCommand, AModelOfAnotherGeometryIsNamed) {
  for (const auto& [scenario, change, cause] :
       {std::tuple("panda-reach", "model.chain.0.rows.4.d=0.394",
                   "joint panda_joint5: origin differs: d 0.394 in the model, 0.384 in the MJCF"),
        {"hold", "model.lengths.L_3=0.3801",
         "joint r_shoulder_pitch, joint l_shoulder_pitch: origin differs: a 0.3801 in the model, "
         "0.38 in the MJCF"}}) {
    SCOPED_TRACE(scenario);
    const Json causes =
        RunJson(1, {"run", scenario, "--set", change, "--set", "duration=0.02", "--no-log"}).at("causes");
    ASSERT_EQ(causes.size(), 1U) << causes;
    EXPECT_EQ(causes[0].at("text"), std::string(cause));
  }
}

TEST_F(RunCommand, DisagreementIsExitCodeOneAndNamesTheCause) {
  const Json summary = RunJson(1, "run paper-rest --set duration=0.3 --no-log");
  EXPECT_EQ(summary["verdict"], "disagreement");
  EXPECT_EQ(summary["attribution"]["cause"], "wheel slip");
}

TEST_F(RunCommand, FailureIsExitCodeThreeAndKeepsTheRecords) {
  Expect(3, "run paper-ramp --set duration=2 --set plant.floor_friction=0.1 --no-report --out run");
  EXPECT_EQ(ReadSummary()["verdict"], "failed");
  EXPECT_NE(ReadSummary()["failure"], "");
  EXPECT_GT(ReadLog().rows(), 300);
  EXPECT_LT(ReadLog().rows(), 2000);
}

TEST_F(RunCommand, AKilledRunLeavesAReadableLog) {
  {
    Program program(DexcheckCommand("run hold --set duration=1000 --out run"), {folder_.path()});
    for (int i = 0; i < 600; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      if (Has("run/log.h5") && ReadLog().rows() >= 200) break;
    }
    program.Signal(SIGKILL);
    program.Wait();
  }
  const LogReader log = ReadLog();
  ASSERT_GE(log.rows(), 200);
  EXPECT_TRUE(log.ReadSignal("engine/qpos").allFinite());
  Expect(0, "export run --csv - --signals time,object/X_o");
}

// The program beside a copy of the scenarios, one of them broken: the others run, and it is listed as what it
// is.
TEST_F(RunCommand, ABrokenShippedScenarioStopsNoOther) {
  const std::string shipped = "share/dexcheck/harness/shipped/scenarios/";
  std::filesystem::create_directories(Path("bin"));
  std::filesystem::create_directories(Path(shipped));
  for (const char* folder : {"controller", "mjcf"})
    std::filesystem::create_symlink(SourcePath(std::string("/") + folder),
                                    Path("share/dexcheck/" + std::string(folder)));
  const std::string program = Path("bin/dexcheck");
  std::filesystem::copy_file(ProgramPath(), program);
  Write(shipped + "hold.toml", ReadText(SourcePath("/harness/shipped/scenarios/hold.toml")));
  Write(shipped + "broken.toml", "name = [");
  const auto run = [&](const Words& arguments) { return RunProgram(Words{program, "run"} + arguments); };
  EXPECT_EQ(run("hold --set duration=0.002 --set settle=0.002 --no-check --no-log --quiet").exit_code, 0);
  EXPECT_TRUE(IsRefused(run("broken"), {"broken.toml:1"}));
  EXPECT_TRUE(IsRefused(run("brokem"), {"\"broken\"?"}));
  const ProgramResult list = run("--list");
  EXPECT_EQ(list.exit_code, 0);
  for (const char* part : {"unreadable: ", "hold ", "\n  cp "}) EXPECT_THAT(list.out, HasSubstr(part));
}

// Equations (46) to (57) are of a robot that holds an object.
TEST_F(RunCommand, AnArmsPageHasNoEquationOfThePaper) {
  Expect(0, "run panda-reach --set duration=0.02 --quiet --out run");
  const std::string page = Read("run/report.html");
  const std::string list = Run("export run --list").out;
  EXPECT_THAT(page, HasSubstr("law_torque"));
  for (const char* equation : {"(46)", "(47)", "(48)", "(53)", "(55)", "(57)"}) {
    EXPECT_THAT(page, Not(HasSubstr(equation)));
    EXPECT_THAT(list, Not(HasSubstr(equation)));
  }
}

}  // namespace
}  // namespace dexcheck::testing::run_command_test
