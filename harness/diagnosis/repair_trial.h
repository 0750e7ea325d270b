#pragma once

// A robot file with numbers as they may be, held against the engine.

#include <optional>
#include <string>
#include <vector>

#include "harness/descriptions/constant_checks.h"
#include "harness/diagnosis/diagnose.h"
#include "harness/diagnosis/placement.h"

namespace dexcheck {

/// What a robot file is held against, and how.
struct TrialSetup {
  const mjModel& engine;
  std::string source;  ///< Of the engine's model.
  DiagnosisOptions options;
  FileTerms terms;

  [[nodiscard]] std::optional<RobotModel> TryModel(const RobotSpec& written) const {
    return dexcheck::TryModel(terms.Read(written));
  }
};

class RepairTrial {
 public:
  /// @param written numbers as they stand in the file. @param setup must outlive this.
  /// @throws InputError when they are no robot.
  RepairTrial(RobotSpec written, const TrialSetup& setup);
  RepairTrial(const RepairTrial&) = delete;
  RepairTrial& operator=(const RepairTrial&) = delete;

  [[nodiscard]] const TrialSetup& setup() const { return *setup_; }
  [[nodiscard]] const RobotSpec& written() const { return written_; }
  [[nodiscard]] const RobotModel& model() const { return model_; }
  [[nodiscard]] const EngineEvidence& evidence() const { return evidence_; }
  [[nodiscard]] const Placement& placement() const { return placement_; }
  [[nodiscard]] const ConstantChecks& constants() const { return constants_; }

  /// What the engine has in the place of the file's constants: ranges, wheels, fingertips, the object.
  [[nodiscard]] std::vector<Repair> ReadConstants() const;
  /// What it has in the place of mass, centre of mass and inertia of links (the base's without the wheels),
  /// damping and armature of joints, the wheels' transverse inertia, gravity: of links that stand where the
  /// engine has them. No fit: each value is read by itself, so that any number of them may be wrong at once.
  [[nodiscard]] std::vector<Repair> ReadBodies() const;
  /// Whether what a repair changes agrees with the engine.
  [[nodiscard]] bool IsRepairedBy(const Repair& cause) const;

 private:
  /// The number that a check of constants compares, when it can be read there at once.
  [[nodiscard]] std::optional<Parameter> FindNumber(const ConstantFinding& finding) const;
  /// @param scale what they are compared with; 0: their own size.
  [[nodiscard]] bool Differs(double value, double there, double scale) const;
  /// Adds a value of the engine that differs.
  void Compare(const Parameter& parameter, double value, double scale, Repair* read) const;
  void ReadBody(int link, Repair* read) const;
  [[nodiscard]] MassProperties FindBody(int link) const;
  [[nodiscard]] bool IsLinkRight(int link) const;
  [[nodiscard]] bool IsNumberRight(const Parameter& parameter) const;

  RobotSpec written_;
  const TrialSetup* setup_;
  RobotModel model_;
  Adapter adapter_;
  EngineEvidence evidence_;
  Placement placement_;
  ConstantChecks constants_;
  // What is wrong of it, as far as a repair is asked.
  std::vector<Parameter> wrong_;
  bool axle_right_ = true;  // what the base's numbers are relative to
};

/// Explains misplaced axes, frames and bodies by changes of rows, of the places where chains and frames
/// start, of the sign of an axis, or of two joints' order.
///
/// Always the misplaced link nearest the base is taken: what carries it is right, so what is wrong is its own
/// joint or one that moves nothing else that is compared. Each number there is solved for by itself, and the
/// one after whose repair the fewest things are misplaced is taken; then the walk goes on.
/// @return causes in the order found, each to be repaired after those before it.
std::vector<Repair> WalkGeometry(const RepairTrial& trial);

}  // namespace dexcheck
