#pragma once

// The measurements of robot, object and contacts at one instant.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "controller/common/types.h"
#include "controller/contact/contact_geometry.h"

namespace dexcheck {

/// Fingertips of a grasp, bit i for the i-th.
using ContactSet = std::uint32_t;

/// All of `count` fingertips.
constexpr ContactSet AllContacts(int count) { return (ContactSet{1} << count) - 1; }
constexpr bool Contains(ContactSet set, size_t fingertip) { return (set >> fingertip & 1U) != 0; }

/// State of robot, object and contacts at one instant, true or measured.
struct MeasuredState {
  VectorXd q;   ///< q' (p').
  VectorXd xi;  ///< n.
  Pose X_Bo = Pose::Identity();
  Vector6d V_Bo = Vector6d::Zero();       ///< Body velocity, Sigma_o.
  std::vector<ContactCoordinates> kappa;  ///< One for each fingertip of the grasp.
  std::vector<double> overlap;            ///< Likewise, m; see CalcContactGeometry.
};

/// The contacts that the hand feels, and the force of the support.
struct Touch {
  ContactSet fingertips = 0;   ///< That touch the object.
  double support_force = 0.0;  ///< Upward, on the object by what it lies on, N; of the step before.
};

/// All measurements of one instant.
struct Reading {
  MeasuredState state;
  Touch touch;
};

}  // namespace dexcheck
