#pragma once

// Faults that are made in what is written of a robot. They share no code with what finds them.

#include <optional>
#include <string>
#include <vector>

#include "harness/corrections/correction.h"
#include "tests/harness/corrections/drawn_robot.h"

namespace dexcheck::testing {

/// A fault that was made, and what names it.
struct MadeFault {
  std::string name;
  SiteKind of = SiteKind::kMass;
  std::vector<CorrectionKind> kinds;  ///< That say the same.
  std::vector<std::string> places;    ///< "joint q1", "link l1": all of them, or of an exchange one.
  std::vector<std::string> hardly;    ///< Places with little change, which may be listed or not.
  bool any_place = false;
};

/// Kinds of faults by name.
std::vector<std::string> ListFaultNames();
/// Makes a fault of a kind somewhere. @param form of the file that will have it. @return none where it does
/// not show.
std::optional<MadeFault> MakeFault(const std::string& name, const WrittenForm& form, std::mt19937* random,
                                   DrawnRobot* robot);

}  // namespace dexcheck::testing
