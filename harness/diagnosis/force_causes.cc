#include "harness/diagnosis/force_causes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include "controller/common/text.h"
#include "controller/dynamics/tree_factor.h"
#include "controller/model/platform.h"
#include "harness/diagnosis/cause_estimator.h"

namespace dexcheck {
namespace {

using Eigen::Index;

// Columns agree with what a fault does to this fraction: platforms tilt, and wheels slip, by as much.
constexpr double kAccuracy = 1e-4;
// What is left over may be this many times the noise and is explained all the same.
constexpr double kLeft = 3.0;
// And of what there is to explain, squared, at least this fraction.
constexpr double kExplains = 0.99;
constexpr Index kMostSteps = 20;  // that are looked at
constexpr size_t kMostSegments = 8;
// Residuals that change by more than this from one step to the next, in units of noise, and by this many
// times what they change in the steps around, have begun, or ended.
constexpr double kJumpNoise = 1.0, kJump = 5.0;
// Gravity whose size differs by less than this fraction of its change only points elsewhere.
constexpr double kTilted = 0.2;

constexpr double kFarthest = 10.0;  // rad or m: where springs relax, and loads are
constexpr const char* kBearing = "dry friction of the bearing";
constexpr const char* kWorld = "world";
constexpr const char* kForce = "force at its centre of mass";
constexpr const char* kForceInAxes = "force at its centre of mass, in its axes";
constexpr const char* kMomentInAxes = "moment, in its axes";
constexpr const char* kMassWithInertia = "mass and inertia";

Matrix3d Cross(const Vector3d& a) {
  Matrix3d A;
  A << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return A;
}

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
    first_moment << Cross(w_dot) + Cross(w) * Cross(w), -Cross(a);
    inertia << Eigen::Matrix<double, 3, 6>::Zero(), InertiaTimes(w_dot) + Cross(w) * InertiaTimes(w);
  }
};

/// A model with a frame at each link's centre of mass, after its own frames.
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

/// Residual and columns of one step.
class StepForces {
 public:
  explicit StepForces(const StepStore& store)
      : store_(store),
        model_(AddBodyFrames(store.setup().declared_model())),
        terms_(model_),
        factor_(model_),
        actuation_(model_),
        n_(model_.num_velocities()) {
    if (model_.base().type != BaseType::kFixed) mass_ = model_.base_with_wheels().mass;
    for (const Joint& joint : model_.joints()) mass_ += joint.body.mass;
    if (store.setup().has_object()) mass_ += store.setup().declared_object().body.mass;
    gravity_ = model_.gravity();
    constexpr double kEarth = 10.0;  // m/s^2
    weight_ = kEarth * mass_;
  }

  [[nodiscard]] Index rows() const { return n_ + 6; }
  [[nodiscard]] const RobotModel& model() const { return model_; }
  /// In which masses that differ fall, m/s^2; the model's at first.
  void SetGravity(const Vector3d& gravity) { gravity_ = gravity; }

  void SetStep(Index step) {
    step_ = step;
    terms_.SetState(store_.Get(StepStore::kPosition).col(step), store_.Get(StepStore::kVelocity).col(step));
    terms_.CalcDynamics();
    factor_.Compute(terms_.M());
    noise_ = store_.Get(StepStore::kNoise).col(step);
    const ObjectModel& object = store_.setup().declared_object();
    arm_ = std::sqrt(object.body.inertia.trace() / object.body.mass);
  }

  /// Robot's force and object's wrench, whitened.
  template <typename Robot, typename Object>
  [[nodiscard]] VectorXd Whiten(const Robot& f, const Object& w) {
    VectorXd y(rows());
    y.head(n_) = f;
    factor_.SolveTransposed(y.head(n_));
    y.head(n_) /= std::max(noise_[0], std::numeric_limits<double>::min());
    y.segment<3>(n_) = w.template head<3>();
    y.tail<3>() = w.template tail<3>() / arm_;
    y.tail<6>() /= std::max(noise_[1], std::numeric_limits<double>::min());
    if (!store_.setup().has_object()) y.tail<6>().setZero();
    return y;
  }
  [[nodiscard]] VectorXd CalcResidual() {
    return Whiten(store_.Get(StepStore::kRobotResidual).col(step_),
                  store_.Get(StepStore::kObjectResidual).col(step_));
  }

  /// Adds this step's rows to each candidate: `begin` is the first of them.
  void AddColumns(Index begin, Index steps, std::vector<Candidate>* candidates);

 private:
  /// The next candidate of the list, made at the first step. @param scale plausible sizes.
  Candidate& Next(std::vector<Candidate>* candidates, const char* fault, const std::string& place,
                  const std::string& unit, double nominal, const VectorXd& scale) {
    if (next_ == candidates->size()) {
      candidates->push_back({.fault = fault,
                             .place = place,
                             .unit = unit,
                             .nominal = nominal,
                             .columns = MatrixXd::Zero(rows() * steps_, scale.size()),
                             .scale = scale});
      // Masses, frictions and the like are not negative.
      constexpr double kRounding = 1e-6;
      if (scale.size() == 1 && std::string_view(fault) != "torque")
        candidates->back().is_possible = [=](const VectorXd& a) {
          return a[0] >= -nominal * (1.0 + kRounding);
        };
    }
    return (*candidates)[next_++];
  }
  /// Plausible sizes of `count` amplitudes: that times the weight or mass of all.
  [[nodiscard]] VectorXd Weights(Index count, double times = 1.0) const {
    return VectorXd::Constant(count, times * weight_);
  }
  /// Of a centre of mass, and of the inertia about the old one.
  [[nodiscard]] VectorXd Moved() const {
    VectorXd scale = Masses(9);
    scale.head<3>().setOnes();
    return scale;
  }
  [[nodiscard]] VectorXd Masses(Index count, double times = 1.0) const {
    return VectorXd::Constant(count, times * mass_);
  }
  template <typename Columns>
  void AddRobot(Candidate* candidate, const Columns& f) {
    for (Index k = 0; k < f.cols(); ++k)
      candidate->columns.col(k).segment(begin_, rows()) = Whiten(f.col(k), Vector6d::Zero());
  }
  template <typename Columns>
  void AddObject(Candidate* candidate, const Columns& w) {
    for (Index k = 0; k < w.cols(); ++k)
      candidate->columns.col(k).segment(begin_, rows()) = Whiten(VectorXd::Zero(n_), Vector6d(w.col(k)));
  }
  void AddJoints(std::vector<Candidate>* candidates);
  void AddLink(int link, std::vector<Candidate>* candidates);
  void AddObjectForces(std::vector<Candidate>* candidates);
  void AddGravity(std::vector<Candidate>* candidates);
  void AddWheels(std::vector<Candidate>* candidates);

  const StepStore& store_;
  RobotModel model_;
  ModelTerms terms_;
  TreeFactor factor_;
  ActuationMap actuation_;
  Index n_;
  Index step_ = 0, begin_ = 0, steps_ = 1;
  size_t next_ = 0;
  Vector2d noise_ = Vector2d::Ones();
  double arm_ = 1.0;
  double mass_ = 0.0, weight_ = 0.0;  // of all, kg and N
  Vector3d gravity_;
};

void StepForces::AddColumns(Index begin, Index steps, std::vector<Candidate>* candidates) {
  begin_ = begin;
  steps_ = steps;
  next_ = 0;
  AddJoints(candidates);
  const bool is_fixed = model_.base().type == BaseType::kFixed;
  for (int link = is_fixed ? 0 : -1; link < model_.num_joints(); ++link) AddLink(link, candidates);
  if (store_.setup().has_object()) AddObjectForces(candidates);
  AddGravity(candidates);
  if (model_.base().type == BaseType::kDifferentialDrive && model_.base().velocity == DriveVelocity::kTwist)
    AddWheels(candidates);
}

void StepForces::AddWheels(std::vector<Candidate>* candidates) {
  // Net torques of the wheels push the platform by W^T, and wheels that are farther apart turn with it.
  const Base& base = model_.base();
  const Vector2d tau = store_.Get(StepStore::kTauReceived).col(step_).head<2>();
  const Vector2d v = store_.Get(StepStore::kVelocity).col(step_).head<2>();
  const Vector2d v_dot = store_.Get(StepStore::kAcceleration).col(step_).head<2>();
  const auto push = [&](const Vector3d& r_r_l_b) {
    Matrix2d W;
    W << 1.0 / r_r_l_b[0], 0.5 * r_r_l_b[2] / r_r_l_b[0], 1.0 / r_r_l_b[1], -0.5 * r_r_l_b[2] / r_r_l_b[1];
    const WheelProperties& wheel = base.wheel;
    Vector2d f =
        W.transpose() * (tau - (wheel.spin_inertia + wheel.armature) * (W * v_dot) - wheel.damping * (W * v));
    f[1] -= 0.5 * wheel.mass * r_r_l_b[2] * r_r_l_b[2] * v_dot[1];
    return f;
  };
  const Vector3d nominal(base.wheel_radius, base.wheel_radius, base.wheel_distance);
  constexpr double kStep = 1e-6;  // m, of the difference quotient
  for (const auto& [fault, place, direction] :
       {std::tuple{"radius", std::string("wheels"), Vector3d(1, 1, 0)},
        {"radius", "wheel " + base.wheel_joint_right, Vector3d(1, 0, 0)},
        {"radius", "wheel " + base.wheel_joint_left, Vector3d(0, 1, 0)},
        {"distance", std::string("wheels"), Vector3d(0, 0, 1)}}) {
    VectorXd f = VectorXd::Zero(n_);
    f.head<2>() = (push(nominal + kStep * direction) - push(nominal - kStep * direction)) / (2.0 * kStep);
    const double size = direction[2] > 0.0 ? base.wheel_distance : base.wheel_radius;
    AddRobot(&Next(candidates, fault, place, "m", size, VectorXd::Constant(1, size)), f);
  }
}

void StepForces::AddJoints(std::vector<Candidate>* candidates) {
  const VectorXd q = store_.Get(StepStore::kPosition).col(step_);
  VectorXd rate = terms_.velocity();
  VectorXd acceleration = store_.Get(StepStore::kAcceleration).col(step_);
  const Base& base = model_.base();
  const int offset = model_.num_base_velocities();
  const bool wheels = base.type == BaseType::kDifferentialDrive;
  if (wheels) {
    rate.head<2>() = CalcWheelRates(base, rate.head<2>());
    acceleration.head<2>() = CalcWheelRates(base, acceleration.head<2>());
  }
  for (Index i = wheels ? 0 : offset; i < n_; ++i) {
    const int dof = static_cast<int>(i) - offset;
    const Joint* joint = dof < 0 ? nullptr : &model_.joints()[static_cast<size_t>(model_.joint_of_dof(dof))];
    const bool slides = joint != nullptr && joint->type == JointType::kPrismatic;
    const std::string force = slides ? "N" : "N m";
    const std::string place =
        "joint " +
        (joint == nullptr ? (i == 0 ? base.wheel_joint_right : base.wheel_joint_left) : model_.dof_name(dof));
    VectorXd f(n_);
    actuation_.CalcForce(VectorXd::Unit(n_, i), f);
    AddRobot(&Next(candidates, "torque", place, force, 0.0, Weights(1)), f);
    AddRobot(&Next(candidates, "armature", place, slides ? "kg" : "kg m^2",
                   joint == nullptr ? base.wheel.armature : joint->armature, Masses(1)),
             VectorXd(-acceleration[i] * f));
    AddRobot(&Next(candidates, "viscous friction", place, slides ? "N s/m" : "N m s/rad",
                   joint == nullptr ? base.wheel.damping : joint->damping, Weights(1)),
             VectorXd(-rate[i] * f));
    const double sign = rate[i] > 0.0 ? 1.0 : rate[i] < 0.0 ? -1.0 : 0.0;
    if (joint != nullptr) {
      // Where the plant says it, also of a joint that sticks. The largest is told.
      const double known = store_.Get(StepStore::kDryFriction)(i, step_);
      Candidate& bearing = Next(candidates, kBearing, place, force, 0.0, VectorXd::Ones(1));
      bearing.nominal = std::max(bearing.nominal, std::abs(known));
      AddRobot(&bearing, VectorXd(known * f));
    }
    AddRobot(&Next(candidates, "dry friction", place, force, joint == nullptr ? 0.0 : joint->dry_friction,
                   Weights(1)),
             VectorXd(-sign * f));
    if (joint == nullptr || joint->type == JointType::kBall) continue;
    MatrixXd spring(n_, 2);
    spring << -q[model_.position_index(model_.joint_of_dof(dof))] * f, f;
    Candidate& candidate = Next(candidates, "spring", place, slides ? "N/m" : "N m/rad", 0.0, Weights(2));
    candidate.is_ordinary = true;
    candidate.is_possible = [](const VectorXd& a) {
      return a[0] > 0.0 && std::abs(a[1]) <= kFarthest * a[0];
    };
    AddRobot(&candidate, spring);
  }
}

void StepForces::AddLink(int link, std::vector<Candidate>* candidates) {
  const MassProperties& body =
      link < 0 ? model_.base_with_wheels() : model_.joints()[static_cast<size_t>(link)].body;
  const std::string place = "link " + model_.link_name(link);
  const int frame = static_cast<int>(model_.frames().size()) - model_.num_joints() + link;
  Matrix6Xd J = Matrix6Xd::Zero(6, n_), J_dot = J;
  terms_.CalcFrameJacobian(frame, J, J_dot);
  const Matrix3d R = terms_.CalcFramePose(frame).linear();
  const VectorXd xi_dot = store_.Get(StepStore::kAcceleration).col(step_);
  const Vector6d V = J * terms_.velocity();
  const Vector6d V_dot = J * xi_dot + J_dot * terms_.velocity();
  const Vector3d w = V.tail<3>();
  const Vector3d a = V_dot.head<3>() + w.cross(V.head<3>()) - R.transpose() * gravity_;
  const BodyWrench wrench(a, w, V_dot.tail<3>());
  const MatrixXd J_T = J.transpose();
  const MatrixXd forces = J_T.leftCols<3>(), moments = J_T.rightCols<3>();
  AddRobot(&Next(candidates, kForce, place, "N", 0.0, Weights(3)), MatrixXd(forces * R.transpose()));
  AddRobot(&Next(candidates, kForceInAxes, place, "N", 0.0, Weights(3)), forces);
  AddRobot(&Next(candidates, "moment", place, "N m", 0.0, Weights(3)), MatrixXd(moments * R.transpose()));
  AddRobot(&Next(candidates, kMomentInAxes, place, "N m", 0.0, Weights(3)), moments);
  MatrixXd both(n_, 6);
  both << forces * R.transpose(), moments * R.transpose();
  AddRobot(&Next(candidates, "force and moment", place, "N", 0.0, Weights(6)), both);
  if (!(body.mass > 0.0)) return;
  const VectorXd mass = -J_T * wrench.mass;
  AddRobot(&Next(candidates, "mass", place, "kg", body.mass, Masses(1)), mass);
  // The whole body times a factor.
  Eigen::Matrix<double, 6, 1> I;
  I << body.inertia(0, 0), body.inertia(1, 1), body.inertia(2, 2), body.inertia(0, 1), body.inertia(0, 2),
      body.inertia(1, 2);
  const VectorXd scaled = -J_T * (wrench.mass * body.mass + wrench.inertia * I);
  AddRobot(&Next(candidates, kMassWithInertia, place, "kg", body.mass, Masses(1)),
           VectorXd(scaled / body.mass));
  const MatrixXd inertia = -J_T * wrench.inertia;
  AddRobot(&Next(candidates, "inertia", place, "kg m^2", 0.0, Masses(6)), inertia);
  // Another centre of mass changes the inertia about the old one.
  MatrixXd com(n_, 9);
  com << -J_T * wrench.first_moment * body.mass, inertia;
  AddRobot(&Next(candidates, "centre of mass off by", place, "m", 0.0, Moved()), com);
  MatrixXd payload(n_, 10);
  payload << mass, -J_T * wrench.first_moment, inertia;
  Candidate& load = Next(candidates, "payload", place, "kg", 0.0, Masses(10));
  load.is_possible = [](const VectorXd& a) { return a.segment<3>(1).norm() <= kFarthest * std::abs(a[0]); };
  AddRobot(&load, payload);
}

void StepForces::AddObjectForces(std::vector<Candidate>* candidates) {
  const VectorXd pose = store_.Get(StepStore::kObjectPose).col(step_);
  const Vector6d V = store_.Get(StepStore::kObjectMotion).col(step_).head<6>();
  const Vector6d V_dot = store_.Get(StepStore::kObjectMotion).col(step_).tail<6>();
  const Matrix3d R = pose.head<9>().reshaped(3, 3);
  const Vector3d p = pose.tail<3>();
  const ObjectModel& object = store_.setup().declared_object();
  const std::string place = "object " + object.name;
  const Matrix3d R_T = R.transpose(), zero = Matrix3d::Zero();
  const auto stack = [](const Matrix3d& force, const Matrix3d& moment) {
    Eigen::Matrix<double, 6, 3> columns;
    columns << force, moment;
    return columns;
  };
  AddObject(&Next(candidates, kForce, place, "N", 0.0, Weights(3)), stack(R_T, zero));
  AddObject(&Next(candidates, kForceInAxes, place, "N", 0.0, Weights(3)), stack(Matrix3d::Identity(), zero));
  AddObject(&Next(candidates, "moment", place, "N m", 0.0, Weights(3)), stack(zero, R_T));
  AddObject(&Next(candidates, kMomentInAxes, place, "N m", 0.0, Weights(3)),
            stack(zero, Matrix3d::Identity()));
  Matrix6d both = Matrix6d::Zero();
  both.topLeftCorner<3, 3>() = both.bottomRightCorner<3, 3>() = R_T;
  AddObject(&Next(candidates, "force and moment", place, "N", 0.0, Weights(6)), both);
  const Vector3d w = V.tail<3>();
  const BodyWrench wrench(V_dot.head<3>() + w.cross(V.head<3>()) - R_T * gravity_, w, V_dot.tail<3>());
  AddObject(&Next(candidates, "mass", place, "kg", object.body.mass, Masses(1)), Vector6d(-wrench.mass));
  const Matrix6d inertia = -wrench.inertia;
  AddObject(&Next(candidates, "inertia", place, "kg m^2", 0.0, Masses(6)), inertia);
  Matrix6Xd com(6, 9);
  com << -wrench.first_moment * object.body.mass, inertia;
  AddObject(&Next(candidates, "centre of mass off by", place, "m", 0.0, Moved()), com);
  Vector6d drag = Vector6d::Zero();
  drag.head<3>() = -V.head<3>();
  AddObject(&Next(candidates, "drag", place, "N s/m", 0.0, Weights(1)), drag);
  Matrix6Xd tether = Matrix6Xd::Zero(6, 4);
  tether.topRows<3>() << -R_T * p, R_T;
  AddObject(&Next(candidates, "tether", place, "N/m", 0.0, Weights(4)), tether);
}

void StepForces::AddGravity(std::vector<Candidate>* candidates) {
  // f = sum_b m_b J_b^T dg, w = [m R^T dg; 0]
  const bool is_fixed = model_.base().type == BaseType::kFixed;
  MatrixXd weights = MatrixXd::Zero(n_, 3);
  Matrix6Xd J = Matrix6Xd::Zero(6, n_), J_dot = J;
  for (int link = is_fixed ? 0 : -1; link < model_.num_joints(); ++link) {
    const int frame = static_cast<int>(model_.frames().size()) - model_.num_joints() + link;
    terms_.CalcFrameJacobian(frame, J, J_dot);
    const double mass =
        link < 0 ? model_.base_with_wheels().mass : model_.joints()[static_cast<size_t>(link)].body.mass;
    weights += mass * J.topRows<3>().transpose() * terms_.CalcFramePose(frame).linear().transpose();
  }
  Eigen::Matrix<double, 6, 3> object = Eigen::Matrix<double, 6, 3>::Zero();
  const VectorXd pose = store_.Get(StepStore::kObjectPose).col(step_);
  if (store_.setup().has_object())
    object.topRows<3>() =
        store_.setup().declared_object().body.mass * pose.head<9>().reshaped(3, 3).transpose();
  Candidate& gravity = Next(candidates, "gravity off by", kWorld, "m/s^2", 0.0, VectorXd::Constant(3, 20.0));
  for (Index k = 0; k < 3; ++k)
    gravity.columns.col(k).segment(begin_, rows()) = Whiten(weights.col(k), Vector6d(object.col(k)));
}

std::string TellVector(const Eigen::Ref<const VectorXd>& v) {
  std::string text = "(";
  for (Index i = 0; i < v.size(); ++i) text += (i > 0 ? ", " : "") + FormatNumber(v[i], 4);
  return text + ")";
}

Fault MakeFault(const Candidate& candidate, const VectorXd& a, const VectorXd& error,
                const Vector3d& gravity) {
  Fault fault{candidate.fault,          candidate.place,
              candidate.nominal + a[0], error.size() > 0 ? error[0] : 0.0,
              candidate.unit,           ""};
  if (candidate.fault == kBearing) {
    fault.fault = "dry friction";
    fault.value = candidate.nominal * a[0];
    fault.error *= candidate.nominal;
  } else if (candidate.fault == "spring") {
    if (a[0] != 0.0) fault.detail = "relaxed at " + FormatNumber(a[1] / a[0], 4);
  } else if (candidate.fault == "tether") {
    if (a[0] != 0.0) fault.detail = "to " + TellVector(a.tail<3>() / a[0]) + " m";
  } else if (candidate.fault == "payload") {
    if (a[0] != 0.0) fault.detail = "at " + TellVector(a.segment<3>(1) / a[0]) + " m of its centre of mass";
  } else if (a.size() >= 3) {
    const Index size = candidate.fault == "inertia" ? 6 : 3;
    fault.value = a.head(size).norm();
    if (error.size() >= size) fault.error = error.head(size).norm();
    fault.detail = TellVector(a.head(size));
    if (candidate.fault == "force and moment") fault.detail += " and " + TellVector(a.tail<3>()) + " N m";
  }
  if (candidate.fault == kForceInAxes || candidate.fault == kMomentInAxes) {
    fault.fault = candidate.fault == kForceInAxes ? kForce : "moment";
    fault.detail += " in its axes";
  } else if (candidate.fault == kMassWithInertia) {
    fault.fault = "mass";
    fault.detail = "and its inertia by the same factor";
  }
  if (candidate.fault != "gravity off by") return fault;
  const Vector3d change = a;
  if (std::abs(change.dot(gravity.normalized())) < kTilted * change.norm()) {
    const Vector3d actual = gravity + change;
    fault.fault = "slope";
    fault.value = RadToDeg(std::atan2(actual.cross(gravity).norm(), actual.dot(gravity)));
    fault.error = RadToDeg(fault.error / gravity.norm());
    fault.unit = "deg";
    fault.detail = "by " + fault.detail + " m/s^2";
  }
  return fault;
}

/// The steps from `first` to `last` of those that differ.
struct Segment {
  std::vector<Index> steps;
  double from = 0.0, to = 0.0;
};

/// One residual and what explains it.
class Problem {
 public:
  Problem(const StepStore& store, StepForces* forces, const Segment& segment)
      : store_(store), forces_(forces) {
    const auto count = static_cast<Index>(segment.steps.size());
    steps_ = std::min(count, kMostSteps);
    for (Index i = 0; i < steps_; ++i)
      used_.push_back(segment.steps[static_cast<size_t>(steps_ == 1 ? 0 : i * (count - 1) / (steps_ - 1))]);
    forces->SetGravity(forces->model().gravity());
    Build();
  }

  /// Whether what is left is noise, or next to nothing beside what there was.
  [[nodiscard]] bool IsExplained(double fraction, double left) const {
    if (left <= 1.0) return fraction > 0.0;
    return fraction >= kExplains && left <= kLeft;
  }

  /// Faults that do not change.
  bool ExplainConstant(const Segment& segment, Causes* causes) {
    const CauseSelection selection = Select();
    if (!IsExplained(selection.fraction, selection.left)) return false;
    if (ExplainJoint(segment, selection, causes)) return true;
    for (const CauseTerm& term : selection.terms) {
      Explanation one = Start(segment);
      one.fraction = selection.terms.size() == 1 ? selection.fraction : term.fraction;
      one.left = selection.left;
      const Vector3d& gravity = forces_->model().gravity();
      one.faults.push_back(MakeFault(candidates_[term.candidate], term.amplitude, term.error, gravity));
      for (const auto& [same, amplitude] : term.same)
        one.faults.push_back(MakeFault(candidates_[same], amplitude, {}, gravity));
      one.SetOutcome();
      if (term.rival != SIZE_MAX) one.SetRival(candidates_[term.rival], term.log_odds);
      causes->push_back(one);
    }
    return true;
  }

  /// Two faults of one joint may be anything that acts there.
  bool ExplainJoint(const Segment& segment, const CauseSelection& selection, Causes* causes) const {
    if (selection.terms.size() < 2) return false;
    const std::string& place = candidates_[selection.terms.front().candidate].place;
    Explanation one = Start(segment);
    one.outcome = CauseOutcome::kNamedClass;
    one.fraction = selection.fraction;
    one.left = selection.left;
    one.faults.push_back({"torque that changes", place, 0.0, 0.0, "", ""});
    for (const CauseTerm& term : selection.terms) {
      const Candidate& candidate = candidates_[term.candidate];
      if (candidate.place != place || !place.starts_with("joint ")) return false;
      one.faults.push_back(MakeFault(candidate, term.amplitude, term.error, forces_->model().gravity()));
    }
    for (Index k = 0; k < steps_; ++k) {
      const VectorXd y = y_.segment(k * forces_->rows(), forces_->rows());
      one.faults.front().value = std::max(one.faults.front().value, CalcTorque(place, k, y));
    }
    causes->push_back(one);
    return true;
  }

  /// One force that changes in time, free at each step.
  void ExplainChanging(const Segment& segment, Causes* causes) const {
    struct Free {
      size_t candidate = SIZE_MAX;
      double left = std::numeric_limits<double>::infinity(), criterion = left, largest = 0.0;
    };
    std::vector<Free> all;
    const double rows = static_cast<double>(y_.size());
    for (size_t i = 0; i < candidates_.size(); ++i) {
      const Candidate& candidate = candidates_[i];
      if (candidate.fault != "torque" && candidate.fault != kForce && candidate.fault != "moment" &&
          candidate.fault != "force and moment")
        continue;
      Free free{.candidate = i, .left = 0.0};
      for (Index k = 0; k < steps_; ++k) {
        const Index begin = k * forces_->rows();
        const MatrixXd C = candidate.columns.middleRows(begin, forces_->rows());
        const VectorXd y = y_.segment(begin, forces_->rows());
        Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition;
        decomposition.setThreshold(1e-3);
        const VectorXd a = decomposition.compute(C).solve(y);
        free.left += (y - C * a).squaredNorm();
        free.largest = std::max(free.largest, a.head(std::min<Index>(3, a.size())).norm());
      }
      const double parameters = static_cast<double>(candidate.columns.cols() * steps_);
      free.criterion = rows * std::log(1.0 + free.left / rows) + parameters * std::log(rows);
      all.push_back(free);
    }
    std::sort(all.begin(), all.end(), [](const Free& a, const Free& b) { return a.criterion < b.criterion; });
    if (all.empty()) return;
    Explanation one = Start(segment);
    one.fraction = 1.0 - all.front().left / y_.squaredNorm();
    one.left = std::sqrt(all.front().left / rows);
    const bool explained = IsExplained(one.fraction, one.left);
    for (const Free& free : all) {
      const Candidate& candidate = candidates_[free.candidate];
      const double odds = 0.5 * (free.criterion - all.front().criterion);
      if (!one.faults.empty() && odds >= kEqualLogOdds) {
        one.rival = candidate.place + ": " + candidate.fault;
        one.log_odds = odds;
        break;
      }
      one.faults.push_back(
          {candidate.fault + " that changes, up to", candidate.place, free.largest, 0.0, candidate.unit, ""});
    }
    one.SetOutcome();
    if (!explained) one.outcome = CauseOutcome::kNotExplained;
    causes->push_back(one);
  }

 private:
  /// Size of the torque of that joint that explains most of y, a step's rows.
  [[nodiscard]] double CalcTorque(const std::string& place, Index step, const VectorXd& y) const {
    for (const Candidate& candidate : candidates_) {
      if (candidate.place != place || candidate.fault != "torque") continue;
      const VectorXd column = candidate.columns.col(0).segment(step * forces_->rows(), forces_->rows());
      return std::abs(column.dot(y)) / column.squaredNorm();
    }
    return 0.0;
  }

  [[nodiscard]] Explanation Start(const Segment& segment) const {
    Explanation one;
    one.channel = CauseChannel::kBalance;
    one.from = segment.from;
    one.to = segment.to;
    const VectorXd time = store_.Get(StepStore::kTime).row(0);
    one.ends = segment.steps.back() + 2 < store_.size();
    return one;
  }

  void Build() {
    const Index rows = forces_->rows();
    y_.resize(rows * steps_);
    candidates_.clear();
    for (Index i = 0; i < steps_; ++i) {
      forces_->SetStep(used_[static_cast<size_t>(i)]);
      y_.segment(i * rows, rows) = forces_->CalcResidual();
      forces_->AddColumns(i * rows, steps_, &candidates_);
    }
    // What the columns are off hides what is smaller in the same block, and in no other.
    ScaleBlock(0, rows - 6);
    ScaleBlock(rows - 6, 6);
  }

  [[nodiscard]] CauseSelection Select() {
    const CauseOptions options{.alike = static_cast<double>(steps_)};
    CauseSelection selection = SelectCauses(y_, candidates_, options);
    for (const CauseTerm& term : selection.terms) {
      if (candidates_[term.candidate].place != kWorld || selection.terms.size() == 1) continue;
      // Masses that differ fall as all do.
      forces_->SetGravity(forces_->model().gravity() + Vector3d(term.amplitude));
      Build();
      return SelectCauses(y_, candidates_, options);
    }
    return selection;
  }

  /// Rows `first` ... of each step, in units of noise and of what their columns are off.
  void ScaleBlock(Index first, Index count) {
    const Index rows = forces_->rows();
    double square = 0.0;
    for (Index k = 0; k < steps_; ++k) square += y_.segment(k * rows + first, count).squaredNorm();
    const double unit =
        1.0 / std::sqrt(1.0 + kAccuracy * kAccuracy * square / static_cast<double>(count * steps_));
    for (Index k = 0; k < steps_; ++k) {
      y_.segment(k * rows + first, count) *= unit;
      for (Candidate& one : candidates_) one.columns.middleRows(k * rows + first, count) *= unit;
    }
  }

  const StepStore& store_;
  StepForces* forces_;
  std::vector<Candidate> candidates_;
  VectorXd y_;
  std::vector<Index> used_;  // steps of the store
  Index steps_ = 0;
};

/// All steps that differ, and the same in parts that begin or end with a jump.
void FindSegments(const StepStore& store, StepForces* forces, Segment* whole, std::vector<Segment>* parts) {
  struct Step {
    Index index;
    bool follows;
    double robot, object;  // by how much each differs from the step before
  };
  std::vector<Step> steps;
  VectorXd before;
  for (Index i = 0; i < store.size(); ++i) {
    if (!(store.Get(StepStore::kNoise)(0, i) > 0.0)) continue;
    forces->SetStep(i);
    const VectorXd y = forces->CalcResidual();
    const Index n = y.size() - 6;
    const bool differs = y.head(n).squaredNorm() > static_cast<double>(n) || y.tail<6>().squaredNorm() > 6.0;
    if (differs) {
      const bool follows = !steps.empty() && steps.back().index == i - 1;
      steps.push_back({i, follows, 0.0, 0.0});
      if (follows) {
        steps.back().robot = (y - before).head(n).norm() / std::sqrt(static_cast<double>(n));
        steps.back().object = (y - before).tail<6>().norm() / std::sqrt(6.0);
      }
    }
    before = y;
  }
  const auto jumps = [&](size_t k, double Step::*size) {
    double around = k > 0 ? steps[k - 1].*size : 0.0;
    if (k + 1 < steps.size()) around = std::max(around, steps[k + 1].*size);
    return steps[k].*size > std::max(kJumpNoise, kJump * around);
  };
  for (size_t k = 0; k < steps.size(); ++k) {
    const double time = store.Get(StepStore::kTime)(0, steps[k].index);
    if (!steps[k].follows || jumps(k, &Step::robot) || jumps(k, &Step::object))
      parts->push_back({{}, time, time});
    for (Segment* segment : {whole, &parts->back()}) {
      if (segment->steps.empty()) segment->from = time;
      segment->steps.push_back(steps[k].index);
      segment->to = time;
    }
  }
}

bool IsSame(const Explanation& a, const Explanation& b) {
  if (a.outcome == CauseOutcome::kNotExplained || b.outcome == CauseOutcome::kNotExplained) return false;
  const Fault& x = a.faults.front();
  const Fault& y = b.faults.front();
  constexpr double kSame = 0.02;
  return x.fault == y.fault && x.place == y.place &&
         std::abs(x.value - y.value) <= kSame * std::abs(x.value) + 3.0 * (x.error + y.error);
}

}  // namespace

Causes ExplainForces(const StepStore& store) {
  Causes causes;
  if (store.size() == 0) return causes;
  StepForces forces(store);
  Segment whole;
  std::vector<Segment> parts;
  FindSegments(store, &forces, &whole, &parts);
  if (whole.steps.empty()) return causes;
  Problem problem(store, &forces, whole);
  if (problem.ExplainConstant(whole, &causes)) return causes;
  if (parts.size() > 1 && parts.size() <= kMostSegments) {
    Causes found;
    bool all = true;
    for (const Segment& part : parts)
      all = all && Problem(store, &forces, part).ExplainConstant(part, &found);
    if (all) {
      for (const Explanation& one : found) {
        const auto same = std::find_if(causes.begin(), causes.end(),
                                       [&](const Explanation& other) { return IsSame(one, other); });
        if (same == causes.end()) {
          causes.push_back(one);
        } else {
          same->to = one.to;
          same->ends = one.ends;
          if (one.faults.size() < same->faults.size()) same->faults = one.faults, same->outcome = one.outcome;
        }
      }
      return causes;
    }
  }
  problem.ExplainChanging(whole, &causes);
  return causes;
}

}  // namespace dexcheck
