#include <algorithm>
#include <array>
#include <set>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/engine/clearance.h"
#include "harness/engine/engine.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

/// Joints whose origins are no farther apart meet in one point, m.
constexpr double kMeeting = 1e-9;

class PairLister {
 public:
  PairLister(const mjModel& engine, const Adapter& adapter, const Solids& solids)
      : m_(engine), solids_(solids), object_(adapter.object_body()) {
    for (const std::vector<int>& welded : adapter.welded_bodies()) {
      for (const int body : welded) roots_.insert(m_.body_rootid[body]);
    }
    for (const EngineWheel& wheel : adapter.wheels()) wheels_.insert(m_.jnt_bodyid[wheel.joint]);
    const auto add = [&](int a, int b) { declared_.emplace(a, b); };
    for (const auto& [a, b] : solids.declared) add(a, b);
    for (const auto& [a, b] : solids.by_type) {
      const int body_a = BodyOf(a);
      const int body_b = BodyOf(b);
      if (IsObject(body_a) || IsObject(body_b) || wheels_.count(body_a) > 0 || wheels_.count(body_b) > 0) {
        add(a, b);
      }
    }
  }

  [[nodiscard]] bool IsWatched(int a, int b) const {
    const int body_a = BodyOf(a);
    const int body_b = BodyOf(b);
    if (RootOf(body_a) == RootOf(body_b) || (IsStatic(body_a) && IsStatic(body_b))) return false;
    const bool known = IsRobot(body_a) || IsRobot(body_b) || IsObject(body_a) || IsObject(body_b);
    if (!known || AreNeighbours(body_a, body_b) || AreExcluded(m_, body_a, body_b)) return false;
    if ((wheels_.count(body_a) > 0 && IsPlane(b)) || (wheels_.count(body_b) > 0 && IsPlane(a))) return false;
    return declared_.count({a, b}) == 0;
  }

  [[nodiscard]] PairClass Classify(int a, int b) const {
    const bool robot_a = IsRobot(BodyOf(a));
    const bool robot_b = IsRobot(BodyOf(b));
    if (robot_a && robot_b) return PairClass::kRobotItself;
    const bool object = IsObject(BodyOf(a)) || IsObject(BodyOf(b));
    if (!robot_a && !robot_b) return PairClass::kObjectSurroundings;
    if (object) return PairClass::kRobotObject;
    return IsPlane(robot_a ? b : a) ? PairClass::kRobotFloor : PairClass::kRobotSurroundings;
  }

 private:
  [[nodiscard]] int BodyOf(int solid) const { return solids_.list[static_cast<size_t>(solid)].body; }
  [[nodiscard]] bool IsPlane(int solid) const {
    const Solid& s = solids_.list[static_cast<size_t>(solid)];
    return s.shape == Solid::Shape::kPlane && IsStatic(s.body);
  }
  [[nodiscard]] bool IsStatic(int body) const { return m_.body_weldid[body] == 0; }
  [[nodiscard]] bool IsRobot(int body) const { return roots_.count(m_.body_rootid[body]) > 0 && body > 0; }
  [[nodiscard]] bool IsObject(int body) const {
    return object_ > 0 && m_.body_rootid[body] == m_.body_rootid[object_] && !IsRobot(body);
  }

  /// The body that this one is fixed to; of one that does not move, the one that stands in the world.
  [[nodiscard]] int RootOf(int body) const {
    return m_.body_weldid[body] != 0 ? m_.body_weldid[body] : m_.body_rootid[body];
  }
  /// The body whose joint the body moves by, or by several joints that meet in one point.
  [[nodiscard]] int AnchorOf(int body) const {
    int anchor = RootOf(body);
    while (m_.body_parentid[anchor] != 0 && anchor != 0 &&
           Eigen::Map<const Vector3d>(m_.body_pos + 3 * anchor).norm() <= kMeeting) {
      anchor = RootOf(m_.body_parentid[anchor]);
    }
    return anchor;
  }
  /// Returns the anchor that carries a body's anchor; -1 for the first.
  [[nodiscard]] int AnchorBefore(int body) const {
    const int parent = m_.body_parentid[AnchorOf(body)];
    return parent > 0 ? AnchorOf(parent) : -1;
  }
  [[nodiscard]] bool AreNeighbours(int a, int b) const {
    const int anchor_a = AnchorOf(a);
    const int anchor_b = AnchorOf(b);
    return anchor_a == anchor_b || AnchorBefore(a) == anchor_b || AnchorBefore(b) == anchor_a;
  }

  const mjModel& m_;
  const Solids& solids_;
  int object_;
  std::set<int> roots_, wheels_;
  std::set<std::pair<int, int>> declared_;
};

}  // namespace

const char* NameOf(PairClass pairs) {
  constexpr std::array<const char*, kPairClassCount> kNames = {"robot_itself", "robot_object", "robot_floor",
                                                               "robot_surroundings", "object_surroundings"};
  return kNames.at(static_cast<size_t>(pairs));
}

std::vector<WatchedPair> ListWatchedPairs(const mjModel& engine, const Adapter& adapter, const Solids& solids,
                                          const std::vector<AllowedPair>& allowed,
                                          const std::string& source) {
  for (const AllowedPair& pair : allowed) {
    for (const std::string& name : {pair.first, pair.second}) {
      const auto has_name = [&](const Solid& solid) { return solid.name == name; };
      if (std::ranges::any_of(solids.list, has_name)) continue;
      throw InputError(source + ": plant.allowed_collision_pairs: " + Quote(name) +
                       " is no body with a shape in the MJCF");
    }
  }
  const PairLister lister(engine, adapter, solids);
  std::vector<WatchedPair> pairs;
  const int count = static_cast<int>(solids.list.size());
  for (int a = 0; a < count; ++a) {
    for (int b = a + 1; b < count; ++b) {
      const std::string& name_a = solids.list[static_cast<size_t>(a)].name;
      const std::string& name_b = solids.list[static_cast<size_t>(b)].name;
      const bool allowed_collision_pairs = std::ranges::any_of(allowed, [&](const AllowedPair& pair) {
        return (pair.first == name_a && pair.second == name_b) ||
               (pair.first == name_b && pair.second == name_a);
      });
      if (!allowed_collision_pairs && lister.IsWatched(a, b)) pairs.push_back({a, b, lister.Classify(a, b)});
    }
  }
  return pairs;
}

}  // namespace dexcheck
