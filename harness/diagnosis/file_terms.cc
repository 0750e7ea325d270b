#include "harness/diagnosis/file_terms.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "controller/model/body_frame.h"
#include "controller/model/robot_model.h"

namespace dexcheck {
namespace {

using Kind = ParameterKind;

bool IsIdentity(const Pose& X) { return X.isApprox(Pose::Identity(), 0.0); }

/// What rounding leaves of a zero when a vector or tensor is turned into other axes.
template <typename Matrix>
void Tidy(Matrix&& matrix) {
  constexpr double kRounding = 4e-15;
  const double size = matrix.norm();
  for (double& entry : matrix.reshaped()) {
    if (std::abs(entry) <= kRounding * size) entry = 0.0;
  }
}

void TidyPose(Pose* X) {
  Tidy(X->matrix().topLeftCorner<3, 3>());
  Tidy(X->matrix().topRightCorner<3, 1>());
}

bool IsSame(const Repair& a, const Repair& b) {
  return a.kind == b.kind && a.kind == RepairKind::kParameters && a.parameters == b.parameters;
}

}  // namespace

FileTerms::FileTerms(RobotSpec spec, std::vector<WrittenRow> rows)
    : spec_(std::move(spec)), rows_(std::move(rows)) {
  rows_.resize(spec_.joints.size());
  is_plain_ = std::any_of(rows_.begin(), rows_.end(), [](const WrittenRow& row) { return row.is_plain; });
  written_ = Write(spec_, rows_);
}

RobotSpec FileTerms::Write(const RobotSpec& spec, const std::vector<WrittenRow>& rows) {
  RobotSpec written = spec;
  const auto own_frame = [&](int link) {
    return link < 0 || !rows[static_cast<size_t>(link)].is_plain ? Pose::Identity()
                                                                 : rows[static_cast<size_t>(link)].X_iL;
  };
  for (size_t i = 0; i < spec.joints.size(); ++i) {
    const Joint& joint = spec.joints[i];
    Joint& own = written.joints[i];
    const Pose X_iL = own_frame(static_cast<int>(i));
    const Pose X_PL = own_frame(joint.parent);
    if (!IsIdentity(X_PL)) own.X_PB = X_PL.inverse() * own.X_PB;
    if (rows[i].is_plain) {
      own.X_PB = own.X_PB * CalcMdhTransform(joint.mdh.alpha, joint.mdh.a, joint.mdh.q, joint.mdh.d) * X_iL;
      own.mdh = MdhRow{};
      TidyPose(&own.X_PB);
    }
    if (IsIdentity(X_iL)) continue;
    own.body = ExpressIn(joint.body, X_iL.inverse());
    Tidy(own.body.com);
    Tidy(own.body.inertia);
  }
  for (Frame& frame : written.frames) {
    const Pose X_iL = own_frame(frame.link);
    if (IsIdentity(X_iL)) continue;
    frame.X_LF = X_iL.inverse() * frame.X_LF;
    TidyPose(&frame.X_LF);
  }
  return written;
}

bool FileTerms::IsWritten(const Parameter& parameter) const {
  const auto is_turned = [&](int link) { return link >= 0 && rows_[static_cast<size_t>(link)].is_plain; };
  switch (parameter.kind) {
    case Kind::kCom:
    case Kind::kInertia:
      return !is_turned(parameter.index);
    case Kind::kFramePosition:
    case Kind::kFrameRotation:
      return !is_turned(spec_.frames[static_cast<size_t>(parameter.index)].link);
    default:
      return !IsOfRow(parameter.kind) ||
             !(is_turned(parameter.index) ||
               (is_turned(spec_.joints[static_cast<size_t>(parameter.index)].parent) &&
                (parameter.kind == Kind::kPosition || parameter.kind == Kind::kRotation)));
  }
}

Repair FileTerms::ConvertFrom(const RobotSpec& before, const std::vector<WrittenRow>& rows,
                              const Repair& cause) const {
  if (cause.kind != RepairKind::kParameters ||
      std::all_of(cause.parameters.begin(), cause.parameters.end(),
                  [&](const Parameter& parameter) { return IsWritten(parameter); })) {
    return cause;
  }
  RobotSpec repaired = before;
  Apply(cause, &repaired);
  const RobotSpec from = Write(before, rows);
  const RobotSpec to = Write(repaired, rows);
  Repair converted = cause;
  converted.parameters.clear();
  converted.values.clear();
  const auto add_group = [&](Kind kind, int index, int count) {
    // Solved numbers keep some eleven digits; what is turned with them differs by their rounding.
    constexpr double kRounding = 1e-9;
    double largest = 0.0;
    const auto change = [&](int k) {
      const Parameter parameter{kind, index, k};
      return std::abs(GetValue(to, parameter) - GetValue(from, parameter));
    };
    for (int k = 0; k < count; ++k) largest = std::max(largest, change(k));
    const bool is_length = !IsAngle(written_, {kind, index, 0});
    const double least = is_length && kind != Kind::kInertia ? 1e-13 : 0.0;  // m
    for (int k = 0; k < count; ++k) {
      const Parameter parameter{kind, index, k};
      const bool is_named = std::find(converted.parameters.begin(), converted.parameters.end(), parameter) !=
                            converted.parameters.end();
      if (is_named || !(change(k) > std::max(least, kRounding * largest))) continue;
      const double value = GetValue(to, parameter);
      // As a person would have written it, unless that is another number.
      constexpr double kSolved = 1e-11;
      const double rounded = RoundSolved(written_, parameter, value);
      const bool is_same = rounded == 0.0 || std::abs(rounded - value) <= kSolved * std::abs(value);
      converted.parameters.push_back(parameter);
      converted.values.push_back(ReadBackPrinted(written_, parameter, is_same ? rounded : value));
    }
  };
  for (size_t i = 0; i < cause.parameters.size(); ++i) {
    const Parameter& parameter = cause.parameters[i];
    if (IsWritten(parameter)) {
      converted.parameters.push_back(parameter);
      converted.values.push_back(cause.values[i]);
    } else if (IsOfRow(parameter.kind)) {
      add_group(Kind::kPosition, parameter.index, 3);
      add_group(Kind::kRotation, parameter.index, 3);
    } else {
      add_group(parameter.kind, parameter.index, parameter.kind == Kind::kInertia ? 6 : 3);
    }
  }
  return converted;
}

std::vector<Repair> FileTerms::Convert(const std::vector<Repair>& causes) const {
  if (!is_plain_) return causes;
  std::vector<Repair> converted;
  RobotSpec spec = spec_;
  std::vector<WrittenRow> rows = rows_;
  for (const Repair& cause : causes) {
    Repair& own = converted.emplace_back(ConvertFrom(spec, rows, cause));
    own.equivalents.clear();
    for (const Repair& equal : cause.equivalents) {
      Repair other = ConvertFrom(spec, rows, equal);
      const bool is_known =
          IsSame(other, own) || std::any_of(own.equivalents.begin(), own.equivalents.end(),
                                            [&](const Repair& known) { return IsSame(known, other); });
      if (!is_known) own.equivalents.push_back(std::move(other));
    }
    Apply(cause, &spec);
    // Frame i is turned by half about its x axis, and the link's own frame stays where it is.
    if (cause.kind == RepairKind::kAxisReversed) {
      WrittenRow& row = rows[static_cast<size_t>(cause.joint)];
      row.X_iL.linear() = Vector3d(1.0, -1.0, -1.0).asDiagonal() * row.X_iL.linear();
    }
  }
  return converted;
}

Repair FileTerms::ConvertPart(const Repair& cause) const {
  if (!is_plain_ || cause.kind != RepairKind::kParameters) return cause;
  Repair changed = cause;
  constexpr double kOffset = 1e-3;
  for (size_t i = 0; i < changed.parameters.size(); ++i)
    changed.values[i] =
        GetValue(spec_, changed.parameters[i]) + kOffset * GetScale(spec_, changed.parameters[i]);
  return ConvertFrom(spec_, rows_, changed);
}

}  // namespace dexcheck
