#include "harness/corrections/corrections.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "controller/common/text.h"
#include "harness/corrections/candidate_search.h"
#include "harness/corrections/cover.h"
#include "harness/corrections/link_frames.h"
#include "harness/corrections/printed_pair.h"
#include "harness/corrections/read_printed.h"

namespace dexcheck {
namespace {

/// Gives `link` what `right` has otherwise than `before`.
void Merge(const PrintedLink& before, const PrintedLink& right, PrintedLink* link) {
  const auto merge_origin = [](const PrintedOrigin& from, const PrintedOrigin& to, PrintedOrigin* origin) {
    if (from.t != to.t) {
      origin->t = to.t;
      origin->half_t = to.half_t;
    }
    if (from.r == to.r && from.form == to.form && from.sequence == to.sequence) return;
    origin->r = to.r;
    origin->half_r = to.half_r;
    origin->form = to.form;
    origin->sequence = to.sequence;
    origin->X_before = to.X_before;
  };
  merge_origin(before.origin, right.origin, &link->origin);
  if (!before.inertial || !right.inertial || !link->inertial) {
    if (before.inertial.has_value() != right.inertial.has_value()) link->inertial = right.inertial;
  } else {
    if (before.inertial->mass.value != right.inertial->mass.value)
      link->inertial->mass = right.inertial->mass;
    merge_origin(before.inertial->origin, right.inertial->origin, &link->inertial->origin);
    if (before.inertial->I != right.inertial->I) {
      link->inertial->I = right.inertial->I;
      link->inertial->half_I = right.inertial->half_I;
    }
  }
  const PrintedJoint& joint = before.joint;
  const PrintedJoint& to = right.joint;
  if (joint.kind != to.kind) link->joint = to;
  if (joint.name != to.name) link->joint.name = to.name;
  if (joint.axis != to.axis) link->joint.axis = to.axis;
  if (joint.anchor != to.anchor) link->joint.anchor = to.anchor;
  const auto differ = [](const auto& x, const auto& y) {
    return x.has_value() != y.has_value() || (x && x->value != y->value);
  };
  for (size_t k = 0; k < kNumJointScalars; ++k) {
    if (differ(joint.scalars[k], to.scalars[k])) link->joint.scalars[k] = to.scalars[k];
  }
  const auto differ_in = [&](size_t k) {
    return joint.range && to.range && (*joint.range)[k].value != (*to.range)[k].value;
  };
  if (joint.range.has_value() != to.range.has_value() || differ_in(0) || differ_in(1))
    link->joint.range = to.range;
  const bool same_mimic = joint.mimic.has_value() == to.mimic.has_value() &&
                          (!joint.mimic || (joint.mimic->leader == to.mimic->leader &&
                                            joint.mimic->multiplier.value == to.mimic->multiplier.value &&
                                            joint.mimic->offset.value == to.mimic->offset.value));
  if (!same_mimic) link->joint.mimic = to.mimic;
}

std::string NamePlace(const PrintedPair& pair, int link, SiteKind kind) {
  if (kind == SiteKind::kGravity) return "robot";
  const PrintedLink& place = link >= 0 ? pair.a().link(link) : pair.b().link(-1 - link);
  if (IsOfBody(kind) || place.joint.name.empty()) return "link " + place.name;
  return "joint " + place.joint.name;
}

CorrectionItem MakeItem(const PrintedPair& pair, const Deal& deal, const std::vector<Site>& sites,
                        const std::vector<CorrectionCandidate>& candidates) {
  CorrectionItem item;
  item.bits = deal.bits;
  for (const size_t site : deal.sites) item.sites.push_back(sites[site]);
  for (const size_t c : deal.candidates) {
    const CorrectionCandidate& candidate = candidates[c];
    item.fault = candidate.fault;
    const bool is_exchange = candidate.fault.kind == CorrectionKind::kExchanged;
    for (size_t k = 0; k < (is_exchange ? 1 : std::max<size_t>(candidate.patches.size(), 1)); ++k) {
      const int link = k == 0 && candidate.patches.size() < 2 ? candidate.link : candidate.patches[k].link;
      std::string place = NamePlace(pair, link, candidate.fault.of);
      if (std::ranges::find(item.places, place) != item.places.end()) continue;
      item.places.push_back(std::move(place));
      item.values.push_back(candidate.values);
    }
    item.patches.insert(item.patches.end(), candidate.patches.begin(), candidate.patches.end());
  }
  return item;
}

/// One direction: what of `a` is wrong.
class OneWay {
 public:
  OneWay(const PrintedRobot& a, const PrintedRobot& b, bool is_second, bool by_tree)
      : pair_(a, b, by_tree), is_second_(is_second) {}

  FileCorrections Run() {
    constexpr double kCheap = 25.0;  // bits of one fault, under which other frames are not looked for
    std::vector<ChosenFrames> frames = ChooseFrames(pair_);
    std::optional<FileCorrections> best;
    const PrintedRobot given = pair_.a();
    for (ChosenFrames& choice : frames) {
      *pair_.mutable_a() = given;
      pair_.Measure();
      pair_.SetFrames(std::move(choice.X_ab));
      FileCorrections found = Explain();
      found.bits += found.agrees ? 0.0 : choice.bits;
      if (!best || found.bits < best->bits - 1e-9) best = std::move(found);
      if (best->agrees || best->bits < kCheap) break;
    }
    best->of_second = is_second_;
    return *std::move(best);
  }

 private:
  FileCorrections Explain() {
    constexpr int kRounds = 3;
    FileCorrections result;
    std::vector<Site> settled;  // with digits that a patch does not carry
    for (int round = 0; round < kRounds; ++round) {
      std::vector<Site> sites = pair_.ListSites();
      std::erase_if(sites,
                    [&](const Site& site) { return std::ranges::find(settled, site) != settled.end(); });
      result.agrees = result.agrees && sites.empty();
      if (sites.empty()) break;
      const std::vector<CorrectionCandidate> candidates = CandidateSearch(&pair_, sites, is_second_).Run();
      const Cover cover = FindCover(sites, candidates, pair_.links().size());
      result.unexplained.clear();
      for (const size_t site : cover.left)
        result.unexplained.push_back(NamePlace(pair_, sites[site].link, sites[site].kind) + ": " +
                                     NameSite(sites[site].kind));
      if (cover.chosen.empty()) break;
      const PrintedRobot before = pair_.a();
      for (const ChosenDeal& chosen : cover.chosen) {
        CorrectionItem& item = result.items.emplace_back(MakeItem(pair_, chosen.deal, sites, candidates));
        AddRivals(chosen, sites, candidates, &item);
        result.bits += item.bits;
        for (const LinkPatch& patch : item.patches)
          Merge(before.link(patch.link), patch.right, &pair_.mutable_a()->link(patch.link));
        settled.insert(settled.end(), item.sites.begin(), item.sites.end());
      }
      pair_.Measure();
    }
    constexpr double kUnexplained = 60.0;
    result.bits += kUnexplained * static_cast<double>(result.unexplained.size());
    return result;
  }

  void AddRivals(const ChosenDeal& chosen, const std::vector<Site>& sites,
                 const std::vector<CorrectionCandidate>& candidates, CorrectionItem* item) const {
    std::vector<std::string> told = {DescribeItem(*item, false)};
    for (const Deal& deal : chosen.rivals) {
      CorrectionItem rival = MakeItem(pair_, deal, sites, candidates);
      if (deal.candidates.size() < chosen.deal.candidates.size() && IsSameFault(rival.fault, item->fault))
        continue;
      std::string text = DescribeItem(rival, false);
      if (std::ranges::find(told, text) != told.end()) continue;
      told.push_back(std::move(text));
      item->rivals.push_back(std::move(rival));
    }
  }

  PrintedPair pair_;
  bool is_second_;
};

}  // namespace

FileCorrections FindCorrections(const PrintedRobot& a, const PrintedRobot& b) {
  constexpr double kOneFault = 16.0;
  constexpr double kClearer = 20.0;
  FileCorrections first = OneWay(a, b, false, false).Run();
  constexpr double kSeveral = 40.0;
  if (!first.agrees && first.bits > kSeveral) {
    // Joints whose names were exchanged are others' by them.
    FileCorrections by_tree = OneWay(a, b, false, true).Run();
    if (!by_tree.agrees && by_tree.bits + kClearer < first.bits) first = std::move(by_tree);
  }
  if (first.agrees || first.bits <= kOneFault) return first;
  FileCorrections second = OneWay(b, a, true, false).Run();
  if (!second.agrees && second.bits + kClearer < first.bits) return second;
  return first;
}

FileCorrections FindCorrections(const DescriptionFile& a, const DescriptionFile& b) {
  return FindCorrections(ReadPrintedRobot(a), ReadPrintedRobot(b));
}

std::string DescribeItem(const CorrectionItem& item, bool of_second) {
  std::string text = of_second ? "in the second file, " : "";
  std::string places = JoinNames(item.places);
  const std::string fault = DescribeFault(item.fault);
  text += fmt::format("{}: {}", places, fault);
  // Values of a few places; one where they are the same at all.
  constexpr size_t kShown = 3;
  std::vector<std::string> values;
  for (const std::string& value : item.values) {
    if (!value.empty() && std::ranges::find(values, value) == values.end()) values.push_back(value);
  }
  if (values.empty() || values.size() > kShown) return text;
  const bool is_name = item.fault.kind == CorrectionKind::kOfOther ||
                       (item.fault.kind == CorrectionKind::kExchanged && item.fault.of != SiteKind::kName);
  text += is_name ? " " : ": ";
  for (size_t k = 0; k < values.size(); ++k) text += (k > 0 ? "; " : "") + values[k];
  return text;
}

}  // namespace dexcheck
