#pragma once

// The physics engine's model and data as owned objects.

#include <mujoco/mujoco.h>

#include <filesystem>
#include <memory>
#include <string>

#include "harness/engine/mjcf_file.h"

namespace dexcheck {

struct MjModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
struct MjDataDeleter {
  void operator()(mjData* data) const { mj_deleteData(data); }
};
using MjModelPtr = std::unique_ptr<mjModel, MjModelDeleter>;
using MjDataPtr = std::unique_ptr<mjData, MjDataDeleter>;

/// Compiles an MJCF file. Engine warnings go to standard error; an engine error ends the process with exit
/// code 3.
/// @throws InputError when the file cannot be read or compiled, or when the engine library at run time is not
/// the version that this program was built for.
MjModelPtr LoadMjcf(const std::filesystem::path& path);
/// The same of a file that was read; what other releases of the engine have is taken out of the document.
MjModelPtr LoadMjcf(MjcfFile* document);

/// Compiles MJCF text (tests, replays). @throws InputError as LoadMjcf; `source` names the text in messages.
MjModelPtr LoadMjcfText(const std::string& text, const std::string& source);

/// @throws std::bad_alloc when the engine cannot allocate.
MjDataPtr MakeData(const mjModel& model);

/// How many bodies, joints, dofs, sites, tendons, actuators or equality constraints a model has.
int CountElements(const mjModel& model, mjtObj type);

/// Name of an element, or "#ID" when it has none.
std::string NameOf(const mjModel& model, mjtObj type, int id);

/// The body, joint or site of a name as NameOf gives it: "#ID" is one that has none. -1 when there is none.
int FindByName(const mjModel& model, mjtObj type, const std::string& name);

/// Whether a geom takes part in contacts at all: by an explicit pair, or by its contype or conaffinity.
bool CanTouch(const mjModel& model, int geom);

/// Data for what comes before contacts and constraints (mj_kinematics, mj_comPos, mj_rne, ...), without
/// memory for those: in 2.2.2 the engine sets all of it to zero, which costs more than placing all bodies;
/// later releases take it when contacts are found. @throws std::bad_alloc as MakeData.
inline MjDataPtr MakeDataWithoutContacts(const mjModel& model) {
  mjModel sizes = model;  // the arrays stay the model's
  sizes.njmax = 0;
  sizes.nconmax = 0;
  return MakeData(sizes);
}

/// The engine compiles numbers that are not finite into its model and warns at most. This throws instead.
/// @throws InputError "SOURCE: body "NAME": mass must be finite, got nan" for the first such number of the
/// MJCF's options, bodies, joints, geoms, sites and contact pairs, and for a nan anywhere else.
void CheckFinite(const mjModel& model, const std::string& source);

}  // namespace dexcheck
