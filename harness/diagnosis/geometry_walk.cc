#include "harness/diagnosis/geometry_walk.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

namespace dexcheck {
namespace {

using ItemKind = PlacedItem::Kind;
using Kind = ParameterKind;

constexpr int kMaxCauses = 12;

// Where nearly all is wrong, nearly all is suspect: pairs of far numbers would take for ever.
constexpr size_t kMostPaired = 30;

bool IsBodyItem(const PlacedItem& item) {
  return item.kind == ItemKind::kCom || item.kind == ItemKind::kInertia;
}

bool IsRotation(Kind kind) {
  return kind == Kind::kAlpha || kind == Kind::kHomeAngle || kind == Kind::kRotation ||
         kind == Kind::kFrameRotation || kind == Kind::kBaseRotation;
}

/// The middle one of three angles, which stays within a quarter turn.
bool IsPitch(const Parameter& parameter) {
  return IsRotation(parameter.kind) && parameter.kind != Kind::kAlpha && parameter.kind != Kind::kHomeAngle &&
         parameter.component == 1;
}

/// A cause for each vector that is changed: two numbers solved for together may be two faults.
std::vector<Repair> Split(const Repair& cause) {
  if (cause.parameters.size() < 2) return {cause};
  std::vector<Repair> parts;
  for (size_t i = 0; i < cause.parameters.size(); ++i) {
    const Parameter& parameter = cause.parameters[i];
    auto same = std::find_if(parts.begin(), parts.end(), [&](const Repair& part) {
      return part.parameters[0].kind == parameter.kind && part.parameters[0].index == parameter.index;
    });
    if (same == parts.end()) same = parts.insert(parts.end(), Repair{});
    same->parameters.push_back(parameter);
    same->values.push_back(cause.values[i]);
  }
  return parts;
}

}  // namespace

GeometryWalk::GeometryWalk(const RobotSpec& spec, const EngineEvidence& evidence, bool bodies,
                           std::function<double(const RobotSpec&)> force_error)
    : spec_(spec),
      placement_(spec, evidence, bodies),
      force_error_(std::move(force_error)),
      left_(placement_.items().size(), false) {}

std::vector<Repair> GeometryWalk::Run() {
  std::vector<Repair> causes;
  while (causes.size() < kMaxCauses) {
    const std::vector<int> failing = ListFailing(placement_.ItemsBeyond(-1));
    const int first = FindFirst(failing);
    if (first < 0) break;
    Repair cause;
    if (FindCause(first, &cause)) {
      Apply(cause, &spec_);
      for (Repair& part : Split(cause)) causes.push_back(std::move(part));
    } else {
      Leave(placement_.items()[static_cast<size_t>(first)].link, failing);
    }
    placement_.Replace(spec_);
  }
  return causes;
}

std::vector<int> GeometryWalk::ListFailing(const std::vector<int>& items) const {
  std::vector<int> failing;
  std::copy_if(items.begin(), items.end(), std::back_inserter(failing),
               [&](int item) { return !left_[static_cast<size_t>(item)] && placement_.Fails(item); });
  return failing;
}

int GeometryWalk::FindFirst(const std::vector<int>& failing) const {
  // Parents have smaller indices than children, so the smallest link has nothing misplaced before it.
  int first = -1;
  for (const int item : failing) {
    const auto link_of = [&](int i) { return placement_.items()[static_cast<size_t>(i)].link; };
    if (first < 0 || link_of(item) < link_of(first)) first = item;
  }
  return first;
}

void GeometryWalk::Leave(int link, const std::vector<int>& failing) {
  const auto is_axis = [&](int index) {
    const PlacedItem& item = placement_.items()[static_cast<size_t>(index)];
    return item.link == link && !IsBodyItem(item) && item.kind != ItemKind::kFramePosition &&
           item.kind != ItemKind::kFrameRotation;
  };
  // What hangs on an axis that stays wrong cannot be put right, and its suspects grow with each link.
  const bool with_carried =
      num_suspects_ > kMostPaired && std::any_of(failing.begin(), failing.end(), is_axis);
  for (const int item : failing) {
    const int there = placement_.items()[static_cast<size_t>(item)].link;
    if (there == link || (with_carried && placement_.Carries(link, there)))
      left_[static_cast<size_t>(item)] = true;
  }
}

bool GeometryWalk::FindCause(int first, Repair* cause) {
  const int link = placement_.items()[static_cast<size_t>(first)].link;
  const std::vector<int> failing = ListFailing(placement_.ItemsBeyond(-1));
  const std::vector<Parameter> suspects = ListSuspects(link, failing);
  num_suspects_ = suspects.size();
  const std::vector<std::vector<int>> targets = ListTargets(link, failing);
  std::vector<Candidate> candidates;
  for (const Parameter& suspect : suspects) TryParameters(link, {suspect}, targets, &candidates);
  TryStructure(link, &candidates);
  const double cost_before = CalcCost(0);
  const auto by_cost = [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; };
  auto best = std::min_element(candidates.begin(), candidates.end(), by_cost);
  if (best == candidates.end() || best->cost >= cost_before) {
    // Whole vectors, then two numbers of one place that hide each other.
    for (const Parameter& parameter : suspects) {
      if (parameter.component != 2) continue;
      std::vector<Parameter> vector(3, parameter);
      for (int k = 0; k < 3; ++k) vector[static_cast<size_t>(k)].component = k;
      TryParameters(link, vector, targets, &candidates);
    }
    best = std::min_element(candidates.begin(), candidates.end(), by_cost);
  }
  if (best == candidates.end() || best->cost >= cost_before) {
    const std::vector<Parameter> near = ListNear(link, suspects);
    for (size_t i = 0; i < near.size(); ++i) {
      for (size_t j = i + 1; j < near.size(); ++j)
        TryParameters(link, {near[i], near[j]}, {targets[0]}, &candidates);
    }
    best = std::min_element(candidates.begin(), candidates.end(), by_cost);
  }
  if (best == candidates.end() || best->cost >= cost_before) return false;
  const double least_cost = best->cost;
  std::vector<Repair> equal;
  for (const Candidate& candidate : candidates) {
    // Angles that were reached through a pole do not come out as they went in.
    if (candidate.cost == least_cost && CalcCostAfter(candidate.cause) == least_cost)
      equal.push_back(candidate.cause);
  }
  if (equal.empty()) return false;
  if (equal.size() > 1 && force_error_) {
    std::vector<double> errors;
    for (const Repair& one : equal) {
      RobotSpec repaired = spec_;
      Apply(one, &repaired);
      errors.push_back(force_error_(repaired));
    }
    constexpr double kSame = 1.0 + 1e-6;
    const double least = *std::min_element(errors.begin(), errors.end());
    const double rounding = placement_.evidence().Widen(1e-9);
    std::vector<Repair> kept;
    for (size_t i = 0; i < equal.size(); ++i) {
      if (errors[i] <= least * kSame + rounding) kept.push_back(equal[i]);
    }
    equal = std::move(kept);
  }
  std::stable_sort(equal.begin(), equal.end(),
                   [&](const Repair& a, const Repair& b) { return IsLikelier(a, b, spec_); });
  *cause = equal.front();
  cause->equivalents.assign(equal.begin() + 1, equal.end());
  return true;
}

std::vector<Parameter> GeometryWalk::ListSuspects(int link, const std::vector<int>& failing) {
  std::vector<Parameter> suspects;
  const auto add = [&](Kind kind, int index, int components) {
    for (int k = 0; k < components; ++k) {
      const Parameter parameter{kind, index, k};
      if (KeepsWhatIsRight(parameter)) suspects.push_back(parameter);
    }
  };
  for (int joint = link; joint >= 0; joint = spec_.joints[static_cast<size_t>(joint)].parent) {
    for (const Kind kind : {Kind::kAlpha, Kind::kA, Kind::kHomeAngle, Kind::kD}) add(kind, joint, 1);
    add(Kind::kPosition, joint, 3);
    add(Kind::kRotation, joint, 3);
  }
  if (spec_.base.type != BaseType::kFloating) add(Kind::kBasePosition, -1, 3);
  if (spec_.base.type == BaseType::kFixed) add(Kind::kBaseRotation, -1, 3);
  for (const int index : failing) {
    const PlacedItem& item = placement_.items()[static_cast<size_t>(index)];
    if (item.link != link) continue;
    if (item.kind == ItemKind::kFramePosition) add(Kind::kFramePosition, item.index, 3);
    if (item.kind == ItemKind::kFrameRotation) add(Kind::kFrameRotation, item.index, 3);
  }
  return suspects;
}

std::vector<Parameter> GeometryWalk::ListNear(int link, const std::vector<Parameter>& suspects) const {
  if (suspects.size() <= kMostPaired) return suspects;
  std::vector<Parameter> near;
  std::copy_if(suspects.begin(), suspects.end(), std::back_inserter(near),
               [&](const Parameter& parameter) { return CarrierOf(spec_, parameter) == link; });
  return near;
}

bool GeometryWalk::KeepsWhatIsRight(const Parameter& parameter) {
  constexpr double kOffset = 1e-3;  // rad or m
  const std::vector<int>& items = placement_.ItemsBeyond(CarrierOf(spec_, parameter));
  std::vector<int> right;
  for (const int item : items) {
    if (!placement_.Fails(item)) right.push_back(item);
  }
  placement_.Set(parameter, GetValue(spec_, parameter) + kOffset);
  const bool keeps =
      std::none_of(right.begin(), right.end(), [&](int item) { return placement_.Fails(item); });
  placement_.Restore(spec_, parameter);
  return keeps;
}

std::vector<std::vector<int>> GeometryWalk::ListTargets(int link, const std::vector<int>& failing) const {
  // All that fails on the link and the axes that it carries; the same without bodies; then each by itself,
  // since another error may spoil the others.
  std::vector<int> near;
  std::vector<int> without_bodies;
  for (const int index : failing) {
    const PlacedItem& item = placement_.items()[static_cast<size_t>(index)];
    const bool axis = item.kind == ItemKind::kAxisDirection || item.kind == ItemKind::kAxisLine;
    const bool carried = axis && spec_.joints[static_cast<size_t>(item.index)].parent == link;
    if (item.link != link && !carried) continue;
    near.push_back(index);
    if (!IsBodyItem(item)) without_bodies.push_back(index);
  }
  std::vector<std::vector<int>> targets = {near};
  if (near.size() == 1) return targets;
  if (!without_bodies.empty() && without_bodies.size() < near.size()) targets.push_back(without_bodies);
  for (const int item : near) targets.push_back({item});
  return targets;
}

VectorXd GeometryWalk::CollectResidual(const std::vector<int>& target) const {
  std::vector<double> rows;
  for (const int item : target) placement_.AppendResidual(item, &rows);
  return Eigen::Map<const VectorXd>(rows.data(), static_cast<Eigen::Index>(rows.size()));
}

bool GeometryWalk::Solve(const std::vector<Parameter>& parameters, const std::vector<int>& target,
                         const std::vector<double>& start) {
  placement_.Focus(target);
  const bool solves =
      Iterate(parameters, target, start) &&
      std::none_of(target.begin(), target.end(), [&](int item) { return placement_.Fails(item); });
  placement_.Unfocus();
  if (solves) placement_.Follow();  // otherwise the parameters are restored
  return solves;
}

bool GeometryWalk::Iterate(const std::vector<Parameter>& parameters, const std::vector<int>& target,
                           const std::vector<double>& start) {
  constexpr int kMaxIterations = 30;
  constexpr double kStep = 1e-6;
  constexpr double kConverged = 1e-14;
  const double zero =
      placement_.evidence().Widen(1e-9);  // far above what is left of a right solution, far below any fault
  constexpr double kExplained = 1e-3;     // of the residual, by a step
  constexpr double kFar = 10.0;           // of the robot's size: no length is that long
  constexpr double kLongestTurn =
      0.7;  // rad; Gauss-Newton steps that stay where the linearisation means something
  const auto count = static_cast<Eigen::Index>(parameters.size());
  const double longest = kFar * placement_.length();
  std::vector<double> values = start;
  for (size_t i = 0; i < parameters.size(); ++i) placement_.Set(parameters[i], values[i]);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const VectorXd residual = CollectResidual(target);
    MatrixXd slope(residual.size(), count);
    for (size_t i = 0; i < parameters.size(); ++i) {
      placement_.Set(parameters[i], values[i] + kStep);
      const VectorXd above = CollectResidual(target);
      placement_.Set(parameters[i], values[i] - kStep);
      slope.col(static_cast<Eigen::Index>(i)) = (above - CollectResidual(target)) / (2.0 * kStep);
      placement_.Set(parameters[i], values[i]);
    }
    if (slope.colwise().norm().minCoeff() < 1e-9) return false;  // moves nothing of the target
    VectorXd step = -slope.colPivHouseholderQr().solve(residual);
    // Where the residual is least and not zero, a step explains next to nothing of it.
    const bool is_zero = residual.cwiseAbs().maxCoeff() < zero;
    if (!is_zero && (slope * step).norm() < kExplained * residual.norm()) return false;
    double change = 0.0;
    for (size_t i = 0; i < parameters.size(); ++i) {
      double& entry = step[static_cast<Eigen::Index>(i)];
      if (IsRotation(parameters[i].kind)) entry = std::clamp(entry, -kLongestTurn, kLongestTurn);
      values[i] += entry;
      if (!IsRotation(parameters[i].kind) && std::abs(values[i]) > longest) return false;
      if (IsPitch(parameters[i]) && std::abs(values[i]) >= 0.5 * kPi) return false;
      placement_.Set(parameters[i], values[i]);
      change = std::max(change, std::abs(entry));
    }
    if (change < kConverged) break;
  }
  return true;
}

int GeometryWalk::CountWrongNumbers(int link) const {
  int wrong = 0;
  for (const int item : placement_.ItemsBeyond(link)) {
    if (placement_.items()[static_cast<size_t>(item)].link == link)
      wrong += placement_.CountWrongNumbers(item);
  }
  return wrong;
}

double GeometryWalk::CalcCost(size_t changes) const {
  double cost = static_cast<double>(changes);
  for (const int item : placement_.ItemsBeyond(-1)) cost += placement_.CountWrongNumbers(item);
  return cost;
}

double GeometryWalk::CalcCostAfter(const Repair& cause) {
  RobotSpec changed = spec_;
  Apply(cause, &changed);
  placement_.Replace(changed);
  const double cost = CalcCost(std::max(cause.parameters.size(), size_t{1}));
  placement_.Replace(spec_);
  return cost;
}

void GeometryWalk::TryParameters(int link, const std::vector<Parameter>& parameters,
                                 const std::vector<std::vector<int>>& targets,
                                 std::vector<Candidate>* candidates) {
  std::vector<double> now;
  now.reserve(parameters.size());
  for (const Parameter& parameter : parameters) now.push_back(GetValue(spec_, parameter));
  const bool turns = std::any_of(parameters.begin(), parameters.end(),
                                 [](const Parameter& parameter) { return IsRotation(parameter.kind); });
  std::vector<double> turned = {0.0};
  if (turns) turned.insert(turned.end(), {0.5 * kPi, -0.5 * kPi, kPi});
  const int wrong_before = CountWrongNumbers(link);
  Candidate best;
  bool found = false;
  for (const std::vector<int>& target : targets) {
    for (const double turn : turned) {
      std::vector<double> start = now;
      for (size_t i = 0; i < parameters.size(); ++i) {
        if (IsRotation(parameters[i].kind) && !IsPitch(parameters[i])) start[i] += turn;
      }
      if (!Solve(parameters, target, start) || CountWrongNumbers(link) >= wrong_before) continue;
      const double cost = CalcCost(parameters.size());
      if (found && cost >= best.cost) break;
      best.cost = cost;
      best.cause.parameters = parameters;
      best.cause.values.clear();
      for (const Parameter& parameter : parameters)
        best.cause.values.push_back(GetValue(placement_.trial(), parameter));
      found = true;
      break;
    }
    if (found && best.cost <= static_cast<double>(parameters.size())) break;
  }
  for (const Parameter& parameter : parameters) placement_.Restore(spec_, parameter);
  if (!found) return;
  for (size_t i = 0; i < parameters.size(); ++i) {
    double& value = best.cause.values[i];
    if (IsRotation(parameters[i].kind)) value = std::remainder(value, 2.0 * kPi);
    value = RoundWithin(spec_, parameters[i], value, placement_.evidence().CalcSolvedDigits());
  }
  candidates->push_back(best);
}

void GeometryWalk::TryStructure(int link, std::vector<Candidate>* candidates) {
  const auto attempt = [&](RepairKind kind, int joint, int other) {
    Candidate candidate;
    candidate.cause.kind = kind;
    candidate.cause.joint = joint;
    candidate.cause.other = other;
    candidate.cost = CalcCostAfter(candidate.cause);
    candidates->push_back(candidate);
  };
  if (link < 0) return;
  const int parent = spec_.joints[static_cast<size_t>(link)].parent;
  attempt(RepairKind::kAxisReversed, link, -1);
  if (parent >= 0) attempt(RepairKind::kAxisReversed, parent, -1);
  for (int other = 0; other < static_cast<int>(spec_.joints.size()); ++other) {
    const int above = spec_.joints[static_cast<size_t>(other)].parent;
    if (other == link) continue;
    if (above == link || above == parent)
      attempt(RepairKind::kRowsSwapped, std::min(link, other), std::max(link, other));
    if (above == parent) attempt(RepairKind::kPosesSwapped, std::min(link, other), std::max(link, other));
  }
}

}  // namespace dexcheck
