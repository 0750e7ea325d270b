#pragma once

#include "harness/corrections/candidate_search.h"

namespace dexcheck {

struct CandidateSearch::Part {
  int node;  ///< The link that carries the body,
  int link;  ///< and that whose inertial it is.
  bool is_fused;
  double extra;  ///< Bits of which of several.
  PrintedInertial given;
  BodyNumbers right;  ///< What it would have to be alone, in its link's frame.
  BodyNumbers open;   ///< What digits of both files leave open of that.
  bool mass_wrong, com_wrong, inertia_wrong;
  std::vector<Pose> origins;  ///< Of its link in its parent's frame, as given and as right.

  /// What a correction of some kinds must put right.
  [[nodiscard]] SiteMask Mask(SiteMask kinds) const { return is_fused ? kBodyMask : kinds; }
  [[nodiscard]] Matrix3d CalcAxes() const { return given.origin.CalcRotation(); }
};

}  // namespace dexcheck
