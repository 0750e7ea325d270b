#include "harness/engine/engine.h"

#include <fmt/format.h>
#include <mujoco/mjxmacro.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <mutex>
#include <new>
#include <string_view>
#include <type_traits>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/engine/exact_collision.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/mujoco_release.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

constexpr int kEngineFailureExitCode = 3;

// Without these the engine writes MUJOCO_LOG.TXT into the working directory.
void InstallMessageHandlers() {
  mju_user_warning = [](const char* message) {
    // This warning has no place; CheckFinite names it.
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

/// Notes on the files that were loaded; commands load a file more than once.
struct LoadNotes {
  std::mutex mutex;
  std::vector<std::string> texts;
  std::vector<std::string> quiet_sources;  // of KeepQuietAbout
};

LoadNotes& AllLoadNotes() {
  static LoadNotes notes;
  return notes;
}

void WarnOnce(const std::string& text, const std::string& source) {
  LoadNotes& notes = AllLoadNotes();
  const std::scoped_lock lock(notes.mutex);
  if (std::ranges::find(notes.quiet_sources, source) != notes.quiet_sources.end()) return;
  if (std::ranges::find(notes.texts, text) != notes.texts.end()) return;
  notes.texts.push_back(text);
  Warn(text);
}

std::string OneLine(std::string text) {
  std::ranges::replace(text, '\n', ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

/// Returns advice on a refusal of the engine's compiler; empty where there is none.
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
  KeepNearFrames(model.get());
  CheckFinite(*model, source);
  if (const int wide = FindWideActuator(*model); wide >= 0) {
    throw InputError(source + ": actuator " + Quote(NameOf(*model, mjOBJ_ACTUATOR, wide)) +
                     ": must have one control and one force");
  }
  if (message[0] != '\0') WarnOnce(source + ": " + OneLine(message), source);
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
  return LoadText(mjcf.PrintFor(CurrentFolder()), mjcf.source());
}

/// Keeps entries of M that are zero for the compiled masses, since the masses may be changed.
void LeaveBodiesGeneral(MjcfFile* mjcf) {
  if (!kHasSimpleBodies) return;
  for (tinyxml2::XMLElement* body : ListElements(mjcf->root(), "body"))
    if (body->Attribute("simple") == nullptr) body->SetAttribute("simple", "false");
}

/// @param load loads the file when nothing need be changed.
template <typename Load>
MjModelPtr LoadAdapted(MjcfFile* mjcf, const Load& load) {
  AdaptMjcf(mjcf);
  LeaveBodiesGeneral(mjcf);
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
  WarnOnce(mjcf->SummarizeChanges(), mjcf->source());
  return model;
}

constexpr const char* kBlanks = " \t\r\n";

/// Attributes that the engine reads as one integer, between blanks.
constexpr std::string_view kIntegers =
    "iterations noslip_iterations mpr_iterations njmax nconmax nstack nuserdata nkey nuser_body"
    " nuser_jnt nuser_geom nuser_site nuser_cam nuser_tendon nuser_actuator nuser_sensor group contype"
    " conaffinity condim priority subgrid offwidth offheight shadowsize offsamples numslices numstacks"
    " numquads nrow ncol dim";
/// Attributes that are sizes of memory, with the largest accepted value: each model fits into some 1 GB.
constexpr std::pair<std::string_view, double> kSizes[] = {
    {"width height nrow ncol offwidth offheight shadowsize", 1 << 13},
    {"njmax nconmax nuserdata nkey nuser_body nuser_jnt nuser_geom nuser_site nuser_cam nuser_tendon"
     " nuser_actuator nuser_sensor",
     1 << 20},
    {"nstack", 1 << 26}};
/// Attributes that may have fewer numbers than the most. At a blank after the last number, 2.2.2 reads it
/// once more: "1 " as a friction of 1 1 0.0001.
constexpr std::string_view kOpenLists =
    "o_solref o_solimp solref solimp solreflimit solimplimit solreffriction solimpfriction"
    " solrefsmooth solimpsmooth solreffix solimpfix size friction fluidcoef gear dynprm gainprm biasprm"
    " user data qpos qvel act mpos mquat ctrl";
/// Attributes of meshes, skins and bones that it reads as lists.
constexpr std::string_view kLists = "vertex normal texcoord face vertid vertweight";

/// Whether a text is numbers and blanks alone. @param integer one integer. A list's ends at the first other.
bool IsNumbers(const char* text, bool integer) {
  int count = 0;
  while (*(text += std::strspn(text, kBlanks)) != '\0') {
    char* end = nullptr;
    const double value = std::strtod(text, &end);
    const bool is_cut_off = end == text || (*end != '\0' && std::strchr(kBlanks, *end) == nullptr);
    if (is_cut_off || !std::isfinite(value) || (integer && value != std::trunc(value))) return false;
    text = end;
    ++count;
  }
  return !integer || count == 1;
}

/// Returns the largest value of an attribute that is a size; infinite for others.
double MostOf(std::string_view name) {
  const auto* const size =
      std::ranges::find_if(kSizes, [&](const auto& one) { return IsAmong(one.first, name); });
  return size == std::end(kSizes) ? std::numeric_limits<double>::infinity() : size->second;
}

/// Returns the product of a text's numbers.
double Multiply(const char* text) {
  double product = 1.0;
  for (char* end = nullptr;; text = end) {
    const double value = std::strtod(text, &end);
    if (end == text) return product;
    product *= value;
  }
}

/// Elements whose numbers must be finite: by the array's name, "body_mass" is the mass of a body.
constexpr struct {
  std::string_view prefix;
  const char* kind;
  mjtObj type;
  std::string_view finite;  ///< Attributes, between blanks.
} kElements[] = {
    {"body_", "body", mjOBJ_BODY, "pos quat ipos iquat mass inertia"},
    {"jnt_", "joint", mjOBJ_JOINT, "pos axis range stiffness"},
    {"dof_", "joint", mjOBJ_JOINT, "armature damping frictionloss"},
    {"geom_", "geom", mjOBJ_GEOM, "pos quat size friction"},
    {"site_", "site", mjOBJ_SITE, "pos quat"},
    {"pair_", "pair", mjOBJ_PAIR, "friction"},
};

template <typename Number>
void CheckArray(const mjModel& model, const std::string& source, const std::string& name,
                const Number* values, size_t rows, size_t columns) {
  for (const auto& element : kElements) {
    if (!name.starts_with(element.prefix)) continue;
    const std::string attribute = name.substr(element.prefix.size());
    if (!IsAmong(element.finite, attribute)) break;
    for (size_t i = 0; i < rows * columns; ++i) {
      if (std::isfinite(values[i])) continue;
      const auto row = static_cast<int>(i / columns);
      const int id = element.prefix == "dof_" ? model.dof_jntid[row] : row;
      throw InputError(fmt::format("{}: {} {}: {} must be finite, got {}", source, element.kind,
                                   Quote(NameOf(model, element.type, id)), attribute,
                                   FormatNumber(static_cast<double>(values[i]))));
    }
  }
  for (size_t i = 0; i < rows * columns; ++i) {
    if (std::isnan(values[i]))
      throw InputError(fmt::format("{}: {}[{}] must be a number, got nan", source, name, i));
  }
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
      if (!std::filesystem::exists(path)) throw;  // a text in memory
      return Load(path, nullptr, path);           // its refusal has the lines of the file
    }
  });
}

MjModelPtr LoadMjcfText(const std::string& text, const std::string& source) {
  PrepareEngine();
  MjcfFile mjcf(text, source);
  if (mjcf.IsUrdf()) return LoadText(text, source);
  return LoadAdapted(&mjcf, [&] { return kHasSimpleBodies ? LoadDocument(mjcf) : LoadText(text, source); });
}

void KeepQuietAbout(const std::filesystem::path& mjcf) {
  LoadNotes& notes = AllLoadNotes();
  const std::scoped_lock lock(notes.mutex);
  notes.quiet_sources.push_back(mjcf.string());
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

int CountElements(const mjModel& model, mjtObj type) {
  const std::pair<mjtObj, EngineSize> counts[] = {
      {mjOBJ_BODY, model.nbody},  {mjOBJ_JOINT, model.njnt},     {mjOBJ_DOF, model.nv},
      {mjOBJ_SITE, model.nsite},  {mjOBJ_EQUALITY, model.neq},   {mjOBJ_TENDON, model.ntendon},
      {mjOBJ_ACTUATOR, model.nu}, {mjOBJ_SENSOR, model.nsensor}, {mjOBJ_KEY, model.nkey}};
  for (const auto& [kind, count] : counts)
    if (kind == type) return static_cast<int>(count);
  return 0;
}

int FindByName(const mjModel& model, mjtObj type, const std::string& name) {
  const int id = mj_name2id(&model, type, name.c_str());
  if (id >= 0 || !name.starts_with('#')) return id;
  const int number = ParseNumber<int>(name.substr(1)).value_or(-1);
  if (number < 0) return -1;
  const char* const own = mj_id2name(&model, type, number);
  return number < CountElements(model, type) && (own == nullptr || *own == '\0') ? number : -1;
}

bool AreExcluded(const mjModel& model, int body, int other) {
  return std::any_of(model.exclude_signature, model.exclude_signature + model.nexclude, [&](int excluded) {
    return excluded == MakeSignature(body, other) || excluded == MakeSignature(other, body);
  });
}

bool CanTouch(const mjModel& model, int geom) {
  for (int pair = 0; pair < model.npair; ++pair) {
    if (model.pair_geom1[pair] == geom || model.pair_geom2[pair] == geom) return true;
  }
  return model.geom_contype[geom] != 0 || model.geom_conaffinity[geom] != 0;
}

void CheckNumbers(MjcfFile* mjcf) {
  VisitElements(mjcf->root(), [&](tinyxml2::XMLElement* element) {
    const std::string_view kind = element->Name();
    const bool has_lists = kind == "mesh" || kind == "skin" || kind == "bone";
    for (const auto* attribute = element->FirstAttribute(); attribute != nullptr;
         attribute = attribute->Next()) {
      const std::string name = attribute->Name();
      const std::string value = attribute->Value();
      const std::string word = "<" + std::string(kind) + " " + name + ">";
      const size_t end = value.find_last_not_of(kBlanks) + 1;
      if (end < value.size() && IsAmong(kOpenLists, name) && IsNumbers(value.c_str(), false)) {
        element->SetAttribute(name.c_str(), value.substr(0, end).c_str());
        mjcf->Note(*element, word,
                   "read without its last blank, after which 2.2.2 would read one more number");
      }
      const bool is_integer =
          IsAmong(kIntegers, name) || (kind == "texture" && (name == "width" || name == "height"));
      constexpr double kMostParts = 1e5;
      const double most = kind == "composite" && name == "count" ? kMostParts : MostOf(name);
      if (std::isfinite(most) && Multiply(value.c_str()) > most)
        throw InputError(mjcf->FindPlace(*element) + ": " + word + ": must be at most " + FormatNumber(most) +
                         ", got " + Quote(value));
      if (!is_integer && !(has_lists && IsAmong(kLists, name))) continue;
      if (IsNumbers(value.c_str(), is_integer)) continue;
      throw InputError(mjcf->FindPlace(*element) + ": " + word + ": must be " +
                       (is_integer ? "an integer" : "numbers") + ", got " + Quote(value));
    }
  });
}

void CheckFinite(const mjModel& model, const std::string& source) {
  const mjOption& option = model.opt;
  const auto check_option = [&](const char* name, const mjtNum* values, int count) {
    for (int i = 0; i < count; ++i) {
      if (!std::isfinite(values[i]))
        throw InputError(source + ": option " + name + " must be finite, got " + FormatNumber(values[i]));
    }
  };
  for (const auto& [name, value] :
       {std::pair("timestep", option.timestep), std::pair("density", option.density),
        std::pair("viscosity", option.viscosity), std::pair("impratio", option.impratio),
        std::pair("tolerance", option.tolerance), std::pair("noslip_tolerance", option.noslip_tolerance),
        std::pair("o_margin", option.o_margin)}) {
    check_option(name, &value, 1);
  }
  check_option("gravity", option.gravity, 3);
  check_option("wind", option.wind, 3);
  check_option("magnetic", option.magnetic, 3);
  check_option("o_solref", option.o_solref, mjNREF);
  check_option("o_solimp", option.o_solimp, mjNIMP);

#undef MJ_M
#define MJ_M(size) model.size
#define X(type, name, rows, columns)                                              \
  if constexpr (std::is_floating_point_v<type>)                                   \
    CheckArray(model, source, #name, model.name, static_cast<size_t>(model.rows), \
               static_cast<size_t>(columns));
  MJMODEL_POINTERS
#undef X
}

}  // namespace dexcheck
