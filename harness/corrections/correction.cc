#include "harness/corrections/correction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace dexcheck {
namespace {

constexpr UnitFault kLengths[] = {{1e-3, "in mm"},
                                  {1e-2, "in cm"},
                                  {0.0254, "in inches"},
                                  {1e3, "a thousandth (converted from mm twice)"},
                                  {1e2, "a hundredth (converted from cm twice)"}};
constexpr UnitFault kMasses[] = {
    {1e-3, "in g"},   {0.45359237, "in pounds"},    {1e3, "a thousandth"}, {2.0, "halved"},
    {0.5, "doubled"}, {0.1, "ten times too large"}, {10.0, "a tenth"},     {-1.0, "with the other sign"}};
constexpr UnitFault kInertias[] = {
    {1e-9, "in g mm^2"},          {1e-7, "in g cm^2"},     {1e-6, "in kg mm^2"},
    {1e-4, "in kg cm^2"},         {1e-3, "in g m^2"},      {0.45359237 * 0.0254 * 0.0254, "in lb in^2"},
    {1e9, "divided by 1e9"},      {1e6, "divided by 1e6"}, {1e4, "divided by 1e4"},
    {1e3, "divided by 1000"},     {2.0, "halved"},         {0.5, "doubled"},
    {0.1, "ten times too large"}, {10.0, "a tenth"}};
constexpr UnitFault kRanges[] = {
    {kPi / 180.0, "in degrees"}, {180.0 / kPi, "converted to radians twice"}, {1e-3, "in mm"}};
constexpr UnitFault kDampings[] = {{180.0 / kPi, "per degree"},  {kPi / 180.0, "times pi/180"},
                                   {1e-3, "times 1000"},         {1e3, "a thousandth"},
                                   {0.1, "ten times too large"}, {10.0, "a tenth"}};
constexpr UnitFault kArmatures[] = {
    {1e-6, "in kg mm^2"}, {1e-7, "in g cm^2"}, {1e-4, "in kg cm^2"}, {1e-3, "times 1000"}};
constexpr UnitFault kGears[] = {{-1.0, "with the other sign"}};

constexpr const char* kAxes[] = {"x", "y", "z"};
constexpr const char* kAngles[] = {"roll", "pitch", "yaw"};
constexpr const char* kProducts[] = {"ixy", "ixz", "iyz"};
constexpr const char* kPermuted[] = {"with x and y exchanged", "with x and z exchanged",
                                     "with y and z exchanged", "in the order y z x", "in the order z x y"};
constexpr const char* kSixWords[] = {
    "with its six numbers read as xx xy xz yy yz zz", "with its six numbers read as xx xy yy xz yz zz",
    "with its products read as yz xz xy", "with its products read as xy yz xz",
    "with its products read as xz xy yz"};

/// Words of a kind; "{}" stands for its component.
struct KindWords {
  CorrectionKind kind;
  const char* words;
};
constexpr KindWords kWords[] = {
    {CorrectionKind::kNumber, "another value"},
    {CorrectionKind::kMissing, "missing"},
    {CorrectionKind::kSurplus, "stated only here"},
    {CorrectionKind::kSign, "with the other sign"},
    {CorrectionKind::kSignOf, "with the sign of {} turned around"},
    {CorrectionKind::kDegrees, "with its angles in degrees"},
    {CorrectionKind::kRadians, "with its angles converted to radians twice"},
    {CorrectionKind::kAngleSign, "with the sign of {} turned around"},
    {CorrectionKind::kAngleDegrees, "with {} in degrees"},
    {CorrectionKind::kAnglesReversed, "with its angles in the order yaw, pitch, roll"},
    {CorrectionKind::kMovingAxes, "as if its angles were about fixed axes, they are about moving ones"},
    {CorrectionKind::kFixedAxes, "as if its angles were about moving axes, they are about fixed ones"},
    {CorrectionKind::kTransposed, "transposed (inverse)"},
    {CorrectionKind::kScalarFirst, "with a quaternion w x y z read as x y z w"},
    {CorrectionKind::kScalarLast, "with a quaternion x y z w read as w x y z"},
    {CorrectionKind::kMirror, "mirrored in {}"},
    {CorrectionKind::kZero, "with another zero of the joint"},
    {CorrectionKind::kAlongLink, "given along the link's own axes"},
    {CorrectionKind::kAlongParent, "given along the parent's axes"},
    {CorrectionKind::kInParent, "given in the parent's frame"},
    {CorrectionKind::kToParent, "given in the link's frame, to be in the parent's"},
    {CorrectionKind::kAlongToParent, "given along the link's axes, to be along the parent's"},
    {CorrectionKind::kPlaceAdded, "with the place of its joint added"},
    {CorrectionKind::kPlaceTaken, "with the place of its joint taken away"},
    {CorrectionKind::kInChild, "given in the frame of a link that it carries"},
    {CorrectionKind::kInertialAxes, "given along the axes of its inertia"},
    {CorrectionKind::kToInertialAxes, "turned by the rotation of its inertial frame"},
    {CorrectionKind::kInverse, "inverted (the parent's frame in the link's)"},
    {CorrectionKind::kAboutOrigin, "about the link's origin instead of the centre of mass"},
    {CorrectionKind::kMovedTwice, "moved to the centre of mass twice"},
    {CorrectionKind::kAboutOriginAxes, "about the link's origin, along its own axes"},
    {CorrectionKind::kAboutParent, "about the parent's origin"},
    {CorrectionKind::kProductSigns, "with the signs of its products turned around"},
    {CorrectionKind::kProductSign, "with the sign of {} turned around"},
    {CorrectionKind::kNoProducts, "without its products"},
    {CorrectionKind::kNoAxes, "without the rotation of its frame"},
    {CorrectionKind::kLinkAxes, "with a rotation of its frame that is too much"},
    {CorrectionKind::kWithMass, "not scaled with the mass"},
    {CorrectionKind::kExchanged, "exchanged with that of"},
    {CorrectionKind::kOfOther, "that of"},
    {CorrectionKind::kPartMissing, "without a part that is welded to it"},
    {CorrectionKind::kOtherAxis, "another axis"},
};

std::string NameComponent(const FileFault& fault) {
  const auto at = static_cast<size_t>(fault.component);
  switch (fault.kind) {
    case CorrectionKind::kAngleSign:
    case CorrectionKind::kAngleDegrees:
      return kAngles[at];
    case CorrectionKind::kProductSign:
      return kProducts[at];
    default:
      return kAxes[at % 3];
  }
}

std::string DescribeKind(const FileFault& fault) {
  const auto at = static_cast<size_t>(fault.component);
  switch (fault.kind) {
    case CorrectionKind::kUnit:
      return ListUnits(fault.of)[at].words;
    case CorrectionKind::kPermutation:
      return kPermuted[at];
    case CorrectionKind::kAnglesPermuted:
      return fmt::format("with its angles {}", kPermuted[at]);
    case CorrectionKind::kMoments:
      return fmt::format("with its moments {}", kPermuted[at]);
    case CorrectionKind::kSixOrder:
    case CorrectionKind::kSixOrderInverse:
      return kSixWords[at];
    case CorrectionKind::kEulerSequence:
      return fmt::format("with its angles taken in another order, {} would be right", kSequences[at]);
    case CorrectionKind::kTurnOwn:
    case CorrectionKind::kTurnParent:
      return fmt::format("turned by {} degrees about {} {}",
                         fault.component % 3 == 0   ? -90
                         : fault.component % 3 == 1 ? 180
                                                    : 90,
                         fault.kind == CorrectionKind::kTurnOwn ? "its own" : "the parent's", kAxes[at / 3]);
    case CorrectionKind::kExchanged:
      if (fault.of == SiteKind::kName) return "exchanged";
      break;
    case CorrectionKind::kFrame: {
      FileFault rotation = fault;
      rotation.kind = fault.rotation;
      return "in a frame whose rotation is " + DescribeKind(rotation);
    }
    default:
      break;
  }
  const auto* const found = std::ranges::find(kWords, fault.kind, &KindWords::kind);
  return fmt::format(fmt::runtime(found->words), NameComponent(fault));
}

}  // namespace

bool IsSameFault(const FileFault& a, const FileFault& b) {
  return a.kind == b.kind && a.of == b.of && a.component == b.component && a.rotation == b.rotation &&
         a.in_second == b.in_second && a.whole == b.whole;
}

const char* NameSite(SiteKind kind) {
  switch (kind) {
    case SiteKind::kCarrier:
      return "carrying link";
    case SiteKind::kPresence:
      return "joint";
    case SiteKind::kName:
      return "name";
    case SiteKind::kType:
      return "type";
    case SiteKind::kPosition:
      return "position";
    case SiteKind::kRotation:
      return "rotation";
    case SiteKind::kAxis:
      return "axis";
    case SiteKind::kAxisPoint:
      return "point of the axis";
    case SiteKind::kRange:
      return "range";
    case SiteKind::kMimic:
      return "mimic";
    case SiteKind::kDamping:
      return "damping";
    case SiteKind::kFriction:
      return "friction";
    case SiteKind::kArmature:
      return "armature";
    case SiteKind::kEffort:
      return "effort limit";
    case SiteKind::kVelocity:
      return "velocity limit";
    case SiteKind::kStiffness:
      return "stiffness";
    case SiteKind::kSpringAngle:
      return "spring's angle";
    case SiteKind::kGear:
      return "motor's gear";
    case SiteKind::kMass:
      return "mass";
    case SiteKind::kCom:
      return "centre of mass";
    case SiteKind::kInertia:
      return "inertia";
    case SiteKind::kGravity:
      return "gravity";
  }
  return "";
}

std::string DescribeFault(const FileFault& fault) {
  std::string what = NameSite(fault.of);
  if (fault.whole) what = IsOfBody(fault.of) ? "inertial" : "origin";
  return fmt::format("{}{} {}", fault.in_second ? "in the second file, " : "", what, DescribeKind(fault));
}

std::span<const UnitFault> ListUnits(SiteKind kind) {
  switch (kind) {
    case SiteKind::kPosition:
    case SiteKind::kCom:
      return kLengths;
    case SiteKind::kMass:
      return kMasses;
    case SiteKind::kInertia:
      return kInertias;
    case SiteKind::kRange:
      return kRanges;
    case SiteKind::kDamping:
    case SiteKind::kFriction:
    case SiteKind::kStiffness:
    case SiteKind::kEffort:
    case SiteKind::kVelocity:
      return kDampings;
    case SiteKind::kArmature:
      return kArmatures;
    case SiteKind::kGear:
      return kGears;
    default:
      return {};
  }
}

double CountBits(double value, double half) {
  constexpr double kZero = 5.0;
  constexpr double kLeast = 8.0;
  constexpr double kMost = 20.0;
  if (value == 0.0) return kZero;
  if (!(half > 0.0)) return kMost;
  return std::clamp(std::log2(std::abs(value) / half) + 1.0, kLeast, kMost);
}

}  // namespace dexcheck
