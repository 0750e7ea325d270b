#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "harness/diagnosis/force_problem.h"
#include "harness/diagnosis/run_causes.h"
#include "harness/diagnosis/search_limit.h"
#include "harness/diagnosis/telling.h"

namespace dexcheck {
namespace {

constexpr size_t kMostSegments = 8;

/// Whether they have a fault in common.
bool IsSame(const Explanation& a, const Explanation& b) {
  constexpr double kSame = 0.02, kDirection = 0.1;
  const double error = 3.0 * (a.faults.front().error + b.faults.front().error);
  return std::ranges::any_of(a.faults, [&](const Fault& x) {
    return std::ranges::any_of(b.faults, [&](const Fault& y) {
      return x.IsLike(y) && std::abs(x.value - y.value) <= kSame * std::abs(x.value) + error &&
             (x.numbers.size() != y.numbers.size() ||
              (x.numbers - y.numbers).norm() <= kDirection * x.numbers.norm());
    });
  });
}

/// Whether something acts independently of the motion, and may begin and end at any time.
bool HasPush(const Causes& causes) {
  return std::ranges::any_of(causes, [](const Explanation& one) {
    return std::ranges::any_of(one.faults, [](const Fault& fault) {
      return fault.fault.starts_with("force") || fault.fault.starts_with("torque") ||
             fault.fault.starts_with("moment");
    });
  });
}

/// Whether one is free at each step, which explains anything at its place.
bool IsFree(const Causes& causes) {
  return std::ranges::any_of(causes, [](const Explanation& one) {
    return one.faults.front().fault.ends_with(force_fault::kChanges);
  });
}

/// A part of the steps and what explains it.
struct Part {
  bool is_explained = false, is_exact = false;
  ForceProblem::Terms terms;
  Causes causes;

  /// Simpler explanations have smaller ones.
  [[nodiscard]] auto rank() const {
    return std::tuple(!is_explained, !is_exact, IsFree(causes), terms.count);
  }
};

Part ExplainPart(const StepStore& store, StepForces* forces, const Segment& segment, const Part* known) {
  Part part;
  ForceProblem problem(store, forces, segment);
  if (known != nullptr) problem.FixTerms(known->terms);
  part.is_explained = problem.ExplainConstant(segment, &part.causes);
  part.is_exact = problem.is_exact();
  part.terms = problem.terms();
  if (known == nullptr) return part;
  for (Explanation one : known->causes) {
    const Explanation here = StartExplanation(store, CauseChannel::kBalance, segment);
    one.from = here.from, one.to = here.to, one.ends = here.ends;
    one.unseen_before = here.unseen_before, one.unseen_after = here.unseen_after;
    part.causes.push_back(one);
  }
  return part;
}

Segment Concatenate(const std::vector<Segment>& parts, size_t begin, size_t count) {
  Segment whole;
  for (size_t i = begin; i < begin + count; ++i) whole.insert(whole.end(), parts[i].begin(), parts[i].end());
  return whole;
}

/// Joins parts that only gaps divide, as far as the same faults explain them: long runs keep blocks of steps
/// with gaps between them, whose changes are not seen. Returns none where one part is not explained.
std::vector<Segment> JoinAcrossGaps(const StepStore& store, StepForces* forces,
                                    const std::vector<Segment>& parts) {
  const auto is_gap = [&](size_t part) {
    const auto time = store.Get(StepStore::kTime);
    const double apart = time(0, parts[part].front()) - time(0, parts[part - 1].back());
    return apart > 1.5 * store.setup().scenario().plant.time_step;
  };
  size_t seen = 1;  // parts that are cut where a change was seen: each takes its time
  for (size_t part = 1; part < parts.size(); ++part) seen += is_gap(part) ? 0 : 1;
  if (seen > kMostSegments) return {};
  std::optional<Part> known;
  const auto explain = [&](size_t begin, size_t count) {
    const Segment segment = Concatenate(parts, begin, count);
    Part part = ExplainPart(store, forces, segment, nullptr);
    if (!part.is_explained && known) part = ExplainPart(store, forces, segment, &*known);
    return part;
  };
  std::vector<Segment> joined;
  for (size_t begin = 0; begin < parts.size() && joined.size() <= kMostSegments;) {
    const Part first = explain(begin, 1);
    if (!first.is_explained || SearchLimit::IsOver()) return {};
    // A stretch that leaves more than rounding where its first part does not has something else in it.
    const auto is_one = [&](size_t count) {
      const Part part = explain(begin, count);
      return part.is_explained && (part.is_exact || !first.is_exact);
    };
    size_t most = 1;
    while (begin + most < parts.size() && is_gap(begin + most)) ++most;
    // The most that are explained, by bisection, all of them first.
    size_t count = 1, fails = most + 1;
    for (size_t next = most; next > count; next = (count + fails) / 2) (is_one(next) ? count : fails) = next;
    if (!known) known = explain(begin, count);
    joined.push_back(Concatenate(parts, begin, count));
    begin += count;
  }
  return joined;
}

/// Each part by itself, and with what the simplest of them shows; none where a part is not explained, or,
/// where `exactly`, leaves more than rounding.
Causes ExplainParts(const StepStore& store, StepForces* forces, const std::vector<Segment>& segments,
                    bool exactly) {
  std::vector<Part> parts;
  parts.reserve(segments.size());
  for (const Segment& one : segments) {
    if (SearchLimit::IsOver()) return {};
    parts.push_back(ExplainPart(store, forces, one, nullptr));
  }
  const Part simplest = *std::ranges::min_element(
      parts, {}, [](const Part& one) { return std::pair(one.rank(), HasPush(one.causes)); });
  // Properties of the robot do not come and go, as pushes do.
  const bool stays = !HasPush(simplest.causes);
  Causes causes;
  for (size_t i = 0; i < parts.size(); ++i) {
    if (SearchLimit::IsOver()) return {};
    if (simplest.is_explained) {
      Part beside = ExplainPart(store, forces, segments[i], &simplest);
      // A stretch that has the same faults by itself, and no more of them, knows them better.
      const bool has_them = std::ranges::all_of(simplest.causes, [&](const auto& one) {
        return std::ranges::any_of(parts[i].causes, [&](const auto& other) { return IsSame(one, other); });
      });
      if (has_them) beside.terms.count += simplest.terms.count;
      if (beside.rank() < parts[i].rank() || (stays && !has_them && beside.rank() == parts[i].rank()))
        parts[i] = beside;
    }
    if (!parts[i].is_explained || (exactly && !parts[i].is_exact)) return {};
    for (const Explanation& one : parts[i].causes) {
      const auto same = std::find_if(causes.begin(), causes.end(),
                                     [&](const Explanation& other) { return IsSame(one, other); });
      if (same == causes.end()) {
        causes.push_back(one);
      } else {
        same->to = one.to;
        same->ends = one.ends;
        same->unseen_after = one.unseen_after;
        // The better one has fewer faults, or a smaller error of the same one.
        const auto rank = [](const auto& of) { return std::pair(of.faults.size(), of.faults.front().error); };
        if (rank(one) < rank(*same)) same->faults = one.faults, same->outcome = one.outcome;
      }
    }
  }
  return causes;
}

}  // namespace

Causes ExplainForces(const StepStore& store) {
  Causes causes;
  if (store.size() == 0) return causes;
  StepForces forces(store);
  Segment whole;
  std::vector<Segment> parts;
  FindSegments(store, &forces, 1.0, &whole, &parts);
  if (whole.empty()) {
    // Predictions fail by what is less than the bounds of the balances.
    FindSegments(store, &forces, kFaint, &whole, &parts);
    if (!whole.empty()) ForceProblem(store, &forces, whole, kFaint).ExplainConstant(whole, &causes);
    return causes;
  }
  ForceProblem problem(store, &forces, whole);
  const bool is_explained = problem.ExplainConstant(whole, &causes);
  const bool is_exact = is_explained && problem.is_exact();
  constexpr size_t kFewestForSegments = 3;  // so many faults may be fewer that begin one after another
  if ((is_exact && causes.size() < kFewestForSegments) || SearchLimit::IsOver()) return causes;
  const bool are_many = parts.size() > kMostSegments;
  const std::vector<Segment> few = are_many ? JoinAcrossGaps(store, &forces, parts) : parts;
  Causes found;
  if (few.size() > 1 && few.size() <= kMostSegments) found = ExplainParts(store, &forces, few, is_explained);
  if (SearchLimit::IsOver()) return causes;
  // One that grows from a time on explains all steps at once.
  ForceProblem growing(store, &forces, whole, 1.0, ForceProblem::Growth::kWithin);
  Causes grown;
  if (found.size() != 1 && growing.ExplainConstant(whole, &grown) && growing.is_exact() && !IsFree(grown) &&
      !SearchLimit::IsOver() && (found.empty() || grown.size() < found.size()))
    found = grown;
  if (!found.empty() && (!is_exact || found.size() < causes.size())) return found;
  if (!is_explained) problem.ExplainChanging(whole, &causes);
  return causes;
}

}  // namespace dexcheck
