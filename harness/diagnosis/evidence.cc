#include "harness/diagnosis/evidence.h"

#include <cmath>

#include "harness/descriptions/random_states.h"

namespace dexcheck {
namespace {

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

}  // namespace dexcheck
