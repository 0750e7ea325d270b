#pragma once

// What was found of a difference, before it is put into words.

#include <string>
#include <vector>

#include "harness/descriptions/hypotheses.h"

namespace dexcheck {

struct Finding {
  std::vector<std::string> ids;    ///< Of conventions or numbers; several when nothing tells them apart.
  std::vector<std::string> one;    ///< By id: "inertia looks halved". Whole sentences when `what` is empty.
  std::vector<std::string> many;   ///< By id: "inertias look halved".
  std::string what;                ///< "link" or "joint", or empty.
  std::vector<std::string> parts;  ///< By name.
  size_t total = 0;                ///< How many such parts the robot has.
  bool is_all = false;             ///< All that are wrong in what it is about, and most there are.
  std::vector<std::string> values;
  size_t cells = 0;  ///< Quantities of parts that it explains.
};

Hypothesis ToHypothesis(const Finding& finding, size_t all_cells);

}  // namespace dexcheck
