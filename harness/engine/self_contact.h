#pragma once

// Whether a robot's bodies overlap in a posture.

#include <string>
#include <vector>

#include "controller/common/types.h"
#include "harness/engine/engine.h"

namespace dexcheck {

/// By the collision shapes of an MJCF, and those of what stands around the robot.
class SelfContact {
 public:
  /// @param joints names of joints with one position, in the order of postures. Pairs of bodies that overlap
  /// at `usual` always do, as neighbours may, and are left out.
  /// @throws InputError when the MJCF has none of such a name. @param source of messages.
  SelfContact(MjModelPtr model, const std::string& source, const std::vector<std::string>& joints,
              const VectorXd& usual);

  /// Sum of the depths of all contacts, m; 0 where none is. @param q rad or m.
  double CalcDepth(const VectorXd& q);

 private:
  void Place(const VectorXd& q);
  [[nodiscard]] std::pair<int, int> BodiesOf(const mjContact& contact) const;

  MjModelPtr model_;
  MjDataPtr data_;
  std::vector<int> addresses_;  // of positions
  std::vector<std::pair<int, int>> usual_;
};

}  // namespace dexcheck
