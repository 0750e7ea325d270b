#pragma once

// What standard output and standard error are: terminals, how wide, and whether they take colours.

#include <string>
#include <string_view>

namespace dexcheck::cli {

/// Columns of the terminal that a descriptor leads to, now; 0 when it is none or does not report them.
int CountColumns(int descriptor);

/// What every line of a table, and of text without long paths, fits.
inline constexpr size_t kColumns = 80;

/// Lines of at most kColumns, broken at blanks; those after the first of each are indented. A word that is
/// longer stays whole.
std::string Wrap(std::string_view text, size_t indent);

enum class Tone { kGood, kBad, kWarning, kFaint };

/// The text in a colour when standard output is a terminal and the environment has no NO_COLOR (no-color.org)
/// and no TERM=dumb; otherwise as it is.
std::string Paint(Tone tone, std::string_view text);

}  // namespace dexcheck::cli
