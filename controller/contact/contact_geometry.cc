#include "controller/contact/contact_geometry.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "controller/common/errors.h"
#include "controller/object/so3.h"

namespace dexcheck {

namespace {

// R_co_cf = [R_psi 0; 0 -1]
Matrix3d CalcContactRotation3(const Matrix2d& R_psi) {
  Matrix3d R_co_cf = Matrix3d::Zero();
  R_co_cf.topLeftCorner<2, 2>() = R_psi;
  R_co_cf(2, 2) = -1.0;
  return R_co_cf;
}

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

constexpr int kMaxSteps = 50;
// Largest turn of either normal in one Newton step, rad.
constexpr double kMaxTurn = 0.5;

// The fingertip's and the object's surface at the present kappa, all in the object frame.
struct Pair {
  SurfaceGeometry f;
  SurfaceGeometry o;
  Vector3d p_f;
  Matrix3d R_f;
  Vector3d e;     // from the fingertip's point to the object's
  Vector2d e_xy;  // tangential part of e, in the fingertip's Gauss frame
  Vector2d n_xy;  // tangential part of the object's normal, in the same frame
  double gap;
};

Pair EvaluatePair(const Surface& fingertip, const Surface& object, const Pose& X_OF,
                  const SurfacePoint& alpha_f, const SurfacePoint& alpha_o) {
  Pair pair;
  pair.f = fingertip.Evaluate(alpha_f);
  pair.o = object.Evaluate(alpha_o);
  pair.p_f = X_OF * pair.f.p;
  pair.R_f = X_OF.linear() * pair.f.R;
  pair.e = pair.o.p - pair.p_f;
  pair.e_xy = pair.R_f.leftCols<2>().transpose() * pair.e;
  pair.n_xy = pair.R_f.leftCols<2>().transpose() * pair.o.R.col(2);
  pair.gap = pair.R_f.col(2).dot(pair.e);
  return pair;
}

bool HasConverged(const Pair& pair, const Pose& X_OF) {
  const double length = pair.o.p.norm() + pair.f.p.norm() + X_OF.translation().norm();
  return pair.n_xy.norm() <= kContactConvergence && pair.e_xy.norm() <= kContactConvergence * length;
}

// Newton step [s_f; s_o] = [M_f dalpha_f; M_o dalpha_o] (m) for e_xy = 0, n_xy = 0. To first order
//   d e_xy = C s_o - (I + gap K_f) s_f,   d n_xy = C K_o s_o - (n_f . n_o) K_f s_f,
// with C the object's tangent axes in the fingertip's; turning the fingertip's axes only adds second-order
// terms.
Eigen::Vector4d CalcStep(const Pair& pair) {
  const Matrix2d C = pair.R_f.leftCols<2>().transpose() * pair.o.R.leftCols<2>();
  const double n_dot = pair.R_f.col(2).dot(pair.o.R.col(2));
  Eigen::Matrix4d A;
  A << -(Matrix2d::Identity() + pair.gap * pair.f.K), C, -n_dot * pair.f.K, C * pair.o.K;
  Eigen::Vector4d residual;
  residual << pair.e_xy, pair.n_xy;
  const Eigen::Vector4d step = -A.partialPivLu().solve(residual);
  const double turn = std::max((pair.f.K * step.head<2>()).norm(), (pair.o.K * step.tail<2>()).norm());
  return turn > kMaxTurn ? Eigen::Vector4d(step * (kMaxTurn / turn)) : step;
}

SurfacePoint Move(const Surface& surface, const SurfacePoint& alpha, const SurfaceGeometry& geometry,
                  const Vector2d& s) {
  const Vector2d change = geometry.M.triangularView<Eigen::Upper>().solve(s);
  return surface.Normalize({alpha.u + change.x(), alpha.v + change.y(), alpha.chart});
}

// psi from x_cf = cos(psi) x_co - sin(psi) y_co
double CalcPsi(const Pair& pair) {
  const Vector3d x_cf = pair.R_f.col(0);
  return std::atan2(-pair.o.R.col(1).dot(x_cf), pair.o.R.col(0).dot(x_cf));
}

}  // namespace

Vector5d ContactCoordinates::CalcVector() const {
  Vector5d kappa;
  kappa << alpha_f.u, alpha_f.v, alpha_o.u, alpha_o.v, psi;
  return kappa;
}

Matrix2d CalcContactRotation(double psi) {
  const double c = std::cos(psi);
  const double s = std::sin(psi);
  Matrix2d R_psi;
  R_psi << c, -s, -s, -c;
  return R_psi;
}

ContactGeometry CalcContactGeometry(const Surface& fingertip, const Surface& object,
                                    const ContactCoordinates& kappa, double overlap) {
  Require(std::isfinite(kappa.psi), "psi", "must be finite", kappa.psi);
  ContactGeometry contact;
  contact.fingertip = fingertip.Evaluate(kappa.alpha_f);
  contact.object = object.Evaluate(kappa.alpha_o);
  if (overlap != 0.0) {
    contact.fingertip = CalcParallelSurface(contact.fingertip, -0.5 * overlap);
    contact.object = CalcParallelSurface(contact.object, -0.5 * overlap);
  }
  contact.R_psi = CalcContactRotation(kappa.psi);
  contact.g_f_cf = contact.fingertip.CalcPose();
  // g_o_cf = g_o_co g_co_cf, the inverse of (31)
  contact.g_o_cf = contact.object.CalcPose();
  contact.g_o_cf.linear() = contact.object.R * CalcContactRotation3(contact.R_psi);
  return contact;
}

Vector6d CalcRelativeTwist(const ContactGeometry& contact, const Vector6d& V_f, const Vector6d& V_o) {
  // V_co_cf^cf = Ad_{g_cf_f} V_f - Ad_{g_cf_o} V_o
  return CalcAdjointInverse(contact.g_f_cf) * V_f - CalcAdjointInverse(contact.g_o_cf) * V_o;
}

Vector6d CalcGaussFrameTwist(const SurfaceGeometry& surface, const Vector2d& alpha_dot) {
  // s = M alphadot;  v = [s; 0];  zdot = [x y] K s = omega x z;  y . xdot = T s = omega_z
  const Vector2d s = surface.M * alpha_dot;
  const Vector2d n_dot = surface.K * s;
  Vector6d V;
  V << s, 0.0, -n_dot.y(), n_dot.x(), surface.T.dot(s);
  return V;
}

Vector6d CalcFrameTwistOnFingertip(const ContactGeometry& contact, const Vector5d& kappa_dot) {
  return CalcGaussFrameTwist(contact.fingertip, kappa_dot.head<2>());
}

Vector6d CalcFrameTwistOnObject(const ContactGeometry& contact, const Vector5d& kappa_dot) {
  // V_o_cf^cf = Ad_{g_cf_co} V_o_co^co + psidot e_6, with R_cf_co = R_co_cf^T = R_co_cf
  const Vector6d V_o_co = CalcGaussFrameTwist(contact.object, kappa_dot.segment<2>(2));
  const Matrix3d R_cf_co = CalcContactRotation3(contact.R_psi);
  Vector6d V;
  V << R_cf_co * V_o_co.head<3>(), R_cf_co * V_o_co.tail<3>();
  V(5) += kappa_dot(4);
  return V;
}

double CalcRimDistance(double radius, const Vector3d& pole, const Vector3d& p) {
  // pi/2 - angle, of the height above the rim's plane and the distance from the axis
  return radius * std::atan2(pole.dot(p), pole.cross(p).norm());
}

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

FoundContact FindContact(const Surface& fingertip, const Surface& object, const Pose& X_OF,
                         const ContactCoordinates& guess) {
  SurfacePoint alpha_f = fingertip.Normalize(guess.alpha_f);
  SurfacePoint alpha_o = object.Normalize(guess.alpha_o);
  Pair pair = EvaluatePair(fingertip, object, X_OF, alpha_f, alpha_o);
  for (int count = 0; count < kMaxSteps && !HasConverged(pair, X_OF); ++count) {
    const Eigen::Vector4d step = CalcStep(pair);
    if (!step.allFinite()) break;
    alpha_f = Move(fingertip, alpha_f, pair.f, step.head<2>());
    alpha_o = Move(object, alpha_o, pair.o, step.tail<2>());
    pair = EvaluatePair(fingertip, object, X_OF, alpha_f, alpha_o);
  }
  const double misalignment = std::atan2(pair.n_xy.norm(), -pair.R_f.col(2).dot(pair.o.R.col(2)));
  if (!HasConverged(pair, X_OF) || misalignment > kPi / 2.0) {
    throw SingularityError("no contact found from this start, angle left between the normals [rad]: " +
                               std::to_string(misalignment),
                           misalignment);
  }
  return {{alpha_f, alpha_o, CalcPsi(pair)}, pair.gap};
}

FoundContact FindContact(const Surface& fingertip, const Surface& object, const Pose& X_OF) {
  ContactCoordinates guess;
  guess.alpha_o = object.Project(X_OF.translation()).alpha;
  const Vector3d p_FC = X_OF.inverse() * object.Evaluate(guess.alpha_o).p;
  guess.alpha_f = fingertip.Project(p_FC).alpha;
  return FindContact(fingertip, object, X_OF, guess);
}

}  // namespace dexcheck
