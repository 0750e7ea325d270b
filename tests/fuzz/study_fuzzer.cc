// ParseStudy: any text is a study or an InputError that names the file; its trials are what it says.

#include "controller/common/errors.h"
#include "harness/study/study.h"
#include "tests/fuzz/fuzz_target.h"

namespace dexcheck::fuzz {
namespace {

/// As many as the study makes; what is larger is only read.
constexpr double kMostTrials = 2000;

double CountTrials(const Study& study) {
  double count = static_cast<double>(study.seeds.size());
  if (study.sampling != Sampling::kGrid) return count * static_cast<double>(study.samples);
  for (const Variation& variation : study.variations) count *= static_cast<double>(variation.values.size());
  return count;
}

void UseStudy(const Study& study) {
  Expect(!study.variations.empty() && !study.seeds.empty(), "nothing to vary");
  const double count = CountTrials(study);
  Expect(count >= 1.0 && count <= static_cast<double>(kMaxTrials), "number of trials");
  if (count > kMostTrials) return;
  const std::vector<Trial> trials = ListTrials(study);
  Expect(static_cast<double>(trials.size()) == count, "trials are missing");
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
}  // namespace dexcheck::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck::fuzz;
  try {
    UseStudy(dexcheck::ParseStudy(std::string(AsText(data, size)), "study.toml"));
  } catch (const dexcheck::InputError& error) {
    ExpectGoodMessage(error.what(), "study.toml:");
  }
  return 0;
}
