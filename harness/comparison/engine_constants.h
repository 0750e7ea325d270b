#pragma once

// Constants of a model, or of the description that it was made of, against an engine's model.

#include <string>
#include <vector>

#include "harness/comparison/constant_checks.h"
#include "harness/comparison/engine_parts.h"
#include "harness/engine/adapter.h"

namespace dexcheck {

/// Compares constants: mass of each link; damping, armature and range of each joint; gravity; the wheels'
/// radius, place, axis, mass, inertia, damping and armature; the floor they stand on; fingertip radii; the
/// object's mass, inertia, centre of mass, shape and friction; and finds whatever the MJCF has that the
/// analytic model lacks. engine_fields.h says of each field of the engine's model how it is seen.
ConstantChecks CheckConstants(const Adapter& adapter);

/// The file that is compared with an MJCF.
struct FirstFile {
  bool is_file = false;                     ///< Otherwise a run's model, which states all but couplings.
  const RobotDescription* robot = nullptr;  ///< Its robot, as CompletePair left it; null: it states all.
  std::vector<std::string> ignore = {};     ///< Constants that the two files need not share: kIgnorable.
  std::string second_file = {};             ///< The MJCF's name.
  std::vector<EnginePart> parts = {};       ///< Parts besides the mechanism, of another MJCF.
};

/// Compares an MJCF with another file. @param parts of the adapter's engine.
ConstantChecks CheckConstants(const Adapter& adapter, const EngineParts& parts, const FirstFile& first);

}  // namespace dexcheck
