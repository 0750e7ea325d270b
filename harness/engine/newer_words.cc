#include "harness/engine/newer_words.h"

#include <algorithm>
#include <array>
#include <sstream>

#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

// Words that later releases added: the schemas of MuJoCo from 2.3.0 to 3.12.0, compared with that of 2.2.2.

using enum MjcfEffect;

constexpr std::string_view kExpand =
    "load the file in the release that it was written for and save it compiled (mj_saveLastXML), which has "
    "no such element";
constexpr std::string_view kActuatorInertia = "give it to the joint, as armature or damping";

constexpr NewerWord kWords[] = {
    // Words that act on the dynamics, or on nothing when they have a certain value.
    {"frame", "", "3.1.0", kDynamics, "", kExpand},
    {"replicate", "", "3.1.5", kDynamics, "", kExpand},
    {"attach model", "", "3.2.0", kDynamics, "", kExpand},
    {"flexcomp deformable flex", "", "3.0.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"flexvert", "", "3.5.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"flexstrain", "", "3.6.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"composite", "initial curve", "2.3.0", kDynamics, "", kExpand},
    {"plugin", "", "2.3.0", kDynamics, "", "plugins may apply forces; remove them by hand"},
    {"compiler", "alignfree", "3.2.3", kDynamics, "false", "it moves frames of free bodies; set it to false"},
    {"freejoint", "align", "3.2.3", kDynamics, "false",
     "it moves the frame of the free body; set it to false"},
    {"mesh", "inertia", "3.2.5", kDynamics, "legacy",
     "give each body an inertial, or use compiler exactmeshinertia"},
    {"mesh", "builtin params", "3.3.5", kDynamics, "", "save the mesh as a file"},
    {"body", "gravcomp", "2.3.1", kDynamics, "0", "it holds a part of the weight; set it to 0"},
    {"connect", "site1 site2", "3.2.3", kDynamics, "", "give the constraint bodies and an anchor"},
    {"weld", "site1 site2", "3.2.3", kDynamics, "", "give the constraint bodies and a pose"},
    {"spatial fixed", "armature", "3.3.1", kDynamics, "0", "tendons have no inertia in 2.2.2"},
    {"flag", "spring damper", "3.3.6", kDynamics, "enable",
     "the flag passive switches springs and dampers together"},
    {"*", "armature damping", "3.7.0", kDynamics, "0", kActuatorInertia},
    // Words that act on no term, or on motors and contacts alone.
    {"layer", "", "3.2.5", kNone},
    {"rgb", "", "3.2.1", kNone},
    {"dcmotor", "", "3.7.0", kActuators},
    {"orientation", "", "3.11.0", kActuators},
    {"pid", "", "3.12.0", kActuators},
    {"jointactuatorfrc", "", "2.3.7", kNone},
    {"tendonactuatorfrc", "", "3.3.1", kNone},
    {"camprojection", "", "3.0.0", kNone},
    {"distance normal fromto", "", "3.1.6", kNone},
    {"e_potential e_kinetic", "", "3.3.0", kNone},
    {"insidesite tactile sensor/contact", "", "3.3.5", kNone},
    {"extension extension/plugin sensor/plugin", "", "2.3.0", kNone},
    {"actuator/plugin", "", "2.3.0", kActuators},
    {"compiler", "saveinertial", "3.3.1", kNone},
    {"compiler", "conflict", "3.10.0", kNone},
    {"size", "memory", "2.3.0", kNone},
    {"scale rgba", "frustum", "3.0.1", kNone},
    {"rgba", "bv bvactive", "3.1.2", kNone},
    {"global", "realtime", "2.3.0", kNone},
    {"global", "ellipsoidinertia", "2.3.4", kNone},
    {"global", "bvactive", "3.1.2", kNone},
    {"global camera", "orthographic", "3.2.0", kNone},
    {"global", "cameraid", "3.3.4", kNone},
    {"material", "metallic roughness", "3.1.5", kNone},
    {"light", "bulbradius", "3.1.5", kNone},
    {"light", "intensity range texture type", "3.3.3", kNone},
    {"light", "softness", "3.12.0", kNone},
    {"camera", "focal focalpixel principal principalpixel resolution sensorsize", "3.0.0", kNone},
    {"camera", "output projection", "3.5.0", kNone},
    {"texture", "nchannel", "3.2.1", kNone},
    {"texture", "colorspace", "3.3.3", kNone},
    {"texture mesh hfield", "content_type", "2.3.7", kNone},
    {"mesh", "material", "3.3.6", kNone},
    {"mesh", "maxhullvert", "3.2.0", kContacts},
    {"hfield", "elevation", "3.1.2", kContacts},
    {"body flag", "sleep", "3.4.0", kContacts},
    {"body", "simple", "3.11.0", kNone},
    {"joint", "actuatorforcelimited actuatorforcerange", "2.3.7", kActuators},
    {"joint", "actuatorfrclimited actuatorfrcrange", "3.0.0", kActuators},
    {"joint", "actuatorgravcomp", "3.1.4", kActuators},
    {"geom", "adhesion surfacevel", "3.11.0", kContacts},
    {"pair", "adhesion", "3.11.0", kContacts},
    {"pair", "solreffriction", "2.3.6", kContacts},
    {"spatial fixed", "actuatorfrclimited actuatorfrcrange", "3.3.1", kActuators},
    {"flag", "midphase eulerdamp invdiscrete island", "3.0.0", kContacts},
    {"flag", "autoreset", "3.2.1", kContacts},
    {"flag", "nativeccd", "3.2.3", kContacts},
    {"flag", "diagexact", "3.9.0", kContacts},
    {"option", "ls_iterations ls_tolerance o_friction sdf_initpoints sdf_iterations", "3.0.0", kContacts},
    {"option", "actuatorgroupdisable", "3.0.1", kActuators},
    {"option", "ccd_iterations ccd_tolerance", "3.2.3", kContacts},
    {"option", "sleep_tolerance", "3.4.0", kContacts},
    {"lengthrange", "interval", "2.3.3", kActuators},
    {"*", "kv", "3.1.0", kActuators},
    {"*", "dampratio timeconst", "3.1.6", kActuators},
    {"*", "inheritrange", "3.1.3", kActuators},
    {"*", "actearly", "3.0.0", kActuators},
    {"*", "actdim", "2.3.1", kActuators},
    {"*", "actlimited input", "3.11.0", kActuators},
    {"*", "tausmooth", "2.3.6", kActuators},
    {"*", "ffrange velrange", "3.12.0", kActuators},
    {"*", "delay interp nsample", "3.5.0", kActuators},
    {"*", "interval", "3.5.0", kNone},
    {"rangefinder", "camera data", "3.5.0", kNone},
};

}  // namespace

const char* NameOf(MjcfEffect effect) {
  constexpr std::array<const char*, 4> kNames = {"looks, sensors or memory", "contacts, solver or time steps",
                                                 "forces of actuators", "dynamics"};
  return kNames.at(static_cast<size_t>(effect));
}

std::vector<std::string> ListNewerOfActuators() {
  std::vector<std::string> attributes;
  for (const NewerWord& word : kWords) {
    if (word.elements != "*" || word.effect != kActuators) continue;
    std::istringstream names{std::string(word.attributes)};
    for (std::string name; names >> name;) attributes.push_back(name);
  }
  return attributes;
}

const NewerWord* FindNewerWord(std::string_view element, std::string_view attribute) {
  const auto find = [&](std::string_view name) -> const NewerWord* {
    const auto* const found = std::ranges::find_if(kWords, [&](const NewerWord& word) {
      return IsAmong(word.elements, name) && IsAmong(word.attributes, attribute);
    });
    return found == std::end(kWords) ? nullptr : found;
  };
  const NewerWord* const own = find(element);
  return own != nullptr || attribute.empty() ? own : find("*");
}

}  // namespace dexcheck
