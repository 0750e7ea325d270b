#pragma once

// States written for a program that cannot be asked, and its answers read back.

#include <filesystem>
#include <map>
#include <string>

#include "harness/descriptions/npy_file.h"
#include "harness/descriptions/random_states.h"
#include "harness/descriptions/side_layout.h"

namespace dexcheck {

/// States of a robot in its own layout: positions N x num_positions, velocities N x n.
struct StateTable {
  NpyArray q;
  NpyArray v;
};

/// Random states, drawn as CheckConsistency draws them.
StateTable DrawStates(const RobotDescription& robot, long count, const StateRange& range, std::uint64_t seed);

/// A line {"id":0,"q":[...],"v":[...]} for each state.
std::string WriteStateLines(const StateTable& states);

/// What layout.json says: the robot, and in which layout states are written and answers are expected.
std::string WriteLayout(const RobotDescription& robot, const std::string& origin);

/// Answers in a folder beside the states they belong to: q.npy (N x num_positions) and v.npy (N x n) in the
/// robot's own layout; M.npy, C.npy (N x n x n), c.npy, g.npy, h.npy, friction.npy (N x n),
/// kinetic_energy.npy, potential_energy.npy (N), each of which may be missing, in the layout of layout.json,
/// or in the robot's own without such a file. Instead of them the answers may stand in
/// answers.jsonl, a line for each state as a program gives it.
class AnswerFiles : public AnsweringSide {
 public:
  /// @throws InputError, one line that names the file.
  AnswerFiles(const std::filesystem::path& folder, const RobotDescription& robot);

  [[nodiscard]] const std::string& name() const override { return name_; }

  /// Number of states, and each of them.
  [[nodiscard]] long count() const { return count_; }
  [[nodiscard]] VectorXd positions(long sample) const { return Row(q_, sample); }
  [[nodiscard]] VectorXd velocities(long sample) const { return Row(v_, sample); }
  /// Gives the states, from the first to the last.
  [[nodiscard]] StateFeed MakeFeed() const;
  SideTerms Evaluate(long sample, const VectorXd& q, const VectorXd& xi) override;

 private:
  [[nodiscard]] NpyArray Read(const std::string& file, const std::vector<size_t>& shape) const;
  [[nodiscard]] static NpyArray Check(NpyArray array, const std::string& source,
                                      const std::vector<size_t>& shape);
  void ReadLines(const std::filesystem::path& path);
  [[nodiscard]] static VectorXd Row(const NpyArray& array, long sample);
  [[nodiscard]] VectorXd FindRow(const std::string& term, long sample) const;

  std::filesystem::path folder_;
  std::string name_;
  long count_ = 0;
  NpyArray q_, v_;
  std::map<std::string, NpyArray> terms_;
  std::vector<SideTerms> lines_;  // of answers.jsonl, by state
};

}  // namespace dexcheck
