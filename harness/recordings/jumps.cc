#include "harness/recordings/jumps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/linear_algebra.h"
#include "harness/recordings/motion_fit.h"

namespace dexcheck {
namespace {

using Eigen::Index;

constexpr size_t kBeside = 4;         // rows that say how fast a joint is
constexpr size_t kEnd = 4 * kBeside;  // rows at the ends, where it does not show what follows

class Search {
 public:
  Search(const std::deque<VectorXd>& rows, const JumpOptions& options)
      : rows_(rows), options_(options), noise_(VectorXd::Zero(options.quanta.size())) {
    // The first is more than ten standard deviations of Gaussian noise.
    constexpr double kTimes = 20.0, kQuanta = 3.0;
    for (const Index at : options.positions) {
      std::vector<double> usual;
      for (size_t row = kBeside + 1; row + kBeside < rows.size(); ++row)
        usual.push_back(std::abs(Change(row, at) / Passed(row) - CalcRange(row, at).mean()));
      noise_[at] = kTimes * Median(usual) + kQuanta * options.quanta[at];
    }
  }

  std::map<Index, std::vector<Jump>> Run() {
    for (size_t row = kEnd + 1; row + kEnd < rows_.size(); ++row) FindAt(row);
    for (const Index at : options_.positions) {
      const auto found = jumps_.find(at);
      if (found == jumps_.end()) continue;
      if (found->second.size() > 1 || StoodStill(found->second.front().row, at)) jumps_.erase(found);
    }
    return std::move(jumps_);
  }

 private:
  [[nodiscard]] double Change(size_t row, Index at) const { return rows_[row][at] - rows_[row - 1][at]; }
  /// Usual steps between a row and the one before.
  [[nodiscard]] double Passed(size_t row) const { return Change(row, options_.time) / options_.step; }

  /// Returns the least and the largest change for a usual step beside a row.
  [[nodiscard]] Vector2d CalcRange(size_t row, Index at) const {
    Vector2d range(std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity());
    for (size_t i = row - kBeside; i <= row + kBeside; ++i) {
      if (i == row) continue;
      const double rate = Change(i, at) / Passed(i);
      range = Vector2d(std::min(range[0], rate), std::max(range[1], rate));
    }
    return range;
  }

  void FindAt(size_t row) {
    const double passed = Passed(row);
    double travel = 0.0, squares = 0.0;  // over all joints, weighted
    bool is_one_row = true, is_more = false;
    std::map<Index, double> jumped;
    for (const Index at : options_.positions) {
      const Vector2d range = CalcRange(row, at);
      // The time of a row is known to one row.
      const double error = noise_[at] + range.cwiseAbs().maxCoeff();
      const double moved = Change(row, at);
      const auto is_by = [&](double steps) {
        return moved > range[0] * steps - error && moved < range[1] * steps + error;
      };
      is_one_row = is_one_row && is_by(1.0);
      is_more = is_more || std::abs(range.mean()) * (passed - 1.0) > 2.0 * error;
      travel += moved * range.mean() / Square(error);
      squares += Square(range.mean() / error);
      if (!is_by(passed)) jumped[at] = moved - range.mean() * passed;
    }
    if (passed > options_.longest_gap) {
      if (is_one_row && is_more) jumps_[options_.time].push_back({row, (passed - 1.0) * options_.step});
    } else if (jumped.size() > 1 && travel > options_.longest_gap * squares) {
      jumps_[options_.time].push_back({row, (passed - travel / squares) * options_.step});
    } else {
      for (const auto& [at, size] : jumped) jumps_[at].push_back({row, size});
    }
  }

  /// Whether a joint moves after a jump and did not before.
  [[nodiscard]] bool StoodStill(size_t row, Index at) const {
    constexpr double kLittle = 0.2;
    const double before = rows_[row - 1][at] - rows_[row - 1 - kEnd][at];
    const double after = rows_[row + kEnd][at] - rows_[row][at];
    return std::abs(before) < kLittle * std::abs(after);
  }

  const std::deque<VectorXd>& rows_;
  const JumpOptions& options_;
  VectorXd noise_;  // by channel: what a position changes by, beyond its velocity
  std::map<Index, std::vector<Jump>> jumps_;
};

}  // namespace

std::map<Index, std::vector<Jump>> FindJumps(const std::deque<VectorXd>& rows, const JumpOptions& options) {
  return Search(rows, options).Run();
}

}  // namespace dexcheck
