// --junit: what continuous-integration servers read.

#include <gmock/gmock.h>
#include <tinyxml2.h>

#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::junit_test {
namespace {

/// The test cases of a JUnit file, whose counts must be those that it states.
struct JUnitFile {
  explicit JUnitFile(const std::filesystem::path& path) {
    tinyxml2::XMLDocument document;
    EXPECT_EQ(document.LoadFile(path.c_str()), tinyxml2::XML_SUCCESS) << path;
    const tinyxml2::XMLElement* suite = document.RootElement()->FirstChildElement("testsuite");
    for (const auto* test = suite->FirstChildElement("testcase"); test != nullptr;
         test = test->NextSiblingElement("testcase")) {
      const std::string name = std::string(test->Attribute("classname")) + " " + test->Attribute("name");
      cases.push_back(name);
      const tinyxml2::XMLElement* failure = test->FirstChildElement("failure");
      if (failure != nullptr) failures.push_back(name + ": " + failure->Attribute("message"));
      if (test->FirstChildElement("error") != nullptr) {
        errors.emplace_back(test->FirstChildElement("error")->Attribute("message"));
      }
    }
    EXPECT_EQ(suite->IntAttribute("tests"), static_cast<int>(cases.size()));
    EXPECT_EQ(suite->IntAttribute("failures"), static_cast<int>(failures.size()));
    EXPECT_EQ(suite->IntAttribute("errors"), static_cast<int>(errors.size()));
  }

  std::vector<std::string> cases, failures, errors;
};

class JUnit : public ::testing::Test {
 protected:
  [[nodiscard]] JUnitFile Run(std::vector<std::string> arguments, int exit_code) const {
    arguments.insert(arguments.end(), {"--junit", "junit.xml", "--quiet"});
    const testing::ProgramResult result = RunDexcheck(arguments, {folder_.path()});
    EXPECT_EQ(result.exit_code, exit_code) << result.err << result.out;
    return JUnitFile(folder_.path() / "junit.xml");
  }
  /// Writes a file into the folder that differs from another in one place.
  void Spoil(const std::string& original, const std::string& right, const std::string& wrong,
             const std::string& name) const {
    testing::WriteText(folder_.path() / name,
                       testing::ReplaceOnce(testing::ReadText(original), right, wrong));
  }

  testing::TempFolder folder_;
  std::string toml_ = testing::kParameters + "panda.toml";
  std::string mjcf_ = testing::kMjcf + "panda.xml";
};

TEST_F(JUnit, OfAComparison) {
  const JUnitFile good = Run({"consistency", toml_, mjcf_, "--samples", "20"}, 0);
  EXPECT_GT(good.cases.size(), 20U);
  EXPECT_THAT(good.cases, ::testing::Contains("dexcheck.consistency.panda.term M_bar"));
  EXPECT_THAT(good.failures, ::testing::IsEmpty());

  Spoil(toml_, "3.228604", "3.3", "bad <&>.toml");
  const JUnitFile bad = Run({"consistency", "bad <&>.toml", mjcf_, "--samples", "20"}, 1);
  EXPECT_EQ(bad.cases.size(), good.cases.size());
  EXPECT_THAT(bad.failures,
              ::testing::Contains(HasSubstr("dexcheck.consistency.bad <&>.constant link_mass: worst ")));
  EXPECT_THAT(bad.failures, ::testing::Contains(HasSubstr("link panda_link3")));
}

TEST_F(JUnit, OfAnAudit) {
  const std::string path = testing::SourcePath("/harness/descriptions/examples/arm.urdf");
  EXPECT_THAT(Run({"audit", path}, 0).failures, ::testing::IsEmpty());
  Spoil(path, "izz=\"0.008\"", "izz=\"0.8\"", "arm.urdf");
  const JUnitFile bad = Run({"audit", "arm.urdf"}, 1);
  EXPECT_THAT(bad.failures, ::testing::Contains(HasSubstr("dexcheck.audit.arm.audit inertia: ")));
  EXPECT_GE(bad.cases.size(), 9U);
}

TEST_F(JUnit, OfARun) {
  const JUnitFile good = Run({"run", "paper", "--set", "duration=0.05", "--no-log"}, 0);
  EXPECT_THAT(good.cases, ::testing::Contains("dexcheck.run.paper.forward_dynamics contact_force"));
  EXPECT_THAT(good.failures, ::testing::IsEmpty());
  const JUnitFile bad =
      Run({"run", "paper", "--set", "duration=0.05", "--set", "model.gravity=[0,0,-9.8]", "--no-log"}, 1);
  EXPECT_THAT(bad.failures, ::testing::Contains(HasSubstr("run verdict: cause: model")));
}

TEST_F(JUnit, ABadPathIsRefusedBeforeTheWork) {
  for (const std::vector<std::string>& command : {std::vector<std::string>{"consistency", toml_, mjcf_},
                                                  {"audit", mjcf_},
                                                  {"run", "paper", "--no-log"}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {"--junit", "no/such/folder.xml"});
    EXPECT_TRUE(testing::IsRefused(RunDexcheck(arguments, {folder_.path()}), {"no/such/folder.xml"}));
  }
}

}  // namespace
}  // namespace dexcheck::testing::junit_test
