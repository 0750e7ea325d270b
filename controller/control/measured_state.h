#pragma once

#include <vector>

#include "controller/common/types.h"
#include "controller/contact/contact_geometry.h"

namespace dexcheck {

/// State of robot, object and contacts at one instant, as it is or as somebody is told it.
struct MeasuredState {
  VectorXd q;   ///< q' (p').
  VectorXd xi;  ///< n.
  Pose X_Bo = Pose::Identity();
  Vector6d V_Bo = Vector6d::Zero();       ///< Body velocity, Sigma_o.
  std::vector<ContactCoordinates> kappa;  ///< One for each fingertip of the grasp.
  std::vector<double> overlap;            ///< Likewise, m; see CalcContactGeometry.
};

}  // namespace dexcheck
