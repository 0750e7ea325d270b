// dexcheck consistency: exit codes, results as JSON, repeatability.

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::consistency_command_test {
namespace {

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

using ConsistencyCommand = CommandTest;

TEST_F(ConsistencyCommand, JsonHasEveryPartOfEveryCheck) {
  const ProgramResult shipped = Expect(0, "consistency --samples 20 --json -");
  EXPECT_EQ(shipped.err, "");
  const Json results = Json::parse(shipped.out);  // nothing else stands on standard output
  EXPECT_EQ(results.at("verdict"), "pass");
  EXPECT_EQ(results.at("seed"), 1);
  EXPECT_EQ(results.at("samples"), 20);
  EXPECT_EQ(results.at("samples_requested"), 20);
  EXPECT_GE(CheckSchema(results), 43U);
  for (const auto& [name, check] : results.at("checks").items()) EXPECT_EQ(check.at("pass"), true) << name;
  for (const char* name : {"link_mass", "M_bar", "C_bar", "C_bar_xi", "J", "J_dot_xi", "gravity", "friction",
                           "kinetic_energy", "angular_momentum", "M_o", "N_o"})
    EXPECT_TRUE(results.at("checks").contains(name)) << name;
  EXPECT_GE(CheckSchema(RunJson(0, {"consistency", kPandaToml, kPandaXml, "--samples", "20"})), 20U);
}

TEST_F(ConsistencyCommand, QuietPrintsTheVerdictOnly) {
  EXPECT_THAT(Expect(0, "consistency --samples 2 --quiet").out, ::testing::MatchesRegex("AGREE: [^\n]*\n"));
}

TEST_F(ConsistencyCommand, ChangedNumberIsADisagreement) {
  WriteChanged("bad.toml", ReadText(kPandaToml), "mass = 3.228604", "mass = 3.3");
  const Json results = RunJson(1, {"consistency", "bad.toml", kPandaXml, "--samples", "20"});
  EXPECT_EQ(results.at("verdict"), "disagreement");
  CheckSchema(results);
  EXPECT_FALSE(results.at("checks").at("M_bar").at("pass"));
  EXPECT_TRUE(results.at("checks").at("joint_axis").at("pass"));
  ASSERT_EQ(results.at("findings").size(), 1U);
  EXPECT_TRUE(HasFinding(results, "link_mass", "link panda_link3", 3.3, 3.228604));
}

// Any addition of the MJCF alone is a disagreement.
TEST_F(ConsistencyCommand, WhatOnlyTheMjcfHasIsADisagreement) {
  struct Addition {
    std::string text;
    const char* check;
    const char* where;
    bool is_of_joint = false;  ///< The text stands in a tendon of a joint.
  };
  for (const Addition& addition :
       {Addition{"stiffness='300'", "tendon_spring", "tendon t", true},
        {"damping='2'", "tendon_damping", "tendon t", true},
        {"frictionloss='2'", "tendon_friction", "tendon t", true},
        {"limited='true' range='0 1'", "tendon_limit", "tendon t", true},
        {"<equality><joint name='e' joint1='panda_joint2' joint2='panda_joint3'/></equality>",
         "equality_constraint", "constraint e"},
        {"<actuator><position name='p' joint='panda_joint2' kp='50'/></actuator>", "motor_bias",
         "actuator p"},
        {"<actuator><velocity name='p' joint='panda_joint2' kv='5'/></actuator>", "motor_gain", "actuator p"},
        {"<option><flag gravity='disable'/></option>", "disable_flag", "Gravity"},
        {"<option><flag override='enable'/></option>", "enable_flag", "Override"}}) {
    SCOPED_TRACE(addition.text);
    const std::string text = addition.is_of_joint
                                 ? "<tendon><fixed name='t' " + addition.text +
                                       "><joint joint='panda_joint2' coef='1'/></fixed></tendon>"
                                 : addition.text;
    WriteChanged("more.xml", ReadText(kPandaXml), "\n</mujoco>", text + "\n</mujoco>");
    const Json results = RunJson(1, {"consistency", kPandaToml, "more.xml", "--samples", "2"});
    EXPECT_TRUE(HasFinding(results, addition.check, addition.where));
  }
}

TEST_F(ConsistencyCommand, SeedDecidesTheStates) {
  const auto run = [&](const std::string& seed) {
    Json results = RunJson(0, {"consistency", kPandaToml, kPandaXml, "--samples", "50", "--seed", seed});
    EXPECT_EQ(results.erase("seconds"), 1U);
    return results;
  };
  const Json once = run("7");
  EXPECT_EQ(once, run("7"));
  EXPECT_NE(once.at("checks"), run("8").at("checks"));
  EXPECT_EQ(run("18446744073709551615").at("seed"), 18446744073709551615U);
}

}  // namespace
}  // namespace dexcheck::testing::consistency_command_test
