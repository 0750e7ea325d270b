#pragma once

// A cause in words: its size, its direction in the file's frames, and each joint's whole numbers.

#include <string>
#include <vector>

#include "harness/diagnosis/causes.h"
#include "harness/recordings/torque_estimator.h"

namespace dexcheck {

/// A cause with its size.
struct FoundFault {
  TorqueFault fault;
  VectorXd amplitude, error;
  bool is_named = true;   ///< No other cause explains the same.
  bool is_guess = false;  ///< It, and all that explains the same, is nonlinear and to be searched for.
  std::vector<Fault> parts = {};  ///< Whole numbers of each joint, where it has one for each.

  /// Whether the size is one that can be, and no zero within its error.
  [[nodiscard]] bool HasSize() const;
};

/// Says by what a joint is displaced or turned. @param by in its parent's frame, m or rad.
std::string DescribeGeometry(const RobotModel& model, const LinkFrames& frames, int joint, bool is_turn,
                             const Vector3d& by);

class CauseDescription {
 public:
  /// @param names of the recordings. All must outlive this.
  CauseDescription(const RecordingSet& set, const TorqueEstimator& estimator, const LinkFrames& frames,
                   const std::vector<std::string>& names)
      : model_(set.model()), set_(set), estimator_(estimator), frames_(frames), names_(names) {}

  /// @param error empty where it is not known.
  [[nodiscard]] Fault Describe(const TorqueFault& fault, const VectorXd& amplitude, VectorXd error) const;
  /// Says each joint's whole number: "all joints" only of those that have no more of their own.
  /// @return whether the number has several parts.
  bool AddWholeNumbers(FoundFault* found, Fault* shown) const;
  /// Velocity of a shape of friction, rad/s or m/s.
  [[nodiscard]] double ShapeVelocityOf(const TorqueFault& fault, const VectorXd& amplitude) const;
  /// Torque of a saturation, N m or N.
  [[nodiscard]] double LimitOf(const TorqueFault& fault, const VectorXd& amplitude) const;

 private:
  /// A joint's number as all that was found makes it: what is in all joints, and its own beside that.
  struct JointNumber {
    double change = 0.0, variance = 0.0;
    int terms = 0;
  };
  [[nodiscard]] JointNumber CalcNumber(int joint, TorqueColumn::Kind kind) const;
  [[nodiscard]] std::string InFrameOf(int link) const {
    return " in " + frames_.NameOf(model_.link_name(link));
  }

  const RobotModel& model_;
  const RecordingSet& set_;
  const TorqueEstimator& estimator_;
  const LinkFrames& frames_;
  const std::vector<std::string>& names_;
};

}  // namespace dexcheck
