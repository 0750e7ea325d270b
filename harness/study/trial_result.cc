#include "harness/study/trial_result.h"

namespace dexcheck {
namespace {

constexpr const char* kNames[] = {"tracked",          "slipped", "lost contact", "wheels spun", "diverged",
                                  "checks disagreed", "refused", "crashed",      "timed out"};
static_assert(std::size(kNames) == kNumOutcomes);

}  // namespace

const char* NameOf(Outcome outcome) { return kNames[static_cast<size_t>(outcome)]; }

std::optional<Outcome> FindOutcome(std::string_view name) {
  for (size_t i = 0; i < std::size(kNames); ++i) {
    if (kNames[i] == name) return static_cast<Outcome>(i);
  }
  return std::nullopt;
}

}  // namespace dexcheck
