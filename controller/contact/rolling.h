#pragma once

// Rolling contact (section 4.3 (c)): the rates of the contact coordinates, their integration, change of
// charts.

#include "controller/common/types.h"
#include "controller/contact/contact_geometry.h"
#include "controller/contact/surface.h"

namespace dexcheck {

/// Rates kappa_dot (5x1, order of (39)) from the relative twist V = V_co_cf^cf (6x1, in Sigma_cf, m/s,
/// rad/s): (40) with the spin omega_z and the slip v_x, v_y that print leaves out; v_z does not enter. Throws
/// SingularityError when K_f + R_psi K_o R_psi is not positive definite: the surfaces then do not touch at an
/// isolated point (two planes, or a fingertip flatter than the hollow it is in).
Vector5d CalcKappaDot(const ContactGeometry& contact, const Vector6d& V);

/// The same contact in well-conditioned charts: both alphas normalized (Surface::Normalize), psi turned with
/// the Gauss frames when a chart changes, and in [-pi, pi].
ContactCoordinates NormalizeContact(const Surface& fingertip, const Surface& object,
                                    const ContactCoordinates& kappa);

/// The same contact in given charts, psi turned with the Gauss frames. Throws std::invalid_argument for an
/// unknown chart.
ContactCoordinates ChangeCharts(const Surface& fingertip, const Surface& object,
                                const ContactCoordinates& kappa, int fingertip_chart, int object_chart);

/// kappa displaced by `change` (5x1, order of (39)) within its charts.
ContactCoordinates Displace(const ContactCoordinates& kappa, const Vector5d& change);

/// Integrates (40) over one step dt (s) from time t with the classical fourth-order Runge-Kutta method.
/// `twist(t, contact)` returns V_co_cf^cf (6x1) at time t for the ContactGeometry given. The result is
/// normalized. Throws what CalcKappaDot and CalcContactGeometry throw. FindContact removes the drift.
template <typename TwistFunction>
ContactCoordinates IntegrateKappa(const Surface& fingertip, const Surface& object,
                                  const ContactCoordinates& kappa, double t, double dt,
                                  const TwistFunction& twist) {
  const auto rate = [&](double time, const ContactCoordinates& at) -> Vector5d {
    const ContactGeometry contact = CalcContactGeometry(fingertip, object, at);
    return CalcKappaDot(contact, twist(time, contact));
  };
  const Vector5d k1 = rate(t, kappa);
  const Vector5d k2 = rate(t + dt / 2.0, Displace(kappa, dt / 2.0 * k1));
  const Vector5d k3 = rate(t + dt / 2.0, Displace(kappa, dt / 2.0 * k2));
  const Vector5d k4 = rate(t + dt, Displace(kappa, dt * k3));
  const Vector5d change = dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  return NormalizeContact(fingertip, object, Displace(kappa, change));
}

}  // namespace dexcheck
