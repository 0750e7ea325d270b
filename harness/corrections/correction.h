#pragma once

// Faults of a file as values: their kind, quantity and place, and the value that would be right.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "harness/corrections/printed_robot.h"

namespace dexcheck {

/// A printed quantity of a joint or a link.
enum class SiteKind {
  // Quantities of the joint that moves a link.
  kCarrier,   ///< The link that carries it.
  kPresence,  ///< The joint and its link are in one file only.
  kName,
  kLinkName,
  kType,
  kPosition,
  kRotation,
  kAxis,
  kAxisPoint,
  kRange,
  kMimic,
  kDamping,  ///< From here on in the order of JointScalar.
  kFriction,
  kArmature,
  kEffort,
  kVelocity,
  kStiffness,
  kSpringAngle,
  kGear,
  // Quantities of the link.
  kMass,
  kCom,
  kInertia,
  // Quantities of the robot.
  kGravity,
  kConstraint,  ///< A constraint or spring between links.
  kMotor,       ///< The joints that motors drive, and gains of servos.
};
inline constexpr SiteKind kBodyKinds[] = {SiteKind::kMass, SiteKind::kCom, SiteKind::kInertia};
inline constexpr SiteKind kNodeKinds[] = {SiteKind::kPosition, SiteKind::kRotation, SiteKind::kMass,
                                          SiteKind::kCom, SiteKind::kInertia};
inline bool IsOfBody(SiteKind kind) { return kind >= SiteKind::kMass && kind <= SiteKind::kInertia; }
inline bool IsName(SiteKind kind) { return kind == SiteKind::kName || kind == SiteKind::kLinkName; }
inline bool IsOfPose(SiteKind kind) { return kind == SiteKind::kPosition || kind == SiteKind::kRotation; }
inline SiteKind ToSite(JointScalar scalar) {
  return static_cast<SiteKind>(static_cast<int>(SiteKind::kDamping) + static_cast<int>(scalar));
}

/// Kinds of sites, a bit each.
using SiteMask = unsigned;
constexpr SiteMask MaskOf(SiteKind kind) { return 1U << static_cast<unsigned>(kind); }
inline constexpr SiteMask kBodyMask =
    MaskOf(SiteKind::kMass) | MaskOf(SiteKind::kCom) | MaskOf(SiteKind::kInertia);
inline constexpr SiteMask kPoseMask = MaskOf(SiteKind::kPosition) | MaskOf(SiteKind::kRotation);

struct Site {
  SiteKind kind;
  int link;  ///< Of the first file; -1 - j for link j that the second file alone has.
  bool operator==(const Site&) const = default;
};

enum class CorrectionKind {
  kNumber,   ///< Other numbers.
  kMissing,  ///< It is not stated.
  kSurplus,  ///< It is stated here only.
  // Faults of a vector.
  kSign,
  kSignOf,       ///< Component: the axis, or the number of a row (alpha, a, q, d).
  kPermutation,  ///< Component: of kPermutations.
  kUnit,         ///< Component: of ListUnits.
  // Faults of a rotation.
  kDegrees,
  kRadians,
  kAngleSign,     ///< Component: the angle.
  kAngleDegrees,  ///< Component: the angle.
  kAnglesReversed,
  kAnglesPermuted,  ///< Component: of kPermutations.
  kEulerSequence,   ///< Component: of kSequences.
  kMovingAxes,
  kFixedAxes,
  kTransposed,
  kScalarFirst,
  kScalarLast,
  kMirror,      ///< Component: the axis.
  kTurnOwn,     ///< Component: 3 axis + quarter turns - 1.
  kTurnParent,  ///< Component: 3 axis + quarter turns - 1.
  kZero,        ///< The joint's zero is elsewhere.
  // Places and centres of mass in another frame.
  kAlongLink,
  kAlongParent,
  kInParent,
  kToParent,
  kAlongToParent,
  kPlaceAdded,
  kPlaceTaken,
  kInChild,
  kInertialAxes,
  kToInertialAxes,
  kInverse,  ///< The parent's pose in the link.
  // Faults of an inertia.
  kAboutOrigin,
  kMovedTwice,
  kAboutOriginAxes,
  kAboutParent,
  kProductSigns,
  kProductSign,  ///< Component: xy, xz, yz.
  kMoments,      ///< Component: of kPermutations.
  kSixOrder,     ///< Component: of kSixOrders.
  kSixOrderInverse,
  kNoProducts,
  kNoAxes,  ///< Component 1: the six numbers were along other axes, no principal ones.
  kLinkAxes,
  kFrame,  ///< The rotation of its frame: `rotation` says how.
  kWithMass,
  // Faults of whole inertials and joints.
  kExchanged,
  kOfOther,
  kPartMissing,
  kOtherAxis,
  kShapes,    ///< Both files leave it to the engine, which computes it from the shapes.
  kCompiled,  ///< A setting of an MJCF's compiler changed what the text states.
  // All rows of a table, or all bodies of a list.
  kClassicRows,  ///< Component: 1: they are modified ones.
  kShiftedRows,  ///< Component: 0: alpha and a of the row before, 1: of the row behind.
  kShiftedBodies,
};

/// One fault of a file.
struct FileFault {
  CorrectionKind kind = CorrectionKind::kNumber;
  SiteKind of = SiteKind::kPosition;
  int component = 0;
  CorrectionKind rotation = CorrectionKind::kNumber;  ///< Of kFrame.
  int other = -1;                                     ///< The link it is exchanged with, or whose it has.
  bool in_second = false;                             ///< The second file has it.
  bool whole = false;  ///< Of a body: its centre and inertia, of a place: position and rotation.
};
/// Whether two are the same at different places.
bool IsSameFault(const FileFault& a, const FileFault& b);

/// Gives a link what is right.
using LinkUndo = std::function<void(PrintedLink*)>;

/// A link with the fault undone.
struct LinkPatch {
  int link;
  PrintedLink right;
};

/// A fault at some links, beside another one of the same body or of the same places.
struct FaultBeside {
  FileFault fault;
  std::vector<int> links;
  double bits;
};

/// One way to put sites right.
struct CorrectionCandidate {
  FileFault fault;
  int link = -1;
  std::vector<Site> sites;
  double bits = 0.0;  ///< Beyond those of which convention and where.
  std::vector<LinkPatch> patches;
  std::string values;                   ///< "mass 1.9 kg here, 1.998 kg in the other file"
  std::optional<FaultBeside> beside{};  ///< The sites are right only if this is undone too.
  double rest =
      1.0;  ///< How far sites are from right then, relative to the digits' tolerances; 1: they are right.
};

/// Returns whether a fault pays for its digits, and not for a convention.
inline bool IsNumber(const FileFault& fault) {
  return fault.kind == CorrectionKind::kNumber || fault.kind == CorrectionKind::kZero ||
         (fault.kind == CorrectionKind::kFrame && fault.rotation == CorrectionKind::kNumber);
}

/// Words for a fault, to be read behind "joint q1: " or "link l1: ".
std::string DescribeFault(const FileFault& fault);
/// A stable name: "inertia.about_origin", "com.mm", "number.mass", "exchange.body".
std::string NameFault(const FileFault& fault);
const char* NameSite(SiteKind kind);
/// Returns the unit of a joint's quantity as " N m"; empty where it has none.
const char* FindUnit(SiteKind kind, bool slides);
/// Names the place of a quantity of a link: "link l1", "joint q1", or "frame tip".
std::string NamePlace(const PrintedLink& link, SiteKind kind);

inline constexpr const char* kAxisNames[] = {"x", "y", "z"};
inline constexpr const char* kAngleNames[] = {"roll", "pitch", "yaw"};
inline constexpr int kPermutations[5][3] = {{1, 0, 2}, {2, 1, 0}, {0, 2, 1}, {1, 2, 0}, {2, 0, 1}};
inline constexpr int kSixOrders[5][6] = {
    {0, 3, 5, 1, 2, 4}, {0, 2, 5, 1, 3, 4}, {0, 1, 2, 5, 4, 3}, {0, 1, 2, 3, 5, 4}, {0, 1, 2, 4, 3, 5}};
inline constexpr const char* kSequences[] = {"xyz", "XYZ", "zyx", "ZYX", "xzy", "yxz", "yzx", "zxy"};

/// A factor that corrects a number which was taken in another unit.
struct UnitFault {
  double factor;
  const char* id;
  const char* words;
};
std::span<const UnitFault> ListUnits(SiteKind kind);

/// Bits of a number of this size that is known to half a unit.
double CountBits(double value, double half);

}  // namespace dexcheck
