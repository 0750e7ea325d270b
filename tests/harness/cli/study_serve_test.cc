// dexcheck study serve: points of another program's optimiser, Optuna's among them.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/harness/cli/study_command.h"

namespace dexcheck::testing::study_serve_test {
namespace {

using ::testing::HasSubstr;

const std::string kExternal = R"(name = "tiny"
scenario = "offset"
set = ["duration=0.02", "settle=0.3", "start_error.xyz=[1e-6, 0, 0]"]
[search]
method = "external"
count = 12
[[objective]]
minimize = "position_error_rms"
[[vary]]
key = "control.K_p"
from = 100
to = 1e4
[[vary]]
key = "control.K_v"
from = 20
to = 1500
)";

class StudyServe : public StudyCommand {
 protected:
  StudyServe() { WriteText(folder_.path() / "tiny.toml", kExternal); }

  /// What the server answers to these lines, line by line.
  [[nodiscard]] std::vector<nlohmann::json> Serve(const std::string& lines,
                                                  const std::string& database) const {
    WriteText(folder_.path() / "lines.txt", lines);
    const ProgramResult result =
        RunProgram({"sh", "-c", "\"$0\" study serve \"$1\" --db \"$2\" --jobs 2 < \"$3\"", ProgramPath(),
                    Path("tiny.toml"), Path(database), Path("lines.txt")});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<nlohmann::json> answers;
    std::istringstream out(result.out);
    for (std::string line; std::getline(out, line);) answers.push_back(nlohmann::json::parse(line));
    return answers;
  }
};

TEST_F(StudyServe, AnswersPointsAndGoesOnFromItsRows) {
  const std::string lines = "[[400, 40], [5000, 141.4]]\n[[400, 4000]]\nnonsense\n[[1e4, 200]]\n";
  const auto answers = Serve(lines, "a.sqlite");
  ASSERT_EQ(answers.size(), 4U);
  ASSERT_EQ(answers[0].size(), 2U);
  EXPECT_EQ(answers[0][1]["point"], 1);
  EXPECT_EQ(answers[0][1]["feasible"], true);
  const std::vector<TrialRow> rows = StudyStore::Open(Path("a.sqlite")).ReadRows();
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(answers[0][1]["objectives"][0].get<double>(), rows[1].result.metrics[kPositionErrorRms]);
  EXPECT_THAT(answers[1]["error"].get<std::string>(),
              HasSubstr("control.K_v: must be from 20 to 1500, got 4000"));
  EXPECT_THAT(answers[2]["error"].get<std::string>(), HasSubstr("must be a JSON list of points"));
  EXPECT_EQ(answers[3][0]["point"], 2) << "lines that were refused are no points";
  const std::string before = Dump(Path("a.sqlite"));
  EXPECT_EQ(Serve(lines, "a.sqlite"), answers);
  EXPECT_EQ(Dump(Path("a.sqlite")), before) << "nothing was made again";
  EXPECT_TRUE(IsRefused(RunDexcheck(RunArguments("a.sqlite")), {"the points come from another program"}));
}

// Optuna asks, the study tells.
TEST_F(StudyServe, OptunaFindsBetterGainsThroughIt) {
  const std::string script = R"(
import json, optuna, subprocess, sys
optuna.logging.set_verbosity(optuna.logging.ERROR)
server = subprocess.Popen(sys.argv[1:], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=1, n_startup_trials=6))
for _ in range(12):
    trial = study.ask()
    point = [trial.suggest_float("K_p", 100, 1e4, log=True), trial.suggest_float("K_v", 20, 1500, log=True)]
    server.stdin.write(json.dumps([point]) + "\n")
    server.stdin.flush()
    study.tell(trial, json.loads(server.stdout.readline())[0]["objectives"][0])
server.stdin.close()
print(server.wait(), study.best_value, study.trials[0].value)
)";
  const ProgramResult result =
      RunProgram({"/usr/bin/python3", "-W", "ignore", "-c", script, ProgramPath(), "study", "serve",
                  Path("tiny.toml"), "--db", Path("b.sqlite"), "--jobs", "1"});
  if (result.err.find("No module named 'optuna'") != std::string::npos) GTEST_SKIP() << "no Optuna here";
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::istringstream numbers(result.out);
  int exit_code = -1;
  double best = 0.0;
  double first = 0.0;
  numbers >> exit_code >> best >> first;
  EXPECT_EQ(exit_code, 0);
  EXPECT_LT(best, first);
  const std::vector<TrialRow> rows = StudyStore::Open(Path("b.sqlite")).ReadRows();
  ASSERT_EQ(rows.size(), 12U);
  EXPECT_EQ(rows[0].result.metrics[kPositionErrorRms], first);
}

}  // namespace
}  // namespace dexcheck::testing::study_serve_test
