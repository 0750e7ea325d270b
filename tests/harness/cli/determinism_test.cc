// Same inputs, same bytes: again, and on one processor or all.

#include "harness/log/log_reader.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::determinism_test {
namespace {

/// The program on the machine's first processor only.
std::vector<std::string> OnOneProcessor(std::vector<std::string> command) {
  command.insert(command.begin(), {"taskset", "--cpu-list", "0"});
  return command;
}

/// Every number of every signal, bit by bit, and every text but the command and the summary, which has times
/// of the clock.
std::string ListLog(const std::filesystem::path& path) {
  const LogReader log(path);
  std::string all;
  for (const SignalInfo& signal : log.signals()) {
    const RowMatrixXd values = log.ReadSignal(signal.name);
    all += signal.name + " " + signal.unit + " " + signal.description;
    all.append(reinterpret_cast<const char*>(values.data()),
               static_cast<size_t>(values.size()) * sizeof(double));
  }
  for (const std::string& text : log.ListTexts()) {
    if (text != "command" && text != "summary") all += text + "=" + log.ReadText(text);
  }
  for (const std::string& file : log.ListFiles("inputs")) all += file + "=" + log.ReadFile("inputs", file);
  return all;
}

Json WithoutClock(Json json) {
  json.erase("seconds");
  json.erase("speed");
  return json;
}

class Determinism : public CommandTest {
 protected:
  /// Runs dexcheck, on one processor alone or on all.
  ProgramResult RunOn(bool alone, const Words& arguments) const {
    std::vector<std::string> command = DexcheckCommand(arguments);
    if (alone) command = OnOneProcessor(command);
    const ProgramResult result = RunProgram(command, {.folder = folder_.path()});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result;
  }
};

TEST_F(Determinism, RunsGiveTheSameLog) {
  const auto run = [&](const std::string& name, const char* seed, bool alone) {
    RunOn(alone, Words("run curve --set duration=0.3 --no-report") + Words{"--seed", seed, "--out", name});
    return ListLog(Path(name + "/log.h5"));
  };
  const auto summary = [&](const std::string& name) {
    return WithoutClock(ReadJson(name + "/summary.json"));
  };
  const std::string first = run("first", "3", false);
  ASSERT_GT(first.size(), 300U * 8 * 100);
  EXPECT_TRUE(run("again", "3", false) == first);
  EXPECT_TRUE(run("alone", "3", true) == first);
  EXPECT_FALSE(run("other", "4", false) == first);
  EXPECT_EQ(summary("first"), summary("alone"));
  EXPECT_NE(summary("first"), summary("other"));
}

TEST_F(Determinism, ComparisonsGiveTheSameNumbers) {
  const auto compare = [&](const char* seed, bool alone) {
    return WithoutClock(
        Json::parse(RunOn(alone, Words("consistency --samples 50 --json - --seed") + Words{seed}).out));
  };
  const Json first = compare("5", false);
  EXPECT_EQ(compare("5", false), first);
  EXPECT_EQ(compare("5", true), first);
  EXPECT_NE(compare("6", false), first);
}

}  // namespace
}  // namespace dexcheck::testing::determinism_test
