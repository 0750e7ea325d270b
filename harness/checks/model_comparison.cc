#include "harness/checks/model_comparison.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "harness/checks/rounding_scales.h"
#include "harness/checks/term_table.h"
#include "harness/descriptions/description_match.h"

namespace dexcheck {
namespace {

// Both sides read decimal numbers and form at most short sums and products of them.
constexpr double kRounding = 64.0 * std::numeric_limits<double>::epsilon();

/// Compares two models' constants and terms; coordinates and locations are those of `a`.
class ModelComparison {
 public:
  ModelComparison(const RobotDescription& a, const RobotDescription& b)
      : a_(a),
        b_(b),
        model_a_(a.spec),
        model_b_(b.spec),
        terms_a_(model_a_),
        terms_b_(model_b_),
        scales_(model_a_),
        base_(model_a_.num_base_velocities()),
        b_of_a_(MatchJoints(a.spec, b.spec)) {
    const int n = model_a_.num_velocities();
    const int offset_a = model_a_.num_base_positions();
    position_of_.resize(static_cast<size_t>(model_a_.num_positions()));
    velocity_of_.resize(static_cast<size_t>(n));
    for (int i = 0; i < offset_a; ++i) position_of_[static_cast<size_t>(i)] = i;
    for (int i = 0; i < base_; ++i) velocity_of_[static_cast<size_t>(i)] = i;
    for (size_t i = 0; i < b_of_a_.size(); ++i) {
      const auto at = static_cast<size_t>(model_a_.position_index(static_cast<int>(i)));
      const JointType type = a_.spec.joints[i].type;
      for (int k = 0; k < CountPositions(type); ++k)
        position_of_[at + static_cast<size_t>(k)] = model_b_.position_index(b_of_a_[i]) + k;
      for (int k = 0; k < CountVelocities(type); ++k)
        velocity_of_[static_cast<size_t>(base_ + model_a_.dof(static_cast<int>(i)) + k)] =
            base_ + model_b_.dof(b_of_a_[i]) + k;
    }
    q_b_.setZero(model_a_.num_positions());
    xi_b_.setZero(n);
    for (Matrix6Xd* J : {&J_a_, &J_dot_a_, &J_b_, &J_dot_b_}) J->setZero(6, n);
    const int depth = std::max(model_a_.max_depth(), model_b_.max_depth());
    constexpr const char* kNames[] = {
        "joint_axis", "link_com",       "link_inertia",     "frame_pose",      "J",
        "J_dot_xi",   "M_bar",          "C_bar_xi",         "C_bar",           "gravity",
        "friction",   "kinetic_energy", "potential_energy", "linear_momentum", "angular_momentum"};
    static_assert(std::size(kNames) == kTermCount);
    for (int term = 0; term < kTermCount; ++term) {
      records_[term].name = kNames[term];
      records_[term].bound = CalcBound(FindTerm(kNames[term]), depth);
    }
  }

  [[nodiscard]] const RobotModel& model() const { return model_a_; }

  ConstantChecks CompareConstants() {
    ConstantChecks constants;
    if (a_.states_gravity && b_.states_gravity) {
      for (int k = 0; k < 3; ++k) {
        AddConstant(&constants, "gravity_vector", {}, a_.spec.gravity[k], b_.spec.gravity[k], k,
                    a_.spec.gravity.norm());
      }
    }
    if (model_a_.base().type != BaseType::kFixed) {
      AddConstant(&constants, "link_mass", {Location::Kind::kLink, -1, -1}, model_a_.base_with_wheels().mass,
                  model_b_.base_with_wheels().mass, 0);
    }
    ForJoints([&](size_t i, size_t j) {
      AddConstant(&constants, "link_mass", {Location::Kind::kLink, static_cast<int>(i), -1},
                  a_.spec.joints[i].body.mass, b_.spec.joints[j].body.mass, 0);
    });
    CompareStated(&constants, "joint_damping", &DescribedJoint::states_damping,
                  [](const RobotDescription& robot, size_t i) {
                    return std::vector<double>{robot.spec.joints[i].damping};
                  });
    CompareStated(&constants, "joint_dry_friction", &DescribedJoint::states_dry_friction,
                  [](const RobotDescription& robot, size_t i) {
                    return std::vector<double>{robot.spec.joints[i].dry_friction};
                  });
    CompareStated(&constants, "joint_armature", &DescribedJoint::states_armature,
                  [](const RobotDescription& robot, size_t i) {
                    return std::vector<double>{robot.spec.joints[i].armature};
                  });
    CompareStated(&constants, "joint_range", &DescribedJoint::states_range,
                  [](const RobotDescription& robot, size_t i) {
                    return std::vector<double>{robot.spec.joints[i].lower, robot.spec.joints[i].upper};
                  });
    ForJoints([&](size_t i, size_t j) {
      const std::optional<JointCoupling>& own = a_.spec.joints[i].coupling;
      const std::optional<JointCoupling>& other = b_.spec.joints[j].coupling;
      const Location where{Location::Kind::kJoint, static_cast<int>(i), -1};
      const std::string name = "joint_coupling";
      if (own.has_value() != other.has_value())
        AddConstant(&constants, name, where, own ? own->multiplier : 0.0, other ? other->multiplier : 0.0, 1);
      if (!own || !other) return;
      AddConstant(&constants, name, where, b_of_a_[static_cast<size_t>(own->leader)], other->leader, 0);
      AddConstant(&constants, name, where, own->multiplier, other->multiplier, 1);
      AddConstant(&constants, name, where, own->offset, other->offset, 2);
    });
    return constants;
  }

  void Compare(const VectorXd& q, const VectorXd& xi, long sample) {
    sample_ = static_cast<double>(sample);
    for (size_t i = 0; i < position_of_.size(); ++i) q_b_[position_of_[i]] = q[static_cast<Eigen::Index>(i)];
    for (size_t i = 0; i < velocity_of_.size(); ++i)
      xi_b_[velocity_of_[i]] = xi[static_cast<Eigen::Index>(i)];
    terms_a_.SetState(q, xi);
    terms_b_.SetState(q_b_, xi_b_);
    terms_a_.CalcDynamics();
    terms_b_.CalcDynamics();
    scales_.SetState(terms_a_, q, xi);
    CompareLinks();
    CompareFrames(xi);
    CompareDynamics(xi);
    CompareEnergies();
  }

  [[nodiscard]] std::vector<CheckRecord> TakeRecords() const {
    std::vector<CheckRecord> records;
    for (const CheckRecord& record : records_) {
      if (record.comparisons > 0) records.push_back(record);
    }
    return records;
  }

 private:
  enum Term {
    kJointAxis,
    kLinkCom,
    kLinkInertia,
    kFramePose,
    kJ,
    kJDotXi,
    kMassMatrix,
    kCoriolisForce,
    kCoriolisMatrix,
    kGravity,
    kFriction,
    kKineticEnergy,
    kPotentialEnergy,
    kLinearMomentum,
    kAngularMomentum,
    kTermCount
  };

  void ForJoints(const std::function<void(size_t, size_t)>& visit) const {
    for (size_t i = 0; i < b_of_a_.size(); ++i) visit(i, static_cast<size_t>(b_of_a_[i]));
  }

  void CompareStated(ConstantChecks* constants, const std::string& name, bool DescribedJoint::*states,
                     const std::function<std::vector<double>(const RobotDescription&, size_t)>& numbers) {
    ForJoints([&](size_t i, size_t j) {
      if (!(a_.joints[i].*states) || !(b_.joints[j].*states)) return;
      const std::vector<double> own = numbers(a_, i);
      const std::vector<double> other = numbers(b_, j);
      for (size_t k = 0; k < own.size(); ++k) {
        AddConstant(constants, name, {Location::Kind::kJoint, static_cast<int>(i), -1}, own[k], other[k],
                    static_cast<int>(k));
      }
    });
  }

  void AddConstant(ConstantChecks* constants, const std::string& name, const Location& where, double a,
                   double b, int entry, double scale = 0.0) {
    const double size = std::max({std::abs(a), std::abs(b), scale});
    if (constants->Define(name)->Compare(a, b, size > 0.0 ? size : 1.0, where, -1) <= kRounding) return;
    constants->findings.push_back({name, Describe(where, model_a_, base_), a, b, where, entry});
  }

  void Add(Term term, double a, double b, double scale, const Location& where) {
    records_[term].Compare(a, b, scale, where, sample_);
  }

  /// Physical quantities: link frames are each description's own choice.
  void CompareLinks() {
    const double length = scales_.world_length();
    ForJoints([&](size_t i, size_t j) {
      const Joint& joint = a_.spec.joints[i];
      const Joint& other = b_.spec.joints[j];
      const Pose X_a = terms_a_.CalcLinkPose(static_cast<int>(i));
      const Pose X_b = terms_b_.CalcLinkPose(static_cast<int>(j));
      const Location at_joint{Location::Kind::kJoint, static_cast<int>(i), -1};
      const bool is_ball = joint.type == JointType::kBall;
      for (int col = is_ball ? 0 : 2; col < 3; ++col) {
        for (int k = 0; k < 3; ++k)
          Add(kJointAxis, X_a.linear()(k, col), X_b.linear()(k, col), 1.0, at_joint);
      }
      const Vector3d axis = X_a.linear().col(2);
      if (joint.type != JointType::kPrismatic) {
        const Vector3d anchor = X_b.translation();
        // A ball has one place, a hinge any along its axis.
        const double along = is_ball ? 0.0 : axis.dot(anchor - X_a.translation());
        const Vector3d foot = X_a.translation() + along * axis;
        for (int k = 0; k < 3; ++k) Add(kJointAxis, foot[k], anchor[k], length, at_joint);
      }
      CompareBody({Location::Kind::kLink, static_cast<int>(i), -1}, joint.body, X_a, other.body, X_b);
    });
    if (model_a_.base().type == BaseType::kFixed) return;
    CompareBody({Location::Kind::kLink, -1, -1}, model_a_.base_with_wheels(), terms_a_.CalcLinkPose(-1),
                model_b_.base_with_wheels(), terms_b_.CalcLinkPose(-1));
  }

  void CompareBody(const Location& where, const MassProperties& a, const Pose& X_a, const MassProperties& b,
                   const Pose& X_b) {
    if (a.mass > 0.0 && b.mass > 0.0) {
      const Vector3d com_a = X_a * a.com;
      const Vector3d com_b = X_b * b.com;
      for (int k = 0; k < 3; ++k) Add(kLinkCom, com_a[k], com_b[k], scales_.world_length(), where);
    }
    const Matrix3d I_a = X_a.linear() * a.inertia * X_a.linear().transpose();
    const Matrix3d I_b = X_b.linear() * b.inertia * X_b.linear().transpose();
    const double scale = CalcInertiaScale(a.mass, I_a, I_b);
    for (int k = 0; k < 9; ++k) Add(kLinkInertia, I_a.data()[k], I_b.data()[k], scale, where);
  }

  void CompareFrames(const VectorXd& xi) {
    const double acceleration = Positive(scales_.acceleration());
    const double angular_acceleration = Positive(scales_.angular_rate() * scales_.angular_rate());
    for (int frame = 0; frame < static_cast<int>(model_a_.frames().size()); ++frame) {
      const int other = model_b_.FindFrame(model_a_.frames()[static_cast<size_t>(frame)].name);
      const Location where{Location::Kind::kFrame, frame, -1};
      const Pose X_a = terms_a_.CalcFramePose(frame);
      const Pose X_b = terms_b_.CalcFramePose(other);
      for (int row = 0; row < 3; ++row) {
        Add(kFramePose, X_a.translation()[row], X_b.translation()[row], scales_.world_length(), where);
        for (int col = 0; col < 3; ++col)
          Add(kFramePose, X_a.linear()(row, col), X_b.linear()(row, col), 1.0, where);
      }
      terms_a_.CalcFrameJacobian(frame, J_a_, J_dot_a_);
      terms_b_.CalcFrameJacobian(other, J_b_, J_dot_b_);
      const Vector6d bias_a = J_dot_a_ * xi;
      const Vector6d bias_b = J_dot_b_ * xi_b_;
      for (int row = 0; row < 6; ++row) {
        const bool linear = row < 3;
        for (Eigen::Index col = 0; col < xi.size(); ++col) {
          const double scale = scales_.CalcVelocityScale(static_cast<int>(col));
          Add(kJ, J_a_(row, col), J_b_(row, velocity_of_[static_cast<size_t>(col)]),
              Positive(linear ? scale : scale / scales_.length()), where);
        }
        Add(kJDotXi, bias_a[row], bias_b[row], linear ? acceleration : angular_acceleration, where);
      }
    }
  }

  void CompareDynamics(const VectorXd& xi) {
    const int n = model_a_.num_velocities();
    const VectorXd force_a = terms_a_.C() * xi;
    const VectorXd force_b = terms_b_.C() * xi_b_;
    for (int col = 0; col < n; ++col) {
      const int other_col = velocity_of_[static_cast<size_t>(col)];
      const Location where{Location::Kind::kVelocity, col, -1};
      for (int row = 0; row < n; ++row) {
        const int other_row = velocity_of_[static_cast<size_t>(row)];
        const Location pair{Location::Kind::kVelocityPair, row, col};
        Add(kMassMatrix, terms_a_.M()(row, col), terms_b_.M()(other_row, other_col),
            scales_.CalcMassScale(row, col), pair);
        // C_ij is a force per velocity.
        const double rate =
            std::max(scales_.angular_rate(), scales_.linear_rate() / Positive(scales_.length()));
        Add(kCoriolisMatrix, terms_a_.C()(row, col), terms_b_.C()(other_row, other_col),
            Positive(scales_.CalcMassScale(row, col) * rate), pair);
      }
      Add(kCoriolisForce, force_a[col], force_b[other_col], scales_.CalcCoriolisScale(col), where);
      Add(kGravity, terms_a_.gravity()[col], terms_b_.gravity()[other_col], scales_.CalcGravityScale(col),
          where);
      Add(kFriction, terms_a_.friction()[col], terms_b_.friction()[other_col],
          scales_.CalcFrictionScale(col, xi), where);
    }
  }

  void CompareEnergies() {
    const EnergyAndMomentum a = terms_a_.CalcEnergyAndMomentum();
    const EnergyAndMomentum b = terms_b_.CalcEnergyAndMomentum();
    const double momentum = scales_.CalcMomentumScale();
    Add(kKineticEnergy, a.kinetic, b.kinetic, scales_.CalcKineticEnergyScale(), {});
    Add(kPotentialEnergy, a.potential, b.potential, scales_.CalcPotentialEnergyScale(), {});
    for (int k = 0; k < 3; ++k) {
      Add(kLinearMomentum, a.linear_momentum[k], b.linear_momentum[k], Positive(momentum), {});
      Add(kAngularMomentum, a.angular_momentum[k], b.angular_momentum[k],
          Positive(momentum * scales_.length()), {});
    }
  }

  const RobotDescription& a_;
  const RobotDescription& b_;
  RobotModel model_a_;
  RobotModel model_b_;
  ModelTerms terms_a_;
  ModelTerms terms_b_;
  RoundingScales scales_;
  int base_;
  std::vector<int> b_of_a_;
  std::vector<int> position_of_;  // index in b's q' and xi of each entry of a's
  std::vector<int> velocity_of_;
  VectorXd q_b_, xi_b_;
  Matrix6Xd J_a_, J_dot_a_, J_b_, J_dot_b_;
  CheckRecord records_[kTermCount];
  double sample_ = -1.0;
};

}  // namespace

ConsistencyResult CompareDescriptions(const RobotDescription& a, const RobotDescription& b,
                                      const ConsistencyOptions& options,
                                      const std::function<bool(long)>& progress) {
  const auto start = std::chrono::steady_clock::now();
  ModelComparison comparison(a, b);
  ConsistencyResult result;
  result.constants = comparison.CompareConstants();
  StateSource source(comparison.model(), options.range, options.seed);
  VectorXd q = VectorXd::Zero(comparison.model().num_positions());
  VectorXd xi = VectorXd::Zero(comparison.model().num_velocities());
  bool go_on = true;
  while (go_on && result.samples < options.samples) {
    const long sample = result.samples++;
    source.DrawPositions(&q);
    source.DrawVelocity(&xi);
    comparison.Compare(q, xi, sample);
    go_on = progress(result.samples);
  }
  result.terms = comparison.TakeRecords();
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace dexcheck
