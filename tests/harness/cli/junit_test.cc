// --junit: what continuous-integration servers read.

#include <tinyxml2.h>

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

class JUnit : public CommandTest {
 protected:
  [[nodiscard]] JUnitFile RunForJUnit(const Words& arguments, int exit_code) const {
    Expect(exit_code, arguments + "--junit junit.xml --quiet");
    return JUnitFile(Path("junit.xml"));
  }
};

TEST_F(JUnit, OfAComparison) {
  const JUnitFile good = RunForJUnit({"consistency", kPandaToml, kPandaXml, "--samples", "20"}, 0);
  EXPECT_GT(good.cases.size(), 20U);
  EXPECT_THAT(good.cases, Contains("dexcheck.consistency.panda.term M_bar"));
  EXPECT_THAT(good.failures, IsEmpty());

  WriteChanged("bad <&>.toml", ReadText(kPandaToml), "3.228604", "3.3");
  const JUnitFile bad = RunForJUnit({"consistency", "bad <&>.toml", kPandaXml, "--samples", "20"}, 1);
  EXPECT_EQ(bad.cases.size(), good.cases.size() + 1);  // the cause
  EXPECT_THAT(bad.failures, Contains(AllOf(StartsWith("dexcheck.consistency.bad <&>.constant link_mass: "),
                                           HasSubstr("link panda_link3"))));
}

TEST_F(JUnit, OfAnAudit) {
  const std::string path = SourcePath("/harness/descriptions/examples/arm.urdf");
  EXPECT_THAT(RunForJUnit({"audit", path}, 0).failures, IsEmpty());
  WriteChanged("arm.urdf", ReadText(path), "izz=\"0.008\"", "izz=\"0.8\"");
  const JUnitFile bad = RunForJUnit("audit arm.urdf", 1);
  EXPECT_THAT(bad.failures, Contains(StartsWith("dexcheck.audit.arm.audit inertia: ")));
  EXPECT_GE(bad.cases.size(), 9U);
}

TEST_F(JUnit, OfARun) {
  const JUnitFile good = RunForJUnit("run paper --set duration=0.05 --no-log", 0);
  EXPECT_THAT(good.cases, Contains("dexcheck.run.paper.forward_dynamics constraint_force"));
  EXPECT_THAT(good.failures, IsEmpty());
  const JUnitFile bad =
      RunForJUnit("run paper --set duration=0.05 --set model.gravity=[0,0,-9.8] --no-log", 1);
  EXPECT_THAT(bad.failures, Contains(HasSubstr("cause: model")));
}

}  // namespace
}  // namespace dexcheck::testing::junit_test
