#include "harness/engine/clearance.h"

#include <algorithm>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/engine/map_vector.h"

namespace dexcheck {

namespace {

Pose ReadBody(const BodyPoses& bodies, int body) {
  return MapPose(bodies.rotations + 9 * body, bodies.positions + 3 * body);
}

/// Returns the largest motion of a point within `reach` of the frame's origin, m: the difference of two
/// rotations stretches by its Frobenius norm over sqrt(2).
double BoundMotion(const Pose& from, const Pose& to, double reach) {
  return (to.translation() - from.translation()).norm() +
         std::sqrt(0.5) * (to.linear() - from.linear()).norm() * reach;
}

/// Returns the distance from G's origin to the farthest point that turns with the solid, m. A solid that is
/// round about a point, or about a line's points, is as far from others as these are.
double CalcTurningReach(const Solid& s) {
  if (s.shape == Solid::Shape::kSphere) return 0.0;
  if (s.shape == Solid::Shape::kCapsule) return s.size[1];
  return s.reach;
}

bool IsRoundAboutZ(const Solid& s) {
  return s.shape != Solid::Shape::kBox && s.shape != Solid::Shape::kEllipsoid;
}

/// BoundMotion of a solid that is round about an axis through the frame's origin, whose turn moves nothing.
double BoundRoundMotion(const Pose& from, const Pose& to, const Vector3d& axis, double reach) {
  return (to.translation() - from.translation()).norm() +
         ((to.linear() - from.linear()) * axis).norm() * reach;
}

/// BoundMotion of the solid. @param from, to frame G, which is round about z or not at all.
double BoundSolid(const Solid& s, const Pose& from, const Pose& to) {
  const double reach = CalcTurningReach(s);
  return IsRoundAboutZ(s) ? BoundRoundMotion(from, to, Vector3d::UnitZ(), reach)
                          : BoundMotion(from, to, reach);
}

/// The axis through the body's origin that the solid is round about; zero when there is none. All axes suit a
/// ball there: then `any` is set.
Vector3d FindAxis(const Solid& s, bool* any) {
  constexpr double kOnAxis = 1e-9;  // m
  const Vector3d p = s.X_BG.translation();
  const bool is_ball = s.shape == Solid::Shape::kSphere;
  *any = is_ball && p.norm() < kOnAxis;
  if (is_ball) return *any ? Vector3d::Zero() : Vector3d(p.normalized());
  const Vector3d z = s.X_BG.linear().col(2);
  return IsRoundAboutZ(s) && z.cross(p).norm() < kOnAxis ? z : Vector3d(Vector3d::Zero());
}

/// Returns the largest change of the heights of points within `reach` of the frame's origin, m.
double BoundRise(const Pose& from, const Pose& to, const Vector3d& normal, double reach) {
  return std::abs(normal.dot(to.translation() - from.translation())) +
         ((to.linear() - from.linear()).transpose() * normal).norm() * reach;
}

}  // namespace

Clearance::Frame Clearance::FrameOf(const mjModel& engine, const WatchedPair& pair) const {
  for (const int index : {pair.a, pair.b}) {
    const Solid& s = solid(index);
    if (s.shape == Solid::Shape::kPlane && engine.body_weldid[s.body] == 0) return kOverPlanes;
  }
  const bool with_robot = pair.pairs == PairClass::kRobotItself || pair.pairs == PairClass::kRobotObject;
  return with_robot && base_body_ > 0 ? kOfBase : kOfWorld;
}

Clearance::Clearance(const mjModel& engine, const Adapter& adapter, const Solids& solids,
                     std::vector<WatchedPair> pairs)
    : solids_(&solids), pairs_(std::move(pairs)), states_(pairs_.size()) {
  // The two frames are one where the base does not move.
  const int base = adapter.link_bodies().front();
  base_body_ = base > 0 && engine.body_weldid[base] != 0 ? base : 0;
  std::vector<MovingBody> moving(static_cast<size_t>(engine.nbody));
  for (size_t i = 0; i < pairs_.size(); ++i) {
    const WatchedPair& pair = pairs_[i];
    states_[i].frame = FrameOf(engine, pair);
    for (const int index : {pair.a, pair.b}) {
      const Solid& s = solid(index);
      if (engine.body_weldid[s.body] == 0) {
        const bool is_new = std::ranges::find(planes_, index) == planes_.end();
        if (s.shape == Solid::Shape::kPlane && is_new) planes_.push_back(index);
        continue;
      }
      MovingBody& body = moving[static_cast<size_t>(s.body)];
      if (body.body == 0) body.axis = CalcAxisOfAll(s.body);
      body.body = s.body;
      body.reach = std::max(body.reach, s.X_BG.translation().norm() + CalcTurningReach(s));
      body.counts[states_[i].frame] = true;
    }
    due_[states_[i].frame].push_back({0.0, static_cast<int>(i)});
  }
  for (const MovingBody& body : moving) {
    if (body.body > 0) bodies_.push_back(body);
  }
  overlapping_.reserve(pairs_.size());
  normals_.resize(planes_.size());
}

Vector3d Clearance::CalcAxisOfAll(int body) const {
  constexpr double kParallel = 1e-9;
  Vector3d axis = Vector3d::Zero();
  for (const Solid& s : solids_->list) {
    bool any = false;
    if (s.body != body) continue;
    const Vector3d own = FindAxis(s, &any);
    if (any) continue;
    if (own.isZero() || own.cross(axis).norm() > kParallel) return Vector3d::Zero();
    axis = own;
  }
  return axis;
}

Pose Clearance::PoseOf(int index, const BodyPoses& bodies) const {
  const Solid& s = solid(index);
  return ReadBody(bodies, s.body) * s.X_BG;
}

void Clearance::FollowBodies(const BodyPoses& bodies) {
  const Pose X_0W = ReadBody(bodies, base_body_).inverse(Eigen::Isometry);
  for (size_t i = 0; !has_begun_ && i < planes_.size(); ++i) {
    normals_[i] = PoseOf(planes_[i], bodies).linear().col(2);
  }
  std::array<double, kFrameCount> most = {};
  const auto bound = [&](const MovingBody& body, Frame frame, const Pose& X) {
    if (frame != kOverPlanes) {
      return body.axis.isZero() ? BoundMotion(body.last[frame], X, body.reach)
                                : BoundRoundMotion(body.last[frame], X, body.axis, body.reach);
    }
    double rise = 0.0;
    for (const Vector3d& normal : normals_) {
      rise = std::max(rise, BoundRise(body.last[frame], X, normal, body.reach));
    }
    return rise;
  };
  for (MovingBody& body : bodies_) {
    const Pose X_WB = ReadBody(bodies, body.body);
    for (const Frame frame : kFrames) {
      if (!body.counts[frame]) continue;
      const Pose X = frame == kOfBase ? X_0W * X_WB : X_WB;
      if (has_begun_) most[frame] = std::max(most[frame], bound(body, frame, X));
      body.last[frame] = X;
    }
  }
  // Both bodies of a pair may move, but only one where the other is a plane that stands still.
  for (const Frame frame : kFrames) travel_[frame] += (frame == kOverPlanes ? 1.0 : 2.0) * most[frame];
  has_begun_ = true;
}

void Clearance::Update(const BodyPoses& bodies, double time) {
  FollowBodies(bodies);
  const auto later = [](const Due& x, const Due& y) { return x.travel > y.travel; };
  for (const Frame frame : kFrames) {
    std::vector<Due>& due = due_[frame];
    while (!due.empty() && due.front().travel <= travel_[frame]) {
      std::pop_heap(due.begin(), due.end(), later);
      Due& next = due.back();
      // The budget of a pair that overlaps by rounding alone may be less than travel_ resolves.
      next.travel = std::nextafter(travel_[frame] + CalcBudget(next.pair, bodies, time),
                                   std::numeric_limits<double>::infinity());
      std::push_heap(due.begin(), due.end(), later);
    }
  }
}

void Clearance::Restart() {
  nearest_ = {};
  for (State& state : states_) state.is_measured = false;
  for (const Frame frame : kFrames) {
    for (Due& due : due_[frame]) due.travel = travel_[frame];
  }
}

double Clearance::BoundChange(int index, const Pose& X_AB) const {
  const WatchedPair& pair = pairs_[static_cast<size_t>(index)];
  const Pose& before = states_[static_cast<size_t>(index)].X_AB;
  const Solid& a = solid(pair.a);
  const Solid& b = solid(pair.b);
  // The motion is that of the plane in the other's frame, or of the other in the plane's.
  if (b.shape == Solid::Shape::kPlane) {
    return BoundRise(before.inverse(Eigen::Isometry), X_AB.inverse(Eigen::Isometry), Vector3d::UnitZ(),
                     CalcTurningReach(a));
  }
  if (a.shape == Solid::Shape::kPlane) {
    return BoundRise(before, X_AB, Vector3d::UnitZ(), CalcTurningReach(b));
  }
  // Either body's frame may be used: a wheel that spins does not swing the other around it.
  return std::min(BoundSolid(b, before, X_AB),
                  BoundSolid(a, before.inverse(Eigen::Isometry), X_AB.inverse(Eigen::Isometry)));
}

double Clearance::BoundDistance(const Solid& a, const Solid& b, const Pose& X_AB) {
  if (a.shape == Solid::Shape::kPlane) return X_AB.translation().z() - b.reach;
  if (b.shape == Solid::Shape::kPlane) return X_AB.inverse(Eigen::Isometry).translation().z() - a.reach;
  return X_AB.translation().norm() - a.reach - b.reach;
}

double Clearance::CalcBudget(int index, const BodyPoses& bodies, double time) {
  const WatchedPair& pair = pairs_[static_cast<size_t>(index)];
  State& state = states_[static_cast<size_t>(index)];
  const double smallest = nearest_[static_cast<size_t>(pair.pairs)].distance;
  // A distance above this level need not be known.
  double level = std::max(0.0, smallest - kResolution);
  const Solid& a = solid(pair.a);
  const Solid& b = solid(pair.b);
  const Pose X_WA = PoseOf(pair.a, bodies);
  const Pose X_WB = PoseOf(pair.b, bodies);
  const Pose X_AB = X_WA.inverse(Eigen::Isometry) * X_WB;
  if (state.is_measured) {
    const double moved = BoundChange(index, X_AB);
    const double left = state.overlaps ? kResolution - moved : state.distance - moved - level;
    if (left > 0.0) return left;
  }
  const double between = BoundDistance(a, b, X_AB);
  if (between > level && std::isfinite(smallest)) {
    SetOverlap(index, false);
    return between - level;
  }

  const double distance = CalcDistance(a, X_WA, b, X_WB);
  ++measured_;
  state.distance = distance;
  state.X_AB = X_AB;
  state.is_measured = true;
  Note(index, distance, time);
  level = std::max(0.0, nearest_[static_cast<size_t>(pair.pairs)].distance - kResolution);
  return state.overlaps ? kResolution : distance - level;
}

void Clearance::Note(int index, double distance, double time) {
  Nearest& nearest = nearest_[static_cast<size_t>(pairs_[static_cast<size_t>(index)].pairs)];
  if (distance < nearest.distance) nearest = {distance, time, index};
  SetOverlap(index, distance < 0.0);
}

void Clearance::SetOverlap(int index, bool overlaps) {
  State& state = states_[static_cast<size_t>(index)];
  if (overlaps == state.overlaps) return;
  state.overlaps = overlaps;
  if (overlaps) {
    overlapping_.push_back(index);
  } else {
    overlapping_.erase(std::ranges::find(overlapping_, index));
  }
}

std::pair<double, int> Clearance::FindDeepest() const {
  std::pair<double, int> deepest = {0.0, -1};
  for (const int index : overlapping_) {
    const double depth = -states_[static_cast<size_t>(index)].distance;
    if (depth > deepest.first) deepest = {depth, index};
  }
  return deepest;
}

std::string Clearance::Describe(int index) const {
  const WatchedPair& pair = pairs_[static_cast<size_t>(index)];
  return solid(pair.a).name + " and " + solid(pair.b).name;
}

SelfContact::SelfContact(MjModelPtr model, const std::string& source, const std::vector<std::string>& joints,
                         const VectorXd& usual)
    : model_(std::move(model)), data_(MakeData(*model_)) {
  for (const std::string& name : joints) {
    const int joint = FindByName(*model_, mjOBJ_JOINT, name);
    const bool is_single =
        joint >= 0 && (model_->jnt_type[joint] == mjJNT_HINGE || model_->jnt_type[joint] == mjJNT_SLIDE);
    if (!is_single) throw InputError(source + ": must have a hinge or slide joint " + Quote(name));
    addresses_.push_back(model_->jnt_qposadr[joint]);
  }
  Place(usual);
  for (int i = 0; i < data_->ncon; ++i) usual_.push_back(BodiesOf(data_->contact[i]));
}

double SelfContact::CalcDepth(const VectorXd& q) {
  Place(q);
  double depth = 0.0;
  for (int i = 0; i < data_->ncon; ++i) {
    const mjContact& contact = data_->contact[i];
    if (std::ranges::find(usual_, BodiesOf(contact)) == usual_.end()) depth += std::max(0.0, -contact.dist);
  }
  return depth;
}

void SelfContact::Place(const VectorXd& q) {
  for (size_t i = 0; i < addresses_.size(); ++i) data_->qpos[addresses_[i]] = q[static_cast<Eigen::Index>(i)];
  mj_kinematics(model_.get(), data_.get());
  mj_comPos(model_.get(), data_.get());
  mj_collision(model_.get(), data_.get());
}

std::pair<int, int> SelfContact::BodiesOf(const mjContact& contact) const {
  return std::minmax({model_->geom_bodyid[contact.geom1], model_->geom_bodyid[contact.geom2]});
}

}  // namespace dexcheck
