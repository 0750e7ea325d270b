#pragma once

// Faults of a law, each with the force that it leaves at a step: the law is computed once more from changed
// inputs.

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "controller/model/platform.h"
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

/// E_bar' tau' (n) of a law, right or wrong, from its inputs; empty where these have none.
using LawForce = std::function<VectorXd(const LawInputs&)>;

/// A law at a step, which other faults may have changed already.
class LawAtStep {
 public:
  /// @param step, inputs, law outlive this.
  LawAtStep(const LawSnapshot& step, const LawInputs& inputs, const LawForce& law)
      : LawAtStep(step, inputs, law, law(inputs)) {}
  LawAtStep(const LawSnapshot& step, const LawInputs& inputs, const LawForce& law, VectorXd force)
      : step(step), inputs(inputs), law(law), force(std::move(force)) {}

  /// The difference that other inputs make to the force.
  [[nodiscard]] VectorXd CalcChange(const LawInputs& changed) const;
  /// The acceleration that M_bar' makes a force (n).
  [[nodiscard]] const VectorXd& demand() const;

  const LawSnapshot& step;
  const LawInputs& inputs;
  const LawForce& law;
  VectorXd force;  ///< Of `inputs`.

 private:
  mutable VectorXd demand_;
};

/// A fault that a law may have, of one size or several.
struct LawEntry {
  std::string fault;
  std::string place = "law";
  std::string unit = {};
  double nominal = 0.0;      ///< Value of the right law.
  double plausible = 0.0;    ///< Size that each number may plausibly have; 0 for any.
  unsigned parts = 0;        ///< Summands of LawPartName that a factor is of.
  bool at_places = false;    ///< Some torques alone may have it.
  bool is_whole = false;     ///< It is there as a whole: its size is 1.
  bool is_positive = false;  ///< Its value is not negative.
  bool is_variant = false;   ///< Another age, or another pair of joints, of an entry before it.
  /// E_bar' (tau' - tau'_printed) by its sizes (n x p), where that is linear in them.
  std::function<MatrixXd(const LawAtStep&)> force = {};
  /// Otherwise the same of these sizes (p), and sizes from which they are looked for.
  std::function<VectorXd(const LawAtStep&, const VectorXd& sizes)> change = {};
  std::vector<VectorXd> starts = {};
  bool is_vector = false;  ///< Its sizes are a vector; otherwise the first one alone is shown.
  /// Unit of the last size, where that is part of the name.
  const char* shape_unit = nullptr;
};

/// A fault of a law with its sizes.
struct LawTerm {
  const LawEntry* entry = nullptr;
  const LawPlace* place = nullptr;  ///< Torques that alone have it; null for all.
  VectorXd sizes;

  [[nodiscard]] const std::string& place_name() const {
    return place != nullptr ? place->name : entry->place;
  }
  /// Whether both are one fault at one place.
  [[nodiscard]] bool IsLike(const LawTerm& other) const {
    return entry == other.entry && place == other.place;
  }
  /// Numbers that are not known beforehand.
  [[nodiscard]] Eigen::Index CountNumbers() const { return entry->is_whole ? 0 : sizes.size(); }
  /// Whether the fault can have its sizes.
  [[nodiscard]] bool CanBe() const;
  /// The force that it adds to a law (n).
  [[nodiscard]] VectorXd CalcChange(const ActuationMap& actuation, const LawAtStep& at) const;
};

/// All but those that the torques themselves show. @param law of the run; outlives the entries.
std::vector<LawEntry> ListLawEntries(const Setup& setup, JudgedLaw* law);
/// Faults that the sent torques themselves show: limits and rounding. @param places names of the entries of
/// tau'.
std::vector<LawEntry> ListTorqueEntries(const RobotModel& model, const std::vector<std::string>& places,
                                        const std::vector<const LawSnapshot*>& steps);

}  // namespace dexcheck
