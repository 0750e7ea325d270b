// dexcheck consistency: exit codes, results as JSON, repeatability, interruption.

#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::consistency_command_test {
namespace {

using Json = nlohmann::json;

std::vector<std::string> Join(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// Every check has all of its parts, each of the right type; returns how many checks there are.
size_t CheckSchema(const Json& results) {
  for (const char* key :
       {"robot", "mjcf", "mujoco", "samples", "samples_requested", "seed", "seconds", "verdict"}) {
    EXPECT_TRUE(results.contains(key)) << key;
  }
  EXPECT_EQ(results.at("mujoco"), "2.2.2");
  EXPECT_TRUE(results.at("findings").is_array());
  EXPECT_FALSE(results.at("engine_notes").empty());
  for (const Json& note : results.at("engine_notes"))
    EXPECT_TRUE(note.contains("kind") && note.contains("text"));
  for (const auto& [name, check] : results.at("checks").items()) {
    SCOPED_TRACE(name);
    EXPECT_EQ(check.at("kind"), "model");
    EXPECT_TRUE(check.at("pass").is_boolean());
    EXPECT_TRUE(check.at("where").is_string());
    EXPECT_NE(check.at("where"), "");
    EXPECT_TRUE(check.at("sample").is_number_integer());
    EXPECT_GT(check.at("compared"), 0);
    EXPECT_GT(check.at("bound"), 0.0);
    EXPECT_LT(check.at("bound"), 1e-11);
    for (const char* key : {"max", "model", "engine"}) EXPECT_TRUE(check.at(key).is_number()) << key;
    EXPECT_EQ(check.at("pass").get<bool>(), check.at("max") <= check.at("bound"));
    EXPECT_EQ(check.contains("first_failure"), !check.at("pass").get<bool>());
  }
  return results.at("checks").size();
}

TEST(ConsistencyCommand, ShippedRobotAgrees) {
  const ProgramResult result = RunDexcheck({"consistency", "--samples", "20"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("20 random states (seed 1)"));
  EXPECT_THAT(result.out, HasSubstr("\nAGREE: "));
  EXPECT_THAT(result.out, ::testing::Not(HasSubstr("DIFFERS")));
}

TEST(ConsistencyCommand, QuietPrintsTheVerdictOnly) {
  const ProgramResult result = RunDexcheck({"consistency", "--samples", "2", "--quiet"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, ::testing::MatchesRegex("AGREE: [^\n]*\n"));
}

TEST(ConsistencyCommand, JsonHasEveryPartOfEveryCheck) {
  const ProgramResult shipped = RunDexcheck({"consistency", "--samples", "20", "--json", "-"});
  ASSERT_EQ(shipped.exit_code, 0);
  const Json results = Json::parse(shipped.out);  // nothing else stands on standard output
  EXPECT_EQ(results.at("verdict"), "pass");
  EXPECT_EQ(results.at("samples"), 20);
  EXPECT_EQ(results.at("samples_requested"), 20);
  EXPECT_GE(CheckSchema(results), 43U);
  for (const char* name : {"link_mass", "M_bar", "C_bar", "C_bar_xi", "J", "J_dot_xi", "gravity", "friction",
                           "kinetic_energy", "angular_momentum", "M_o", "N_o"}) {
    EXPECT_TRUE(results.at("checks").contains(name)) << name;
  }

  const ProgramResult panda =
      RunDexcheck(Join({"consistency", "--samples", "20", "--json", "-"}, testing::kPandaFiles));
  ASSERT_EQ(panda.exit_code, 0);
  EXPECT_GE(CheckSchema(Json::parse(panda.out)), 20U);
}

TEST(ConsistencyCommand, ChangedNumberIsADisagreement) {
  const TempFolder folder;
  const std::string panda = ReadText(testing::kParameters + "panda.toml");
  WriteText(folder.path() / "bad.toml", ReplaceOnce(panda, "mass = 3.228604", "mass = 3.3"));
  const ProgramResult result = RunDexcheck({"consistency", "--samples", "20", "--robot", "bad.toml", "--mjcf",
                                            testing::kMjcf + "panda.xml", "--json", "out.json"},
                                           {folder.path()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("\nDISAGREE: link_mass: link panda_link3: 3.3 in bad.toml, 3.228604 in"));
  EXPECT_THAT(result.out, HasSubstr("  gravity: nearest the base: panda_joint2;"));

  const Json results = Json::parse(ReadText(folder.path() / "out.json"));
  EXPECT_EQ(results.at("verdict"), "disagreement");
  CheckSchema(results);
  EXPECT_FALSE(results.at("checks").at("M_bar").at("pass"));
  EXPECT_TRUE(results.at("checks").at("joint_axis").at("pass"));
  ASSERT_EQ(results.at("findings").size(), 1U);
  const Json finding = results.at("findings").front();
  EXPECT_EQ(finding.at("check"), "link_mass");
  EXPECT_EQ(finding.at("where"), "link panda_link3");
  EXPECT_EQ(finding.at("model"), 3.3);
  EXPECT_EQ(finding.at("engine"), 3.228604);
}

// What only the MJCF has is a disagreement, whatever it is.
TEST(ConsistencyCommand, WhatOnlyTheMjcfHasIsADisagreement) {
  struct Addition {
    const char* text;
    const char* finding;
  };
  for (const Addition& addition : {
           Addition{"<tendon><fixed name='t' stiffness='300'><joint joint='panda_joint2' "
                    "coef='1'/></fixed></tendon>",
                    "tendon_spring: tendon t: 0 in panda.toml, 300 in "},
           {"<tendon><fixed name='t' damping='2'><joint joint='panda_joint2' coef='1'/></fixed></tendon>",
            "tendon_damping: tendon t: "},
           {"<tendon><fixed name='t' frictionloss='2'><joint joint='panda_joint2' "
            "coef='1'/></fixed></tendon>",
            "tendon_friction: tendon t: "},
           {"<tendon><fixed name='t' limited='true' range='0 1'><joint joint='panda_joint2' "
            "coef='1'/></fixed></tendon>",
            "tendon_limit: tendon t: "},
           {"<equality><joint name='e' joint1='panda_joint2' joint2='panda_joint3'/></equality>",
            "equality_constraint: constraint e: "},
           {"<actuator><position name='p' joint='panda_joint2' kp='50'/></actuator>",
            "motor_bias: actuator p: "},
           {"<actuator><velocity name='p' joint='panda_joint2' kv='5'/></actuator>",
            "motor_gain: actuator p: "},
           {"<option><flag gravity='disable'/></option>", "disable_flag: Gravity: "},
           {"<option><flag override='enable'/></option>", "enable_flag: Override: "},
       }) {
    const TempFolder folder;
    std::string text = ReadText(testing::kMjcf + "panda.xml");
    const std::string end = "</mujoco>";
    text.replace(text.rfind(end), end.size(), addition.text + end);
    WriteText(folder.path() / "more.xml", text);
    const ProgramResult result =
        RunDexcheck({"consistency", "--samples", "2", "--robot", testing::kParameters + "panda.toml",
                     "--mjcf", (folder.path() / "more.xml").string()});
    EXPECT_EQ(result.exit_code, 1) << addition.text << result.err;
    EXPECT_THAT(result.out, HasSubstr(addition.finding));
  }
}

TEST(ConsistencyCommand, SeedDecidesTheStates) {
  const auto run = [](const std::string& seed) {
    const ProgramResult result = RunDexcheck(
        Join({"consistency", "--samples", "50", "--seed", seed, "--json", "-"}, testing::kPandaFiles));
    EXPECT_EQ(result.exit_code, 0);
    Json results = Json::parse(result.out);
    EXPECT_EQ(results.erase("seconds"), 1U);
    return results;
  };
  const Json once = run("7");
  EXPECT_EQ(once, run("7"));
  EXPECT_NE(once.at("checks"), run("8").at("checks"));
  EXPECT_EQ(run("18446744073709551615").at("seed"), 18446744073709551615U);
}

class Interruption : public ::testing::TestWithParam<int> {};

// The program makes its output file once it listens to signals.
bool WaitForFile(const std::filesystem::path& folder) {
  for (int attempt = 0; attempt < 3000; ++attempt) {
    if (!std::filesystem::is_empty(folder)) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

TEST_P(Interruption, EndsWithWhatWasDone) {
  const TempFolder folder;
  testing::Program program(DexcheckCommand({"consistency", "--samples", "1000000000", "--json", "out.json"}),
                           {folder.path()});
  ASSERT_TRUE(WaitForFile(folder.path()));
  program.Signal(GetParam());
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr(" of 1000000000 states were compared\n"));
  EXPECT_THAT(result.out, HasSubstr("INTERRUPTED after "));
  EXPECT_THAT(result.out, HasSubstr(" of 1000000000 samples. So far:\nAGREE: "));

  const Json results = Json::parse(ReadText(folder.path() / "out.json"));
  CheckSchema(results);
  EXPECT_EQ(results.at("verdict"), "failed");
  EXPECT_GT(results.at("samples"), 0);
  EXPECT_LT(results.at("samples"), results.at("samples_requested"));
  const auto files = std::filesystem::directory_iterator(folder.path());
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
}

INSTANTIATE_TEST_SUITE_P(Signals, Interruption, ::testing::Values(SIGINT, SIGTERM),
                         [](const auto& info) { return info.param == SIGINT ? "SigInt" : "SigTerm"; });

}  // namespace
}  // namespace dexcheck::testing::consistency_command_test
