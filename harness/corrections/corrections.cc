#include "harness/corrections/corrections.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "controller/common/text.h"
#include "harness/corrections/candidate_search.h"
#include "harness/corrections/cover.h"
#include "harness/corrections/link_frames.h"
#include "harness/corrections/printed_pair.h"
#include "harness/corrections/whole_readings.h"

namespace dexcheck {
namespace {

/// @param in_second the place has the second file's name.
std::string NamePlace(const PrintedPair& pair, int link, SiteKind kind, bool in_second = false) {
  if (kind >= SiteKind::kGravity) return "robot";
  if (in_second && link >= 0 && pair.Partner(link) >= 0) link = -1 - pair.Partner(link);
  return NamePlace(link >= 0 ? pair.a().link(link) : pair.b().link(-1 - link), kind);
}

/// Which sites were put right, and how far they may be from right since.
struct SettledSite {
  Site site;
  double rest;
};

/// One direction: what of `a` is wrong.
class OneWay {
 public:
  OneWay(const PrintedRobot& a, const PrintedRobot& b, bool is_second, int* budget,
         MatchBy by = MatchBy::kLinks)
      : pair_(a, b, by), is_second_(is_second), budget_(budget) {}

  /// The sites that differ with the cheapest frames.
  std::vector<Site> ListSites() {
    pair_.SetFrames(ChooseFrames(pair_)[0].X_ab);
    return pair_.ListSites();
  }

  FileCorrections Run() {
    constexpr double kCheap = 25.0;  // bits of one fault, under which other frames are not looked for
    const PrintedRobot given = pair_.a();
    std::vector<ChosenFrames> frames = ChooseFrames(pair_);
    std::optional<Explanation> best;
    for (ChosenFrames& choice : frames) {
      Explanation found = ExplainWith(given, std::move(choice));
      if (!best || found.result.bits < best->result.bits - 1e-9) best = std::move(found);
      if (best->result.agrees || best->result.bits < kCheap) break;
    }
    if (!best->result.agrees && best->result.bits >= kCheap) ChangeFrames(given, &*best);
    best->result.of_second = is_second_;
    return std::move(best->result);
  }

 private:
  /// Corrections with one choice of frames.
  struct Explanation {
    ChosenFrames frames;
    FileCorrections result;
    std::set<int> doubtful;  ///< Links with numbers, or with what is not explained.
  };

  Explanation ExplainWith(const PrintedRobot& given, ChosenFrames frames) {
    *pair_.mutable_a() = given;
    pair_.Measure();
    pair_.SetFrames(frames.X_ab);
    doubtful_.clear();
    FileCorrections found = Explain();
    if (!found.agrees) found.bits += frames.bits;
    return {std::move(frames), std::move(found), doubtful_};
  }

  /// Gives one link after another another frame where numbers explain it, and takes that which leaves the
  /// cheapest explanation of all that then differs.
  void ChangeFrames(const PrintedRobot& given, Explanation* best) {
    constexpr int kMost = 40;      // explanations
    constexpr double kLess = 0.5;  // bits
    int count = 0;
    const auto is_free = [&](int link) {
      const auto is_other = [&](int k) {
        return k >= 0 && !best->frames.X_ab[static_cast<size_t>(k)].isApprox(Pose::Identity(), 1e-9);
      };
      return pair_.Carrier(link) >= 0 && (is_other(link) || is_other(pair_.Carrier(link)));
    };
    for (bool improves = true; improves && count < kMost;) {
      improves = false;
      for (const int link : pair_.links()) {
        const bool is_near = best->doubtful.contains(link) || best->doubtful.contains(pair_.Carrier(link));
        if (!is_near || !is_free(link)) continue;
        *pair_.mutable_a() = given;
        pair_.Measure();
        for (ChosenFrames& choice : ChangeFrame(pair_, best->frames, link)) {
          if (++count > kMost) break;
          Explanation found = ExplainWith(given, std::move(choice));
          if (found.result.bits >= best->result.bits - kLess) continue;
          *best = std::move(found);
          improves = true;
        }
      }
    }
  }

  FileCorrections Explain() {
    constexpr int kRounds = 3;
    FileCorrections result;
    settled_.clear();
    std::vector<Site> all;
    std::vector<std::string> unexplained;  // bodies of which all ten numbers are others
    for (int round = 0; round < kRounds; ++round) {
      std::vector<Site> sites = pair_.ListSites();
      std::erase_if(sites, [&](const Site& site) { return IsSettled(site); });
      result.agrees = result.agrees && sites.empty();
      result.unexplained.clear();
      left_.clear();
      if (sites.empty()) break;
      for (const Site& site : sites) {
        if (!Contains(all, site)) all.push_back(site);
      }
      const std::vector<CorrectionCandidate> candidates =
          CandidateSearch(&pair_, sites, is_second_, budget_).Run();
      const Cover cover = FindCover(sites, candidates, pair_.links().size());
      for (const size_t site : cover.left) {
        doubtful_.insert(sites[site].link);
        left_.push_back(sites[site]);
        result.unexplained.push_back(NamePlace(pair_, sites[site].link, sites[site].kind) + ": " +
                                     NameSite(sites[site].kind));
      }
      if (cover.chosen.empty()) break;
      const PrintedRobot before = pair_.a();
      for (const ChosenDeal& chosen : cover.chosen) {
        for (const size_t c : chosen.deal.candidates) {
          if (IsNumber(candidates[c].fault)) doubtful_.insert(candidates[c].link);
        }
        if (IsBodyOfNumbers(candidates[chosen.deal.candidates[0]].fault)) {
          for (const size_t c : chosen.deal.candidates)
            unexplained.push_back(NamePlace(pair_, candidates[c].link, SiteKind::kMass) + ": inertial");
          result.bits += chosen.deal.bits;
          Apply(chosen.deal, before, candidates);
          continue;
        }
        std::vector<CorrectionItem> made = MakeItems(chosen.deal, sites, candidates);
        AddRivals(chosen, sites, candidates, &made[0]);
        AddPlaceRival(candidates[chosen.deal.candidates[0]], &made[0]);
        for (CorrectionItem& item : made) {
          result.bits += item.bits;
          AddItem(std::move(item), &result.items);
        }
        Apply(chosen.deal, before, candidates);
      }
      pair_.Measure();
    }
    WithdrawDoubtful(&result, &unexplained);
    for (CorrectionItem& item : result.items)
      item.explained = static_cast<double>(item.sites.size()) / static_cast<double>(all.size());
    constexpr double kUnexplained = 60.0;
    result.bits += kUnexplained * static_cast<double>(result.unexplained.size());
    Append(unexplained, &result.unexplained);
    return result;
  }

  /// Makes several free numbers at one link or at links that carry one another "not explained" if the files
  /// have different frames there, since they follow from the choice of the frame, and so numbers that are
  /// corrected twice.
  void WithdrawDoubtful(FileCorrections* result, std::vector<std::string>* unexplained) const {
    constexpr double kFree = 24.0;  // bits of two entries
    const auto is_free = [&](const CorrectionItem& item) {
      const bool is_number = IsNumber(item.fault) || item.fault.kind == CorrectionKind::kOtherAxis;
      if (!is_number || item.bits < kFree || item.sites.empty()) return false;
      const int link = item.sites[0].link;
      const bool is_geometry = IsOfPose(item.fault.of) || item.fault.of == SiteKind::kAxis ||
                               item.fault.of == SiteKind::kAxisPoint || item.fault.of == SiteKind::kCom;
      return is_geometry && link >= 0 && pair_.Carrier(link) >= 0 &&
             !pair_.X_ab(link).isApprox(Pose::Identity(), 1e-9);
    };
    // The inertia turned, or six other numbers.
    const auto is_of_inertia = [](const CorrectionItem& item) {
      using Kind = CorrectionKind;
      const Kind kind = item.fault.kind;
      return item.fault.of == SiteKind::kInertia && !item.sites.empty() &&
             (IsNumber(item.fault) || kind == Kind::kFrame || kind == Kind::kNoAxes ||
              kind == Kind::kAlongParent || kind == Kind::kAlongToParent || kind == Kind::kMirror);
    };
    // A link's frame was chosen wrongly if its centre of mass and its inertia are both wrong in it.
    const auto is_of_frame = [&](const CorrectionItem& one, const CorrectionItem& other) {
      return is_free(one) && one.fault.of == SiteKind::kCom && is_of_inertia(other) &&
             one.sites[0].link == other.sites[0].link;
    };
    const auto is_near = [&](const Site& site, int link) {
      return site.link == link ||
             (site.link >= 0 && (pair_.Carrier(site.link) == link || pair_.Carrier(link) == site.link));
    };
    const auto is_doubtful = [&](const CorrectionItem& item) {
      const auto is_other = [&](const CorrectionItem& other) {
        if (&other == &item || other.sites.empty()) return false;
        const bool is_again = IsNumber(item.fault) && IsNumber(other.fault) && item.places == other.places &&
                              item.id == other.id && IsOfBody(item.fault.of);
        return is_again || is_of_frame(item, other) || is_of_frame(other, item) ||
               (is_free(item) && is_free(other) && is_near(item.sites[0], other.sites[0].link));
      };
      return std::ranges::any_of(result->items, is_other) ||
             (is_free(item) && std::ranges::any_of(left_, [&](const Site& site) {
                return !IsOfBody(site.kind) && is_near(site, item.sites[0].link);
              }));
    };
    std::vector<CorrectionItem> kept;
    for (const CorrectionItem& item : result->items) {
      if (!is_doubtful(item)) {
        kept.push_back(item);
        continue;
      }
      const std::string text = item.places[0] + ": " + NameSite(item.fault.of);
      if (!Contains(*unexplained, text)) unexplained->push_back(text);
    }
    result->items = std::move(kept);
  }

  static bool IsBodyOfNumbers(const FileFault& fault) {
    return fault.kind == CorrectionKind::kNumber && fault.whole && IsOfBody(fault.of);
  }

  /// Whether a site was put right and still is, as far as its correction left it.
  [[nodiscard]] bool IsSettled(const Site& site) const {
    constexpr double kMore = 2.0;
    const SettledSite* const settled = FindIn(settled_, site, &SettledSite::site);
    if (settled == nullptr) return false;
    if (!IsOfBody(site.kind) && !IsOfPose(site.kind)) return true;
    return settled->rest == 0.0 || pair_.CompareNode(site.kind, site.link) <= kMore * settled->rest;
  }

  void Apply(const Deal& deal, const PrintedRobot& before,
             const std::vector<CorrectionCandidate>& candidates) {
    for (const size_t c : deal.candidates) {
      for (const LinkPatch& patch : candidates[c].patches)
        TakeChanges(before.link(patch.link), patch.right, &pair_.mutable_a()->link(patch.link));
      // A site without a patch stays as it is; a body that the file had not is none of the measured parts.
      const bool is_measured =
          !candidates[c].patches.empty() && !pair_.node(candidates[c].link).parts.empty();
      for (const Site& site : candidates[c].sites)
        settled_.push_back({site, is_measured ? candidates[c].rest : 0.0});
    }
  }

  /// The item of a deal, and one of the fault beside it.
  [[nodiscard]] std::vector<CorrectionItem> MakeItems(
      const Deal& deal, const std::vector<Site>& sites,
      const std::vector<CorrectionCandidate>& candidates) const {
    CorrectionItem item;
    item.bits = deal.bits;
    for (const size_t site : deal.sites) item.sites.push_back(sites[site]);
    for (const size_t c : deal.candidates) {
      const CorrectionCandidate& candidate = candidates[c];
      item.fault = candidate.fault;
      const bool is_one = candidate.fault.kind == CorrectionKind::kExchanged || candidate.beside ||
                          candidate.patches.size() < 2;
      for (size_t k = 0; k < (is_one ? 1 : candidate.patches.size()); ++k) {
        const int link = is_one ? candidate.link : candidate.patches[k].link;
        std::string place = NamePlace(pair_, link, candidate.fault.of, candidate.fault.in_second);
        if (Contains(item.places, place)) continue;
        item.places.push_back(std::move(place));
        item.values.push_back(candidate.values);
      }
      // A patch of this file would copy the other one's fault.
      // Numbers that a compiler computes are not written in this place.
      const bool is_computed = candidate.fault.kind == CorrectionKind::kShapes ||
                               candidate.fault.kind == CorrectionKind::kCompiled;
      if (!candidate.fault.in_second && !is_computed) Append(candidate.patches, &item.patches);
    }
    const CorrectionCandidate& first = candidates[deal.candidates[0]];
    item.in_second = is_second_ != item.fault.in_second;
    item.id = NameFault(item.fault);
    const bool is_root = first.link >= 0 && IsOfPose(item.fault.of) && pair_.Carrier(first.link) < 0 &&
                         pair_.node(first.link).link == first.link;
    if (is_root && deal.candidates.size() == 1)
      item.id = item.id.starts_with("number.") ? "number.base" : "base." + item.id;
    std::vector<CorrectionItem> items = {item};
    if (first.beside) {
      CorrectionItem other;
      other.fault = first.beside->fault;
      other.in_second = is_second_;
      other.id = NameFault(other.fault);
      for (const int link : first.beside->links)
        other.places.push_back(NamePlace(pair_, link, other.fault.of));
      other.values.resize(other.places.size());
      items.push_back(std::move(other));
    }
    return items;
  }

  /// Adds an item, or its places to one of the same convention.
  static void AddItem(CorrectionItem item, std::vector<CorrectionItem>* items) {
    const auto is_same = [&](const CorrectionItem& other) {
      return other.id == item.id && IsSameFault(other.fault, item.fault) && other.in_second == item.in_second;
    };
    const auto same = std::ranges::find_if(*items, is_same);
    if (IsNumber(item.fault) || item.fault.kind == CorrectionKind::kExchanged || same == items->end()) {
      items->push_back(std::move(item));
      return;
    }
    for (size_t k = 0; k < item.places.size(); ++k) {
      if (Contains(same->places, item.places[k])) continue;
      same->places.push_back(item.places[k]);
      same->values.push_back(item.values[k]);
    }
    same->bits += item.bits;
    Append(item.sites, &same->sites);
    Append(item.patches, &same->patches);
  }

  void AddRivals(const ChosenDeal& chosen, const std::vector<Site>& sites,
                 const std::vector<CorrectionCandidate>& candidates, CorrectionItem* item) const {
    const auto describe = [](const CorrectionItem& one) {
      return DescribeItem(one, one.in_second ? "the second file" : "");
    };
    std::vector<std::string> texts = {describe(*item)};
    for (const Deal& deal : chosen.rivals) {
      CorrectionItem rival = MakeItems(deal, sites, candidates)[0];
      if (deal.candidates.size() < chosen.deal.candidates.size() && IsSameFault(rival.fault, item->fault))
        continue;
      std::string text = describe(rival);
      if (Contains(texts, text)) continue;
      texts.push_back(std::move(text));
      item->rivals.push_back(std::move(rival));
    }
  }

  /// If frames of links are free, a fault of a link is as well one of its place: another centre of mass of a
  /// link that carries nothing its position along its axis, another axis its rotation with all it carries.
  void AddPlaceRival(const CorrectionCandidate& candidate, CorrectionItem* item) const {
    const int link = candidate.link;
    const bool is_turn = candidate.fault.kind == CorrectionKind::kOtherAxis;
    const bool is_com =
        candidate.fault.of == SiteKind::kCom && candidate.fault.kind == CorrectionKind::kNumber;
    if ((!is_turn && !is_com) || link < 0 || item->places.size() != 1 || pair_.Carrier(link) < 0 ||
        pair_.X_ab(link).isApprox(Pose::Identity(), 1e-9))
      return;
    CorrectionItem rival = *item;
    rival.rivals.clear();
    rival.patches.clear();
    rival.fault = {CorrectionKind::kNumber, is_turn ? SiteKind::kRotation : SiteKind::kPosition};
    rival.id = NameFault(rival.fault);
    rival.values = {""};
    if (is_com) {
      const auto is_on = [&](int k) { return pair_.node(k).parent == link; };
      if (std::ranges::any_of(pair_.links(), is_on)) return;
      const Vector3d apart = pair_.right(link).body.com - pair_.given(link).body.com;
      const PrintedJoint& joint = pair_.a().link(link).joint;
      const double across = joint.axis.normalized().cross(apart).norm();
      constexpr double kAlong = 1e-3;  // of the distance
      if (joint.kind == JointKind::kHinge && across > kAlong * apart.norm() + 1e-6) return;
      rival.places = {NamePlace(pair_, link, SiteKind::kPosition)};
      rival.values = {fmt::format("off by ({})", ShowVector(-(pair_.given(link).X.linear() * apart)))};
    }
    item->rivals.push_back(std::move(rival));
  }

  PrintedPair pair_;
  bool is_second_;
  int* budget_;
  std::vector<SettledSite> settled_;
  std::set<int> doubtful_;  // of the explanation that is made
  std::vector<Site> left_;  // that its last round does not explain
};

/// Tries readings of a whole file that put half of what differs right. @param found the best so far.
void TryReadings(const PrintedRobot& a, const PrintedRobot& b, bool of_second, int* budget,
                 FileCorrections* found) {
  constexpr double kReading = 10.0;
  constexpr double kClearer = 20.0;
  const std::vector<Site> sites = OneWay(a, b, false, budget).ListSites();
  for (const WholeReading& reading : ListWholeReadings(of_second ? b : a)) {
    OneWay way(of_second ? a : reading.robot, of_second ? reading.robot : b, false, budget);
    if (2 * way.ListSites().size() > sites.size()) continue;
    FileCorrections read = way.Run();
    if (read.bits + kReading + kClearer >= found->bits) continue;
    CorrectionItem item;
    item.fault = reading.fault;
    item.fault.in_second = item.in_second = of_second;
    item.id = NameFault(item.fault);
    item.places = {"robot"};
    item.values = {""};
    item.sites = sites;
    item.bits = kReading;
    item.explained = 1.0;
    read.agrees = false;
    read.bits += kReading;
    read.items.insert(read.items.begin(), std::move(item));
    *found = std::move(read);
  }
}

}  // namespace

void TakeChanges(PrintedLink before, PrintedLink right, PrintedLink* link) {
  const auto take = [](const auto& from, const auto& to, auto* member) {
    if (!(from == to)) *member = to;
  };
  const auto merge = [](auto* from, auto* to, auto* merged) {
    const std::vector<LinkNumber> given = ListNumbers(from), made = ListNumbers(to), at = ListNumbers(merged);
    for (size_t k = 0; k < at.size(); ++k) {
      if (*given[k].value == *made[k].value) continue;
      *at[k].value = *made[k].value;
      *at[k].half = *made[k].half;
    }
  };
  const auto merge_origin = [&](PrintedOrigin* from, PrintedOrigin* to, PrintedOrigin* merged) {
    merge(from, to, merged);
    if (!IsTurned(*from, *to)) return;
    PrintedOrigin turned = *to;
    turned.TakePlace(*merged);
    *merged = turned;
  };
  merge_origin(&before.origin, &right.origin, &link->origin);
  if (!before.inertial || !right.inertial || !link->inertial) {
    if (before.inertial.has_value() != right.inertial.has_value()) link->inertial = right.inertial;
  } else {
    merge(&*before.inertial, &*right.inertial, &*link->inertial);
    merge_origin(&before.inertial->origin, &right.inertial->origin, &link->inertial->origin);
  }
  if (before.joint.kind != right.joint.kind) link->joint = right.joint;
  take(before.joint.name, right.joint.name, &link->joint.name);
  take(before.joint.axis, right.joint.axis, &link->joint.axis);
  take(before.joint.anchor, right.joint.anchor, &link->joint.anchor);
  take(before.joint.range, right.joint.range, &link->joint.range);
  take(before.joint.mimic, right.joint.mimic, &link->joint.mimic);
  for (size_t k = 0; k < kNumJointScalars; ++k)
    take(before.joint.scalars[k], right.joint.scalars[k], &link->joint.scalars[k]);
}

FileCorrections FindCorrections(const PrintedRobot& a, const PrintedRobot& b) {
  constexpr double kOneFault = 16.0;
  constexpr double kClearer = 20.0;
  constexpr double kSeveral = 40.0;
  int budget = 60000;  // edits that are tried at most, some microseconds each
  FileCorrections best = OneWay(a, b, false, &budget).Run();
  if (best.agrees || best.bits <= kOneFault) return best;
  const auto take = [&](FileCorrections found) {
    if (!found.agrees && found.bits + kClearer < best.bits) best = std::move(found);
  };
  // Links or joints whose names were exchanged are others' by them.
  for (const MatchBy by : {MatchBy::kTree, MatchBy::kJoints}) {
    if (best.bits > kSeveral && MatchLinks(a, b, by).b_of_a != MatchLinks(a, b).b_of_a)
      take(OneWay(a, b, false, &budget, by).Run());
  }
  take(OneWay(b, a, true, &budget).Run());
  for (const bool of_second : {false, true}) {
    if (best.bits > kSeveral) TryReadings(a, b, of_second, &budget, &best);
  }
  return best;
}

std::string DescribeItem(const CorrectionItem& item, const std::string& file) {
  FileFault fault = item.fault;
  fault.in_second = false;
  std::string text = fmt::format("{}{}: {}", file.empty() ? "" : "in " + file + ", ", JoinNames(item.places),
                                 DescribeFault(fault));
  // Values of a few places; one where they are the same at all.
  constexpr size_t kShown = 3;
  std::vector<std::string> values;
  for (const std::string& value : item.values) {
    if (!value.empty() && !Contains(values, value)) values.push_back(value);
  }
  if (values.empty() || values.size() > kShown) return text;
  const bool is_name = item.fault.kind == CorrectionKind::kOfOther ||
                       (item.fault.kind == CorrectionKind::kExchanged && !IsName(item.fault.of));
  text += is_name ? " " : ": ";
  for (size_t k = 0; k < values.size(); ++k) text += (k > 0 ? "; " : "") + values[k];
  return text;
}

}  // namespace dexcheck
