#include "harness/diagnosis/placement.h"

#include <algorithm>
#include <cmath>

namespace dexcheck {
namespace {

// Three states tell a wrong place from a right one that is seen along its axis.
constexpr size_t kStateSamples = 3;

// Both sides chain some dozen rotations: 1e-14 of the robot's size. A file's numbers have fewer digits than
// this leaves.
constexpr double kPlaceRounding = 1e-11;

size_t At(int link) { return static_cast<size_t>(link + 1); }

}  // namespace

int CarrierOf(const RobotSpec& spec, const Parameter& parameter) {
  if (parameter.kind == ParameterKind::kFramePosition || parameter.kind == ParameterKind::kFrameRotation)
    return spec.frames[static_cast<size_t>(parameter.index)].link;
  return parameter.index;
}

Placement::Placement(const RobotSpec& spec, const EngineEvidence& evidence, bool bodies)
    : trial_(spec),
      base_origin_(spec.base.X_B0.translation()),
      evidence_(&evidence),
      used_(std::min(kStateSamples, evidence.samples().size())) {
  const int joints = static_cast<int>(spec.joints.size());
  subtree_.resize(At(joints));
  for (int i = 0; i < joints; ++i) {
    for (int j = i; j >= 0; j = spec.joints[static_cast<size_t>(j)].parent) subtree_[At(j)].push_back(i);
    subtree_[0].push_back(i);
  }
  poses_.assign(used_, std::vector<Pose>(At(joints), Pose::Identity()));
  rows_ = poses_;
  for (int i = 0; i < joints; ++i) {
    const Joint& joint = spec.joints[static_cast<size_t>(i)];
    items_.push_back({PlacedItem::Kind::kAxisDirection, i, i});
    if (joint.type == JointType::kRevolute) items_.push_back({PlacedItem::Kind::kAxisLine, i, i});
    if (!bodies) continue;
    if (joint.body.mass > 0.0) items_.push_back({PlacedItem::Kind::kCom, i, i});
    if (joint.body.inertia.trace() > 0.0) items_.push_back({PlacedItem::Kind::kInertia, i, i});
  }
  for (size_t i = 0; i < spec.frames.size(); ++i) {
    items_.push_back({PlacedItem::Kind::kFramePosition, static_cast<int>(i), spec.frames[i].link});
    items_.push_back({PlacedItem::Kind::kFrameRotation, static_cast<int>(i), spec.frames[i].link});
  }
  beyond_.resize(At(joints));
  for (size_t item = 0; item < items_.size(); ++item) {
    beyond_[0].push_back(static_cast<int>(item));
    for (int j = items_[item].link; j >= 0; j = spec.joints[static_cast<size_t>(j)].parent)
      beyond_[At(j)].push_back(static_cast<int>(item));
  }
  UpdateAll();
}

bool Placement::Carries(int inner, int outer) const {
  while (outer > inner) outer = trial_.joints[static_cast<size_t>(outer)].parent;
  return outer == inner;
}

Pose Placement::CalcBasePose(const VectorXd& q) const {
  Pose X = trial_.base.X_B0;
  if (trial_.base.type == BaseType::kFixed) return X;
  if (trial_.base.type == BaseType::kFloating) {
    X.linear() = Eigen::Quaterniond(q[3], q[4], q[5], q[6]).normalized().toRotationMatrix();
    X.translation() = q.head<3>();
    return X;
  }
  // The engine's base was placed by X_B0 as it was; what a change moves is Sigma_0 on the base.
  X.linear() = Eigen::AngleAxisd(q[2], Vector3d::UnitZ()).toRotationMatrix();
  X.translation() = base_origin_ + X.linear() * (trial_.base.X_B0.translation() - base_origin_);
  X.translation().head<2>() += q.head<2>();
  return X;
}

void Placement::UpdateRow(int i) {
  const int offset = trial_.base.type == BaseType::kFixed      ? 0
                     : trial_.base.type == BaseType::kFloating ? 7
                                                               : 3;
  const Joint& joint = trial_.joints[static_cast<size_t>(i)];
  const bool revolute = joint.type == JointType::kRevolute;
  for (size_t sample = 0; sample < used_; ++sample) {
    const double q_i = evidence_->samples()[sample].q[offset + i];
    rows_[sample][At(i)] =
        joint.X_PB * CalcMdhTransform(joint.mdh.alpha, joint.mdh.a, joint.mdh.q + (revolute ? q_i : 0.0),
                                      joint.mdh.d + (revolute ? 0.0 : q_i));
  }
}

void Placement::UpdateFrom(int from) {
  for (size_t sample = 0; sample < used_; ++sample) {
    std::vector<Pose>& poses = poses_[sample];
    if (from < 0) poses[0] = CalcBasePose(evidence_->samples()[sample].q);
    for (const int i : subtree_[At(from)]) {
      if (!focus_.empty() && !focus_[At(i)]) continue;
      poses[At(i)] = poses[At(trial_.joints[static_cast<size_t>(i)].parent)] * rows_[sample][At(i)];
    }
  }
}

void Placement::UpdateAll() {
  for (int i = 0; i < static_cast<int>(trial_.joints.size()); ++i) UpdateRow(i);
  UpdateFrom(-1);
}

void Placement::Focus(const std::vector<int>& items) {
  focus_.assign(subtree_.size(), false);
  for (const int item : items) {
    for (int j = items_[static_cast<size_t>(item)].link; j >= 0;
         j = trial_.joints[static_cast<size_t>(j)].parent)
      focus_[At(j)] = true;
  }
}

void Placement::Unfocus() { focus_.clear(); }

void Placement::Follow() { UpdateFrom(-1); }

void Placement::Set(const Parameter& parameter, double value) {
  SetValue(&trial_, parameter, value);
  const bool frame =
      parameter.kind == ParameterKind::kFramePosition || parameter.kind == ParameterKind::kFrameRotation;
  if (frame) return;
  const int carrier = CarrierOf(trial_, parameter);
  if (carrier >= 0) UpdateRow(carrier);
  UpdateFrom(carrier);
}

void Placement::Replace(const RobotSpec& spec) {
  trial_ = spec;
  UpdateAll();
}

void Placement::Restore(const RobotSpec& spec, const Parameter& parameter) {
  const int joint = CarrierOf(spec, parameter);
  const bool frame =
      parameter.kind == ParameterKind::kFramePosition || parameter.kind == ParameterKind::kFrameRotation;
  if (frame) {
    const size_t i = static_cast<size_t>(parameter.index);
    trial_.frames[i].X_LF = spec.frames[i].X_LF;
    return;
  }
  if (joint < 0) {
    trial_.base.X_B0 = spec.base.X_B0;
  } else {
    const size_t i = static_cast<size_t>(joint);
    trial_.joints[i].X_PB = spec.joints[i].X_PB;
    trial_.joints[i].mdh = spec.joints[i].mdh;
    UpdateRow(joint);
  }
  UpdateFrom(joint);
}

void Placement::AppendResidual(int index, std::vector<double>* rows) const {
  const PlacedItem& item = items_[static_cast<size_t>(index)];
  const size_t i = static_cast<size_t>(item.index);
  const double length = evidence_->length();
  const auto append = [&](const auto& difference) {
    for (const double entry : difference.reshaped()) rows->push_back(entry);
  };
  for (size_t sample = 0; sample < used_; ++sample) {
    const StateSample& engine = evidence_->samples()[sample];
    const Pose& X = poses_[sample][At(item.link)];
    switch (item.kind) {
      case PlacedItem::Kind::kAxisDirection:
        append(engine.axes[i] - X.linear().col(2));
        break;
      case PlacedItem::Kind::kAxisLine: {
        // Where along the axis the anchor stands is a choice of frames.
        const Vector3d apart = engine.anchors[i] - X.translation();
        append(((apart - engine.axes[i].dot(apart) * engine.axes[i]) / length).eval());
        break;
      }
      case PlacedItem::Kind::kFramePosition:
        append(((engine.frames[i].translation() - X * trial_.frames[i].X_LF.translation()) / length).eval());
        break;
      case PlacedItem::Kind::kFrameRotation:
        append((engine.frames[i].linear() - X.linear() * trial_.frames[i].X_LF.linear()).eval());
        break;
      case PlacedItem::Kind::kCom:
        append(((engine.links[i + 1].com - X * trial_.joints[i].body.com) / length).eval());
        break;
      case PlacedItem::Kind::kInertia: {
        const Matrix3d& inertia = trial_.joints[i].body.inertia;
        append(
            ((engine.links[i + 1].inertia - X.linear() * inertia * X.linear().transpose()) / inertia.trace())
                .eval());
        break;
      }
    }
  }
}

double Placement::CalcError(int item) const {
  scratch_.clear();
  AppendResidual(item, &scratch_);
  double error = 0.0;
  for (const double entry : scratch_) error = std::max(error, std::abs(entry));
  return error;
}

int Placement::CountWrongNumbers(int index) const {
  if (!Fails(index)) return 0;
  const PlacedItem& item = items_[static_cast<size_t>(index)];
  if (item.kind != PlacedItem::Kind::kCom && item.kind != PlacedItem::Kind::kInertia) return 3;
  const Pose& X = poses_[0][At(item.link)];
  const MassProperties& body = trial_.joints[static_cast<size_t>(item.index)].body;
  const LinkInWorld& engine = evidence_->samples()[0].links[static_cast<size_t>(item.index + 1)];
  const double rounding = evidence_->Widen(kPlaceRounding);
  int wrong = 0;
  if (item.kind == PlacedItem::Kind::kCom) {
    const Vector3d difference = X.inverse() * engine.com - body.com;
    for (const double entry : difference) wrong += std::abs(entry) > rounding * evidence_->length() ? 1 : 0;
  } else {
    const Matrix3d difference = X.linear().transpose() * engine.inertia * X.linear() - body.inertia;
    for (const int entry : {0, 3, 6, 4, 7, 8})
      wrong += std::abs(difference.data()[entry]) > rounding * body.inertia.trace() ? 1 : 0;
  }
  return std::max(wrong, 1);
}

bool Placement::Fails(int item) const { return !(CalcError(item) <= evidence_->Widen(kPlaceRounding)); }

}  // namespace dexcheck
