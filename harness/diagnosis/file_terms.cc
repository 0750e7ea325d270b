#include "harness/diagnosis/file_terms.h"

#include <cmath>

#include "controller/model/rigid_body.h"
#include "controller/model/robot_model.h"

namespace dexcheck {
namespace {

bool IsIdentity(const Pose& X) { return X.isApprox(Pose::Identity(), 0.0); }

/// The product, where nothing is rounded by frames that coincide.
Pose Chain(const Pose& X, const Pose& Y) { return IsIdentity(X) ? Y : IsIdentity(Y) ? X : X * Y; }

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

/// A body in another frame, in which its own stands at X.
void Move(const Pose& X, MassProperties* body) {
  if (IsIdentity(X)) return;
  *body = ExpressIn(*body, X);
  Tidy(body->com);
  Tidy(body->inertia);
}

}  // namespace

RobotSpec FileTerms::Write(RobotSpec spec) const {
  for (size_t i = 0; i < spec.joints.size(); ++i) {
    Joint& joint = spec.joints[i];
    const Pose X_iL = OwnFrame(static_cast<int>(i));
    joint.X_PB = Chain(OwnFrame(joint.parent).inverse(), joint.X_PB);
    if (IsPlain(static_cast<int>(i))) {
      joint.X_PB =
          Chain(joint.X_PB, CalcMdhTransform(joint.mdh.alpha, joint.mdh.a, joint.mdh.q, joint.mdh.d));
      joint.X_PB = Chain(joint.X_PB, X_iL);
      joint.mdh = MdhRow{};
      TidyPose(&joint.X_PB);
    }
    Move(X_iL.inverse(), &joint.body);
  }
  for (Frame& frame : spec.frames) {
    if (!IsPlain(frame.link)) continue;
    frame.X_LF = Chain(OwnFrame(frame.link).inverse(), frame.X_LF);
    TidyPose(&frame.X_LF);
  }
  return spec;
}

RobotSpec FileTerms::Read(RobotSpec written) const {
  std::vector<Pose> X_iL;
  for (size_t i = 0; i < written.joints.size(); ++i)
    X_iL.push_back(AxisFrame(written.joints[i], static_cast<int>(i)).inverse());
  const auto own_frame = [&](int link) {
    return link < 0 ? Pose::Identity() : X_iL[static_cast<size_t>(link)];
  };
  for (size_t i = 0; i < written.joints.size(); ++i) {
    Joint& joint = written.joints[i];
    joint.X_PB = Chain(own_frame(joint.parent), Chain(joint.X_PB, X_iL[i].inverse()));
    if (IsPlain(static_cast<int>(i))) joint.mdh = MdhRow{};
    if (!IsIdentity(X_iL[i])) joint.body = ExpressIn(joint.body, X_iL[i]);
  }
  for (Frame& frame : written.frames) frame.X_LF = Chain(own_frame(frame.link), frame.X_LF);
  return written;
}

Pose FileTerms::AxisFrame(const Joint& written, int joint) const {
  if (!IsPlain(joint)) return Pose::Identity();
  Pose X_Li = OwnFrame(joint).inverse();
  const MdhRow& turn = written.mdh;
  if (turn.alpha == 0.0 && turn.q == 0.0) return X_Li;
  return X_Li * Eigen::AngleAxisd(turn.q, Vector3d::UnitZ()) *
         Eigen::AngleAxisd(turn.alpha, Vector3d::UnitX());
}

Pose FileTerms::CalcPlace(const Joint& written, int joint, double q) const {
  const bool is_plain = IsPlain(joint);
  const MdhRow mdh = is_plain ? MdhRow{} : written.mdh;
  const bool turns = written.type == JointType::kRevolute;
  const Pose X = CalcMdhTransform(mdh.alpha, mdh.a, mdh.q + (turns ? q : 0.0), mdh.d + (turns ? 0.0 : q));
  if (!is_plain) return written.X_PB * X;
  const Pose X_Li = AxisFrame(written, joint);
  return written.X_PB * X_Li * X * X_Li.inverse();
}

}  // namespace dexcheck
