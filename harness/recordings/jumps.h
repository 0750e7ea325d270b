#pragma once

// Positions and times of a recording that go on from another place: an encoder slips, a clock is set, rows
// are lost.

#include <deque>
#include <map>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// A channel's change from the row before to a row that its velocities beside them do not explain.
struct Jump {
  size_t row = 0;
  double size = 0.0;
};

/// A recording's channels, and how they change.
struct JumpOptions {
  Eigen::Index time = 0;
  std::vector<Eigen::Index> positions;
  VectorXd quanta;           ///< By channel: the steps of encoders, 0 for none.
  double step = 0.0;         ///< The usual time between rows, s.
  double longest_gap = 0.0;  ///< Times the usual step; over a longer one, positions may move anywhere.
};

/// Returns the jumps by channel. The time jumps ahead where no joint moves by more than in one row; it jumps
/// back (size < 0, roughly) where several joints move as over many rows. A joint has one jump at most:
/// several are its play, and one before which it did not move ends a time in which its sensor stood still.
/// @param rows by channel.
std::map<Eigen::Index, std::vector<Jump>> FindJumps(const std::deque<VectorXd>& rows,
                                                    const JumpOptions& options);

}  // namespace dexcheck
