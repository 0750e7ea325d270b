// Robots whose base floats, from a table as `dexcheck import` writes it: a wrong number is named as it stands
// in the file, where axes are x, y or slanted, with the value that was there.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "controller/model/parameter_reader.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/diagnosis/diagnose.h"
#include "harness/diagnosis/file_terms.h"
#include "harness/diagnosis/mutation.h"
#include "harness/engine/engine.h"
#include "tests/common/legged_robots.h"
#include "tests/common/matchers.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::diagnose_floating_test {
namespace {

/// A number of a table's text, found by what stands before its list.
struct Place {
  std::string section;  ///< Text before the key, such as the link's heading.
  std::string key;      ///< "com = ["
  size_t component;
};

/// The list of numbers behind a key; `end` is where it ends in the text.
std::vector<double> ReadNumbers(const std::string& text, size_t begin, size_t* end) {
  *end = text.find_first_of("]\n", begin);
  std::istringstream in(text.substr(begin, *end - begin));
  std::vector<double> numbers;
  for (double number = 0.0; in >> number; in.ignore(1)) numbers.push_back(number);
  return numbers;
}

/// The text with a change of one number. @param right the number as it was.
std::string Change(const std::string& text, const Place& place, double change, double* right) {
  const size_t section = text.find(place.section);
  const size_t key = section == std::string::npos ? section : text.find(place.key, section);
  if (key == std::string::npos) throw std::invalid_argument(place.section + " " + place.key);
  const size_t begin = key + place.key.size();
  size_t end = 0;
  std::vector<double> numbers = ReadNumbers(text, begin, &end);
  *right = numbers.at(place.component);
  numbers[place.component] += change;
  std::string list;
  for (const double number : numbers) list += fmt::format("{}{:.15g}", list.empty() ? "" : ", ", number);
  return text.substr(0, begin) + list + text.substr(end);
}

/// Diagnoses the table and looks for one repair: of this part and quantity, to this value.
void ExpectNamed(const std::string& text, const mjModel& engine, const std::string& part,
                 const std::string& quantity, double right) {
  SCOPED_TRACE(part + ": " + quantity);
  std::vector<WrittenRow> rows;
  const RobotModel model = ParseRobotModel(text, "robot.toml", {}, &rows);
  const Diagnosis diagnosis = Diagnose(
      model, engine, "robot.xml", {}, [](const char*) { return true; }, rows);
  EXPECT_FALSE(diagnosis.agrees);
  EXPECT_TRUE(diagnosis.remaining_constants.empty());
  EXPECT_TRUE(diagnosis.remaining_terms.empty());
  const std::vector<Repair>& causes = diagnosis.causes;
  const RobotSpec& written = diagnosis.written;
  ASSERT_EQ(causes.size(), 1U) << Describe(causes.back(), written, "FILE");
  ASSERT_EQ(causes[0].parameters.size(), 1U) << Describe(causes[0], written, "FILE");
  EXPECT_EQ(DescribeShort(causes[0], written), part + ": " + quantity);
  const bool is_angle = IsAngle(written, causes[0].parameters[0]);
  // Thirteen digits are printed, of angles in degrees.
  EXPECT_NEAR(causes[0].values[0], right, (is_angle ? 1e-12 : 1e-13) * std::max(1.0, std::abs(right)));
}

class LeggedDiagnosis : public ::testing::TestWithParam<std::string> {
 protected:
  LeggedDiagnosis()
      : links_(GetParam() == "quadruped" ? ListQuadruped() : ListHumanoid()),
        engine_(LoadMjcfText(WriteLeggedMjcf(GetParam(), links_), "robot.xml")),
        text_(WriteParameters(ReadMjcfDescription(*engine_, "robot.xml"), "robot.xml")) {}

  void Try(const Place& place, double change, const std::string& part, const std::string& quantity) {
    double right = 0.0;
    const std::string text = Change(text_, place, change, &right);
    ExpectNamed(text, *engine_, part, quantity, right);
  }

  std::vector<LeggedLink> links_;
  MjModelPtr engine_;
  std::string text_;
};

TEST_P(LeggedDiagnosis, NamesTheBase) {
  const std::string part = "link " + links_[0].name;
  Try({"[base]", "mass = ", 0}, 0.5, part, "mass");
  Try({"[base]", "com = [", 1}, 0.01, part, "centre of mass y");
  Try({"[base]", "inertia = [", 2}, 0.002, part, "Izz");
  Try({"[base]", "inertia = [", 4}, 0.001, part, "Ixz");
}

TEST_P(LeggedDiagnosis, NamesOneLinkInTheFilesTerms) {
  const char* const axes[] = {"x", "y", "z"};
  const char* const turns[] = {"roll", "pitch", "yaw"};
  const char* const entries[] = {"Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"};
  const size_t every = GetParam() == "quadruped" ? 3 : 8;  // links with axes of each kind
  size_t tried = 0;
  for (size_t i = 1; i < links_.size(); ++i) {
    const LeggedLink& link = links_[i];
    if (!link.has_joint || i % every != 1) continue;
    const std::string heading = "[chain.links.\"" + link.name + "\"]";
    const std::string row = "joint = \"" + link.name + "_joint\"";
    const std::string part = "link " + link.name;
    const std::string joint = "joint " + link.name + "_joint";
    const size_t k = tried % 3;
    const size_t entry = tried % 6;
    Try({heading, "com = [", k}, 0.004, part, std::string("centre of mass ") + axes[k]);
    Try({row, "xyz = [", k}, 0.02, joint, std::string("position ") + axes[k]);
    Try({heading, "inertia = [", entry}, 1e-5, part, entries[entry]);
    if (tried % 2 == 0) Try({heading, "mass = ", 0}, 0.1, part, "mass");
    if (link.rpy != "0 0 0") {
      const size_t turn = link.rpy.starts_with("0 ") ? 1 : 0;
      Try({row, "rpy = [", turn}, 0.05, joint, turns[turn]);
    }
    ++tried;
  }
  EXPECT_GE(tried, 4U);
}

// What floats has a body like any link's: each of its numbers, and it as a whole.
TEST_P(LeggedDiagnosis, MutantsOfTheBaseAreKilledAndNamed) {
  const RobotModel model = ParseRobotModel(text_, "robot.toml");
  std::set<std::string> kinds;
  for (Mutant& mutant : ListMutants(model.spec(), 1e-3)) {
    const std::vector<Parameter>& changed = mutant.expected.parameters;
    if (changed.empty() || changed.front().index >= 0 || changed.front().kind == ParameterKind::kGravity)
      continue;
    if (GetParam() == "humanoid" && changed.size() == 1) continue;  // as the quadruped's, in 3 s
    kinds.insert(mutant.kind);
    TryMutant(model, *engine_, "robot.xml", {}, &mutant);
    EXPECT_EQ(mutant.outcome, MutantOutcome::kKilled) << mutant.name;
    EXPECT_TRUE(mutant.named_first) << mutant.kind << ": " << mutant.named;
  }
  EXPECT_THAT(kinds, ::testing::IsSupersetOf({"solid of another mass", "inertia about the frame's origin",
                                              "inertia with x and z exchanged"}));
  if (GetParam() == "quadruped") {
    EXPECT_THAT(kinds, ::testing::IsSupersetOf({"mass", "centre of mass", "inertia"}));
  }
}

INSTANTIATE_TEST_SUITE_P(FloatingBase, LeggedDiagnosis, ::testing::Values("quadruped", "humanoid"));

// Axes of any direction: no number of frame i, whose z axis is the joint's, stands in the file.
TEST(FileTermsTest, SlantedAxesAreTurnedBack) {
  constexpr const char* kArm = R"(<mujoco><worldbody><body name="trunk"><freejoint/>
<inertial mass="3" pos="0.01 0.02 0" diaginertia="0.02 0.03 0.04"/>
<body name="upper" pos="0.1 0.2 0.3"><joint name="shoulder" axis="1 2 3"/>
<inertial mass="2" pos="0.1 0.02 0.03" diaginertia="0.01 0.02 0.025"/>
<body name="lower" pos="0.3 0 0.1" euler="10 20 0"><joint name="elbow" axis="-1 0.5 0.25"/>
<inertial mass="1" pos="0.15 0 0.01" diaginertia="0.004 0.006 0.008"/><site name="tip" pos="0.2 0.01 0"/>
</body></body></body></worldbody></mujoco>)";
  const MjModelPtr engine = LoadMjcfText(kArm, "arm.xml");
  const std::string text = WriteParameters(ReadMjcfDescription(*engine, "arm.xml"), "arm.xml");
  const auto expect = [&](const Place& place, double change, const std::string& part,
                          const std::string& quantity) {
    double right = 0.0;
    const std::string changed = Change(text, place, change, &right);
    ExpectNamed(changed, *engine, part, quantity, right);
  };
  expect({"[chain.links.\"upper\"]", "com = [", 1}, 0.01, "link upper", "centre of mass y");
  expect({"[chain.links.\"lower\"]", "inertia = [", 0}, 0.001, "link lower", "Ixx");
  expect({"joint = \"elbow\"", "xyz = [", 0}, 0.05, "joint elbow", "position x");
  expect({"joint = \"elbow\"", "rpy = [", 0}, 0.1, "joint elbow", "roll");
  expect({"name = \"tip\"", "xyz = [", 2}, 0.03, "frame tip", "position z");
}

// The axis of a plain row is no number of its place.
TEST(FileTermsTest, AnotherAxisIsNamedWithTheRightOne) {
  std::vector<LeggedLink> links = ListQuadruped();
  const MjModelPtr engine = LoadMjcfText(WriteLeggedMjcf("quadruped", links), "robot.xml");
  const std::string text = WriteParameters(ReadMjcfDescription(*engine, "robot.xml"), "robot.xml");
  for (const char* const axis : {"[0, 0, 1]", "[0.6, 0, 0.8]", "[0, -0.6, 0.8]"}) {
    const std::string key = "axis = [";
    const size_t begin = text.find(key) + key.size() - 1;
    const size_t end = text.find(']', begin) + 1;
    const std::string right = text.substr(begin, end - begin);
    ASSERT_NE(right, axis);
    std::vector<WrittenRow> rows;
    const RobotModel model =
        ParseRobotModel(text.substr(0, begin) + axis + text.substr(end), "robot.toml", {}, &rows);
    const Diagnosis diagnosis = Diagnose(
        model, *engine, "robot.xml", {}, [](const char*) { return true; }, rows);
    ASSERT_EQ(diagnosis.causes.size(), 1U);
    EXPECT_EQ(diagnosis.causes[0].kind, RepairKind::kAxisTurned);
    EXPECT_THAT(Describe(diagnosis.causes[0], diagnosis.written, "FILE"),
                ::testing::HasSubstr("; " + right + " repairs it"));
    EXPECT_TRUE(diagnosis.remaining_constants.empty() && diagnosis.remaining_terms.empty());
  }
}

// Rows of modified parameters stand in the file as in the specification; plain ones are read back.
TEST(FileTermsTest, NumbersAreReadAsTheyAreWritten) {
  std::mt19937 random(12);
  const RobotSpec spec = MakeRandomRobot({}, &random);
  const RobotSpec written = FileTerms({}).Write(spec);
  for (const Parameter& parameter : ListParameters(spec))
    EXPECT_EQ(GetValue(written, parameter), GetValue(spec, parameter));
  std::vector<WrittenRow> rows(spec.joints.size());
  for (size_t i = 0; i < rows.size(); i += 2) {
    rows[i].is_plain = true;
    rows[i].X_iL.linear() = Eigen::AngleAxisd(0.3 + static_cast<double>(i), Vector3d(1, 2, 2) / 3.0).matrix();
  }
  const FileTerms terms(rows);
  const RobotModel before(spec);
  const RobotModel after(terms.Read(terms.Write(spec)));
  ModelTerms a(before);
  ModelTerms b(after);
  const VectorXd q = DrawPositions(before, &random);
  a.SetState(q, VectorXd::Zero(a.size()));
  b.SetState(q, VectorXd::Zero(b.size()));
  for (int i = 0; i < static_cast<int>(spec.frames.size()); ++i)
    EXPECT_LT((a.CalcFramePose(i).matrix() - b.CalcFramePose(i).matrix()).norm(), 1e-13);
}

}  // namespace
}  // namespace dexcheck::testing::diagnose_floating_test
