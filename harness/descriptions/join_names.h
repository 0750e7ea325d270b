#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "controller/common/text.h"

namespace dexcheck {

/// "a, b, c" on one line: the first few names, and how many more.
inline std::string JoinNames(const std::vector<std::string>& names) {
  constexpr size_t kMaxShown = 8;
  std::string text;
  for (size_t i = 0; i < std::min(names.size(), kMaxShown); ++i) text += (i == 0 ? "" : ", ") + names[i];
  if (names.size() > kMaxShown) text += " and " + std::to_string(names.size() - kMaxShown) + " more";
  return Abbreviate(text);
}

}  // namespace dexcheck
