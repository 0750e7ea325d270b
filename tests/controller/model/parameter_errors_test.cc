// Every way in which a parameter file can be wrong is one line that names file, line, key and value.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/toml_reader.h"
#include "controller/model/parameter_reader.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/common/paths.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::parameter_errors_test {
namespace {

const std::string& ShippedText() {
  static const std::string text = ReadTextFile(
      (std::filesystem::path(SourcePath("/controller/parameters")) / "assistant_robot.toml").string());
  return text;
}

/// The line on which the first of a text's occurrences stands.
std::string FindLine(const std::string& text, const std::string& part) {
  const size_t at = text.find(part);
  EXPECT_NE(at, std::string::npos) << part;
  return std::to_string(1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
}

std::string CatchProblem(const std::string& text) {
  return MessageOf<InputError>([&] { return ParseRobotModel(text, "robot.toml"); });
}

/// A change of one place in the shipped file, and what follows "robot.toml:LINE: " in the message. In the
/// message {x} stands for the number of the line on which x first stands.
struct BadInput {
  std::string name;
  std::string original;
  std::string changed;
  std::string message;
  std::string line_of = {};  ///< Text on the line named; the changed text unless given.
};

std::string FillInLines(std::string message, const std::string& text) {
  for (size_t open = message.find('{'); open != std::string::npos; open = message.find('{')) {
    const size_t close = message.find('}', open);
    message.replace(open, close - open + 1, FindLine(text, message.substr(open + 1, close - open - 1)));
  }
  return message;
}

/// Expects each to be refused by file, line, key and value.
void ExpectRefused(const std::vector<BadInput>& inputs) {
  for (const BadInput& bad : inputs) {
    SCOPED_TRACE(bad.name);
    const std::string text = ReplaceOnce(ShippedText(), bad.original, bad.changed);
    const std::string line = FindLine(text, bad.line_of.empty() ? bad.changed : bad.line_of);
    EXPECT_EQ(CatchProblem(text), "robot.toml:" + line + ": " + FillInLines(bad.message, text));
  }
}

/// How a chain of the shipped file begins.
std::string Chain(const std::string& parent, const std::string& prefix) {
  return "[[chain]]\nparent = \"" + parent + "\"\nprefix = \"" + prefix + "\"\n";
}

const std::string kWaistRow = R"(link = "waist", alpha_deg = 0,   a = 0, q_deg = 0,)";
const std::string kElbow = "elbow           = { range = [-0.1, 2.5], damping = 0.2, armature = 0.02 }";
const std::string kTip = R"(xyz = ["h_f4", 0, 0], sphere_radius = 0.009)";
const std::string kWheels = "width = 0.04, damping = 0.02, armature = 0.004 }";
const std::string kCarpus =
    R"([{ shape = "cylinder", mass = 0.25, radius = 0.025, length = 0.06, axis = "z" }])";

TEST(ParameterErrors, Keys) {
  ExpectRefused({
      {"MisspeltRequired", kWaistRow, R"(link = "waist", alpha_dge = 0, a = 0, q_deg = 0,)",
       R"(chain[0].rows[0].alpha_dge: unknown key, did you mean "alpha_deg"?)"},
      {"MisspeltOptional", R"(prefix = "r_")", R"(prefx = "r_")",
       R"(chain[1].prefx: unknown key, did you mean "prefix"?)"},
      {"UnknownKey", "friction = 0.8", "friction = 0.8\ncolour = \"red\"",
       "object.colour: unknown key, known here are body, friction, inertia, mass, ring_radius, shape, "
       "tube_radius",
       "colour"},
      {"KeyOfAnotherShape", kCarpus, R"([{ shape = "sphere", mass = 0.25, radius = 0.025, axis = "z" }])",
       "template.arm.links.carpus.shapes[0].axis: unknown key, known here are center, mass, radius, shape"},
      {"MissingKey", "friction = 0.8", "", R"(object: missing key "friction")", "[object]"},
      {"MissingInertia", "carpus    = { shapes = " + kCarpus, "carpus = { mass = 0.25, com = [0, 0, 0]",
       R"(template.arm.links.carpus: missing key "inertia")"},
      {"MissingAtTheTop", "gravity = [0.0, 0.0, -9.81]", "", R"(missing key "gravity")", "#"},
      {"BothUnits", kWaistRow, R"(link = "waist", alpha_deg = 0, alpha = 0, a = 0, q_deg = 0,)",
       R"(chain[0].rows[0].alpha_deg: must not stand beside "alpha")"},
      {"ShapesAndMass", R"(carpus    = { shapes)", R"(carpus    = { mass = 1.0, shapes)",
       R"(template.arm.links.carpus.mass: must not stand beside "shapes")"},
      {"WidthAndInertia", kWheels, "spin_inertia = 0.1, " + kWheels,
       R"(base.wheels.spin_inertia: must not stand beside "width")"},
  });
}

TEST(ParameterErrors, Values) {
  ExpectRefused({
      {"Boolean", "mass = 0.2\n", "mass = true\n", "object.mass: must be a number, got true"},
      {"Symbol", R"(d = "L_1 + L_2")", R"(d = "L_1 + L_9")",
       R"(chain[0].rows[0].d: must be a number or arithmetic, unknown symbol "L_9" (did you mean "L_1"?) at )"
       R"(character 7, got "L_1 + L_9")"},
      {"LengthBeforeItsSymbol", "L_1 = 0.30", R"(L_1 = "2 * L_2")",
       R"(lengths.L_1: must be a number or arithmetic, unknown symbol "L_2" at character 5, got "2 * L_2")"},
      {"LengthName", "L_1 = 0.30", "pi = 3.0",
       R"(lengths.pi: must be named by letters, digits and _, other than pi, got "pi")"},
      {"Infinity", "L_7 = 0.25", "L_7 = inf", "lengths.L_7: must be finite, got inf"},
      {"DivisionByZero", "L_7 = 0.25", R"(L_7 = "1 / 0 * L_1")",
       R"(lengths.L_7: must be finite, is inf, got "1 / 0 * L_1")"},
      {"Text", R"(parent = "platform")", "parent = 1", "chain[0].parent: must be text, got 1"},
      {"Name", R"(joint = "waist_yaw",)", R"(joint = "waist\tyaw",)",
       R"(chain[0].rows[0].joint: must be a name of 1 to 256 bytes without control characters, got "waist?yaw")"},
      {"EmptyName", R"(link = "platform"
velocity)",
       R"(link = ""
velocity)",
       R"(base.link: must be a name of 1 to 256 bytes without control characters, got "")"},
      {"List", "size = [0.28, 0.22, 0.08]", "size = 0.28", "base.shapes[1].size: must be a list, got 0.28"},
      {"ListLength", "size = [0.28, 0.22, 0.08]", "size = [0.28, 0.22]",
       "base.shapes[1].size: must be a list of 3 numbers, got [0.28, 0.22]"},
      {"TableExpected", "[[frame]]", "[frame]", R"(frame: must be a list, got a table)", "[frame]"},
      {"Choice", R"(velocity = "twist")", R"(velocity = "twists")",
       R"(base.velocity: must be one of "twist", "wheel_rates", got "twists")"},
      {"MultiLineValue", R"(velocity = "twist")", "velocity = '''\ntwist\n'''",
       R"(base.velocity: must be one of "twist", "wheel_rates", got "twist?")", "velocity = '''"},
  });
}

TEST(ParameterErrors, Physics) {
  ExpectRefused({
      {"NegativeMass", R"(shape = "box", mass = 12.0)", R"(shape = "box", mass = -12.0)",
       "base.shapes[1].mass: must not be negative, got -12"},
      {"MasslessObject", "mass = 0.2\n", "mass = 0\n", "object.mass: must be positive, got 0"},
      {"NegativeInertia", "carpus    = { shapes = " + kCarpus,
       "carpus = { mass = 0.25, com = [0, 0, 0], inertia = [1e-4, 1e-4, -1e-4, 0, 0, 0]",
       "template.arm.links.carpus.inertia: principal moments of inertia must not be negative, got "
       "[-1e-04, 1e-04, 1e-04]"},
      {"Overflow", "radius = 0.025, length = 0.06", "radius = 1e200, length = 0.06",
       "template.arm.links.carpus.shapes: inertia must be finite, got [nan, nan, nan, nan, "
       "nan, nan, nan, nan, nan]"},
      {"Damping", kElbow, "elbow = { range = [-0.1, 2.5], damping = -0.2, armature = 0.02 }",
       "template.arm.joints.elbow.damping: must not be negative, got -0.2"},
      {"Range", kElbow, "elbow = { range = [2.5, -0.1], damping = 0.2, armature = 0.02 }",
       "template.arm.joints.elbow.range: lower limit must not exceed upper limit, got [2.5, -0.1]"},
      {"ShapeRadius", "radius = 0.055", "radius = 0.000",
       "template.arm.links.shoulder.shapes[0].radius: must be positive, got 0"},
      {"Axis", R"(length = 0.06, axis = "z")", "length = 0.06, axis = [0, 1, 1]",
       "template.arm.links.carpus.shapes[0].axis: must be a unit vector, got [0, 1, 1]"},
      {"FingertipRadius", kTip, R"(xyz = ["h_f4", 0, 0], sphere_radius = 0)",
       "template.finger.frames[0].sphere_radius: must be positive, got 0"},
      {"WheelRadius", "wheel_radius = 0.1", "wheel_radius = 0", "base.wheel_radius: must be positive, got 0"},
      {"WheelInertia", kWheels,
       "spin_inertia = 0.1, transverse_inertia = 0.01, damping = 0.02, armature = 0.004 }",
       "base.wheels: principal moments of inertia must satisfy the triangle inequality, got [0.01, "
       "0.01, 0.1]"},
      {"TubeOfTorus", "tube_radius = 0.011", "tube_radius = 0.035",
       "object.tube_radius: must be less than ring_radius, got 0.035"},
      {"Friction", "friction = 0.8", "friction = 0", "object.friction: must be positive, got 0"},
      {"PrismaticInDegrees",
       R"({ joint = "waist_yaw",   link = "waist", alpha_deg = 0,   a = 0, q_deg = 0,   d = "L_1 + L_2" },
  { joint = "waist_pitch", link = "torso", alpha_deg = -90, a = 0, q_deg = -90, d = 0 },
]
[chain.joints]  # [own]
waist_yaw   = { range = [-2.6, 2.6],)",
       R"({ joint = "waist_yaw", type = "prismatic", link = "waist", alpha_deg = 0, a = 0, q_deg = 0, d = 0 },
  { joint = "waist_pitch", link = "torso", alpha_deg = -90, a = 0, q_deg = -90, d = 0 },
]
[chain.joints]  # [own]
waist_yaw   = { range_deg = [-90, 90],)",
       "chain[0].joints.waist_yaw.range_deg: must be in m for a prismatic joint, not in degrees, "
       "got [-90, 90]",
       "range_deg = [-90, 90]"},
  });
}

const std::string kRightArm = Chain("torso", "r_");

TEST(ParameterErrors, Tree) {
  ExpectRefused({
      {"CyclicParents", kRightArm, Chain("rf1_phalanx_4", "r_"),
       R"(chain[1].parent: must not be cyclic, chain[1] -> chain[3] -> chain[1], got "rf1_phalanx_4")",
       R"(parent = "rf1_phalanx_4")"},
      {"LaterParent", kRightArm, Chain("l_palm", "r_"),
       "chain[1].parent: must be declared before its children, move chain[2] (line {" + Chain("torso", "l_") +
           "}) before chain[1] (line {" + Chain("l_palm", "r_") + R"(}), got "l_palm")",
       R"(parent = "l_palm")"},
      {"UnknownParent", kRightArm, Chain("torsoo", "r_"),
       R"(chain[1].parent: must be a link (did you mean "torso"?), got "torsoo")", R"(parent = "torsoo")"},
      {"DuplicateJoint", Chain("l_palm", "lf1_"), Chain("l_palm", "rf4_"),
       R"(chain[7]: joint names must be unique, got "rf4_1", taken by chain[6] on line {)" +
           Chain("r_palm", "rf4_") + "}"},
      {"BaseLink", R"(link = "torso")", R"(link = "platform")",
       R"(chain[0]: link names must be unique, got "platform", taken by the base)", "[[chain]]"},
      {"WheelAsJoint", R"(joint = "waist_yaw",)", R"(joint = "wheel_left",)",
       R"(chain[0]: joint names must be unique, got "wheel_left", taken by a wheel)", "[[chain]]"},
      {"SameWheel", R"(left = "wheel_left")", R"(left = "wheel_right")",
       R"(base.wheels.left: must differ from right, got "wheel_right")"},
      {"DuplicateFrame", "base_frame", "lf4_tip",
       R"(frame[0]: frame names must be unique, got "lf4_tip", taken by chain[10] on line {)" +
           Chain("l_palm", "lf4_") + "}",
       "[[frame]]"},
      {"FrameLink", R"(link = "phalanx_4", xyz)", R"(link = "phalanx_5", xyz)",
       R"(template.finger.frames[0].link: must be a link (did you mean "phalanx_1"?), got "phalanx_5")"},
      {"UnknownTemplate", Chain("r_palm", "rf4_") + R"(template = "finger")",
       Chain("r_palm", "rf4_") + R"(template = "fingers")",
       R"(chain[6].template: must be a template (did you mean "finger"?), got "fingers")",
       R"(template = "fingers")"},
      {"UnusedTemplate", "# Table 1, row 2-3 (right arm)",
       "[template.leg]\nrows = []\n# Table 1, row 2-3 (right arm)", "template.leg: must be used by a chain"},
      {"JointWithoutEntry", "elbow           = {", "elboww          = {",
       R"(template.arm.rows[2]: has no entry in joints (did you mean "elboww"?), got "elbow")",
       R"(joint = "elbow")"},
      {"EntryWithoutJoint", kElbow, "knee = { range = [0, 1], damping = 0, armature = 0 }\n" + kElbow,
       "template.arm.joints.knee: no row has this joint"},
      {"NoRows", "[[frame]]", "[[chain]]\nparent = \"torso\"\n[[frame]]",
       "chain[11]: must have rows, its own or a template's"},
  });
}

TEST(ParameterErrors, Syntax) {
  ExpectRefused({
      {"RepeatedKey", "wheel_radius = 0.1", "wheel_radius = 0.1\nwheel_radius = 0.2",
       "syntax error: Error while parsing key-value pair: cannot redefine existing floating-point "
       "'wheel_radius'",
       "wheel_radius = 0.2"},
  });
}

TEST(ParameterFiles, ThatCannotBeReadAreNamed) {
  const auto read = [](const std::string& path) {
    return MessageOf<InputError>([&] { return ReadRobotModel(path); });
  };
  EXPECT_EQ(read("no/such/file.toml"), "no/such/file.toml: cannot be read: No such file or directory");
  EXPECT_EQ(read("/"), "/: cannot be read: is a directory");
  EXPECT_EQ(read("/dev/zero"), "/dev/zero: must be at most 1048576 bytes long");
}

std::string Repeat(const std::string& part, int count) {
  std::string text;
  for (int i = 0; i < count; ++i) text += part;
  return text;
}

TEST(ParameterTexts, OfExcessiveSizeOrDepthAreRefused) {
  const std::string too_deep = "robot.toml:1: nested too deeply, more than 32 brackets or 16 dots";
  EXPECT_EQ(CatchProblem("[" + Repeat("a.", 200000) + "a]"), too_deep);
  EXPECT_EQ(CatchProblem(Repeat(R"("a" . )", 100000) + "a = 1"), too_deep);
  EXPECT_EQ(CatchProblem("a = " + Repeat("[", 500000)), too_deep);
  EXPECT_EQ(CatchProblem("a = " + Repeat("{a=", 200000)), too_deep);
  EXPECT_EQ(CatchProblem("gravity = [1.0, " + Repeat("2.5, ", 1000) + "]"),
            R"(robot.toml:1: missing key "name")");
  EXPECT_EQ(CatchProblem(Repeat("#", 2000000)), "robot.toml: must be at most 1048576 bytes long");
  // Brackets and dots in text and comments do not count.
  EXPECT_EQ(CatchProblem(ShippedText() + "\n# " + Repeat("[.", 100) + "\n"), "accepted");
  EXPECT_EQ(CatchProblem("name = \"\\\"" + Repeat("[.", 100) + "\""),
            R"(robot.toml:1: missing key "gravity", "base", "chain")");
}

TEST(ParameterTexts, AllMissingKeysAreReportedAtOnce) {
  std::string text = ShippedText();
  const auto change = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
  };
  change("gravity = [0.0, 0.0, -9.81]\n", "\n");
  change("friction = 0.8\n", "\n");
  change(kWaistRow, R"(link = "waist", alpha_dge = 0, a = 0,)");
  // A template of two arms is reported once.
  change(kElbow, "elbow = { damping = 0.2 }");
  EXPECT_EQ(
      CatchProblem(text),
      FillInLines(R"(robot.toml:1: missing key "gravity"; line {alpha_dge}: chain[0].rows[0].alpha_dge: )"
                  R"(unknown key, did you mean "alpha_deg"?; line {alpha_dge}: chain[0].rows[0]: )"
                  R"(missing key "q_deg"; line {elbow = {}: template.arm.joints.elbow: missing key )"
                  R"("range"; line {[object]}: object: missing key "friction")",
                  text));
}

TEST(ParameterTexts, CannotAskForMillionsOfJoints) {
  std::string text = ShippedText();
  for (int i = 0; i < 400; ++i) {
    text += "[[chain]]\nparent = \"torso\"\ntemplate = \"finger\"\nprefix = \"x" + std::to_string(i) + "\"\n";
  }
  EXPECT_THAT(CatchProblem(text), HasSubstr("must leave the number of joints within 1000, got 100"));
}

TEST(ParameterTexts, DamagedAtRandomAreReadOrRefusedInOneLine) {
  std::mt19937 random(20);
  const std::string& original = ShippedText();
  int refused = 0;
  for (int i = 0; i < 1000; ++i) {
    std::string text = original;
    const size_t at = random() % text.size();
    const size_t length = 1 + random() % 12;
    switch (random() % 3) {
      case 0:
        text.erase(at, length);
        break;
      case 1:
        text.insert(at, original, random() % original.size(), length);
        break;
      default:
        text[at] = static_cast<char>(random() % 256);
    }
    const std::string problem = CatchProblem(text);
    if (problem == "accepted") continue;
    ++refused;
    EXPECT_THAT(problem, StartsWith("robot.toml:"));
    EXPECT_THAT(problem, Not(HasSubstr("\n")));
  }
  // Most of the file is not comment.
  EXPECT_GT(refused, 300);
}

}  // namespace
}  // namespace dexcheck::testing::parameter_errors_test
