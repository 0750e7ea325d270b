// Study files and the trials that follow from them.

#include <gtest/gtest.h>

#include <cmath>

#include "controller/common/errors.h"
#include "harness/study/study.h"
#include "tests/common/files.h"
#include "tests/common/throws.h"

namespace dexcheck {
namespace {

using testing::ReplaceOnce;
using testing::Throws;

const std::string kStudy = R"(name = "example"
description = "two keys"
scenario = "hold"
set = ["duration=0.1", "control.f_min=2"]
seeds = [0, 7]
check = true
metrics = ["settling_time", "energy"]

[[vary]]
key = "control.K_p"
from = 1
to = 100
count = 3
spacing = "log"

[[vary]]
key = "control.K_v"
values = [5, 4.5]
)";

TEST(StudyReader, ReadsEveryKey) {
  const Study study = ParseStudy(kStudy, "study.toml");
  EXPECT_EQ(study.name, "example");
  EXPECT_EQ(study.scenario, "hold");
  EXPECT_EQ(study.overrides, (std::vector<std::string>{"duration=0.1", "control.f_min=2"}));
  EXPECT_EQ(study.seeds, (std::vector<std::uint64_t>{0, 7}));
  EXPECT_TRUE(study.check);
  EXPECT_EQ(study.metrics, (std::vector<std::string>{"settling_time", "energy"}));
  ASSERT_EQ(study.variations.size(), 2u);
  EXPECT_EQ(study.variations[0].values, (std::vector<double>{1, 10, 100}));
}

TEST(StudyReader, TextsAreValuesToo) {
  const std::string text =
      ReplaceOnce(ReplaceOnce(kStudy, "values = [5, 4.5]", "values = [\"mass\", \"identity\"]"),
                  "control.K_v", "control.weight");
  const Study study = ParseStudy(text, "study.toml");
  EXPECT_EQ(study.variations[1].labels, (std::vector<std::string>{"mass", "identity"}));
  EXPECT_EQ(study.variations[1].values, (std::vector<double>{0, 1}));
  const std::vector<Trial> trials = ListTrials(study);
  EXPECT_EQ(ListOverrides(study, trials[2]).back(), "control.weight=identity");
  for (const char* mixed : {"values = [5, \"identity\"]", "values = [\"identity\", 5]"}) {
    EXPECT_THROW(ParseStudy(ReplaceOnce(kStudy, "values = [5, 4.5]", mixed), "study.toml"), InputError)
        << mixed;
  }
}

TEST(StudyReader, TrialsAreTheProductTheLastKeyFastest) {
  const Study study = ParseStudy(kStudy, "study.toml");
  const std::vector<Trial> trials = ListTrials(study);
  ASSERT_EQ(trials.size(), 12u);
  for (size_t i = 0; i < trials.size(); ++i) EXPECT_EQ(trials[i].number, static_cast<long>(i));
  EXPECT_EQ(trials[5].seed, 7u);
  EXPECT_EQ(trials[5].parameters, (std::vector<double>{10, 5}));
  EXPECT_EQ(ListOverrides(study, trials[6]), (std::vector<std::string>{"duration=0.1", "control.f_min=2",
                                                                       "control.K_p=10", "control.K_v=4.5"}));
}

TEST(StudyReader, SamplesStayInTheirRanges) {
  for (const std::string method : {"sobol", "latin_hypercube"}) {
    const Study study = ParseStudy("name = \"s\"\nscenario = \"hold\"\n[sample]\nmethod = \"" + method +
                                       "\"\ncount = 64\n[[vary]]\nkey = \"a\"\nfrom = 1\nto = 100\nspacing = "
                                       "\"log\"\n[[vary]]\nkey = \"b\"\nfrom = -2\nto = 2\n",
                                   "study.toml");
    const std::vector<Trial> trials = ListTrials(study);
    ASSERT_EQ(trials.size(), 64u);
    int low_half = 0;
    for (const Trial& trial : trials) {
      EXPECT_GE(trial.parameters[0], 1.0);
      EXPECT_LE(trial.parameters[0], 100.0);
      EXPECT_LE(std::abs(trial.parameters[1]), 2.0);
      if (trial.parameters[0] < 10.0) ++low_half;
    }
    EXPECT_EQ(low_half, 32) << "even in the logarithm";
  }
}

TEST(StudyReader, MistakesAreNamed) {
  const auto fails = [](const std::string& from, const std::string& to, const std::string& message) {
    return Throws<InputError>([&] { return ParseStudy(ReplaceOnce(kStudy, from, to), "study.toml"); },
                              message);
  };
  EXPECT_TRUE(fails("scenario =", "scenaro =", "study.toml:3: scenaro"));
  EXPECT_TRUE(fails("\"energy\"", "\"enrgy\"", "did you mean \"energy\"?"));
  EXPECT_TRUE(fails("to = 100", "to = 1", "study.toml:12: vary[0].to: must be greater than from, got 1"));
  EXPECT_TRUE(fails("from = 1", "from = 0", "from: must be positive, got 0"));
  EXPECT_TRUE(fails("count = 3", "count = 1", "count"));
  EXPECT_TRUE(fails("count = 3", "count = 3\nvalues = [1]", "values"));
  EXPECT_TRUE(fails("control.K_v", "control.K_p", "\"control.K_p\" is varied twice"));
  EXPECT_TRUE(fails("control.K_v", "control.K_v=3", "key: must be a key as --set takes it"));
  EXPECT_TRUE(fails("values = [5, 4.5]", "values = []", "needs at least one value"));
  EXPECT_TRUE(fails("control.f_min=2", "control.f_min", "must be KEY=VALUE"));
  EXPECT_TRUE(fails("seeds = [0, 7]", "seeds = [-1]", "seeds"));
  EXPECT_TRUE(Throws<InputError>(
      [] {
        return ParseStudy(
            "name = \"s\"\nscenario = \"hold\"\n[[vary]]\nkey = \"a\"\nfrom = 0\nto = 1\ncount = "
            "2000\n[[vary]]\nkey = \"b\"\nfrom = 0\nto = 1\ncount = 2000\n",
            "study.toml");
      },
      "vary: makes 4e+06 trials; at most 1000000"));
  // Ranges whose width, or ratio, is no number.
  for (const std::string range :
       {"from = -1e308\nto = 1e308", "from = 1e-300\nto = 1e300\nspacing = \"log\""}) {
    EXPECT_TRUE(Throws<InputError>(
        [&] {
          return ParseStudy(
              "name = \"s\"\nscenario = \"hold\"\n[[vary]]\nkey = \"a\"\ncount = 3\n" + range + "\n",
              "study.toml");
        },
        "to: must not be so far from from"));
  }
}

}  // namespace
}  // namespace dexcheck
