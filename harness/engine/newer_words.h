#pragma once

// Words of MJCFs that releases of MuJoCo after 2.2.2 added.

#include <string>
#include <string_view>
#include <vector>

namespace dexcheck {

/// Quantities that a newer element or attribute acts on.
enum class MjcfEffect {
  kNone,       ///< Looks, sensors, memory, names.
  kContacts,   ///< Contacts, solver, integration in time: no term of the free robot.
  kActuators,  ///< Forces of motors.
  kDynamics,   ///< M, C v, gravity, friction, or the mechanism itself.
};

/// Elements that 2.2.2 does not have, or attributes that it does not have in any of these elements.
struct NewerWord {
  std::string_view elements;    ///< Separated by blanks; "*" stands for all, "a/b" for b in a.
  std::string_view attributes;  ///< Empty for the elements themselves.
  std::string_view since;       ///< Release, "3.1.4".
  MjcfEffect effect;
  std::string_view neutral = {};  ///< Value with which it has no effect; empty if none is known.
  std::string_view advice = {};   ///< Remedy when it acts on the dynamics.
};

/// The word's entry; nullptr when it is not known. @param attribute empty for the element itself.
const NewerWord* FindNewerWord(std::string_view element, std::string_view attribute);

/// Attributes of any actuator that act on its force and that 2.2.2 does not have.
std::vector<std::string> ListNewerOfActuators();

/// "looks, sensors or memory", "contacts, solver or time steps", "forces of actuators", "dynamics".
const char* NameOf(MjcfEffect effect);

}  // namespace dexcheck
