#include "harness/corrections/cover.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace dexcheck {
namespace {

constexpr double kConvention = 7.0;    ///< Bits: which of some hundred conventions.
constexpr double kNumber = 2.0;        ///< Bits: a number, beside its digits.
constexpr double kUnexplained = 60.0;  ///< Bits of a site that nothing puts right.
constexpr double kClass = 3.1;         ///< Bits that do not decide.

class CoverFinder {
 public:
  CoverFinder(const std::vector<Site>& sites, const std::vector<CorrectionCandidate>& candidates,
              size_t places)
      : candidates_(candidates),
        which_(std::log2(std::max(2.0, static_cast<double>(places)))),
        is_left_(sites.size(), true) {
    for (const CorrectionCandidate& candidate : candidates) {
      std::vector<size_t>& put_right = put_right_.emplace_back();
      for (const Site& site : candidate.sites) {
        const int found = IndexOf(sites, site);
        if (found >= 0) put_right.push_back(static_cast<size_t>(found));
      }
      std::ranges::sort(put_right);
    }
    alone_.assign(sites.size(), kUnexplained);
    for (size_t c = 0; c < candidates.size(); ++c) {
      for (const size_t site : put_right_[c])
        alone_[site] = std::min(alone_[site], CountBitsOf(c) / static_cast<double>(put_right_[c].size()));
    }
    MakeGroups();
  }

  Cover Run() {
    Cover cover;
    const std::vector<Deal> all = ListDeals();
    while (Contains(is_left_, true)) {
      const std::vector<Deal> deals = ListDeals();
      if (deals.empty()) break;
      size_t best = 0;
      const auto gain = [&](const Deal& deal) {
        double saved = -deal.bits;
        for (const size_t site : deal.sites) saved += alone_[site];
        return saved;
      };
      double most = gain(deals[0]);
      for (size_t d = 1; d < deals.size(); ++d) {
        const double saved = gain(deals[d]);
        if (saved > most + 1e-9 || (saved > most - 1e-9 && deals[d].bits < deals[best].bits)) {
          best = d;
          most = saved;
        }
      }
      if (most <= 1e-9) {
        const auto share = [](const Deal& deal) {
          return deal.bits / static_cast<double>(deal.sites.size());
        };
        best = static_cast<size_t>(std::ranges::min_element(deals, {}, share) - deals.begin());
      }
      ChosenDeal& chosen = cover.chosen.emplace_back();
      chosen.deal = deals[best];
      for (const Deal& deal : deals) {
        if (&deal == &deals[best] || deal.sites != chosen.deal.sites || deal.bits > chosen.deal.bits + kClass)
          continue;
        chosen.rivals.push_back(deal);
      }
      std::ranges::stable_sort(chosen.rivals, {}, &Deal::bits);
      for (const size_t site : chosen.deal.sites) is_left_[site] = false;
    }
    for (const Deal& deal : all) Replace(deal, &cover);
    for (const ChosenDeal& chosen : cover.chosen) cover.bits += chosen.deal.bits;
    for (size_t site = 0; site < is_left_.size(); ++site) {
      if (!is_left_[site]) continue;
      cover.left.push_back(site);
      cover.bits += kUnexplained;
    }
    return cover;
  }

 private:
  /// Takes a deal in the place of several chosen ones that put the same right for more bits: what is cheapest
  /// for each site need not be for all.
  static void Replace(const Deal& deal, Cover* cover) {
    double bits = 0.0;
    size_t sites = 0, within = 0;
    const auto is_within = [&](const ChosenDeal& chosen) {
      return std::ranges::includes(deal.sites, chosen.deal.sites);
    };
    for (const ChosenDeal& chosen : cover->chosen) {
      if (!is_within(chosen)) continue;
      bits += chosen.deal.bits;
      sites += chosen.deal.sites.size();
      ++within;
    }
    if (within < 2 || sites != deal.sites.size() || bits <= deal.bits) return;
    std::erase_if(cover->chosen, is_within);
    cover->chosen.push_back({deal, {}});
  }

  [[nodiscard]] double CountBitsOf(size_t c) const {
    const CorrectionCandidate& candidate = candidates_[c];
    const double beside = candidate.beside ? kConvention + which_ + candidate.beside->bits : 0.0;
    return candidate.bits + (IsNumber(candidate.fault) ? kNumber : kConvention) + which_ + beside;
  }

  /// Groups candidates of one convention, or of equal numbers, at several places.
  void MakeGroups() {
    std::map<std::tuple<int, int, int, int, bool, bool, std::string>, std::vector<size_t>> groups;
    for (size_t c = 0; c < candidates_.size(); ++c) {
      const FileFault& fault = candidates_[c].fault;
      if (candidates_[c].beside) continue;
      groups[{static_cast<int>(fault.kind), static_cast<int>(fault.of), fault.component,
              static_cast<int>(fault.rotation), fault.in_second, fault.whole,
              IsNumber(fault) ? candidates_[c].values : std::string()}]
          .push_back(c);
    }
    for (auto& [key, group] : groups) {
      if (group.size() > 1) groups_.push_back(std::move(group));
    }
  }

  [[nodiscard]] std::vector<size_t> ListLeft(size_t c) const {
    std::vector<size_t> left;
    for (const size_t site : put_right_[c]) {
      if (is_left_[site]) left.push_back(site);
    }
    return left;
  }

  /// Bits that each place adds to a convention, for a free value or a remainder.
  [[nodiscard]] static bool PaysEach(const FileFault& fault) {
    using Kind = CorrectionKind;
    if (fault.of == SiteKind::kAxis) return false;
    return fault.kind == Kind::kMissing || fault.kind == Kind::kSurplus || fault.kind == Kind::kNoProducts ||
           fault.kind == Kind::kNoAxes || fault.kind == Kind::kOfOther || fault.kind == Kind::kExchanged ||
           fault.kind == Kind::kPartMissing;
  }

  [[nodiscard]] std::vector<Deal> ListDeals() const {
    constexpr double kWhich = 3.0;  // how many places,
    constexpr double kEach = 0.6;   // and which, of most
    std::vector<Deal> deals;
    for (size_t c = 0; c < candidates_.size(); ++c) {
      std::vector<size_t> left = ListLeft(c);
      if (!left.empty()) deals.push_back({CountBitsOf(c), std::move(left), {c}});
    }
    for (const std::vector<size_t>& group : groups_) {
      Deal deal;
      std::map<int, size_t> by_place;
      for (const size_t c : group) {
        if (ListLeft(c).empty()) continue;
        const auto [at, is_new] = by_place.emplace(candidates_[c].link, c);
        const auto puts_more = [&](size_t x, size_t y) {
          const size_t more = ListLeft(x).size(), less = ListLeft(y).size();
          return more > less || (more == less && candidates_[x].bits < candidates_[y].bits);
        };
        if (!is_new && puts_more(c, at->second)) at->second = c;
      }
      if (by_place.size() < 2) continue;
      double sum = 0.0, largest = 0.0;
      for (const auto& [place, c] : by_place) {
        deal.candidates.push_back(c);
        for (const size_t site : ListLeft(c)) {
          if (!Contains(deal.sites, site)) deal.sites.push_back(site);
        }
        sum += candidates_[c].bits;
        largest = std::max(largest, candidates_[c].bits);
      }
      std::ranges::sort(deal.sites);
      const FileFault& fault = candidates_[group[0]].fault;
      const auto count = static_cast<double>(by_place.size());
      deal.bits = (IsNumber(fault) ? kNumber : kConvention) + (PaysEach(fault) ? sum : largest) +
                  std::min(count * which_, kWhich + which_ + kEach * count);
      deals.push_back(std::move(deal));
    }
    return deals;
  }

  const std::vector<CorrectionCandidate>& candidates_;
  double which_;
  std::vector<bool> is_left_;
  std::vector<std::vector<size_t>> put_right_;  // by candidate
  std::vector<double> alone_;                   // by site, the cheapest share
  std::vector<std::vector<size_t>> groups_;
};

}  // namespace

Cover FindCover(const std::vector<Site>& sites, const std::vector<CorrectionCandidate>& candidates,
                size_t places) {
  return CoverFinder(sites, candidates, places).Run();
}

}  // namespace dexcheck
