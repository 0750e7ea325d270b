// How often the two judgements of a pair of files are one: terms and constants against printed numbers. The
// verdict is the worse one. Pairs are drawn, with faults in what is written; DEXCHECK_DRAWN_SEED=N draws
// others.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "harness/comparison/file_differences.h"
#include "tests/harness/corrections/drawn_faults.h"

namespace dexcheck::testing::file_verdicts_test {
namespace {

struct Tally {
  int pairs = 0, terms_alone = 0, causes_alone = 0;
  std::string details;

  /// Compares two files; `name` says what is wrong in the first.
  void Add(const std::string& name, const std::string& a, const std::string& end_a, const std::string& b) {
    ConsistencyOptions options;
    options.samples = 20;
    options.within_digits = true;
    DescriptionFile first("a" + end_a, a, {});
    DescriptionFile second("b.xml", b, {});
    const Comparison comparison = CompareFiles(&first, &second, {}, options, [](long) { return true; });
    ++pairs;
    if (!comparison.causes || comparison.result.Agrees() == comparison.causes->agrees) return;
    ++(comparison.result.Agrees() ? causes_alone : terms_alone);
    details += fmt::format("\n{} ({}): {}", name, comparison.result.Agrees() ? "causes alone" : "terms alone",
                           ListDifferences(comparison).front());
  }
};

unsigned TakeSeed(unsigned otherwise) {
  const char* const seed = std::getenv("DEXCHECK_DRAWN_SEED");
  return seed == nullptr ? otherwise : otherwise + static_cast<unsigned>(std::atoi(seed));
}

TEST(FileVerdicts, OfTermsAndOfPrintedNumbersAreOne) {
  using Format = WrittenForm::Format;
  std::mt19937 random(TakeSeed(404));
  std::vector<std::string> names = ListFaultNames();
  names.insert(names.end(), 20, "");  // right pairs
  Tally right, wrong;
  for (const std::string& name : names) {
    for (int k = 0, tries = 0; k < 2 && tries < 40; ++tries) {
      const DrawnRobot robot = DrawRobot(&random);
      WrittenForm form_a, form_b;
      form_a.format = tries % 3 == 2 ? Format::kMjcf : Format::kUrdf;
      form_b.format = Format::kMjcf;
      form_b.principal = tries % 2 == 0;
      DrawnRobot changed = robot;
      if (!name.empty() && !MakeFault(name, form_a, &random, &changed)) continue;
      ++k;
      const std::string end = form_a.format == Format::kUrdf ? ".urdf" : ".xml";
      try {
        (name.empty() ? right : wrong)
            .Add(name.empty() ? "right" : name, WriteRobot(changed, form_a), end, WriteRobot(robot, form_b));
      } catch (const std::exception& error) {
        wrong.details += fmt::format("\n{} refused: {}", name, error.what());
      }
    }
  }
  for (const Tally& tally : {right, wrong})
    fmt::print("{} pairs: {} differ in terms alone, {} in printed numbers alone{}\n", tally.pairs,
               tally.terms_alone, tally.causes_alone, tally.details);
  EXPECT_GE(right.pairs, 30);
  EXPECT_EQ(right.terms_alone + right.causes_alone, 0);
  EXPECT_LE(wrong.terms_alone, 0.02 * wrong.pairs);
}

/// An arm whose first link has this frame, turned about z by -yaw from where it is for 0.
std::string WriteArm(const char* yaw, const char* com, const char* moments, const char* place,
                     const char* back) {
  return fmt::format(
      "<robot name='arm'><link name='base'/><link name='upper'><inertial><origin xyz='{}'/><mass "
      "value='2.13'/><inertia {} ixy='0' ixz='0' iyz='0'/></inertial></link><link name='lower'><inertial>"
      "<origin xyz='0.08 -0.01 0.02'/><mass value='0.313'/><inertia ixx='0.00104' iyy='0.00231' "
      "izz='0.00283' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='q1' type='continuous'><parent "
      "link='base'/><child link='upper'/><origin xyz='0 0 0.3' rpy='0 0 {}'/><axis xyz='0 0 1'/></joint>"
      "<joint name='q2' type='continuous'><parent link='upper'/><child link='lower'/><origin xyz='{}' "
      "rpy='0 0 {}'/><axis xyz='0 1 0'/></joint></robot>",
      com, moments, yaw, place, back);
}

// The printed angle turns numbers that are printed exactly.
TEST(FileVerdicts, OfTurnedFramesCountTheDigitsOfTheAngle) {
  DescriptionFile first(
      "a.urdf", WriteArm("0", "0 0.067 0.034", "ixx='0.017' iyy='0.0164' izz='0.006'", "0.1 0.2 0.3", "0"),
      {});
  DescriptionFile second("b.urdf",
                         WriteArm("1.570796", "0.067 0 0.034", "ixx='0.0164' iyy='0.017' izz='0.006'",
                                  "0.2 -0.1 0.3", "-1.570796"),
                         {});
  ConsistencyOptions options;
  options.samples = 20;
  options.within_digits = true;
  const Comparison comparison = CompareFiles(&first, &second, {}, options, [](long) { return true; });
  EXPECT_TRUE(comparison.result.Agrees());
  ASSERT_TRUE(comparison.causes.has_value());
  EXPECT_TRUE(comparison.causes->agrees);
}

}  // namespace
}  // namespace dexcheck::testing::file_verdicts_test
