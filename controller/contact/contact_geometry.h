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

}  // namespace dexcheck
