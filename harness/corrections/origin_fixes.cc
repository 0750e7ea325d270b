#include "harness/corrections/origin_fixes.h"

#include <cctype>
#include <cmath>

namespace dexcheck {
namespace {

constexpr int kNumPermutations = 5;

bool IsNone(const Matrix3d& R) { return (R - Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-12; }

void TakeAngles(const Vector3d& angles, PrintedOrigin* right) { right->r.head<3>() = angles; }

Matrix3d TurnMoving(const Vector3d& angles) {
  return TurnAbout(0, angles[0]) * TurnAbout(1, angles[1]) * TurnAbout(2, angles[2]);
}

}  // namespace

Matrix3d MakeMirror(int axis) {
  Matrix3d mirror = Matrix3d::Identity();
  mirror(axis, axis) = -1.0;
  return mirror;
}

Matrix3d MakePermutation(const int (&p)[3]) {
  Matrix3d P = Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) P(k, p[k]) = 1.0;
  return P;
}

std::vector<OriginFix> ListRotationFixes(const PrintedOrigin& origin) {
  std::vector<OriginFix> fixes;
  const Matrix3d R = origin.CalcRotation();
  if (IsNone(R)) return fixes;
  const bool has_angles = origin.form == RotationForm::kRollPitchYaw;
  const auto add = [&](CorrectionKind kind, double bits, int component = 0) {
    fixes.push_back({kind, component, bits});
  };
  if (has_angles || origin.form == RotationForm::kEuler || origin.form == RotationForm::kMdh) {
    add(CorrectionKind::kDegrees, 0.0);
    add(CorrectionKind::kRadians, 0.0);
  }
  if (has_angles || origin.form == RotationForm::kEuler) {
    const bool several = (origin.r.head<3>().array().abs() > 1e-9).count() > 1;
    for (int k = 0; k < 3 && several; ++k) {
      add(CorrectionKind::kAngleSign, 0.0, k);
      add(CorrectionKind::kAngleDegrees, 1.0, k);
    }
  }
  if (has_angles) {
    add(CorrectionKind::kAnglesReversed, 0.0);
    for (const int k : {0, 2, 3, 4}) add(CorrectionKind::kAnglesPermuted, 1.0, k);
  }
  for (int k = 0; k < static_cast<int>(std::size(kSequences)) && origin.form == RotationForm::kEuler; ++k)
    add(CorrectionKind::kEulerSequence, 1.0, k);
  add(CorrectionKind::kMovingAxes, 0.0);
  add(CorrectionKind::kFixedAxes, 0.0);
  add(CorrectionKind::kTransposed, 0.0);
  const double indirect = origin.form == RotationForm::kQuaternion ? 0.0 : 2.0;
  add(CorrectionKind::kScalarFirst, indirect);
  add(CorrectionKind::kScalarLast, indirect);
  for (int k = 0; k < 3; ++k) add(CorrectionKind::kMirror, 0.0, k);
  for (int k = 0; k < 9; ++k) {
    add(CorrectionKind::kTurnOwn, 3.0, k);
    add(CorrectionKind::kTurnParent, 3.5, k);
  }
  return fixes;
}

void FixRotation(const OriginFix& fix, const PrintedOrigin& given, PrintedOrigin* right) {
  const auto k = static_cast<size_t>(fix.component);
  const Vector3d angles = given.r.head<3>();
  const Matrix3d R = given.CalcRotation();
  constexpr double kDegree = kPi / 180.0;
  switch (fix.kind) {
    case CorrectionKind::kDegrees:
      return TakeAngles(angles * kDegree, right);
    case CorrectionKind::kRadians:
      return TakeAngles(angles / kDegree, right);
    case CorrectionKind::kAngleSign:
      right->r[fix.component] = -angles[fix.component];
      return;
    case CorrectionKind::kAngleDegrees:
      right->r[fix.component] = angles[fix.component] * kDegree;
      return;
    case CorrectionKind::kAnglesReversed:
      return TakeAngles(angles.reverse(), right);
    case CorrectionKind::kAnglesPermuted:
      return TakeAngles(MakePermutation(kPermutations[k]) * angles, right);
    case CorrectionKind::kEulerSequence:
      for (size_t i = 0; i < 3; ++i) right->sequence[i] = kSequences[k][i];
      return;
    case CorrectionKind::kMovingAxes:  // they were read as roll, pitch, yaw
      if (given.form == RotationForm::kRollPitchYaw) return right->SetRotation(TurnMoving(angles));
      return right->SetRotation(TurnMoving(SolveRollPitchYaw(R)[0]));
    case CorrectionKind::kFixedAxes:
      return right->SetRotation(TurnRollPitchYaw(-SolveRollPitchYaw(R.transpose())[0]));
    case CorrectionKind::kTransposed:
      return right->SetRotation(R.transpose());
    case CorrectionKind::kScalarFirst:
    case CorrectionKind::kScalarLast: {
      const Vector4d q = given.form == RotationForm::kQuaternion ? given.r : ToQuaternion(R);
      const bool first = fix.kind == CorrectionKind::kScalarFirst;
      return right->SetRotation(
          TurnQuaternion(first ? Vector4d(q[3], q[0], q[1], q[2]) : Vector4d(q[1], q[2], q[3], q[0])));
    }
    case CorrectionKind::kMirror:
      return right->SetRotation(MakeMirror(fix.component) * R * MakeMirror(fix.component));
    case CorrectionKind::kTurnOwn:
    case CorrectionKind::kTurnParent: {
      constexpr double kQuarters[] = {-1.0, 2.0, 1.0};
      const Matrix3d turn = TurnAbout(fix.component / 3, kQuarters[k % 3] * kPi / 2.0);
      return right->SetRotation(fix.kind == CorrectionKind::kTurnOwn ? Matrix3d(R * turn.transpose())
                                                                     : Matrix3d(turn.transpose() * R));
    }
    default:
      return;
  }
}

std::vector<OriginFix> ListVectorFixes(SiteKind kind, const Vector3d& given) {
  std::vector<OriginFix> fixes = {{CorrectionKind::kSign}};
  const bool several = (given.array() != 0.0).count() > 1;
  for (int k = 0; k < 3 && several; ++k) fixes.push_back({CorrectionKind::kSignOf, k});
  for (int k = 0; k < kNumPermutations; ++k) fixes.push_back({CorrectionKind::kPermutation, k});
  if (kind == SiteKind::kAxis) return fixes;
  for (int k = 0; k < static_cast<int>(ListUnits(kind).size()); ++k)
    fixes.push_back({CorrectionKind::kUnit, k});
  return fixes;
}

Vector3d FixVector(const OriginFix& fix, SiteKind kind, const Vector3d& given) {
  const auto k = static_cast<size_t>(fix.component);
  switch (fix.kind) {
    case CorrectionKind::kSign:
      return -given;
    case CorrectionKind::kSignOf:
      return MakeMirror(fix.component) * given;
    case CorrectionKind::kPermutation:
      return MakePermutation(kPermutations[k]).transpose() * given;
    case CorrectionKind::kUnit:
      return ListUnits(kind)[k].factor * given;
    default:
      return given;
  }
}

}  // namespace dexcheck
