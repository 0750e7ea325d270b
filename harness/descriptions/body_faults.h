#pragma once

// Faults of one body that people make, each with what undoes it.

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>
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

/// The body with the fault undone, as far as it can have been made there.
using UndoBodyFault = std::function<std::optional<MassProperties>(const ComparedBody&)>;

/// A fault of one body: "inertia looks as if given about the link's origin".
struct BodyFault {
  std::string noun;    ///< "inertia", "mass", "centre of mass"
  std::string plural;  ///< "inertias"
  std::string text;    ///< "as if given about the link's origin"
  UndoBodyFault undo;
};

/// Lengths in another unit: right is the factor times what is given.
inline constexpr std::pair<double, const char*> kLengthUnits[] = {
    {1e-3, "as if in mm"}, {1e-2, "as if in cm"}, {0.0254, "as if in inches"}, {1e3, "divided by 1000"}};

/// Axes in another order: axis i of what is given is axis [i] of what is right. First those of two axes.
inline constexpr std::pair<std::array<int, 3>, const char*> kAxisOrders[] = {
    {{1, 0, 2}, "x and y exchanged"},
    {{2, 1, 0}, "x and z exchanged"},
    {{0, 2, 1}, "y and z exchanged"},
    {{1, 2, 0}, "in the order y, z, x"},
    {{2, 0, 1}, "in the order z, x, y"}};
inline constexpr size_t kAxisExchanges = 3;

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
