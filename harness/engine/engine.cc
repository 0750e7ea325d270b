#include "harness/engine/engine.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <new>

#include "controller/common/errors.h"
#include "harness/engine/torus_collision.h"

namespace dexcheck {
namespace {

static_assert(mjVERSION_HEADER == 222, "dexcheck is written for MuJoCo 2.2.2");

constexpr int kEngineFailureExitCode = 3;

// Without these the engine writes MUJOCO_LOG.TXT into the working directory.
void InstallMessageHandlers() {
  mju_user_warning = [](const char* message) {
    std::fprintf(stderr, "dexcheck: MuJoCo warning: %s\n", message);
  };
  mju_user_error = [](const char* message) {
    std::fprintf(stderr, "dexcheck: MuJoCo error: %s\n", message);
    std::_Exit(kEngineFailureExitCode);
  };
}

void CheckVersion() {
  if (mj_version() == mjVERSION_HEADER) return;
  throw InputError("libmujoco: version " + std::to_string(mjVERSION_HEADER) + " needed (as built), found " +
                   std::to_string(mj_version()));
}

void PrepareEngine() {
  InstallMessageHandlers();
  CheckVersion();
  InstallTorusCollision();
}

std::string OneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

MjModelPtr Load(const std::string& path, const mjVFS* vfs, const std::string& source) {
  char message[1024] = "";
  MjModelPtr model(mj_loadXML(path.c_str(), vfs, message, sizeof(message)));
  if (!model) throw InputError(source + ": not a valid MJCF model: " + OneLine(message));
  if (message[0] != '\0')
    std::fprintf(stderr, "dexcheck: %s: %s\n", source.c_str(), OneLine(message).c_str());
  return model;
}

}  // namespace

MjModelPtr LoadMjcf(const std::filesystem::path& path) {
  PrepareEngine();
  if (!std::filesystem::is_regular_file(path) || !std::ifstream(path)) {
    throw InputError(path.string() + ": cannot be read");
  }
  return Load(path.string(), nullptr, path.string());
}

MjModelPtr LoadMjcfText(const std::string& text, const std::string& source) {
  PrepareEngine();
  const auto vfs = std::make_unique<mjVFS>();
  mj_defaultVFS(vfs.get());
  constexpr const char* kName = "model.xml";
  mj_makeEmptyFileVFS(vfs.get(), kName, static_cast<int>(text.size()));
  std::memcpy(vfs->filedata[mj_findFileVFS(vfs.get(), kName)], text.data(), text.size());
  try {
    MjModelPtr model = Load(kName, vfs.get(), source);
    mj_deleteVFS(vfs.get());
    return model;
  } catch (...) {
    mj_deleteVFS(vfs.get());
    throw;
  }
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

}  // namespace dexcheck
