#include "harness/engine/finite_check.h"

#include <mujoco/mjxmacro.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <set>
#include <string_view>
#include <type_traits>

#include "controller/common/text.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/mujoco_release.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

/// One attribute of all elements of a kind: `count` entries of `width` numbers.
struct Attribute {
  const char* kind;
  mjtObj type;
  const char* name;
  const mjtNum* values;
  EngineSize count;
  int width;
  const int* owner = nullptr;  ///< Element of each entry where they are not the same.
};

constexpr const char* kBlanks = " \t\r\n";

/// Attributes that the engine reads as one integer.
const std::set<std::string_view> kIntegers = {"iterations",     "noslip_iterations",
                                              "mpr_iterations", "njmax",
                                              "nconmax",        "nstack",
                                              "nuserdata",      "nkey",
                                              "nuser_body",     "nuser_jnt",
                                              "nuser_geom",     "nuser_site",
                                              "nuser_cam",      "nuser_tendon",
                                              "nuser_actuator", "nuser_sensor",
                                              "group",          "contype",
                                              "conaffinity",    "condim",
                                              "priority",       "subgrid",
                                              "offwidth",       "offheight",
                                              "shadowsize",     "offsamples",
                                              "numslices",      "numstacks",
                                              "numquads",       "nrow",
                                              "ncol",           "dim"};

/// Those of which there may be fewer numbers than the most. At a blank behind the last one, 2.2.2 reads that
/// once more: "1 " as a friction of 1 1 0.0001.
const std::set<std::string_view> kOpenLists = {
    "o_solref",       "o_solimp",       "solref",       "solimp",       "solreflimit", "solimplimit",
    "solreffriction", "solimpfriction", "solrefsmooth", "solimpsmooth", "solreffix",   "solimpfix",
    "size",           "friction",       "fluidcoef",    "gear",         "dynprm",      "gainprm",
    "biasprm",        "user",           "data",         "qpos",         "qvel",        "act",
    "mpos",           "mquat",          "ctrl"};

/// Attributes of meshes, skins and bones that it reads as lists.
const std::set<std::string_view> kLists = {"vertex", "normal", "texcoord", "face", "vertid", "vertweight"};

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

}  // namespace

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
      if (end < value.size() && kOpenLists.contains(name) && IsNumbers(value.c_str(), false)) {
        element->SetAttribute(name.c_str(), value.substr(0, end).c_str());
        mjcf->Note(*element, word, "without the blank at its end, at which 2.2.2 reads a number too many");
      }
      const bool is_integer =
          kIntegers.contains(name) || (kind == "texture" && (name == "width" || name == "height"));
      if (!is_integer && !(has_lists && kLists.contains(name))) continue;
      if (IsNumbers(value.c_str(), is_integer)) continue;
      throw InputError(mjcf->FindPlace(*element) + ": " + word + ": must be " +
                       (is_integer ? "an integer" : "numbers") + ", got " + Quote(value));
    }
  });
}

void CheckFinite(const mjModel& model, const std::string& source) {
  const auto check = [&](const mjtNum* values, EngineSize count, const auto& describe) {
    for (EngineSize i = 0; i < count; ++i) {
      if (std::isfinite(values[i])) continue;
      throw InputError(source + ": " + describe(i) + " must be finite, got " + FormatNumber(values[i]));
    }
  };
  const auto option = [](const char* name) {
    return [name](EngineSize) { return std::string("option ") + name; };
  };
  check(&model.opt.timestep, 1, option("timestep"));
  check(model.opt.gravity, 3, option("gravity"));
  check(&model.opt.density, 1, option("density"));
  check(&model.opt.viscosity, 1, option("viscosity"));
  check(&model.opt.impratio, 1, option("impratio"));
  check(&model.opt.tolerance, 1, option("tolerance"));
  check(&model.opt.noslip_tolerance, 1, option("noslip_tolerance"));
  check(&model.opt.o_margin, 1, option("o_margin"));
  check(model.opt.wind, 3, option("wind"));
  check(model.opt.magnetic, 3, option("magnetic"));
  check(model.opt.o_solref, mjNREF, option("o_solref"));
  check(model.opt.o_solimp, mjNIMP, option("o_solimp"));

  const Attribute attributes[] = {
      {"body", mjOBJ_BODY, "pos", model.body_pos, model.nbody, 3},
      {"body", mjOBJ_BODY, "quat", model.body_quat, model.nbody, 4},
      {"body", mjOBJ_BODY, "inertial pos", model.body_ipos, model.nbody, 3},
      {"body", mjOBJ_BODY, "inertial quat", model.body_iquat, model.nbody, 4},
      {"body", mjOBJ_BODY, "mass", model.body_mass, model.nbody, 1},
      {"body", mjOBJ_BODY, "inertia", model.body_inertia, model.nbody, 3},
      {"joint", mjOBJ_JOINT, "pos", model.jnt_pos, model.njnt, 3},
      {"joint", mjOBJ_JOINT, "axis", model.jnt_axis, model.njnt, 3},
      {"joint", mjOBJ_JOINT, "range", model.jnt_range, model.njnt, 2},
      {"joint", mjOBJ_JOINT, "stiffness", model.jnt_stiffness, model.njnt, 1},
      {"joint", mjOBJ_JOINT, "armature", model.dof_armature, model.nv, 1, model.dof_jntid},
      {"joint", mjOBJ_JOINT, "damping", model.dof_damping, model.nv, 1, model.dof_jntid},
      {"joint", mjOBJ_JOINT, "frictionloss", model.dof_frictionloss, model.nv, 1, model.dof_jntid},
      {"geom", mjOBJ_GEOM, "pos", model.geom_pos, model.ngeom, 3},
      {"geom", mjOBJ_GEOM, "quat", model.geom_quat, model.ngeom, 4},
      {"geom", mjOBJ_GEOM, "size", model.geom_size, model.ngeom, 3},
      {"geom", mjOBJ_GEOM, "friction", model.geom_friction, model.ngeom, 3},
      {"site", mjOBJ_SITE, "pos", model.site_pos, model.nsite, 3},
      {"site", mjOBJ_SITE, "quat", model.site_quat, model.nsite, 4},
      {"pair", mjOBJ_PAIR, "friction", model.pair_friction, model.npair, 5},
  };
  for (const Attribute& attribute : attributes) {
    check(attribute.values, attribute.count * attribute.width, [&](EngineSize i) {
      const auto entry = static_cast<int>(i / attribute.width);
      const int element = attribute.owner == nullptr ? entry : attribute.owner[entry];
      return std::string(attribute.kind) + " " + Quote(NameOf(model, attribute.type, element)) + ": " +
             attribute.name;
    });
  }

#undef MJ_M
#define MJ_M(size) model.size
#define X(type, name, rows, columns)                                                                     \
  if constexpr (std::is_floating_point_v<type>) {                                                        \
    for (size_t i = 0, n = static_cast<size_t>(model.rows) * static_cast<size_t>(columns); i < n; ++i) { \
      if (!std::isnan(model.name[i])) continue;                                                          \
      throw InputError(source + ": " #name "[" + std::to_string(i) + "] must be a number, got nan");     \
    }                                                                                                    \
  }
  MJMODEL_POINTERS
#undef X
}

}  // namespace dexcheck
