#include "harness/checks/failure_cause.h"

#include <cstddef>
#include <iterator>

namespace dexcheck {
namespace {

constexpr const char* kNames[] = {"none",
                                  "model",
                                  "sensing",
                                  "control law",
                                  "actuator",
                                  "actuator limit",
                                  "joint limit",
                                  "fingertip slip",
                                  "foot slip",
                                  "wheel slip",
                                  "contact softness",
                                  "tilt",
                                  "solver",
                                  "unmodelled force",
                                  "slope",
                                  "contact geometry",
                                  "wheel geometry",
                                  "collision",
                                  "fingertip rim",
                                  "declared imperfections",
                                  "unexplained"};
static_assert(std::size(kNames) == static_cast<size_t>(Cause::kUnexplained) + 1);

}  // namespace

const char* NameOf(Cause cause) { return kNames[static_cast<size_t>(cause)]; }

}  // namespace dexcheck
