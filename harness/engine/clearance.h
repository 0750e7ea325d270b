#pragma once

// Bodies that touch where nobody looks: palm, phalanges, arms and platform against object, table, floor and
// each other. Such contacts have no <pair>, so the engine lets bodies pass through each other.

#include <mujoco/mujoco.h>

#include <utility>
#include <vector>

#include "controller/common/types.h"
#include "harness/engine/engine.h"
#include "harness/engine/overlap.h"

namespace dexcheck {

/// Looks for overlaps of all bodies that the MJCF lets move against each other, but for
///
///   - bodies with a contact <pair> between them, which the engine itself collides;
///   - links at most two joints apart, which are built into each other;
///   - geoms of two links that overlap at the MJCF's reference pose.
///
/// A body's shape are its geoms that can collide by contype or conaffinity, or all of its geoms when none
/// can. Meshes count as their convex hulls, as the engine has them; a torus is exact where its ring passes
/// one of kTorusBalls balls, and lies within its surface elsewhere. Distances are the engine's own. A pair
/// that is far apart is not looked at again before its bodies can have come that far.
class Clearance {
 public:
  /// Balls that stand for a torus.
  static constexpr int kTorusBalls = 32;

  /// @param model with the geoms that are only looked at.
  explicit Clearance(const mjModel& model);

  /// The deepest overlap. @param xpos, xmat of all bodies, as mjData has them; nothing allocates.
  const Overlap& Find(const mjtNum* xpos, const mjtNum* xmat);

  /// Pairs of bodies that are watched.
  [[nodiscard]] size_t num_pairs() const { return pairs_.size(); }

 private:
  /// A geom in the frame of the body that carries its group.
  struct Part {
    int geom;
    Vector3d center;
    Matrix3d R;
    double radius;             ///< Of a ball around it; infinite for a plane.
    double ring_radius = 0.0;  ///< Of a torus, whose geom is a ball here.
  };
  /// Bodies that move as one.
  struct Group {
    int body;
    std::vector<Part> parts;
    Vector3d center = Vector3d::Zero();  ///< Of a ball around all parts.
    double radius = 0.0;
    Pose X = Pose::Identity();
    Vector3d center_now = Vector3d::Zero();  ///< In the world.
  };
  struct Pair {
    int first, second;                         ///< Groups.
    std::vector<std::pair<int, int>> allowed;  ///< Parts that may overlap.
    double due = 0.0;                          ///< Way of all bodies until it must be looked at again, m.
  };
  void MakeGroups();
  void AddPart(int geom, const mjData& reference, Group* group) const;
  void MakePairs();
  void AllowOverlaps(Pair* pair);
  [[nodiscard]] bool AreBuiltTogether(int body1, int body2) const;
  void Move(const mjtNum* xpos, const mjtNum* xmat);
  /// Least distance of two groups, or one that it is not below, m; negative when they overlap.
  double Measure(const Pair& pair);
  double MeasureParts(const Group& a, const Part& part_a, const Group& b, const Part& part_b);
  double MeasureGeoms(int geom1, int geom2);
  void Place(const Group& group, const Part& part, const Vector3d& shift);

  MjModelPtr model_;
  MjDataPtr data_;
  std::vector<Group> groups_;
  std::vector<int> group_of_;  // by body
  std::vector<Pair> pairs_;
  std::vector<int> queue_;  // of pairs, a heap by what is due first
  std::vector<int> looked_at_;
  double way_ = 0.0;  // that any two bodies can have moved against each other since the first step, m
  bool is_first_ = true;
  Overlap overlap_;
};

}  // namespace dexcheck
