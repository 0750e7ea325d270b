#include "harness/checks/force_evidence.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

// A candidate that explains this much of the squares is the force; what soft contacts add is less.
constexpr double kForceExplains = 0.95;
// A joint is preferred to a body that explains hardly more: a body has three numbers each step.
constexpr double kSimpler = 0.02;
// The first steps are looked at, then every one that is a power of two away.
constexpr long kFirstSteps = 8;
// Directions in which a link moves less than this fraction of the others do not count.
constexpr double kSingular = 1e-3;
// Gravity whose size differs by less than this fraction of its change only points elsewhere.
constexpr double kTilted = 0.2;

std::string Short(double value) { return FormatNumber(value, 3); }

std::string Percent(double fraction) { return std::to_string(std::lround(100.0 * fraction)) + " %"; }

bool IsLookedAt(long step) { return step < kFirstSteps || (step & (step - 1)) == 0; }

}  // namespace

ForceEvidence::ForceEvidence(const RobotModel& model)
    : model_(&model), kinematics_(model), actuation_(model) {
  const Base& base = model.base();
  const int base_velocities = model.num_base_velocities();
  for (int i = 0; i < base_velocities; ++i) {
    const bool wheels = base.type == BaseType::kDifferentialDrive;
    joints_.push_back({wheels ? (i == 0 ? base.wheel_joint_right : base.wheel_joint_left) : base.link});
  }
  for (const Joint& joint : model.joints()) joints_.push_back({joint.name});
  links_.push_back({base.link});
  for (const Joint& joint : model.joints()) links_.push_back({joint.link});
}

void ForceEvidence::CalcLinkJacobians(const VectorXd& q) {
  const Eigen::Index n = model_->num_velocities();
  link_jacobians_.assign(links_.size(), MatrixXd::Zero(3, n));
  // Velocities are linear in xi: its columns are those at the unit vectors.
  for (Eigen::Index i = 0; i < n; ++i) {
    kinematics_.SetState(q, VectorXd::Unit(n, i));
    for (int link = -1; link < model_->num_joints(); ++link) {
      const MassProperties& body =
          link < 0 ? model_->base_with_wheels() : model_->joints()[static_cast<size_t>(link)].body;
      const Vector6d V = kinematics_.CalcLinkVelocity(link);
      const Vector3d arm = kinematics_.CalcLinkPose(link).linear() * body.com;
      link_jacobians_[static_cast<size_t>(link + 1)].col(i) = V.head<3>() + V.tail<3>().cross(arm);
    }
  }
}

void ForceEvidence::AddJoints(const RowMatrixXd& half_inverse, const VectorXd& y, double weight) {
  const Eigen::Index n = y.size();
  VectorXd direction(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    actuation_.CalcForce(VectorXd::Unit(n, i), direction);
    const VectorXd column = half_inverse * direction;
    const double amplitude = column.dot(y) / column.squaredNorm();
    Candidate& joint = joints_[static_cast<size_t>(i)];
    joint.square += weight * amplitude * amplitude * column.squaredNorm();
    if (std::abs(amplitude) > std::abs(joint.largest)) joint.largest = amplitude;
  }
}

void ForceEvidence::AddLinks(const RowMatrixXd& half_inverse, const VectorXd& y, double weight) {
  for (size_t i = 0; i < links_.size(); ++i) {
    const MatrixXd columns = half_inverse * link_jacobians_[i].transpose();
    // A base on wheels moves in some directions only: least squares of least norm.
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition;
    decomposition.setThreshold(kSingular);
    const Vector3d force = decomposition.compute(columns).solve(y);
    links_[i].square += weight * (columns * force).squaredNorm();
    links_[i].largest = std::max(links_[i].largest, force.norm());
  }
}

void ForceEvidence::Add(const VectorXd& f, const Vector6d& w, const GraspModel& model, const VectorXd& q,
                        const TreeFactor& mass_factor, double scale) {
  if (!IsLookedAt(steps_++)) return;
  const Eigen::Index n = f.size();
  RowMatrixXd half_inverse = RowMatrixXd::Identity(n, n);
  mass_factor.SolveTransposedColumns(half_inverse);  // L^-T
  // Without an object there is no weight of one.
  const double object_mass = model_->object() ? model.grasp().object().mass : 0.0;
  const Eigen::LLT<Matrix6d> M_hat(model.grasp().body().M_hat);
  const VectorXd y = half_inverse * f;
  const Vector6d y_o = M_hat.matrixL().solve(w);
  const double weight = 1.0 / (scale * scale);
  if (!y.allFinite() || !y_o.allFinite()) return;
  squares_ += weight * (y.squaredNorm() + y_o.squaredNorm());
  robot_squares_ += weight * y.squaredNorm();
  object_force_ = std::max(object_force_, w.head<3>().norm());
  object_moment_ = std::max(object_moment_, w.tail<3>().norm());
  CalcLinkJacobians(q);
  AddJoints(half_inverse, y, weight);
  AddLinks(half_inverse, y, weight);

  // f = sum_b m_b J_b^T dg, w = [m R^T dg; 0]
  MatrixXd weights = MatrixXd::Zero(n, 3);
  for (int link = -1; link < model_->num_joints(); ++link) {
    const double mass =
        link < 0 ? model_->base_with_wheels().mass : model_->joints()[static_cast<size_t>(link)].body.mass;
    weights += mass * link_jacobians_[static_cast<size_t>(link + 1)].transpose();
  }
  Eigen::Matrix<double, 6, 3> object = Eigen::Matrix<double, 6, 3>::Zero();
  object.topRows<3>() = object_mass * model.grasp().X_Bo().linear().transpose();
  const MatrixXd columns = half_inverse * weights;
  const Eigen::Matrix<double, 6, 3> object_columns = M_hat.matrixL().solve(object);
  gravity_normal_ += weight * (columns.transpose() * columns + object_columns.transpose() * object_columns);
  gravity_product_ += weight * (columns.transpose() * y + object_columns.transpose() * y_o);
}

ForceFinding ForceEvidence::Find() const {
  ForceFinding finding;
  if (!has_any()) return finding;
  const auto larger = [](const Candidate& a, const Candidate& b) { return a.square < b.square; };
  if (robot_squares_ > 0.0) {
    const Candidate& joint = *std::max_element(joints_.begin(), joints_.end(), larger);
    finding.joint = joint.name;
    finding.joint_fraction = joint.square / robot_squares_;
    finding.torque = joint.largest;
    // Of links that explain it equally well, the one where the least force does: bodies near the base, which
    // a chain of joints carries along, move in few directions, and a huge force there may look the same. Of
    // forces that are as good as equal, the one nearest the base.
    const double best = std::max_element(links_.begin(), links_.end(), larger)->square;
    const auto explains = [&](const Candidate& one) { return one.square >= (1.0 - kSimpler) * best; };
    double least = std::numeric_limits<double>::infinity();
    for (const Candidate& one : links_) {
      if (explains(one)) least = std::min(least, one.largest);
    }
    const Candidate& link = *std::find_if(links_.begin(), links_.end(), [&](const Candidate& one) {
      return explains(one) && one.largest <= (1.0 + kSimpler) * least;
    });
    finding.link = link.name;
    finding.link_fraction = link.square / robot_squares_;
    finding.link_force = link.largest;
  }
  const Vector3d change = gravity_normal_.ldlt().solve(gravity_product_);
  finding.gravity = change;
  finding.gravity_fraction = change.dot(gravity_product_) / squares_;
  finding.object_fraction = 1.0 - robot_squares_ / squares_;
  finding.object_force = object_force_;
  finding.object_moment = object_moment_;
  return finding;
}

bool ForceEvidence::IsSlope(const ForceFinding& finding, const Vector3d& gravity) {
  if (finding.gravity_fraction < kForceExplains || gravity.isZero(0.0)) return false;
  const double along = std::abs(finding.gravity.dot(gravity.normalized()));
  return along < kTilted * finding.gravity.norm();
}

std::string ForceEvidence::Tell() const {
  const ForceFinding finding = Find();
  const Vector3d& gravity = model_->gravity();
  if (IsSlope(finding, gravity)) {
    const Vector3d actual = gravity + finding.gravity;
    const double slope = std::atan2(actual.cross(gravity).norm(), actual.dot(gravity));
    return "gravity is not upright but " + Short(RadToDeg(slope)) + " deg off, by (" +
           Short(finding.gravity.x()) + ", " + Short(finding.gravity.y()) + ", " +
           Short(finding.gravity.z()) + ") m/s^2; explains " + Percent(finding.gravity_fraction);
  }
  if (finding.gravity_fraction >= kForceExplains) {
    return "gravity differs by (" + Short(finding.gravity.x()) + ", " + Short(finding.gravity.y()) + ", " +
           Short(finding.gravity.z()) + ") m/s^2; explains " + Percent(finding.gravity_fraction);
  }
  const bool on_object = finding.object_fraction >= 0.5;
  if (on_object) {
    return "on body " + model_->object()->name + ", up to " + Short(finding.object_force) + " N, " +
           Short(finding.object_moment) + " N m; " + Percent(finding.object_fraction) + " of what is left";
  }
  const bool joint =
      finding.joint_fraction >= kForceExplains || finding.joint_fraction + kSimpler >= finding.link_fraction;
  if (joint) {
    return std::string(finding.joint_fraction >= kForceExplains ? "at" : "nearest:") + " joint " +
           finding.joint + ", up to " + Short(std::abs(finding.torque)) + " N m; explains " +
           Percent(finding.joint_fraction);
  }
  return std::string(finding.link_fraction >= kForceExplains ? "on" : "nearest:") + " body " + finding.link +
         ", up to " + Short(finding.link_force) + " N at its centre of mass; explains " +
         Percent(finding.link_fraction);
}

}  // namespace dexcheck
