#include "controller/contact/find_contact.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

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
  Vector2d n_xy;  // tangential part of the object's normal, likewise
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
