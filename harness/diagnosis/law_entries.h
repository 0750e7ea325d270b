#pragma once

// Faults of a law, each with the force that it leaves at a step: the right law is computed once more from
// changed inputs.

#include <functional>
#include <string>
#include <vector>

#include "controller/control/actuation.h"
#include "harness/checks/judged_law.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// Entries of tau' that belong together.
struct LawPlace {
  std::string name;  ///< "law" for all, "law of panda_joint4", "law of the finger of rf1_tip".
  std::vector<Eigen::Index> entries;
  bool is_balanced = false;  ///< Whether the ground is asked to balance what the base has of it.
};
/// All torques, those of each finger, and each torque.
std::vector<LawPlace> ListLawPlaces(const Setup& setup);
/// The part of a force (n) that the torques of a place have.
VectorXd KeepAt(const ActuationMap& actuation, const LawPlace& place, const VectorXd& force);

/// A fault that a law may have.
struct LawEntry {
  std::string fault;
  std::string place = "law";
  std::string unit = {};
  double nominal = 0.0;      ///< Value of the right law.
  unsigned parts = 0;        ///< Summands of LawPartName that a factor is of.
  bool at_places = false;    ///< Some torques alone may have it.
  bool is_whole = false;     ///< It is there as a whole: its amplitude is 1.
  bool is_positive = false;  ///< Its value is not negative.
  bool is_variant = false;   ///< Another age, or another pair of joints, of an entry before it.
  /// E_bar' (tau' - tau'_printed) at a step of amplitude 1 (n x p).
  std::function<MatrixXd(const LawSnapshot&)> force;
};

/// A fault with one number, which the force is not linear in.
struct FittedLawEntry {
  std::string fault, unit;
  double least, most;  ///< Of the number.
  bool is_whole;
  std::function<VectorXd(const LawSnapshot&, double)> force;
};

/// Faults that are linear in their size. @param law of the run; outlives the entries.
std::vector<LawEntry> ListLawEntries(const Setup& setup, JudgedLaw* law);
/// Faults that are not.
std::vector<FittedLawEntry> ListFittedLawEntries(const Setup& setup, JudgedLaw* law);
/// Faults that the sent torques themselves show: limits and rounding. @param places names of the entries of
/// tau'.
std::vector<LawEntry> ListTorqueEntries(const RobotModel& model, const std::vector<std::string>& places,
                                        const std::vector<const LawSnapshot*>& steps);

}  // namespace dexcheck
