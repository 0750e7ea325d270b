#pragma once

#include "renders/image.h"

namespace dexcheck {

/// One picture left of the other, with a thin line between. @throws std::invalid_argument unless both are
/// equally high.
Image PlaceBeside(const Image& left, const Image& right);

/// Puts a smaller picture with a thin frame into the lower right corner.
/// @throws std::invalid_argument when it does not fit.
void PlaceInset(const Image& inset, Image* image);

}  // namespace dexcheck
