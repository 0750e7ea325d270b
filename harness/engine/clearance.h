#pragma once

// Distances between bodies that should not touch.

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

/// Classes of pairs, by the owners of the two bodies.
enum class PairClass {
  kRobotItself,
  kRobotObject,
  kRobotFloor,         ///< Planes of bodies that do not move.
  kRobotSurroundings,  ///< Any other body, such as a table.
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

/// Names of two bodies that may touch; for the world's own geoms, the geom's name.
using AllowedPair = std::pair<std::string, std::string>;

/// Lists all pairs except those
/// - of one body, or of bodies welded to each other, or of two that do not move;
/// - of neighbours: bodies on either side of a joint, also over a link whose two joints meet in one point;
/// - whose contact the MJCF declares, or excludes; for the object and wheels also by contype and conaffinity;
/// - of wheels and planes, on which they roll;
/// - that are allowed.
/// @throws InputError when an allowed body is none of the MJCF's. @param source for messages.
std::vector<WatchedPair> ListWatchedPairs(const mjModel& engine, const Adapter& adapter, const Solids& solids,
                                          const std::vector<AllowedPair>& allowed, const std::string& source);

/// Poses of the engine's bodies, as in mjData (xpos, xmat).
struct BodyPoses {
  const double* positions;  ///< Origins, 3 each, m.
  const double* rotations;  ///< Row by row, 9 each.
};

/// Follows the distances between the solids of watched pairs while bodies move. A pair is measured again when
/// its bodies may have come near enough to matter, by the largest motion of any body since its last
/// measurement. Therefore most steps measure nothing, no overlap is missed in any step, and the smallest
/// distance of a class is known to kResolution. Nothing allocates after construction.
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

  /// Updates the distances for these poses. @param time s.
  void Update(const BodyPoses& bodies, double time);
  /// Forgets the smallest distances so far: time begins anew.
  void Restart();

  [[nodiscard]] const std::vector<WatchedPair>& pairs() const { return pairs_; }
  [[nodiscard]] const Solid& solid(int index) const { return solids_->list[static_cast<size_t>(index)]; }
  [[nodiscard]] const Nearest& nearest(PairClass pairs) const { return nearest_[static_cast<size_t>(pairs)]; }
  /// Returns the depth of the deepest overlap in the last update, m, to kResolution, or 0; and its pair.
  [[nodiscard]] std::pair<double, int> FindDeepest() const;
  /// Number of distances that were measured so far.
  [[nodiscard]] long measured() const { return measured_; }
  /// "r_palm and bench".
  [[nodiscard]] std::string Describe(int pair) const;

 private:
  /// Frame in which the motion of a pair's bodies is bounded: the base's where the robot itself is concerned,
  /// so that driving changes nothing; over planes that stand still, along their normals alone.
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
  /// Bounds the change of a pair's distance since its last measurement, m.
  [[nodiscard]] double BoundChange(int pair, const Pose& X_AB) const;
  /// Returns a lower bound of the distance of two solids, from their origins and reaches, m.
  [[nodiscard]] static double BoundDistance(const Solid& a, const Solid& b, const Pose& X_AB);
  /// Returns how far the pair may approach before it matters, m.
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
  long measured_ = 0;
};

// Overlaps of a robot's bodies in a posture.

/// Overlaps by the collision shapes of an MJCF, those around the robot included.
class SelfContact {
 public:
  /// @param joints names of joints with one position, in the order of postures. Pairs of bodies that overlap
  /// at `usual` overlap always, as neighbours may, and are left out.
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
