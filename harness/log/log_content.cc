#include "harness/log/log_content.h"

#include <algorithm>

namespace dexcheck {

std::vector<std::string> ListUnits(const SignalInfo& signal) {
  constexpr std::string_view kSeparator = ", ";
  std::vector<std::string> units;
  for (size_t begin = 0; begin <= signal.unit.size();) {
    const size_t end = std::min(signal.unit.find(kSeparator, begin), signal.unit.size());
    units.push_back(signal.unit.substr(begin, end - begin));
    begin = end + kSeparator.size();
  }
  const auto width = static_cast<size_t>(signal.width);
  if (units.size() != width) units.assign(width, signal.unit);
  return units;
}

bool IsPlainPath(std::string_view name) {
  size_t begin = 0;
  while (begin <= name.size()) {
    const size_t end = std::min(name.find('/', begin), name.size());
    const std::string_view part = name.substr(begin, end - begin);
    if (part.empty() || part == "." || part == "..") return false;
    begin = end + 1;
  }
  return std::none_of(name.begin(), name.end(),
                      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == '\\'; });
}

}  // namespace dexcheck
