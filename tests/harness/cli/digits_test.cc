// dexcheck consistency of published files: what their digits leave open is no difference, and hides none.

#include <fmt/format.h>

#include <regex>

#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/descriptions/panda_urdf.h"

namespace dexcheck::testing::digits_test {
namespace {

/// The text with each number printed with at most so many significant digits.
std::string RoundNumbers(const std::string& text, int digits) {
  static const std::regex number(R"(-?\d*\.\d+(e-?\d+)?)");
  std::string rounded;
  std::string rest = text;
  for (std::smatch match; std::regex_search(rest, match, number); rest = match.suffix())
    rounded += match.prefix().str() + fmt::format("{:.{}g}", std::stod(match.str()), digits);
  return rounded + rest;
}

class Digits : public CommandTest {
 protected:
  const std::string kPanda = MakePandaUrdf();
};

// A URDF with few digits and an MJCF with more: of any number of digits, nothing is said to differ.
TEST_F(Digits, WhatTheyLeaveOpenIsNoDifference) {
  for (int digits = 4; digits <= 12; ++digits) {
    SCOPED_TRACE(digits);
    Write("rounded.urdf", RoundNumbers(kPanda, digits));
    const Json results = Compare(0, "rounded.urdf", kPandaXml);
    EXPECT_EQ(results.at("verdict"), "pass");
    EXPECT_EQ(results.at("outcome"), "digits");
    EXPECT_TRUE(results.at("digits").at("exceeds").empty());
    EXPECT_EQ(results.at("digits").at("files").at(0).at("file"), "rounded.urdf");
    EXPECT_LE(results.at("digits").at("files").at(0).at("most"), digits);
    // Not for want of judgement: what differs uses a part of what is open.
    double most = 0.0;
    for (const auto& [check, units] : results.at("digits").at("units").items())
      most = std::max(most, units.get<double>());
    EXPECT_GT(most, 0.01);
    EXPECT_LE(most, 1.0 + 1e-6);
    const Json exact = Compare(1, "rounded.urdf", kPandaXml, "--exact");
    EXPECT_EQ(exact.at("outcome"), "differ");
    EXPECT_FALSE(exact.contains("digits"));
  }
  Write("same.urdf", kPanda);
  EXPECT_EQ(Compare(0, "same.urdf", kPandaXml).at("outcome"), "rounding");
  EXPECT_EQ(Compare(0, "rounded.urdf", kPandaXml, "--digits 3").at("outcome"), "tolerance");
  EXPECT_TRUE(Refused("consistency rounded.urdf same.urdf --exact --digits 3", {"--exact"}));
}

// Frames of links are placed by both files: a turn that one of them rounds moves both.
TEST_F(Digits, FramesOfLinksMoveWithBothFiles) {
  const std::string turned = ReplaceOnce(ReadFixture("pair.urdf"), "<origin xyz=\"0 0 0.1\"/>",
                                         "<origin xyz=\"0 0 0.1\" rpy=\"-0.08726646255 0.123456789 0\"/>");
  Write("turned.urdf", turned);
  for (const int digits : {4, 6, 8}) {
    Write("rounded.urdf", RoundNumbers(turned, digits));
    EXPECT_EQ(Compare(0, "turned.urdf", "rounded.urdf").at("outcome"), "digits") << digits;
    EXPECT_EQ(Compare(0, "rounded.urdf", "turned.urdf").at("outcome"), "digits") << digits;
  }
}

/// The first cause that is printed, without its line breaks.
std::string FirstCause(const std::string& out) {
  const size_t begin = out.find("  1. ");
  if (begin == std::string::npos) return out;
  std::string text = out.substr(begin, out.find("; explains", begin) - begin);
  for (size_t at = 0; (at = text.find("\n     ", at)) != std::string::npos;) text.replace(at, 6, " ");
  return text;
}

/// A hand's finger: its numbers have few digits.
std::string MakeFinger(const std::string& inertia, const std::string& com = "0.01 0 0",
                       const std::string& mass = "0.05") {
  return R"(<robot name="finger"><link name="palm"/><link name="tip"><inertial><origin xyz=")" + com +
         R"("/><mass value=")" + mass + R"("/><inertia )" + inertia +
         R"( ixz="0" iyz="0"/></inertial></link><joint name="bend" type="continuous"><parent link="palm"/>)"
         R"(<child link="tip"/><origin xyz="0 0.02 0.1" rpy="0.3 0 0"/><axis xyz="0 1 0"/></joint></robot>)";
}

// People type 0.0001 and mean it: a short number stands for three digits, however small it is.
TEST_F(Digits, OfFewDigitsHideNoMistake) {
  Write("right.urdf", MakeFinger(R"(ixx="0.0001" iyy="0.0002" izz="0.0002" ixy="0")"));
  const std::pair<std::string, std::string> cases[] = {
      {MakeFinger(R"(ixx="0.0002" iyy="0.0002" izz="0.0002" ixy="0")"),
       "ixx 0.0002 kg m^2 here, 0.0001 kg m^2 in the other file"},
      {MakeFinger(R"(ixx="0.0001" iyy="0.0002" izz="0.00021" ixy="0")"),
       "izz 0.00021 kg m^2 here, 0.0002 kg m^2 in the other file"},
      {MakeFinger(R"(ixx="0.0001" iyy="0.0002" izz="0.0002" ixy="0.00001")"),
       "ixy 1e-05 kg m^2 here, 0 kg m^2 in the other file"},
      {MakeFinger(R"(ixx="0.0001" iyy="0.0002" izz="0.0002" ixy="0")", "0.01 0.002 0"),
       "y 0.002 m here, 0 m in the other file"},
      {MakeFinger(R"(ixx="0.0001" iyy="0.0002" izz="0.0002" ixy="0")", "0.01 0 0", "0.051"),
       "mass differs: 0.051 kg here, 0.05 kg in the other file"}};
  for (const auto& [wrong, value] : cases) {
    SCOPED_TRACE(value);
    Write("wrong.urdf", wrong);
    EXPECT_EQ(Compare(1, "wrong.urdf", "right.urdf").at("outcome"), "differ");
    // The number stands in the only cause as it stands in the file, with its component.
    EXPECT_THAT(FirstCause(Expect(1, "wrong.urdf right.urdf --quiet").out),
                AllOf(HasSubstr("link tip"), HasSubstr(value)));
  }
}

// The verdict names the number that was compared most coarsely, and is good only to 1 %.
TEST_F(Digits, AreAgreementOnlyToTheStatedPrecision) {
  Write("long.urdf", MakeFinger(R"(ixx="0.000123" iyy="0.000234" izz="0.000245" ixy="0.0000000")"));
  Write("short.urdf", MakeFinger(R"(ixx="0.0001234" iyy="0.000234" izz="0.000245" ixy="0.0000000")"));
  const Json good = Compare(0, "long.urdf", "short.urdf");
  EXPECT_EQ(good.at("digits").at("loosest").at("what"), "inertia of link tip");
  EXPECT_NEAR(good.at("digits").at("loosest").at("precision").get<double>(), 5.5e-7 / 2.45e-4, 1e-5);
  EXPECT_THAT(Expect(0, "long.urdf short.urdf --quiet").out,
              HasSubstr("inertia of link tip, compared to 0.22 %"));
  Expect(1, "consistency long.urdf short.urdf --precision 0.2");
  // A zero of four decimals leaves a third of this tensor open.
  Write("zero.urdf", MakeFinger(R"(ixx="0.000123" iyy="0.000234" izz="0.000245" ixy="0.0000")"));
  Write("small.urdf", MakeFinger(R"(ixx="0.000123" iyy="0.000234" izz="0.000245" ixy="0.00001")"));
  EXPECT_EQ(Compare(1, "zero.urdf", "small.urdf").at("outcome"), "differ");
  EXPECT_THAT(Expect(1, "zero.urdf small.urdf --quiet").out,
              HasSubstr("the printed digits give it to 20 % only"));
  Expect(0, "consistency zero.urdf small.urdf --precision 30");
}

// Differences are reported in the frames of the files: a joint's origin or its axis, or a frame on its link.
TEST_F(Digits, APlacementIsToldAsItsFileHasIt) {
  const std::string right = MakeFinger(R"(ixx="0.000123" iyy="0.000234" izz="0.000245" ixy="0")");
  Write("right.urdf", right);
  const std::pair<Edit, std::string> cases[] = {
      {{"xyz=\"0 0.02 0.1\"", "xyz=\"0 0.02 0.13\""},
       "position differs: z 0.13 m here, 0.1 m in the other file"},
      {{"rpy=\"0.3 0 0\"", "rpy=\"0.5 0 0\""},
       "rotation differs: roll 0.5 rad here, 0.3 rad in the other file"},
      {{"axis xyz=\"0 1 0\"", "axis xyz=\"0 -1 0\""}, "axis with the other sign"}};
  for (const auto& [edit, words] : cases) {
    Write("wrong.urdf", ApplyEdits(right, {edit}));
    const std::string out = Expect(1, "wrong.urdf right.urdf --quiet").out;
    EXPECT_THAT(FirstCause(out), AllOf(HasSubstr("joint bend"), HasSubstr(words)));
    // Nothing beside it is a cause.
    EXPECT_THAT(out, Not(HasSubstr("  2. ")));
  }
}

// One number in the middle of a robot whose others are all rounded.
TEST_F(Digits, AMistakeIsTheOnlyCause) {
  const std::string rounded = RoundNumbers(kPanda, 5);
  const std::string mass = "<mass value=\"3.2286\"/>";
  const size_t link = rounded.find(mass);
  ASSERT_NE(link, std::string::npos);
  const size_t com = rounded.rfind("<origin xyz=\"", link) + 13;
  struct Case {
    const char* check;
    std::string text;
  };
  const double x = std::stod(rounded.substr(com));
  for (const Case& one : {Case{"link_mass", ReplaceOnce(rounded, mass, "<mass value=\"3.2609\"/>")},  // 1 %
                          {"link_com", std::string(rounded).replace(com, rounded.find(' ', com) - com,
                                                                    fmt::format("{:.5g}", x + 0.001))}}) {
    SCOPED_TRACE(one.check);
    Write("wrong.urdf", one.text);
    const Json results = Compare(1, "wrong.urdf", kPandaXml);
    EXPECT_EQ(results.at("outcome"), "differ");
    const Json& exceeds = results.at("digits").at("exceeds");
    ASSERT_FALSE(exceeds.empty());
    EXPECT_EQ(exceeds.at(0).at("check"), one.check);
    EXPECT_THAT(exceeds.at(0).at("where"), HasSubstr("panda_link3"));
    EXPECT_GT(exceeds.at(0).at("units"), 5.0);
    // Other links are not blamed.
    for (const Json& excess : exceeds) {
      if (excess.at("check") == "link_mass" || excess.at("check") == "link_com" ||
          excess.at("check") == "link_inertia")
        EXPECT_THAT(excess.at("where"), HasSubstr("panda_link3"));
    }
    const std::string out = Expect(1, "consistency wrong.urdf " + kPandaXml + " --samples 50 --quiet").out;
    EXPECT_THAT(FirstCause(out), HasSubstr("link panda_link3"));
    EXPECT_THAT(out, Not(HasSubstr("  2. ")));
    EXPECT_LE(std::ranges::count(out, '\n'), 24);
    // Quantities that agree are a list of names.
    const std::string whole = Expect(1, "consistency wrong.urdf " + kPandaXml + " --samples 50").out;
    EXPECT_LE(std::ranges::count(whole, '\n'), 48);
    EXPECT_THAT(whole, AllOf(HasSubstr("DIFFERS at "), HasSubstr("  ok: ")));
  }
}

// A slender body, whose axes the engine finds to some digits only: these are its own.
TEST_F(Digits, TheEnginesOwnDiagonalisationIsOpenToo) {
  Copy("pair.urdf");
  WriteChanged("pair.xml", ReadFixture("pair.xml"), "mass=\"1.5\"", "mass=\"1.5\"");
  // One number that the other file has not, so that the tensor is not the one that the MJCF states.
  WriteChanged("digits.urdf", ReadFixture("pair.urdf"), "ixy=\"0.001\"", "ixy=\"0.00100000000001\"");
  EXPECT_EQ(Compare(0, "digits.urdf", "pair.xml").at("outcome"), "digits");
}

}  // namespace
}  // namespace dexcheck::testing::digits_test
