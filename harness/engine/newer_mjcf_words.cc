// The schemas of MuJoCo's releases from 2.3.0 to 3.12.0, compared with that of 2.2.2.

#include <algorithm>

#include "harness/engine/newer_mjcf.h"

namespace dexcheck {
namespace {

using enum MjcfEffect;

constexpr std::string_view kExpand =
    "load the file in the release that it was written for and save it compiled (mj_saveLastXML), which has "
    "no such element";
constexpr std::string_view kActuatorInertia = "give it to the joint, as armature or damping";

constexpr NewerWord kWords[] = {
    // Elements.
    {"frame", "", "3.1.0", kDynamics, "", kExpand},
    {"replicate", "", "3.1.5", kDynamics, "", kExpand},
    {"attach", "", "3.2.0", kDynamics, "", kExpand},
    {"model", "", "3.2.0", kDynamics, "", kExpand},
    {"flexcomp", "", "3.0.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"deformable", "", "3.0.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"flex", "", "3.0.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"flexvert", "", "3.5.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"flexstrain", "", "3.6.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"extension", "", "2.3.0", kDynamics, "", "plugins may apply forces; remove them by hand"},
    {"plugin", "", "2.3.0", kDynamics, "", "plugins may apply forces; remove them by hand"},
    {"layer", "", "3.2.5", kNone, "", ""},
    {"rgb", "", "3.2.1", kNone, "", ""},
    {"dcmotor", "", "3.7.0", kActuators, "", ""},
    {"orientation", "", "3.11.0", kActuators, "", ""},
    {"pid", "", "3.12.0", kActuators, "", ""},
    {"jointactuatorfrc", "", "2.3.7", kNone, "", ""},
    {"tendonactuatorfrc", "", "3.3.1", kNone, "", ""},
    {"camprojection", "", "3.0.0", kNone, "", ""},
    {"distance", "", "3.1.6", kNone, "", ""},
    {"normal", "", "3.1.6", kNone, "", ""},
    {"fromto", "", "3.1.6", kNone, "", ""},
    {"e_potential", "", "3.3.0", kNone, "", ""},
    {"e_kinetic", "", "3.3.0", kNone, "", ""},
    {"insidesite", "", "3.3.5", kNone, "", ""},
    {"tactile", "", "3.3.5", kNone, "", ""},
    // Attributes of particular elements.
    {"compiler", "alignfree", "3.2.3", kDynamics, "false", "it moves frames of free bodies; set it to false"},
    {"compiler", "saveinertial", "3.3.1", kNone, "", ""},
    {"compiler", "conflict", "3.10.0", kNone, "", ""},
    {"freejoint", "align", "3.2.3", kDynamics, "false",
     "it moves the frame of the free body; set it to false"},
    {"size", "memory", "2.3.0", kNone, "", ""},
    {"scale", "frustum", "3.0.1", kNone, "", ""},
    {"rgba", "frustum", "3.0.1", kNone, "", ""},
    {"rgba", "bv", "3.1.2", kNone, "", ""},
    {"rgba", "bvactive", "3.1.2", kNone, "", ""},
    {"global", "realtime", "2.3.0", kNone, "", ""},
    {"global", "ellipsoidinertia", "2.3.4", kNone, "", ""},
    {"global", "bvactive", "3.1.2", kNone, "", ""},
    {"global", "orthographic", "3.2.0", kNone, "", ""},
    {"global", "cameraid", "3.3.4", kNone, "", ""},
    {"material", "metallic", "3.1.5", kNone, "", ""},
    {"material", "roughness", "3.1.5", kNone, "", ""},
    {"light", "bulbradius", "3.1.5", kNone, "", ""},
    {"light", "intensity", "3.3.3", kNone, "", ""},
    {"light", "range", "3.3.3", kNone, "", ""},
    {"light", "texture", "3.3.3", kNone, "", ""},
    {"light", "type", "3.3.3", kNone, "", ""},
    {"light", "softness", "3.12.0", kNone, "", ""},
    {"camera", "focal", "3.0.0", kNone, "", ""},
    {"camera", "focalpixel", "3.0.0", kNone, "", ""},
    {"camera", "principal", "3.0.0", kNone, "", ""},
    {"camera", "principalpixel", "3.0.0", kNone, "", ""},
    {"camera", "resolution", "3.0.0", kNone, "", ""},
    {"camera", "sensorsize", "3.0.0", kNone, "", ""},
    {"camera", "orthographic", "3.2.0", kNone, "", ""},
    {"camera", "output", "3.5.0", kNone, "", ""},
    {"camera", "projection", "3.5.0", kNone, "", ""},
    {"texture", "nchannel", "3.2.1", kNone, "", ""},
    {"texture", "colorspace", "3.3.3", kNone, "", ""},
    {"texture", "content_type", "2.3.7", kNone, "", ""},
    {"mesh", "content_type", "2.3.7", kNone, "", ""},
    {"mesh", "material", "3.3.6", kNone, "", ""},
    {"mesh", "maxhullvert", "3.2.0", kContacts, "", ""},
    {"mesh", "inertia", "3.2.5", kDynamics, "legacy",
     "give each body an inertial, or use compiler exactmeshinertia"},
    {"mesh", "builtin", "3.3.5", kDynamics, "", "save the mesh as a file"},
    {"mesh", "params", "3.3.5", kDynamics, "", "save the mesh as a file"},
    {"hfield", "content_type", "2.3.7", kNone, "", ""},
    {"hfield", "elevation", "3.1.2", kContacts, "", ""},
    {"body", "gravcomp", "2.3.1", kDynamics, "0", "it holds a part of the weight; set it to 0"},
    {"body", "sleep", "3.4.0", kContacts, "", ""},
    {"body", "simple", "3.11.0", kNone, "", ""},
    {"joint", "actuatorforcelimited", "2.3.7", kActuators, "", ""},
    {"joint", "actuatorforcerange", "2.3.7", kActuators, "", ""},
    {"joint", "actuatorfrclimited", "3.0.0", kActuators, "", ""},
    {"joint", "actuatorfrcrange", "3.0.0", kActuators, "", ""},
    {"joint", "actuatorgravcomp", "3.1.4", kActuators, "", ""},
    {"geom", "adhesion", "3.11.0", kContacts, "", ""},
    {"geom", "surfacevel", "3.11.0", kContacts, "", ""},
    {"pair", "adhesion", "3.11.0", kContacts, "", ""},
    {"pair", "solreffriction", "2.3.6", kContacts, "", ""},
    {"connect", "site1", "3.2.3", kDynamics, "", "give the constraint bodies and an anchor"},
    {"connect", "site2", "3.2.3", kDynamics, "", "give the constraint bodies and an anchor"},
    {"weld", "site1", "3.2.3", kDynamics, "", "give the constraint bodies and a pose"},
    {"weld", "site2", "3.2.3", kDynamics, "", "give the constraint bodies and a pose"},
    {"spatial", "armature", "3.3.1", kDynamics, "0", "tendons have no inertia in 2.2.2"},
    {"fixed", "armature", "3.3.1", kDynamics, "0", "tendons have no inertia in 2.2.2"},
    {"spatial", "actuatorfrclimited", "3.3.1", kActuators, "", ""},
    {"spatial", "actuatorfrcrange", "3.3.1", kActuators, "", ""},
    {"fixed", "actuatorfrclimited", "3.3.1", kActuators, "", ""},
    {"fixed", "actuatorfrcrange", "3.3.1", kActuators, "", ""},
    {"flag", "midphase", "3.0.0", kContacts, "", ""},
    {"flag", "eulerdamp", "3.0.0", kContacts, "", ""},
    {"flag", "invdiscrete", "3.0.0", kContacts, "", ""},
    {"flag", "island", "3.0.0", kContacts, "", ""},
    {"flag", "autoreset", "3.2.1", kContacts, "", ""},
    {"flag", "nativeccd", "3.2.3", kContacts, "", ""},
    {"flag", "sleep", "3.4.0", kContacts, "", ""},
    {"flag", "diagexact", "3.9.0", kContacts, "", ""},
    {"flag", "spring", "3.3.6", kDynamics, "enable",
     "the flag passive switches springs and dampers together"},
    {"flag", "damper", "3.3.6", kDynamics, "enable",
     "the flag passive switches springs and dampers together"},
    {"option", "ls_iterations", "3.0.0", kContacts, "", ""},
    {"option", "ls_tolerance", "3.0.0", kContacts, "", ""},
    {"option", "o_friction", "3.0.0", kContacts, "", ""},
    {"option", "sdf_initpoints", "3.0.0", kContacts, "", ""},
    {"option", "sdf_iterations", "3.0.0", kContacts, "", ""},
    {"option", "actuatorgroupdisable", "3.0.1", kActuators, "", ""},
    {"option", "ccd_iterations", "3.2.3", kContacts, "", ""},
    {"option", "ccd_tolerance", "3.2.3", kContacts, "", ""},
    {"option", "sleep_tolerance", "3.4.0", kContacts, "", ""},
    {"lengthrange", "interval", "2.3.3", kActuators, "", ""},
    // Attributes of all actuators (element "*").
    {"*", "armature", "3.7.0", kDynamics, "0", kActuatorInertia},
    {"*", "damping", "3.7.0", kDynamics, "0", kActuatorInertia},
    {"*", "kv", "3.1.0", kActuators, "", ""},
    {"*", "dampratio", "3.1.6", kActuators, "", ""},
    {"*", "timeconst", "3.1.6", kActuators, "", ""},
    {"*", "inheritrange", "3.1.3", kActuators, "", ""},
    {"*", "actearly", "3.0.0", kActuators, "", ""},
    {"*", "actdim", "2.3.1", kActuators, "", ""},
    {"*", "actlimited", "3.11.0", kActuators, "", ""},
    {"*", "tausmooth", "2.3.6", kActuators, "", ""},
    {"*", "input", "3.11.0", kActuators, "", ""},
    {"*", "ffrange", "3.12.0", kActuators, "", ""},
    {"*", "velrange", "3.12.0", kActuators, "", ""},
    // Of actuators and sensors.
    {"*", "delay", "3.5.0", kActuators, "", ""},
    {"*", "interp", "3.5.0", kActuators, "", ""},
    {"*", "nsample", "3.5.0", kActuators, "", ""},
    {"*", "interval", "3.5.0", kNone, "", ""},
    {"rangefinder", "camera", "3.5.0", kNone, "", ""},
    {"rangefinder", "data", "3.5.0", kNone, "", ""},
};

}  // namespace

const char* NameOf(MjcfEffect effect) {
  switch (effect) {
    case kNone:
      return "looks, sensors or memory";
    case kContacts:
      return "contacts, solver or time steps";
    case kActuators:
      return "forces of actuators";
    case kDynamics:
      break;
  }
  return "dynamics";
}

const NewerWord* FindNewerWord(std::string_view element, std::string_view attribute) {
  const auto find = [&](std::string_view name) -> const NewerWord* {
    const auto* const end = std::end(kWords);
    const auto* const found = std::find_if(std::begin(kWords), end, [&](const NewerWord& word) {
      return word.element == name && word.attribute == attribute;
    });
    return found == end ? nullptr : found;
  };
  const NewerWord* const own = find(element);
  return own != nullptr || attribute.empty() ? own : find("*");
}

}  // namespace dexcheck
