#include "harness/corrections/candidate_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace dexcheck {
namespace {

constexpr SiteKind kNodeKinds[] = {SiteKind::kPosition, SiteKind::kRotation, SiteKind::kMass, SiteKind::kCom,
                                   SiteKind::kInertia};
/// Over what digits leave open of the file as it is: what is farther off is right only if little of it is
/// left.
constexpr double kFar = 100.0;

}  // namespace

CandidateSearch::CandidateSearch(PrintedPair* pair, std::vector<Site> sites, bool is_second)
    : pair_(*pair), sites_(std::move(sites)), is_second_(is_second) {
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

std::optional<double> CandidateSearch::CountLeft(double after, double before) {
  constexpr double kCorrected = 1e-4;  // of the change, which a correction may leave over
  if (after <= 1.0) return 0.0;
  if (after <= kCorrected * before) return std::log2(after);
  return std::nullopt;
}

bool CandidateSearch::Try(const EditTrial& trial, int link, const LinkEdit& edit) {
  PrintedRobot& robot = *pair_.mutable_a();
  PrintedLink before = robot.link(link);
  PrintedLink after = before;
  edit(before, &after);
  robot.link(link) = after;
  std::vector<Site> right;
  double left = 0.0;
  bool holds = true;
  const auto visit = [&](int at) {
    const Node& node = pair_.node(at);
    const GivenNode& given = pair_.given(at);
    const bool places =
        std::ranges::find(poses_[static_cast<size_t>(link)], at) != poses_[static_cast<size_t>(link)].end();
    const Pose X = places ? CalcNodePose(robot, node) : given.X;
    const BodyNumbers body = CalcNodeBody(robot, node);
    std::optional<GivenNode> open;  // with the digits of the edited link
    for (const SiteKind kind : kNodeKinds) {
      const bool is_wrong = IsWrong(at, kind);
      if (!holds || (trial.kinds & MaskOf(kind)) == 0) continue;
      if (!IsOfBody(kind) && !places) continue;
      if (IsOfBody(kind) && (node.parts.empty() || bodies_[static_cast<size_t>(link)] != at)) continue;
      double ratio = pair_.CompareNode(kind, at, X, given.pose, body, given.body_tolerance);
      const double was = pair_.CompareNode(kind, at, given.X, given.pose, given.body, given.body_tolerance);
      if (ratio > 1.0 && (ratio < kFar || ratio < 0.05 * was)) {
        if (!open) {
          open.emplace();
          const auto measure = [&] {
            return std::pair(CalcNodePose(robot, node), CalcNodeBody(robot, node));
          };
          const auto nominal = measure();
          const auto add = [&] {
            const auto moved = measure();
            AddChange(nominal.first, moved.first, &open->pose);
            AddChange(nominal.second, moved.second, &open->body_tolerance);
          };
          const auto move = [&](double* number, double half) {
            *number += half;
            add();
            *number -= half;
          };
          const auto move_before = [&](double* number, double half) {
            *number += half;
            PrintedLink edited = before;
            edit(before, &edited);
            robot.link(link) = std::move(edited);
            add();
            robot.link(link) = after;
            *number -= half;
          };
          const auto visit_link = [&](int k, bool inertial) {
            PrintedLink& changed = k == link ? before : robot.link(k);
            const auto visit_part = [&](auto* part) {
              k == link ? VisitNumbers(part, move_before) : VisitNumbers(part, move);
            };
            inertial ? visit_part(&*changed.inertial) : visit_part(&changed.origin);
          };
          for (const int k : node.chain) visit_link(k, false);
          for (const int part : node.parts) {
            visit_link(part, true);
            for (int k = part; k != node.link; k = robot.link(k).parent) visit_link(k, false);
          }
          open->pose.angle = std::max(open->pose.angle, 1e-8);
          open->pose.length.array() += 1e-9;
          open->body_tolerance.mass += 1e-9 * std::abs(body.mass);
          open->body_tolerance.com.array() += 1e-9;
          open->body_tolerance.inertia.array() += 1e-9 * std::abs(body.inertia.trace()) + 1e-15;
        }
        ratio = pair_.CompareNode(kind, at, X, open->pose, body, open->body_tolerance);
      }
      const std::optional<double> rest = CountLeft(ratio, was);
      if (is_wrong && rest) {
        right.push_back({kind, at});
        left += 2.0 * *rest;
      } else if (is_wrong ? trial.demand == Demand::kAll : !(ratio <= 1.0)) {
        holds = false;
      }
    }
  };
  for (const int at : poses_[static_cast<size_t>(link)]) visit(at);
  const int body = bodies_[static_cast<size_t>(link)];
  if (body >= 0 &&
      std::ranges::find(poses_[static_cast<size_t>(link)], body) == poses_[static_cast<size_t>(link)].end())
    visit(body);
  robot.link(link) = std::move(before);
  if (!holds || right.empty()) return false;
  Add(trial.fault, link, std::move(right), trial.bits + left, {{link, std::move(after)}}, trial.values);
  return true;
}

bool CandidateSearch::TryPatches(const EditTrial& trial, int link, std::vector<LinkPatch> patches) {
  PrintedRobot& robot = *pair_.mutable_a();
  std::vector<LinkPatch> before;
  std::vector<int> nodes;
  for (LinkPatch& patch : patches) {
    before.push_back({patch.link, robot.link(patch.link)});
    robot.link(patch.link) = patch.right;
    const auto take = [&](int at) {
      if (at >= 0 && std::ranges::find(nodes, at) == nodes.end()) nodes.push_back(at);
    };
    for (const int at : poses_[static_cast<size_t>(patch.link)]) take(at);
    take(bodies_[static_cast<size_t>(patch.link)]);
  }
  const auto places = [&](int at) {
    return std::ranges::any_of(patches, [&](const LinkPatch& patch) {
      const std::vector<int>& placed = poses_[static_cast<size_t>(patch.link)];
      return std::ranges::find(placed, at) != placed.end();
    });
  };
  const auto bears = [&](int at) {
    return std::ranges::any_of(
        patches, [&](const LinkPatch& patch) { return bodies_[static_cast<size_t>(patch.link)] == at; });
  };
  std::vector<Site> right;
  bool holds = true;
  for (const int at : nodes) {
    const Node& node = pair_.node(at);
    const GivenNode& given = pair_.given(at);
    const Pose X = CalcNodePose(robot, node);
    const BodyNumbers body = CalcNodeBody(robot, node);
    PoseTolerance pose = given.pose;
    BodyNumbers open = given.body_tolerance;
    bool is_measured = false;
    const bool is_placed = pair_.IsPlaced(at) && places(at);
    const bool has_body = !node.parts.empty() && bears(at);
    for (const SiteKind kind : kNodeKinds) {
      if (!holds || (trial.kinds & MaskOf(kind)) == 0 || !(IsOfBody(kind) ? has_body : is_placed)) continue;
      const double was = pair_.CompareNode(kind, at, given.X, given.pose, given.body, given.body_tolerance);
      double ratio = pair_.CompareNode(kind, at, X, pose, body, open);
      if (ratio > 1.0 && !is_measured && (ratio < kFar || ratio < 0.05 * was)) {
        is_measured = true;
        pose = CalcPoseTolerance(node, &robot);
        open = CalcBodyTolerance(node, &robot);
        ratio = pair_.CompareNode(kind, at, X, pose, body, open);
      }
      if (IsWrong(at, kind) && CountLeft(ratio, was)) {
        right.push_back({kind, at});
      } else if (!(ratio <= 1.0) && (!IsWrong(at, kind) || trial.demand == Demand::kAll)) {
        holds = false;
      }
    }
  }
  for (LinkPatch& patch : before) robot.link(patch.link) = std::move(patch.right);
  if (!holds || right.empty()) return false;
  Add(trial.fault, link, std::move(right), trial.bits, std::move(patches), trial.values);
  return true;
}

void CandidateSearch::Add(const FileFault& fault, int link, std::vector<Site> sites, double bits,
                          std::vector<LinkPatch> patches, std::string values) {
  found_.push_back({fault, link, std::move(sites), bits, std::move(patches), std::move(values)});
}

void CandidateSearch::AddSimple(CorrectionKind kind, Site site, double bits, std::string values,
                                const LinkEdit& edit) {
  FileFault fault;
  fault.kind = kind;
  fault.of = site.kind;
  LinkPatch patch{site.link, pair_.a().link(site.link)};
  edit(pair_.a().link(site.link), &patch.right);
  Add(fault, site.link, {site}, bits, {std::move(patch)}, std::move(values));
}

std::vector<CorrectionCandidate> CandidateSearch::Run() {
  for (const int link : pair_.links()) {
    const SiteMask wrong = wrong_[static_cast<size_t>(link)];
    if ((wrong & kPoseMask) != 0) SearchPlace(link);
    if ((wrong & ~(kPoseMask | kBodyMask)) != 0) SearchJoint(link);
    if ((wrong & kBodyMask) != 0) SearchBody(link);
  }
  SearchNames();
  SearchExchanges();
  SearchWelds();
  return std::move(found_);
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

std::string DescribeEntries(std::span<const char* const> names, const double* given, const double* right,
                            const double* open) {
  std::string text;
  for (const size_t k : ListDiffering(names.size(), given, right, open))
    text += fmt::format("{}{} {:.6g}, {:.6g} would be right", text.empty() ? "" : "; ", names[k], given[k],
                        ShowZero(right[k], open[k]));
  return text;
}

double CountEntries(size_t count, const double* given, const double* right, const double* open) {
  double bits = 1.0;
  for (const size_t k : ListDiffering(count, given, right, open))
    bits += CountBits(ShowZero(right[k], open[k]), open[k]);
  return bits;
}

}  // namespace dexcheck
