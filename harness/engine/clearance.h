#pragma once

// Which bodies come near to each other that should not touch.

#include <array>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/types.h"
#include "harness/engine/adapter.h"
#include "harness/engine/engine.h"
#include "harness/engine/solid.h"

namespace dexcheck {

/// Pairs of bodies, by what they belong to.
enum class PairClass {
  kRobotItself,
  kRobotObject,
  kRobotFloor,         ///< Planes of bodies that do not move.
  kRobotSurroundings,  ///< All else: a table.
  kObjectSurroundings,
};
inline constexpr int kPairClassCount = 5;

/// "robot_itself", ...
const char* NameOf(PairClass pairs);

/// Two solids of bodies that should not touch.
struct WatchedPair {
  int a = 0, b = 0;  ///< Indices of the solids, a < b.
  PairClass pairs = PairClass::kRobotItself;
};

/// Names of two bodies that may touch; of the world's own geoms, the geom's.
using AllowedPair = std::pair<std::string, std::string>;

/// All pairs but those
/// - of one body, or of bodies welded to each other, or of two that do not move;
/// - of neighbours: bodies on either side of a joint, also over a link whose two joints meet in one point;
/// - whose contact the MJCF declares, or excludes; of the object and of wheels also by contype and
/// conaffinity;
/// - of wheels and planes, on which they roll;
/// - that are allowed.
/// @throws InputError when an allowed body is none of the MJCF's. @param source for messages.
std::vector<WatchedPair> ListWatchedPairs(const mjModel& engine, const Adapter& adapter, const Solids& solids,
                                          const std::vector<AllowedPair>& allowed, const std::string& source);

/// Where the engine's bodies are, as mjData has it (xpos, xmat).
struct BodyPoses {
  const double* positions;  ///< Origins, 3 each, m.
  const double* rotations;  ///< Row by row, 9 each.
};

/// Follows how far the solids of watched pairs are apart while bodies move. A pair is measured again when its
/// bodies may have come near enough to matter: at what they moved at the most, of all bodies, since it was
/// measured. So most steps measure nothing, no overlap is missed in any of them, and the smallest distance of
/// a class is known to kResolution. Nothing allocates after construction.
class Clearance {
 public:
  /// m
  static constexpr double kResolution = 2e-4;

  /// The smallest distance so far.
  struct Nearest {
    double distance = std::numeric_limits<double>::infinity();  ///< m, negative when they overlap.
    double time = 0.0;                                          ///< s
    int pair = -1;
  };

  /// @param solids of the engine's model; outlive this.
  Clearance(const mjModel& engine, const Adapter& adapter, const Solids& solids,
            std::vector<WatchedPair> pairs);

  /// The bodies are there.
  void Update(const BodyPoses& bodies, double time);
  /// Forgets the smallest distances so far: time begins anew.
  void Restart();

  [[nodiscard]] const std::vector<WatchedPair>& pairs() const { return pairs_; }
  [[nodiscard]] const Solid& solid(int index) const { return solids_->list[static_cast<size_t>(index)]; }
  [[nodiscard]] const Nearest& nearest(PairClass pairs) const { return nearest_[static_cast<size_t>(pairs)]; }
  /// Of the pairs that overlap in the last update the deepest: depth, m, 0 for none, to kResolution; and
  /// which.
  [[nodiscard]] std::pair<double, int> FindDeepest() const;
  /// Distances that were measured, so far.
  [[nodiscard]] long measured() const { return measured_; }
  /// Pairs that were looked at, so far: measured, or found to be far enough apart still.
  [[nodiscard]] long looked_at() const { return looked_at_; }
  /// "r_palm and bench".
  [[nodiscard]] std::string Describe(int pair) const;

 private:
  /// In which frame the motion of a pair's bodies is bounded: where the robot itself is concerned, that of
  /// its base, so that driving changes nothing; over planes that stand still, along their normals alone.
  enum Frame { kOfBase, kOfWorld, kOverPlanes, kFrameCount };
  static constexpr std::array<Frame, kFrameCount> kFrames = {kOfBase, kOfWorld, kOverPlanes};
  struct MovingBody {
    int body = 0;
    double reach = 0.0;  // from the body's origin to the farthest point that turning it moves, m
    Vector3d axis = Vector3d::Zero();  // through its origin, that all of its solids are round about, if any
    std::array<Pose, kFrameCount> last;
    std::array<bool, kFrameCount> counts = {};
  };
  struct State {
    Frame frame = kOfWorld;
    double distance = 0.0;         // when it was measured, m
    Pose X_AB = Pose::Identity();  // then
    bool is_measured = false;      // whether X_AB is set
    bool overlaps = false;
  };
  struct Due {
    double travel = 0.0;  // of the frame's bodies, from which on the pair is looked at again
    int pair = 0;
  };

  [[nodiscard]] Frame FrameOf(const mjModel& engine, const WatchedPair& pair) const;
  [[nodiscard]] Vector3d CalcAxisOfAll(int body) const;
  void FollowBodies(const BodyPoses& bodies);
  /// By how much a pair's distance can have changed since it was measured, m.
  [[nodiscard]] double BoundChange(int pair, const Pose& X_AB) const;
  /// What their distance is not less than, from their origins and reaches, m.
  [[nodiscard]] static double BoundDistance(const Solid& a, const Solid& b, const Pose& X_AB);
  /// How far the pair may come nearer before it matters.
  [[nodiscard]] double CalcBudget(int pair, const BodyPoses& bodies, double time);
  [[nodiscard]] Pose PoseOf(int solid, const BodyPoses& bodies) const;
  void Note(int pair, double distance, double time);
  void SetOverlap(int pair, bool overlaps);

  const Solids* solids_;
  std::vector<WatchedPair> pairs_;
  std::vector<State> states_;
  std::vector<MovingBody> bodies_;
  std::vector<int> planes_;        // solids that are planes and stand still
  std::vector<Vector3d> normals_;  // theirs, world
  int base_body_ = 0;
  std::array<double, kFrameCount> travel_ = {};
  std::array<std::vector<Due>, kFrameCount> due_;  // heaps, the next on top
  std::array<Nearest, kPairClassCount> nearest_;
  std::vector<int> overlapping_;
  bool has_begun_ = false;
  long measured_ = 0, looked_at_ = 0;
};

// Whether a robot's bodies overlap in a posture.

/// By the collision shapes of an MJCF, and those of what stands around the robot.
class SelfContact {
 public:
  /// @param joints names of joints with one position, in the order of postures. Pairs of bodies that overlap
  /// at `usual` always do, as neighbours may, and are left out.
  /// @throws InputError when the MJCF has none of such a name. @param source of messages.
  SelfContact(MjModelPtr model, const std::string& source, const std::vector<std::string>& joints,
              const VectorXd& usual);

  /// Sum of the depths of all contacts, m; 0 where none is. @param q rad or m.
  double CalcDepth(const VectorXd& q);

 private:
  void Place(const VectorXd& q);
  [[nodiscard]] std::pair<int, int> BodiesOf(const mjContact& contact) const;

  MjModelPtr model_;
  MjDataPtr data_;
  std::vector<int> addresses_;  // of positions
  std::vector<std::pair<int, int>> usual_;
};

}  // namespace dexcheck
