#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace dexcheck {

/// An outline font, drawn smoothly at any size. For one thread.
class Font {
 public:
  /// Folder of the system's DejaVu fonts: "DejaVuSans.ttf", "DejaVuSans-Bold.ttf".
  static std::filesystem::path SystemFolder();

  /// @throws InputError "PATH: cannot be used as a font: reason".
  explicit Font(const std::filesystem::path& path);
  ~Font();
  Font(const Font&) = delete;
  Font& operator=(const Font&) = delete;

  struct Glyph {
    int left = 0;  ///< From the pen to the bitmap's left edge, pixels.
    int top = 0;   ///< From the base line up to the bitmap's top edge, pixels.
    int width = 0;
    int height = 0;
    double advance = 0.0;                ///< How far the pen moves, pixels.
    std::vector<std::uint8_t> coverage;  ///< width * height, 255 is full.
  };

  /// Width of a text in pixels. @param text UTF-8; @param size of the font in pixels.
  double Measure(const std::string& text, double size);

  /// Calls `draw` with each glyph of the text in turn.
  void Visit(const std::string& text, double size, const std::function<void(const Glyph&)>& draw);

 private:
  struct Face;
  const Glyph& Get(int size_64, std::uint32_t code);

  std::unique_ptr<Face> face_;
  std::map<std::pair<int, std::uint32_t>, Glyph> glyphs_;  // by size in 1/64 pixel and character
};

}  // namespace dexcheck
