#pragma once

namespace dexcheck {

/// How deep two bodies overlap.
struct Overlap {
  double depth = 0.0;          ///< m; 0 when nothing does.
  int body1 = -1, body2 = -1;  ///< Of the engine.
};

}  // namespace dexcheck
