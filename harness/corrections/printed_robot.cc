#include "harness/corrections/printed_robot.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

namespace dexcheck {
namespace {

/// Median of the half units of numbers that are no whole ones; 0 of few.
double FindMedian(std::vector<double> halves) {
  constexpr size_t kFew = 4;
  return halves.size() < kFew ? 0.0 : Median(std::move(halves));
}

bool IsWhole(double value) { return std::abs(value - std::round(value)) < 1e-12; }

/// Gives numbers at least the median half unit of those that are no whole ones.
void Level(const std::vector<LinkNumber>& broken, const std::vector<LinkNumber>& all,
           double most = std::numeric_limits<double>::infinity()) {
  std::vector<double> halves;
  for (const LinkNumber& number : broken) halves.push_back(*number.half);
  const double least = std::min(FindMedian(std::move(halves)), most);
  for (const LinkNumber& number : all) *number.half = std::max(*number.half, least);
}

}  // namespace

Matrix3d TurnAbout(int axis, double angle) {
  return Eigen::AngleAxisd(angle, Vector3d::Unit(axis)).toRotationMatrix();
}

std::array<Vector3d, 2> SolveRollPitchYaw(const Matrix3d& R) {
  constexpr double kGimbal = 1e-7;
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  if (std::abs(std::cos(pitch)) > kGimbal) {
    const Vector3d near(std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0)));
    return {near, Vector3d(near[0] + kPi, kPi - pitch, near[2] + kPi)};
  }
  const double sign = pitch > 0.0 ? 1.0 : -1.0;
  const double turn = std::atan2(sign * R(0, 1), R(1, 1));
  return {Vector3d(turn, pitch, 0.0), Vector3d(0.0, pitch, -sign * turn)};
}

Vector4d ToQuaternion(const Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  const Vector4d wxyz(q.w(), q.x(), q.y(), q.z());
  return q.w() < 0.0 ? Vector4d(-wxyz) : wxyz;
}

Matrix3d TurnQuaternion(const Vector4d& wxyz) {
  const double length = wxyz.norm();
  if (length == 0.0) return Matrix3d::Identity();
  const Vector4d q = wxyz / length;
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

Vector3d CalcRotationVector(const Matrix3d& R) {
  const Vector4d q = ToQuaternion(R);
  const double sine = q.tail<3>().norm();
  if (sine < 1e-15) return Vector3d::Zero();
  return q.tail<3>() / sine * 2.0 * std::atan2(sine, q[0]);
}

double CalcAngle(const Matrix3d& R) { return CalcRotationVector(R).norm(); }

std::vector<Matrix3d> ListAxesTurns(const Matrix3d& from, const Matrix3d& to) {
  const Matrix3d V = Eigen::SelfAdjointEigenSolver<Matrix3d>(to).eigenvectors();
  const Matrix3d W = Eigen::SelfAdjointEigenSolver<Matrix3d>(from).eigenvectors();
  std::vector<Matrix3d> turns;
  for (int signs = 0; signs < 8; ++signs) {
    const Vector3d s((signs & 1) != 0 ? 1.0 : -1.0, (signs & 2) != 0 ? 1.0 : -1.0,
                     (signs & 4) != 0 ? 1.0 : -1.0);
    const Matrix3d R = V * s.asDiagonal() * W.transpose();
    if (R.determinant() > 0.0) turns.push_back(R);
  }
  return turns;
}

Matrix3d PrintedOrigin::CalcRotation() const {
  switch (form) {
    case RotationForm::kNone:
      return Matrix3d::Identity();
    case RotationForm::kRollPitchYaw:
      return TurnRollPitchYaw(r.head<3>());
    case RotationForm::kQuaternion:
      return TurnQuaternion(r);
    case RotationForm::kMdh:
      return X_before.linear() * TurnAbout(0, r[0]) * TurnAbout(2, r[1]);
    case RotationForm::kEuler:
      break;
  }
  Matrix3d R = Matrix3d::Identity();
  for (int k = 0; k < 3; ++k) {
    const char letter = sequence[static_cast<size_t>(k)];
    const Matrix3d turn = TurnAbout(std::tolower(letter) - 'x', r[k]);
    R = std::islower(static_cast<unsigned char>(letter)) != 0 ? Matrix3d(R * turn) : Matrix3d(turn * R);
  }
  return R;
}

Pose PrintedOrigin::CalcPose() const {
  Pose X;
  X.linear() = CalcRotation();
  X.translation() = t;
  X.makeAffine();
  if (form == RotationForm::kMdh)
    X.translation() = X_before * (TurnAbout(0, r[0]) * Vector3d(0.0, 0.0, t[2]) + Vector3d(t[0], 0.0, 0.0));
  return X;
}

void PrintedOrigin::SetRotation(const Matrix3d& R) {
  if (form == RotationForm::kMdh) {
    t = CalcPose().translation();
    X_before = Pose::Identity();
  }
  half_r.setConstant(half_r.maxCoeff());
  if (form == RotationForm::kRollPitchYaw) {
    r.head<3>() = SolveRollPitchYaw(R)[0];
    return;
  }
  form = RotationForm::kQuaternion;
  r = ToQuaternion(R);
}

void PrintedOrigin::SetRow(const Pose& pose) {
  const Pose X = X_before.inverse() * pose;
  const Matrix3d R = X.linear();  // Rot(x, alpha) Rot(z, q)
  const double alpha = std::atan2(-R(1, 2), R(2, 2));
  const double q = std::atan2(-R(0, 1), R(0, 0));
  r.head<2>() << alpha, std::remainder(q - r[1], 2.0 * kPi) + r[1];
  t << X.translation().x(), 0.0, Vector3d(0.0, -std::sin(alpha), std::cos(alpha)).dot(X.translation());
}

bool IsTurned(const PrintedOrigin& x, const PrintedOrigin& y) {
  return x.r != y.r || x.form != y.form || x.sequence != y.sequence;
}

bool IsOther(const PrintedOrigin& x, const PrintedOrigin& y) { return x.t != y.t || IsTurned(x, y); }

bool IsOther(const std::optional<PrintedInertial>& x, const std::optional<PrintedInertial>& y) {
  if (!x || !y) return x.has_value() != y.has_value();
  return x->mass.value != y->mass.value || x->I != y->I || IsOther(x->origin, y->origin);
}

std::vector<LinkNumber> ListNumbers(PrintedOrigin* origin) {
  std::vector<LinkNumber> numbers;
  numbers.reserve(7);
  for (int k = 0; k < 3; ++k) numbers.push_back({&origin->t[k], &origin->half_t[k]});
  for (int k = 0; k < 4; ++k) numbers.push_back({&origin->r[k], &origin->half_r[k]});
  return numbers;
}

std::vector<LinkNumber> ListNumbers(PrintedInertial* inertial) {
  std::vector<LinkNumber> numbers = ListNumbers(&inertial->origin);
  numbers.reserve(numbers.size() + 7);
  numbers.push_back({&inertial->mass.value, &inertial->mass.half});
  for (int k = 0; k < 6; ++k) numbers.push_back({&inertial->I[k], &inertial->half_I[k]});
  return numbers;
}

int PrintedRobot::Add(PrintedLink added) {
  const int index = size();
  if (added.parent >= 0) link(added.parent).children.push_back(index);
  links.push_back(std::move(added));
  return index;
}

void TakeMotors(PrintedRobot* robot) {
  std::erase_if(robot->constraints, [](const std::string& text) { return text.starts_with("servo "); });
  for (int i = 0; i < robot->size(); ++i) {
    PrintedLink& link = robot->link(i);
    if (link.joint.kind == JointKind::kFixed) continue;
    std::optional<PrintedScalar>& gear = link.joint.scalars[static_cast<size_t>(JointScalar::kGear)];
    std::optional<PrintedScalar>& effort = link.joint.scalars[static_cast<size_t>(JointScalar::kEffort)];
    gear.reset();
    effort.reset();
    for (const bool servos : {false, true}) {
      const bool has_motor = servos && gear;
      for (const PrintedMotor& motor : robot->motors) {
        if (motor.link != i || motor.servo.empty() == servos) continue;
        if (servos)
          robot->constraints.push_back(fmt::format("{} joint {} {}",
                                                   has_motor ? "servo beside the motor of" : kServo,
                                                   link.joint.name, motor.servo));
        if (!servos || !gear) gear = PrintedScalar{(gear ? gear->value : 0.0) + motor.gear, 0.0};
        if (motor.effort)
          effort = PrintedScalar{(effort ? effort->value : 0.0) + motor.effort->value, motor.effort->half};
      }
    }
  }
  std::ranges::sort(robot->constraints);
}

namespace {

/// Gives whole numbers among rounded ones as many significant digits as those have: 31 stands for 31.0000.
void LevelWhole(PrintedRobot* robot) {
  constexpr double kMost = 1e-4;  // of the number
  std::vector<PrintedScalar*> whole;
  std::vector<double> fractions;  // of half units in a unit of the first digit
  const auto find_unit = [](double value) { return std::pow(10.0, std::floor(std::log10(std::abs(value)))); };
  const auto add = [&](PrintedScalar* number) {
    if (number->value == 0.0) return;
    if (number->half == 0.0) whole.push_back(number);
    if (number->half > 0.0) fractions.push_back(number->half / find_unit(number->value));
  };
  for (PrintedLink& link : robot->links) {
    if (link.inertial) add(&link.inertial->mass);
    for (std::optional<PrintedScalar>& number : link.joint.scalars) {
      if (number) add(&*number);
    }
  }
  if (fractions.size() < whole.size()) return;
  const double fraction = FindMedian(std::move(fractions));
  for (PrintedScalar* const number : whole)
    number->half = std::min(fraction * find_unit(number->value), kMost * std::abs(number->value));
}

}  // namespace

void LevelPrecision(PrintedRobot* robot) {
  // At most a micrometre, and a hundredth of a milliradian: a file of few digits stays as it is.
  constexpr double kMostTurn = 1e-5;
  constexpr double kMostLength = 1e-6;
  std::vector<LinkNumber> turns, lengths, ends, limits;
  for (PrintedLink& link : robot->links) {
    const std::vector<LinkNumber> numbers = ListNumbers(&link.origin);
    for (size_t k = 0; k < numbers.size(); ++k) {
      if (!IsWhole(*numbers[k].value)) (k < 3 ? lengths : turns).push_back(numbers[k]);
    }
    if (!link.joint.range) continue;
    for (PrintedScalar& limit : *link.joint.range) {
      limits.push_back({&limit.value, &limit.half});
      if (limit.value != 0.0) ends.push_back(limits.back());
    }
  }
  Level(turns, turns, kMostTurn);
  Level(lengths, lengths, kMostLength);
  Level(ends, limits);
  LevelWhole(robot);
}

}  // namespace dexcheck
