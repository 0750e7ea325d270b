#pragma once

#include <string>
#include <vector>

namespace dexcheck {

/// The beginning of every result, in the same words in terminal, page and file: the verdict and its causes.
struct Answer {
  enum class Tone { kGood, kOpen, kBad };

  Tone tone = Tone::kGood;
  std::string word;                       ///< "AGREE", "PASS".
  std::string sentence = {};              ///< With its full stop, in lower case.
  std::vector<std::string> causes = {};   ///< A line each; they are numbered.
  std::vector<std::string> remarks = {};  ///< Evidence, or what to do next; a line each.
};

/// Returns the CSS class of a tone: "pass", "open" or "fail".
inline const char* NameOf(Answer::Tone tone) {
  return tone == Answer::Tone::kGood ? "pass" : tone == Answer::Tone::kOpen ? "open" : "fail";
}

}  // namespace dexcheck
