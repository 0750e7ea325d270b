#include "harness/recordings/torque_rows.h"

#include <cmath>

namespace dexcheck {

using Eigen::Index;

Index CountForced(const RecordingSet& recordings) {
  return recordings.has_currents() ? static_cast<Index>(recordings.joints().size()) : 0;
}

Index CountColumns(const TorqueFault& fault) {
  if (fault.kind == TorqueFault::kPush) return fault.push.link >= 0 ? 3 : 1;
  return static_cast<Index>(fault.columns.size());
}

Index CountColumns(const std::vector<TorqueFault>& faults) {
  Index count = 0;
  for (const TorqueFault& fault : faults) count += CountColumns(fault);
  return count;
}

Eigen::SparseMatrix<double> MapColumns(const TorqueBalance& balance, size_t place, size_t recording,
                                       const std::vector<TorqueFault>& faults) {
  const int joint = balance.joints()[place];
  std::vector<Eigen::Triplet<double>> entries;
  Index at = 0;
  for (const TorqueFault& fault : faults) {
    for (size_t k = 0; k < fault.columns.size(); ++k)
      for (const ColumnPart& one : fault.columns[k]) {
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

template <typename Rows>
void FillPush(const RecordingSet& recordings, const Push& push, const TorqueRows::Part& part,
              const TorqueBalance& balance, Index at, Rows& target) {
  if (static_cast<size_t>(push.recording) != part.recording) return;
  const double noise = recordings[part.recording].weight[static_cast<Index>(part.place)];
  for (size_t b = 0; b < balance.blocks().size(); ++b) {
    const TorqueBalance::Block& block = balance.blocks()[b];
    if (block.to < push.from || block.from > push.to || !(block.counts[part.place] > 0.0)) continue;
    const Index row = part.within + static_cast<Index>(b);
    const double count = std::sqrt(block.counts[part.place]);
    if (push.link >= 0) {
      target.row(row).segment(at, 3) =
          block.forces.block<1, 3>(static_cast<Index>(part.place), 6 * push.link) / block.samples * count /
          noise;
    } else if (recordings.joints()[part.place] == push.joint) {
      target(row, at) = count / noise;
    }
  }
}

void FillPart(const RecordingSet& recordings, const std::vector<TorqueFault>& faults,
              const TorqueRows::Part& part, const MatrixXd& rows, bool is_held, MatrixXd* all) {
  const TorqueBalance& balance = is_held ? *recordings[part.recording].held : *recordings[part.recording].fit;
  const int joint = recordings.joints()[part.place];
  auto target = all->middleRows(part.begin, part.size);
  target.rightCols(1) = rows.rightCols(1);
  if (recordings.has_currents()) {
    // k i = (1 + a) tau + ...: how much the gain is off is part of every explanation.
    target.rightCols(1) +=
        recordings.gain(part.place) * rows.col(balance.Find(part.place, {TorqueColumn::kCurrent, joint}));
    target.col(static_cast<Index>(part.place)) =
        rows.col(balance.Find(part.place, {TorqueColumn::kTorque, joint}));
  }
  Index at = CountForced(recordings);
  target.middleCols(at, CountColumns(faults)) +=
      rows * MapColumns(balance, part.place, part.recording, faults);
  for (const TorqueFault& fault : faults) {
    if (fault.kind == TorqueFault::kPush) FillPush(recordings, fault.push, part, balance, at, target);
    at += CountColumns(fault);
  }
}

}  // namespace

TorqueRows MakeTorqueRows(const RecordingSet& recordings, const std::vector<TorqueFault>& faults,
                          bool is_held) {
  TorqueRows all;
  std::vector<MatrixXd> rows;
  Index height = 0;
  for (size_t r = 0; r < recordings.size(); ++r) {
    const TorqueBalance& balance = is_held ? *recordings[r].held : *recordings[r].fit;
    for (size_t place = 0; place < recordings.joints().size(); ++place) {
      if (!recordings.IsJudged(place)) continue;
      rows.push_back(balance.CalcRows(place) / recordings[r].weight[static_cast<Index>(place)]);
      const Index size = rows.back().rows();
      all.parts.push_back({r, place, height, size - static_cast<Index>(balance.blocks().size()), size,
                           balance.samples(place)});
      all.samples += balance.samples(place);
      height += size;
    }
  }
  all.rows = MatrixXd::Zero(height, CountForced(recordings) + CountColumns(faults) + 1);
  for (size_t i = 0; i < rows.size(); ++i)
    FillPart(recordings, faults, all.parts[i], rows[i], is_held, &all.rows);
  return all;
}

}  // namespace dexcheck
