#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "controller/control/reading.h"
#include "controller/dynamics/model_terms.h"
#include "harness/plant/imperfections.h"
#include "harness/plant/plant.h"
#include "harness/plant/random_stream.h"

namespace dexcheck {

/// The wrenches of a scenario, as they are at an instant. Nothing allocates after construction.
class Disturbances {
 public:
  /// @throws InputError when a body is neither a link nor the object.
  Disturbances(std::span<const DisturbanceOptions> options, const PartContext& context);

  [[nodiscard]] bool empty() const { return sources_.empty(); }
  /// Returns the wrenches that act from t on, s, in the model's pose of each body. @param state the plant's.
  std::span<const Wrench> Evaluate(double t, const MeasuredState& state);
  /// Returns them at the same points of the plant's bodies, which tilt and sink with its platform.
  std::span<const Wrench> Evaluate(double t, const PlantReading& reading);
  /// Returns the factor by which a disturbance's wrench acts at t, s.
  [[nodiscard]] double CalcSize(size_t disturbance, double t) const;

 private:
  struct Source {
    DisturbanceOptions options;
    int body;
    RandomStream moment, size, noise;
  };
  [[nodiscard]] double CalcShape(const Source& source, double since, std::uint64_t repetition) const;

  std::vector<Source> sources_;
  bool on_robot_ = false;
  ModelTerms robot_;  // kinematics, when a link is among the bodies
  std::vector<Wrench> wrenches_;
};

/// Adds sum_i J_i^T w_i, the wrenches on links as forces on xi (n). @param robot its state set.
void AddRobotForce(std::span<const Wrench> wrenches, const ModelTerms& robot, Eigen::Ref<VectorXd> force);
/// Sum of the wrenches on the object, about its origin and in Sigma_o. @param X_Bo its pose.
Vector6d CalcObjectWrench(std::span<const Wrench> wrenches, const Pose& X_Bo);

}  // namespace dexcheck
