#include "tests/harness/corrections/drawn_faults.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>

namespace dexcheck::testing {
namespace {

using Kind = CorrectionKind;

struct Spoiling {
  const WrittenForm& form;
  Random* random;
  DrawnRobot* robot;

  [[nodiscard]] std::vector<size_t> List(const std::function<bool(const DrawnLink&)>& concerns) const {
    std::vector<size_t> found;
    for (size_t i = 0; i < robot->links.size(); ++i) {
      if (concerns(robot->links[i])) found.push_back(i);
    }
    return found;
  }
};

bool IsJoint(const DrawnLink& link) { return link.parent >= 0 && link.type != 'f'; }
bool IsPlaced(const DrawnLink& link) { return link.parent >= 0; }
bool IsBody(const DrawnLink& link) { return link.parent >= 0 && link.has_inertial && link.mass > 0.0; }
bool IsTurned(const DrawnLink& link) { return link.parent >= 0 && link.rpy.norm() > 0.1; }

/// A fault of one link; it may be made at several.
struct FaultMaker {
  SiteKind of;
  std::vector<Kind> kinds;
  bool (*concerns)(const DrawnLink&);
  void (*make)(Random*, DrawnLink&);
};

double DrawFactor(Random* random) {
  const double size = Draw(random, 0.05, 0.6);
  return DrawIndex(random, 2) == 0 ? 1.0 + size : 1.0 / (1.0 + size);
}

const std::map<std::string, FaultMaker>& ListMakers() {
  using enum SiteKind;
  using enum CorrectionKind;
  using Rng = Random*;
  using Link = DrawnLink&;
  static const std::map<std::string, FaultMaker> makers = {
      {"mass_grams", {kMass, {kUnit}, IsBody, [](Rng, Link l) { l.mass *= 1e3; }}},
      {"mass_number", {kMass, {kNumber}, IsBody, [](Rng r, Link l) { l.mass *= DrawFactor(r); }}},
      {"mass_pounds", {kMass, {kUnit}, IsBody, [](Rng, Link l) { l.mass /= 0.45359237; }}},
      {"com_mm", {kCom, {kUnit}, IsBody, [](Rng, Link l) { l.com *= 1e3; }}},
      {"com_sign", {kCom, {kSign}, IsBody, [](Rng, Link l) { l.com *= -1.0; }}},
      {"com_sign_x", {kCom, {kSignOf}, IsBody, [](Rng, Link l) { l.com[0] *= -1.0; }}},
      {"com_xy", {kCom, {kPermutation}, IsBody, [](Rng, Link l) { std::swap(l.com[0], l.com[1]); }}},
      {"com_number",
       {kCom, {kNumber}, IsBody, [](Rng r, Link l) { l.com[DrawIndex(r, 3)] += Draw(r, 0.003, 0.03); }}},
      {"com_dropped", {kCom, {kMissing}, IsBody, [](Rng, Link l) { l.com.setZero(); }}},
      {"com_in_parent",
       {kCom, {kInParent}, IsBody, [](Rng, Link l) { l.com = Turn(l.rpy) * l.com + l.xyz; }}},
      {"com_parent_axes",
       {kCom,
        {kAlongParent},
        [](const DrawnLink& l) { return IsBody(l) && IsTurned(l); },
        [](Rng, Link l) { l.com = Turn(l.rpy) * l.com; }}},
      {"inertia_gmm2", {kInertia, {kUnit}, IsBody, [](Rng, Link l) { l.I *= 1e9; }}},
      {"inertia_doubled", {kInertia, {kUnit}, IsBody, [](Rng, Link l) { l.I *= 2.0; }}},
      {"inertia_at_origin",
       {kInertia,
        {kAboutOrigin},
        [](const DrawnLink& l) { return IsBody(l) && l.com_rpy.isZero(); },
        [](Rng, Link l) {
          l.I += Entries(l.mass * (l.com.squaredNorm() * Matrix3d::Identity() - l.com * l.com.transpose()));
        }}},
      {"products_sign", {kInertia, {kProductSigns}, IsBody, [](Rng, Link l) { l.I.tail<3>() *= -1.0; }}},
      {"product_sign",
       {kInertia, {kProductSign}, IsBody, [](Rng r, Link l) { l.I[3 + DrawIndex(r, 3)] *= -1.0; }}},
      {"products_dropped", {kInertia, {kNoProducts}, IsBody, [](Rng, Link l) { l.I.tail<3>().setZero(); }}},
      {"moments_xy", {kInertia, {kMoments}, IsBody, [](Rng, Link l) { std::swap(l.I[0], l.I[1]); }}},
      {"inertia_number",
       {kInertia, {kNumber}, IsBody, [](Rng r, Link l) { l.I[DrawIndex(r, 3)] *= DrawFactor(r); }}},
      {"inertia_axes_dropped",
       {kInertia,
        {kNoAxes, kFrame},
        [](const DrawnLink& l) { return IsBody(l) && !l.com_rpy.isZero(); },
        [](Rng, Link l) { l.com_rpy.setZero(); }}},
      {"inertia_parent_axes",
       {kInertia,
        {kAlongParent},
        [](const DrawnLink& l) { return IsBody(l) && IsTurned(l) && l.com_rpy.isZero(); },
        [](Rng, Link l) { l.I = Entries(Turn(l.rpy) * Tensor(l.I) * Turn(l.rpy).transpose()); }}},
      {"place_mm", {kPosition, {kUnit}, IsPlaced, [](Rng, Link l) { l.xyz *= 1e3; }}},
      {"place_sign",
       {kPosition, {kSignOf, kSign}, IsPlaced, [](Rng r, Link l) { l.xyz[DrawIndex(r, 3)] *= -1.0; }}},
      {"place_number",
       {kPosition,
        {kNumber},
        IsPlaced,
        [](Rng r, Link l) { l.xyz[DrawIndex(r, 3)] += Draw(r, 0.002, 0.05); }}},
      {"place_dropped", {kPosition, {kMissing}, IsPlaced, [](Rng, Link l) { l.xyz.setZero(); }}},
      {"place_yz", {kPosition, {kPermutation}, IsPlaced, [](Rng, Link l) { std::swap(l.xyz[1], l.xyz[2]); }}},
      {"rpy_degrees",
       {kRotation, {kDegrees, kAngleDegrees}, IsTurned, [](Rng, Link l) { l.rpy *= 180.0 / kPi; }}},
      {"rpy_dropped", {kRotation, {kMissing}, IsTurned, [](Rng, Link l) { l.rpy.setZero(); }}},
      {"rpy_reversed",
       {kRotation,
        {kAnglesReversed, kAnglesPermuted},
        IsTurned,
        [](Rng, Link l) { std::swap(l.rpy[0], l.rpy[2]); }}},
      {"rpy_sign",
       {kRotation,
        {kAngleSign, kTransposed, kMirror},
        IsTurned,
        [](Rng r, Link l) { l.rpy[DrawIndex(r, 3)] *= -1.0; }}},
      {"rpy_number",
       {kRotation,
        {kNumber, kZero},
        IsPlaced,
        [](Rng r, Link l) { l.rpy[DrawIndex(r, 3)] += Draw(r, 0.02, 0.4); }}},
      {"rotation_inverse",
       {kRotation,
        {kTransposed, kAngleSign},
        IsTurned,
        [](Rng, Link l) { l.rpy = SolveAngles(Turn(l.rpy).transpose()); }}},
      {"rotation_order",
       {kRotation,
        {kMovingAxes, kFixedAxes},
        IsTurned,
        [](Rng, Link l) {
          l.rpy = SolveAngles((Eigen::AngleAxisd(l.rpy[0], Vector3d::UnitX()) *
                               Eigen::AngleAxisd(l.rpy[1], Vector3d::UnitY()) *
                               Eigen::AngleAxisd(l.rpy[2], Vector3d::UnitZ()))
                                  .toRotationMatrix());
        }}},
      {"zero_offset",
       {kRotation,
        {kZero, kNumber},
        [](const DrawnLink& l) { return IsJoint(l) && l.type == 'h'; },
        [](Rng r, Link l) {
          l.rpy = SolveAngles(Turn(l.rpy) * Eigen::AngleAxisd(Draw(r, 0.05, 0.8), l.axis.normalized()));
        }}},
      {"rotation_oblique",
       {kRotation,
        {kNumber, kSurplus},
        IsPlaced,
        [](Rng r, Link l) {
          l.rpy = SolveAngles(Turn(l.rpy) *
                              Eigen::AngleAxisd(Draw(r, 0.05, 0.4), DrawVector(r, 1.0).normalized()));
        }}},
      {"axis_sign", {kAxis, {kSign}, IsJoint, [](Rng, Link l) { l.axis *= -1.0; }}},
      {"axis_other",
       {kAxis,
        {kOtherAxis, kPermutation},
        IsJoint,
        [](Rng, Link l) { l.axis = Vector3d(l.axis[1], l.axis[2], l.axis[0]); }}},
      {"range_number",
       {kRange,
        {kNumber},
        [](const DrawnLink& l) { return IsJoint(l) && l.range; },
        [](Rng r, Link l) { (*l.range)[1] *= DrawFactor(r); }}},
      {"range_degrees",
       {kRange,
        {kUnit},
        [](const DrawnLink& l) { return IsJoint(l) && l.range && l.type == 'h'; },
        [](Rng, Link l) {
          for (double& x : *l.range) x *= 180.0 / kPi;
        }}},
      {"range_turned",
       {kRange,
        {kSign},
        [](const DrawnLink& l) { return IsJoint(l) && l.range; },
        [](Rng, Link l) {
          l.range = {-(*l.range)[1], -(*l.range)[0]};
        }}},
      {"range_dropped",
       {kRange,
        {kMissing},
        [](const DrawnLink& l) { return IsJoint(l) && l.range && l.type == 'h'; },
        [](Rng, Link l) { l.range.reset(); }}},
      {"damping_number",
       {kDamping, {kNumber, kUnit}, IsJoint, [](Rng r, Link l) { l.damping *= DrawFactor(r); }}},
      {"damping_dropped", {kDamping, {kMissing, kNumber}, IsJoint, [](Rng, Link l) { l.damping = 0.0; }}},
      {"friction_number",
       {kFriction, {kNumber, kUnit}, IsJoint, [](Rng r, Link l) { l.friction *= DrawFactor(r); }}},
      {"type_other",
       {kType,
        {kNumber},
        [](const DrawnLink& l) { return IsJoint(l) && l.leader < 0 && l.range; },
        [](Rng, Link l) { l.type = l.type == 'h' ? 's' : 'h'; }}},
      {"mimic_number",
       {kMimic,
        {kNumber},
        [](const DrawnLink& l) { return l.leader >= 0; },
        [](Rng, Link l) { l.multiplier *= 2.0; }}},
      {"mimic_dropped",
       {kMimic,
        {kMissing},
        [](const DrawnLink& l) { return l.leader >= 0; },
        [](Rng, Link l) { l.leader = -1; }}},
      {"inertial_dropped",
       {kMass,
        {kMissing, kPartMissing},
        [](const DrawnLink& l) { return IsBody(l) && l.type != 'f'; },
        [](Rng, Link l) { l.has_inertial = false; }}},
  };
  return makers;
}

std::string PlaceOf(const FaultMaker& maker, const DrawnLink& link) {
  return maker.of >= SiteKind::kMass ? "link " + link.name : "joint " + link.joint;
}

double Compare(const DrawnLink& a, const DrawnLink& b) {
  const auto far = [](double x, double y) { return std::abs(x - y) / (1e-9 + std::abs(x) + std::abs(y)); };
  double apart =
      far(a.mass, b.mass) + (a.com - b.com).norm() / 0.05 + (a.I - b.I).norm() / b.I.head<3>().sum();
  apart += (a.xyz - b.xyz).norm() + (Turn(a.rpy) - Turn(b.rpy)).norm() + (a.axis - b.axis).norm() +
           far(a.damping, b.damping) + far(a.friction, b.friction);
  const Matrix3d R = Turn(a.com_rpy), Q = Turn(b.com_rpy);
  apart += (R * Tensor(a.I) * R.transpose() - Q * Tensor(b.I) * Q.transpose()).norm() / b.I.head<3>().sum();
  if (a.range.has_value() != b.range.has_value() || a.leader != b.leader || a.type != b.type ||
      a.multiplier != b.multiplier || a.has_inertial != b.has_inertial)
    apart += 1.0;
  if (a.range && b.range)
    apart += std::abs((*a.range)[0] - (*b.range)[0]) + std::abs((*a.range)[1] - (*b.range)[1]);
  return apart;
}

/// An MJCF has no joint at a link that is welded.
void NamePlacesByLinks(const DrawnRobot& robot, MadeFault* made) {
  for (std::string& place : made->places) {
    for (const DrawnLink& link : robot.links) {
      if (link.type == 'f' && place == "joint " + link.joint) place = "link " + link.name;
    }
  }
}

}  // namespace

std::vector<std::string> ListFaultNames() {
  std::vector<std::string> names;
  for (const auto& [name, maker] : ListMakers()) names.push_back(name);
  for (const char* all : {"all com_mm", "all products_sign", "all inertia_at_origin", "all rpy_degrees",
                          "all damping_dropped", "all inertia_gmm2", "all rotation_order"})
    names.emplace_back(all);
  for (const char* whole : {"inertials_exchanged", "names_exchanged", "gravity_number", "last_link_missing",
                            "payload_missing", "places_exchanged"})
    names.emplace_back(whole);
  return names;
}

std::optional<MadeFault> MakeFault(const std::string& name, const WrittenForm& form, Random* random,
                                   DrawnRobot* robot) {
  const DrawnRobot before = *robot;
  MadeFault made;
  made.name = name;
  const bool is_mjcf = form.format == WrittenForm::Format::kMjcf;
  const Spoiling spoiling{form, random, robot};
  const auto pick = [&](const std::vector<size_t>& from) {
    return from[static_cast<size_t>(DrawIndex(random, static_cast<int>(from.size())))];
  };
  if (name == "inertials_exchanged" || name == "places_exchanged") {
    const bool bodies = name == "inertials_exchanged";
    const std::vector<size_t> links = spoiling.List(bodies ? IsBody : IsPlaced);
    if (links.size() < 2) return std::nullopt;
    const size_t i = pick(links);
    const size_t k = pick(links);
    if (i == k) return std::nullopt;
    DrawnLink& a = robot->links[i];
    DrawnLink& b = robot->links[k];
    if (bodies) {
      std::swap(a.mass, b.mass);
      std::swap(a.com, b.com);
      std::swap(a.com_rpy, b.com_rpy);
      std::swap(a.I, b.I);
    } else {
      std::swap(a.xyz, b.xyz);
      std::swap(a.rpy, b.rpy);
    }
    made.of = bodies ? SiteKind::kMass : SiteKind::kPosition;
    made.kinds = {Kind::kExchanged};
    made.places = bodies ? std::vector<std::string>{"link " + a.name, "link " + b.name}
                         : std::vector<std::string>{"joint " + a.joint, "joint " + b.joint};
    made.any_place = true;
    if (is_mjcf) NamePlacesByLinks(*robot, &made);
    return made;
  }
  if (name == "names_exchanged") {
    const std::vector<size_t> links =
        spoiling.List([](const DrawnLink& l) { return IsJoint(l) && l.leader < 0; });
    if (links.size() < 3) return std::nullopt;
    const size_t i = pick(links);
    const size_t k = pick(links);
    if (i == k || i == 1 || k == 1) return std::nullopt;
    std::swap(robot->links[i].joint, robot->links[k].joint);
    made.of = SiteKind::kName;
    made.kinds = {Kind::kExchanged};
    made.places = {"joint " + robot->links[i].joint, "joint " + robot->links[k].joint};
    made.any_place = true;
    return made;
  }
  if (name == "gravity_number") {
    if (!is_mjcf) return std::nullopt;
    robot->gravity *= 1.02;
    made.of = SiteKind::kGravity;
    made.kinds = {Kind::kNumber};
    made.places = {"robot"};
    return made;
  }
  if (name == "last_link_missing" || name == "payload_missing") {
    const auto last = static_cast<int>(robot->links.size()) - 1;
    if (std::ranges::any_of(robot->links, [&](const DrawnLink& l) { return l.parent == last; }))
      return std::nullopt;
    const DrawnLink link = robot->links.back();
    if ((link.type == 'f') != (name == "payload_missing")) return std::nullopt;
    robot->links.pop_back();
    made.of = link.type == 'f' ? SiteKind::kMass : SiteKind::kPresence;
    made.kinds = {link.type == 'f' ? Kind::kPartMissing : Kind::kMissing};
    made.places = {link.type == 'f' ? "link " + robot->links[static_cast<size_t>(link.parent)].name
                                    : "joint " + link.joint};
    return made;
  }
  const bool all = name.starts_with("all ");
  const FaultMaker& maker = ListMakers().at(all ? name.substr(4) : name);
  if (is_mjcf && (maker.of == SiteKind::kEffort || name.find("degrees") != std::string::npos ||
                  name.find("rpy_reversed") != std::string::npos))
    return std::nullopt;
  if (!is_mjcf && name == "range_dropped") return std::nullopt;
  if (is_mjcf && (form.principal && maker.of == SiteKind::kInertia)) return std::nullopt;
  std::vector<size_t> links = spoiling.List(maker.concerns);
  // An MJCF has the tensor along the link's axes only.
  if (is_mjcf && maker.of == SiteKind::kInertia)
    std::erase_if(links, [&](size_t i) { return !robot->links[i].com_rpy.isZero(); });
  if (links.empty() || (all && links.size() < 2)) return std::nullopt;
  const std::vector<size_t> wrong = all ? links : std::vector<size_t>{pick(links)};
  constexpr double kVisible = 5e-3;
  for (const size_t i : wrong) {
    maker.make(random, robot->links[i]);
    if (Compare(robot->links[i], before.links[i]) > kVisible)
      made.places.push_back(PlaceOf(maker, robot->links[i]));
    else
      made.hardly.push_back(PlaceOf(maker, robot->links[i]));
  }
  if (made.places.empty()) {
    *robot = before;
    return std::nullopt;
  }
  made.of = maker.of;
  made.kinds = maker.kinds;
  if (is_mjcf && (maker.of == SiteKind::kRotation || maker.of == SiteKind::kPosition)) {
    if (!form.euler && maker.of == SiteKind::kRotation)
      made.kinds.insert(made.kinds.end(), {Kind::kNumber, Kind::kMirror, Kind::kTransposed});
    NamePlacesByLinks(*robot, &made);
  }
  return made;
}

}  // namespace dexcheck::testing
