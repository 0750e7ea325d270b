#pragma once

// States written for a program that runs elsewhere, and its results read back.

#include <filesystem>
#include <map>
#include <string>

#include "harness/descriptions/program_layout.h"
#include "harness/log/npy_file.h"

namespace dexcheck {

/// States of a robot in its own layout: positions N x num_positions, velocities N x n.
struct StateTable {
  NpyArray q;
  NpyArray v;
};

/// A line {"id":0,"q":[...],"v":[...]} for each state.
std::string WriteStateLines(const StateTable& states);

/// Writes layout.json: the robot, and the layout in which states are written and results are expected.
std::string WriteLayout(const RobotDescription& robot, const std::string& origin);

/// Results in a folder beside the states they belong to: q.npy (N x num_positions) and v.npy (N x n) in the
/// robot's own layout; M.npy, C.npy (N x n x n), c.npy, g.npy, h.npy, friction.npy (N x n),
/// kinetic_energy.npy, potential_energy.npy (N), each of which may be missing, in the layout of layout.json,
/// or in the robot's own without such a file. Instead of them the results may stand in
/// results.jsonl, a line for each state as a program writes it.
class ResultFiles : public LayoutProvider {
 public:
  /// @throws InputError, one line that names the file.
  ResultFiles(const std::filesystem::path& folder, const RobotDescription& robot);

  [[nodiscard]] const std::string& name() const override { return name_; }

  /// The state of a sample; false when there is none.
  bool ReadState(DynamicsState* state) const;
  TermResults Evaluate(long sample, const VectorXd& q, const VectorXd& xi) override;

 private:
  [[nodiscard]] NpyArray ReadArray(const std::string& file, const std::vector<size_t>& shape) const;
  void ReadLines(const std::filesystem::path& path);

  std::filesystem::path folder_;
  std::string name_;
  long count_ = 0;
  NpyArray q_, v_;
  std::map<std::string, NpyArray> terms_;
  std::vector<TermResults> lines_;  // of results.jsonl, by state
};

}  // namespace dexcheck
