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
    {"model", "the two descriptions of the robot differ"},
    {"sensing", "the controller gets wrong measurements"},
    {"control law", "the torques are not those of the law, or do not do what is expected"},
    {"actuator", "the motors give other torques than were sent"},
    {"actuator limit", "a motor is at its limit"},
    {"joint limit", "a joint is at the end of its range"},
    {"fingertip slip", "a fingertip slides"},
    {"foot slip", "a foot slides or leaves the ground"},
    {"wheel slip", "a wheel slides"},
    {"contact softness", "contacts creep without sliding"},
    {"tilt", "the platform does not stay level"},
    {"solver", "the engine's solver stopped before its forces fit its motion"},
    {"unmodelled force", "a force acts that neither description has"},
    {"slope", "the floor is not level"},
    {"contact geometry", "a fingertip or the object has another shape"},
    {"wheel geometry", "the wheels have another radius or distance"},
    {"collision", "two bodies touch that must not"},
    {"fingertip rim", "a contact has rolled past the rim of a fingertip"},
    {"declared imperfections", "the scenario's own plant, motors or sensors miss what it expects"},
    {"unexplained", "the engine does not do what the equations say; no cause is known"}};
static_assert(std::size(kWords) == static_cast<size_t>(Cause::kUnexplained) + 1);

}  // namespace

const char* NameOf(Cause cause) { return kWords[static_cast<size_t>(cause)].name; }

const char* DescribeCause(std::string_view name) {
  const auto* const found = std::ranges::find(kWords, name, &Words::name);
  return found == std::end(kWords) ? std::rbegin(kWords)->sentence : found->sentence;
}

}  // namespace dexcheck
