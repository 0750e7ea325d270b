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

/// Elements whose numbers must be finite: by the array's name, "body_mass" is the mass of a body.
constexpr struct {
  std::string_view prefix;
  const char* kind;
  mjtObj type;
  std::string_view finite;  ///< Attributes, each between blanks.
} kElements[] = {
    {"body_", "body", mjOBJ_BODY, " pos quat ipos iquat mass inertia "},
    {"jnt_", "joint", mjOBJ_JOINT, " pos axis range stiffness "},
    {"dof_", "joint", mjOBJ_JOINT, " armature damping frictionloss "},
    {"geom_", "geom", mjOBJ_GEOM, " pos quat size friction "},
    {"site_", "site", mjOBJ_SITE, " pos quat "},
    {"pair_", "pair", mjOBJ_PAIR, " friction "},
};

template <typename Number>
void CheckArray(const mjModel& model, const std::string& source, const std::string& name,
                const Number* values, size_t rows, size_t columns) {
  for (const auto& element : kElements) {
    if (!name.starts_with(element.prefix)) continue;
    const std::string attribute = name.substr(element.prefix.size());
    if (element.finite.find(" " + attribute + " ") == std::string_view::npos) break;
    for (size_t i = 0; i < rows * columns; ++i) {
      if (std::isfinite(values[i])) continue;
      const auto row = static_cast<int>(i / columns);
      const int id = element.prefix == "dof_" ? model.dof_jntid[row] : row;
      throw InputError(source + ": " + element.kind + " " + Quote(NameOf(model, element.type, id)) + ": " +
                       attribute + " must be finite, got " + FormatNumber(static_cast<double>(values[i])));
    }
  }
  for (size_t i = 0; i < rows * columns; ++i) {
    if (std::isnan(values[i]))
      throw InputError(source + ": " + name + "[" + std::to_string(i) + "] must be a number, got nan");
  }
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
