#include "harness/recordings/torque_balance.h"

#include <algorithm>
#include <cmath>

#include "controller/common/linear_algebra.h"
#include "harness/recordings/nonlinear_faults.h"

namespace dexcheck {

using Eigen::Index;

double FindCutOff(const Refinements& refinements, int joint, int component, double most) {
  constexpr double kFractions[kCutOffs] = {1.0, 0.8, 0.55};
  const auto known = refinements.limits.find(joint);
  return known != refinements.limits.end() ? known->second : kFractions[component / 2] * most;
}

constexpr double kDisplaced = 1e-6;  // m, rad

/// A joint's fault of geometry, of one of its components.
static NonlinearFault GeometryFault(const RobotModel& model, int joint, int component) {
  using enum NonlinearFault::Number;
  NonlinearFault fault{.number = component < 3   ? kPlacement
                                 : component < 5 ? kOrientation
                                                 : kAxis,
                       .joint = joint};
  if (component < 3) {
    fault.shift[component] = kDisplaced;
  } else {
    fault.turn = kDisplaced * FindDirections(model, joint).col((component - 3) % 2);
  }
  return fault;
}

TorqueBalance::TorqueBalance(const RobotModel& model, const std::vector<int>& joints, bool has_currents,
                             const Refinements& refinements)
    : model_(&model),
      regressor_(model),
      joints_(joints),
      has_currents_(has_currents),
      refinements_(refinements) {
  const Index n = model.num_joints();
  bodies_.resize(n, TorqueRegressor::kBody * n);
  gravity_.resize(n, 3);
  forces_.resize(n, 6);
  shaking_.resize(n, 12);
  along_.resize(n, kAlong * n);
  torques_in_time_.resize(n, 3);
  torques_.resize(n);
  late_.resize(n);
  residual_ = VectorXd::Zero(static_cast<Index>(joints.size()));
  for (int k = 0; k < kGeometries * n && n <= kMostWithGeometry; ++k) {
    RobotSpec spec = model.spec();
    GeometryFault(model, k / kGeometries, k % kGeometries).Undo(&spec);
    Displaced& one = displaced_.emplace_back();
    one.model = std::make_unique<RobotModel>(std::move(spec));
    one.regressor = std::make_unique<TorqueRegressor>(*one.model);
  }
  geometry_.resize(n, static_cast<Index>(displaced_.size()));
  ListColumns(has_currents);
  for (const std::vector<TorqueColumn>& columns : columns_) {
    const auto width = static_cast<Index>(columns.size()) + 1;
    products_.push_back(MatrixXd::Zero(width, width));
    parts_.push_back(MatrixXd::Zero(width, kPart));
  }
  used_.assign(joints_.size(), 0);
  counts_.assign(joints_.size(), 0.0);
}

void TorqueBalance::ListColumns(bool has_currents) {
  for (const int joint : joints_) {
    std::vector<TorqueColumn>& columns = columns_.emplace_back();
    for (int link = 0; link < model_->num_joints(); ++link) {
      const std::vector<int> chain = model_->ListChain(link);
      const bool is_moved = std::find(chain.begin(), chain.end(), joint) != chain.end();
      for (int k = 0; is_moved && k < TorqueRegressor::kBody; ++k)
        columns.push_back({TorqueColumn::kBody, link, k});
    }
    columns.push_back({TorqueColumn::kTorque, joint});
    for (const auto kind : {TorqueColumn::kPosition, TorqueColumn::kBacklash, TorqueColumn::kElastic})
      for (int other = 0; other < model_->num_joints(); ++other) columns.push_back({kind, other});
    for (int other = 0; other < model_->num_joints(); ++other) {
      columns.push_back({TorqueColumn::kLatePosition, other});
      columns.push_back({TorqueColumn::kPositionGain, other});
      for (int k = 0; k < kGeometries && !displaced_.empty(); ++k)
        columns.push_back({TorqueColumn::kGeometry, other, k});
      for (int k = 0; k < kTurns; ++k) columns.push_back({TorqueColumn::kTurn, other, k});
    }
    for (int k = 0; k < 2 * kCutOffs; ++k) columns.push_back({TorqueColumn::kCutOff, joint, k});
    for (int k = 0; k < 3; ++k) columns.push_back({TorqueColumn::kGravity, 0, k});
    if (has_currents) columns.push_back({TorqueColumn::kCurrent, joint});
    for (const auto kind :
         {TorqueColumn::kRate, TorqueColumn::kLate, TorqueColumn::kOffset, TorqueColumn::kDry,
          TorqueColumn::kViscous, TorqueColumn::kSquare, TorqueColumn::kTime, TorqueColumn::kDryTime,
          TorqueColumn::kAcceleration, TorqueColumn::kLoad, TorqueColumn::kAngle})
      columns.push_back({kind, joint});
    for (int k = 0; k < kFrictionShapes; ++k) columns.push_back({TorqueColumn::kFriction, joint, k});
    for (int k = 0; refinements_.shaking > 0.0 && k < shaking_.cols(); ++k)
      columns.push_back({TorqueColumn::kShaking, 0, k});
    std::map<TorqueColumn, Index>& places = places_.emplace_back();
    for (const TorqueColumn& column : columns) places.emplace(column, static_cast<Index>(places.size()));
  }
}

Index TorqueBalance::Find(size_t place, const TorqueColumn& column) const {
  const auto found = places_[place].find(column);
  return found == places_[place].end() ? -1 : found->second;
}

double TorqueBalance::CalcFriction(int joint, const RecordedSample& sample) const {
  const Joint& modelled = model_->joint(joint);
  return modelled.damping * sample.qd[joint] + modelled.dry_friction * sample.direction[joint];
}

double TorqueBalance::CalcCutOff(int joint, int component, const RecordedSample& sample) const {
  const bool is_recorded = component < 2;
  const double torque = is_recorded ? torques_[joint] + CalcFriction(joint, sample) : sample.torque[joint];
  const double limit = FindCutOff(refinements_, joint, component, sample.most_torque[joint]);
  const double beyond = std::abs(torque) - limit;
  if (!(beyond > 0.0)) return 0.0;
  return (is_recorded == torque > 0.0 ? -1.0 : 1.0) * (component % 2 == 0 ? beyond : -limit);
}

double TorqueBalance::CalcEntry(int joint, const TorqueColumn& column, const RecordedSample& sample) const {
  const double direction = sample.direction[joint];
  switch (column.kind) {
    case TorqueColumn::kBody:
      return bodies_(joint, TorqueRegressor::kBody * column.index + column.component);
    case TorqueColumn::kTorque:
      return torques_[joint] + CalcFriction(joint, sample);
    case TorqueColumn::kPosition:
    case TorqueColumn::kElastic:
    case TorqueColumn::kLatePosition:
    case TorqueColumn::kPositionGain:
    case TorqueColumn::kTurn:
      return along_(joint,
                    kAlong * column.index + (column.kind - TorqueColumn::kPosition) + column.component);
    case TorqueColumn::kBacklash:
      return std::copysign(1.0, torques_[column.index]) * along_(joint, kAlong * column.index);
    case TorqueColumn::kGeometry:
      return geometry_(joint, kGeometries * column.index + column.component);
    case TorqueColumn::kCutOff:
      return CalcCutOff(joint, column.component, sample);
    case TorqueColumn::kGravity:
      return gravity_(joint, column.component);
    case TorqueColumn::kRate:
      return sample.torque_rate[joint];
    case TorqueColumn::kLate:
      return late_[joint] - model_->joint(joint).damping * sample.qdd[joint];
    case TorqueColumn::kCurrent:
      return sample.torque[joint];
    case TorqueColumn::kOffset:
      return 1.0;
    case TorqueColumn::kDry:
      return direction;
    case TorqueColumn::kViscous:
      return sample.qd[joint];
    case TorqueColumn::kSquare:
      return sample.qd[joint] * std::abs(sample.qd[joint]);
    case TorqueColumn::kTime:
      return sample.passed;
    case TorqueColumn::kDryTime:
      return direction * sample.passed;
    case TorqueColumn::kAcceleration:
      return sample.qdd[joint];
    case TorqueColumn::kFriction:
      return sample.friction(joint, column.component);
    case TorqueColumn::kAngle:
      return sample.q[joint];
    case TorqueColumn::kShaking:
      return shaking_(joint, column.component);
    case TorqueColumn::kLoad:
      return direction * std::abs(torques_[joint]);
  }
  return 0.0;
}

void TorqueBalance::FillRow(size_t place, const RecordedSample& sample, Eigen::Ref<VectorXd> row) const {
  const int joint = joints_[place];
  for (size_t i = 0; i < columns_[place].size(); ++i)
    row[static_cast<Index>(i)] = CalcEntry(joint, columns_[place][i], sample);
  row[row.size() - 1] =
      (has_currents_ ? 0.0 : sample.torque[joint]) - torques_[joint] - CalcFriction(joint, sample);
}

void TorqueBalance::SetWrenches(const std::vector<WrenchPlace>& places) {
  wrenches_ = places;
  wrench_squares_ = MatrixXd::Zero(residual_.size(), 6 * static_cast<Index>(places.size()));
}

MatrixXd TorqueBalance::CalcWrenchColumns() {
  MatrixXd columns(forces_.rows(), wrench_squares_.cols());
  Index at = 0;
  for (const WrenchPlace& place : wrenches_) {
    const Matrix3d& R = regressor_.GetRotation(place.link);
    const Matrix3d axes = place.is_world ? Matrix3d(Matrix3d::Identity()) : Matrix3d(R * place.R_iL);
    const Vector3d lever =
        R * (place.point - model_->joint(place.link).body.com) - place.below * Vector3d::UnitZ();
    regressor_.CalcForceColumns(place.link, forces_);
    columns.middleCols(at, 6) << (forces_.leftCols<3>() + forces_.rightCols<3>() * Skew(lever)) * axes,
        forces_.rightCols<3>() * axes;
    at += 6;
  }
  return columns;
}

void TorqueBalance::CalcShakingColumns(const RecordedSample& sample) {
  constexpr double kStep = 1e-6;  // rad
  const double w = refinements_.shaking;
  for (int k = 0; k < 3; ++k)
    for (int phase = 0; phase < 2; ++phase) {
      const double value = sample.swing[phase];
      const double rate = phase == 0 ? w * sample.swing[1] : -w * sample.swing[0];
      const Vector3d turn = kStep * Vector3d::Unit(k);
      shaking_.col(2 * k + phase) = w * w * value * gravity_.col(k);
      const Matrix3d R = Eigen::AngleAxisd(kStep * value, Vector3d::Unit(k)).toRotationMatrix();
      regressor_.SetMotion(sample.q, sample.qd, sample.qdd,
                           {R, rate * turn, -w * w * value * turn, Vector3d::Zero()});
      regressor_.CalcTorques(shaking_.col(6 + 2 * k + phase));
    }
  shaking_.rightCols<6>() = (shaking_.rightCols<6>().colwise() - torques_).eval() / kStep;
}

Vector3d TorqueBalance::CalcMotionChange(int joint, int k, const RecordedSample& sample) const {
  const double rate = sample.qd[joint], acceleration = sample.qdd[joint];
  if (k == 0) return Vector3d::UnitX();
  if (k == 1) return torques_in_time_.row(joint).transpose();
  if (k == 2) return {rate, acceleration, sample.jerk[joint]};
  if (k == 3) return {sample.q[joint], rate, acceleration};
  const double turns = k < 6 ? 1.0 : 2.0, angle = turns * sample.q[joint];
  const double e = k % 2 == 0 ? std::sin(angle) : std::cos(angle);
  const double slope = turns * (k % 2 == 0 ? std::cos(angle) : -std::sin(angle));
  return {e, slope * rate, slope * acceleration - turns * turns * e * Square(rate)};
}

void TorqueBalance::CalcMotionColumns(const RecordedSample& sample) {
  constexpr double kStep = 1e-6;
  for (size_t k = 0; k < displaced_.size(); ++k) {
    auto column = geometry_.col(static_cast<Index>(k));
    displaced_[k].regressor->SetMotion(sample.q, sample.qd, sample.qdd, sample.base);
    displaced_[k].regressor->CalcTorques(column);
    column = ((column - torques_) / kDisplaced).eval();
  }
  // The torques and their derivatives by time.
  constexpr double kTime = 1e-3;  // s
  VectorXd q, qd, qdd;
  MatrixXd beside(torques_.size(), 2);
  for (const int k : {0, 1}) {
    const double t = k == 0 ? -kTime : kTime, s = 0.5 * t * t;
    q = sample.q + t * sample.qd + s * sample.qdd;
    qd = sample.qd + t * sample.qdd + s * sample.jerk;
    qdd = sample.qdd + t * sample.jerk + s * sample.snap;
    regressor_.SetMotion(q, qd, qdd, sample.base);
    regressor_.CalcTorques(beside.col(k));
  }
  torques_in_time_ << torques_, (beside.col(1) - beside.col(0)) / (2.0 * kTime),
      (beside.rowwise().sum() - 2.0 * torques_) / Square(kTime);
  q = sample.q, qd = sample.qd, qdd = sample.qdd;
  for (Index joint = 0; joint < q.size(); ++joint)
    for (int k = 0; k < kAlong; ++k) {
      const Vector3d change = CalcMotionChange(static_cast<int>(joint), k, sample);
      q[joint] += kStep * change[0], qd[joint] += kStep * change[1], qdd[joint] += kStep * change[2];
      auto column = along_.col(kAlong * joint + k);
      regressor_.SetMotion(q, qd, qdd, sample.base);
      regressor_.CalcTorques(column);
      column = ((column - torques_) / kStep).eval();
      column[joint] += model_->joint(static_cast<int>(joint)).damping * change[1];
      q[joint] = sample.q[joint], qd[joint] = sample.qd[joint], qdd[joint] = sample.qdd[joint];
    }
}

void TorqueBalance::Add(const RecordedSample& sample, const std::vector<bool>& is_judged) {
  constexpr double kDelay = 1e-6;  // s
  regressor_.SetMotion(sample.q, sample.qd - kDelay * sample.qdd, sample.qdd, sample.base);
  regressor_.CalcTorques(late_);
  regressor_.SetMotion(sample.q, sample.qd, sample.qdd, sample.base);
  regressor_.CalcTorques(torques_);
  late_ = (late_ - torques_) / kDelay;
  CalcMotionColumns(sample);
  regressor_.SetMotion(sample.q, sample.qd, sample.qdd, sample.base);
  regressor_.CalcGravityColumns(gravity_);
  if (refinements_.shaking > 0.0) CalcShakingColumns(sample);
  BaseMotion turned = sample.base;
  turned.a -= refinements_.gravity;
  regressor_.SetMotion(sample.q, sample.qd, sample.qdd, turned);
  regressor_.CalcBodyColumns(bodies_);
  regressor_.SetMotion(sample.q, sample.qd, sample.qdd, sample.base);
  if (!wrenches_.empty()) {
    const MatrixXd columns = CalcWrenchColumns();
    torques_ += columns * sample.wrench;
    wrench_squares_ += columns(joints_, Eigen::all).cwiseAbs2();
  }

  if (blocks_.empty() || blocks_.back().samples >= block_samples_) {
    if (blocks_.size() == kMostBlocks) MergeBlocks();
    Block& block = blocks_.emplace_back();
    block.from = sample.time;
    for (const MatrixXd& products : products_) block.sums.push_back(VectorXd::Zero(products.rows()));
    block.counts.assign(joints_.size(), 0.0);
    block.forces = MatrixXd::Zero(static_cast<Index>(joints_.size()), 6 * model_->num_joints());
    block.gravity = MatrixXd::Zero(static_cast<Index>(joints_.size()), 3);
    block.q = VectorXd::Zero(model_->num_joints());
  }
  Block& block = blocks_.back();
  block.to = sample.time;
  block.samples += 1.0;
  block.q += sample.q;
  block.gravity += gravity_(joints_, Eigen::all);
  for (int link = 0; link < model_->num_joints(); ++link) {
    regressor_.CalcForceColumns(link, forces_);
    for (size_t place = 0; place < joints_.size(); ++place)
      block.forces.block<1, 6>(static_cast<Index>(place), 6 * link) += forces_.row(joints_[place]);
  }
  residual_.setZero();
  for (size_t place = 0; place < joints_.size(); ++place) {
    const int joint = joints_[place];
    auto row = parts_[place].col(used_[place]);
    FillRow(place, sample, row);
    const double residual = row[row.size() - 1];
    // A joint that friction holds, whichever way: more than friction can do is judged. A smaller part of the
    // largest torque would show more pushes, but then friction is noise beside a wrong mass, which gets no
    // name.
    constexpr double kFrictions = 2.0, kMuch = 0.1;
    const double friction = model_->joint(joint).dry_friction;
    const double held = residual + friction * sample.direction[joint];
    const bool is_more = friction > 0.0 && !has_currents_ && sample.beyond[joint] == 0.0 &&
                         std::abs(held) > std::max(kFrictions * friction, kMuch * sample.most_torque[joint]);
    if (!is_judged[static_cast<size_t>(joint)] && !is_more) continue;
    residual_[static_cast<Index>(place)] = residual;
    block.sums[place] += row;
    block.counts[place] += 1.0;
    counts_[place] += 1.0;
    if (++used_[place] == kPart) Flush(place);
  }
}

void TorqueBalance::Flush(size_t place) {
  if (used_[place] == 0) return;
  products_[place].selfadjointView<Eigen::Lower>().rankUpdate(parts_[place].leftCols(used_[place]));
  used_[place] = 0;
}

void TorqueBalance::Finish() {
  for (size_t place = 0; place < joints_.size(); ++place) {
    Flush(place);
    products_[place].triangularView<Eigen::StrictlyUpper>() = products_[place].transpose();
    rows_.push_back(CalcRows(place));
  }
}

void TorqueBalance::MergeBlocks() {
  std::vector<Block> merged;
  for (size_t i = 0; i < blocks_.size(); i += 2) {
    Block& block = merged.emplace_back(std::move(blocks_[i]));
    if (i + 1 == blocks_.size()) break;
    const Block& next = blocks_[i + 1];
    block.to = next.to;
    block.forces += next.forces;
    block.gravity += next.gravity;
    block.q += next.q;
    block.samples += next.samples;
    for (size_t place = 0; place < joints_.size(); ++place) {
      block.sums[place] += next.sums[place];
      block.counts[place] += next.counts[place];
    }
  }
  blocks_ = std::move(merged);
  block_samples_ *= 2.0;
}

MatrixXd TorqueBalance::CalcRows(size_t place) const {
  MatrixXd within = products_[place];
  MatrixXd of_blocks = MatrixXd::Zero(static_cast<Index>(blocks_.size()), within.cols());
  for (size_t b = 0; b < blocks_.size(); ++b) {
    if (!(blocks_[b].counts[place] > 0.0)) continue;
    of_blocks.row(static_cast<Index>(b)) =
        blocks_[b].sums[place].transpose() / std::sqrt(blocks_[b].counts[place]);
  }
  within -= of_blocks.transpose() * of_blocks;
  // A factor of what may be singular, with columns of one size.
  const VectorXd size =
      products_[place].diagonal().cwiseSqrt().unaryExpr([](double s) { return s > 0.0 ? s : 1.0; });
  const SymmetricEigen eigen =
      DecomposeSymmetric(size.cwiseInverse().asDiagonal() * within * size.cwiseInverse().asDiagonal());
  MatrixXd rows(within.rows() + of_blocks.rows(), within.cols());
  rows.topRows(within.rows()) =
      eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal() * eigen.vectors.transpose() * size.asDiagonal();
  rows.bottomRows(of_blocks.rows()) = of_blocks;
  return rows;
}

}  // namespace dexcheck
