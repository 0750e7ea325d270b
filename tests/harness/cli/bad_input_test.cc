// Input that cannot be used: one line that names file, key and value; exit code 2; no file written or harmed.

#include <ostream>

#include "tests/common/paths.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::bad_input_test {
namespace {

/// Replaces one place in one file.
struct Edit {
  std::string from;
  std::string to;
};

struct BadInput {
  const char* name;
  std::vector<Edit> toml = {};
  std::vector<Edit> mjcf = {};
  std::vector<std::string> parts;  ///< What the line must name: file, key and value.
};

void PrintTo(const BadInput& bad, std::ostream* stream) { *stream << bad.name; }
std::string PrintName(const ::testing::TestParamInfo<BadInput>& info) { return info.param.name; }

std::string Apply(std::string text, const std::vector<Edit>& edits) {
  for (const Edit& edit : edits) text = ReplaceOnce(text, edit.from, edit.to);
  return text;
}

class BadInputTest : public ::testing::TestWithParam<BadInput> {
 protected:
  /// Runs `consistency` in the folder on robot.toml and robot.xml, with results meant for out.json.
  testing::ProgramResult RunConsistency() {
    return RunDexcheck({"consistency", "--samples", "5", "--robot", "robot.toml", "--mjcf", "robot.xml",
                        "--json", "out.json"},
                       {folder_.path()});
  }

  TempFolder folder_;
};

TEST_P(BadInputTest, IsRefusedInOneLine) {
  WriteText(folder_.path() / "robot.toml", Apply(testing::kTwoLinksToml, GetParam().toml));
  WriteText(folder_.path() / "robot.xml", Apply(testing::kTwoLinksMjcf, GetParam().mjcf));
  const std::string before = "what stood here before";
  WriteText(folder_.path() / "out.json", before);
  EXPECT_TRUE(IsRefused(RunConsistency(), GetParam().parts));
  EXPECT_EQ(ReadText(folder_.path() / "out.json"), before);
  const auto files = std::filesystem::directory_iterator(folder_.path());
  EXPECT_EQ(std::distance(begin(files), end(files)), 3) << "a file was left behind";
}

INSTANTIATE_TEST_SUITE_P(
    Parameters, BadInputTest,
    ::testing::ValuesIn(std::vector<BadInput>{
        {"MissingKey",
         {{"damping = 0.05, ", ""}},
         {},
         {"robot.toml:17: ", "chain[0].joints.elbow", "missing key \"damping\""}},
        {"MisspeltKey",
         {{"gravity", "gravty"}},
         {},
         {"robot.toml:2: ", "gravty", "did you mean \"gravity\"?"}},
        {"NegativeMass",
         {{"mass = 1.5", "mass = -1.5"}},
         {},
         {"robot.toml:19: ", "links.upper.mass", "got -1.5"}},
        {"Infinite",
         {{"d = 0.1 ", "d = inf "}},
         {},
         {"robot.toml:11: ", "chain[0].rows[0].d", "must be finite, got inf"}},
        {"NotANumber",
         {{"0.0, -9.81", "nan, -9.81"}},
         {},
         {"robot.toml:2: ", "gravity[1]", "must be finite, got nan"}},
        {"DivisionByZero",
         {{"a = 0.3", "a = \"1 / 0\""}},
         {},
         {"robot.toml:12: ", "chain[0].rows[1].a", "1 / 0"}},
        {"TextForNumber",
         {{"a = 0.3", "a = \"long\""}},
         {},
         {"robot.toml:12: ", "chain[0].rows[1].a", "\"long\""}},
        {"CyclicParents",
         {{"parent = \"stand\"", "parent = \"lower\""}},
         {},
         {"robot.toml:9: ", "chain[0].parent", "cyclic", "got \"lower\""}},
        {"Range",
         {{"[-2.0, 2.0]", "[2.0, -2.0]"}},
         {},
         {"robot.toml:16: ", "joints.shoulder.range", "got [2, -2]"}},
        {"Syntax", {{"name = \"two links\"", "name = two links"}}, {}, {"robot.toml:1: ", "syntax error"}},
        {"Empty",
         {{testing::kTwoLinksToml, ""}},
         {},
         {"robot.toml:1: ", "missing key \"name\", \"gravity\", \"base\""}},
        {"Binary", {{"two links", std::string("\x01\xff\n\0", 4)}}, {}, {"robot.toml:1: ", "syntax error"}},
        {"JointMissing",
         {{"  { joint = \"elbow\", link = \"lower\", alpha_deg = -90, a = 0.3, q = 0, d = 0 },\n", ""},
          {"elbow = { range = [-1.0, 1.0], damping = 0.05, armature = 0.02 }\n", ""},
          {"lower = { mass = 0.8, com = [0.1, 0.0, 0.0], inertia = [0.01, 0.01, 0.01, 0, 0, 0] }\n", ""},
          {"link = \"lower\", xyz", "link = \"upper\", xyz"}},
         {},
         {"robot.xml: does not match robot.toml", "only in the MJCF: joint \"elbow\""}},
    }),
    PrintName);

INSTANTIATE_TEST_SUITE_P(
    Mjcf, BadInputTest,
    ::testing::ValuesIn(std::vector<BadInput>{
        {"JointRenamed",
         {},
         {{"name=\"elbow\"", "name=\"knee\""}},
         {"robot.xml: does not match robot.toml", "only in the parameters: joint \"elbow\"",
          "only in the MJCF: joint \"knee\""}},
        {"JointKind",
         {},
         {{"<joint name=\"elbow\"", "<joint type=\"slide\" name=\"elbow\""}},
         {"robot.xml: ", "joint \"elbow\"", "must be a hinge"}},
        {"BallJoint",
         {},
         {{"<joint name=\"elbow\" axis=\"0 0 1\" damping=\"0.05\" armature=\"0.02\" limited=\"true\" "
           "range=\"-1 1\"/>",
           "<joint name=\"elbow\" type=\"ball\"/>"}},
         {"robot.xml: ", "joint \"elbow\"", "must be a hinge"}},
        {"JointTooMany",
         {},
         {{"<site", "<joint name=\"twist\" axis=\"1 0 0\"/><site"}},
         {"robot.xml: ", "only in the MJCF: joint \"twist\""}},
        {"JointWithoutName",
         {},
         {{"<site", "<joint axis=\"1 0 0\"/><site"}},
         {"robot.xml: ", "only in the MJCF: joint \"#2\""}},
        {"JointsSwapped",
         {},
         {{"name=\"shoulder\"", "name=\"x\""},
          {"name=\"elbow\"", "name=\"shoulder\""},
          {"name=\"x\"", "name=\"elbow\""}},
         {"robot.xml: ", "joint \"shoulder\"", "must move body \"upper\", moves \"lower\""}},
        {"OtherParent",
         {},
         {{"<body name=\"lower\"", "</body><body name=\"lower\""},
          {"</body>\n      </body>\n    </body>", "</body>\n    </body>"}},
         {"robot.xml: ", "joint \"elbow\"", "must hang on body \"upper\", hangs on \"world\""}},
        {"BaseMoves",
         {},
         {{"<body name=\"stand\">", "<body name=\"stand\"><freejoint/><geom size=\"0.1\"/>"}},
         {"robot.xml: ", "only in the MJCF: joint \"#0\""}},
        {"Syntax",
         {},
         {{"</worldbody>", "</worldbodyy>"}},
         {"robot.xml:3: is not XML, XML_ERROR_MISMATCHED_ELEMENT"}},
        {"UnknownElement",
         {},
         {{"<site", "<sight"}},
         {"robot.xml:11: <sight>: is neither in 2.2.2 nor known to be newer"}},
        {"NegativeMass",
         {},
         {{"mass=\"0.8\"", "mass=\"-0.8\""}},
         {"robot.xml: ", "mass", "lower", "line = 8"}},
        {"Triangle",
         {},
         {{"0.01 0.01 0.01", "0.01 0.01 0.03"}},
         {"robot.xml: ", "inertia must satisfy A + B >= C", "lower"}},
        {"NotANumber",
         {},
         {{"damping=\"0.05\"", "damping=\"nan\""}},
         {"robot.xml: ", "joint \"elbow\": damping", "must be finite, got nan"}},
        {"Infinite",
         {},
         {{"mass=\"0.8\"", "mass=\"inf\""}},
         {"robot.xml: ", "body \"lower\": mass", "must be finite, got inf"}},
        {"InfiniteGravity",
         {},
         {{"<worldbody>", "<option gravity=\"0 0 -inf\"/><worldbody>"}},
         {"robot.xml: ", "option gravity", "must be finite, got -inf"}},
        {"NotANumberAnywhere",
         {},
         {{"<worldbody>",
           "<equality><weld body1=\"upper\" active=\"false\" solref=\"nan 1\"/></equality><worldbody>"}},
         {"robot.xml: ", "eq_solref[0] must be a number, got nan"}},
        {"TwoNumbersForOne",
         {},
         {{"<worldbody>", "<size nconmax=\"1,5\"/><worldbody>"}},
         {"robot.xml:", "<size nconmax>: must be an integer, got \"1,5\""}},
        {"CutOffList",
         {},
         {{"<worldbody>", "<asset><mesh name=\"m\" vertex=\"0 0 0 1 x\"/></asset><worldbody>"}},
         {"robot.xml:", "<mesh vertex>: must be numbers, got \"0 0 0 1 x\""}},
        {"MeshWithMass",
         {},
         {{"<worldbody>", "<asset><mesh file=\"no.stl\"/></asset><worldbody>"},
          {"<site name=\"tip\"",
           "<body name=\"tool\"><geom type=\"mesh\" mesh=\"no\"/></body><site name=\"tip\""}},
         {"robot.xml:11: mesh \"no.stl\": does not exist; the mass of body \"tool\" follows from it"}},
        {"NoWorld",
         {},
         {{testing::kTwoLinksMjcf, "<mujoco><sensor/></mujoco>"}},
         {"robot.xml: has no <worldbody>: it is a part for <include>"}},
        {"MissingInclude",
         {},
         {{"<worldbody>", "<include file=\"no.xml\"/><worldbody>"}},
         {"robot.xml:3: ", "no.xml"}},
        {"Empty", {}, {{testing::kTwoLinksMjcf, ""}}, {"robot.xml:1: is not XML, XML_ERROR_EMPTY_DOCUMENT"}},
    }),
    PrintName);

class BadFiles : public BadInputTest {};

TEST_F(BadFiles, GoodOnesAreAccepted) {
  WriteText(folder_.path() / "robot.toml", testing::kTwoLinksToml);
  WriteText(folder_.path() / "robot.xml", testing::kTwoLinksMjcf);
  const testing::ProgramResult result = RunConsistency();
  EXPECT_EQ(result.exit_code, 0) << result.out;
  EXPECT_EQ(result.err, "");
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "out.json"));
}

TEST_F(BadFiles, CannotBeRead) {
  EXPECT_TRUE(IsRefused(RunConsistency(), {"robot.toml: cannot be read: No such file or directory"}));
  WriteText(folder_.path() / "robot.toml", testing::kTwoLinksToml);
  EXPECT_TRUE(IsRefused(RunConsistency(), {"robot.xml: cannot be read: No such file or directory"}));
  std::filesystem::create_directory(folder_.path() / "robot.xml");
  EXPECT_TRUE(IsRefused(RunConsistency(), {"robot.xml: cannot be read: is a directory"}));
  std::filesystem::remove(folder_.path() / "robot.toml");
  std::filesystem::create_directory(folder_.path() / "robot.toml");
  EXPECT_TRUE(IsRefused(RunConsistency(), {"robot.toml: cannot be read: is a directory"}));
}

TEST_F(BadFiles, OfAnotherRobotAreNamedInOneLine) {
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"consistency", "--robot", testing::kParameters + "panda.toml", "--mjcf",
                             testing::kMjcf + "scene.xml"}),
                {"scene.xml: does not match ", "panda.toml; only in the parameters: body \"panda_link0\"",
                 "and 8 more; only in the MJCF: joint \"base\"", "and 44 more"}));
}

TEST_F(BadFiles, MobileBaseNeedsAFreeJoint) {
  std::filesystem::copy(testing::kMjcf, folder_.path() / "mjcf", std::filesystem::copy_options::recursive);
  const std::filesystem::path robot = folder_.path() / "mjcf/robot.xml";
  WriteText(robot, ReplaceOnce(ReadText(robot), "<freejoint name=\"base\"/>", ""));
  WriteText(folder_.path() / "mjcf/bare.xml",
            "<mujoco><include file=\"robot.xml\"/><include file=\"torus.xml\"/></mujoco>");
  EXPECT_TRUE(IsRefused(RunDexcheck({"consistency", "--robot", testing::kParameters + "assistant_robot.toml",
                                     "--mjcf", "mjcf/bare.xml"},
                                    {folder_.path()}),
                        {"mjcf/bare.xml: body \"platform\": must move by a free joint"}));
}

TEST_F(BadFiles, AnotherMujocoVersionIsNamed) {
  testing::ProgramOptions options;
  options.environment = {{"LD_PRELOAD", testing::BuildPath("/tests/libother_mujoco_version.so")}};
  EXPECT_TRUE(IsRefused(RunDexcheck({"consistency", "--samples", "1"}, options),
                        {"libmujoco: version must be 2.2.2, got 2.3.1"}));
}

TEST_F(BadFiles, AFaultOfTheProgramIsNoBadInput) {
  testing::ProgramOptions options;
  options.environment = {{"LD_PRELOAD", testing::BuildPath("/tests/libother_mujoco_version.so")},
                         {"TEST_MISTAKE", "1"}};
  const testing::ProgramResult result = RunDexcheck({"consistency", "--samples", "1"}, options);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(result.err, "dexcheck: internal error: size: must be positive, got -1\n");
}

}  // namespace
}  // namespace dexcheck::testing::bad_input_test
