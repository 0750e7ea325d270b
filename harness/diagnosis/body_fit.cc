#include "harness/diagnosis/body_fit.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

using Kind = ParameterKind;

// Residuals are relative to their own sizes. Rounding leaves some 1e-12 of a finger's forces.
constexpr double kFitRounding = 1e-10;
constexpr int kMaxNumbers = 24;
constexpr size_t kRanked = 5;

size_t SlotOf(int link) { return static_cast<size_t>(link + 1); }

double Positive(double size) { return size > 0.0 ? size : 1.0; }

const MassProperties& BodyOf(const RobotSpec& spec, int link) {
  return link < 0 ? spec.base.body : spec.joints[static_cast<size_t>(link)].body;
}

/// Step of the difference quotient: any for what the rows are linear in, small for centres of mass.
double CalcColumnStep(const RobotSpec& spec, const Parameter& parameter) {
  constexpr double kLinear = 1e-3;
  constexpr double kQuadratic = 1e-6;  // m
  if (parameter.kind == Kind::kCom) return kQuadratic;
  if (parameter.kind == Kind::kInertia)
    return kLinear * Positive(BodyOf(spec, parameter.index).inertia.trace());
  return kLinear * GetScale(spec, parameter);
}

/// `spec` with the pads added to every link's principal moments, every armature and every damping.
RobotSpec Add(RobotSpec spec, const BodyPads& pads) {
  for (size_t i = 0; i < spec.joints.size(); ++i) {
    Joint& joint = spec.joints[i];
    joint.body.inertia += pads.inertia[i + 1] * Matrix3d::Identity();
    joint.armature += pads.armature[i];
    joint.damping += pads.damping[i];
  }
  spec.base.body.inertia += pads.inertia[0] * Matrix3d::Identity();
  return spec;
}

/// Places of the largest entries, the largest first.
std::vector<Eigen::Index> BestOf(const VectorXd& score, size_t wanted) {
  std::vector<Eigen::Index> order(static_cast<size_t>(score.size()));
  std::iota(order.begin(), order.end(), 0);
  wanted = std::min(wanted, order.size());
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(wanted), order.end(),
                    [&](Eigen::Index a, Eigen::Index b) { return score[a] > score[b]; });
  order.resize(wanted);
  return order;
}

/// Vectors and tensors whose entries are one thing to a reader.
bool AreOneThing(const Parameter& a, const Parameter& b) { return a.kind == b.kind && a.index == b.index; }

}  // namespace

BodyFit::BodyFit(const RobotSpec& spec, const EngineEvidence& evidence) : spec_(spec), evidence_(&evidence) {
  const RobotModel model(spec_);
  target_ = evidence_->CalcForces(model) + evidence_->CalcForceResidual(model);
  candidates_ = ListCandidates();
  MakePads();
}

std::vector<Parameter> BodyFit::ListCandidates() const {
  std::vector<Parameter> candidates;
  for (const Parameter& parameter : ListParameters(spec_)) {
    if (!IsDynamic(parameter.kind)) continue;
    const bool needs_mass = parameter.kind == Kind::kCom || parameter.kind == Kind::kInertia;
    if (!needs_mass || BodyOf(spec_, parameter.index).mass > 0.0) candidates.push_back(parameter);
  }
  return candidates;
}

void BodyFit::MakePads() {
  const StateSample& at = evidence_->samples().front();
  const size_t joints = spec_.joints.size();
  for (int link = -1; link < static_cast<int>(joints); ++link) {
    const MassProperties& body = BodyOf(spec_, link);
    pads_.inertia.push_back(body.mass > 0.0 ? body.inertia.trace() + at.links[SlotOf(link)].inertia.trace()
                                            : 0.0);
  }
  for (const Joint& joint : spec_.joints) {
    pads_.armature.push_back(joint.armature + joint.body.inertia.trace());
    pads_.damping.push_back(joint.damping + 1.0);
  }
  pad_rows_ = evidence_->CalcForces(RobotModel(Add(spec_, pads_))) - evidence_->CalcForces(RobotModel(spec_));
}

VectorXd BodyFit::CalcResidual(const RobotSpec& spec) const {
  const std::optional<RobotModel> model = TryModel(Add(spec, pads_));
  if (!model) return VectorXd::Constant(target_.size(), std::numeric_limits<double>::infinity());
  return target_ - (evidence_->CalcForces(*model) - pad_rows_);
}

MatrixXd BodyFit::CalcColumns(const RobotSpec& spec, const std::vector<Parameter>& parameters) const {
  RobotSpec trial = Add(spec, pads_);
  MatrixXd columns = MatrixXd::Zero(target_.size(), static_cast<Eigen::Index>(parameters.size()));
  const std::optional<RobotModel> here = TryModel(trial);
  if (!here) return columns;
  const VectorXd rows = evidence_->CalcForces(*here);
  for (size_t i = 0; i < parameters.size(); ++i) {
    const double value = GetValue(trial, parameters[i]);
    const double step = CalcColumnStep(spec, parameters[i]);
    SetValue(&trial, parameters[i], value + step);
    const std::optional<RobotModel> there = TryModel(trial);
    if (there) columns.col(static_cast<Eigen::Index>(i)) = (evidence_->CalcForces(*there) - rows) / step;
    SetValue(&trial, parameters[i], value);
  }
  return columns;
}

BodyFit::Solution BodyFit::Solve(const std::vector<Parameter>& parameters) const {
  constexpr int kMaxIterations = 8;
  constexpr double kConverged = 1e-13;
  Solution solution;
  solution.parameters = parameters;
  solution.repaired = spec_;
  VectorXd residual = residual_;
  const auto count = static_cast<Eigen::Index>(parameters.size());
  VectorXd scale(count);
  for (Eigen::Index i = 0; i < count; ++i) scale[i] = GetScale(spec_, parameters[static_cast<size_t>(i)]);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const MatrixXd columns = CalcColumns(solution.repaired, parameters) * scale.asDiagonal();
    const VectorXd step = columns.completeOrthogonalDecomposition().solve(residual);
    RobotSpec next = solution.repaired;
    for (Eigen::Index i = 0; i < count; ++i) {
      const Parameter& parameter = parameters[static_cast<size_t>(i)];
      const double value = GetValue(next, parameter) + step[i] * scale[i];
      constexpr double kNothing = 1e-9;  // what should be zero must not become a negative mass
      SetValue(&next, parameter, std::abs(value) < kNothing * scale[i] ? 0.0 : value);
    }
    const VectorXd after = CalcResidual(next);
    if (!(after.squaredNorm() <= residual.squaredNorm())) break;
    solution.repaired = std::move(next);
    residual = after;
    if (step.cwiseAbs().maxCoeff() < kConverged) break;
  }
  solution.worst = residual.cwiseAbs().maxCoeff();
  solution.squared = residual.squaredNorm();
  return solution;
}

VectorXd BodyFit::CalcGains(const VectorXd& residual, const VectorXd* first) const {
  VectorXd products = columns_.transpose() * residual;
  const VectorXd norms_squared = columns_.colwise().squaredNorm().transpose();
  VectorXd squares = norms_squared;
  if (first != nullptr) squares -= (columns_.transpose() * *first).cwiseAbs2();
  for (Eigen::Index i = 0; i < products.size(); ++i) {
    constexpr double kDependent = 1e-10;
    products[i] = squares[i] > kDependent * norms_squared[i] ? products[i] * products[i] / squares[i] : 0.0;
  }
  return products;
}

bool BodyFit::Linearise() {
  residual_ = CalcResidual(spec_);
  if (!(residual_.cwiseAbs().maxCoeff() > evidence_->Widen(kFitRounding))) return false;
  columns_ = CalcColumns(spec_, candidates_);
  for (size_t i = 0; i < candidates_.size(); ++i)
    columns_.col(static_cast<Eigen::Index>(i)) *= GetScale(spec_, candidates_[i]);
  return true;
}

void BodyFit::Rank() {
  if (!Linearise()) return;
  const VectorXd gains = CalcGains(residual_, nullptr);
  for (const Eigen::Index i : BestOf(gains, kRanked)) {
    if (!(gains[i] > 0.0)) break;
    Repair cause;
    cause.parameters = {candidates_[static_cast<size_t>(i)]};
    cause.values = {GetValue(spec_, cause.parameters.front())};
    ranking_.emplace_back(cause, gains[i] / residual_.squaredNorm());
  }
}

bool BodyFit::FindSolution(std::vector<Solution>* solutions) {
  const VectorXd norms = columns_.colwise().norm().transpose();
  const auto keep_solved = [&](const std::vector<std::vector<Parameter>>& sets) {
    for (const std::vector<Parameter>& set : sets) {
      Solution solution = Solve(set);
      DropUnchanged(&solution);
      if (solution.worst <= evidence_->Widen(kFitRounding)) solutions->push_back(std::move(solution));
    }
    return !solutions->empty();
  };
  constexpr size_t kSingles = 8;
  constexpr size_t kFirsts = 24;
  constexpr size_t kPairs = 8;
  const VectorXd single = CalcGains(residual_, nullptr);
  std::vector<std::vector<Parameter>> sets;
  for (const Eigen::Index i : BestOf(single, kSingles)) {
    const Parameter& parameter = candidates_[static_cast<size_t>(i)];
    sets.push_back({parameter});
  }
  if (keep_solved(sets)) return true;

  struct Pair {
    Eigen::Index first, second;
    double gain;
  };
  std::vector<Pair> pairs;
  for (const Eigen::Index i : BestOf(single, kFirsts)) {
    if (!(norms[i] > 0.0)) continue;
    const VectorXd direction = columns_.col(i) / norms[i];
    const VectorXd rest = residual_ - direction.dot(residual_) * direction;
    const VectorXd more = CalcGains(rest, &direction);
    for (const Eigen::Index j : BestOf(more, 2)) pairs.push_back({i, j, single[i] + more[j]});
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.gain > b.gain; });
  sets.clear();
  for (const Pair& pair : pairs) {
    if (sets.size() == kPairs) break;
    sets.push_back(
        {candidates_[static_cast<size_t>(pair.first)], candidates_[static_cast<size_t>(pair.second)]});
  }
  return keep_solved(sets);  // otherwise whole vectors and tensors, by Grow
}

BodyFit::Solution BodyFit::Grow() const {
  // Orthogonal matching pursuit, each step solved exactly.
  Solution solution;
  solution.repaired = spec_;
  solution.worst = residual_.cwiseAbs().maxCoeff();
  solution.squared = residual_.squaredNorm();
  std::vector<Parameter> chosen;
  while (chosen.size() < kMaxNumbers && solution.worst > evidence_->Widen(kFitRounding)) {
    const VectorXd residual = CalcResidual(solution.repaired);
    VectorXd gains = (columns_.transpose() * residual).cwiseAbs2();
    for (Eigen::Index i = 0; i < gains.size(); ++i) {
      const double square = columns_.col(i).squaredNorm();
      const bool taken =
          std::find(chosen.begin(), chosen.end(), candidates_[static_cast<size_t>(i)]) != chosen.end();
      gains[i] = square > 0.0 && !taken ? gains[i] / square : 0.0;
    }
    Eigen::Index best = 0;
    if (!(gains.maxCoeff(&best) > 0.0)) break;
    // A vector or tensor at once: half a tensor repaired may be no tensor.
    for (const Parameter& parameter : candidates_) {
      if (AreOneThing(parameter, candidates_[static_cast<size_t>(best)])) chosen.push_back(parameter);
    }
    Solution next = Solve(chosen);
    if (!(next.squared < solution.squared)) break;
    solution = std::move(next);
  }
  DropUnchanged(&solution);
  return solution;
}

void BodyFit::DropUnchanged(Solution* solution) const {
  const double few = evidence_->Widen(1e-9);
  std::erase_if(solution->parameters, [&](const Parameter& parameter) {
    const double change = GetValue(solution->repaired, parameter) - GetValue(spec_, parameter);
    const double size = parameter.kind == Kind::kInertia ? BodyOf(spec_, parameter.index).inertia.trace()
                                                         : GetScale(spec_, parameter);
    const bool unchanged = std::abs(change) <= few * size;
    if (unchanged) SetValue(&solution->repaired, parameter, GetValue(spec_, parameter));
    return unchanged;
  });
}

double BodyFit::Read(const Solution& solution, const Parameter& parameter) const {
  return RoundWithin(spec_, parameter, GetValue(solution.repaired, parameter), evidence_->CalcSolvedDigits());
}

Repair BodyFit::ToCause(const Solution& solution) const {
  Repair cause;
  cause.parameters = solution.parameters;
  for (const Parameter& parameter : solution.parameters) cause.values.push_back(Read(solution, parameter));
  return cause;
}

void BodyFit::MergeScaledBodies(std::vector<Repair>* causes) const {
  const double same = evidence_->Widen(1e-8);
  for (size_t i = 0; i < causes->size(); ++i) {
    const Parameter mass = (*causes)[i].parameters.front();
    if (mass.kind != Kind::kMass || !(GetValue(spec_, mass) > 0.0)) continue;
    const auto inertia = std::find_if(causes->begin(), causes->end(), [&](const Repair& cause) {
      return cause.parameters.front().kind == Kind::kInertia && cause.parameters.front().index == mass.index;
    });
    if (inertia == causes->end()) continue;
    const double ratio = (*causes)[i].values.front() / GetValue(spec_, mass);
    RobotSpec scaled = spec_;
    Apply(*inertia, &scaled);
    const Matrix3d expected = ratio * BodyOf(spec_, mass.index).inertia;
    if ((BodyOf(scaled, mass.index).inertia - expected).norm() > same * expected.norm()) continue;
    Repair& whole = (*causes)[i];
    whole.parameters.insert(whole.parameters.end(), inertia->parameters.begin(), inertia->parameters.end());
    whole.values.insert(whole.values.end(), inertia->values.begin(), inertia->values.end());
    const bool before = static_cast<size_t>(inertia - causes->begin()) < i;
    causes->erase(inertia);
    if (before) --i;
  }
}

std::vector<Repair> BodyFit::Run() {
  Rank();
  if (columns_.size() == 0) return {};

  std::vector<Solution> solutions;
  if (!FindSolution(&solutions)) solutions = {Grow()};
  std::vector<Repair> whole;
  whole.reserve(solutions.size());
  for (const Solution& solution : solutions) whole.push_back(ToCause(solution));
  std::vector<size_t> order(whole.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return IsLikelier(whole[a], whole[b], spec_); });
  const Solution& chosen = solutions[order.front()];
  if (!(chosen.worst <= evidence_->Widen(kFitRounding))) return {};

  // One cause for each thing that is changed.
  std::vector<Repair> causes;
  for (size_t i = 0; i < chosen.parameters.size(); ++i) {
    const Parameter& parameter = chosen.parameters[i];
    const auto same = std::find_if(causes.begin(), causes.end(), [&](const Repair& cause) {
      return AreOneThing(cause.parameters.front(), parameter);
    });
    Repair& cause = same == causes.end() ? causes.emplace_back() : *same;
    cause.parameters.push_back(parameter);
    cause.values.push_back(Read(chosen, parameter));
  }
  MergeScaledBodies(&causes);
  if (causes.size() == 1) {
    for (size_t i = 1; i < order.size(); ++i) causes.front().equivalents.push_back(whole[order[i]]);
  }
  return causes;
}

}  // namespace dexcheck
