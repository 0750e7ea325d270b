// Values that are printed for faults of conventions and units, on one link and on all, on four robots whose
// two files have other frames. A sample is tried; all are with
//   DEXCHECK_ALL_MISTAKES=1 build/release/tests/descriptions_test --gtest_filter='Faults.*'

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <regex>

#include "controller/model/rigid_body.h"
#include "harness/descriptions/hypotheses.h"
#include "tests/harness/descriptions/robot_pairs.h"

namespace dexcheck::testing::faults_measurement_test {
namespace {

/// The numbers of a quantity behind "right would be" of a body's line; none where it has not that quantity.
std::vector<double> ReadRight(const std::string& line, const std::string& quantity) {
  std::string part = line.substr(line.find("right would be"));
  const size_t begin = part.find(quantity + " ");
  if (begin == std::string::npos) return {};
  part = part.substr(begin,
                     part.find_first_of(part[begin + quantity.size() + 1] == '[' ? "]" : ",", begin) - begin);
  static const std::regex number(R"(-?\d+\.?\d*(e[-+]?\d+)?)");
  std::vector<double> values;
  for (auto it = std::sregex_iterator(part.begin(), part.end(), number); it != std::sregex_iterator(); ++it) {
    values.push_back(std::stod(it->str()));
  }
  return values;
}

/// Whether what is printed of a body is right to the printed digits, of which there are seven.
bool IsRight(const std::string& line, const MassProperties& body) {
  constexpr double kDigits = 2e-6;
  size_t printed = 0;
  const auto is_right = [&](const char* quantity, const std::vector<double>& right, double scale) {
    const std::vector<double> values = ReadRight(line, quantity);
    printed += values.size();
    bool good = values.empty() || values.size() == right.size();
    for (size_t k = 0; good && k < values.size(); ++k)
      good = std::abs(values[k] - right[k]) <= kDigits * scale;
    return good;
  };
  return is_right("mass", {body.mass}, body.mass) &&
         is_right("com", {body.com.begin(), body.com.end()}, 1.0) &&
         is_right("inertia", ListInertia(body.inertia), body.inertia.trace()) && printed > 0;
}

struct Count {
  int tried = 0;
  int named = 0;
  int values = 0;
  int wrong_values = 0;
  std::string missed;
};

void Try(const RobotPair& pair, const ConventionFault& fault, bool all, Count* count) {
  RobotDescription wrong = pair.a;
  size_t visible = 0;
  for (size_t i = 0; i < wrong.spec.joints.size() && (all || visible == 0); ++i) {
    RobotDescription changed = wrong;
    if (!SpoilLink(fault, i, &changed)) continue;
    wrong = changed;
    ++visible;
  }
  if (visible < (all ? 2U : 1U)) return;
  ++count->tried;
  const std::vector<Hypothesis> found = ExplainDifference(wrong, pair.b);
  std::string lines;
  for (const Hypothesis& hypothesis : found) lines += "\n    " + hypothesis.text;
  const bool named = std::ranges::all_of(fault.ids, [&](const std::string& id) {
    return std::ranges::any_of(
        found, [&](const Hypothesis& one) { return std::ranges::find(one.ids, id) != one.ids.end(); });
  });
  count->named += named ? 1 : 0;
  if (!named) count->missed += "\n  " + pair.name + (all ? " all: " : " one: ") + fault.name + lines;
  for (const Hypothesis& hypothesis : found) {
    for (const std::string& line : hypothesis.values) {
      for (size_t i = 0; i < pair.a.spec.joints.size(); ++i) {
        if (!line.starts_with("link " + pair.a.spec.joints[i].link + ":")) continue;
        ++count->values;
        const MassProperties right = ExpressIn(pair.a.spec.joints[i].body, pair.a.joints[i].X_iL.inverse());
        const bool good = IsRight(line, right);
        count->wrong_values += good ? 0 : 1;
        if (!good) count->missed += "\n  " + pair.name + ": wrong value: " + line;
      }
    }
  }
}

TEST(Faults, AreNamedInWordsWithTheRightValues) {
  const std::vector<ConventionFault>& faults = ListConventionFaults();
  EXPECT_GE(faults.size(), 60U);
  const bool everything = std::getenv("DEXCHECK_ALL_MISTAKES") != nullptr;
  constexpr size_t kSample = 5;  // every fifth case, another one for each robot
  Count count;
  size_t number = 0;
  for (const RobotPair& pair : ListRobotPairs()) {
    for (const ConventionFault& fault : faults) {
      for (const bool all : {false, true}) {
        if (everything || number % kSample == 0) Try(pair, fault, all, &count);
        ++number;
      }
    }
    ++number;
  }
  std::printf("%zu faults on %zu robots, on one link and on all: %d cases, %d named, %d values, %d wrong\n",
              faults.size(), ListRobotPairs().size(), count.tried, count.named, count.values,
              count.wrong_values);
  EXPECT_GE(count.tried, everything ? 480 : 80);
  EXPECT_GE(count.named, 0.95 * count.tried) << count.missed;
  EXPECT_EQ(count.wrong_values, 0) << count.missed;
  EXPECT_GT(count.values, count.tried / 3);
}

}  // namespace
}  // namespace dexcheck::testing::faults_measurement_test
