// ParseStudy: any text is a study or an InputError that names the file; its trials are what it says.

#include "harness/study/study.h"
#include "tests/fuzz/fuzz_target.h"

namespace dexcheck::testing::fuzz {
namespace {

/// Studies with more trials are only read.
constexpr long kMostTrials = 2000;

void UseStudy(const Study& study) {
  Expect(!study.variations.empty() && !study.seeds.empty(), "nothing to vary");
  const long count = CountTrials(study);
  Expect(count >= 1 && count <= kMaxTrials, "number of trials");
  if (study.is_search() || count > kMostTrials) return;
  const std::vector<Trial> trials = ListTrials(study);
  Expect(static_cast<long>(trials.size()) == count, "trials are missing");
  for (size_t i = 0; i < trials.size(); ++i) {
    Expect(trials[i].number == static_cast<long>(i), "order of the trials");
    Expect(trials[i].parameters.size() == study.variations.size(), "number of parameters");
    for (size_t k = 0; k < study.variations.size(); ++k) {
      const double value = trials[i].parameters[k];
      Expect(study.variations[k].from <= value && value <= study.variations[k].to,
             "a parameter outside its range", study.text);
    }
    Expect(ListOverrides(study, trials[i]).size() == study.overrides.size() + study.variations.size(),
           "overrides");
  }
}

}  // namespace
}  // namespace dexcheck::testing::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck::testing::fuzz;
  return Try("study.toml:",
             [&] { UseStudy(dexcheck::ParseStudy(std::string(AsText(data, size)), "study.toml")); });
}
