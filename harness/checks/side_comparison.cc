#include "harness/checks/side_comparison.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "controller/common/errors.h"
#include "harness/checks/rounding_scales.h"
#include "harness/checks/term_table.h"
#include "harness/descriptions/random_states.h"

namespace dexcheck {
namespace {

/// What the table calls the terms; the bias has the bound of its largest part.
constexpr const char* kNames[] = {"M_bar",    "C_bar_xi",       "gravity",         "bias",
                                  "friction", "kinetic_energy", "potential_energy"};
constexpr const char* kBounds[] = {"M_bar",    "C_bar_xi",       "gravity",         "C_bar_xi",
                                   "friction", "kinetic_energy", "potential_energy"};

}  // namespace

SideComparison::SideComparison(const RobotDescription& robot, std::vector<TermSide*> sides)
    : robot_(robot),
      sides_(std::move(sides)),
      model_(robot.spec),
      terms_(model_),
      scales_(model_),
      base_(model_.num_base_velocities()),
      first_potential_(sides_.size()) {
  for (const TermSide* side : sides_) is_reduced_ = is_reduced_ || side->is_reduced();
  const int n = model_.num_velocities();
  T_ = MatrixXd::Identity(n, n);
  if (is_reduced_) {
    const MatrixXd joints = CalcCouplingMap(robot);
    T_ = MatrixXd::Zero(n, base_ + joints.cols());
    T_.topLeftCorner(base_, base_).setIdentity();
    T_.bottomRightCorner(joints.rows(), joints.cols()) = joints;
  }
  for (size_t a = 0; a < sides_.size(); ++a) {
    for (size_t b = a + 1; b < sides_.size(); ++b) {
      Pair pair{a, b, {}};
      for (int term = 0; term < kTermCount; ++term) {
        CheckRecord& record = pair.records.emplace_back();
        record.name = kNames[term];
        record.bound = CalcBound(FindTerm(kBounds[term]), model_.max_depth());
      }
      pairs_.push_back(std::move(pair));
    }
  }
}

int SideComparison::CoordinateOf(Eigen::Index entry) const {
  // The column's leader is the only joint of it that follows none.
  for (Eigen::Index row = 0; row < T_.rows(); ++row) {
    const bool is_free =
        row < base_ || !is_reduced_ ||
        !model_.joints()[static_cast<size_t>(model_.joint_of_dof(static_cast<int>(row) - base_))].coupling;
    if (is_free && T_(row, entry) != 0.0) return static_cast<int>(row);
  }
  return static_cast<int>(entry);
}

void SideComparison::Follow(VectorXd* q, VectorXd* xi) const {
  if (!is_reduced_) return;
  for (size_t i = 0; i < robot_.spec.joints.size(); ++i) {
    const std::optional<JointCoupling>& coupling = robot_.spec.joints[i].coupling;
    if (!coupling) continue;
    const auto own = static_cast<int>(i);
    (*q)[model_.position_index(own)] =
        coupling->multiplier * (*q)[model_.position_index(coupling->leader)] + coupling->offset;
    (*xi)[base_ + model_.dof(own)] = coupling->multiplier * (*xi)[base_ + model_.dof(coupling->leader)];
  }
}

void SideComparison::ReduceTerms(const TermSide& side, SideTerms* terms) const {
  if (!is_reduced_ || side.is_reduced()) return;
  // T is constant: T^T M T, and T^T of the forces.
  if (terms->M.size() > 0) terms->M = (T_.transpose() * terms->M * T_).eval();
  for (VectorXd* force : {&terms->coriolis, &terms->gravity, &terms->bias, &terms->friction}) {
    if (force->size() > 0) *force = (T_.transpose() * *force).eval();
  }
}

void SideComparison::SetScales(const VectorXd& q, const VectorXd& xi) {
  terms_.SetState(q, xi);
  scales_.SetState(terms_, q, xi);
  const int n = model_.num_velocities();
  MatrixXd mass(n, n);
  VectorXd coriolis(n);
  VectorXd gravity(n);
  VectorXd friction(n);
  for (int col = 0; col < n; ++col) {
    for (int row = 0; row < n; ++row) mass(row, col) = scales_.CalcMassScale(row, col);
    coriolis[col] = scales_.CalcCoriolisScale(col);
    gravity[col] = scales_.CalcGravityScale(col);
    friction[col] = scales_.CalcFrictionScale(col, xi);
  }
  const MatrixXd T = T_.cwiseAbs();
  mass_scale_ = T.transpose() * mass * T;
  coriolis_scale_ = T.transpose() * coriolis;
  gravity_scale_ = T.transpose() * gravity;
  friction_scale_ = T.transpose() * friction;
}

void SideComparison::ComparePair(const SideTerms& a, const SideTerms& b, double sample, Pair* pair) {
  std::vector<CheckRecord>& records = pair->records;
  const auto compare_forces = [&](Term term, const VectorXd& own, const VectorXd& other,
                                  const VectorXd& scale) {
    if (own.size() == 0 || other.size() == 0) return;
    for (Eigen::Index i = 0; i < own.size(); ++i) {
      records[term].Compare(own[i], other[i], Positive(scale[i]),
                            {Location::Kind::kVelocity, CoordinateOf(i), -1}, sample);
    }
  };
  if (a.M.size() > 0 && b.M.size() > 0) {
    for (Eigen::Index col = 0; col < a.M.cols(); ++col) {
      for (Eigen::Index row = 0; row < a.M.rows(); ++row) {
        records[kMass].Compare(a.M(row, col), b.M(row, col), Positive(mass_scale_(row, col)),
                               {Location::Kind::kVelocityPair, CoordinateOf(row), CoordinateOf(col)}, sample);
      }
    }
  }
  compare_forces(kCoriolis, a.coriolis, b.coriolis, coriolis_scale_);
  compare_forces(kGravity, a.gravity, b.gravity, gravity_scale_);
  compare_forces(kBias, a.bias, b.bias, coriolis_scale_ + gravity_scale_);
  compare_forces(kFriction, a.friction, b.friction, friction_scale_);
  if (a.kinetic && b.kinetic) {
    records[kKinetic].Compare(*a.kinetic, *b.kinetic, scales_.CalcKineticEnergyScale(), {}, sample);
  }
  if (a.potential && b.potential) {
    // From the first state on: the level of zero is each side's own.
    const double scale = 2.0 * scales_.CalcPotentialEnergyScale();
    records[kPotential].Compare(*a.potential - *first_potential_[pair->first],
                                *b.potential - *first_potential_[pair->second], scale, {}, sample);
  }
}

void SideComparison::Compare(const VectorXd& q, const VectorXd& xi, long sample) {
  SetScales(q, xi);
  std::vector<SideTerms> all;
  for (size_t i = 0; i < sides_.size(); ++i) {
    all.push_back(sides_[i]->Evaluate(sample, q, xi));
    ReduceTerms(*sides_[i], &all.back());
    if (!first_potential_[i]) first_potential_[i] = all.back().potential;
  }
  for (Pair& pair : pairs_) {
    ComparePair(all[pair.first], all[pair.second], static_cast<double>(sample), &pair);
  }
}

std::vector<ComparedPair> SideComparison::TakePairs() const {
  std::vector<ComparedPair> pairs;
  for (const Pair& pair : pairs_) {
    ComparedPair taken{pair.first, pair.second, {}};
    for (const CheckRecord& record : pair.records) {
      if (record.comparisons > 0) taken.terms.push_back(record);
    }
    pairs.push_back(std::move(taken));
  }
  return pairs;
}

std::vector<std::string> SideComparison::ListUnanswered() const {
  std::vector<std::string> names;
  for (size_t term = 0; term < kTermCount; ++term) {
    if (std::all_of(pairs_.begin(), pairs_.end(),
                    [&](const Pair& pair) { return pair.records[term].comparisons == 0; }))
      names.emplace_back(kNames[term]);
  }
  return names;
}

StateFeed FeedRandomStates(const RobotModel& model, const ConsistencyOptions& options) {
  const auto source = std::make_shared<StateSource>(model, options.range, options.seed);
  return [source, samples = options.samples](long sample, VectorXd* q, VectorXd* xi) {
    if (sample >= samples) return false;
    source->DrawPositions(q);
    source->DrawVelocity(xi);
    return true;
  };
}

long CompareAtStates(const StateFeed& feed, const std::function<bool(long)>& progress,
                     SideComparison* comparison) {
  VectorXd q = VectorXd::Zero(comparison->model().num_positions());
  VectorXd xi = VectorXd::Zero(comparison->model().num_velocities());
  long samples = 0;
  bool go_on = true;
  while (go_on && feed(samples, &q, &xi)) {
    comparison->Follow(&q, &xi);
    comparison->Compare(q, xi, samples++);
    go_on = progress(samples);
  }
  return samples;
}

std::optional<BaseConvention> FindOtherConvention(const RobotDescription& robot, TermSide* reference,
                                                  TermSide* side, const BaseConvention& spoken,
                                                  const std::function<void(const BaseConvention&)>& set,
                                                  const std::function<StateFeed()>& make_feed) {
  constexpr long kStates = 3;
  std::optional<BaseConvention> found;
  for (const BaseConvention& convention : ListBaseConventions()) {
    if (convention == spoken || found) continue;
    set(convention);
    try {
      SideComparison comparison(robot, {reference, side});
      CompareAtStates(
          make_feed(), [](long samples) { return samples < kStates; }, &comparison);
      const std::vector<CheckRecord> terms = comparison.TakePairs().front().terms;
      const bool agrees = !terms.empty() && std::none_of(terms.begin(), terms.end(),
                                                         [](const CheckRecord& r) { return r.failed; });
      if (agrees) found = convention;
    } catch (const Error&) {
      break;  // a program may not bear what it did not ask for
    }
  }
  set(spoken);
  return found;
}

}  // namespace dexcheck
