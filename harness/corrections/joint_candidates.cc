#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/corrections/candidate_search.h"
#include "harness/corrections/origin_fixes.h"

namespace dexcheck {
namespace {

const char* NameJointKind(JointKind kind) {
  switch (kind) {
    case JointKind::kFixed:
      return "fixed";
    case JointKind::kHinge:
      return "revolute";
    case JointKind::kSlide:
      return "prismatic";
    case JointKind::kBall:
      return "ball";
    case JointKind::kFree:
      return "free";
  }
  return "";
}

std::string DescribeRight(double given, double right) {
  return fmt::format("{:.6g}, {:.6g} would be right", given, right);
}

}  // namespace

void CandidateSearch::SearchAxis(int link) {
  const PrintedJoint& joint = pair_.a().link(link).joint;
  const RightNode& right = pair_.right(link);
  const Vector3d given = joint.axis.normalized();
  const double open = joint.half_axis.sum() / std::max(joint.axis.norm(), 1e-9) + right.axis_tolerance;
  const Site site{SiteKind::kAxis, link};
  const auto offer = [&](CorrectionKind kind, int component, double bits, const Vector3d& axis,
                         double more = 0.0) {
    if ((axis - right.axis).norm() > open + more) return;
    const std::string values =
        kind == CorrectionKind::kSign
            ? ""
            : fmt::format("({:.6g} {:.6g} {:.6g}), ({:.6g} {:.6g} {:.6g}) would be right", joint.axis.x(),
                          joint.axis.y(), joint.axis.z(), axis.x(), axis.y(), axis.z());
    AddSimple(kind, site, bits, values,
              [&](const PrintedLink&, PrintedLink* after) { after->joint.axis = axis; });
    found_.back().fault.component = component;
  };
  for (const OriginFix& fix : ListVectorFixes(SiteKind::kAxis, given)) {
    if (fix.kind != CorrectionKind::kSignOf)
      offer(fix.kind, fix.component, fix.bits, FixVector(fix, SiteKind::kAxis, given));
  }
  const GivenNode& numbers = pair_.given(link);
  const Matrix3d& R = numbers.X.linear();
  if (!R.isIdentity(1e-9)) {
    offer(CorrectionKind::kAlongParent, 0, 0.0, R.transpose() * given, numbers.pose.angle);
    offer(CorrectionKind::kAlongToParent, 0, 0.0, R * given, numbers.pose.angle);
  }
  const bool is_default =
      (given - Vector3d::UnitX()).norm() < 1e-12 && pair_.a().format == RobotFormat::kUrdf;
  if (is_default) offer(CorrectionKind::kMissing, 0, 2.0, right.axis);
  const bool is_simple = right.axis.cwiseAbs().maxCoeff() > 1.0 - 1e-6;
  offer(CorrectionKind::kOtherAxis, 0, is_simple ? 3.0 : 25.0, right.axis);
}

void CandidateSearch::SearchRange(int link) {
  const PrintedJoint& joint = pair_.a().link(link).joint;
  const PrintedJoint& other = pair_.b().link(pair_.Partner(link)).joint;
  const Site site{SiteKind::kRange, link};
  const auto take = [&](const PrintedLink&, PrintedLink* after) { after->joint.range = other.range; };
  if (!joint.range)
    return AddSimple(
        CorrectionKind::kMissing, site, 3.0,
        fmt::format("{:.6g} to {:.6g} would be right", (*other.range)[0].value, (*other.range)[1].value),
        take);
  if (!other.range) return AddSimple(CorrectionKind::kSurplus, site, 3.0, "", take);
  const PrintedScalar lower = (*joint.range)[0], upper = (*joint.range)[1];
  const PrintedScalar right_lower = (*other.range)[0], right_upper = (*other.range)[1];
  const auto offer = [&](CorrectionKind kind, int component, const PrintedScalar& low,
                         const PrintedScalar& high) {
    double left = 0.0;
    for (const auto& [fixed, right, was] :
         {std::tuple(low, right_lower, lower), std::tuple(high, right_upper, upper)}) {
      const double open = fixed.half + right.half + 1e-9 * (1.0 + std::abs(right.value));
      const std::optional<double> rest =
          CountLeft(std::abs(fixed.value - right.value) / open, std::abs(was.value - right.value) / open);
      if (!rest) return;
      left += *rest;
    }
    AddSimple(kind, site, left, "", take);
    found_.back().fault.component = component;
  };
  offer(CorrectionKind::kSign, 0, {-upper.value, upper.half}, {-lower.value, lower.half});
  const std::span<const UnitFault> units = ListUnits(SiteKind::kRange);
  for (size_t k = 0; k < units.size(); ++k) {
    const double f = units[k].factor;
    offer(CorrectionKind::kUnit, static_cast<int>(k), {f * lower.value, f * lower.half},
          {f * upper.value, f * upper.half});
  }
  constexpr const char* kNames[] = {"lower limit", "upper limit"};
  const double given[] = {lower.value, upper.value};
  const double right[] = {right_lower.value, right_upper.value};
  const double open[] = {lower.half + right_lower.half + 1e-9, upper.half + right_upper.half + 1e-9};
  AddSimple(CorrectionKind::kNumber, site, CountEntries(2, given, right, open),
            DescribeEntries(kNames, given, right, open), take);
}

void CandidateSearch::SearchMimic(int link) {
  const PrintedJoint& joint = pair_.a().link(link).joint;
  const PrintedJoint& other = pair_.b().link(pair_.Partner(link)).joint;
  const Site site{SiteKind::kMimic, link};
  const auto take = [&](const PrintedLink&, PrintedLink* after) { after->joint.mimic = other.mimic; };
  if (!joint.mimic)
    return AddSimple(
        CorrectionKind::kMissing, site, 3.0,
        fmt::format("{:.6g} times {} would be right", other.mimic->multiplier.value, other.mimic->leader),
        take);
  if (!other.mimic) return AddSimple(CorrectionKind::kSurplus, site, 3.0, "", take);
  std::string values;
  double bits = 1.0;
  const auto say = [&](const char* name, const PrintedScalar& x, const PrintedScalar& y) {
    if (!Differ(x, y)) return;
    values += fmt::format("{}{} {}", values.empty() ? "" : "; ", name, DescribeRight(x.value, y.value));
    bits += CountBits(y.value, y.half);
  };
  say("multiplier", joint.mimic->multiplier, other.mimic->multiplier);
  say("offset", joint.mimic->offset, other.mimic->offset);
  if (values.empty())
    values = fmt::format("follows {}, {} would be right", joint.mimic->leader, other.mimic->leader);
  AddSimple(CorrectionKind::kNumber, site, bits, values, take);
}

void CandidateSearch::SearchScalar(int link, JointScalar scalar) {
  const PrintedRobot& a = pair_.a();
  const PrintedRobot& b = pair_.b();
  const PrintedLink& other = b.link(pair_.Partner(link));
  const Site site{ToSite(scalar), link};
  const auto at = static_cast<size_t>(scalar);
  const std::optional<PrintedScalar> given = TakeScalar(a, a.link(link), scalar);
  const std::optional<PrintedScalar> right = TakeScalar(b, other, scalar);
  const auto take = [&](const PrintedLink&, PrintedLink* after) { after->joint.scalars[at] = right; };
  if (scalar == JointScalar::kGear) {
    if (given && given->value == 0.0 && !(right && right->value == 0.0))
      return AddSimple(CorrectionKind::kMissing, site, 0.0, "the joint has no motor", take);
    if (right && right->value == 0.0 && !(given && given->value == 0.0)) {
      AddSimple(CorrectionKind::kMissing, site, 4.0, "the joint has no motor", take);
      found_.back().fault.in_second = true;
      return;
    }
    if (!given || !right) {
      AddSimple(CorrectionKind::kSign, site, 0.0, "", take);
      found_.back().fault.in_second = !given;
      return;
    }
  }
  if (!given || !right) return;
  if (given->value == 0.0)
    AddSimple(CorrectionKind::kMissing, site, 3.0, fmt::format("{:.6g} would be right", right->value), take);
  if (right->value == 0.0)
    AddSimple(CorrectionKind::kSurplus, site, PrintedPair::States(b, scalar) ? 5.0 : 3.0,
              fmt::format("{:.6g}", given->value), take);
  if (given->value == -right->value) AddSimple(CorrectionKind::kSign, site, 0.0, "", take);
  const std::span<const UnitFault> units = ListUnits(site.kind);
  for (size_t k = 0; k < units.size() && given->value != 0.0 && right->value != 0.0; ++k) {
    const double f = units[k].factor;
    if (Differ({given->value * f, given->half * std::abs(f)}, *right)) continue;
    AddSimple(CorrectionKind::kUnit, site, 1.0, "", take);
    found_.back().fault.component = static_cast<int>(k);
  }
  AddSimple(CorrectionKind::kNumber, site, CountBits(right->value, right->half),
            DescribeRight(given->value, right->value), take);
}

void CandidateSearch::SearchJoint(int link) {
  const PrintedLink& given = pair_.a().link(link);
  const PrintedLink& other = pair_.b().link(pair_.Partner(link));
  if (IsWrong(link, SiteKind::kCarrier)) {
    const int parent = pair_.node_b(pair_.Partner(link)).parent;
    AddSimple(CorrectionKind::kNumber, {SiteKind::kCarrier, link}, 8.0,
              fmt::format("{} carries it, {} would be right", pair_.a().link(pair_.node(link).parent).name,
                          pair_.b().link(parent).name),
              [](const PrintedLink&, PrintedLink*) {});
  }
  if (IsWrong(link, SiteKind::kType)) {
    AddSimple(CorrectionKind::kNumber, {SiteKind::kType, link}, 3.0,
              fmt::format("{}, {} would be right", NameJointKind(given.joint.kind),
                          NameJointKind(other.joint.kind)),
              [&](const PrintedLink&, PrintedLink* after) {
                after->joint = other.joint;
                after->joint.axis = pair_.right(link).axis;
                after->joint.anchor = pair_.right(link).anchor;
              });
  }
  if (IsWrong(link, SiteKind::kAxis)) SearchAxis(link);
  if (IsWrong(link, SiteKind::kAxisPoint)) {
    const Vector3d& right = pair_.right(link).anchor;
    AddSimple(
        CorrectionKind::kNumber, {SiteKind::kAxisPoint, link}, 20.0,
        fmt::format("({:.6g} {:.6g} {:.6g}), ({:.6g} {:.6g} {:.6g}) would be right", given.joint.anchor.x(),
                    given.joint.anchor.y(), given.joint.anchor.z(), right.x(), right.y(), right.z()),
        [&](const PrintedLink&, PrintedLink* after) { after->joint.anchor = right; });
  }
  if (IsWrong(link, SiteKind::kRange)) SearchRange(link);
  if (IsWrong(link, SiteKind::kMimic)) SearchMimic(link);
  for (size_t k = 0; k < kNumJointScalars; ++k) {
    if (IsWrong(link, ToSite(static_cast<JointScalar>(k)))) SearchScalar(link, static_cast<JointScalar>(k));
  }
}

void CandidateSearch::SearchNames() {
  for (const Site& site : sites_) {
    if (site.kind == SiteKind::kName) {
      const std::string& right = pair_.b().link(pair_.Partner(site.link)).joint.name;
      AddSimple(CorrectionKind::kExchanged, site, 1.0,
                fmt::format("{} should be {}", pair_.a().link(site.link).joint.name, right),
                [&](const PrintedLink&, PrintedLink* after) { after->joint.name = right; });
    } else if (site.kind == SiteKind::kPresence) {
      const bool second = site.link < 0;
      const PrintedLink& link = second ? pair_.b().link(-1 - site.link) : pair_.a().link(site.link);
      FileFault fault;
      fault.kind = second ? CorrectionKind::kMissing : CorrectionKind::kSurplus;
      fault.of = SiteKind::kPresence;
      Add(fault, site.link, {site}, 3.0, {}, fmt::format("joint {}, link {}", link.joint.name, link.name));
    } else if (site.kind == SiteKind::kGravity) {
      const Vector3d& given = *pair_.a().gravity;
      const Vector3d& right = *pair_.b().gravity;
      FileFault fault;
      fault.of = SiteKind::kGravity;
      fault.kind = (given + right).norm() <= 1e-9 ? CorrectionKind::kSign : CorrectionKind::kNumber;
      const Vector3d open = Vector3d::Constant(1e-6);
      Add(fault, 0, {site},
          fault.kind == CorrectionKind::kSign ? 0.0
                                              : CountEntries(3, given.data(), right.data(), open.data()),
          {}, DescribeEntries(kAxisNames, given.data(), right.data(), open.data()));
    }
  }
}

}  // namespace dexcheck
