#include "harness/descriptions/alike_names.h"

#include <algorithm>
#include <cctype>
#include <map>

#include "controller/common/text.h"
#include "harness/descriptions/join_names.h"

namespace dexcheck {
namespace {

using Names = std::vector<std::string>;

size_t CountCommonPrefix(const Names& names) {
  if (names.size() < 2) return 0;
  size_t length = names[0].size();
  for (const std::string& name : names) {
    const auto [own, first] = std::mismatch(name.begin(), name.end(), names[0].begin(), names[0].end());
    length = std::min(length, static_cast<size_t>(own - name.begin()));
  }
  return length;
}

Names Reverse(Names names) {
  for (std::string& name : names) std::ranges::reverse(name);
  return names;
}

Names DropCommonPrefix(Names names) {
  const size_t length = CountCommonPrefix(names);
  for (std::string& name : names) name.erase(0, length);
  return names;
}

/// The names as they are, and without what all begin with, or end with, or both.
std::vector<Names> ListVariants(const Names& names) {
  Names simple;
  for (const std::string& name : names) simple.push_back(SimplifyName(name));
  const Names without_prefix = DropCommonPrefix(simple);
  const auto drop_suffix = [](const Names& some) { return Reverse(DropCommonPrefix(Reverse(some))); };
  return {simple, without_prefix, drop_suffix(simple), drop_suffix(without_prefix)};
}

}  // namespace

std::string SimplifyName(const std::string& name) {
  std::string simple;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      simple += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return simple;
}

Names ListJointNames(const RobotDescription& robot) {
  Names names;
  for (const Joint& joint : robot.spec.joints) names.push_back(joint.name);
  return names;
}

Names FindAlikeNames(const Names& names, const Names& others) {
  if (names.size() != others.size()) return {};
  for (const Names& own : ListVariants(names)) {
    for (const Names& other : ListVariants(others)) {
      std::map<std::string, std::string> found;
      for (size_t i = 0; i < others.size(); ++i) found.emplace(other[i], others[i]);
      if (found.size() != others.size()) continue;
      Names partners;
      for (const std::string& name : own) {
        const auto partner = found.find(name);
        if (partner == found.end()) break;
        partners.push_back(partner->second);
        found.erase(partner);  // its own
      }
      if (partners.size() == names.size()) return partners;
    }
  }
  return {};
}

Names TakeJointNames(const RobotDescription& other, RobotDescription* robot) {
  const Names names = ListJointNames(*robot);
  const Names others = ListJointNames(other);
  Names partners = FindAlikeNames(names, others);
  const bool is_alike = !partners.empty();
  if (!is_alike) {
    for (const int joint : MatchByStructure(*robot, other))
      partners.push_back(others[static_cast<size_t>(joint)]);
  }
  Names renamed;
  for (size_t i = 0; i < partners.size(); ++i) {
    if (names[i] == partners[i]) continue;
    robot->spec.joints[i].name = partners[i];
    renamed.push_back(Quote(names[i]) + " is " + Quote(partners[i]));
  }
  if (renamed.empty()) return {};
  const std::string source = " in " + other.spec.source;
  if (is_alike) return {"joints by other names: " + JoinNames(renamed) + source};
  // These are for the reader to judge, so all of them are named.
  std::string pairs = "joints by other names, matched by the tree, then by places, axes, masses and ranges: ";
  for (const std::string& pair : renamed) pairs += pair + (&pair == &renamed.back() ? source : ", ");
  return {pairs};
}

}  // namespace dexcheck
