#pragma once

// How the list of a law's faults is made: what all laws have, what those of joints have, and those of the
// object.

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "harness/diagnosis/law_entries.h"

namespace dexcheck {

/// The joint or wheel of an entry of tau'.
std::string NameEntry(const RobotModel& model, Eigen::Index entry);

/// Builds the list for one law.
class LawEntryList {
 public:
  LawEntryList(const Setup& setup, JudgedLaw* law)
      : model_(setup.model()),
        law_(*law),
        n_(model_.num_velocities()),
        is_of_joints_(setup.joints() != nullptr),
        start_(setup.start().q) {}

  [[nodiscard]] std::vector<LawEntry> Make();

 private:
  using Index = Eigen::Index;
  using Edit = std::function<void(const LawAtStep&, LawInputs*)>;

  LawEntry& Add(const std::string& fault, std::function<MatrixXd(const LawAtStep&)> force);
  /// A fault that is there or not.
  LawEntry& AddEdit(const std::string& fault, const Edit& edit);
  /// A factor of what an edit takes out.
  void AddFactor(const std::string& fault, const Edit& remove);
  void AddFactors();
  /// Signals of some steps before.
  void AddOldSignals();
  /// Pairs that may be taken for each other: all of a small robot, and neighbours of a large one.
  [[nodiscard]] std::vector<std::pair<Index, Index>> ListPairs() const;
  void AddExchanges();
  /// @param both names of two joints.
  void AddSignalExchanges(const std::string& both, Index i, Index j);
  void AddMatrices();
  void AddJointFaults();
  /// Terms of the model at another state than the measured one.
  void AddOtherStates();
  void AddFriction();
  void AddFilters();
  /// The sum may have the error of this step, or not; what it was before the first step that was looked at is
  /// not known.
  void AddIntegrals();
  /// Torques that a controller may add at single joints.
  void AddJointTorques();
  /// Numbers of the model that the law goes by.
  void AddModelFaults();
  using Columns = std::function<MatrixXd(const LawAtStep&)>;
  /// @param columns of the link's BodyVector.
  void AddInertialFaults(const std::string& place, int link, const Columns& columns);
  void AddGravityVector();
  void AddArmatureFaults();
  /// Joints that the law's model has in another order.
  void AddJointOrder();
  void AddObjectFaults();

  const RobotModel& model_;
  JudgedLaw& law_;
  Index n_;
  bool is_of_joints_;
  VectorXd start_;
  std::vector<LawEntry> entries_;
};

}  // namespace dexcheck
