#include "harness/corrections/link_match.h"

#include <algorithm>
#include <map>

#include "controller/model/rigid_body.h"
#include "harness/descriptions/alike_names.h"

namespace dexcheck {
namespace {

/// The nearest link above that is in the set; -1 when there is none.
int FindCarrier(const PrintedRobot& robot, int link, const std::vector<int>& other) {
  for (link = robot.link(link).parent; link >= 0; link = robot.link(link).parent) {
    if (other[static_cast<size_t>(link)] >= 0) break;
  }
  return link;
}

/// Moving links below a link with no other moving one between.
void ListNext(const PrintedRobot& robot, int link, std::vector<int>* next) {
  for (const int child : robot.link(link).children) {
    if (Moves(robot.link(child))) {
      next->push_back(child);
    } else {
      ListNext(robot, child, next);
    }
  }
}

int CountMoving(const PrintedRobot& robot, int link) {
  int count = Moves(robot.link(link)) ? 1 : 0;
  for (const int child : robot.link(link).children) count += CountMoving(robot, child);
  return count;
}

class LinkMatcher {
 public:
  LinkMatcher(const PrintedRobot& a, const PrintedRobot& b) : a_(a), b_(b) {
    match_.b_of_a.assign(a.links.size(), -1);
    match_.a_of_b.assign(b.links.size(), -1);
  }

  LinkMatch Run(MatchBy by) {
    std::map<std::string, int> links, joints;
    for (int j = 0; j < b_.size(); ++j) {
      links.emplace(b_.link(j).name, j);
      if (Moves(b_.link(j))) joints.emplace(b_.link(j).joint.name, j);
    }
    std::vector<int> by_joint;
    const auto match_joints = [&] {
      for (int i = 0; i < a_.size(); ++i) {
        const auto found = joints.find(a_.link(i).joint.name);
        if (Moves(a_.link(i)) && found != joints.end() && Take(i, found->second)) by_joint.push_back(i);
      }
    };
    if (by == MatchBy::kJoints) match_joints();
    for (int i = 0; i < a_.size(); ++i) {
      const auto found = links.find(a_.link(i).name);
      if (found == links.end()) continue;
      // A frame on a link has the name of no link that moves.
      const PrintedLink& other = b_.link(found->second);
      const bool is_frame = a_.link(i).is_frame || other.is_frame;
      if (!is_frame || (!Moves(a_.link(i)) && !Moves(other))) Take(i, found->second);
    }
    match_joints();
    MatchAlike(&by_joint);
    MatchRoot();
    if (by == MatchBy::kTree || std::ranges::any_of(by_joint, [&](int i) { return !IsCarriedAlike(i); })) {
      for (const int i : by_joint) {
        match_.a_of_b[Index(match_.b_of_a[Index(i)])] = -1;
        match_.b_of_a[Index(i)] = -1;
      }
    }
    MatchTrees();
    return std::move(match_);
  }

 private:
  static size_t Index(int i) { return static_cast<size_t>(i); }

  bool Take(int i, int j) {
    if (match_.b_of_a[Index(i)] >= 0 || match_.a_of_b[Index(j)] >= 0) return false;
    match_.b_of_a[Index(i)] = j;
    match_.a_of_b[Index(j)] = i;
    return true;
  }

  void MatchAlike(std::vector<int>* by_joint) {
    const auto list = [](const PrintedRobot& robot, const std::vector<int>& match, std::vector<int>* open) {
      std::vector<std::string> names;
      for (int i = 0; i < robot.size(); ++i) {
        if (!Moves(robot.link(i)) || match[Index(i)] >= 0) continue;
        names.push_back(robot.link(i).joint.name);
        open->push_back(i);
      }
      return names;
    };
    std::vector<int> open, open_b;
    const std::vector<std::string> names = list(a_, match_.b_of_a, &open);
    const std::vector<std::string> others = list(b_, match_.a_of_b, &open_b);
    const std::vector<std::string> similar = FindAlikeNames(names, others);
    for (size_t k = 0; k < similar.size(); ++k) {
      const int found = IndexOf(others, similar[k]);
      if (found >= 0 && Take(open[k], open_b[Index(found)])) by_joint->push_back(open[k]);
    }
  }

  /// The root is the other file's, or what stands or floats on it.
  void MatchRoot() {
    if (match_.b_of_a[0] >= 0) return;
    const auto is_free = [](const PrintedRobot& robot, int link, const std::vector<int>& other) {
      return other[Index(link)] < 0 && robot.link(link).parent == 0 && !Moves(robot.link(link));
    };
    std::vector<int> real;
    for (int j = 0; j < b_.size(); ++j) {
      if (is_free(b_, j, match_.a_of_b) && (b_.link(j).inertial || b_.link(j).joint.kind == JointKind::kFree))
        real.push_back(j);
    }
    const bool floats =
        std::ranges::any_of(real, [&](int j) { return b_.link(j).joint.kind == JointKind::kFree; });
    const PrintedLink& root_b = b_.link(0);
    const bool is_world = b_.format == RobotFormat::kMjcf || root_b.name == "world";
    if (!real.empty() && is_world && !root_b.inertial &&
        (match_.a_of_b[0] >= 0 || floats || real.size() == 1)) {
      Take(0, real[0]);
    } else if (match_.a_of_b[0] < 0) {
      Take(0, 0);
    }
  }

  [[nodiscard]] bool IsCarriedAlike(int i) const {
    const int j = match_.b_of_a[Index(i)];
    const int p = FindCarrier(a_, i, match_.b_of_a);
    const int q = FindCarrier(b_, j, match_.a_of_b);
    return (p < 0 ? -1 : match_.b_of_a[Index(p)]) == q || p < 0 || q < 0;
  }

  /// Pairs what hangs on links that are matched: of as many joints each, kinds and what they carry decide.
  void MatchTrees() {
    for (int i = 0; i < a_.size(); ++i) {
      const int j = match_.b_of_a[Index(i)];
      if (j < 0) continue;
      std::vector<int> next, next_b;
      ListNext(a_, i, &next);
      ListNext(b_, j, &next_b);
      std::erase_if(next, [&](int k) { return match_.b_of_a[Index(k)] >= 0; });
      std::erase_if(next_b, [&](int k) { return match_.a_of_b[Index(k)] >= 0; });
      for (const int k : next) {
        const auto is_same = [&](int l) {
          return match_.a_of_b[Index(l)] < 0 && a_.link(k).joint.kind == b_.link(l).joint.kind &&
                 CountMoving(a_, k) == CountMoving(b_, l);
        };
        const auto found = std::ranges::find_if(next_b, is_same);
        if (found != next_b.end()) {
          Take(k, *found);
        } else if (next.size() == 1 && next_b.size() == 1) {
          Take(k, next_b[0]);
        }
      }
      MatchWelded(i, j);
    }
  }

  /// Pairs bodies that are welded to a link under other names, where both files have as many, in their order.
  void MatchWelded(int i, int j) {
    const auto list = [](const PrintedRobot& robot, int link, const std::vector<int>& other) {
      std::vector<int> welded;
      for (const int k : robot.link(link).children) {
        if (robot.link(k).inertial && robot.link(k).joint.kind == JointKind::kFixed && other[Index(k)] < 0)
          welded.push_back(k);
      }
      return welded;
    };
    const std::vector<int> ours = list(a_, i, match_.b_of_a), theirs = list(b_, j, match_.a_of_b);
    if (ours.size() != theirs.size()) return;
    for (size_t k = 0; k < ours.size(); ++k) {
      if (CountMoving(a_, ours[k]) == CountMoving(b_, theirs[k])) Take(ours[k], theirs[k]);
    }
  }

  const PrintedRobot& a_;
  const PrintedRobot& b_;
  LinkMatch match_;
};

/// Adds what half units of these numbers change.
template <typename Part, typename Measure, typename Tolerance>
void AddHalves(Part* part, const Measure& measure, Tolerance* tolerance) {
  const auto nominal = measure();
  MoveHalves(ListNumbers(part), [&] { AddChange(nominal, measure(), tolerance); });
}

}  // namespace

bool Moves(const PrintedLink& link) { return HasAxis(link) || link.joint.kind == JointKind::kBall; }

bool HasAxis(const PrintedLink& link) {
  return link.joint.kind == JointKind::kHinge || link.joint.kind == JointKind::kSlide;
}

LinkMatch MatchLinks(const PrintedRobot& a, const PrintedRobot& b, MatchBy by) {
  return LinkMatcher(a, b).Run(by);
}

std::vector<Node> ListNodes(const PrintedRobot& robot, const std::vector<int>& other) {
  std::vector<Node> nodes(robot.links.size());
  std::vector<int> home(robot.links.size(),
                        -1);  // the node that a link is part of; -1 of links that are left out
  for (int i = 0; i < robot.size(); ++i) {
    const auto at = static_cast<size_t>(i);
    const PrintedLink& link = robot.link(i);
    const int above = link.parent < 0 ? -1 : home[static_cast<size_t>(link.parent)];
    if (other[at] >= 0 || link.parent < 0) {
      Node& node = nodes[at];
      home[at] = node.link = i;
      int from = i;
      const auto carries = [&](int k) {
        return nodes[static_cast<size_t>(k)].link >= 0 && !robot.link(k).is_frame;
      };
      for (; from >= 0 && (from == i || !carries(from)); from = robot.link(from).parent)
        node.chain.insert(node.chain.begin(), from);
      node.parent = from;
      if (link.is_frame) home[at] = above;
    } else if (!Moves(link) && above >= 0) {
      home[at] = above;
    }
    if (home[at] >= 0 && link.inertial) nodes[static_cast<size_t>(home[at])].parts.push_back(i);
  }
  return nodes;
}

Pose CalcNodePose(const PrintedRobot& robot, const Node& node) {
  Pose X = Pose::Identity();
  for (const int link : node.chain) X = X * robot.link(link).origin.CalcPose();
  return X;
}

std::vector<ChainOrigin> ListOrigins(const PrintedRobot& robot, const Node& node) {
  std::vector<ChainOrigin> origins;
  const Pose whole = CalcNodePose(robot, node);
  Pose before = Pose::Identity();
  for (const int link : node.chain) {
    const Pose X = robot.link(link).origin.CalcPose();
    origins.push_back({link, before, X, (before * X).inverse() * whole});
    before = before * X;
  }
  return origins;
}

bool IsTurned(const Pose& X, const Pose& Y, double open) {
  return CalcAngle(X.linear().transpose() * Y.linear()) > open;
}

bool IsMoved(const Pose& X, const Pose& Y, const Vector3d& open) {
  return ((X.translation() - Y.translation()).cwiseAbs().array() > open.array()).any();
}

Pose CalcPartPose(const PrintedRobot& robot, const Node& node, int part) {
  Pose X = Pose::Identity();
  for (; part != node.link; part = robot.link(part).parent) X = robot.link(part).origin.CalcPose() * X;
  return X;
}

MassProperties CalcNodeBody(const PrintedRobot& robot, const Node& node) {
  std::vector<MassProperties> bodies;
  for (const int part : node.parts) {
    const PrintedInertial& inertial = *robot.link(part).inertial;
    const Pose X = CalcPartPose(robot, node, part);
    const Matrix3d R = X.linear() * inertial.origin.CalcRotation();
    bodies.push_back({inertial.mass.value, X * inertial.origin.t, R * ToTensor(inertial.I) * R.transpose()});
  }
  return bodies.size() == 1 ? bodies[0] : Combine(bodies);
}

void AddChange(const Pose& before, const Pose& after, PoseTolerance* tolerance) {
  tolerance->length += (after.translation() - before.translation()).cwiseAbs();
  tolerance->angle += CalcAngle(before.linear().transpose() * after.linear());
}

void AddChange(const MassProperties& before, const MassProperties& after, MassProperties* tolerance) {
  tolerance->mass += std::abs(after.mass - before.mass);
  tolerance->com += (after.com - before.com).cwiseAbs();
  tolerance->inertia += (after.inertia - before.inertia).cwiseAbs();
}

PoseTolerance CalcPoseTolerance(const Node& node, PrintedRobot* robot) {
  constexpr double kLeastAngle = 1e-8;
  constexpr double kLeast = 1e-9;
  PoseTolerance tolerance;
  double reach = 1.0;
  for (const int link : node.chain) {
    AddHalves(
        &robot->link(link).origin, [&] { return CalcNodePose(*robot, node); }, &tolerance);
    reach += robot->link(link).origin.t.norm();
  }
  tolerance.angle += kLeastAngle;
  tolerance.length.array() += kLeast * reach;
  return tolerance;
}

MassProperties CalcBodyTolerance(const Node& node, PrintedRobot* robot) {
  constexpr double kLeast = 1e-9;
  MassProperties tolerance;
  const MassProperties body = CalcNodeBody(*robot, node);
  const auto measure = [&] { return CalcNodeBody(*robot, node); };
  for (const int part : node.parts) {
    AddHalves(&*robot->link(part).inertial, measure, &tolerance);
    for (int link = part; link != node.link; link = robot->link(link).parent)
      AddHalves(&robot->link(link).origin, measure, &tolerance);
  }
  tolerance.mass += kLeast * std::abs(body.mass);
  tolerance.com.array() += kLeast;
  tolerance.inertia.array() += kLeast * std::abs(body.inertia.trace()) + 1e-15;
  return tolerance;
}

}  // namespace dexcheck
