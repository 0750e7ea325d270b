#include "renders/font.h"

#include <ft2build.h>
#include FT_FREETYPE_H

#include <cmath>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

constexpr std::uint32_t kReplacement = 0xfffd;

/// Takes the next character of UTF-8 text.
std::uint32_t NextCharacter(const std::string& text, size_t* position) {
  const auto lead = static_cast<unsigned char>(text[(*position)++]);
  if (lead < 0x80) return lead;
  const int extra = lead >= 0xf0 ? 3 : lead >= 0xe0 ? 2 : lead >= 0xc0 ? 1 : 0;
  if (extra == 0) return kReplacement;
  std::uint32_t code = lead & (0x3fU >> extra);
  for (int k = 0; k < extra; ++k) {
    if (*position >= text.size()) return kReplacement;
    const auto next = static_cast<unsigned char>(text[*position]);
    if ((next & 0xc0U) != 0x80U) return kReplacement;
    code = code << 6U | (next & 0x3fU);
    ++*position;
  }
  return code;
}

}  // namespace

struct Font::Face {
  FT_Library library = nullptr;
  FT_Face face = nullptr;
  int size_64 = 0;

  ~Face() {
    if (face != nullptr) FT_Done_Face(face);
    if (library != nullptr) FT_Done_FreeType(library);
  }
};

std::filesystem::path Font::SystemFolder() { return DEXCHECK_FONT_FOLDER; }

Font::Font(const std::filesystem::path& path) : face_(std::make_unique<Face>()) {
  if (FT_Init_FreeType(&face_->library) != 0) throw Error("FreeType: cannot be initialised");
  const FT_Error error = FT_New_Face(face_->library, path.c_str(), 0, &face_->face);
  if (error != 0) {
    throw InputError(path.string() + ": cannot be used as a font: " +
                     (error == FT_Err_Cannot_Open_Resource ? "cannot be read" : "not a font file"));
  }
}

Font::~Font() = default;

const Font::Glyph& Font::Get(int size_64, std::uint32_t code) {
  const auto [place, is_new] = glyphs_.try_emplace({size_64, code});
  Glyph& glyph = place->second;
  if (!is_new) return glyph;
  if (face_->size_64 != size_64) {
    if (FT_Set_Char_Size(face_->face, 0, size_64, 72, 72) != 0) return glyph;
    face_->size_64 = size_64;
  }
  if (FT_Load_Char(face_->face, code, FT_LOAD_RENDER | FT_LOAD_TARGET_LIGHT) != 0) return glyph;
  const FT_GlyphSlot slot = face_->face->glyph;
  glyph.left = slot->bitmap_left;
  glyph.top = slot->bitmap_top;
  glyph.width = static_cast<int>(slot->bitmap.width);
  glyph.height = static_cast<int>(slot->bitmap.rows);
  glyph.advance = static_cast<double>(slot->linearHoriAdvance) / 65536.0;
  for (int y = 0; y < glyph.height; ++y) {
    const unsigned char* row = slot->bitmap.buffer + y * slot->bitmap.pitch;
    glyph.coverage.insert(glyph.coverage.end(), row, row + glyph.width);
  }
  return glyph;
}

void Font::Visit(const std::string& text, double size, const std::function<void(const Glyph&)>& draw) {
  const int size_64 = static_cast<int>(std::lround(64.0 * size));
  for (size_t position = 0; position < text.size();) draw(Get(size_64, NextCharacter(text, &position)));
}

double Font::Measure(const std::string& text, double size) {
  double width = 0.0;
  Visit(text, size, [&](const Glyph& glyph) { width += glyph.advance; });
  return width;
}

}  // namespace dexcheck
