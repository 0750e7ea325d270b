// Study files and the trials that follow from them.

#include <gtest/gtest.h>

#include <array>

#include "controller/common/errors.h"
#include "harness/study/study.h"
#include "tests/common/files.h"

namespace dexcheck::testing::study_reader_test {
namespace {

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

TEST(StudyReader, TruthsAndListsAreValuesToo) {
  const Study study =
      ParseStudy(ReplaceOnce(kStudy, "values = [5, 4.5]", "values = [true, false, [1, 0, 0]]"), "study.toml");
  EXPECT_EQ(study.variations[1].labels, (std::vector<std::string>{"true", "false", "[1, 0, 0]"}));
  EXPECT_EQ(ListOverrides(study, ListTrials(study)[4]).back(), "control.K_v=[1, 0, 0]");
}

const std::string kSearch = R"(name = "best"
scenario = "hold"
constraints = ["peak_effort < 0.8", { require = "held", fraction = 0.9 }]
[search]
method = "cma_es"
count = 100
start = [20, "pd"]
[[objective]]
minimize = "energy + 2 * overshoot"
aggregate = "quantile"
quantile = 0.9
[[vary]]
key = "a"
from = 10
to = 30
[[vary]]
key = "b"
from = 0
to = 1
)";

TEST(StudyReader, ReadsASearch) {
  const Study study = ParseStudy(ReplaceOnce(kSearch, "\"pd\"", "0.25"), "study.toml");
  EXPECT_EQ(study.search.method, SearchMethod::kCmaEs);
  EXPECT_EQ(study.search.count, 96) << "whole generations of 16";
  EXPECT_EQ(study.search.start_values, (std::vector<double>{20, 0.25}));
  ASSERT_EQ(study.objectives.size(), 1U);
  EXPECT_EQ(study.objectives[0].expression, "energy + 2 * overshoot");
  EXPECT_EQ(study.objectives[0].quantile, 0.9);
  ASSERT_EQ(study.constraints.size(), 2U);
  EXPECT_EQ(study.constraints[1].fraction, 0.9);
  EXPECT_EQ(CountTrials(study), 96);
}

TEST(StudyReader, SamplesChooseAmongValues) {
  const Study study = ParseStudy(
      "name = \"s\"\nscenario = \"hold\"\n[sample]\nmethod = \"sobol\"\ncount = 32\n[[vary]]\nkey = "
      "\"a\"\nfrom = 0\nto = 1\n[[vary]]\nkey = \"law\"\nvalues = [\"x\", \"y\", \"z\", \"w\"]\n",
      "study.toml");
  std::array<int, 4> counts{};
  for (const Trial& trial : ListTrials(study)) ++counts.at(static_cast<size_t>(trial.parameters[1]));
  EXPECT_EQ(counts, (std::array<int, 4>{8, 8, 8, 8}));
}

}  // namespace
}  // namespace dexcheck::testing::study_reader_test
