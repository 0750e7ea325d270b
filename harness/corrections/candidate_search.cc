#include "harness/corrections/candidate_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "controller/model/rigid_body.h"

namespace dexcheck {
namespace {

/// Relative to the tolerances of the file as it is: what is farther off is right only if little of it is
/// left.
constexpr double kFar = 100.0;
constexpr double kNearer = 0.01;  // of the deviation before

}  // namespace

/// A node that edits change.
struct CandidateSearch::TriedNode {
  int link;
  bool is_placed = false, has_body = false;
};

CandidateSearch::CandidateSearch(PrintedPair* pair, std::vector<Site> sites, bool is_second, int* budget)
    : pair_(*pair), sites_(std::move(sites)), is_second_(is_second), budget_(budget) {
  const PrintedRobot& a = pair_.a();
  wrong_.assign(a.links.size(), 0);
  poses_.resize(a.links.size());
  bodies_.assign(a.links.size(), -1);
  for (const Site& site : sites_) {
    if (site.link >= 0) wrong_[static_cast<size_t>(site.link)] |= MaskOf(site.kind);
  }
  for (const int link : pair_.links()) {
    for (const int k : pair_.node(link).chain) poses_[static_cast<size_t>(k)].push_back(link);
    for (const int part : pair_.node(link).parts) {
      for (int k = part; k != link; k = a.link(k).parent) bodies_[static_cast<size_t>(k)] = link;
      if (part == link) bodies_[static_cast<size_t>(link)] = link;
    }
  }
}

std::optional<double> CountLeft(double after, double before) {
  constexpr double kCorrected = 1e-4;  // of the change, which a correction may leave over
  if (after <= 1.0) return 0.0;
  if (after <= kCorrected * before) return std::log2(after);
  return std::nullopt;
}

std::vector<CandidateSearch::TriedNode> CandidateSearch::ListTried(
    const std::vector<PlacedEdit>& edits) const {
  std::vector<TriedNode> nodes;
  const auto take = [&](int link) -> TriedNode& {
    const auto found = std::ranges::find(nodes, link, &TriedNode::link);
    return found == nodes.end() ? nodes.emplace_back(TriedNode{link}) : *found;
  };
  for (const PlacedEdit& edit : edits) {
    for (const int at : PosesOf(edit.link)) take(at).is_placed = pair_.IsPlaced(at);
    const int body = BodyOf(edit.link);
    if (body >= 0) take(body).has_body = !pair_.node(body).parts.empty();
  }
  return nodes;
}

bool CandidateSearch::Try(const EditTrial& trial, int place, const std::vector<PlacedEdit>& edits) {
  if (*budget_ <= 0) return false;
  --*budget_;
  PrintedRobot& robot = *pair_.mutable_a();
  std::vector<LinkPatch> before;
  for (const PlacedEdit& edit : edits) {
    before.push_back({edit.link, robot.link(edit.link)});
    edit.undo(&robot.link(edit.link));
  }
  const std::vector<TriedNode> nodes = ListTried(edits);
  std::vector<Site> right;
  double left = 0.0, rest = 1.0;
  // A number far from right by the digits of the file as it is, is not looked at closer.
  const auto judge = [&](bool is_close) {
    for (const TriedNode& tried : nodes) {
      const Node& node = pair_.node(tried.link);
      const GivenNode& given = pair_.given(tried.link);
      const GivenNode now = {
          CalcNodePose(robot, node),
          is_close && tried.is_placed ? CalcPoseTolerance(node, &robot) : given.pose,
          CalcNodeBody(robot, node),
          is_close && tried.has_body ? CalcBodyTolerance(node, &robot) : given.body_tolerance};
      for (const SiteKind kind : kNodeKinds) {
        if ((trial.kinds & MaskOf(kind)) == 0 || !(IsOfBody(kind) ? tried.has_body : tried.is_placed))
          continue;
        const bool is_wrong = IsWrong(tried.link, kind);
        double apart = 0.0, was_apart = 0.0;
        const double was = pair_.CompareNode(kind, tried.link, given, &was_apart);
        const double ratio = pair_.CompareNode(kind, tried.link, now, &apart);
        // An entry that is printed exactly, as a 0, must not hide that the others become no better.
        const bool is_nearer = ratio <= 1.0 || apart < kNearer * was_apart;
        const bool holds = is_close
                               ? (is_wrong ? CountLeft(ratio, was).has_value() && is_nearer : ratio <= 1.0)
                               : ratio < kFar || ratio < 0.05 * was;
        if (!holds && (!is_wrong || trial.needs_all)) return false;
        if (!is_close || !is_wrong || !holds) continue;
        right.push_back({kind, tried.link});
        left += 2.0 * *CountLeft(ratio, was);
        rest = std::max(rest, ratio);
      }
    }
    return true;
  };
  bool holds = judge(false);
  if (holds) {
    for (size_t k = 0; k < edits.size(); ++k)
      robot.link(edits[k].link) = Carry(before[k].right, edits[k].undo);
    holds = judge(true) && !right.empty();
  }
  std::vector<LinkPatch> patches;
  for (LinkPatch& patch : before) {
    if (holds) patches.push_back({patch.link, robot.link(patch.link)});
    robot.link(patch.link) = std::move(patch.right);
  }
  if (!holds) return false;
  Add(trial, place, std::move(right), std::move(patches));
  found_.back().bits += left;
  found_.back().rest = rest;
  return true;
}

void CandidateSearch::TryTogether(const std::vector<LinkEdits>& lists, int place, SiteMask kinds,
                                  bool needs_all) {
  std::vector<FileFault> tried;
  for (const LinkEdits& list : lists) {
    for (const LinkEdit& edit : list.edits) {
      const auto is_same = [&](const FileFault& fault) { return IsSameFault(fault, edit.fault); };
      if (std::ranges::any_of(tried, is_same)) continue;
      tried.push_back(edit.fault);
      std::vector<PlacedEdit> placed;
      for (const auto& [link, edits] : lists) {
        const auto own = std::ranges::find_if(edits, is_same, &LinkEdit::fault);
        if (own != edits.end()) placed.push_back({link, own->undo});
      }
      if (placed.size() > 1) Try({edit.fault, edit.bits, kinds, "", needs_all}, place, placed);
    }
  }
}

void CandidateSearch::Add(const EditTrial& trial, int link, std::vector<Site> sites,
                          std::vector<LinkPatch> patches) {
  found_.push_back({trial.fault, link, std::move(sites), trial.bits, std::move(patches), trial.values});
}

void CandidateSearch::AddSimple(const EditTrial& trial, int link, const LinkUndo& undo) {
  LinkPatch patch{link, pair_.a().link(link)};
  undo(&patch.right);
  Add(trial, link, {{trial.fault.of, link}}, {std::move(patch)});
}

std::vector<Site> CandidateSearch::ListBodySites(int link) const {
  std::vector<Site> sites;
  for (const SiteKind kind : kBodyKinds) {
    if (IsWrong(link, kind)) sites.push_back({kind, link});
  }
  return sites;
}

std::vector<CorrectionCandidate> CandidateSearch::Run() {
  for (const int link : pair_.links()) {
    const SiteMask wrong = WrongOf(link);
    if ((wrong & kPoseMask) != 0) SearchPlace(link);
    if ((wrong & ~(kPoseMask | kBodyMask)) != 0) SearchJoint(link);
    if ((wrong & kBodyMask) != 0) SearchBody(link);
  }
  SearchRobot();
  SearchExchanges();
  for (const int link : pair_.links()) {
    SearchAllOrigins(link);
    SearchSecond(link);
  }
  for (int link = 0; link < pair_.a().size(); ++link) SearchWeld(link);
  return std::move(found_);
}

FileFault MakeLostAxes(const PrintedInertial& inertial, bool in_second) {
  return {.kind = CorrectionKind::kNoAxes,
          .of = SiteKind::kInertia,
          .component = inertial.I.tail<3>().isZero() ? 0 : 1,
          .in_second = in_second};
}

std::optional<MassProperties> Subtract(const MassProperties& whole, const MassProperties& rest) {
  constexpr double kLeastMass = 1e-9;
  MassProperties part;
  part.mass = whole.mass - rest.mass;
  if (part.mass <= kLeastMass) return std::nullopt;
  part.com = (whole.mass * whole.com - rest.mass * rest.com) / part.mass;
  part.inertia = whole.inertia - rest.inertia - CalcPointInertia(rest.mass, rest.com - whole.com) -
                 CalcPointInertia(part.mass, part.com - whole.com);
  return part;
}

LinkUndo GiveBody(const MassProperties& body) {
  return [body](PrintedLink* made) {
    if (!made->inertial) made->inertial.emplace();
    const Matrix3d R = made->inertial->origin.CalcRotation();
    made->inertial->mass.value = body.mass;
    made->inertial->origin.t = body.com;
    made->inertial->I = ToEntries(R.transpose() * body.inertia * R);
  };
}

namespace {

/// Which entries differ; all where none does by more than what is open.
std::vector<size_t> ListDiffering(size_t count, const double* given, const double* right,
                                  const double* open) {
  std::vector<size_t> differing;
  for (const double fraction : {1.0, -1.0}) {
    for (size_t k = 0; k < count && (fraction > 0.0 || differing.empty() || differing.size() < count); ++k) {
      if (std::abs(given[k] - right[k]) > fraction * open[k]) differing.push_back(k);
    }
    if (!differing.empty()) break;
  }
  return differing;
}

double ShowZero(double right, double open) { return std::abs(right) <= open ? 0.0 : right; }

}  // namespace

std::string DescribeRight(const std::string& given, const std::string& right) {
  return fmt::format("{} here, {} in the other file", given, right);
}

std::string DescribeRight(double given, double right, const char* unit) {
  return DescribeRight(fmt::format("{:.6g}{}", given, unit), fmt::format("{:.6g}{}", right, unit));
}

std::string DescribeRight(const Vector3d& given, const Vector3d& right, const char* unit) {
  return DescribeRight("(" + ShowVector(given) + ")" + unit, "(" + ShowVector(right) + ")" + unit);
}

EntryDifference CompareEntries(std::span<const char* const> names, const double* given, const double* right,
                               const double* open, const char* unit) {
  EntryDifference difference;
  for (const size_t k : ListDiffering(names.size(), given, right, open)) {
    const double shown = ShowZero(right[k], open[k]);
    difference.bits += CountBits(shown, open[k]);
    difference.values += fmt::format("{}{} {}", difference.values.empty() ? "" : "; ", names[k],
                                     DescribeRight(given[k], shown, unit));
  }
  return difference;
}

std::string ShowVector(const Vector3d& v) {
  constexpr double kRounding = 1e-9;
  const auto show = [&](double x) { return ShowZero(x, kRounding * v.norm()); };
  return fmt::format("{:.6g} {:.6g} {:.6g}", show(v[0]), show(v[1]), show(v[2]));
}

}  // namespace dexcheck
