#pragma once

// One contact between a fingertip f and an object o: contact coordinates, contact frames, relative twist.
//
// Sigma_cf is the Gauss frame of the fingertip at the contact point: z = outward normal of the fingertip =
// into the object. Sigma_co is the object's. Both have their origin at the contact point, and (39)'s psi
// places them:
//   R_co_cf = [R_psi 0; 0 -1],  R_psi = [cos psi  -sin psi; -sin psi  -cos psi],
// that is, c_u of the object turned by psi about the outward normal of the FINGERTIP gives c_u of the
// fingertip.

#include "controller/common/types.h"
#include "controller/contact/surface.h"

namespace dexcheck {

using Vector5d = Eigen::Matrix<double, 5, 1>;

/// Contact coordinates kappa = [u_f v_f u_o v_o psi] (39) with the chart of each surface; angles in rad.
struct ContactCoordinates {
  SurfacePoint alpha_f;  ///< on the fingertip
  SurfacePoint alpha_o;  ///< on the object
  double psi = 0.0;      ///< angle of contact, rad

  /// The five coordinates in the order of (39), without the charts.
  [[nodiscard]] Vector5d CalcVector() const;
};

/// Everything about one contact that depends on kappa alone; calculate once per step and contact.
struct ContactGeometry {
  SurfaceGeometry fingertip;  ///< M_f, K_f, T_f and Gauss frame, fingertip frame
  SurfaceGeometry object;     ///< M_o, K_o, T_o and Gauss frame, object frame
  Matrix2d R_psi;             ///< see above; symmetric and its own inverse
  Pose g_f_cf;                ///< pose of Sigma_cf in the fingertip frame
  Pose g_o_cf;                ///< pose of Sigma_cf in the object frame (centre of mass), (31)
};

/// Rotation block R_psi (2x2) of (40).
Matrix2d CalcContactRotation(double psi);

/// Contact frames and surface parameters at kappa (31), (35)-(38). Throws what Surface::Evaluate throws, and
/// std::invalid_argument when psi is not finite.
/// @param overlap of the two bodies along the normal, m. Rigid bodies have none; where compliant ones are
/// pressed into each other, the contact is taken midway, between the parallel surfaces that meet there.
ContactGeometry CalcContactGeometry(const Surface& fingertip, const Surface& object,
                                    const ContactCoordinates& kappa, double overlap = 0.0);

/// Twist V_co_cf^cf = [v; omega] (6x1, in Sigma_cf) of the fingertip relative to the object at the contact
/// point (30), from the body twists V_f of the fingertip (fingertip frame) and V_o of the object (object
/// frame) relative to any one common frame. Its first two entries are the slip in m/s, the third is the
/// approach.
Vector6d CalcRelativeTwist(const ContactGeometry& contact, const Vector6d& V_f, const Vector6d& V_o);

/// Body twist (6x1, in the contact frame) of a Gauss frame that moves over its own surface at alpha_dot
/// (2x1).
Vector6d CalcGaussFrameTwist(const SurfaceGeometry& surface, const Vector2d& alpha_dot);

/// Body twist V_f_cf^cf (6x1) of Sigma_cf relative to the fingertip at kappa_dot (5x1).
Vector6d CalcFrameTwistOnFingertip(const ContactGeometry& contact, const Vector5d& kappa_dot);

/// Body twist V_o_cf^cf (6x1) of Sigma_cf relative to the object at kappa_dot (5x1).
Vector6d CalcFrameTwistOnObject(const ContactGeometry& contact, const Vector5d& kappa_dot);

// Hemispherical fingertips, as the paper has them: the chart of a sphere, and the rim where it ends.

/// Length over a fingertip of this radius (m) from its point p (3x1, m, fingertip frame) to the rim of the
/// hemisphere around `pole` (3x1, any length, same frame): rho (pi/2 - angle between p and the pole), m.
/// Negative past the rim.
double CalcRimDistance(double radius, const Vector3d& pole, const Vector3d& p);

// Rolling contact (section 4.3 (c)): the rates of the contact coordinates, their integration, change of
// charts.

/// Rates kappa_dot (5x1, order of (39)) from the relative twist V = V_co_cf^cf (6x1, in Sigma_cf, m/s,
/// rad/s): (40) with the spin omega_z and the slip v_x, v_y that print leaves out; v_z does not enter. Throws
/// SingularityError when K_f + R_psi K_o R_psi is not positive definite: the surfaces then do not touch at an
/// isolated point (two planes, or a fingertip flatter than the hollow it is in).
Vector5d CalcKappaDot(const ContactGeometry& contact, const Vector6d& V);

/// Expresses a contact in well-conditioned charts: both alphas are normalized (Surface::Normalize), psi turns
/// with the Gauss frames when a chart changes and lies in [-pi, pi].
ContactCoordinates NormalizeContact(const Surface& fingertip, const Surface& object,
                                    const ContactCoordinates& kappa);

/// Expresses a contact in the given charts; psi turns with the Gauss frames. Throws std::invalid_argument for
/// an unknown chart.
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

// The contact of two posed bodies: the pair of points where the surfaces are closest (or overlap deepest).

/// Misalignment of the normals (rad), and offset relative to the lengths involved, at which FindContact
/// stops: a few hundred rounding errors.
inline constexpr double kContactConvergence = 1e-13;

/// Contact that FindContact found between two surfaces.
struct FoundContact {
  ContactCoordinates kappa;  ///< normalized
  double gap = 0.0;          ///< m along the common normal; negative where the bodies overlap
};

/// Contact coordinates (39) of two bodies by geometry: the points whose normals oppose each other and whose
/// connection is along them, found by Newton's method from `guess`. X_OF is the pose of the fingertip frame
/// in the object frame. With the integrated kappa as the guess, this projects it back onto the constraint.
/// Throws SingularityError, with the remaining misalignment in rad, when it finds no such pair.
FoundContact FindContact(const Surface& fingertip, const Surface& object, const Pose& X_OF,
                         const ContactCoordinates& guess);

/// Finds the contact without a guess: starts at the object's point closest to the fingertip frame's origin.
FoundContact FindContact(const Surface& fingertip, const Surface& object, const Pose& X_OF);

}  // namespace dexcheck
