#include "harness/corrections/correction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace dexcheck {
namespace {

using Kind = CorrectionKind;

constexpr double kPound = 0.45359237;
constexpr UnitFault kLengths[] = {{1e-3, "mm", "in mm"},
                                  {1e-2, "cm", "in cm"},
                                  {0.0254, "inch", "in inches"},
                                  {1e3, "per_1000", "a thousandth (converted from mm twice)"},
                                  {1e2, "per_100", "a hundredth (converted from cm twice)"}};
constexpr UnitFault kMasses[] = {
    {1e-3, "g", "in g"},        {kPound, "lb", "in pounds"},          {1e3, "per_1000", "a thousandth"},
    {2.0, "halved", "halved"},  {0.5, "doubled", "doubled"},          {0.1, "tenfold", "ten times too large"},
    {10.0, "tenth", "a tenth"}, {-1.0, "sign", "with the other sign"}};
constexpr UnitFault kInertias[] = {{1e-9, "g_mm2", "in g mm^2"},
                                   {1e-7, "g_cm2", "in g cm^2"},
                                   {1e-6, "kg_mm2", "in kg mm^2"},
                                   {1e-4, "kg_cm2", "in kg cm^2"},
                                   {1e-3, "g_m2", "in g m^2"},
                                   {kPound * 0.0254 * 0.0254, "lb_in2", "in lb in^2"},
                                   {kPound, "lb_m2", "in lb m^2"},
                                   {1e9, "per_1e9", "divided by 1e9"},
                                   {1e6, "per_1e6", "divided by 1e6"},
                                   {1e4, "per_1e4", "divided by 1e4"},
                                   {1e3, "per_1000", "divided by 1000"},
                                   {2.0, "halved", "halved"},
                                   {0.5, "doubled", "doubled"},
                                   {0.1, "tenfold", "ten times too large"},
                                   {10.0, "tenth", "a tenth"}};
constexpr UnitFault kRanges[] = {{kPi / 180.0, "degrees", "in degrees"},
                                 {180.0 / kPi, "radians", "converted to radians twice"},
                                 {1e-3, "mm", "in mm"}};
constexpr UnitFault kForces[] = {
    {180.0 / kPi, "per_degree", "per degree"}, {kPi / 180.0, "per_radian", "times pi/180"},
    {1e-3, "per_1e-3", "times 1000"},          {1e3, "per_1000", "a thousandth"},
    {0.1, "tenfold", "ten times too large"},   {10.0, "tenth", "a tenth"}};
constexpr UnitFault kArmatures[] = {{1e-6, "kg_mm2", "in kg mm^2"},
                                    {1e-7, "g_cm2", "in g cm^2"},
                                    {1e-4, "kg_cm2", "in kg cm^2"},
                                    {1e-3, "g_m2", "times 1000"}};
constexpr UnitFault kSignOnly[] = {{-1.0, "sign", "with the other sign"}};
constexpr UnitFault kGravities[] = {{1e-3, "mm", "in mm/s^2"}};

constexpr const char* kProducts[] = {"ixy", "ixz", "iyz"};
constexpr const char* kRowNumbers[] = {"alpha", "a", "q", "d"};
constexpr const char* kPermuted[] = {"with x and y exchanged", "with x and z exchanged",
                                     "with y and z exchanged", "in the order y z x", "in the order z x y"};
constexpr const char* kPermutedIds[] = {"swap_xy", "swap_xz", "swap_yz", "yzx", "zxy"};
constexpr const char* kSixWords[] = {
    "with its six numbers read as xx xy xz yy yz zz", "with its six numbers read as xx xy yy xz yz zz",
    "with its products read as yz xz xy", "with its products read as xy yz xz",
    "with its products read as xz xy yz"};
constexpr const char* kSixIds[] = {"by_rows", "by_columns", "products_yz_xz_xy", "products_xy_yz_xz",
                                   "products_xz_xy_yz"};

/// A quantity: its names in an id and in words, units that it may be taken in, its unit of a joint that turns
/// and of one that slides.
struct SiteWords {
  SiteKind kind;
  const char* id;
  const char* words;
  std::span<const UnitFault> units = {};
  const char* turning = "";
  const char* sliding = "";
};
constexpr SiteWords kSites[] = {
    {SiteKind::kCarrier, "carrier", "carrying link"},
    {SiteKind::kPresence, "joint", "joint"},
    {SiteKind::kName, "joint", "name"},
    {SiteKind::kLinkName, "link", "name"},
    {SiteKind::kType, "type", "type"},
    {SiteKind::kPosition, "origin", "position", kLengths},
    {SiteKind::kRotation, "rotation", "rotation"},
    {SiteKind::kAxis, "axis", "axis"},
    {SiteKind::kAxisPoint, "axis_point", "point of the axis"},
    {SiteKind::kRange, "range", "range", kRanges, " rad", " m"},
    {SiteKind::kMimic, "coupling", "mimic"},
    {SiteKind::kDamping, "damping", "damping", kForces, " N m s/rad", " N s/m"},
    {SiteKind::kFriction, "friction", "friction", kForces, " N m", " N"},
    {SiteKind::kArmature, "armature", "armature", kArmatures, " kg m^2", " kg"},
    {SiteKind::kEffort, "effort", "effort limit", kForces, " N m", " N"},
    {SiteKind::kVelocity, "velocity", "velocity limit", kForces, " rad/s", " m/s"},
    {SiteKind::kStiffness, "stiffness", "stiffness", kForces, " N m/rad", " N/m"},
    {SiteKind::kSpringAngle, "spring_reference", "spring's angle", {}, " rad", " m"},
    {SiteKind::kGear, "gear", "motor's gear", kSignOnly},
    {SiteKind::kMass, "mass", "mass", kMasses},
    {SiteKind::kCom, "com", "centre of mass", kLengths},
    {SiteKind::kInertia, "inertia", "inertia", kInertias},
    {SiteKind::kGravity, "gravity", "gravity", kGravities},
    {SiteKind::kConstraint, "constraint", "constraint"},
    {SiteKind::kMotor, "motor", "motor"}};

const SiteWords& FindSite(SiteKind kind) { return *std::ranges::find(kSites, kind, &SiteWords::kind); }

/// A kind in a name and in words; "{}" stands for its component.
struct KindWords {
  Kind kind;
  const char* id;
  const char* words;
};
constexpr KindWords kWords[] = {
    {Kind::kNumber, "number", "differs"},
    {Kind::kMissing, "missing", "missing"},
    {Kind::kSurplus, "unneeded", "not in the other file"},
    {Kind::kSign, "sign", "with the other sign"},
    {Kind::kSignOf, "sign_{}", "with the sign of {} turned around"},
    {Kind::kPermutation, "{}", "{}"},
    {Kind::kUnit, "{}", "{}"},
    {Kind::kDegrees, "degrees", "with its angles in degrees"},
    {Kind::kRadians, "radians", "with its angles converted to radians twice"},
    {Kind::kAngleSign, "sign_{}", "with the sign of {} turned around"},
    {Kind::kAngleDegrees, "degrees_{}", "with {} in degrees"},
    {Kind::kAnglesReversed, "ypr", "with its angles in the order yaw, pitch, roll"},
    {Kind::kAnglesPermuted, "angles_{}", "with its angles {}"},
    {Kind::kEulerSequence, "sequence_{}", "with its angles taken in another order, not {}"},
    {Kind::kMovingAxes, "meant_other_order",
     "as if its angles were about fixed axes, they are about moving ones"},
    {Kind::kFixedAxes, "other_order", "as if its angles were about moving axes, they are about fixed ones"},
    {Kind::kTransposed, "transposed", "transposed (inverse)"},
    {Kind::kScalarFirst, "xyzw", "with a quaternion x y z w read as w x y z"},
    {Kind::kScalarLast, "wxyz", "with a quaternion w x y z read as x y z w"},
    {Kind::kMirror, "mirror_{}", "mirrored in {}"},
    {Kind::kTurnOwn, "turned_{}", "turned by {} of its own"},
    {Kind::kTurnParent, "parent_turned_{}", "turned by {} of the parent"},
    {Kind::kZero, "offset", "with another zero of the joint"},
    {Kind::kAlongLink, "link_axes", "given along the link's own axes"},
    {Kind::kAlongParent, "parent_axes", "given along the parent's axes"},
    {Kind::kInParent, "parent_frame", "given in the parent's frame"},
    {Kind::kToParent, "not_parent_frame", "given in the link's frame, to be in the parent's"},
    {Kind::kAlongToParent, "not_parent_axes", "given along the link's axes, to be along the parent's"},
    {Kind::kPlaceAdded, "joint_added", "with the place of its joint added"},
    {Kind::kPlaceTaken, "joint_taken", "with the place of its joint taken away"},
    {Kind::kInChild, "child_frame", "given in the frame of a link that it carries"},
    {Kind::kInertialAxes, "inertia_axes", "given along the axes of its inertia"},
    {Kind::kToInertialAxes, "turned_with_inertia", "turned by the rotation of its inertial frame"},
    {Kind::kInverse, "inverse", "inverted (the parent's frame in the link's)"},
    {Kind::kAboutOrigin, "about_origin", "about the link's origin instead of the centre of mass"},
    {Kind::kMovedTwice, "moved_twice", "moved to the centre of mass twice"},
    {Kind::kAboutOriginAxes, "about_origin_axes", "about the link's origin, along its own axes"},
    {Kind::kAboutParent, "carrier_origin", "about the parent's origin"},
    {Kind::kProductSigns, "product_sign", "with the signs of its products turned around"},
    {Kind::kProductSign, "sign_{}", "with the sign of {} turned around"},
    {Kind::kMoments, "moments_{}", "with its moments {}"},
    {Kind::kSixOrder, "{}", "{}"},
    {Kind::kSixOrderInverse, "inverse_{}", "{}"},
    {Kind::kNoProducts, "no_products", "without its products"},
    {Kind::kNoAxes, "no_axes", "without the rotation of its frame"},
    {Kind::kLinkAxes, "frame_unneeded", "with a rotation of its frame that is too much"},
    {Kind::kFrame, "frame_{}", "in a frame whose rotation is {}"},
    {Kind::kWithMass, "not_with_mass", "not scaled with the mass"},
    {Kind::kExchanged, "exchange", "exchanged with that of"},
    {Kind::kOfOther, "other_link", "that of"},
    {Kind::kPartMissing, "lost", "without a part that is welded to it"},
    {Kind::kOtherAxis, "number", "differs"},
    {Kind::kShapes, "shapes", "from shapes of another size, place or density, or with settotalmass"},
    {Kind::kCompiled, "compiled", "as a setting of the compiler made it"},
    {Kind::kClassicRows, "{}", "{}"},
    {Kind::kShiftedRows, "{}", "with alpha and a of the row {}"},
    {Kind::kShiftedBodies, "shifted", "shifted by one in the list of bodies"}};

const KindWords& FindWords(Kind kind) { return *std::ranges::find(kWords, kind, &KindWords::kind); }

/// The component in a name, or in words.
std::string NameComponent(const FileFault& fault, bool is_id) {
  const auto at = static_cast<size_t>(fault.component);
  switch (fault.kind) {
    case Kind::kUnit:
      return is_id ? ListUnits(fault.of)[at].id : ListUnits(fault.of)[at].words;
    case Kind::kPermutation:
    case Kind::kAnglesPermuted:
    case Kind::kMoments:
      return is_id ? kPermutedIds[at] : kPermuted[at];
    case Kind::kSixOrder:
    case Kind::kSixOrderInverse:
      return is_id ? kSixIds[at] : kSixWords[at];
    case Kind::kEulerSequence:
      return kSequences[at];
    case Kind::kAngleSign:
    case Kind::kAngleDegrees:
      return kAngleNames[at];
    case Kind::kProductSign:
      return kProducts[at];
    case Kind::kTurnOwn:
    case Kind::kTurnParent: {
      constexpr const char* kTurns[] = {"-90 degrees", "180 degrees", "90 degrees"};
      constexpr const char* kIds[] = {"quarter_back", "half", "quarter"};
      return is_id ? fmt::format("{}_{}", kIds[at % 3], kAxisNames[at / 3])
                   : fmt::format("{} about {}", kTurns[at % 3], kAxisNames[at / 3]);
    }
    case Kind::kClassicRows:
      if (is_id) return at == 0 ? "classic" : "modified";
      return at == 0 ? "in classic (standard) Denavit-Hartenberg parameters, and read as modified ones"
                     : "in modified Denavit-Hartenberg parameters, and read as classic ones (key convention)";
    case Kind::kShiftedRows:
      return is_id ? (at == 0 ? "shifted_down" : "shifted_up") : at == 0 ? "before" : "behind";
    case Kind::kSignOf:
      if (fault.of == SiteKind::kPosition && fault.whole) return kRowNumbers[at];
      return kAxisNames[at % 3];
    default:
      return kAxisNames[at % 3];
  }
}

std::string DescribeKind(const FileFault& fault) {
  if (fault.kind == Kind::kExchanged && IsName(fault.of)) return "exchanged";
  std::string component;
  if (fault.kind == Kind::kFrame) {
    FileFault rotation = fault;
    rotation.kind = fault.rotation;
    component = DescribeKind(rotation);
  } else {
    component = NameComponent(fault, false);
  }
  return fmt::format(fmt::runtime(FindWords(fault.kind).words), component);
}

std::string NameQuantity(const FileFault& fault) {
  if (fault.whole && fault.kind == Kind::kUnit) return "lengths";
  if (fault.whole) return IsOfBody(fault.of) ? "body" : "place";
  return FindSite(fault.of).id;
}

}  // namespace

bool IsSameFault(const FileFault& a, const FileFault& b) {
  return a.kind == b.kind && a.of == b.of && a.component == b.component && a.rotation == b.rotation &&
         a.in_second == b.in_second && a.whole == b.whole;
}

std::string NamePlace(const PrintedLink& link, SiteKind kind) {
  if (link.is_frame) return "frame " + link.name;
  if (IsOfBody(kind) || kind == SiteKind::kLinkName || link.joint.name.empty()) return "link " + link.name;
  return "joint " + link.joint.name;
}

const char* NameSite(SiteKind kind) { return FindSite(kind).words; }

const char* FindUnit(SiteKind kind, bool slides) {
  return slides ? FindSite(kind).sliding : FindSite(kind).turning;
}

std::string DescribeFault(const FileFault& fault) {
  std::string what = NameSite(fault.of);
  if (fault.kind >= Kind::kClassicRows) {
    what = fault.kind == Kind::kShiftedBodies ? "inertials" : "rows";
  } else if (fault.whole && fault.kind == Kind::kUnit) {
    what = "all lengths";
  } else if (fault.whole) {
    what = IsOfBody(fault.of) ? "inertial" : "origin";
  }
  return fmt::format("{}{} {}", fault.in_second ? "in the second file, " : "", what, DescribeKind(fault));
}

std::string NameFault(const FileFault& fault) {
  const std::string quantity = NameQuantity(fault);
  switch (fault.kind) {
    case Kind::kNumber:
      if (fault.of == SiteKind::kGravity) return "gravity.value";
      return "number." + quantity;
    case Kind::kOtherAxis:
      return fault.of == SiteKind::kGravity ? "gravity.axis" : "number.axis";
    case Kind::kExchanged:
      return "exchange." + quantity;
    case Kind::kZero:
      return "zero.offset";
    case Kind::kPartMissing:
      return "part.lost";
    case Kind::kNoAxes:
      return fault.component == 0 ? "inertia.no_axes" : "inertia.frame_missing";
    case Kind::kShiftedBodies:
      return "list.shifted";
    default:
      break;
  }
  FileFault component = fault;
  if (fault.kind == Kind::kFrame) component.kind = fault.rotation;
  std::string id = FindWords(component.kind).id;
  id = fmt::format(fmt::runtime(id), NameComponent(component, true));
  if (fault.kind == Kind::kFrame) id = "frame_" + id;
  return (fault.kind >= Kind::kClassicRows ? "table" : quantity) + "." + id;
}

std::span<const UnitFault> ListUnits(SiteKind kind) { return FindSite(kind).units; }

double CountBits(double value, double half) {
  constexpr double kZero = 5.0;
  constexpr double kLeast = 8.0;
  constexpr double kMost = 20.0;
  if (value == 0.0) return kZero;
  if (!(half > 0.0)) return kMost;
  return std::clamp(std::log2(std::abs(value) / half) + 1.0, kLeast, kMost);
}

}  // namespace dexcheck
