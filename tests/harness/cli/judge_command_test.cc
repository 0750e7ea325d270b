// judge and compare of recordings as a user types them: exit codes, JSON, one line for what is wrong.

#include <cmath>
#include <sstream>

#include "tests/common/refused_text.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::judge_command_test {
namespace {

using ::testing::HasSubstr;

class JudgeCommand : public CommandTest {
 protected:
  JudgeCommand() {
    Expect(0, Words{"run", "panda-reach", "--no-report", "--quiet", "--out", "run"});
    Expect(0, Words{"export", "run", "--csv", "right.csv", "--signals", "time,q,xi,tau"});
    WriteFaulty();
  }

  /// Dry friction of 0.5 N m in joint 4.
  void WriteFaulty() const {
    std::istringstream lines(Read("right.csv"));
    std::ostringstream faulty;
    std::string line;
    std::getline(lines, line);
    const Words names = Split(line);
    faulty << line << "\n";
    const auto find = [&](const std::string& name) {
      return static_cast<size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    };
    const size_t rate = find("xi.panda_joint4 [rad/s]"), torque = find("tau.panda_joint4 [N m]");
    while (std::getline(lines, line)) {
      Words cells = Split(line);
      const double direction = std::copysign(1.0, std::stod(cells.at(rate)));
      std::ostringstream changed;
      changed.precision(17);
      changed << std::stod(cells.at(torque)) + 0.5 * direction;
      cells[torque] = changed.str();
      for (size_t i = 0; i < cells.size(); ++i) faulty << (i == 0 ? "" : ",") << cells[i];
      faulty << "\n";
    }
    Write("faulty.csv", faulty.str());
  }
  static Words Split(const std::string& line) {
    Words cells({});
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    return cells;
  }
  [[nodiscard]] static Words With(const std::string& command, const std::string& rest) {
    return Words{command, SourcePath("/controller/parameters/panda.toml")} + Words(rest);
  }
};

TEST_F(JudgeCommand, ExplainsWhatTheModelDoes) {
  for (const char* recording : {"right.csv", "run", "run/log.h5"}) {
    const Json json = Json::parse(Expect(0, With("judge", std::string(recording) + " --json")).out);
    EXPECT_EQ(json["verdict"], "explained");
    EXPECT_TRUE(json["causes"].empty());
    EXPECT_EQ(json["joints"].size(), 7U);
  }
}

TEST_F(JudgeCommand, NamesWhatIsMissingAndWritesIt) {
  const Json json = Json::parse(Expect(1, With("judge", "faulty.csv --json --write right.toml")).out);
  ASSERT_EQ(json["causes"].size(), 1U);
  const Json& fault = json["causes"][0]["faults"][0];
  EXPECT_EQ(fault["fault"], "dry friction");
  EXPECT_EQ(fault["place"], "joint panda_joint4");
  EXPECT_NEAR(fault["value"], 0.5, 0.01);
  EXPECT_LT(fault["standard_error"], 0.01);
  EXPECT_EQ(json["causes"][0]["outcome"], "named");
  EXPECT_TRUE(json["causes"][0]["from_s"].is_null()) << "it holds always";
  EXPECT_EQ(json["held_out"]["causes"]["numbers"], 1);
  EXPECT_GT(json["held_out"]["all"]["numbers"], 50);
  Expect(0, "judge right.toml faulty.csv --quiet");
  EXPECT_THAT(Read("right.toml"), HasSubstr("# The Franka Emika Panda arm")) << "comments stay";
}

TEST_F(JudgeCommand, ReadsStandardInputAsItComes) {
  const std::string model = SourcePath("/controller/parameters/panda.toml");
  const ProgramResult result =
      RunProgram({"sh", "-c", "'" + ProgramPath() + "' judge '" + model + "' - < faulty.csv"},
                 {.folder = folder_.path()});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr("what the model does not explain, rms by second"));
  EXPECT_THAT(result.out, HasSubstr("joint panda_joint4: dry friction 0.49999"));
}

TEST_F(JudgeCommand, ReadsAPipeFromItsFirstByte) {
  const std::string model = SourcePath("/controller/parameters/panda.toml");
  const ProgramResult result = RunProgram(
      {"sh", "-c",
       "mkfifo pipe; cat right.csv > pipe & '" + ProgramPath() + "' judge '" + model + "' pipe --json; wait"},
      {.folder = folder_.path()});
  const std::string text = Read("right.csv");
  EXPECT_EQ(Json::parse(result.out)["rows"], std::count(text.begin(), text.end(), '\n') - 1);
}

TEST_F(JudgeCommand, ExplainsAnExportOfAllSignals) {
  Expect(0, Words{"export", "run", "--csv", "all.csv"});
  EXPECT_THAT(Read("all.csv"), HasSubstr(" [1]"));
  const Json json = Json::parse(Expect(0, With("judge", "all.csv --json")).out);
  EXPECT_EQ(json["verdict"], "explained");
  EXPECT_EQ(json["joints"].size(), 7U);
}

TEST_F(JudgeCommand, SaysWhatIsNotJudged) {
  std::string text = Read("right.csv");
  const std::string column = "tau.panda_joint4 [N m]";
  text.replace(text.find(column), column.size(), "temperature");
  Write("partly.csv", text);
  const ProgramResult result = Run(With("judge", "partly.csv"));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("PARTLY EXPLAINED: "));
  EXPECT_THAT(result.out, HasSubstr("not judged: panda_joint4 (no torque of it is recorded"));
  const Json json = Json::parse(Run(With("judge", "partly.csv --json --page judge.html")).out);
  EXPECT_EQ(json["verdict"], "partly explained");
  EXPECT_EQ(json["not_judged"][0]["joint"], "panda_joint4");
  EXPECT_THAT(Read("judge.html"), HasSubstr(json["verdict_text"].get<std::string>().substr(0, 40)));
}

TEST_F(JudgeCommand, DescribesColumnsAsAFileThatReadsThem) {
  Write("columns.toml", Expect(0, With("judge", "right.csv --describe")).out);
  Expect(0, With("judge", "right.csv --columns columns.toml --quiet"));
  EXPECT_THAT(Expect(0, "judge right.csv --describe").out, HasSubstr("# CSV: 22 columns"));
}

TEST_F(JudgeCommand, ComparesTwoRecordings) {
  const Words model = {"--model", SourcePath("/controller/parameters/panda.toml")};
  Expect(0, Words("compare right.csv right.csv") + model);
  const Json json = Json::parse(Expect(1, Words("compare right.csv faulty.csv --json") + model).out);
  EXPECT_TRUE(json["same_motion"]);
  ASSERT_EQ(json["causes"].size(), 1U);
  EXPECT_EQ(json["causes"][0]["second"]["place"], "joint panda_joint4");
}

TEST_F(JudgeCommand, MakesAMotionToRecordThatTheModelExplains) {
  const std::string panda = SourcePath("/mjcf/panda.xml");
  const Words excite = Words{"excite", "--model", panda, "--motions", "100"};
  const Json json = Json::parse(Expect(0, excite + Words("--out motion.csv --duration 8 --json")).out);
  EXPECT_EQ(json["motions"], 100);
  EXPECT_GT(json["known_after"], json["known_before"]);
  const std::string motion = Read("motion.csv");
  EXPECT_EQ(std::count(motion.begin(), motion.end(), '\n'), 802);
  EXPECT_EQ(Json::parse(Expect(0, Words{"judge", panda} + Words("motion.csv --json")).out)["verdict"],
            "explained");

  Write("limits.toml", "[joints.elbow]\nvelocity = 1\n");
  for (const auto& [words, parts] : std::initializer_list<std::pair<Words, std::vector<std::string>>>{
           {excite + Words("--limits limits.toml"), {"limits.toml:1", "joints.elbow", "is no joint of"}},
           {excite + Words("--limits none.toml"), {"none.toml", "cannot be read"}},
           {excite + Words("--duration 1e9"), {"--duration", "1e9"}},
           {excite + Words{"--mjcf", SourcePath("/mjcf/torus.xml")}, {"torus.xml", "panda_joint1"}}})
    EXPECT_TRUE(IsOneLineWith(Expect(2, words).err, parts));
}

}  // namespace
}  // namespace dexcheck::testing::judge_command_test
