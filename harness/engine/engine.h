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

/// Name of an element, or "#ID" when it has none.
std::string NameOf(const mjModel& model, mjtObj type, int id);

/// The body, joint or site of a name as NameOf gives it: "#ID" is one that has none. -1 when there is none.
int FindByName(const mjModel& model, mjtObj type, const std::string& name);

/// Whether a geom takes part in contacts at all: by an explicit pair, or by its contype or conaffinity.
bool CanTouch(const mjModel& model, int geom);

}  // namespace dexcheck
