#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "controller/common/text.h"
#include "harness/corrections/candidate_search.h"

namespace dexcheck {
namespace {

using Kind = CorrectionKind;

constexpr const char* kJointKinds[] = {"fixed", "revolute", "prismatic", "ball", "free"};

const char* NameKind(const PrintedLink& link) { return kJointKinds[static_cast<size_t>(link.joint.kind)]; }

EditTrial MakeTrial(Kind kind, SiteKind of, double bits, std::string values = "", int component = 0) {
  return {{kind, of, component}, bits, 0, std::move(values)};
}

}  // namespace

void CandidateSearch::SearchAxis(int link) {
  const PrintedJoint& joint = pair_.a().link(link).joint;
  const RightNode& right = pair_.right(link);
  const Vector3d given = joint.axis.normalized();
  const double open = joint.half_axis.sum() / std::max(joint.axis.norm(), 1e-9) + right.axis_tolerance;
  const auto offer = [&](const FileFault& fault, double bits, const Vector3d& axis, double more = 0.0) {
    if ((axis - right.axis).norm() > open + more) return;
    AddSimple({fault, bits, 0, DescribeRight(joint.axis, axis, "")}, link,
              [axis](PrintedLink* made) { made->joint.axis = axis; });
  };
  if (!joint.states_axis) return offer({Kind::kMissing, SiteKind::kAxis}, 0.5, right.axis);
  // An axis that the other file does not state shows no convention of this one.
  const bool is_shown = pair_.b().link(pair_.Partner(link)).joint.states_axis;
  if (!is_shown) return offer({Kind::kOtherAxis, SiteKind::kAxis}, 25.0, right.axis);
  for (const auto& [fault, axis] : ListAxisEdits(given)) offer(fault, 0.0, axis);
  const bool is_turned = (given + right.axis).norm() <= open;
  const GivenNode& numbers = pair_.given(link);
  const Matrix3d& R = numbers.X.linear();
  if (!R.isIdentity(1e-9)) {
    offer({Kind::kAlongParent, SiteKind::kAxis}, 0.0, R.transpose() * given, numbers.pose.angle);
    offer({Kind::kAlongToParent, SiteKind::kAxis}, 0.0, R * given, numbers.pose.angle);
  }
  const bool is_simple = right.axis.cwiseAbs().maxCoeff() > 1.0 - 1e-6;
  if (!is_turned) offer({Kind::kOtherAxis, SiteKind::kAxis}, is_simple ? 3.0 : 25.0, right.axis);
}

void CandidateSearch::SearchRange(int link) {
  const PrintedJoint& joint = pair_.a().link(link).joint;
  const PrintedJoint& other = pair_.b().link(pair_.Partner(link)).joint;
  const char* const unit = FindUnit(SiteKind::kRange, joint.kind == JointKind::kSlide);
  const auto add = [&](Kind kind, double bits, const std::string& values, int component = 0) {
    AddSimple(MakeTrial(kind, SiteKind::kRange, bits, values, component), link,
              [range = other.range](PrintedLink* made) { made->joint.range = range; });
  };
  if (!joint.range)
    return add(Kind::kMissing, 3.0,
               fmt::format("{:.6g} to {:.6g}{} in the other file", (*other.range)[0].value,
                           (*other.range)[1].value, unit));
  if (!other.range) return add(Kind::kSurplus, 3.0, "");
  const PrintedScalar lower = (*joint.range)[0], upper = (*joint.range)[1];
  const PrintedScalar right_lower = (*other.range)[0], right_upper = (*other.range)[1];
  const auto offer = [&](Kind kind, int component, const PrintedScalar& low, const PrintedScalar& high) {
    double left = 0.0;
    for (const auto& [fixed, right, was] :
         {std::tuple(low, right_lower, lower), std::tuple(high, right_upper, upper)}) {
      const double open = fixed.half + right.half + 1e-9 * (1.0 + std::abs(right.value));
      const std::optional<double> rest =
          CountLeft(std::abs(fixed.value - right.value) / open, std::abs(was.value - right.value) / open);
      if (!rest) return;
      left += *rest;
    }
    add(kind, left, "", component);
  };
  offer(Kind::kSign, 0, {-upper.value, upper.half}, {-lower.value, lower.half});
  const std::span<const UnitFault> units = ListUnits(SiteKind::kRange);
  for (size_t k = 0; k < units.size(); ++k) {
    const double f = units[k].factor;
    offer(Kind::kUnit, static_cast<int>(k), {f * lower.value, f * lower.half},
          {f * upper.value, f * upper.half});
  }
  constexpr const char* kNames[] = {"lower limit", "upper limit"};
  const double given[] = {lower.value, upper.value};
  const double right[] = {right_lower.value, right_upper.value};
  const double open[] = {lower.half + right_lower.half + 1e-9, upper.half + right_upper.half + 1e-9};
  const auto [bits, values] = CompareEntries(kNames, given, right, open, unit);
  add(Kind::kNumber, bits, values);
}

void CandidateSearch::SearchMimic(int link) {
  const PrintedJoint& joint = pair_.a().link(link).joint;
  const PrintedJoint& other = pair_.b().link(pair_.Partner(link)).joint;
  const auto add = [&](Kind kind, double bits, const std::string& values) {
    AddSimple(MakeTrial(kind, SiteKind::kMimic, bits, values), link,
              [mimic = other.mimic](PrintedLink* made) { made->joint.mimic = mimic; });
  };
  const auto show = [](const PrintedMimic& mimic) {
    return fmt::format("{:.6g} times {}", mimic.multiplier.value, mimic.leader);
  };
  if (!joint.mimic) return add(Kind::kMissing, 3.0, show(*other.mimic) + " in the other file");
  if (!other.mimic) return add(Kind::kSurplus, 3.0, show(*joint.mimic));
  std::string values;
  double bits = 1.0;
  const auto say = [&](const char* name, const PrintedScalar& x, const PrintedScalar& y) {
    if (!Differ(x, y)) return;
    values += fmt::format("{}{} {}", values.empty() ? "" : "; ", name, DescribeRight(x.value, y.value, ""));
    bits += CountBits(y.value, y.half);
  };
  say("multiplier", joint.mimic->multiplier, other.mimic->multiplier);
  say("offset", joint.mimic->offset, other.mimic->offset);
  if (joint.mimic->multiplier.value == -other.mimic->multiplier.value &&
      !Differ(joint.mimic->offset, other.mimic->offset))
    add(Kind::kSign, 0.0, values);
  if (values.empty()) values = "follows " + DescribeRight(joint.mimic->leader, other.mimic->leader);
  add(Kind::kNumber, bits, values);
}

void CandidateSearch::SearchScalar(int link, JointScalar scalar) {
  const PrintedRobot& a = pair_.a();
  const PrintedRobot& b = pair_.b();
  const auto at = static_cast<size_t>(scalar);
  const char* const unit = FindUnit(ToSite(scalar), a.link(link).joint.kind == JointKind::kSlide);
  const bool has_motors = a.has_motors && b.has_motors;
  const std::optional<PrintedScalar> given = TakeScalar(a.link(link), scalar, has_motors);
  const std::optional<PrintedScalar> right = TakeScalar(b.link(pair_.Partner(link)), scalar, has_motors);
  const auto add = [&](Kind kind, double bits, const std::string& values = "", int component = 0,
                       bool in_second = false) {
    EditTrial trial = MakeTrial(kind, ToSite(scalar), bits, values, component);
    trial.fault.in_second = in_second;
    AddSimple(trial, link, [at, right](PrintedLink* made) { made->joint.scalars[at] = right; });
  };
  if (scalar == JointScalar::kGear) {
    const bool has_none = given && given->value == 0.0, lacks_none = right && right->value == 0.0;
    if (has_none && !lacks_none) return add(Kind::kMissing, 0.0, "the joint has no motor");
    if (lacks_none && !has_none) return add(Kind::kMissing, 4.0, "the joint has no motor", 0, true);
    if (!given || !right) return add(Kind::kSign, 0.0, "", 0, !given);
  }
  if (!given || !right) return;
  // A number that a whole file lacks is missing in it, whatever it is.
  constexpr double kColumn = 0.1;
  if (given->value == 0.0)
    add(Kind::kMissing, PrintedPair::States(a, scalar) ? 3.0 : kColumn,
        fmt::format("{:.6g}{} in the other file", right->value, unit));
  if (right->value == 0.0)
    add(Kind::kSurplus, PrintedPair::States(b, scalar) ? 5.0 : kColumn,
        fmt::format("{:.6g}{}", given->value, unit));
  if (given->value == -right->value) add(Kind::kSign, 0.0);
  const std::span<const UnitFault> units = ListUnits(ToSite(scalar));
  for (size_t k = 0; k < units.size() && given->value != 0.0 && right->value != 0.0; ++k) {
    const double f = units[k].factor;
    if (!Differ({given->value * f, given->half * std::abs(f)}, *right))
      add(Kind::kUnit, 1.0, "", static_cast<int>(k));
  }
  // A number that the file does not state is missing, and no other value.
  if (a.link(link).joint.scalars[at])
    add(Kind::kNumber, CountBits(right->value, right->half), DescribeRight(given->value, right->value, unit));
}

void CandidateSearch::SearchJoint(int link) {
  const PrintedLink& given = pair_.a().link(link);
  const PrintedLink& other = pair_.b().link(pair_.Partner(link));
  const RightNode& right = pair_.right(link);
  if (IsWrong(link, SiteKind::kCarrier)) {
    const auto name = [](const PrintedRobot& robot, int parent) {
      return parent < 0 ? std::string("the world") : robot.link(parent).name;
    };
    const std::string values =
        fmt::format("{} carries it here, {} in the other file", name(pair_.a(), pair_.node(link).parent),
                    name(pair_.b(), pair_.node_b(pair_.Partner(link)).parent));
    AddSimple(MakeTrial(Kind::kNumber, SiteKind::kCarrier, 8.0, values), link, [](PrintedLink*) {});
  }
  if (IsWrong(link, SiteKind::kType) && given.joint.kind != other.joint.kind) {
    AddSimple(MakeTrial(Kind::kNumber, SiteKind::kType, 3.0, DescribeRight(NameKind(given), NameKind(other))),
              link, [&](PrintedLink* made) {
                const Vector3d axis = HasAxis(given) && HasAxis(other) ? given.joint.axis : right.axis;
                made->joint = other.joint;
                made->joint.axis = axis;
                made->joint.anchor = right.anchor;
              });
  }
  if (IsWrong(link, SiteKind::kAxis)) SearchAxis(link);
  // Only an MJCF states a point of the axis; in other files it is the link's origin.
  if (IsWrong(link, SiteKind::kAxisPoint) && pair_.a().format == RobotFormat::kMjcf) {
    AddSimple(MakeTrial(Kind::kNumber, SiteKind::kAxisPoint, given.joint.anchor.isZero() ? 40.0 : 20.0,
                        DescribeRight(given.joint.anchor, right.anchor, " m")),
              link, [&](PrintedLink* made) { made->joint.anchor = right.anchor; });
  }
  if (IsWrong(link, SiteKind::kRange)) SearchRange(link);
  if (IsWrong(link, SiteKind::kMimic)) SearchMimic(link);
  for (size_t k = 0; k < kNumJointScalars; ++k) {
    if (IsWrong(link, ToSite(static_cast<JointScalar>(k)))) SearchScalar(link, static_cast<JointScalar>(k));
  }
}

/// Motors that drive other joints, which then have their gears and limits, and servos of other gains.
void CandidateSearch::SearchMotors(const Site& site) {
  PrintedRobot moved = pair_.a();
  EditTrial trial = MakeTrial(Kind::kNumber, SiteKind::kMotor, 0.0);
  const auto say = [&](const std::string& text, double bits) {
    trial.values += (trial.values.empty() ? "" : "; ") + text;
    trial.bits += bits;
  };
  for (PrintedMotor& motor : moved.motors) {
    const PrintedMotor right = pair_.FindRight(motor);
    if (right.link != motor.link)
      say(motor.name + " drives " +
              DescribeRight(moved.link(motor.link).joint.name, moved.link(right.link).joint.name),
          3.0);
    if (right.servo != motor.servo) say(motor.name + " " + DescribeRight(motor.servo, right.servo), 12.0);
    motor = right;
  }
  TakeMotors(&moved);
  std::vector<Site> right = {site};
  for (const Site& other : sites_) {
    if (other.kind == SiteKind::kConstraint && pair_.RenameConstraints(moved) == pair_.b().constraints)
      right.push_back(other);
    if (other.kind != SiteKind::kGear && other.kind != SiteKind::kEffort) continue;
    const JointScalar scalar = other.kind == SiteKind::kGear ? JointScalar::kGear : JointScalar::kEffort;
    const std::optional<PrintedScalar> x = TakeScalar(moved.link(other.link), scalar, true);
    const std::optional<PrintedScalar> y =
        TakeScalar(pair_.b().link(pair_.Partner(other.link)), scalar, true);
    if (x && y && !Differ(*x, *y)) right.push_back(other);
  }
  Add(trial, site.link, right);
}

/// Names, joints that one file lacks, and what is of the whole robot.
void CandidateSearch::SearchRobot() {
  const PrintedRobot& a = pair_.a();
  const PrintedRobot& b = pair_.b();
  for (const Site& site : sites_) {
    const auto add = [&](Kind kind, double bits, const std::string& values, int component = 0) {
      Add(MakeTrial(kind, site.kind, bits, values, component), site.link, {site});
    };
    if (site.kind == SiteKind::kName) {
      const std::string right = b.link(pair_.Partner(site.link)).joint.name;
      AddSimple(MakeTrial(Kind::kExchanged, SiteKind::kName, 1.0,
                          fmt::format("{} should be {}", a.link(site.link).joint.name, right)),
                site.link, [right](PrintedLink* made) { made->joint.name = right; });
    } else if (site.kind == SiteKind::kLinkName) {
      add(Kind::kExchanged, 1.0,
          fmt::format("{} should be {}", a.link(site.link).name, b.link(pair_.Partner(site.link)).name));
    } else if (site.kind == SiteKind::kMotor) {
      SearchMotors(site);
    } else if (site.kind == SiteKind::kPresence) {
      const bool second = site.link < 0;
      const PrintedLink& link = second ? b.link(-1 - site.link) : a.link(site.link);
      add(second ? Kind::kMissing : Kind::kSurplus, 3.0,
          fmt::format("joint {}, link {}", link.joint.name, link.name));
    } else if (site.kind == SiteKind::kType && site.link == 0 && a.floats && b.floats) {
      const auto name = [](bool floats) { return std::string(floats ? "floating" : "fixed"); };
      add(Kind::kNumber, 3.0, DescribeRight(name(*a.floats) + " base", name(*b.floats)));
    } else if (site.kind == SiteKind::kConstraint) {
      const auto list = [](const std::vector<std::string>& own, const std::vector<std::string>& other) {
        std::vector<std::string> only;
        std::ranges::set_difference(own, other, std::back_inserter(only));
        return only;
      };
      const std::vector<std::string> ours = pair_.RenameConstraints(a);
      const std::vector<std::string> lacking = list(b.constraints, ours), surplus = list(ours, b.constraints);
      if (!lacking.empty() && !surplus.empty())
        add(Kind::kNumber, 8.0, DescribeRight(JoinNames(surplus), JoinNames(lacking)));
      if (!lacking.empty() && surplus.empty()) add(Kind::kMissing, 3.0, JoinNames(lacking));
      if (lacking.empty()) add(Kind::kSurplus, 3.0, JoinNames(surplus));
    } else if (site.kind == SiteKind::kGravity) {
      const Vector3d& given = *a.gravity;
      const Vector3d& right = *b.gravity;
      const Vector3d open = Vector3d::Constant(1e-6);
      const double size = right.norm();
      const auto [bits, values] = CompareEntries(kAxisNames, given, right, open, " m/s^2");
      if ((given + right).norm() <= 1e-6 * size) add(Kind::kSign, 0.0, values);
      if (given.isZero()) add(Kind::kMissing, 0.0, values);
      if ((1e-3 * given - right).norm() <= 1e-6 * size) add(Kind::kUnit, 0.0, values);
      if (std::abs(given.norm() - size) <= 1e-6 * size) add(Kind::kOtherAxis, 3.0, values);
      add(Kind::kNumber, bits, values);
    }
  }
}

}  // namespace dexcheck
