#pragma once

// Matchers for GoogleTest and GoogleMock, for tests of somebody else's robot; the includer links both.
//
//   EXPECT_THAT("robot.urdf", dexcheck::testing::AgreesWith("robot.xml"));
//   EXPECT_THAT(my_functions, dexcheck::testing::AgreesWith("robot.urdf", {.digits = 9}));
//
// (the second with dexcheck::TermFunctions). Differences are listed with place and both values, and the fault
// that explains them is named.

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <ostream>
#include <string>

#include "harness/comparison/consistency.h"
#include "harness/comparison/file_comparison.h"
#include "harness/comparison/file_differences.h"

namespace dexcheck::testing {

/// How two sides are compared.
struct AgreementOptions {
  long samples = 1000;  ///< Random states.
  std::uint64_t seed = 1;
  int digits = 0;  ///< Agreement to this many digits of a term's scale is enough; 0: to rounding.
  UrdfOptions urdf;
  std::vector<std::string> ignore;  ///< Constants that the two need not share: kIgnorable.
};

/// Whether a description, or terms of one's own, agree with a parameter file, a URDF or an MJCF.
class AgreesWithMatcher {
 public:
  AgreesWithMatcher(std::filesystem::path file, AgreementOptions options)
      : file_(std::move(file)), options_(std::move(options)) {}

  bool MatchAndExplain(const TermFunctions& functions, ::testing::MatchResultListener* listener) const {
    return Judge(CompareFunctions(file_, functions, options_.urdf, MakeOptions()), listener);
  }
  bool MatchAndExplain(const std::filesystem::path& other, ::testing::MatchResultListener* listener) const {
    return Judge(CompareFiles(other, file_, options_.urdf, MakeOptions()), listener);
  }

  void DescribeTo(std::ostream* os) const { *os << "agrees with " << file_; }
  void DescribeNegationTo(std::ostream* os) const { *os << "differs from " << file_; }

 private:
  [[nodiscard]] ConsistencyOptions MakeOptions() const {
    ConsistencyOptions options;
    options.samples = options_.samples;
    options.seed = options_.seed;
    options.ignore = options_.ignore;
    return options;
  }

  bool Judge(Comparison comparison, ::testing::MatchResultListener* listener) const {
    if (options_.digits > 0) comparison.JudgeByTolerance(std::pow(10.0, -options_.digits));
    for (const std::string& line : ListDifferences(comparison)) *listener << "\n  " << line;
    return comparison.Agrees();
  }

  std::filesystem::path file_;
  AgreementOptions options_;
};

inline ::testing::PolymorphicMatcher<AgreesWithMatcher> AgreesWith(const std::filesystem::path& file,
                                                                   const AgreementOptions& options = {}) {
  return ::testing::MakePolymorphicMatcher(AgreesWithMatcher(file, options));
}

}  // namespace dexcheck::testing
