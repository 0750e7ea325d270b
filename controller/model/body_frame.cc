#include "controller/model/body_frame.h"

namespace dexcheck {

MassProperties ExpressIn(const MassProperties& body, const Pose& X_AB) {
  // I_A = R_AB I_B R_AB^T
  const Matrix3d R_AB = X_AB.linear();
  return {body.mass, X_AB * body.com, R_AB * body.inertia * R_AB.transpose()};
}

Matrix3d MakeRotationFromZ(const Vector3d& z) {
  int least = 0;
  z.cwiseAbs().minCoeff(&least);
  const Vector3d x = Vector3d::Unit(least).cross(z).normalized();
  Matrix3d R;
  R << x, z.cross(x), z;
  return R;
}

}  // namespace dexcheck
