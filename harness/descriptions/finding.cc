#include "harness/descriptions/finding.h"

#include "harness/descriptions/join_names.h"

namespace dexcheck {
namespace {

std::string JoinAlternatives(const std::vector<std::string>& clauses, const char* between) {
  std::string text;
  for (const std::string& clause : clauses) text += (text.empty() ? "" : between) + clause;
  return text;
}

std::string Describe(const Finding& finding) {
  const std::string open = finding.ids.size() > 1 ? " (these two files cannot tell which)" : "";
  if (finding.what.empty()) return JoinAlternatives(finding.one, ", or ") + open;
  if (finding.parts.size() == 1) {
    const bool is_base = finding.what == "joint" && finding.parts[0].empty();
    return (is_base ? "base" : finding.what + " " + finding.parts[0]) + ": " +
           JoinAlternatives(finding.one, ", or ") + open;
  }
  return (finding.is_all ? "all " : "") + JoinAlternatives(finding.many, ", or ") + open + ": " +
         std::to_string(finding.parts.size()) + " of " + std::to_string(finding.total) + " " + finding.what +
         "s" + (finding.is_all ? "" : " (" + JoinNames(finding.parts) + ")");
}

}  // namespace

Hypothesis ToHypothesis(const Finding& finding, size_t all_cells) {
  return {Describe(finding), finding.values,
          static_cast<double>(finding.cells) / static_cast<double>(all_cells), finding.ids, finding.parts};
}

}  // namespace dexcheck
