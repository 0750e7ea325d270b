#pragma once

// One description alone: what no body can have, what is suspicious, and what it does to the mass matrix.

#include <optional>
#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

enum class AuditLevel {
  kImpossible,  ///< No robot can have it.
  kSuspicious,  ///< A robot can, but a fault is likelier.
  kNote,        ///< Worth knowing.
};

/// "impossible", "suspicious" or "note".
const char* NameOf(AuditLevel level);

/// One finding.
struct AuditFinding {
  AuditLevel level = AuditLevel::kNote;
  std::string check;      ///< Such as "inertia" or "density".
  std::string where;      ///< Such as "link upper_arm" or "joint elbow".
  int line = 0;           ///< Of the file; 0 when it is not known.
  std::string text = {};  ///< What is found, with its values.
  /// Condition number of M with a plausible body there instead, for findings about one moving body.
  std::optional<double> condition_without = {};
  /// The joint that moves the body it is about, -1 for the base.
  int body = kNoBody;

  static constexpr int kNoBody = -2;
};

struct AuditResult {
  std::vector<AuditFinding> findings;
  /// Condition number of M_bar': the median over random states; infinite when it is singular.
  double condition = 0.0;

  /// Whether there is nothing but notes.
  [[nodiscard]] bool IsGood() const;
};

/// Judges a description.
/// @param robot as read with UrdfOptions::keep_impossible; its parts are what the file says.
AuditResult AuditRobot(const RobotDescription& robot);

// The audit's parts, each of which adds findings.
/// Mass, inertia, density and centre of mass of each part.
void AuditBodies(const RobotDescription& robot, std::vector<AuditFinding>* findings);
/// Left against right.
void AuditMirrors(const RobotDescription& robot, std::vector<AuditFinding>* findings);

}  // namespace dexcheck
