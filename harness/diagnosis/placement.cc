#include "harness/diagnosis/placement.h"

#include <cmath>

#include "harness/descriptions/random_states.h"

namespace dexcheck {
namespace {

using ItemKind = PlacedItem::Kind;

// Three states tell a wrong place from a right one that is seen along its axis.
constexpr size_t kStateSamples = 3;

// Both sides chain some dozen rotations: 1e-14 of the robot's size. A file's numbers have fewer digits than
// this leaves.
constexpr double kPlaceRounding = 1e-11;

size_t At(int link) { return static_cast<size_t>(link + 1); }

bool IsOfFrame(const Parameter& parameter) {
  return parameter.kind == ParameterKind::kFramePosition || parameter.kind == ParameterKind::kFrameRotation;
}

constexpr int kProbes = 2;
constexpr int kBlocks = kProbes + 3;  // M times each probe, C xi, gravity, friction

VectorXd Stack(const MatrixXd& M, const StateSample& at, const VectorXd& coriolis, const VectorXd& gravity,
               const VectorXd& friction) {
  VectorXd forces(kBlocks * coriolis.size());
  forces << (M * at.probes).reshaped(), coriolis, gravity, friction;
  return forces;
}

/// The engine's links, axes and frames at the state of its terms.
void Read(const RobotModel& model, const EngineTerms& terms, StateSample* at) {
  for (int i = 0; i < model.num_joints(); ++i) {
    at->axes.push_back(terms.JointAxis(i));
    at->anchors.push_back(terms.JointAnchor(i));
  }
  for (size_t i = 0; i < model.frames().size(); ++i)
    at->frames.push_back(terms.FramePose(static_cast<int>(i)));
  at->links = terms.links();
}

double CalcReach(const RobotModel& model, const StateSample& at) {
  Vector3d base = model.base().X_B0.translation();
  if (model.num_base_positions() == 3) base.head<2>() += at.q.head<2>();
  if (model.base().type == BaseType::kFloating) base = at.q.head<3>();
  double reach = 0.0;
  for (const Vector3d& anchor : at.anchors) reach = std::max(reach, (anchor - base).norm());
  for (const Pose& frame : at.frames) reach = std::max(reach, (frame.translation() - base).norm());
  return reach;
}

}  // namespace

EngineEvidence::EngineEvidence(const Adapter& adapter, const DiagnosisOptions& options)
    : tolerance_(options.tolerance) {
  const RobotModel& model = adapter.model();
  EngineTerms terms(adapter, Coordinates::kReduced);
  StateSource source(model, {}, options.seed);
  const int n = terms.size();
  MatrixXd roots(n, options.samples);
  MatrixXd forces(kBlocks * n, options.samples);
  for (int sample = 0; sample < options.samples; ++sample) {
    StateSample& at = samples_.emplace_back();
    at.q.setZero(model.num_positions());
    at.xi.setZero(n);
    source.DrawPositions(&at.q);
    source.DrawVelocity(&at.xi);
    terms.SetState(at.q, at.xi);
    const MatrixXd M = terms.M();
    roots.col(sample) = M.diagonal().unaryExpr([](double m) { return m > 0.0 ? std::sqrt(m) : 1.0; });
    at.probes.setZero(n, kProbes);
    for (double& entry : at.probes.reshaped()) entry = source.Draw(-1.0, 1.0);
    at.probes = roots.col(sample).cwiseInverse().asDiagonal() * at.probes;
    forces.col(sample) = Stack(M, at, terms.coriolis(), terms.gravity(), terms.friction());
    Read(model, terms, &at);
    length_ = std::max(length_, CalcReach(model, at));
  }
  if (!(length_ > 0.0)) length_ = 1.0;
  CalcScales(model, roots, forces);
}

MatrixXd EngineEvidence::CalcRawForces(const RobotModel& variant) const {
  ModelTerms terms(variant, Coordinates::kReduced);
  MatrixXd all(scale_.rows(), scale_.cols());
  for (size_t sample = 0; sample < samples_.size(); ++sample) {
    const StateSample& at = samples_[sample];
    terms.SetState(at.q, at.xi);
    terms.CalcDynamics();
    all.col(static_cast<Eigen::Index>(sample)) =
        Stack(terms.M(), at, terms.C() * at.xi, terms.gravity(), terms.friction());
  }
  return all;
}

void EngineEvidence::CalcScales(const RobotModel& model, const MatrixXd& roots, const MatrixXd& forces) {
  // Sizes over all samples, of model and engine, so that what one side lacks is measured by the other.
  scale_ = roots.cwiseInverse().replicate(kBlocks, 1);
  const MatrixXd sizes = (CalcRawForces(model).cwiseAbs().cwiseMax(forces.cwiseAbs())).cwiseProduct(scale_);
  // Coriolis forces or gravity that vanish but for rounding must not be blown up.
  constexpr double kSmall = 1e-4;
  const Eigen::Index n = roots.rows();
  const double least = kSmall * sizes.topRows((kBlocks - 1) * n).maxCoeff();
  for (Eigen::Index row = 0; row < sizes.rows(); ++row) {
    const Eigen::Index block = row / n;
    const double size = block == kBlocks - 1 ? sizes.row(row).maxCoeff()
                                             : std::max(least, sizes.middleRows(block * n, n).maxCoeff());
    if (size > 0.0) scale_.row(row) /= size;
  }
  engine_forces_ = forces.cwiseProduct(scale_).reshaped();
}

int CarrierOf(const RobotSpec& spec, const Parameter& parameter) {
  return IsOfFrame(parameter) ? spec.frames[static_cast<size_t>(parameter.index)].link : parameter.index;
}

Placement::Placement(const RobotSpec& written, const FileTerms& terms, const EngineEvidence& evidence)
    : base_origin_(written.base.X_B0.translation()), terms_(&terms), evidence_(&evidence) {
  for (int i = 0; i < static_cast<int>(written.joints.size()); ++i) {
    const Joint& joint = written.joints[static_cast<size_t>(i)];
    items_.push_back({ItemKind::kAxisDirection, i, i});
    if (joint.type == JointType::kRevolute) items_.push_back({ItemKind::kAxisLine, i, i});
    if (joint.body.mass > 0.0) items_.push_back({ItemKind::kCom, i, i});
    if (joint.body.inertia.trace() > 0.0) items_.push_back({ItemKind::kInertia, i, i});
  }
  for (size_t i = 0; i < written.frames.size(); ++i) {
    for (const ItemKind kind : {ItemKind::kFramePosition, ItemKind::kFrameRotation})
      items_.push_back({kind, static_cast<int>(i), written.frames[i].link});
  }
  poses_.assign(std::min(kStateSamples, evidence.samples().size()),
                std::vector<Pose>(written.joints.size() + 1, Pose::Identity()));
  Replace(written);
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

void Placement::UpdateFrom(int from) {
  for (size_t sample = 0; sample < poses_.size(); ++sample) {
    const VectorXd& q = evidence_->samples()[sample].q;
    const Eigen::Index first = q.size() - static_cast<Eigen::Index>(trial_.joints.size());
    std::vector<Pose>& poses = poses_[sample];
    if (from < 0) poses[0] = CalcBasePose(q);
    for (int i = std::max(from, 0); i < static_cast<int>(trial_.joints.size()); ++i) {
      if (from >= 0 && !Carries(from, i)) continue;
      const Joint& joint = trial_.joints[static_cast<size_t>(i)];
      poses[At(i)] = poses[At(joint.parent)] * terms_->CalcPlace(joint, i, q[first + i]);
    }
  }
}

void Placement::Set(const Parameter& parameter, double value) {
  SetValue(&trial_, parameter, value);
  if (!IsOfFrame(parameter)) UpdateFrom(parameter.index);
}

void Placement::Replace(const RobotSpec& spec) {
  trial_ = spec;
  UpdateFrom(-1);
}

Placement::Difference Placement::CalcDifference(const PlacedItem& item, size_t sample) const {
  const auto i = static_cast<size_t>(item.index);
  const StateSample& engine = evidence_->samples()[sample];
  const Pose& X = poses_[sample][At(item.link)];
  const double length = evidence_->length();
  switch (item.kind) {
    case ItemKind::kAxisDirection:
      return engine.axes[i] - X.linear() * terms_->AxisFrame(trial_.joints[i], item.index).linear().col(2);
    case ItemKind::kAxisLine: {
      // Where along the axis the anchor stands is a choice of frames.
      const Vector3d apart =
          engine.anchors[i] - X * terms_->AxisFrame(trial_.joints[i], item.index).translation();
      return (apart - engine.axes[i].dot(apart) * engine.axes[i]) / length;
    }
    case ItemKind::kFramePosition:
      return (engine.frames[i].translation() - X * trial_.frames[i].X_LF.translation()) / length;
    case ItemKind::kFrameRotation:
      return engine.frames[i].linear() - X.linear() * trial_.frames[i].X_LF.linear();
    case ItemKind::kCom:
      return (engine.links[i + 1].com - X * trial_.joints[i].body.com) / length;
    case ItemKind::kInertia:
      break;
  }
  const Matrix3d& inertia = trial_.joints[i].body.inertia;
  return (engine.links[i + 1].inertia - X.linear() * inertia * X.linear().transpose()) / inertia.trace();
}

VectorXd Placement::CalcResidual(const std::vector<int>& items) const {
  std::vector<double> rows;
  for (const int item : items) {
    for (size_t sample = 0; sample < poses_.size(); ++sample) {
      const Difference difference = CalcDifference(items_[static_cast<size_t>(item)], sample);
      rows.insert(rows.end(), difference.data(), difference.data() + difference.size());
    }
  }
  return Eigen::Map<const VectorXd>(rows.data(), static_cast<Eigen::Index>(rows.size()));
}

bool Placement::Fails(int item) const {
  for (size_t sample = 0; sample < poses_.size(); ++sample) {
    const Difference difference = CalcDifference(items_[static_cast<size_t>(item)], sample);
    if (!(difference.cwiseAbs().maxCoeff() <= evidence_->Widen(kPlaceRounding))) return true;
  }
  return false;
}

int Placement::CountWrongNumbers(int index) const {
  if (!Fails(index)) return 0;
  const PlacedItem& item = items_[static_cast<size_t>(index)];
  if (!item.IsBody()) return 3;
  const Matrix3d R_LW = poses_[0][At(item.link)].linear().transpose();
  Difference own = R_LW * CalcDifference(item, 0);
  if (item.kind == ItemKind::kInertia) own = Matrix3d(own * R_LW.transpose()).triangularView<Eigen::Lower>();
  return std::max(1, static_cast<int>((own.array().abs() > evidence_->Widen(kPlaceRounding)).count()));
}

bool Placement::IsPlaced(int link) const {
  for (size_t i = 0; i < items_.size(); ++i) {
    const PlacedItem& item = items_[i];
    if (item.IsBody()) continue;
    const bool carried =
        item.IsAxis() ? trial_.joints[static_cast<size_t>(item.index)].parent == link : item.link == link;
    const bool carries = item.IsAxis() && link >= 0 && Carries(item.index, link);
    if ((carried || carries) && Fails(static_cast<int>(i))) return false;
  }
  return true;
}

}  // namespace dexcheck
