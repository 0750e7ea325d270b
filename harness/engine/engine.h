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
/// Compiles a file that was read; words of other releases of the engine are taken out of the document.
MjModelPtr LoadMjcf(MjcfFile* document);

/// Compiles MJCF text (tests, replays). @throws InputError as LoadMjcf; `source` names the text in messages.
MjModelPtr LoadMjcfText(const std::string& text, const std::string& source);

/// @throws std::bad_alloc when the engine cannot allocate.
MjDataPtr MakeData(const mjModel& model);

/// Returns the number of bodies, joints, dofs, sites, tendons, actuators or equality constraints of a model.
int CountElements(const mjModel& model, mjtObj type);

/// Name of an element, or "#ID" when it has none.
std::string NameOf(const mjModel& model, mjtObj type, int id);

/// Returns the body, joint or site of a name as NameOf gives it: "#ID" is one without a name. -1 if none.
int FindByName(const mjModel& model, mjtObj type, const std::string& name);

/// Whether the MJCF excludes the contacts of two bodies.
bool AreExcluded(const mjModel& model, int body, int other);
/// Whether a geom takes part in contacts: by an explicit pair, or by its contype or conaffinity.
bool CanTouch(const mjModel& model, int geom);

/// Makes data for the stages before contacts and constraints (mj_kinematics, mj_comPos, mj_rne, ...), without
/// memory for those: 2.2.2 sets all of it to zero, which costs more than placing all bodies; later releases
/// take it when contacts are found. @throws std::bad_alloc as MakeData.
inline MjDataPtr MakeDataWithoutContacts(const mjModel& model) {
  mjModel sizes = model;  // the arrays stay the model's
  sizes.njmax = 0;
  sizes.nconmax = 0;
  return MakeData(sizes);
}

/// Checks a model for numbers that are not finite, which the engine compiles with at most a warning.
/// @throws InputError "SOURCE: body "NAME": mass must be finite, got nan" for the first such number of the
/// MJCF's options, bodies, joints, geoms, sites and contact pairs, and for a nan anywhere else.
void CheckFinite(const mjModel& model, const std::string& source);

}  // namespace dexcheck
