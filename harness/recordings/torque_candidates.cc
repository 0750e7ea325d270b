#include "harness/recordings/torque_candidates.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "controller/common/linear_algebra.h"
#include "harness/recordings/nonlinear_faults.h"

namespace dexcheck {
namespace {

using BodyVector = TorqueRegressor::BodyVector;
using Parts = std::vector<ColumnPart>;

/// N m, N, N m/rad or N/m: what is larger is of two that leave the same.
constexpr double kMostTorque = 1e4;

/// How far from 1 a part may be that is there or not.
constexpr double kWhole = 0.3;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kG = 9.81;  // m/s^2

/// Whether a vector, which is added to another one, is no longer than plausible.
std::function<bool(const VectorXd&)> IsNoLonger(double most, const VectorXd& nominal) {
  return [=](const VectorXd& a) { return (nominal + a).norm() <= most; };
}

/// The columns of a link by a change of its BodyVector.
Parts BodyParts(int link, const BodyVector& change, int recording = -1) {
  Parts parts;
  for (int k = 0; k < TorqueRegressor::kBody; ++k)
    if (change[k] != 0.0) parts.push_back({{TorqueColumn::kBody, link, k}, -1, change[k], recording});
  return parts;
}

/// d BodyVector / d com of a body, of which it is a square: differences are exact.
BodyVector CentreColumn(const MassProperties& body, int k) {
  const auto at = [&](double by) {
    MassProperties moved = body;
    moved.com[k] += by;
    return BodyVector(TorqueRegressor::Pack(moved));
  };
  return 0.5 * (at(1.0) - at(-1.0));
}

class FaultList {
 public:
  FaultList(const RobotModel& model, const std::vector<int>& joints, int recordings,
            const Refinements& refinements, const MotionExtents& extents, const LinkFrames& frames)
      : model_(model),
        joints_(joints),
        recordings_(recordings),
        refinements_(refinements),
        extents_(extents),
        frames_(frames) {}

  std::vector<TorqueFault> Make() {
    for (const int joint : joints_) {
      const bool turns = model_.joint(joint).type == JointType::kRevolute;
      AddFriction(joint, turns, extents_.FindTorque(joint));
      AddSpring(joint, turns);
      AddDrive(joint, turns, extents_.FindTorque(joint));
      AddPosition(joint, turns, extents_.FindTorque(joint));
    }
    for (int joint = 0; joint < model_.num_joints() && model_.num_joints() <= kMostWithGeometry; ++joint)
      AddGeometry(joint);
    for (int link = 0; link < model_.num_joints(); ++link) AddLink(link);
    AddAll();
    for (TorqueFault& one : faults_) {
      if (one.most.size() == 0) continue;
      one.is_possible = [nominal = one.nominal, most = one.most, own = one.is_possible](const VectorXd& a) {
        VectorXd whole = a;
        whole[0] += nominal;
        return (whole.array().abs() <= most.array()).all() && (!own || own(a));
      };
    }
    return std::move(faults_);
  }

 private:
  /// Adds a fault of a joint or link, or for -1 of all joints.
  TorqueFault& Add(TorqueFault::Kind kind, int index, const std::string& fault, const std::string& unit,
                   std::vector<Parts> columns, double nominal = 0.0) {
    TorqueFault& one = faults_.emplace_back();
    one.kind = kind;
    one.index = index;
    one.fault = fault;
    const bool is_of_link = kind >= TorqueFault::kMass && kind <= TorqueFault::kPayload;
    one.place = index < 0    ? "all joints"
                : is_of_link ? "link " + model_.link_name(index)
                             : "joint " + model_.joint(index).name;
    one.unit = unit;
    one.nominal = nominal;
    one.sums = std::move(columns);
    return one;
  }
  /// Adds a fault of one joint's row. @param most the largest value that is plausible.
  TorqueFault& AddAtJoint(TorqueFault::Kind kind, int joint, const std::string& fault,
                          const std::string& unit, TorqueColumn::Kind column, double most,
                          double nominal = 0.0) {
    TorqueFault& one = Add(kind, joint, fault, unit, {{{{column, joint}, joint}}}, nominal);
    if (one.IsFriction() || kind == TorqueFault::kArmature) one.least = VectorXd::Constant(1, -nominal);
    one.most = VectorXd::Constant(1, most);
    return one;
  }

  /// The largest torque of a joint for a unit of its motion. @param least motion that shows a ratio.
  [[nodiscard]] double FindMostPer(int joint, const VectorXd& motion, double least) const {
    return motion.size() > 0 ? extents_.FindTorque(joint) / std::max(least, motion[joint]) : kInfinite;
  }
  [[nodiscard]] double FindMostViscous(int joint) const { return FindMostPer(joint, extents_.speed, kSlow); }

  void AddFriction(int joint, bool turns, double most) {
    using enum TorqueFault::Kind;
    const std::string torque = turns ? "N m" : "N";
    const double dry = model_.joint(joint).dry_friction;
    AddAtJoint(kDryFriction, joint, "dry friction", torque, TorqueColumn::kDry, most, dry);
    AddAtJoint(kViscousFriction, joint, "viscous friction", turns ? "N m s/rad" : "N s/m",
               TorqueColumn::kViscous, FindMostViscous(joint), model_.joint(joint).damping);
    AddAtJoint(kSquareFriction, joint, "friction that grows with the square of the velocity",
               turns ? "N m s^2/rad^2" : "N s^2/m^2", TorqueColumn::kSquare,
               FindMostPer(joint, extents_.speed.cwiseAbs2(), kSlow * kSlow));
    const bool has_stribeck = refinements_.stribeck.contains(joint);
    const bool has_smooth = refinements_.smooth.contains(joint);
    if (has_stribeck) AddKnownShape(kStribeckFriction, joint, "Stribeck friction", torque, 0.0);
    if (has_smooth) AddKnownShape(kDryFriction, joint, "dry friction", torque, dry);
    for (int shape = 0; shape < kFrictionShapes; ++shape) {
      const bool is_stribeck = shape > kSmoothShapes;
      if (is_stribeck ? has_stribeck : has_smooth && shape != kSlipShape) continue;
      TorqueFault& one = AddAtJoint(is_stribeck ? kStribeckFriction : kDryFriction, joint,
                                    is_stribeck ? "Stribeck friction" : "dry friction", torque,
                                    TorqueColumn::kFriction, most, is_stribeck ? 0.0 : dry);
      one.sums[0][0].column.component = shape;
      one.parameters = 1;
    }
  }

  void AddSpring(int joint, bool turns) {
    const Joint& modelled = model_.joint(joint);
    TorqueFault& spring =
        Add(TorqueFault::kSpring, joint, "spring", turns ? "N m/rad" : "N/m",
            {{{{TorqueColumn::kAngle, joint}, joint}}, {{{TorqueColumn::kOffset, joint}, joint}}});
    constexpr double kNear = 0.01;  // rad or m
    spring.most = Vector2d(FindMostPer(joint, extents_.span, kNear), kInfinite);
    spring.scale = VectorXd::Constant(2, kMostTorque);
    spring.least = Vector2d(0.0, -kMostTorque);
    // A spring at rest further from the joint's range than its width is an offset that changes a little.
    const double middle = 0.5 * (modelled.lower + modelled.upper), width = modelled.upper - modelled.lower;
    if (std::isfinite(width) && width > 0.0)
      spring.is_possible = [middle, width](const VectorXd& a) {
        return std::abs(-a[1] / a[0] - middle) <= 1.5 * width;
      };
  }

  void AddDrive(int joint, bool turns, double most) {
    using enum TorqueFault::Kind;
    const std::string torque = turns ? "N m" : "N";
    AddAtJoint(kLoadFriction, joint, "friction that grows with the load", "", TorqueColumn::kLoad, 1.0);
    AddAtJoint(kOffset, joint, "torque offset", torque, TorqueColumn::kOffset, most);
    AddAtJoint(kDrift, joint, "torque drift", torque + "/s", TorqueColumn::kTime, most);
    AddAtJoint(kDryDrift, joint, "dry friction that changes with time", torque + "/s", TorqueColumn::kDryTime,
               most);
    AddAtJoint(kArmature, joint, "armature", turns ? "kg m^2" : "kg", TorqueColumn::kAcceleration,
               FindMostPer(joint, extents_.acceleration, kSlow), model_.joint(joint).armature);
    AddAtJoint(kTorqueGain, joint, "torque gain", "", TorqueColumn::kTorque, kMostGain, 1.0).is_possible =
        IsGain;
    TorqueFault& stuck =
        Add(kStuckTorque, joint, "stuck torque", torque,
            {{{{TorqueColumn::kOffset, joint}, joint}}, {{{TorqueColumn::kTorque, joint}, joint, -1.0}}});
    // The recorded torque has nothing of the model's.
    stuck.is_possible = [](const VectorXd& a) { return std::abs(a[1] - 1.0) < 0.05; };
    AddDelay(kDelay, joint, "delay of the torque", {{{TorqueColumn::kRate, joint}, joint, -1.0}});
    const int limits = refinements_.limits.contains(joint) ? 2 : kCutOffs;
    for (int k = 0; k < limits && recordings_ == 1; ++k) {
      const TorqueColumn beyond{TorqueColumn::kCutOff, joint, 2 * k},
          limit{TorqueColumn::kCutOff, joint, 2 * k + 1};
      TorqueFault& one = Add(kSaturation, joint, "saturation", torque, {{{beyond, joint}}, {{limit, joint}}});
      one.parameters = 1;
      one.is_possible = [](const VectorXd& a) {
        return std::abs(a[0] - 1.0) < kWhole && std::abs(a[1]) < kWhole;
      };
    }
  }

  void AddPosition(int joint, bool turns, double most) {
    using enum TorqueFault::Kind;
    const std::string angle = turns ? "rad" : "m";
    const double play = turns ? 0.2 : 0.02, range = model_.joint(joint).upper - model_.joint(joint).lower;
    const auto is_positive = [](const VectorXd& a) { return a[0] > 0.0; };
    const auto add = [&](TorqueFault::Kind kind, const char* fault, const std::string& unit,
                         const ColumnPart& part, double largest) -> TorqueFault& {
      TorqueFault& one = Add(kind, joint, fault, unit, {{part}});
      one.most = VectorXd::Constant(1, largest);
      return one;
    };
    add(kBacklash, "backlash", angle, {{TorqueColumn::kBacklash, joint}, -1, -0.5}, play).is_possible =
        is_positive;
    add(kElasticity, "elasticity", turns ? "rad/(N m)" : "m/N", {{TorqueColumn::kElastic, joint}, -1, -1.0},
        play / most)
        .is_possible = is_positive;
    add(kZero, "position offset", angle, {{TorqueColumn::kPosition, joint}, -1, -1.0},
        std::min(turns ? kPi : 1.0, range > 0.0 ? range : kInfinite));
    AddDelay(kLatePosition, joint, "delay of the position", {{{TorqueColumn::kLatePosition, joint}}});
    constexpr double kMostOff = 0.3, kMostError = 0.1;
    Add(kPositionGain, joint, "position gain", "", {{{{TorqueColumn::kPositionGain, joint}, -1, -1.0}}}, 1.0)
        .is_possible = IsNoLonger(kMostOff, VectorXd::Zero(1));
    for (const int harmonics : {2, kTurns}) {
      if (!turns) break;
      TorqueFault& turn = Add(kEccentricity, joint, "eccentric encoder", "rad", {});
      for (int k = 0; k < harmonics; ++k) turn.sums.push_back({{{TorqueColumn::kTurn, joint, k}, -1, -1.0}});
      turn.is_possible = IsNoLonger(kMostError, VectorXd::Zero(harmonics));
      turn.is_ordinary = harmonics == 2;
    }
  }

  /// Adds a joint that stands elsewhere. All that a fixed base carries turns with gravity.
  void AddGeometry(int joint) {
    const MatrixXd directions = FindDirections(model_, joint);
    const auto add = [&](const std::string& fault, const std::string& unit, int first, const MatrixXd& axes,
                         double most) {
      TorqueFault& one = Add(TorqueFault::kGeometry, joint, fault, unit, {});
      one.axes = axes;
      for (const auto& axis : axes.colwise()) {
        Parts& parts = one.sums.emplace_back();
        const Vector3d along = first == 0 ? Vector3d(axis) : Vector3d(directions.transpose() * axis);
        for (int k = 0; k < (first == 0 ? 3 : 2); ++k)
          parts.push_back({{TorqueColumn::kGeometry, joint, first + k}, -1, along[k]});
        // A turn about the joint's own axis is an offset of its position.
        if (first > 0) parts.push_back({{TorqueColumn::kPosition, joint}, -1, along[2]});
      }
      one.is_possible = IsNoLonger(most, VectorXd::Zero(axes.cols()));
    };
    // Larger displacements are not in proportion.
    constexpr double kFarthest = 0.05, kMostTurn = 0.15;  // m, rad
    add("axis", "rad", 5, directions.leftCols(2), kMostTurn);
    const int parent = model_.joint(joint).parent;
    if (parent < 0) return;
    add("placement", "m", 0, Matrix3d::Identity(), kFarthest);
    add("orientation", "rad", 3, directions.leftCols(2), kMostTurn);
    // The numbers of a file are wrong one by one.
    const Matrix3d R = frames_.Find(parent).linear();
    constexpr double kAlong = 0.99;
    for (int k = 0; k < 3; ++k) {
      add("placement", "m", 0, R.col(k), kFarthest);
      if (std::abs(directions.col(2).dot(R.col(k))) < kAlong)
        add("orientation", "rad", 3, R.col(k), kMostTurn);
    }
  }

  /// Adds friction whose velocity is roughly known: the shape there, and what the logarithm of the velocity
  /// changes.
  void AddKnownShape(TorqueFault::Kind kind, int joint, const std::string& fault, const std::string& unit,
                     double nominal) {
    const int first = kind == TorqueFault::kStribeckFriction ? 1 + kSmoothShapes : 1;
    const TorqueColumn slow{TorqueColumn::kFriction, joint, first};
    const TorqueColumn fast{TorqueColumn::kFriction, joint, first + 1};
    const double slope = 1.0 / std::log(kFineRatio);
    TorqueFault& one = Add(
        kind, joint, fault, unit,
        {{{slow, joint, 0.5}, {fast, joint, 0.5}}, {{slow, joint, -slope}, {fast, joint, slope}}}, nominal);
    one.is_possible = [nominal](const VectorXd& a) {
      return nominal + a[0] > 0.0 && std::abs(a[1]) < std::abs(a[0]);
    };
    one.most = VectorXd::Constant(2, extents_.FindTorque(joint));
  }

  void AddLink(int link) {
    const MassProperties& body = model_.joint(link).body;
    const BodyVector vector = TorqueRegressor::Pack(body);
    using enum TorqueFault::Kind;
    if (body.mass > 0.0) {
      // With the inertia of its shape, or at its centre.
      for (const BodyVector& change :
           {BodyVector(vector / body.mass), TorqueRegressor::Pack({1.0, body.com})}) {
        Add(kMass, link, "mass", "kg", {BodyParts(link, change)}, body.mass).is_possible =
            [m = body.mass](const VectorXd& a) { return m + a[0] > 0.0 && m + a[0] < kMostTimes * m; };
      }
      const Matrix3d R = frames_.Find(link).linear();
      for (const MatrixXd& axes :
           {MatrixXd(Matrix3d::Identity()), MatrixXd(R.col(0)), MatrixXd(R.col(1)), MatrixXd(R.col(2))}) {
        TorqueFault& centre =
            Add(kCentre, link, "centre of mass", "m", std::vector<Parts>(static_cast<size_t>(axes.cols())));
        centre.axes = axes;
        PlaceMass(model_, VectorXd::Zero(axes.cols()), &centre);
        constexpr double kLength = 0.05, kFarthest = 0.15;
        centre.scale = VectorXd::Constant(axes.cols(), kLength);
        centre.is_possible = [](const VectorXd& a) { return a.norm() < kFarthest; };
        centre.is_ordinary = axes.cols() == 3;
      }
      // All of it times a factor.
      const BodyVector central = TorqueRegressor::Pack({0.0, Vector3d::Zero(), body.inertia});
      Add(kInertia, link, "inertia", "", {BodyParts(link, central)}, 1.0).is_possible =
          [](const VectorXd& a) { return a[0] > -1.0 && a[0] < kMostTimes; };
      TorqueFault& inertia = Add(kInertia, link, "inertia", "kg m^2", {});
      for (int k = 4; k < TorqueRegressor::kBody; ++k)
        inertia.sums.push_back(BodyParts(link, BodyVector::Unit(k)));
      constexpr double kGyration = 0.1;
      inertia.scale = VectorXd::Constant(6, body.mass * kGyration * kGyration);
      inertia.is_possible = [vector, is_real = IsBody(vector)](const VectorXd& a) {
        BodyVector changed = vector;
        changed.tail<6>() += a;
        return !is_real || IsBody(changed);
      };
    }
    AddPayload(link);
  }

  /// Adds payloads at a link that carries no other one.
  void AddPayload(int link) {
    if (!std::ranges::count(ListLastLinks(model_), link)) return;
    constexpr double kMass = 5.0, kMoment = 0.5;
    const BodyVector own = TorqueRegressor::Pack(model_.joint(link).body);
    const int first = recordings_ > 1 ? 0 : -1;
    for (int recording = first; recording < first + recordings_; ++recording) {
      // A point, and a body with an inertia of its own.
      for (const int width : {4, TorqueRegressor::kBody}) {
        TorqueFault& one = Add(TorqueFault::kPayload, link, "payload", "kg", {});
        one.recording = recording;
        for (int k = 0; k < width; ++k) one.sums.push_back(BodyParts(link, BodyVector::Unit(k), recording));
        one.scale = VectorXd::Constant(width, kMoment);
        one.scale[0] = kMass;
        one.most = VectorXd::Constant(width, kInfinite);
        one.most[0] = std::accumulate(model_.joints().begin(), model_.joints().end(), 0.0,
                                      [](double sum, const Joint& each) { return sum + each.body.mass; });
        one.is_possible = IsPayload;
        // Link and payload together are a possible body.
        if (width == TorqueRegressor::kBody && IsBody(own))
          one.is_possible = [=](const VectorXd& a) { return IsPayload(a) && IsBody(own + BodyVector(a)); };
        one.is_ordinary = width == 4;
      }
    }
  }

  void AddAll() {
    using enum TorqueFault::Kind;
    Parts delay, gain, late, implicit;
    for (const int joint : joints_) {
      late.push_back({{TorqueColumn::kLate, joint}, joint, 1.0});
      implicit.push_back({{TorqueColumn::kAcceleration, joint}, joint, model_.joint(joint).damping});
      delay.push_back({{TorqueColumn::kRate, joint}, joint, -1.0});
      gain.push_back({{TorqueColumn::kTorque, joint}, joint, 1.0});
    }
    if (joints_.size() > 1) {
      AddInAll(kAllDry, "dry friction", {TorqueColumn::kDry});
      AddInAll(kAllFriction, "dry and viscous friction", {TorqueColumn::kDry, TorqueColumn::kViscous});
      AddInAll(kAllOffsets, "torque offset", {TorqueColumn::kOffset}).is_possible = nullptr;
      faults_.back().scale = VectorXd::Constant(static_cast<Eigen::Index>(joints_.size()), kMostTorque);
      AddDelay(kDelay, -1, "delay of the torques", delay);
      TorqueFault& all = Add(kTorqueGain, -1, "torque gain", "", {gain}, 1.0);
      all.is_possible = IsGain;
      all.most = VectorXd::Constant(1, kMostGain);
    }
    // A simulator's velocity is that of half a step before; its damping may be that of the step's end.
    constexpr double kBeyond = 0.1;
    for (const std::vector<Parts>& columns : {std::vector<Parts>{late}, {implicit}, {late, implicit}}) {
      TorqueFault& one = Add(kIntegrator, -1, "integrator", "s", columns);
      const auto count = static_cast<Eigen::Index>(columns.size());
      one.least = VectorXd::Constant(count, -kBeyond * extents_.step);
      one.most = VectorXd::Constant(count, (1.0 + kBeyond) * extents_.step);
    }
    TorqueFault& gravity = Add(kGravity, -1, "gravity", "m/s^2", {});
    gravity.place = "world";
    for (int k = 0; k < 3; ++k) gravity.sums.push_back({{{TorqueColumn::kGravity, 0, k}, -1, 1.0}});
    const double g = std::max(model_.gravity().norm(), 1.0);
    gravity.scale = VectorXd::Constant(3, g);
    gravity.is_ordinary = true;
    constexpr double kGravityError = 1.02;
    gravity.is_possible = IsNoLonger(kGravityError * std::max(kG, g), model_.gravity());
    constexpr double kSwing = 0.3;  // m, rad
    const double swing = std::min(kSwing, kG / Square(refinements_.shaking));
    for (const int width : {6, 12}) {
      if (!(refinements_.shaking > 0.0)) break;
      TorqueFault& one = Add(kShaking, -1, width == 6 ? "shaking" : "shaking and tilting", "m", {});
      one.place = "base";
      for (int k = 0; k < width; ++k) one.sums.push_back({{{TorqueColumn::kShaking, 0, k}}});
      one.scale = VectorXd::Constant(width, kSwing);
      one.is_possible = IsNoLonger(swing, VectorXd::Zero(width));
      one.parameters = 1;
    }
  }

  /// A torque that has nothing to do with the model's is no gain.
  static bool IsGain(const VectorXd& a) {
    constexpr double kLeast = 5e-4;
    return std::abs(1.0 + a[0]) > kLeast;
  }
  /// No torque is recorded before it acts.
  void AddDelay(TorqueFault::Kind kind, int joint, const char* fault, const Parts& parts) {
    TorqueFault& delay = Add(kind, joint, fault, "s", {parts});
    constexpr double kUsual = 0.05, kLatest = 0.5;  // s
    delay.scale = VectorXd::Constant(1, kUsual);
    delay.least = VectorXd::Constant(1, -1.5 * extents_.step);
    delay.most = VectorXd::Constant(1, kLatest);
  }

  /// In every joint.
  TorqueFault& AddInAll(TorqueFault::Kind kind, const std::string& name,
                        const std::vector<TorqueColumn::Kind>& columns) {
    TorqueFault& one = Add(kind, -1, name, "N m", {});
    for (const TorqueColumn::Kind column : columns)
      for (const int joint : joints_) one.sums.push_back({{{column, joint}, joint}});
    // In all of them, not in a few and by noise in the others.
    one.is_possible = [](const VectorXd& a) { return (a.array() > 0.0).all(); };
    one.most.resize(static_cast<Eigen::Index>(one.sums.size()));
    Eigen::Index k = 0;
    for (const TorqueColumn::Kind column : columns)
      for (const int joint : joints_)
        one.most[k++] =
            column == TorqueColumn::kViscous ? FindMostViscous(joint) : extents_.FindTorque(joint);
    return one;
  }

  static constexpr double kMostGain = 1100.0;
  static constexpr double kMostTimes = 10.0;  // a body's mass or inertia
  static constexpr double kSlow = 0.1;        // rad/s or rad/s^2, m/s or m/s^2

  const RobotModel& model_;
  const std::vector<int>& joints_;
  int recordings_;
  const Refinements& refinements_;
  const MotionExtents& extents_;
  const LinkFrames& frames_;
  std::vector<TorqueFault> faults_;
};

}  // namespace

std::vector<TorqueFault> ListTorqueFaults(const RobotModel& model, const std::vector<int>& joints,
                                          int recordings, const Refinements& refinements,
                                          const MotionExtents& extents, const LinkFrames& frames) {
  return FaultList(model, joints, recordings, refinements, extents, frames).Make();
}

std::vector<int> ListLastLinks(const RobotModel& model) {
  std::vector<int> links;
  for (int link = 0; link < model.num_joints(); ++link)
    if (!std::ranges::count(model.joints(), link, &Joint::parent)) links.push_back(link);
  return links;
}

bool IsPayload(const VectorXd& a) {
  constexpr double kFarthest = 0.5;  // m
  return a[0] > 0.0 && a.segment<3>(1).norm() < kFarthest * a[0];
}

static void ShiftCentre(const RobotModel& model, const VectorXd& amplitude, TorqueFault* centre) {
  MassProperties body = model.joint(centre->index).body;
  body.com += 0.5 * centre->axes * amplitude;
  for (Eigen::Index k = 0; k < amplitude.size(); ++k) {
    BodyVector change = BodyVector::Zero();
    for (int i = 0; i < 3; ++i) change += centre->axes(i, k) * CentreColumn(body, i);
    centre->sums[static_cast<size_t>(k)] = BodyParts(centre->index, change);
  }
}

/// Returns the columns of a point mass near to where it is.
static Eigen::Matrix<double, TorqueRegressor::kBody, 4> CalcPayloadColumns(double mass, const Vector3d& h) {
  const auto at = [&](const Vector3d& moment) {
    return BodyVector(TorqueRegressor::Pack({mass, moment / mass, Matrix3d::Zero()}));
  };
  // It is a square of h, and of degree one in mass and h together: its derivatives times these are itself.
  Eigen::Matrix<double, TorqueRegressor::kBody, 4> columns;
  BodyVector rest = at(h);
  for (int k = 0; k < 3; ++k) {
    columns.col(k + 1) = 0.5 * (at(h + Vector3d::Unit(k)) - at(h - Vector3d::Unit(k)));
    rest -= h[k] * columns.col(k + 1);
  }
  columns.col(0) = rest / mass;
  return columns;
}

void PlaceMass(const RobotModel& model, const VectorXd& amplitude, TorqueFault* fault) {
  if (fault->is_possible && !fault->is_possible(amplitude)) return;
  if (fault->kind == TorqueFault::kCentre) ShiftCentre(model, amplitude, fault);
  const bool is_point = fault->kind == TorqueFault::kPayload && fault->sums.size() == 4;
  if (!is_point && fault->push.payload < 0) return;
  fault->push.masses = CalcPayloadColumns(amplitude[0], amplitude.segment<3>(1));
  for (int k = 0; k < 4 && is_point; ++k)
    fault->sums[static_cast<size_t>(k)] =
        BodyParts(fault->index, fault->push.masses.col(k), fault->recording);
}

}  // namespace dexcheck
