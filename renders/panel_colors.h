#pragma once

// The colours of what is written over a scene: the video's panel and the live window's controls.

#include "renders/canvas.h"

namespace dexcheck::panel {

inline const Color kText = MakeColor(0xf2f5f8);
inline const Color kFaint = MakeColor(0xa9b5c2);
inline const Color kMark = MakeColor(0xff9a3d);

/// What text stands on; the more opaque, the less of the scene is seen.
inline Color MakeGround(float opacity) { return MakeColor(0x0e141c, opacity); }

}  // namespace dexcheck::panel
