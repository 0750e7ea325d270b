#pragma once

// How far contacts that are followed by (40) are from where they are.

#include <algorithm>

#include "controller/contact/contact_geometry.h"

namespace dexcheck {

/// Between one contact as it was followed and as it is.
struct ContactDrift {
  double object = 0.0;     ///< Of the point alpha_o on the object, m.
  double fingertip = 0.0;  ///< Of the point alpha_f on the fingertip, m.
  double psi = 0.0;        ///< Of the angle of contact, rad.

  /// The larger of each.
  void Raise(const ContactDrift& other) {
    object = std::max(object, other.object);
    fingertip = std::max(fingertip, other.fingertip);
    psi = std::max(psi, other.psi);
  }
};

/// Writes a followed contact in the charts of the measured one; leaves it where the two have nothing to do
/// with each other any more.
void FollowCharts(const Surface& tip, const Surface& object, const ContactCoordinates& measured,
                  ContactCoordinates* followed);

/// In the charts of the measured one.
ContactDrift CalcContactDrift(const Surface& tip, const Surface& object, ContactCoordinates followed,
                              const ContactCoordinates& measured);

}  // namespace dexcheck
