#include "harness/diagnosis/step_forces.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace dexcheck {
namespace {

using Eigen::Index;

RobotModel AddBodyFrames(const RobotModel& model) {
  RobotSpec spec = model.spec();
  for (int link = -1; link < model.num_joints(); ++link) {
    Frame frame;
    frame.name = "centre of mass of " + model.link_name(link);
    frame.link = link;
    frame.X_LF.translation() =
        link < 0 ? model.base_with_wheels().com : model.joints()[static_cast<size_t>(link)].body.com;
    spec.frames.push_back(frame);
  }
  return RobotModel(std::move(spec));
}

}  // namespace

StepForces::StepForces(const StepStore& store)
    : store_(store),
      model_(AddBodyFrames(store.moving_model())),
      terms_(model_),
      n_(model_.num_velocities()),
      rows_(store.Get(StepStore::kResidual).rows()),
      first_link_(model_.base().type == BaseType::kFixed ? 0 : -1),
      wheels_(model_.num_joints() - store.setup().model().num_joints()),
      dry_(store.setup().model().num_base_velocities() - wheels_),
      gravity_(model_.gravity()) {
  for (int link = first_link_; link < model_.num_joints(); ++link) {
    const MassProperties& body =
        link < 0 ? model_.base_with_wheels() : model_.joints()[static_cast<size_t>(link)].body;
    links_.push_back({Matrix6Xd::Zero(6, n_), Matrix6Xd::Zero(6, n_), Pose::Identity(), &body});
    mass_ += body.mass;
  }
  if (store.setup().has_object()) mass_ += store.setup().declared_object().body.mass;
  constexpr double kEarth = 10.0;  // m/s^2
  weight_ = kEarth * mass_;
}

bool StepForces::SetGravity(const Vector3d& gravity) {
  constexpr double kSame = 1e-9;
  const double change = (std::exchange(gravity_, gravity) - gravity).norm();
  return change > kSame * gravity.norm();
}

void StepForces::SetStep(const Eigen::Ref<const VectorXd>& row) {
  row_ = row;
  terms_.SetState(Now(StepStore::kMotionPosition), Now(StepStore::kMotionVelocity));
  noise_ = store_.CalcNoise(row_);
  const int first_frame = static_cast<int>(model_.frames().size() - links_.size());
  for (size_t i = 0; i < links_.size(); ++i) {
    const int frame = first_frame + static_cast<int>(i);
    terms_.CalcFrameJacobian(frame, links_[i].J, links_[i].J_dot);
    links_[i].X = terms_.CalcFramePose(frame);
    for (size_t k = 0; k < i; ++k)
      reach_ = std::max(reach_, (links_[i].X.translation() - links_[k].X.translation()).norm());
  }
}

Turns StepForces::ListTurns() const {
  Turns turns;
  for (const Link& link : links_) turns.push_back(link.X.linear());
  turns.emplace_back(Now(StepStore::kObjectPose).head<9>().reshaped(3, 3));
  return turns;
}

namespace {

using namespace force_fault;

constexpr double kFarthest = 10.0;  // rad or m: where springs relax
constexpr double kStill = 1e-3;     // rad or m
constexpr double kHidden = 0.1;     // by so much of the reach a centre of mass may be off along an axis

/// I a by the six entries Ixx, Iyy, Izz, Ixy, Ixz, Iyz of I.
Eigen::Matrix<double, 3, 6> InertiaTimes(const Vector3d& a) {
  Eigen::Matrix<double, 3, 6> columns;
  columns << a.x(), 0, 0, a.y(), a.z(), 0, 0, a.y(), 0, a.x(), 0, a.z(), 0, 0, a.z(), 0, a.x(), a.y();
  return columns;
}

/// Wrench [force; moment] about a body's centre of mass, in its axes, that its inertia takes, by its mass,
/// centre of mass and inertia.
struct BodyWrench {
  Vector6d mass;                             // of 1 kg more at the centre of mass
  Eigen::Matrix<double, 6, 3> first_moment;  // of 1 kg m
  Eigen::Matrix<double, 6, 6> inertia;

  /// @param a acceleration of the centre of mass less gravity. All in the body's axes.
  BodyWrench(const Vector3d& a, const Vector3d& w, const Vector3d& w_dot) {
    mass << a, Vector3d::Zero();
    first_moment << Skew(w_dot) + Skew(w) * Skew(w), -Skew(a);
    inertia << Eigen::Matrix<double, 3, 6>::Zero(), InertiaTimes(w_dot) + Skew(w) * InertiaTimes(w);
  }
};

}  // namespace

Candidate& StepForces::Next(const char* fault, const std::string& place, const std::string& unit,
                            double nominal, const VectorXd& scale) {
  if (next_ == candidates_->size()) {
    candidates_->push_back({.fault = fault,
                            .place = place,
                            .unit = unit,
                            .nominal = nominal,
                            .columns = MatrixXd::Zero(rows() * steps_, scale.size()),
                            .scale = scale});
    // Masses, frictions and the like are not negative.
    constexpr double kRounding = 1e-6;
    if (scale.size() == 1 && std::string_view(fault) != "torque")
      candidates_->back().is_possible = [=](const VectorXd& a) {
        return a[0] >= -nominal * (1.0 + kRounding);
      };
  }
  return (*candidates_)[next_++];
}

void StepForces::AddRobot(Candidate* candidate, const Eigen::Ref<const MatrixXd>& f) const {
  RowsOf(candidate).topRows(n_) = noise_.head(n_).cwiseInverse().asDiagonal() * f;
}

void StepForces::AddObject(Candidate* candidate, const Matrix6Xd& w) const {
  RowsOf(candidate).bottomRows<6>() = noise_.tail<6>().cwiseInverse().asDiagonal() * w;
}

void StepForces::AddColumns(Index begin, Index steps, std::vector<Candidate>* candidates) {
  candidates_ = candidates;
  begin_ = begin;
  steps_ = steps;
  next_ = 0;
  AddJoints();
  const VectorXd nu_dot = Now(StepStore::kMotionAcceleration);
  for (int index = first_link_; index < model_.num_joints(); ++index) {
    const Link& link = links_[static_cast<size_t>(index - first_link_)];
    AddBody("link " + model_.link_name(index), *link.body, link.X.linear(), link.J * terms_.velocity(),
            link.J * nu_dot + link.J_dot * terms_.velocity(), &link);
  }
  if (store_.setup().has_object()) AddObjectForces();
  AddGravity();
}

void StepForces::AddJoints() {
  const VectorXd q = Now(StepStore::kMotionPosition);
  const VectorXd rate = Now(StepStore::kMotionVelocity);
  const VectorXd acceleration = Now(StepStore::kMotionAcceleration);
  for (int dof = 0; dof < model_.num_dofs(); ++dof) {
    const Index i = model_.num_base_velocities() + dof;
    const Joint& joint = model_.joint(model_.joint_of_dof(dof));
    const bool slides = joint.type == JointType::kPrismatic;
    const std::string force = slides ? "N" : "N m";
    const std::string place = "joint " + model_.dof_name(dof);
    const VectorXd f = VectorXd::Unit(n_, i);
    const auto add = [&](const char* fault, const std::string& unit, double nominal, const VectorXd& scale,
                         double size) {
      AddRobot(&Next(fault, place, unit, nominal, scale), VectorXd(size * f));
    };
    add("torque", force, 0.0, Weights(1), 1.0);
    add("armature", slides ? "kg" : "kg m^2", joint.armature, Masses(1), -acceleration[i]);
    add("viscous friction", slides ? "N s/m" : "N m s/rad", joint.damping, Weights(1), -rate[i]);
    const double sign = rate[i] > 0.0 ? 1.0 : rate[i] < 0.0 ? -1.0 : 0.0;
    if (const Index known_row = FindDryFriction(dof); known_row >= 0) {
      // The plant says it, also for a joint that sticks. The largest value is reported.
      const double known = Now(StepStore::kDryFriction)[known_row];
      Candidate& bearing = Next(kBearing, place, force, 0.0, VectorXd::Ones(1));
      bearing.nominal = std::max(bearing.nominal, std::abs(known));
      bearing.fitted = VectorXd::Constant(1, joint.dry_friction);
      bearing.parameters = -1;  // its size is known
      AddRobot(&bearing, VectorXd(known * f));
    }
    add("dry friction", force, joint.dry_friction, Weights(1), -sign);
    if (joint.type == JointType::kBall) continue;
    MatrixXd spring(n_, 2);
    const double at = q[model_.position_index(model_.joint_of_dof(dof))];
    spring << -at * f, f;
    Candidate& candidate = Next("spring", place, slides ? "N/m" : "N m/rad", 0.0, Weights(2));
    candidate.is_ordinary = true;
    if (candidate.fitted.size() == 0) candidate.fitted = Vector2d(at, at);
    candidate.fitted = Vector2d(std::min(at, candidate.fitted[0]), std::max(at, candidate.fitted[1]));
    // A joint that hardly moves may show only its torque there, which any stiffness makes.
    const bool is_still = candidate.fitted[1] - candidate.fitted[0] <= kStill;
    candidate.is_possible = [at, is_still](const VectorXd& a) {
      const bool is_hidden = is_still && std::abs(a[0] + at * a[1]) <= kStill * a.norm();
      return is_hidden || (a[0] > 0.0 && std::abs(a[1]) <= kFarthest * a[0]);
    };
    AddRobot(&candidate, spring);
  }
}

void StepForces::AddBody(const std::string& place, const MassProperties& body, const Matrix3d& R,
                         const Vector6d& V, const Vector6d& V_dot, const Link* link) {
  const Matrix3d R_T = R.transpose(), zero = Matrix3d::Zero(), one = Matrix3d::Identity();
  const auto add = [&](Candidate& candidate, const Matrix6Xd& w) {
    if (link == nullptr) return AddObject(&candidate, w);
    AddRobot(&candidate, MatrixXd(link->J.transpose() * w));
  };
  const auto push = [&](const char* fault, const char* unit, const Matrix3d& force, const Matrix3d& moment) {
    Matrix6Xd w(6, 3);
    w << force, moment;
    add(Next(fault, place, unit, 0.0, Weights(3)), w);
  };
  push(kForce, "N", R_T, zero);
  push(kForceInAxes, "N", one, zero);
  push("moment", "N m", zero, R_T);
  push(kMomentInAxes, "N m", zero, one);
  Matrix6d both = Matrix6d::Identity();
  Candidate& force = Next(kForceAtPointInAxes, place, "N", 0.0, Weights(6));
  // Its moment about the centre of mass is across it.
  force.is_possible = [this](const VectorXd& a) {
    constexpr double kAcross = 1e-3;
    const Vector3d f = a.head<3>(), m = a.tail<3>();
    return std::abs(f.dot(m)) <= kAcross * f.norm() * m.norm() && m.norm() <= reach_ * f.norm();
  };
  add(force, both);
  both.topLeftCorner<3, 3>() = both.bottomRightCorner<3, 3>() = R_T;
  add(Next("force and moment", place, "N", 0.0, Weights(6)), both);
  if (!(body.mass > 0.0)) return;
  const Vector3d w = V.tail<3>();
  const BodyWrench wrench(V_dot.head<3>() + w.cross(V.head<3>()) - R_T * gravity_, w, V_dot.tail<3>());
  add(Next("mass", place, "kg", body.mass, Masses(1)), -wrench.mass);
  if (link != nullptr) {
    // The whole body times a factor.
    add(Next(kMassWithInertia, place, "kg", body.mass, Masses(1)),
        -wrench.mass - wrench.inertia * ToEntries(body.inertia) / body.mass);
  }
  add(Next("inertia", place, "kg m^2", 0.0, Masses(6)), -wrench.inertia);
  // Another centre of mass changes the inertia about the old one.
  Matrix6Xd com(6, 9), payload(6, 10);
  com << -wrench.first_moment * body.mass, -wrench.inertia;
  add(Next(kCenterAlone, place, "m", 0.0, VectorXd::Ones(3)), com.leftCols<3>());
  VectorXd moved = Masses(9);  // a centre of mass, and the inertia about the old one
  moved.head<3>().setOnes();
  Candidate& center = Next(kCenter, place, "m", 0.0, moved);
  // By d it changes the inertia by m (d^T d 1 - d d^T), of which not all of d need show.
  center.is_possible = [m = body.mass, hidden = kHidden * reach_](const VectorXd& a) {
    const double d = a.head<3>().norm() + hidden;
    return a.tail<6>().norm() <= 2.0 * m * d * d;
  };
  add(center, com);
  if (link == nullptr) return;
  payload << -wrench.mass, -wrench.first_moment, -wrench.inertia;
  Candidate& load = Next("payload", place, "kg", 0.0, Masses(10));
  // Its mass, place and inertia are worth several faults of one number.
  load.parameters = 3;
  load.is_possible = [reach = reach_](const VectorXd& a) { return a.segment<3>(1).norm() <= reach * a[0]; };
  add(load, payload);
}

void StepForces::AddObjectForces() {
  const VectorXd pose = Now(StepStore::kObjectPose);
  const VectorXd motion = Now(StepStore::kObjectMotion);
  const Matrix3d R = pose.head<9>().reshaped(3, 3);
  const ObjectModel& object = store_.setup().declared_object();
  const std::string place = "object " + object.name;
  AddBody(place, object.body, R, motion.head<6>(), motion.tail<6>(), nullptr);
  Vector6d drag = Vector6d::Zero();
  drag.head<3>() = -motion.head<3>();
  AddObject(&Next("drag", place, "N s/m", 0.0, Weights(1)), drag);
  Matrix6Xd tether = Matrix6Xd::Zero(6, 4);
  tether.topRows<3>() << -R.transpose() * pose.tail<3>(), R.transpose();
  AddObject(&Next("tether", place, "N/m", 0.0, Weights(4)), tether);
}

void StepForces::AddGravity() {
  // f = sum_b m_b J_b^T dg, w = [m R^T dg; 0]
  MatrixXd weights = MatrixXd::Zero(n_, 3);
  for (const Link& link : links_)
    weights += link.body->mass * link.J.topRows<3>().transpose() * link.X.linear().transpose();
  Candidate& gravity = Next(kGravity, kWorld, "m/s^2", 0.0, VectorXd::Constant(3, 20.0));
  AddRobot(&gravity, weights);
  if (store_.setup().has_object()) {
    Matrix6Xd object = Matrix6Xd::Zero(6, 3);
    const VectorXd pose = Now(StepStore::kObjectPose);
    object.topRows<3>() =
        store_.setup().declared_object().body.mass * pose.head<9>().reshaped(3, 3).transpose();
    AddObject(&gravity, object);
  }
  const MatrixXd all = RowsOf(&gravity);
  Candidate& size = Next(kGravitySize, kWorld, "m/s^2", 0.0, gravity.scale.head(1));
  size.is_possible = nullptr;
  RowsOf(&size) = all * model_.gravity().normalized();
}

ForceSteps ListForceSteps(const StepStore& store) {
  // Steps that are looked at, beside those at jumps: fewer of a robot with many joints; and between two
  // jumps.
  constexpr size_t kMostSteps = 20, kLeastSteps = 8, kRows = 400, kFewestBetween = 4;
  ForceSteps steps;
  std::vector<Index> differing;
  for (Index i = 0; i < store.size(); ++i) {
    const auto row = store.Row(i);
    if (store.HasForces(row) &&
        (store.Part(row, StepStore::kResidual).cwiseAbs().array() > kFails * store.CalcNoise(row).array())
            .any())
      differing.push_back(i);
  }
  if (differing.empty()) return steps;
  for (Index i = differing.front(); i <= differing.back(); ++i)
    if (store.HasForces(store.Row(i))) steps.all.push_back(i);
  const auto time = store.Get(StepStore::kTime);
  std::vector<const StepStore::Jump*> jumps;
  for (const StepStore::Jump& jump : store.jumps())
    if (jump.before[0] >= time(0, steps.all.front()) && jump.after[0] <= time(0, steps.all.back()))
      jumps.push_back(&jump);
  // Evenly over all steps, and some between any two jumps.
  std::map<double, VectorXd> rows;  // by time
  const auto add = [&](size_t first, size_t last, size_t count) {
    for (size_t k = 0; k < count && last > first; ++k) {
      const Index step = steps.all[first + (count == 1 ? 0 : k * (last - 1 - first) / (count - 1))];
      rows.emplace(time(0, step), store.Row(step));
    }
  };
  const auto entries = static_cast<size_t>(store.Get(StepStore::kResidual).rows());
  add(0, steps.all.size(), std::min(steps.all.size(), std::clamp(kRows / entries, kLeastSteps, kMostSteps)));
  size_t first = 0;
  for (size_t j = 0; j <= jumps.size() && !jumps.empty(); ++j) {
    size_t last = first;
    while (last < steps.all.size() && (j == jumps.size() || time(0, steps.all[last]) < jumps[j]->after[0]))
      ++last;
    add(first, last, kFewestBetween);
    first = last;
  }
  for (const StepStore::Jump* const jump : jumps) {
    rows.emplace(jump->before[0], jump->before);
    rows.emplace(jump->after[0], jump->after);
  }
  for (const auto& [when, row] : rows) {
    const auto jump = std::ranges::find(jumps, when, [](const auto* one) { return one->after[0]; });
    if (jump != jumps.end()) {
      steps.begins.push_back(static_cast<Index>(steps.rows.size()));
      steps.changes.push_back((*jump)->change);
    }
    steps.rows.push_back(row);
  }
  return steps;
}

}  // namespace dexcheck
