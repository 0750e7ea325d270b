#include "harness/recordings/torque_rows.h"

#include <algorithm>
#include <cmath>

namespace dexcheck {

using Eigen::Index;

Index CountForced(const RecordingSet& recordings) {
  return recordings.has_currents() ? static_cast<Index>(recordings.joints().size()) : 0;
}

Index CountColumns(const TorqueFault& fault) {
  if (fault.kind == TorqueFault::kPush) return fault.scale.size();
  return static_cast<Index>(fault.sums.size());
}

Eigen::SparseMatrix<double> MapColumns(const TorqueBalance& balance, size_t place, size_t recording,
                                       const std::vector<TorqueFault>& faults) {
  const int joint = balance.joints()[place];
  std::vector<Eigen::Triplet<double>> entries;
  Index at = 0;
  for (const TorqueFault& fault : faults) {
    for (size_t k = 0; k < fault.sums.size(); ++k)
      for (const ColumnPart& one : fault.sums[k]) {
        const bool is_here = (one.recording < 0 || static_cast<size_t>(one.recording) == recording) &&
                             (one.joint < 0 || one.joint == joint);
        const Index column = is_here ? balance.Find(place, one.column) : -1;
        if (column >= 0) entries.emplace_back(column, at + static_cast<Index>(k), one.factor);
      }
    at += CountColumns(fault);
  }
  Eigen::SparseMatrix<double> map(static_cast<Index>(balance.columns(place).size()) + 1, at);
  map.setFromTriplets(entries.begin(), entries.end());
  return map;
}

namespace {

using Entries = std::vector<Eigen::Triplet<double>>;

/// The value at its centre of a polynomial of order four over [-1, 1] that is fitted to a step at 0.
double SmoothStep(double u) {
  if (std::abs(u) >= 1.0) return u > 0.0 ? 1.0 : 0.0;
  const double s = u * u;
  return 0.5 + 15.0 / 128.0 * u * (15.0 - 70.0 / 3.0 * s + 63.0 / 5.0 * s * s);
}

void AddPush(const RecordingSet& recordings, const Push& push, const TorqueRows::Part& part, Index at,
             Entries* entries) {
  if (static_cast<size_t>(push.recording) != part.recording) return;
  for (size_t b = 0; b < part.balance->blocks().size(); ++b) {
    const double share = CalcShare(push, part.balance->blocks()[b]);
    if (share == 0.0) continue;
    const Eigen::RowVectorXd columns = share * CalcPushColumns(recordings, push, part, b);
    for (Index k = 0; k < columns.size(); ++k)
      if (columns[k] != 0.0) entries->emplace_back(part.within + static_cast<Index>(b), at + k, columns[k]);
  }
}

/// y and what is part of every explanation.
void AddForced(const RecordingSet& recordings, const TorqueRows::Part& part, Index y, Entries* entries) {
  entries->emplace_back(part.map.rows() - 1, y, 1.0);
  if (!recordings.has_currents()) return;
  // k i = (1 + a) tau + ...: how much the gain is off is part of every explanation.
  const int joint = recordings.joints()[part.place];
  const Index current = part.balance->Find(part.place, {TorqueColumn::kCurrent, joint});
  const Index torque = part.balance->Find(part.place, {TorqueColumn::kTorque, joint});
  entries->emplace_back(current, y, recordings.gain(part.place));
  entries->emplace_back(torque, static_cast<Index>(part.place), 1.0);
}

void FillPart(const RecordingSet& recordings, const std::vector<TorqueFault>& faults, Index columns,
              TorqueRows::Part* part) {
  const Index forced = CountForced(recordings);
  const double weight = recordings[part->recording].weight[static_cast<Index>(part->place)];
  const Eigen::SparseMatrix<double> map = MapColumns(*part->balance, part->place, part->recording, faults);
  part->map.resize(map.rows(), columns);
  Entries entries, pushes;
  AddForced(recordings, *part, columns - 1, &entries);
  // Rates are those of what was measured, which may be a current.
  const int joint = recordings.joints()[part->place];
  const Index rate = part->balance->Find(part->place, {TorqueColumn::kRate, joint});
  for (Index column = 0; column < map.cols(); ++column)
    for (Eigen::SparseMatrix<double>::InnerIterator it(map, column); it; ++it) {
      const double unit = it.row() == rate ? recordings.gain(part->place) : 1.0;
      entries.emplace_back(it.row(), forced + column, unit * it.value());
    }
  part->map.setFromTriplets(entries.begin(), entries.end());
  part->map /= weight;
  Index at = forced;
  for (const TorqueFault& fault : faults) {
    if (fault.kind == TorqueFault::kPush) AddPush(recordings, fault.push, *part, at, &pushes);
    at += CountColumns(fault);
  }
  part->pushes.resize(part->size, columns);
  part->pushes.setFromTriplets(pushes.begin(), pushes.end());
}

/// Those that have entries.
std::vector<Index> ListUsed(const Eigen::SparseMatrix<double>& map) {
  std::vector<Index> used;
  for (Index column = 0; column < map.cols(); ++column)
    if (map.outerIndexPtr()[column + 1] > map.outerIndexPtr()[column]) used.push_back(column);
  return used;
}

}  // namespace

double CalcShare(const Push& push, const TorqueBalance::Block& block) {
  constexpr double kMost = 8.0;
  const int count = static_cast<int>(std::clamp(block.samples, 1.0, kMost));
  double share = 0.0;
  for (int i = 0; i < count; ++i) {
    const double t = block.from + (i + 0.5) / count * (block.to - block.from);
    share += SmoothStep((t - push.from) / push.reach) - SmoothStep((t - push.to) / push.reach);
  }
  return share / count;
}

Eigen::RowVectorXd CalcPushColumns(const RecordingSet& recordings, const Push& push,
                                   const TorqueRows::Part& part, size_t b) {
  const TorqueBalance::Block& block = part.balance->blocks()[b];
  const auto place = static_cast<Index>(part.place);
  Eigen::RowVectorXd columns = Eigen::RowVectorXd::Zero(1);
  if (push.link >= 0) {
    columns = block.forces.row(place).segment(6 * push.link, push.has_moment ? 6 : 3) / block.samples;
  } else if (push.payload >= 0) {
    columns.setZero(4);
    for (int k = 0; k < TorqueRegressor::kBody && block.counts[part.place] > 0.0; ++k)
      if (const Index at = part.balance->Find(part.place, {TorqueColumn::kBody, push.payload, k}); at >= 0)
        columns += block.sums[part.place][at] / block.counts[part.place] * push.masses.row(k);
  } else if (push.joint < 0) {
    // To be accelerated is to weigh the other way.
    columns = -block.gravity.row(place) / block.samples;
  } else {
    columns.setZero(push.is_stuck ? 2 : 1);
    if (recordings.joints()[part.place] == push.joint) {
      columns[0] = 1.0;
      const Index torque = part.balance->Find(part.place, {TorqueColumn::kTorque, push.joint});
      if (push.is_stuck && block.counts[part.place] > 0.0)
        columns[1] = -block.sums[part.place][torque] / block.counts[part.place];
    }
  }
  return columns * (std::sqrt(block.counts[part.place]) / recordings[part.recording].weight[place]);
}

VectorXd TorqueRows::Multiply(const VectorXd& a) const {
  VectorXd product(parts.empty() ? 0 : parts.back().begin + parts.back().size);
  for (const Part& part : parts)
    product.segment(part.begin, part.size) =
        part.balance->rows(part.place) * (part.map * a) + part.pushes * a;
  return product;
}

VectorXd TorqueRows::CalcLeft(const VectorXd& a) const {
  VectorXd signs(columns);
  signs << -a, 1.0;
  return Multiply(signs);
}

MatrixXd TorqueRows::CalcProducts() const {
  MatrixXd products = MatrixXd::Zero(columns, columns);
  for (const Part& part : parts) {
    const MatrixXd& rows = part.balance->rows(part.place);
    const MatrixXd reduced = part.balance->products(part.place) * part.map;
    const std::vector<Index> used = ListUsed(part.map);
    products(used, used) += MatrixXd(part.map.transpose() * reduced(Eigen::all, used))(used, Eigen::all);
    if (part.pushes.nonZeros() == 0) continue;
    const MatrixXd crossed = (part.pushes.transpose() * rows) * part.map;
    products += crossed + crossed.transpose() + MatrixXd(part.pushes.transpose() * part.pushes);
  }
  return products;
}

TorqueRows MakeTorqueRows(const RecordingSet& recordings, const std::vector<TorqueFault>& faults,
                          bool is_held) {
  TorqueRows all;
  all.columns = CountForced(recordings);
  for (const TorqueFault& fault : faults) {
    all.first.push_back(all.columns);
    all.columns += CountColumns(fault);
  }
  ++all.columns;
  Index height = 0;
  for (size_t r = 0; r < recordings.size(); ++r) {
    const TorqueBalance& balance = is_held ? *recordings[r].held : *recordings[r].fit;
    for (size_t place = 0; place < recordings.joints().size(); ++place) {
      if (!recordings.IsJudged(place)) continue;
      const Index size = balance.rows(place).rows();
      TorqueRows::Part& part = all.parts.emplace_back(
          TorqueRows::Part{.recording = r,
                           .place = place,
                           .begin = height,
                           .within = size - static_cast<Index>(balance.blocks().size()),
                           .size = size,
                           .samples = balance.samples(place),
                           .balance = &balance});
      FillPart(recordings, faults, all.columns, &part);
      all.samples += part.samples;
      height += size;
    }
  }
  return all;
}

}  // namespace dexcheck
