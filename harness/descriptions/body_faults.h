#pragma once

// Faults of one body that people make, each with what undoes it.

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/descriptions/hypotheses.h"

namespace dexcheck {

/// Relative differences of mass, centre of mass and inertia.
struct BodyDifference {
  double mass, com, inertia;
  [[nodiscard]] double largest() const { return std::max({mass, com, inertia}); }
  [[nodiscard]] double squares() const { return mass * mass + com * com + inertia * inertia; }
};

/// Places are compared relative to `length`, m.
BodyDifference CompareBodies(const MassProperties& a, const MassProperties& b, double length);

/// I about the origin of a body whose centre of mass is c, without that about c: m (c^2 1 - c c^T).
Matrix3d CalcOffset(const MassProperties& body);

/// The body with the fault undone, as far as it can have been made there.
using UndoBodyFault = std::function<std::optional<MassProperties>(const ComparedBody&)>;

/// A fault of one body: "inertia looks as if given about the link's origin".
struct BodyFault {
  std::string noun;    ///< "inertia", "mass", "centre of mass"
  std::string plural;  ///< "inertias"
  std::string text;    ///< "as if given about the link's origin"
  UndoBodyFault undo;
};

/// Those that are known, of inertias, of centres of mass, of masses.
std::vector<BodyFault> ListBodyFaults();

/// Which fault of one part explains why a body of several welded parts differs, in words: 'the inertia of
/// its part "hand" looks as if given about the link's origin ...'. Nothing when none does.
std::optional<std::string> DescribePartFault(const ComparedBody& body, double length, double tolerance);

/// The body when the fault was made in each of its parts; nothing when it is not several parts, or when it
/// shows in fewer of them.
std::optional<MassProperties> UndoInAllParts(const BodyFault& fault, const ComparedBody& body,
                                             int fewest_parts);

}  // namespace dexcheck
