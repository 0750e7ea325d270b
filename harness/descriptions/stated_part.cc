#include <algorithm>
#include <cmath>
#include <tuple>

#include "harness/descriptions/conventions.h"

namespace dexcheck {

const char* NameOf(Quantity quantity, bool many) {
  static constexpr const char* kNames[][2] = {
      {"mass", "masses"},        {"centre of mass", "centres of mass"},
      {"inertia", "inertias"},   {"origin", "origins"},
      {"rotation", "rotations"}, {"place", "places"},
      {"axis", "axes"},          {"range", "ranges"},
      {"damping", "dampings"},   {"armature", "armatures"}};
  return kNames[static_cast<size_t>(quantity)][many ? 1 : 0];
}

bool AgreesIn(Quantity quantity, const StatedPart& a, const StatedPart& b, double length, double tolerance) {
  const auto same = [&](double x, double y) {
    return std::abs(x - y) <= tolerance * std::max(std::abs(x), std::abs(y));
  };
  const double trace = std::max(std::abs(a.body.inertia.trace()), std::abs(b.body.inertia.trace()));
  switch (quantity) {
    case Quantity::kMass:
      return same(a.body.mass, b.body.mass);
    case Quantity::kCom:
      return (a.body.com - b.body.com).cwiseAbs().maxCoeff() <= tolerance * length;
    case Quantity::kInertia:
      return (a.body.inertia - b.body.inertia).cwiseAbs().maxCoeff() <= tolerance * trace;
    case Quantity::kRange:
      return same(a.lower, b.lower) && same(a.upper, b.upper);
    case Quantity::kDamping:
      return same(a.damping, b.damping);
    case Quantity::kArmature:
      return same(a.armature, b.armature);
    default:
      return a.axis == b.axis && a.X_PL.isApprox(b.X_PL, tolerance);
  }
}

void TakeFrom(const StatedPart& other, Quantity quantity, StatedPart* part) {
  if (quantity == Quantity::kMass) part->body.mass = other.body.mass;
  if (quantity == Quantity::kCom) part->body.com = other.body.com;
  if (quantity == Quantity::kInertia) part->body.inertia = other.body.inertia;
  if (quantity == Quantity::kRange) std::tie(part->lower, part->upper) = std::tie(other.lower, other.upper);
  if (quantity == Quantity::kDamping) part->damping = other.damping;
  if (quantity == Quantity::kArmature) part->armature = other.armature;
}

}  // namespace dexcheck
