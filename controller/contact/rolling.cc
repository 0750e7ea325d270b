#include "controller/contact/rolling.h"

#include <Eigen/LU>
#include <cmath>
#include <string>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

// Ratio of the principal relative curvatures below which the contact counts as a line.
constexpr double kMinCurvatureRatio = 1e-9;

// Principal values of a symmetric 2x2 matrix: mean -+ radius.
void RequirePointContact(const Matrix2d& K_relative) {
  const double mean = 0.5 * K_relative.trace();
  const double radius = std::hypot(0.5 * (K_relative(0, 0) - K_relative(1, 1)), K_relative(0, 1));
  const double smallest = mean - radius;
  if (smallest > kMinCurvatureRatio * (mean + radius)) return;
  throw SingularityError(
      "surfaces do not touch at an isolated point, smallest relative curvature K_f + R_psi K_o R_psi "
      "[1/m]: " +
          std::to_string(smallest),
      smallest);
}

// Angle about the normal from the Gauss frame at `from` to that at `to`, two coordinates of one point.
double CalcFrameAngle(const Surface& surface, const SurfacePoint& from, const SurfacePoint& to) {
  if (from.chart == to.chart) return 0.0;
  const Matrix3d R_from = surface.Evaluate(from).R;
  const Vector3d x_to = surface.Evaluate(to).R.col(0);
  return std::atan2(R_from.col(1).dot(x_to), R_from.col(0).dot(x_to));
}

// The contact with its points written as alpha_f and alpha_o. Like T_f and T_o in psidot: each frame's turn
// about its own outward normal adds to psi.
ContactCoordinates Rewrite(const Surface& fingertip, const Surface& object, const ContactCoordinates& kappa,
                           const SurfacePoint& alpha_f, const SurfacePoint& alpha_o) {
  const double turn =
      CalcFrameAngle(fingertip, kappa.alpha_f, alpha_f) + CalcFrameAngle(object, kappa.alpha_o, alpha_o);
  return {alpha_f, alpha_o, std::remainder(kappa.psi + turn, 2.0 * kPi)};
}

}  // namespace

Vector5d CalcKappaDot(const ContactGeometry& contact, const Vector6d& V) {
  const SurfaceGeometry& f = contact.fingertip;
  const SurfaceGeometry& o = contact.object;
  const Vector2d slip = V.head<2>();
  const Vector2d turn(-V(4), V(3));

  // Kt_o = R_psi K_o R_psi
  const Matrix2d K_o_tilde = contact.R_psi * o.K * contact.R_psi;
  const Matrix2d K_relative = f.K + K_o_tilde;
  RequirePointContact(K_relative);
  const Matrix2d K_inverse = K_relative.inverse();

  // M_f alphadot_f = (K_f + Kt_o)^-1 ([-w_y; w_x] - Kt_o [v_x; v_y])
  // M_o alphadot_o = R_psi (K_f + Kt_o)^-1 ([-w_y; w_x] + K_f [v_x; v_y])
  const Vector2d s_f = K_inverse * (turn - K_o_tilde * slip);
  const Vector2d s_o = contact.R_psi * (K_inverse * (turn + f.K * slip));

  // psidot = w_z + T_f M_f alphadot_f + T_o M_o alphadot_o
  Vector5d kappa_dot;
  kappa_dot << f.M.inverse() * s_f, o.M.inverse() * s_o, V(5) + f.T.dot(s_f) + o.T.dot(s_o);
  return kappa_dot;
}

ContactCoordinates NormalizeContact(const Surface& fingertip, const Surface& object,
                                    const ContactCoordinates& kappa) {
  return Rewrite(fingertip, object, kappa, fingertip.Normalize(kappa.alpha_f),
                 object.Normalize(kappa.alpha_o));
}

ContactCoordinates ChangeCharts(const Surface& fingertip, const Surface& object,
                                const ContactCoordinates& kappa, int fingertip_chart, int object_chart) {
  return Rewrite(fingertip, object, kappa, fingertip.ToChart(kappa.alpha_f, fingertip_chart),
                 object.ToChart(kappa.alpha_o, object_chart));
}

ContactCoordinates Displace(const ContactCoordinates& kappa, const Vector5d& change) {
  ContactCoordinates displaced = kappa;
  displaced.alpha_f.u += change(0);
  displaced.alpha_f.v += change(1);
  displaced.alpha_o.u += change(2);
  displaced.alpha_o.v += change(3);
  displaced.psi += change(4);
  return displaced;
}

}  // namespace dexcheck
