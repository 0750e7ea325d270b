#pragma once

// The cheapest list of candidates that put all sites right.

#include <vector>

#include "harness/corrections/correction.h"

namespace dexcheck {

/// Candidates of one fault at one place or several.
struct Deal {
  double bits = 0.0;
  std::vector<size_t> sites;       ///< Of the list of sites.
  std::vector<size_t> candidates;  ///< Of the list of candidates.
};

/// A deal and those that put the same right for at most some bits more.
struct ChosenDeal {
  Deal deal;
  std::vector<Deal> rivals;
};

struct Cover {
  std::vector<ChosenDeal> chosen;
  std::vector<size_t> left;  ///< Sites that no candidate puts right.
  double bits = 0.0;
};

/// Greedy by bits saved over the cheapest explanation of each site by itself. @param places of the robot.
Cover FindCover(const std::vector<Site>& sites, const std::vector<CorrectionCandidate>& candidates,
                size_t places);

}  // namespace dexcheck
