#include "harness/cli/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>

namespace dexcheck::cli {
namespace {

bool TakesColors() {
  static const bool takes = [] {
    const char* const no_color = std::getenv("NO_COLOR");
    const char* const term = std::getenv("TERM");
    return ::isatty(STDOUT_FILENO) != 0 && (no_color == nullptr || *no_color == '\0') && term != nullptr &&
           std::string_view(term) != "dumb";
  }();
  return takes;
}

}  // namespace

int CountColumns(int descriptor) {
  winsize size{};
  return ::ioctl(descriptor, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

std::string Wrap(std::string_view text, size_t indent) {
  std::string wrapped;
  size_t column = 0;
  while (true) {
    const size_t begin = text.find_first_not_of(" \n");
    if (begin == std::string_view::npos) return wrapped;
    const std::string_view gap = text.substr(0, begin);
    const std::string_view word = text.substr(begin, text.find_first_of(" \n", begin) - begin);
    text.remove_prefix(begin + word.size());
    if (gap.find('\n') != std::string_view::npos) {
      wrapped += gap;
      column = begin - gap.rfind('\n') - 1;
    } else if (column > indent && column + begin + word.size() > kColumns) {
      wrapped += "\n" + std::string(indent, ' ');
      column = indent;
    } else {
      wrapped += gap;
      column += begin;
    }
    wrapped += word;
    column += word.size();
  }
}

std::string Paint(Tone tone, std::string_view text) {
  if (!TakesColors()) return std::string(text);
  const char* const code = tone == Tone::kGood      ? "32"
                           : tone == Tone::kBad     ? "1;31"
                           : tone == Tone::kWarning ? "33"
                                                    : "2";
  return "\033[" + std::string(code) + "m" + std::string(text) + "\033[0m";
}

}  // namespace dexcheck::cli
