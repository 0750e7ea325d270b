#include "harness/checks/failure_cause.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

namespace dexcheck {
namespace {

struct Words {
  const char* name;
  const char* sentence;
};

constexpr Words kWords[] = {
    {"none", ""},
    {"sensing", "the controller receives wrong measurements"},
    {"model", "the two descriptions of the robot differ"},
    {"actuator", "the motors deliver other torques than the controller sent"},
    {"unexplained", "the engine does not do what the equations say; no cause is known"},
    {"control law", "the torques differ from the control law's, or miss what the scenario expects"},
    {"fingertip rim", "a contact has rolled past the rim of a fingertip"},
    {"contact softness", "contacts creep without sliding"},
    {"collision", "two bodies touch that must stay apart"},
    {"solver", "the engine's solver stopped before it converged"},
    {"tilt", "the platform does not stay level"},
    {"actuator limit", "a motor is at its limit"},
    {"fingertip slip", "a fingertip slides"},
    {"wheel slip", "a wheel slides"},
    {"contact geometry", "a fingertip or the object has another shape"},
    {"wheel geometry", "the wheels have another radius or distance"},
    {"foot slip", "a foot slides or leaves the ground"},
    {"slope", "the floor is not level"},
    {"unmodelled force", "a force acts that neither description has"},
    {"joint limit", "a joint is at the end of its range"},
    {"declared imperfections",
     "the declared imperfections of plant, motors or sensors cost more than the scenario expects"}};
static_assert(std::size(kWords) == static_cast<size_t>(Cause::kDeclared) + 1);

}  // namespace

const char* NameOf(Cause cause) { return kWords[static_cast<size_t>(cause)].name; }

const char* DescribeCause(std::string_view name) {
  const auto* const found = std::ranges::find(kWords, name, &Words::name);
  return found == std::end(kWords) ? kWords[static_cast<size_t>(Cause::kUnexplained)].sentence
                                   : found->sentence;
}

}  // namespace dexcheck
