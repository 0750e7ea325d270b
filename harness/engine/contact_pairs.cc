#include "harness/engine/contact_pairs.h"

#include <mujoco/mjxmacro.h>

#include <algorithm>
#include <string_view>

#include "controller/common/errors.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/mujoco_release.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

/// The model of the MJCF with so many pairs more, whose numbers nobody has set.
MjModelPtr LoadWithRoom(const std::filesystem::path& mjcf, size_t pairs) {
  MjcfFile document(mjcf);
  tinyxml2::XMLElement* geom = nullptr;
  for (tinyxml2::XMLElement* world : ListChildren(document.root(), "worldbody")) {
    VisitElements(world, [&](tinyxml2::XMLElement* element) {
      const bool is_named = element->Attribute("name") != nullptr;
      if (std::string_view(element->Name()) == "geom" && is_named) geom = element;
    });
  }
  for (size_t i = 0; geom != nullptr && i < pairs; ++i)
    SetAttributes({{"geom1", geom->Attribute("name")}, {"geom2", geom->Attribute("name")}},
                  RequireSection(document.root(), "contact")->InsertNewChildElement("pair"));
  return LoadMjcf(&document);
}

/// Copies the numbers of all elements, in the first rows where there is room for more.
void CopyNumbers(const mjModel& from, mjModel* to) {
#undef MJ_M
#define MJ_M(size) m->size
#define X(type, name, rows, columns)                                                               \
  if (!std::string_view(#name).starts_with("name")) {                                              \
    const mjModel* m = &from;                                                                      \
    std::copy_n(from.name, static_cast<size_t>(m->rows) * static_cast<size_t>(columns), to->name); \
  }
  MJMODEL_POINTERS
#undef X
  to->opt = from.opt;
  to->vis = from.vis;
  to->stat = from.stat;
}

void FillPair(mjModel* m, int pair, const std::pair<int, int>& geoms) {
  const auto [a, b] = geoms;
  m->pair_dim[pair] = 3;
  m->pair_geom1[pair] = a;
  m->pair_geom2[pair] = b;
  m->pair_signature[pair] = MakeSignature(m->geom_bodyid[a], m->geom_bodyid[b]);
  m->pair_margin[pair] = 0.0;
  m->pair_gap[pair] = 0.0;
  const mjtNum solref[mjNREF] = {0.02, 1.0};
  const mjtNum solimp[mjNIMP] = {0.9, 0.95, 0.001, 0.5, 2.0};
  std::copy_n(solref, mjNREF, m->pair_solref + mjNREF * pair);
  std::copy_n(solimp, mjNIMP, m->pair_solimp + mjNIMP * pair);
  constexpr int kOfGeom[5] = {0, 0, 1, 2, 2};  // sliding twice, torsional, rolling twice
  for (int k = 0; k < 5; ++k) {
    m->pair_friction[5 * pair + k] =
        std::max(m->geom_friction[3 * a + kOfGeom[k]], m->geom_friction[3 * b + kOfGeom[k]]);
  }
}

}  // namespace

MjModelPtr AddContactPairs(const mjModel& model, std::span<const std::pair<int, int>> geoms,
                           const std::filesystem::path& mjcf) {
  if (CollidesByType(model))
    throw InputError("MJCF: option collision: must be \"predefined\" for plant.collide");
  const auto first = static_cast<size_t>(model.npair);
  MjModelPtr wider = LoadWithRoom(mjcf, geoms.size());
  if (static_cast<size_t>(wider->npair) != first + geoms.size() || wider->ngeom != model.ngeom)
    throw InputError(mjcf.string() + ": must have a geom with a name for plant.collide");
  CopyNumbers(model, wider.get());
  for (size_t k = 0; k < geoms.size(); ++k) FillPair(wider.get(), static_cast<int>(first + k), geoms[k]);
  return wider;
}

}  // namespace dexcheck
