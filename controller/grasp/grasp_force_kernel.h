#pragma once

// The interior-point method behind GraspForceSolver, for problems of one size. Internal to controller/grasp.

#include <memory>

#include "controller/grasp/grasp_force.h"

namespace dexcheck::grasp_internal {

/// A solver for problems of one size.
class GraspForceKernel {
 public:
  virtual ~GraspForceKernel() = default;
  /// Solves a valid problem of the right size into `result`, whose vectors have the right size.
  virtual void Solve(const GraspForceProblem& problem, const GraspForceOptions& options,
                     GraspForceResult& result) = 0;
  /// Forgets the last solution.
  virtual void Reset() = 0;
};

/// The kernel for `num_contacts` contacts and `num_limits` limited functions of their forces.
std::unique_ptr<GraspForceKernel> MakeGraspForceKernel(int num_contacts, int num_limits);

}  // namespace dexcheck::grasp_internal
