// Residuals made of known faults and noise of 1: what is named, how large, how sure, and what never is.

#include "harness/diagnosis/cause_estimator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/common/linear_algebra.h"
#include "tests/common/matrix_near.h"

namespace dexcheck::testing::cause_estimator_test {
namespace {

using Eigen::Index;

constexpr Index kRows = 200;
constexpr size_t kCandidates = 50;
// An amplitude is drawn from its own normal distribution: beyond this many standard errors one in 16000.
constexpr double kErrors = 4.0;
// Sums over 200 rows, whose terms are of size 1: their rounding.
constexpr double kRounding = 1e-10;

/// Returns the rest of x beyond columns of full rank: x - C (C^T C)^-1 C^T x.
VectorXd CalcLeftOver(const VectorXd& x, const MatrixXd& C) {
  return x - C * SolveDense(C.transpose() * C, C.transpose() * x);
}

/// Random numbers; every test has a seed of its own.
class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}
  VectorXd Normal() {
    VectorXd x(kRows);
    for (double& one : x) one = normal_(random_);
    return x;
  }
  /// A column that has nothing in common with those.
  VectorXd Beside(const std::vector<VectorXd>& others) {
    MatrixXd all(kRows, static_cast<Index>(others.size()));
    for (size_t i = 0; i < others.size(); ++i) all.col(static_cast<Index>(i)) = others[i];
    return CalcLeftOver(Normal(), all);
  }
  /// Columns of standard normal numbers: an amplitude of 1 is sqrt(N) = 14 standard errors.
  std::vector<Candidate> Candidates(size_t count = kCandidates) {
    std::vector<Candidate> candidates(count);
    for (size_t i = 0; i < count; ++i)
      candidates[i] = {.fault = "torque", .place = "joint " + std::to_string(i), .columns = Normal()};
    return candidates;
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

CauseSelection Select(const VectorXd& y, const std::vector<Candidate>& candidates,
                      const CauseOptions& options = {}) {
  return SelectCauses(y, candidates, options);
}

std::vector<size_t> ChosenOf(const CauseSelection& selection) {
  std::vector<size_t> chosen;
  for (const CauseTerm& term : selection.terms) chosen.push_back(term.candidate);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

/// Returns the candidate's term, or an empty one where it was not chosen, which occurs in no test.
CauseTerm TermOf(const CauseSelection& selection, size_t candidate) {
  for (const CauseTerm& term : selection.terms)
    if (term.candidate == candidate) return term;
  ADD_FAILURE() << "candidate " << candidate << " is not chosen";
  CauseTerm none;
  none.amplitude = none.error = VectorXd::Constant(2, std::nan(""));
  return none;
}

std::vector<size_t> SameOf(const CauseTerm& term) {
  std::vector<size_t> same;
  for (const auto& [candidate, amplitude] : term.same) same.push_back(candidate);
  return same;
}

/// Within standard errors, which are those of a column of this length.
void ExpectAmplitude(const CauseTerm& term, double amplitude, double length) {
  EXPECT_LE(std::abs(term.amplitude[0] - amplitude), kErrors * term.error[0] * TolScale());
  // The variance is that of the residual, 10 % off, and other columns take some of this one's length. Of an
  // amplitude that is known to 99 % the rest is not counted.
  EXPECT_LE(term.error[0], 1.5 / length);
  EXPECT_GE(term.error[0], 0.99 / length);
}

/// Sum of squares that is left over beside the best amplitudes.
double CalcLeft(const VectorXd& y, const MatrixXd& columns) { return CalcLeftOver(y, columns).squaredNorm(); }

class Recovery : public ::testing::TestWithParam<size_t> {};

TEST_P(Recovery, FaultsAreNamedWithTheirAmplitudes) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    Random random(100 + seed);
    const std::vector<Candidate> candidates = random.Candidates();
    VectorXd y = random.Normal();
    std::vector<size_t> faults;
    std::vector<double> amplitudes;
    for (size_t k = 0; k < GetParam(); ++k) {
      faults.push_back((7 * seed + 13 * k) % kCandidates);
      amplitudes.push_back(k % 2 == 0 ? 1.5 + 0.1 * seed : -2.5);
      y += amplitudes.back() * candidates[faults.back()].columns;
    }
    const CauseSelection selection = Select(y, candidates);
    for (size_t k = 0; k < faults.size(); ++k) {
      const CauseTerm term = TermOf(selection, faults[k]);
      ExpectAmplitude(term, amplitudes[k], candidates[faults[k]].columns.norm());
      EXPECT_TRUE(term.same.empty());
    }
    std::sort(faults.begin(), faults.end());
    EXPECT_EQ(ChosenOf(selection), faults);
    EXPECT_NEAR(selection.left, 1.0, 0.2);
    EXPECT_TRUE(
        std::is_sorted(selection.terms.begin(), selection.terms.end(),
                       [](const CauseTerm& a, const CauseTerm& b) { return a.fraction > b.fraction; }));
  }
}

INSTANTIATE_TEST_SUITE_P(Faults, Recovery, ::testing::Values(1, 2, 3));

TEST(CauseEstimator, FractionsAndResidualAreThoseOfTheFit) {
  Random random(1);
  const std::vector<Candidate> candidates = random.Candidates();
  const MatrixXd &a = candidates[3].columns, &b = candidates[4].columns;
  const VectorXd y = 2.0 * a - 3.0 * b + random.Normal();
  const CauseSelection selection = Select(y, candidates);
  ASSERT_EQ(ChosenOf(selection), (std::vector<size_t>{3, 4}));
  MatrixXd both(kRows, 2);
  both << a, b;
  const VectorXd left = CalcLeftOver(y, both);
  EXPECT_TRUE(MatrixNear(selection.residual, left, kRounding));
  EXPECT_NEAR(selection.fraction, 1.0 - left.squaredNorm() / y.squaredNorm(), kRounding);
  EXPECT_NEAR(selection.left, std::sqrt(left.squaredNorm() / kRows), kRounding);
  EXPECT_NEAR(TermOf(selection, 3).fraction, CalcLeft(y, b) / y.squaredNorm(), kRounding);
  EXPECT_NEAR(TermOf(selection, 4).fraction, CalcLeft(y, a) / y.squaredNorm(), kRounding);
}

// |y|^2 is 1e28: what is left of it, 1e4, is less than its rounding.
TEST(CauseEstimator, WhatIsLeftOfLargeResidualsIsNotTheirRounding) {
  Random random(20);
  std::vector<Candidate> candidates = random.Candidates();
  const VectorXd y = 1e13 * candidates[7].columns.col(0) + 5.0 * random.Normal();
  const CauseSelection selection = Select(y, candidates, {.floor = 100.0});
  ASSERT_EQ(ChosenOf(selection), std::vector<size_t>{7});
  const double expected = kRows * std::log(100.0 + selection.residual.squaredNorm() / kRows) +
                          std::log(static_cast<double>(kRows)) +
                          2.0 * std::log(static_cast<double>(candidates.size()));
  EXPECT_NEAR(selection.criterion, expected, 1.0);
}

// log odds = N/2 (log(1 + |r_other|^2 / N) - log(1 + |r|^2 / N)), where both have one amplitude.
TEST(CauseEstimator, WhatExplainsItWorseIsTheRival) {
  for (const double apart : {0.0, 0.05, 0.2, 0.35, 0.5, 1.0}) {
    SCOPED_TRACE(apart);
    Random random(3);
    std::vector<Candidate> candidates = random.Candidates();
    const MatrixXd &c = candidates[10].columns, &other = candidates[20].columns;
    candidates[20].columns = c + apart * random.Beside({c});
    const VectorXd y = 2.0 * c + random.Normal();
    const CauseSelection selection = Select(y, candidates);
    ASSERT_EQ(selection.terms.size(), 1u);
    const CauseTerm& term = selection.terms.front();
    const double log_odds = 0.5 * kRows * std::log((kRows + CalcLeft(y, other)) / (kRows + CalcLeft(y, c)));
    if (std::abs(log_odds) < kEqualLogOdds) {
      EXPECT_LT(apart, 0.3);
      EXPECT_EQ(SameOf(term), std::vector<size_t>{term.candidate == 10 ? 20u : 10u});
      EXPECT_NE(term.rival, term.candidate == 10 ? 20u : 10u);
      if (apart == 0.0) EXPECT_NEAR(term.same.front().second[0], term.amplitude[0], kRounding);
      continue;
    }
    EXPECT_GT(apart, 0.1);
    EXPECT_EQ(term.candidate, 10u);
    EXPECT_TRUE(term.same.empty());
    EXPECT_EQ(term.rival, 20u);
    EXPECT_NEAR(term.log_odds, log_odds, 1e-8 * log_odds);
  }
}

// A spring that does not move is a torque.
TEST(CauseEstimator, WiderCandidateIsOfTheClassWhereItIsOrdinary) {
  for (const bool is_ordinary : {false, true}) {
    SCOPED_TRACE(is_ordinary);
    Random random(4);
    std::vector<Candidate> candidates = random.Candidates();
    MatrixXd both(kRows, 2);
    both << candidates[10].columns, random.Normal();
    candidates[20].columns = both;
    candidates[20].is_ordinary = is_ordinary;
    const VectorXd noise = random.Normal();
    const CauseTerm simple = TermOf(Select(2.0 * both.col(0) + noise, candidates), 10);
    EXPECT_EQ(SameOf(simple), is_ordinary ? std::vector<size_t>{20} : std::vector<size_t>{});
    // With both of its columns it is itself.
    const CauseTerm wide = TermOf(Select(2.0 * both.col(0) - 1.0 * both.col(1) + noise, candidates), 20);
    EXPECT_TRUE(MatrixNear(wide.amplitude, Vector2d(2.0, -1.0), kErrors / std::sqrt(kRows)));
    EXPECT_TRUE(wide.same.empty());
  }
}

TEST(CauseEstimator, NoiseIsNotExplained) {
  constexpr unsigned kSeeds = 200;
  unsigned named = 0, found = 0;
  const std::vector<Candidate> candidates = Random(5).Candidates();
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    const VectorXd noise = Random(1000 + seed).Normal();
    named += Select(noise, candidates).terms.empty() ? 0 : 1;
    // This noise hides no real fault.
    found += ChosenOf(Select(noise + candidates[5].columns, candidates)) == std::vector<size_t>{5} ? 1 : 0;
  }
  EXPECT_LE(named, kSeeds / 100);
  EXPECT_GE(found, kSeeds - kSeeds / 100);
}

TEST(CauseEstimator, NoFrictionIsNegative) {
  Random random(6);
  std::vector<Candidate> candidates = random.Candidates();
  const auto is_positive = [](const VectorXd& a) { return a[0] >= 0.0; };
  candidates[10].is_possible = is_positive;
  const VectorXd c = candidates[10].columns, noise = random.Normal();
  const CauseTerm positive = TermOf(Select(2.0 * c + noise, candidates), 10);
  ExpectAmplitude(positive, 2.0, c.norm());
  EXPECT_TRUE(Select(-2.0 * c + noise, candidates).terms.empty());
  // The best other explanation is taken, and the friction is no member of its class.
  candidates[20].columns = c + 0.1 * random.Normal();
  const CauseSelection other = Select(-2.0 * c + noise, candidates);
  const CauseTerm negative = TermOf(other, 20);
  EXPECT_EQ(other.terms.size(), 1u);
  ExpectAmplitude(negative, -2.0, candidates[20].columns.norm());
  EXPECT_TRUE(negative.same.empty());
  EXPECT_NE(negative.rival, 10u);
}

// Beside the first column alone, the two that contain it share their amplitude with it as they like.
TEST(CauseEstimator, WhatCannotBeIsNotPossibleBesideAPartOfIt) {
  Random random(13);
  std::vector<Candidate> candidates = random.Candidates();
  const VectorXd a = candidates[10].columns, b = random.Normal() - 0.5 * a;
  candidates[20].columns.resize(kRows, 2);
  candidates[20].columns << a, b;
  const auto is_less = [](const VectorXd& x) { return x[0] < 0.9; };
  candidates[10].is_possible = candidates[20].is_possible = is_less;
  const VectorXd noise = random.Normal();
  EXPECT_EQ(ChosenOf(Select(0.5 * a + 0.8 * b + noise, candidates)), std::vector<size_t>{20});
  for (const CauseTerm& term : Select(a + 0.8 * b + noise, candidates).terms) {
    EXPECT_NE(term.candidate, 20u);
    if (term.candidate == 10) EXPECT_LT(term.amplitude[0], 0.9);
  }
}

TEST(CauseEstimator, WhatIsTooFaintToShowIsNotEstimated) {
  for (const bool is_bounded : {false, true}) {
    SCOPED_TRACE(is_bounded);
    Random random(7);
    std::vector<Candidate> candidates = random.Candidates();
    // With the plausible size 1, the second column adds a fifth of the noise to the sum over all rows.
    MatrixXd& C = candidates[10].columns;
    C.conservativeResize(kRows, 2);
    C.col(1) = 0.2 * random.Normal().normalized();
    if (is_bounded) candidates[10].scale = VectorXd::Ones(2);
    const double faint = is_bounded ? 0.0 : 100.0;
    const CauseTerm term =
        TermOf(Select(2.0 * C.col(0) + faint * C.col(1) + random.Normal(), candidates), 10);
    ExpectAmplitude(term, 2.0, C.col(0).norm());
    if (is_bounded) {
      EXPECT_TRUE(std::isinf(term.error[1]));
      EXPECT_LT(std::abs(term.amplitude[1]), 0.1);
    } else {
      EXPECT_LT(std::abs(term.amplitude[1] - faint), kErrors * term.error[1]);
      EXPECT_NEAR(term.error[1], 1.0 / C.col(1).norm(), 0.2 / C.col(1).norm());
    }
  }
}

TEST(CauseEstimator, WhatDoesNotShowAtAnyPlausibleSizeIsNotNamed) {
  Random random(8);
  std::vector<Candidate> candidates = random.Candidates();
  candidates[10].columns = 0.9 * random.Normal().normalized();
  const VectorXd y = 20.0 * candidates[10].columns + random.Normal();
  EXPECT_EQ(ChosenOf(Select(y, candidates)), std::vector<size_t>{10});
  candidates[10].scale = VectorXd::Constant(1, 10.0);
  EXPECT_EQ(ChosenOf(Select(y, candidates)), std::vector<size_t>{10});
  candidates[10].scale = VectorXd::Ones(1);
  EXPECT_TRUE(Select(y, candidates).terms.empty());
}

// y = c + d = -99 c + 100 (c + 0.01 d).
TEST(CauseEstimator, HugeAmplitudesThatCancelAreNotNamed) {
  Random random(9);
  std::vector<Candidate> candidates = random.Candidates();
  const VectorXd c = candidates[10].columns, d = random.Beside({c});
  candidates[20].columns = c + 0.01 * d;
  const VectorXd y = c + d + 0.1 * random.Normal();
  const CauseOptions exact{.floor = 0.01};
  const CauseSelection free = Select(y, candidates, exact);
  ASSERT_EQ(ChosenOf(free), (std::vector<size_t>{10, 20}));
  EXPECT_NEAR(TermOf(free, 10).amplitude[0], -99.0, 5.0);
  EXPECT_NEAR(TermOf(free, 20).amplitude[0], 100.0, 5.0);
  for (Candidate& one : candidates) one.scale = VectorXd::Ones(1);
  const CauseSelection plausible = Select(y, candidates, exact);
  for (const CauseTerm& term : plausible.terms) EXPECT_LE(std::abs(term.amplitude[0]), 3.0);
  EXPECT_GT(plausible.left, 0.5);
}

TEST(CauseEstimator, RowsOfOneNoiseWidenTheErrors) {
  constexpr double kAlike = 9.0;
  Random random(10);
  const std::vector<Candidate> candidates = random.Candidates();
  const VectorXd y = 3.0 * candidates[10].columns - 4.0 * candidates[20].columns + random.Normal();
  const CauseSelection own = Select(y, candidates),
                       alike = Select(y, candidates, {.noise_block_size = kAlike});
  ASSERT_EQ(ChosenOf(own), (std::vector<size_t>{10, 20}));
  ASSERT_EQ(ChosenOf(alike), (std::vector<size_t>{10, 20}));
  for (const size_t fault : {10u, 20u}) {
    EXPECT_EQ(TermOf(alike, fault).amplitude[0], TermOf(own, fault).amplitude[0]);
    EXPECT_NEAR(TermOf(alike, fault).error[0], std::sqrt(kAlike) * TermOf(own, fault).error[0], kRounding);
  }
  // A cause that is certain with 200 rows is not with 200 that are worth 2.
  const VectorXd small = candidates[10].columns + random.Normal();
  EXPECT_EQ(ChosenOf(Select(small, candidates)), std::vector<size_t>{10});
  EXPECT_TRUE(Select(small, candidates, {.noise_block_size = 100.0}).terms.empty());
}

// c3 = c1 + c2 + d is the best one alone. Of 1.5 c1 + c2 it is left behind when c2 follows; to c1 + c2
// nothing after it adds enough, so that the search has to begin again.
TEST(CauseEstimator, WhatIsBestAloneGivesWayToTheBestPair) {
  for (const auto& [a, is_one_place] : {std::pair(1.0, false), {1.5, false}, {1.0, true}}) {
    SCOPED_TRACE(a);
    Random random(11);
    std::vector<Candidate> candidates = random.Candidates();
    for (Candidate& one : candidates)
      if (is_one_place) one.place = "joint";  // as all faults of a signal are
    const VectorXd c1 = candidates[10].columns, c2 = random.Beside({c1});
    candidates[20].columns = c2;
    candidates[30].columns = c1 + c2 + 0.7 * random.Beside({c1, c2});
    const VectorXd y = a * c1 + c2 + random.Normal();
    for (const Candidate& one : candidates)
      ASSERT_LE(CalcLeft(y, candidates[30].columns), CalcLeft(y, one.columns)) << "not the best one alone";
    const CauseSelection selection = Select(y, candidates);
    ASSERT_EQ(ChosenOf(selection), (std::vector<size_t>{10, 20}));
    ExpectAmplitude(TermOf(selection, 10), a, c1.norm());
    ExpectAmplitude(TermOf(selection, 20), 1.0, c2.norm());
  }
}

// c1 + c2 is c3 less c4 as well, of which c3 is the best alone; c4 has been fitted beforehand, and neither c1
// nor c2 does in the place of one of the two.
TEST(CauseEstimator, TwoAreExchangedAtOnce) {
  Random random(13);
  std::vector<Candidate> candidates = random.Candidates(200);
  const VectorXd c1 = candidates[10].columns, c2 = random.Beside({c1}), c4 = random.Beside({c1, c2});
  candidates[20].columns = c2;
  candidates[30].columns = c1 + c2 + 0.5 * c4;
  candidates[40].columns = c4;
  candidates[40].parameters = 6;
  const VectorXd y = 3.0 * (c1 + c2) + random.Normal();
  ASSERT_EQ(ChosenOf(Select(y, {candidates[10], candidates[30], candidates[40]})),
            (std::vector<size_t>{1, 2}));
  EXPECT_EQ(ChosenOf(Select(y, candidates)), (std::vector<size_t>{10, 20}));
}

// Two links turn about one axis: only the sum of their inertias about it shows, and no sizes with a small
// error are made up.
TEST(CauseEstimator, AmplitudesThatOnlyShowTogetherHaveNoError) {
  Random random(31);
  const VectorXd shared = random.Normal();
  std::vector<Candidate> candidates = random.Candidates();
  VectorXd y = 100.0 * shared;
  for (const size_t i : {size_t{3}, size_t{7}}) {
    MatrixXd columns(kRows, 2);
    columns << shared, random.Normal();
    y += 100.0 * columns.col(1);
    candidates[i].columns = columns;
  }
  const CauseSelection selection = Select(y, candidates);
  ASSERT_EQ(selection.terms.size(), 2u);
  EXPECT_NEAR(selection.terms[0].amplitude[0] + selection.terms[1].amplitude[0], 100.0, kRounding);
  for (const CauseTerm& term : selection.terms) {
    EXPECT_NEAR(term.amplitude[0], 50.0, 25.0);
    EXPECT_TRUE(std::isinf(term.error[0])) << term.error[0];
    EXPECT_NEAR(term.amplitude[1], 100.0, kErrors * term.error[1]);
  }
}

}  // namespace
}  // namespace dexcheck::testing::cause_estimator_test
