#include "harness/engine/clearance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "harness/engine/torus_collision.h"

namespace dexcheck {
namespace {

using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Distance up to which the engine measures, m: what is farther apart is left alone until it may be near.
constexpr double kLook = 0.02;
/// Least distance until a pair that nearly touches is looked at again, m: the step after the next at 0.1 m/s.
constexpr double kLeastWay = 1e-4;
/// Links that are this many joints apart are built into each other.
constexpr int kBuiltTogether = 2;

bool CollidesByItself(const mjModel& m, int geom) {
  return m.geom_contype[geom] != 0 || m.geom_conaffinity[geom] != 0;
}

bool IsScenery(const mjModel& m, int body) {
  if (m.body_weldid[body] != 0) return false;
  if (body == 0) return true;
  // The base of a robot stands still but carries what moves.
  for (int b = body + 1; b < m.nbody; ++b) {
    if (m.body_weldid[b] == 0) continue;
    for (int parent = b; parent > 0; parent = m.body_parentid[parent]) {
      if (parent == body) return false;
    }
  }
  return true;
}

}  // namespace

Clearance::Clearance(const mjModel& model) : model_(mj_copyModel(nullptr, &model)), data_(MakeData(*model_)) {
  InstallTorusCollision();
  MakeGroups();
  MakePairs();
  looked_at_.reserve(pairs_.size());
}

void Clearance::MakeGroups() {
  const mjModel& m = *model_;
  const MjDataPtr reference = MakeData(m);
  mj_kinematics(&m, reference.get());
  group_of_.assign(static_cast<size_t>(m.nbody), -1);
  // One of scenery, one for what stands still but belongs to a robot, and one for each body that moves.
  constexpr int kSceneryKey = -1;
  std::vector<int> keys;
  for (int body = 0; body < m.nbody; ++body) {
    const int key = IsScenery(m, body) ? kSceneryKey : m.body_weldid[body];
    const auto found = std::find(keys.begin(), keys.end(), key);
    group_of_[static_cast<size_t>(body)] = static_cast<int>(found - keys.begin());
    if (found != keys.end()) continue;
    keys.push_back(key);
    groups_.emplace_back().body = std::max(0, key);
  }
  for (size_t i = 0; i < groups_.size(); ++i) {
    Group& group = groups_[i];
    bool any = false;
    for (int geom = 0; geom < m.ngeom; ++geom) {
      const bool own = group_of_[static_cast<size_t>(m.geom_bodyid[geom])] == static_cast<int>(i);
      any = any || (own && CollidesByItself(m, geom));
    }
    for (int geom = 0; geom < m.ngeom; ++geom) {
      if (group_of_[static_cast<size_t>(m.geom_bodyid[geom])] != static_cast<int>(i)) continue;
      if (!any || CollidesByItself(m, geom)) AddPart(geom, *reference, &group);
    }
    for (const Part& part : group.parts)
      group.center += part.center / static_cast<double>(group.parts.size());
    for (const Part& part : group.parts) {
      group.radius = std::max(group.radius, (part.center - group.center).norm() + part.radius);
    }
  }
}

void Clearance::AddPart(int geom, const mjData& reference, Group* group) const {
  mjModel& m = *model_;
  if (m.geom_type[geom] == mjGEOM_HFIELD) return;
  const auto pose = [&](const mjtNum* p, const mjtNum* R) {
    Pose X = Pose::Identity();
    X.translation() = Eigen::Map<const Vector3d>(p);
    X.linear() = Eigen::Map<const RowMatrix3d>(R);
    return X;
  };
  const Pose X_body = pose(reference.xpos + 3 * group->body, reference.xmat + 9 * group->body);
  Pose X_geom = pose(reference.geom_xpos + 3 * geom, reference.geom_xmat + 9 * geom);
  Part part{.geom = geom, .center = {}, .R = {}, .radius = m.geom_rbound[geom]};
  double tube_radius = 0.0;
  if (GetTorusRadii(m, geom, &part.ring_radius, &tube_radius)) {
    // About its body's frame; see torus_collision.h. Its balls roll around the ring.
    const int body = m.geom_bodyid[geom];
    X_geom = pose(reference.xpos + 3 * body, reference.xmat + 9 * body);
    part.radius = part.ring_radius + tube_radius;
    m.geom_type[geom] = mjGEOM_SPHERE;
    m.geom_size[3 * geom] = tube_radius;
    m.geom_rbound[geom] = tube_radius;
  }
  if (m.geom_type[geom] == mjGEOM_PLANE) part.radius = kInfinity;
  const Pose X = X_body.inverse(Eigen::Isometry) * X_geom;
  part.center = X.translation();
  part.R = X.linear();
  group->parts.push_back(part);
}

bool Clearance::AreBuiltTogether(int body1, int body2) const {
  const mjModel& m = *model_;
  // The way up to the world, by what moves as one; a free body hangs on nothing.
  const auto list_up = [&](int body) {
    std::vector<int> up;
    for (int b = m.body_weldid[body];; b = m.body_weldid[m.body_parentid[b]]) {
      up.push_back(b);
      if (b == 0) break;
      const bool is_free = m.body_jntnum[b] > 0 && m.jnt_type[m.body_jntadr[b]] == mjJNT_FREE;
      if (is_free) break;
    }
    return up;
  };
  const std::vector<int> up1 = list_up(body1);
  const std::vector<int> up2 = list_up(body2);
  for (size_t i = 0; i < up1.size(); ++i) {
    const auto found = std::find(up2.begin(), up2.end(), up1[i]);
    if (found == up2.end()) continue;
    return i + static_cast<size_t>(found - up2.begin()) <= kBuiltTogether;
  }
  return false;
}

void Clearance::MakePairs() {
  const mjModel& m = *model_;
  std::set<std::pair<int, int>> looked_for;
  for (int k = 0; k < m.npair; ++k) {
    const int a = group_of_[static_cast<size_t>(m.geom_bodyid[m.pair_geom1[k]])];
    const int b = group_of_[static_cast<size_t>(m.geom_bodyid[m.pair_geom2[k]])];
    looked_for.insert(std::minmax(a, b));
  }
  const auto is_still = [&](const Group& group) { return m.body_weldid[group.body] == 0; };
  const auto is_scenery = [&](int index) { return group_of_[0] == index; };
  Move(nullptr, nullptr);
  for (int a = 0; a < static_cast<int>(groups_.size()); ++a) {
    for (int b = a + 1; b < static_cast<int>(groups_.size()); ++b) {
      const Group& first = groups_[static_cast<size_t>(a)];
      const Group& second = groups_[static_cast<size_t>(b)];
      if (first.parts.empty() || second.parts.empty()) continue;
      if (is_still(first) && is_still(second)) continue;
      if (looked_for.contains({a, b})) continue;
      const bool links = !is_scenery(a) && !is_scenery(b);
      if (links && AreBuiltTogether(first.body, second.body)) continue;
      Pair pair{a, b, {}, 0.0};
      if (links) AllowOverlaps(&pair);
      queue_.push_back(static_cast<int>(pairs_.size()));
      pairs_.push_back(std::move(pair));
    }
  }
}

void Clearance::AllowOverlaps(Pair* pair) {
  const Group& first = groups_[static_cast<size_t>(pair->first)];
  const Group& second = groups_[static_cast<size_t>(pair->second)];
  for (size_t i = 0; i < first.parts.size(); ++i) {
    for (size_t k = 0; k < second.parts.size(); ++k) {
      if (MeasureParts(first, first.parts[i], second, second.parts[k]) < 0.0)
        pair->allowed.emplace_back(static_cast<int>(i), static_cast<int>(k));
    }
  }
}

void Clearance::Move(const mjtNum* xpos, const mjtNum* xmat) {
  // Without poses: those of the reference.
  if (xpos == nullptr) {
    mj_kinematics(model_.get(), data_.get());
    xpos = data_->xpos;
    xmat = data_->xmat;
  }
  double farthest = 0.0;
  for (Group& group : groups_) {
    const Eigen::Map<const Vector3d> p(xpos + 3 * group.body);
    const Eigen::Map<const RowMatrix3d> R(xmat + 9 * group.body);
    const Vector3d center = p + R * group.center;
    if (std::isfinite(group.radius)) {
      // No point of the group has moved farther than its centre and its turn about that.
      const double turn = (R - group.X.linear()).norm();
      farthest = std::max(farthest, (center - group.center_now).norm() + group.radius * turn);
    }
    group.X.translation() = p;
    group.X.linear() = R;
    group.center_now = center;
  }
  way_ += 2.0 * farthest;
}

void Clearance::Place(const Group& group, const Part& part, const Vector3d& shift) {
  Eigen::Map<Vector3d>(data_->geom_xpos + 3 * part.geom) = group.X * (part.center + part.R * shift);
  Eigen::Map<RowMatrix3d>(data_->geom_xmat + 9 * part.geom) = group.X.linear() * part.R;
}

double Clearance::MeasureGeoms(int geom1, int geom2) {
  const mjModel& m = *model_;
  if (m.geom_type[geom1] > m.geom_type[geom2]) std::swap(geom1, geom2);
  const mjfCollision collide = mjCOLLISIONFUNC[m.geom_type[geom1]][m.geom_type[geom2]];
  if (collide == nullptr) return kInfinity;
  mjContact contacts[mjMAXCONPAIR];
  const int count = collide(model_.get(), data_.get(), contacts, geom1, geom2, kLook);
  double least = kLook;
  for (int i = 0; i < count; ++i) least = std::min(least, contacts[i].dist);
  return least;
}

double Clearance::MeasureParts(const Group& a, const Part& part_a, const Group& b, const Part& part_b) {
  const Part& plane = std::isinf(part_a.radius) ? part_a : part_b;
  const Part& other = std::isinf(part_a.radius) ? part_b : part_a;
  const Group& plane_group = std::isinf(part_a.radius) ? a : b;
  const Group& other_group = std::isinf(part_a.radius) ? b : a;
  double apart = 0.0;
  if (std::isinf(plane.radius)) {
    const Vector3d normal = plane_group.X.linear() * plane.R.col(2);
    apart = normal.dot(other_group.X * other.center - plane_group.X * plane.center) - other.radius;
  } else {
    apart = (a.X * part_a.center - b.X * part_b.center).norm() - part_a.radius - part_b.radius;
  }
  if (apart > kLook) return apart;
  const auto count_balls = [](const Part& part) { return part.ring_radius > 0.0 ? kTorusBalls : 1; };
  const auto shift = [](const Part& part, int ball) {
    const double angle = 2.0 * kPi * ball / kTorusBalls;
    return Vector3d(part.ring_radius * std::cos(angle), part.ring_radius * std::sin(angle), 0.0);
  };
  double least = kInfinity;
  for (int i = 0; i < count_balls(part_a); ++i) {
    Place(a, part_a, shift(part_a, i));
    for (int k = 0; k < count_balls(part_b); ++k) {
      Place(b, part_b, shift(part_b, k));
      least = std::min(least, MeasureGeoms(part_a.geom, part_b.geom));
    }
  }
  return least;
}

double Clearance::Measure(const Pair& pair) {
  const Group& first = groups_[static_cast<size_t>(pair.first)];
  const Group& second = groups_[static_cast<size_t>(pair.second)];
  const double apart = (first.center_now - second.center_now).norm() - first.radius - second.radius;
  if (apart > kLook) return apart;
  double least = kInfinity;
  for (size_t i = 0; i < first.parts.size(); ++i) {
    for (size_t k = 0; k < second.parts.size(); ++k) {
      if (std::find(pair.allowed.begin(), pair.allowed.end(),
                    std::pair(static_cast<int>(i), static_cast<int>(k))) != pair.allowed.end())
        continue;
      least = std::min(least, MeasureParts(first, first.parts[i], second, second.parts[k]));
    }
  }
  return least;
}

const Overlap& Clearance::Find(const mjtNum* xpos, const mjtNum* xmat) {
  Move(xpos, xmat);
  if (is_first_) way_ = 0.0;
  is_first_ = false;
  overlap_ = Overlap{};
  const auto later = [&](int a, int b) {
    return pairs_[static_cast<size_t>(a)].due > pairs_[static_cast<size_t>(b)].due;
  };
  looked_at_.clear();
  while (!queue_.empty() && pairs_[static_cast<size_t>(queue_.front())].due <= way_) {
    std::pop_heap(queue_.begin(), queue_.end(), later);
    const int index = queue_.back();
    queue_.pop_back();
    Pair& pair = pairs_[static_cast<size_t>(index)];
    const double apart = Measure(pair);
    if (-apart > overlap_.depth) {
      overlap_ = {-apart, groups_[static_cast<size_t>(pair.first)].body,
                  groups_[static_cast<size_t>(pair.second)].body};
    }
    // What overlaps is measured at every step.
    pair.due = apart < 0.0 ? way_ : way_ + std::max(apart, kLeastWay);
    looked_at_.push_back(index);
  }
  for (const int index : looked_at_) {
    queue_.push_back(index);
    std::push_heap(queue_.begin(), queue_.end(), later);
  }
  return overlap_;
}

}  // namespace dexcheck
