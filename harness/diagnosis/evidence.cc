#include "harness/diagnosis/evidence.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "harness/descriptions/random_states.h"

namespace dexcheck {
namespace {

constexpr int kProbes = 2;
constexpr int kBlocks = kProbes + 3;  // M times each probe, C xi, gravity, friction

}  // namespace

EngineEvidence::EngineEvidence(const RobotModel& model, const mjModel& engine,
                               const std::string& engine_source, int samples, std::uint64_t seed,
                               double tolerance)
    : tolerance_(tolerance) {
  const Adapter adapter(model, engine, engine_source);
  EngineTerms terms(adapter, Coordinates::kReduced);
  StateSource source(model, {}, seed);
  const int n = terms.size();
  for (int sample = 0; sample < samples; ++sample) {
    StateSample at;
    at.q.setZero(model.num_positions());
    at.xi.setZero(n);
    source.DrawPositions(&at.q);
    source.DrawVelocity(&at.xi);
    terms.SetState(at.q, at.xi);
    const MatrixXd M = terms.M();
    const VectorXd root = M.diagonal().cwiseMax(0.0).cwiseSqrt();
    mass_roots_.push_back(root.unaryExpr([](double x) { return x > 0.0 ? x : 1.0; }));
    at.probes.setZero(n, kProbes);
    for (double& entry : at.probes.reshaped()) entry = source.Draw(-1.0, 1.0);
    at.probes = mass_roots_.back().cwiseInverse().asDiagonal() * at.probes;
    for (int i = 0; i < model.num_joints(); ++i) {
      at.axes.push_back(terms.JointAxis(i));
      at.anchors.push_back(terms.JointAnchor(i));
    }
    for (size_t i = 0; i < model.frames().size(); ++i)
      at.frames.push_back(terms.FramePose(static_cast<int>(i)));
    at.links = terms.links();
    at.forces = CollectForces(M, at, terms.coriolis(), terms.gravity(), terms.friction());
    Vector3d base = model.base().X_B0.translation();
    if (model.num_base_positions() == 3) base.head<2>() += at.q.head<2>();
    if (model.base().type == BaseType::kFloating) base = at.q.head<3>();
    for (const Vector3d& anchor : at.anchors) length_ = std::max(length_, (anchor - base).norm());
    for (const Pose& frame : at.frames) length_ = std::max(length_, (frame.translation() - base).norm());
    samples_.push_back(std::move(at));
  }
  if (!(length_ > 0.0)) length_ = 1.0;
  CalcScales(model);
}

VectorXd EngineEvidence::CollectForces(const MatrixXd& M, const StateSample& at, const VectorXd& coriolis,
                                       const VectorXd& gravity, const VectorXd& friction) {
  const Eigen::Index n = coriolis.size();
  VectorXd forces(kBlocks * n);
  for (int k = 0; k < kProbes; ++k) forces.segment(k * n, n).noalias() = M * at.probes.col(k);
  forces.segment(kProbes * n, n) = coriolis;
  forces.segment((kProbes + 1) * n, n) = gravity;
  forces.segment((kProbes + 2) * n, n) = friction;
  return forces;
}

VectorXd EngineEvidence::CalcRawForces(const RobotModel& variant) const {
  ModelTerms terms(variant, Coordinates::kReduced);
  VectorXd all(engine_forces_.size());
  Eigen::Index row = 0;
  for (const StateSample& at : samples_) {
    terms.SetState(at.q, at.xi);
    terms.CalcDynamics();
    const VectorXd forces =
        CollectForces(terms.M(), at, terms.C() * at.xi, terms.gravity(), terms.friction());
    all.segment(row, forces.size()) = forces;
    row += forces.size();
  }
  return all;
}

void EngineEvidence::CalcScales(const RobotModel& model) {
  const Eigen::Index n = model.num_velocities();
  engine_forces_.resize(static_cast<Eigen::Index>(samples_.size()) * kBlocks * n);
  scale_.resize(engine_forces_.size());
  Eigen::Index row = 0;
  for (size_t sample = 0; sample < samples_.size(); ++sample) {
    engine_forces_.segment(row, kBlocks * n) = samples_[sample].forces;
    for (int block = 0; block < kBlocks; ++block) {
      scale_.segment(row + block * n, n) = mass_roots_[sample].cwiseInverse();
    }
    row += kBlocks * n;
  }
  // Coriolis forces or gravity that vanish but for rounding must not be blown up.
  constexpr double kSmall = 1e-4;
  double mass = 0.0;
  for (const LinkInWorld& link : samples_.front().links) mass += link.mass;
  std::array<double, kBlocks> natural{};
  natural[kProbes + 1] = model.gravity().norm() * std::sqrt(mass);
  for (size_t sample = 0; sample < samples_.size(); ++sample) {
    const VectorXd& xi = samples_[sample].xi;
    const double momentum = mass_roots_[sample].cwiseProduct(xi).cwiseAbs().maxCoeff();
    natural[kProbes] = std::max(natural[kProbes], momentum * xi.cwiseAbs().maxCoeff());
  }
  // Sizes over all samples, of model and engine, so that what one side lacks is measured by the other.
  const VectorXd model_forces = CalcRawForces(model).cwiseProduct(scale_);
  const VectorXd engine_forces = engine_forces_.cwiseProduct(scale_);
  for (Eigen::Index i = 0; i < kBlocks * n; ++i) {
    const Eigen::Index block = i / n;
    const bool own = block == kBlocks - 1;  // friction by each joint's own size
    double size = own ? 0.0 : kSmall * natural[static_cast<size_t>(block)];
    for (Eigen::Index start = 0; start < scale_.size(); start += kBlocks * n) {
      for (const VectorXd* forces : {&model_forces, &engine_forces}) {
        const double here = own ? std::abs((*forces)[start + i])
                                : forces->segment(start + block * n, n).cwiseAbs().maxCoeff();
        size = std::max(size, here);
      }
    }
    if (!(size > 0.0)) continue;
    for (Eigen::Index start = 0; start < scale_.size(); start += kBlocks * n) scale_[start + i] /= size;
  }
  engine_forces_ = engine_forces_.cwiseProduct(scale_);
}

VectorXd EngineEvidence::CalcForces(const RobotModel& variant) const {
  return CalcRawForces(variant).cwiseProduct(scale_);
}

VectorXd EngineEvidence::CalcForceResidual(const RobotModel& variant) const {
  return engine_forces_ - CalcForces(variant);
}

}  // namespace dexcheck
