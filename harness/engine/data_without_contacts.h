#pragma once

#include "harness/engine/engine.h"

namespace dexcheck {

/// Data for what comes before contacts and constraints (mj_kinematics, mj_comPos, mj_rne, ...), without
/// memory for those: in 2.2.2 the engine sets all of it to zero, which costs more than placing all bodies;
/// later releases take it when contacts are found. @throws std::bad_alloc as MakeData.
inline MjDataPtr MakeDataWithoutContacts(const mjModel& model) {
  mjModel sizes = model;  // the arrays stay the model's
  sizes.njmax = 0;
  sizes.nconmax = 0;
  return MakeData(sizes);
}

}  // namespace dexcheck
