#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "renders/image.h"

namespace dexcheck {

/// 256 colours for a video's frames, as GIF needs them: 64 spread evenly over all colours, so that what
/// appears later has some, and 192 that divide one picture's colours evenly (Heckbert's median cut).
class Palette {
 public:
  static constexpr int kColors = 256;
  using Color = std::array<std::uint8_t, 3>;

  /// @param picture typical of the video.
  explicit Palette(const Image& picture);

  [[nodiscard]] const std::array<Color, kColors>& colors() const { return colors_; }

  /// The number of a colour that is nearest.
  [[nodiscard]] std::uint8_t Find(const std::uint8_t* rgb) const { return nearest_[CellOf(rgb)]; }

 private:
  /// Colours are told apart by five bits a channel.
  static size_t CellOf(const std::uint8_t* rgb) {
    return static_cast<size_t>(rgb[0] >> 3 << 10 | rgb[1] >> 3 << 5 | rgb[2] >> 3);
  }

  std::array<Color, kColors> colors_ = {};
  std::vector<std::uint8_t> nearest_;  // by cell
};

}  // namespace dexcheck
