#pragma once

// In which order, and by which convention, another program writes the coordinates of a robot.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/descriptions/robot_description.h"
#include "harness/descriptions/term_results.h"

namespace dexcheck {

/// How a program writes q', xi and terms. Coordinates are the base's, if it floats, then one for each joint;
/// a ball joint has a quaternion qw qx qy qz in q' and three entries in xi, in the robot's own convention.
class ProgramLayout {
 public:
  /// The robot's own: all joints, in its order.
  explicit ProgramLayout(const RobotDescription& robot);

  /// From the keys `joints` (names in the program's order; all joints, or all that follow no other) and
  /// `base` (of a floating base: {"position": "xyz_wxyz" | "xyz_xyzw" | "wxyz_xyz", "velocity":
  /// "linear_angular" | "angular_linear", "linear_axes": "world" | "base", "angular_axes": "base" |
  /// "world"}), each of which may be missing.
  /// @param source who says so, for messages. @throws InputError "SOURCE: KEY: what, got VALUE".
  ProgramLayout(const RobotDescription& robot, const nlohmann::json& json, const std::string& source);

  /// The keys that the constructor reads, of this layout.
  [[nodiscard]] nlohmann::ordered_json ToJson() const;

  /// Joints that follow others have no coordinate.
  [[nodiscard]] bool is_reduced() const { return is_reduced_; }
  [[nodiscard]] bool is_floating() const { return base_ > 0; }
  [[nodiscard]] const BaseConvention& convention() const { return convention_; }
  void set_convention(const BaseConvention& convention) { convention_ = convention; }
  /// Entries of q' and xi as the program has them.
  [[nodiscard]] int num_positions() const { return num_positions_; }
  [[nodiscard]] int size() const { return base_ + static_cast<int>(velocities_.size()); }

  /// q' and xi as the program writes them. q', xi: the robot's own.
  [[nodiscard]] VectorXd WritePositions(const VectorXd& q) const;
  [[nodiscard]] VectorXd WriteVelocities(const VectorXd& q, const VectorXd& xi) const;
  /// Terms as the program wrote them, in the robot's own coordinates; without the joints that follow when it
  /// is reduced.
  void ReadTerms(const VectorXd& q, const VectorXd& xi, TermResults* terms) const;

 private:
  /// A joint as files have it: a ball's entries are one.
  struct NamedJoint {
    std::string name;
    int position, num_positions;   // the robot's q'
    int velocity, num_velocities;  // the robot's xi, without the base's entries
    bool follows;
  };
  void SetJoints(std::vector<int> joints);

  std::vector<NamedJoint> robot_joints_;
  int base_;  // entries of xi before the joints'
  int base_positions_;
  int num_positions_ = 0;
  std::vector<int> joints_;      // the robot's index of each of the program's joints
  std::vector<int> velocities_;  // the robot's of each of the program's velocities, without the base's
  std::vector<int> places_;      // where the program has the robot's velocities, in the robot's order
  bool is_reduced_ = false;
  BaseConvention convention_;
};

/// A provider whose results have a layout of its own.
class LayoutProvider : public ResultProvider {
 public:
  [[nodiscard]] bool is_reduced() const override { return layout_.is_reduced(); }
  [[nodiscard]] const ProgramLayout& layout() const { return layout_; }
  /// Takes its words for another convention of the base than the one it said.
  void set_convention(const BaseConvention& convention) { layout_.set_convention(convention); }

 protected:
  explicit LayoutProvider(ProgramLayout layout) : layout_(std::move(layout)) {}
  void set_layout(ProgramLayout layout) { layout_ = std::move(layout); }

 private:
  ProgramLayout layout_;
};

/// A program's result, which is one JSON object; none where the text is anything else or nests deeper than
/// results do.
std::optional<nlohmann::json> ParseResult(std::string_view text);

/// Terms from the keys M (n x n), C (n x n) or c = C v (n), g (n), h = c + g (n), friction (n),
/// kinetic_energy, potential_energy; at least one. n is the layout's size, v the velocity as the program has
/// it.
/// @throws InputError "SOURCE: KEY: what, got VALUE" for sizes that differ and what is no number.
TermResults ReadResult(const nlohmann::json& json, const ProgramLayout& layout, const VectorXd& v,
                       const std::string& source);

}  // namespace dexcheck
