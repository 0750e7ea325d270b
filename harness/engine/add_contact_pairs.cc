#include "harness/engine/add_contact_pairs.h"

#include <algorithm>

#include "controller/common/errors.h"
#include "harness/engine/mujoco_release.h"
#include "harness/engine/resized_copy.h"

namespace dexcheck {
namespace {

void FillPair(mjModel* m, int pair, const std::pair<int, int>& geoms) {
  const auto [a, b] = geoms;
  m->name_pairadr[pair] = static_cast<int>(m->nnames - 1);  // no name
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

MjModelPtr AddContactPairs(const mjModel& model, std::span<const std::pair<int, int>> geoms) {
  if (CollidesByType(model)) {
    throw InputError("MJCF: option collision: must be \"predefined\" for plant.collide");
  }
  const auto first = static_cast<int>(model.npair);
  MjModelPtr resized =
      MakeResizedCopy(model, [&](mjModel* m) { m->npair += static_cast<int>(geoms.size()); });
  for (size_t k = 0; k < geoms.size(); ++k) FillPair(resized.get(), first + static_cast<int>(k), geoms[k]);
  return resized;
}

}  // namespace dexcheck
