#include "harness/descriptions/conventions.h"
#include "harness/descriptions/parameter_writer.h"

namespace dexcheck {
namespace {

constexpr double kDegree = kPi / 180.0;

Matrix3d Turn(int axis, double angle) {
  return Eigen::AngleAxisd(angle, Vector3d::Unit(axis)).toRotationMatrix();
}
Matrix3d FromAngles(const Vector3d& rpy) { return Turn(2, rpy[2]) * Turn(1, rpy[1]) * Turn(0, rpy[0]); }
Matrix3d InOtherOrder(const Vector3d& rpy) { return Turn(0, rpy[0]) * Turn(1, rpy[1]) * Turn(2, rpy[2]); }
Matrix3d FromQuaternion(double w, double x, double y, double z) {
  return Eigen::Quaterniond(w, x, y, z).toRotationMatrix();
}
bool IsSame(const Matrix3d& a, const Matrix3d& b) {
  constexpr double kSame = 1e-6;
  return (a - b).cwiseAbs().maxCoeff() < kSame;
}

Matrix3d FromSignedAngles(const Matrix3d& R) { return FromAngles(-CalcRollPitchYaw(R)); }
Matrix3d FromReversedAngles(const Matrix3d& R) { return FromAngles(CalcRollPitchYaw(R).reverse()); }
Matrix3d ToOtherOrder(const Matrix3d& R) { return InOtherOrder(CalcRollPitchYaw(R)); }
Matrix3d FromOtherOrder(const Matrix3d& R) { return FromAngles(-CalcRollPitchYaw(R.transpose())); }
Matrix3d Quarter(const Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return FromQuaternion(q.z(), q.w(), q.x(), q.y());
}
Matrix3d QuarterBack(const Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return FromQuaternion(q.x(), q.y(), q.z(), q.w());
}
const RotationFault kRotations[] = {
    {"transposed", "turned the other way (transposed)",
     [](const Matrix3d& R) { return Matrix3d(R.transpose()); }, nullptr},
    {"degrees", "as if its angles were in degrees, though radians are expected", nullptr,
     [](const Matrix3d& R) { return FromAngles(CalcRollPitchYaw(R) / kDegree); }},
    {"radians", "as if its angles were in radians, though degrees are expected",
     [](const Matrix3d& R) { return FromAngles(CalcRollPitchYaw(R) / kDegree); }, nullptr},
    {"missing", "missing", nullptr, [](const Matrix3d&) { return Matrix3d(Matrix3d::Identity()); }},
    {"unneeded", "as if the file should have none",
     [](const Matrix3d&) { return Matrix3d(Matrix3d::Identity()); }, nullptr},
    {"other_order", "as if its roll, pitch and yaw were taken in the other order", FromOtherOrder,
     ToOtherOrder},
    {"meant_other_order", "as if its roll, pitch and yaw were meant in the other order", ToOtherOrder,
     FromOtherOrder},
    {"ypr", "as if yaw, pitch and roll stood in the place of roll, pitch and yaw", FromReversedAngles,
     FromReversedAngles},
    {"sign", "with the sign of its angles turned around", FromSignedAngles, FromSignedAngles},
    {"xyzw", "as if its quaternion were written x, y, z, w and read w, x, y, z", Quarter, nullptr},
    {"wxyz", "as if its quaternion were written w, x, y, z and read x, y, z, w", QuarterBack, nullptr}};

}  // namespace

std::span<const RotationFault> ListRotationFaults() { return kRotations; }

std::optional<Matrix3d> Undo(const RotationFault& fault, const Matrix3d& given, const Matrix3d& right) {
  if (fault.apply != nullptr && IsSame(fault.apply(right), given)) return right;
  if (fault.undo == nullptr) return std::nullopt;
  return fault.undo(given);
}

}  // namespace dexcheck
