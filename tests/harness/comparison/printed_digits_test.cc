// Uncertainty by the printed digits of a file.

#include "harness/comparison/printed_digits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/common/files.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::printed_digits_test {
namespace {

using ::testing::Each;

TEST(PrintedNumbers, AreKnownToHalfAUnitOfTheirLastDigit) {
  struct Case {
    const char* text;
    int digits;
    double half_unit;
  };
  for (const Case& one : {Case{"0.1234", 4, 5e-5},
                          {"-0.1234", 4, 5e-5},
                          {"+12.340", 5, 5e-4},
                          {"1.234e-3", 4, 5e-7},
                          {"1.234E+2", 4, 5e-2},
                          // A zero is known to its last decimal.
                          {"0.000000", 0, 5e-7},
                          {"1.0000", 5, 5e-5},
                          // Short ones stand for three digits.
                          {"0.5", 1, 5e-4},
                          {".25", 2, 5e-4},
                          {"2.9", 2, 5e-3},
                          {"0.01", 1, 5e-5},
                          {"0.0001", 1, 5e-7},
                          {"2e-5", 1, 5e-8},
                          {"0.0043", 2, 5e-6},
                          // Whole ones are exact.
                          {"0", 0, 0.0},
                          {"90", 2, 0.0},
                          {"1.0", 2, 0.0},
                          {"1e3", 1, 0.0}}) {
    SCOPED_TRACE(one.text);
    const std::optional<PrintedNumber> number = ReadPrinted(one.text);
    ASSERT_TRUE(number);
    EXPECT_EQ(number->value, std::stod(one.text));
    EXPECT_EQ(number->digits, one.digits);
    EXPECT_NEAR(number->half_unit, one.half_unit, 1e-12 * one.half_unit);
  }
  for (const char* text : {"", "link1", "0x10", "nan", "inf", "1.5m", "1,5"})
    EXPECT_FALSE(ReadPrinted(text)) << text;
}

/// Absolute changes of a number over all draws, without repetition.
template <typename Read>
std::vector<double> ListChanges(const PrintedSpread& spread, const Read& read) {
  std::vector<double> changes;
  for (const RobotDescription& draw : spread.draws)
    changes.push_back(std::abs(read(draw) - read(spread.nominal)));
  return changes;
}

std::string MakeUrdf(const std::string& mass) {
  return R"(<robot name="r"><link name="b"/><link name="l"><inertial><origin xyz="0.12345 0 0.02"/><mass value=")" +
         mass +
         R"("/><inertia ixx="0.00123" iyy="0.002" izz="0.0022" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><parent link="b"/><child link="l"/><axis xyz="0 0 1"/></joint></robot>)";
}
std::string MakeMjcf(const std::string& inertial) {
  return "<mujoco><worldbody><body name='l'><joint name='j' axis='0 0 1'/><geom type='sphere' "
         "size='0.11'/><inertial " +
         inertial + "/></body></worldbody></mujoco>";
}

std::array<PrintedSpread, 2> Draw(const std::string& a, const std::string& b) {
  const DescriptionFile first("a", a, {});
  const DescriptionFile second("b", b, {});
  const auto spreads = DrawWithinDigits({&first, &second}, {}, 16);
  EXPECT_TRUE(spreads);
  return spreads ? *spreads : std::array<PrintedSpread, 2>{};
}

TEST(PrintedDigits, MoveEachNumberByItsHalfUnit) {
  const auto [urdf, other] = Draw(MakeUrdf("1.234"), MakeUrdf("1.2341"));
  ASSERT_EQ(urdf.draws.size(), 16U);
  const auto near = [](double value) { return ::testing::DoubleNear(value, 1e-12); };
  EXPECT_THAT(ListChanges(urdf, [](const auto& r) { return r.parts[1].body.mass; }), Each(near(5e-4)));
  EXPECT_THAT(ListChanges(other, [](const auto& r) { return r.parts[1].body.mass; }), Each(near(5e-5)));
  // Both directions are drawn.
  EXPECT_TRUE(
      std::ranges::any_of(urdf.draws, [](const auto& draw) { return draw.parts[1].body.mass > 1.234; }));
  EXPECT_TRUE(
      std::ranges::any_of(urdf.draws, [](const auto& draw) { return draw.parts[1].body.mass < 1.234; }));
  EXPECT_EQ(urdf.digits.count, 6);  // mass, centre of mass, inertia
  EXPECT_EQ(urdf.digits.fewest, 1);
  EXPECT_EQ(other.digits.most, 5);
}

// A place that stands in both leaves nothing open between them; as often as it stands there.
TEST(PrintedDigits, OfPlacesAreThoseThatDiffer) {
  const auto place = [](const std::string& xyz) {
    return ReplaceOnce(MakeUrdf("1.234"), "<axis", "<origin xyz=\"" + xyz + "\"/><axis");
  };
  const auto x = [](const RobotDescription& robot) { return robot.spec.joints[0].X_PB.translation().x(); };
  EXPECT_THAT(ListChanges(Draw(place("0.123 0 0"), place("0.123 0 0"))[0], x), Each(0.0));
  EXPECT_THAT(ListChanges(Draw(place("0.123 0 0"), place("0.1231 0 0"))[0], x),
              Each(::testing::DoubleNear(5e-4, 1e-12)));
  EXPECT_THAT(ListChanges(Draw(place("0.123 0.123 0"), place("0.123 0.1231 0"))[0], x),
              Each(::testing::DoubleNear(5e-4, 1e-12)));
}

TEST(PrintedDigits, OfAnMjcfAreCarriedThroughTheCompiler) {
  const std::string diagonal = "pos='0.11 0 0' mass='1.25' diaginertia='0.0012 0.0021 0.0033' quat='1 0 0 0'";
  const std::string full = "pos='0.11 0 0' mass='1.25' fullinertia='0.0013 0.0024 0.0031 0.0001 0.0002 0'";
  for (const std::string& inertial : {diagonal, full}) {
    const auto [a, b] = Draw(MakeMjcf(inertial), MakeUrdf("1.2346"));
    ASSERT_EQ(a.draws.size(), 16U);
    for (int k = 0; k < 3; ++k) {
      // Principal moments at the triangle's limit may be moved beyond it.
      EXPECT_THAT(ListChanges(a, [&](const auto& r) { return r.parts[0].body.inertia(k, k); }),
                  Each(::testing::DoubleNear(5e-6, 1e-9)));
    }
    ASSERT_EQ(a.undiagonalized.has_value(), inertial == full);
    if (inertial == full) EXPECT_EQ(a.undiagonalized->parts[0].body.inertia(0, 1), 0.0001);
  }
}

TEST(PrintedDigits, OfAParameterFileAreThoseOfItsText) {
  const std::string file = SourcePath("/controller/parameters/panda.toml");
  const DescriptionFile table(file);
  const auto [a, b] = Draw(ReplaceFirst(table.text(), "3.228604", "3.2286"), table.text());
  EXPECT_GT(a.digits.count, 7 * 10 - 7);
  EXPECT_EQ(b.digits.count, a.digits.count);
  EXPECT_THAT(ListChanges(a, [](const auto& r) { return r.spec.joints[2].X_PB.translation().norm(); }),
              Each(0.0));
  EXPECT_THAT(ListChanges(a, [](const auto& r) { return r.spec.joints[2].body.mass; }),
              Each(::testing::DoubleNear(5e-5, 1e-12)));
}

}  // namespace
}  // namespace dexcheck::testing::printed_digits_test
