#pragma once

// Words of MJCFs that releases of MuJoCo after 2.2.2 added.

#include <string_view>

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

// Words that later releases added: the schemas of MuJoCo from 2.3.0 to 3.12.0, compared with that of 2.2.2.

inline constexpr std::string_view kExpandNewer =
    "load the file in the release that it was written for and save it compiled (mj_saveLastXML), which has "
    "no such element";
inline constexpr std::string_view kActuatorInertia = "give it to the joint, as armature or damping";

inline constexpr NewerWord kNewerWords[] = {
    // Words that act on the dynamics, or on nothing when they have a certain value.
    {"frame", "", "3.1.0", MjcfEffect::kDynamics, "", kExpandNewer},
    {"replicate", "", "3.1.5", MjcfEffect::kDynamics, "", kExpandNewer},
    {"attach model", "", "3.2.0", MjcfEffect::kDynamics, "", kExpandNewer},
    {"flexcomp deformable flex", "", "3.0.0", MjcfEffect::kDynamics, "",
     "deformable bodies are not in 2.2.2"},
    {"flexvert", "", "3.5.0", MjcfEffect::kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"flexstrain", "", "3.6.0", MjcfEffect::kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"composite", "initial curve", "2.3.0", MjcfEffect::kDynamics, "", kExpandNewer},
    {"plugin", "", "2.3.0", MjcfEffect::kDynamics, "", "plugins may apply forces; remove them by hand"},
    {"compiler", "alignfree", "3.2.3", MjcfEffect::kDynamics, "false",
     "it moves frames of free bodies; set it to false"},
    {"freejoint", "align", "3.2.3", MjcfEffect::kDynamics, "false",
     "it moves the frame of the free body; set it to false"},
    {"mesh", "inertia", "3.2.5", MjcfEffect::kDynamics, "legacy",
     "give each body an inertial, or use compiler exactmeshinertia"},
    {"mesh", "builtin params", "3.3.5", MjcfEffect::kDynamics, "", "save the mesh as a file"},
    {"body", "gravcomp", "2.3.1", MjcfEffect::kDynamics, "0", "it holds a part of the weight; set it to 0"},
    {"connect", "site1 site2", "3.2.3", MjcfEffect::kDynamics, "",
     "give the constraint bodies and an anchor"},
    {"weld", "site1 site2", "3.2.3", MjcfEffect::kDynamics, "", "give the constraint bodies and a pose"},
    {"spatial fixed", "armature", "3.3.1", MjcfEffect::kDynamics, "0", "tendons have no inertia in 2.2.2"},
    {"flag", "spring damper", "3.3.6", MjcfEffect::kDynamics, "enable",
     "the flag passive switches springs and dampers together"},
    {"*", "armature damping", "3.7.0", MjcfEffect::kDynamics, "0", kActuatorInertia},
    // Words that act on no term, or on motors and contacts alone.
    {"layer", "", "3.2.5", MjcfEffect::kNone},
    {"rgb", "", "3.2.1", MjcfEffect::kNone},
    {"dcmotor", "", "3.7.0", MjcfEffect::kActuators},
    {"orientation", "", "3.11.0", MjcfEffect::kActuators},
    {"pid", "", "3.12.0", MjcfEffect::kActuators},
    {"jointactuatorfrc", "", "2.3.7", MjcfEffect::kNone},
    {"tendonactuatorfrc", "", "3.3.1", MjcfEffect::kNone},
    {"camprojection", "", "3.0.0", MjcfEffect::kNone},
    {"distance normal fromto", "", "3.1.6", MjcfEffect::kNone},
    {"e_potential e_kinetic", "", "3.3.0", MjcfEffect::kNone},
    {"insidesite tactile sensor/contact", "", "3.3.5", MjcfEffect::kNone},
    {"extension extension/plugin sensor/plugin", "", "2.3.0", MjcfEffect::kNone},
    {"actuator/plugin", "", "2.3.0", MjcfEffect::kActuators},
    {"compiler", "saveinertial", "3.3.1", MjcfEffect::kNone},
    {"compiler", "conflict", "3.10.0", MjcfEffect::kNone},
    {"size", "memory", "2.3.0", MjcfEffect::kNone},
    {"scale rgba", "frustum", "3.0.1", MjcfEffect::kNone},
    {"rgba", "bv bvactive", "3.1.2", MjcfEffect::kNone},
    {"global", "realtime", "2.3.0", MjcfEffect::kNone},
    {"global", "ellipsoidinertia", "2.3.4", MjcfEffect::kNone},
    {"global", "bvactive", "3.1.2", MjcfEffect::kNone},
    {"global camera", "orthographic", "3.2.0", MjcfEffect::kNone},
    {"global", "cameraid", "3.3.4", MjcfEffect::kNone},
    {"material", "metallic roughness", "3.1.5", MjcfEffect::kNone},
    {"light", "bulbradius", "3.1.5", MjcfEffect::kNone},
    {"light", "intensity range texture type", "3.3.3", MjcfEffect::kNone},
    {"light", "softness", "3.12.0", MjcfEffect::kNone},
    {"camera", "focal focalpixel principal principalpixel resolution sensorsize", "3.0.0", MjcfEffect::kNone},
    {"camera", "output projection", "3.5.0", MjcfEffect::kNone},
    {"texture", "nchannel", "3.2.1", MjcfEffect::kNone},
    {"texture", "colorspace", "3.3.3", MjcfEffect::kNone},
    {"texture mesh hfield", "content_type", "2.3.7", MjcfEffect::kNone},
    {"mesh", "material", "3.3.6", MjcfEffect::kNone},
    {"mesh", "maxhullvert", "3.2.0", MjcfEffect::kContacts},
    {"hfield", "elevation", "3.1.2", MjcfEffect::kContacts},
    {"body flag", "sleep", "3.4.0", MjcfEffect::kContacts},
    {"body", "simple", "3.11.0", MjcfEffect::kNone},
    {"joint", "actuatorforcelimited actuatorforcerange", "2.3.7", MjcfEffect::kActuators},
    {"joint", "actuatorfrclimited actuatorfrcrange", "3.0.0", MjcfEffect::kActuators},
    {"joint", "actuatorgravcomp", "3.1.4", MjcfEffect::kActuators},
    {"geom", "adhesion surfacevel", "3.11.0", MjcfEffect::kContacts},
    {"pair", "adhesion", "3.11.0", MjcfEffect::kContacts},
    {"pair", "solreffriction", "2.3.6", MjcfEffect::kContacts},
    {"spatial fixed", "actuatorfrclimited actuatorfrcrange", "3.3.1", MjcfEffect::kActuators},
    {"flag", "midphase eulerdamp invdiscrete island", "3.0.0", MjcfEffect::kContacts},
    {"flag", "autoreset", "3.2.1", MjcfEffect::kContacts},
    {"flag", "nativeccd", "3.2.3", MjcfEffect::kContacts},
    {"flag", "diagexact", "3.9.0", MjcfEffect::kContacts},
    {"option", "ls_iterations ls_tolerance o_friction sdf_initpoints sdf_iterations", "3.0.0",
     MjcfEffect::kContacts},
    {"option", "actuatorgroupdisable", "3.0.1", MjcfEffect::kActuators},
    {"option", "ccd_iterations ccd_tolerance", "3.2.3", MjcfEffect::kContacts},
    {"option", "sleep_tolerance", "3.4.0", MjcfEffect::kContacts},
    {"lengthrange", "interval", "2.3.3", MjcfEffect::kActuators},
    {"*", "kv", "3.1.0", MjcfEffect::kActuators},
    {"*", "dampratio timeconst", "3.1.6", MjcfEffect::kActuators},
    {"*", "inheritrange", "3.1.3", MjcfEffect::kActuators},
    {"*", "actearly", "3.0.0", MjcfEffect::kActuators},
    {"*", "actdim", "2.3.1", MjcfEffect::kActuators},
    {"*", "actlimited input", "3.11.0", MjcfEffect::kActuators},
    {"*", "tausmooth", "2.3.6", MjcfEffect::kActuators},
    {"*", "ffrange velrange", "3.12.0", MjcfEffect::kActuators},
    {"*", "delay interp nsample", "3.5.0", MjcfEffect::kActuators},
    {"*", "interval", "3.5.0", MjcfEffect::kNone},
    {"rangefinder", "camera data", "3.5.0", MjcfEffect::kNone},
};

}  // namespace dexcheck
