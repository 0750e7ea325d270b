#include "harness/engine/newer_words.h"

#include <algorithm>
#include <array>
#include <vector>

#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

// What later releases added: the schemas of MuJoCo from 2.3.0 to 3.12.0, compared with that of 2.2.2.

using enum MjcfEffect;

constexpr std::string_view kExpand =
    "load the file in the release that it was written for and save it compiled (mj_saveLastXML), which has "
    "no such element";
constexpr std::string_view kActuatorInertia = "give it to the joint, as armature or damping";

/// Of what acts on no term, or on motors and contacts alone: elements, or attributes that each of the
/// elements has.
struct PlainWords {
  std::string_view elements;    ///< Separated by blanks; "*" stands for all, "a/b" for b in a.
  std::string_view attributes;  ///< Empty for the elements themselves.
  std::string_view since;
  MjcfEffect effect;
};

constexpr PlainWords kPlainWords[] = {
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
    {"extension sensor/plugin", "", "2.3.0", kNone},
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

/// What acts on the dynamics, or on nothing with a certain value.
constexpr NewerWord kWords[] = {
    {"frame", "", "3.1.0", kDynamics, "", kExpand},
    {"replicate", "", "3.1.5", kDynamics, "", kExpand},
    {"attach", "", "3.2.0", kDynamics, "", kExpand},
    {"model", "", "3.2.0", kDynamics, "", kExpand},
    {"flexcomp", "", "3.0.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"deformable", "", "3.0.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"flex", "", "3.0.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"flexvert", "", "3.5.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"flexstrain", "", "3.6.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"composite", "initial", "2.3.0", kDynamics, "", kExpand},
    {"composite", "curve", "2.3.0", kDynamics, "", kExpand},
    {"plugin", "", "2.3.0", kDynamics, "", "plugins may apply forces; remove them by hand"},
    {"compiler", "alignfree", "3.2.3", kDynamics, "false", "it moves frames of free bodies; set it to false"},
    {"freejoint", "align", "3.2.3", kDynamics, "false",
     "it moves the frame of the free body; set it to false"},
    {"mesh", "inertia", "3.2.5", kDynamics, "legacy",
     "give each body an inertial, or use compiler exactmeshinertia"},
    {"mesh", "builtin", "3.3.5", kDynamics, "", "save the mesh as a file"},
    {"mesh", "params", "3.3.5", kDynamics, "", "save the mesh as a file"},
    {"body", "gravcomp", "2.3.1", kDynamics, "0", "it holds a part of the weight; set it to 0"},
    {"connect", "site1", "3.2.3", kDynamics, "", "give the constraint bodies and an anchor"},
    {"connect", "site2", "3.2.3", kDynamics, "", "give the constraint bodies and an anchor"},
    {"weld", "site1", "3.2.3", kDynamics, "", "give the constraint bodies and a pose"},
    {"weld", "site2", "3.2.3", kDynamics, "", "give the constraint bodies and a pose"},
    {"spatial", "armature", "3.3.1", kDynamics, "0", "tendons have no inertia in 2.2.2"},
    {"fixed", "armature", "3.3.1", kDynamics, "0", "tendons have no inertia in 2.2.2"},
    {"flag", "spring", "3.3.6", kDynamics, "enable",
     "the flag passive switches springs and dampers together"},
    {"flag", "damper", "3.3.6", kDynamics, "enable",
     "the flag passive switches springs and dampers together"},
    {"*", "armature", "3.7.0", kDynamics, "0", kActuatorInertia},
    {"*", "damping", "3.7.0", kDynamics, "0", kActuatorInertia},
};

std::vector<std::string_view> Split(std::string_view list) {
  std::vector<std::string_view> words;
  while (!list.empty()) {
    const size_t end = std::min(list.find(' '), list.size());
    words.push_back(list.substr(0, end));
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return words.empty() ? std::vector<std::string_view>{""} : words;
}

const std::vector<NewerWord>& ListWords() {
  static const std::vector<NewerWord> all = [] {
    std::vector<NewerWord> list(std::begin(kWords), std::end(kWords));
    for (const PlainWords& words : kPlainWords) {
      for (const std::string_view element : Split(words.elements)) {
        for (const std::string_view attribute : Split(words.attributes))
          list.push_back({element, attribute, words.since, words.effect, "", ""});
      }
    }
    return list;
  }();
  return all;
}

}  // namespace

const char* NameOf(MjcfEffect effect) {
  constexpr std::array<const char*, 4> kNames = {"looks, sensors or memory", "contacts, solver or time steps",
                                                 "forces of actuators", "dynamics"};
  return kNames.at(static_cast<size_t>(effect));
}

const NewerWord* FindNewerWord(std::string_view element, std::string_view attribute) {
  const auto find = [&](std::string_view name) -> const NewerWord* {
    const std::vector<NewerWord>& words = ListWords();
    const auto found = std::find_if(words.begin(), words.end(), [&](const NewerWord& word) {
      return word.element == name && word.attribute == attribute;
    });
    return found == words.end() ? nullptr : &*found;
  };
  const NewerWord* const own = find(element);
  return own != nullptr || attribute.empty() ? own : find("*");
}

}  // namespace dexcheck
