#include "harness/engine/engine.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <mutex>
#include <new>
#include <system_error>
#include <vector>

#include "controller/common/errors.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/engine/exact_collision.h"
#include "harness/engine/finite_check.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

constexpr int kEngineFailureExitCode = 3;

// Without these the engine writes MUJOCO_LOG.TXT into the working directory.
void InstallMessageHandlers() {
  mju_user_warning = [](const char* message) {
    // Without the place; CheckFinite names it.
    if (std::strstr(message, "XML contains a 'NaN'") != nullptr) return;
    std::fprintf(stderr, "dexcheck: MuJoCo warning: %s\n", message);
  };
  mju_user_error = [](const char* message) {
    std::fprintf(stderr, "dexcheck: MuJoCo error: %s\n", message);
    RemoveTemporaryPaths();
    std::_Exit(kEngineFailureExitCode);
  };
}

void CheckVersion() {
  if (mj_version() == mjVERSION_HEADER) return;
  throw InputError("libmujoco: version must be " + FormatRelease(mjVERSION_HEADER) + ", got " +
                   FormatRelease(mj_version()));
}

void PrepareEngine() {
  InstallMessageHandlers();
  CheckVersion();
  InstallExactCollision();
}

/// What was said of the files that were loaded; commands load a file more than once.
struct LoadNotes {
  std::mutex mutex;
  std::vector<std::string> texts;
};

LoadNotes& AllLoadNotes() {
  static LoadNotes notes;
  return notes;
}

void WarnOnce(const std::string& text) {
  LoadNotes& notes = AllLoadNotes();
  const std::scoped_lock lock(notes.mutex);
  if (std::find(notes.texts.begin(), notes.texts.end(), text) != notes.texts.end()) return;
  notes.texts.push_back(text);
  Warn(text);
}

std::string OneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

/// What to do about what the engine's compiler refuses.
std::string Advise(const std::string& message) {
  for (const char* unresolved :
       {"not found in", "unrecognized name", "unknown default", "invalid qpos size"}) {
    if (message.find(unresolved) != std::string::npos)
      return "; if this is a part for <include>, give the file that includes it";
  }
  if (message.find("mass and inertia of moving bodies") != std::string::npos)
    return "; what a joint moves needs a mass and an inertia about all three axes, in that body or in one "
           "that is fixed to it";
  if (message.find("A + B >= C") != std::string::npos)
    return "; no body has such principal moments: the inertia of that one is wrong, or its unit is";
  return {};
}

MjModelPtr Load(const std::string& path, const mjVFS* vfs, const std::string& source) {
  char message[1024] = "";
  MjModelPtr model(mj_loadXML(path.c_str(), vfs, message, sizeof(message)));
  if (!model) {
    if (std::strstr(message, "Could not allocate memory") != nullptr) throw std::bad_alloc();
    throw InputError(source + ": not a valid MJCF model: " + OneLine(message) + Advise(message));
  }
  CheckFinite(*model, source);
  if (message[0] != '\0') WarnOnce(source + ": " + OneLine(message));
  return model;
}

MjModelPtr LoadText(const std::string& text, const std::string& source) {
  const auto vfs = std::make_unique<mjVFS>();
  mj_defaultVFS(vfs.get());
  constexpr const char* kName = "model.xml";
  AddFile(kName, text, vfs.get());
  try {
    MjModelPtr model = Load(kName, vfs.get(), source);
    mj_deleteVFS(vfs.get());
    return model;
  } catch (...) {
    mj_deleteVFS(vfs.get());
    throw;
  }
}

MjModelPtr LoadDocument(const MjcfFile& mjcf) {
  return LoadText(mjcf.PrintFor(std::filesystem::current_path()), mjcf.source());
}

/// @param load what loads it when nothing need be changed.
template <typename Load>
MjModelPtr LoadAdapted(MjcfFile* mjcf, const Load& load) {
  AdaptMjcf(mjcf);
  if (mjcf->changes().empty()) {
    try {
      return load();
    } catch (const InputError& error) {
      // A range without "limited", which this release requires.
      if (std::strstr(error.what(), "autolimits") == nullptr) throw;
    }
  }
  StateNewDefaults(mjcf);
  MjModelPtr model = LoadDocument(*mjcf);
  WarnOnce(mjcf->SummarizeChanges());
  return model;
}

}  // namespace

MjModelPtr LoadMjcf(const std::filesystem::path& path) {
  MjcfFile document(path);
  return LoadMjcf(&document);
}

MjModelPtr LoadMjcf(MjcfFile* document) {
  PrepareEngine();
  const std::string& path = document->source();
  if (document->IsUrdf()) return Load(path, nullptr, path);
  if (!document->HasWorld()) {
    throw InputError(path +
                     ": has no <worldbody>: it is a part for <include>; give the file that includes it");
  }
  return LoadAdapted(document, [&] {
    try {
      return LoadDocument(*document);
    } catch (const InputError&) {
      return Load(path, nullptr, path);  // its refusal has the lines of the file
    }
  });
}

MjModelPtr LoadMjcfText(const std::string& text, const std::string& source) {
  PrepareEngine();
  MjcfFile mjcf(text, source);
  const auto load = [&] { return LoadText(text, source); };
  return mjcf.IsUrdf() ? load() : LoadAdapted(&mjcf, load);
}

std::vector<std::string> ListLoadNotes() {
  LoadNotes& notes = AllLoadNotes();
  const std::scoped_lock lock(notes.mutex);
  return notes.texts;
}

MjDataPtr MakeData(const mjModel& model) {
  MjDataPtr data(mj_makeData(&model));
  if (!data) throw std::bad_alloc();
  return data;
}

std::string NameOf(const mjModel& model, mjtObj type, int id) {
  const char* name = mj_id2name(&model, type, id);
  return name == nullptr || *name == '\0' ? "#" + std::to_string(id) : name;
}

namespace {

EngineSize CountElements(const mjModel& model, mjtObj type) {
  switch (type) {
    case mjOBJ_BODY:
      return model.nbody;
    case mjOBJ_JOINT:
      return model.njnt;
    case mjOBJ_SITE:
      return model.nsite;
    default:
      return 0;
  }
}

}  // namespace

int FindByName(const mjModel& model, mjtObj type, const std::string& name) {
  const int id = mj_name2id(&model, type, name.c_str());
  if (id >= 0 || !name.starts_with('#')) return id;
  int number = -1;
  const char* const end = name.data() + name.size();
  const std::from_chars_result read = std::from_chars(name.data() + 1, end, number);
  if (read.ec != std::errc() || read.ptr != end || number < 0) return -1;
  const char* const own = mj_id2name(&model, type, number);
  return number < CountElements(model, type) && (own == nullptr || *own == '\0') ? number : -1;
}

bool CanTouch(const mjModel& model, int geom) {
  for (int pair = 0; pair < model.npair; ++pair) {
    if (model.pair_geom1[pair] == geom || model.pair_geom2[pair] == geom) return true;
  }
  return model.geom_contype[geom] != 0 || model.geom_conaffinity[geom] != 0;
}

}  // namespace dexcheck
