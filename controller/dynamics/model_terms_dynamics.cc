// Dynamics: M, C and F by integrals over each joint's subtree (section 3).

#include <cmath>
#include <stdexcept>

#include "controller/dynamics/model_terms.h"

namespace dexcheck {
namespace {

/// S_i . (I S_j) and its kin for all columns i of the path at once: the arrays are rows of path_ (w, v,
/// w_dot, v_dot), and the forces those of FillRowAndColumn.
template <bool with_C>
void ProjectOnPath(int length, const double* path, Eigen::Index stride, const Vector6d& inertia_force,
                   const Vector6d& column_force, const Vector3d& row_force, double* M, double* C_column,
                   double* C_row) {
  using Block = Eigen::Array4d;
  for (int k = 0; k < length; k += static_cast<int>(Block::SizeAtCompileTime)) {
    Block m = Block::Zero(), column = Block::Zero(), row = Block::Zero();
    for (int i = 0; i < 6; ++i) {
      const Block S(path + i * stride + k);
      m += inertia_force[i] * S;
      if constexpr (!with_C) continue;
      column += column_force[i] * S;
      row += inertia_force[i] * Block(path + (6 + i) * stride + k);
      if (i < 3) row += row_force[i] * S;
    }
    Block::Map(M + k) = m;
    if constexpr (!with_C) continue;
    Block::Map(C_column + k) = column;
    Block::Map(C_row + k) = row;
  }
}

/// integral p x (w x p) = ((tr P) 1 - P) w. @param P its six entries.
Vector3d TurnMass(const double* P, const Vector3d& w) {
  return (P[0] + P[3] + P[5]) * w - Vector3d(P[0] * w[0] + P[1] * w[1] + P[2] * w[2],
                                             P[1] * w[0] + P[3] * w[1] + P[4] * w[2],
                                             P[2] * w[0] + P[4] * w[1] + P[5] * w[2]);
}

/// integral p x (w x p_dot) = ((tr Q) 1 - Q) w.
Vector3d TurnMovingMass(const Matrix3d& Q, const Vector3d& w) { return Q.trace() * w - Q * w; }

using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

}  // namespace

ModelTerms::MassIntegrals& ModelTerms::MassIntegrals::operator+=(const MassIntegrals& other) {
  m += other.m;
  for (int i = 0; i < 3; ++i) mp[i] += other.mp[i];
  for (int i = 0; i < 6; ++i) P[i] += other.P[i];
  for (int i = 0; i < 3; ++i) h[i] += other.h[i];
  for (int i = 0; i < 9; ++i) Q[i] += other.Q[i];
  return *this;
}

ModelTerms::MassIntegrals ModelTerms::CalcLinkIntegrals(const LinkMass& mass, const LinkState& state) {
  const Matrix3d& R = state.R;
  const Vector3d& p = state.p;
  const Vector3d& w = state.w;
  const Vector3d& v = state.v;
  MassIntegrals sum;
  sum.m = mass.m;
  const Vector3d R_mc = R * mass.mc;
  const Vector3d mp = mass.m * p + R_mc;
  // P = integral (p + R x)(p + R x)^T = R P_link R^T + p (R m c)^T + (m p + R m c) p^T
  Matrix3d P_link;
  P_link << mass.P[0], mass.P[1], mass.P[2], mass.P[1], mass.P[3], mass.P[4], mass.P[2], mass.P[4], mass.P[5];
  const Matrix3d RP = R * P_link;
  Matrix3d P;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      P(i, j) = P(j, i) = RP.row(i).dot(R.row(j)) + p[i] * R_mc[j] + mp[i] * p[j];
    }
  }
  // h = integral p_dot,  Q = integral p_dot p^T,  with p_dot = v + w x p
  const Vector3d h = mass.m * v + w.cross(mp);
  Matrix3d Q = v * mp.transpose();
  for (int j = 0; j < 3; ++j) Q.col(j) += w.cross(Vector3d(P.col(j)));

  for (int i = 0; i < 3; ++i) {
    sum.mp[i] = mp[i];
    sum.h[i] = h[i];
    for (int j = 0; j < 3; ++j) sum.Q[3 * i + j] = Q(i, j);
  }
  const double P_entries[6] = {P(0, 0), P(0, 1), P(0, 2), P(1, 1), P(1, 2), P(2, 2)};
  for (int i = 0; i < 6; ++i) sum.P[i] = P_entries[i];
  return sum;
}

void ModelTerms::PushColumn(int depth, const Column& column, int dof) {
  for (int i = 0; i < 3; ++i) {
    path_(i, depth) = column.w[i];
    path_(3 + i, depth) = column.v[i];
    path_(6 + i, depth) = column.w_dot[i];
    path_(9 + i, depth) = column.v_dot[i];
  }
  path_dofs_[static_cast<size_t>(depth)] = dof;
}

template <bool with_C>
void ModelTerms::FillRowAndColumn(int depth, int dof, const Column& column, const MassIntegrals& subtree) {
  const Eigen::Map<const Vector3d> mp(subtree.mp);
  const Eigen::Map<const Vector3d> h(subtree.h);
  // I S = [integral p x (v + w x p); integral (v + w x p)]
  const auto apply_inertia = [&](const Vector3d& w, const Vector3d& v) {
    Vector6d force;
    force << TurnMass(subtree.P, w) + mp.cross(v), subtree.m * v + w.cross(Vector3d(mp));
    return force;
  };
  const Vector6d inertia_force = apply_inertia(column.w, column.v);
  Vector6d column_force = Vector6d::Zero();
  Vector3d row_force = Vector3d::Zero();
  if constexpr (with_C) {
    // I S_dot + integral [p x (w x p_dot); w x p_dot], and the same operator transposed
    const Matrix3d Q = Eigen::Map<const RowMatrix3d>(subtree.Q);
    column_force = apply_inertia(column.w_dot, column.v_dot);
    column_force.head<3>() += TurnMovingMass(Q, column.w);
    column_force.tail<3>() += column.w.cross(Vector3d(h));
    row_force = TurnMovingMass(Q.transpose(), column.w) + Vector3d(h).cross(column.v);
  }
  ProjectOnPath<with_C>(PaddedPathLength(depth + 1), path_.data(), path_.cols(), inertia_force, column_force,
                        row_force, path_M_.data(), path_C_column_.data(), path_C_row_.data());
  for (int k = 0; k <= depth; ++k) {
    const int other = path_dofs_[static_cast<size_t>(k)];
    M_(other, dof) = M_(dof, other) = path_M_[k];
    if constexpr (!with_C) continue;
    C_(other, dof) = path_C_column_[k];
    C_(dof, other) = path_C_row_[k];
  }
}

void ModelTerms::CalcDynamics() {
  for (size_t i = 0; i < links_.size(); ++i) subtrees_[i] = CalcLinkIntegrals(masses_[i], links_[i]);
  Fill<true>();
}

void ModelTerms::CalcMassAndCoriolis() {
  if (base_size_ > model_->num_base_velocities())
    throw std::invalid_argument("CalcMassAndCoriolis: needs reduced coordinates");
  for (size_t i = 0; i < links_.size(); ++i) subtrees_[i] = CalcLinkIntegrals(masses_[i], links_[i]);
  CalcCoriolis();
  Fill<false>();
}

void ModelTerms::CalcCoriolis() {
  // Outward: the twist's derivative of each link at zero acceleration is the sum of S_dot_i velocity_i, and
  // the force that it needs is integral [p x p_ddot; p_ddot] with p_ddot = v_dot + w_dot x p + w x p_dot.
  const auto accelerate = [this](LinkForce* it, int begin, int count) {
    for (int i = begin; i < begin + count; ++i) {
      it->w_dot += velocity_[i] * columns_[static_cast<size_t>(i)].w_dot;
      it->v_dot += velocity_[i] * columns_[static_cast<size_t>(i)].v_dot;
    }
  };
  for (size_t i = 0; i < links_.size(); ++i) {
    LinkForce& it = forces_[i];
    if (i == 0) {
      it = LinkForce{};
      accelerate(&it, 0, base_size_);
    } else {
      const JointPlace& place = places_[i - 1];
      it = forces_[static_cast<size_t>(place.parent + 1)];
      accelerate(&it, base_size_ + model_->dof(static_cast<int>(i) - 1), CountVelocities(place.type));
    }
    const MassIntegrals& body = subtrees_[i];
    const Vector3d mp(body.mp), h(body.h), &w = links_[i].w;
    it.moment = TurnMass(body.P, it.w_dot) + mp.cross(it.v_dot) +
                TurnMovingMass(Eigen::Map<const RowMatrix3d>(body.Q), w);
    it.force = body.m * it.v_dot + it.w_dot.cross(mp) + w.cross(h);
  }
  // Inward: the forces of all links that a coordinate carries.
  const auto project = [this](const LinkForce& it, int begin, int count) {
    for (int i = begin; i < begin + count; ++i) {
      const Column& S = columns_[static_cast<size_t>(i)];
      coriolis_[i] = S.w.dot(it.moment) + S.v.dot(it.force);
    }
  };
  for (size_t i = places_.size(); i > 0; --i) {
    const LinkForce& it = forces_[i];
    project(it, base_size_ + model_->dof(static_cast<int>(i) - 1), CountVelocities(places_[i - 1].type));
    LinkForce& parent = forces_[static_cast<size_t>(places_[i - 1].parent + 1)];
    parent.moment += it.moment;
    parent.force += it.force;
  }
  project(forces_[0], 0, base_size_);
}

template <bool with_C>
void ModelTerms::Fill() {
  for (size_t i = places_.size(); i > 0; --i)
    subtrees_[static_cast<size_t>(places_[i - 1].parent + 1)] += subtrees_[i];
  // Gravity's generalised force on column i: -(w_i . integral p x g + v_i . integral g)
  const Vector3d g = base_R_.transpose() * model_->gravity();
  const auto fill = [&](int depth, int dof, const MassIntegrals& subtree) {
    const Column& column = columns_[static_cast<size_t>(dof)];
    PushColumn(depth, column, dof);
    FillRowAndColumn<with_C>(depth, dof, column, subtree);
    const Eigen::Map<const Vector3d> mp(subtree.mp);
    gravity_[dof] = -(column.w.dot(mp.cross(g)) + subtree.m * column.v.dot(g));
  };
  for (int i = 0; i < base_size_; ++i) fill(i, i, subtrees_[0]);
  for (const int joint : model_->depth_first()) {
    const int velocities = CountVelocities(places_[static_cast<size_t>(joint)].type);
    for (int k = 0; k < velocities; ++k) {
      fill(base_size_ + model_->depth(joint) - velocities + k, base_size_ + model_->dof(joint) + k,
           subtrees_[static_cast<size_t>(joint + 1)]);
    }
  }
  AddWheelsAndRotors();
}

void ModelTerms::AddWheelsAndRotors() {
  for (int i = 0; i < model_->num_dofs(); ++i) {
    const Joint& joint = model_->joint(model_->joint_of_dof(i));
    const int dof = base_size_ + i;
    M_(dof, dof) += joint.armature;
    friction_[dof] = joint.damping * velocity_[dof];
  }
  const Base& base = model_->base();
  if (base.type != BaseType::kDifferentialDrive) {
    friction_.head(base_size_).setZero();
    return;
  }
  // Rolling ties the wheel rates to the base's motion: thetadot = K v with constant K in reduced coordinates,
  // or the wheel_map along the heading in unreduced ones. M += K^T I K, F += K^T D K v.
  const double spin = base.wheel.spin_inertia + base.wheel.armature;
  Eigen::Matrix<double, 2, 3> K = Eigen::Matrix<double, 2, 3>::Zero();
  for (int i = 0; i < base_size_; ++i) {
    const Column& column = columns_[static_cast<size_t>(i)];
    K.col(i) = wheel_map_ * Vector3d(column.v.x(), column.v.y(), column.w.z());
  }
  const Matrix3d K_spin_K = spin * K.transpose() * K;
  M_.topLeftCorner(base_size_, base_size_) += K_spin_K.topLeftCorner(base_size_, base_size_);
  friction_.head(base_size_) = (base.wheel.damping * K.transpose() * wheel_rates_).head(base_size_);
  if (base_size_ != 3) return;

  // In q_v_dot the spin part is M_w = k u u^T on (x, y), u = [cos phi, sin phi], k = 2 I / r^2; its
  // Christoffel matrix, with D = d(u u^T)/d phi:  C_xy = k D phi_dot / 2,  C_x,phi = k D q_dot / 2 =
  // -C_phi,x^T.
  const double k = 2.0 * spin / (base.wheel_radius * base.wheel_radius);
  Eigen::Matrix2d D;
  D << -std::sin(2.0 * phi_), std::cos(2.0 * phi_), std::cos(2.0 * phi_), std::sin(2.0 * phi_);
  const Eigen::Vector2d cross = 0.5 * k * D * velocity_.head<2>();
  C_.topLeftCorner<2, 2>() += 0.5 * k * velocity_[2] * D;
  C_.block<2, 1>(0, 2) += cross;
  C_.block<1, 2>(2, 0) -= cross.transpose();
}

EnergyAndMomentum ModelTerms::CalcEnergyAndMomentum() const {
  const MassIntegrals& all = subtrees_[0];
  const Eigen::Map<const Vector3d> mp(all.mp);
  const Eigen::Map<const Vector3d> h(all.h);
  EnergyAndMomentum result;
  const Vector3d com = mp / all.m;
  result.com = base_position_ + base_R_ * com;
  // T = 1/2 velocity^T M velocity, column by column below the diagonal: a product M velocity would allocate.
  for (int i = 0; i < size_; ++i) {
    const int below = size_ - i - 1;
    result.kinetic +=
        velocity_[i] * (0.5 * M_(i, i) * velocity_[i] + M_.col(i).tail(below).dot(velocity_.tail(below)));
  }
  result.potential = -all.m * model_->gravity().dot(result.com);
  result.linear_momentum = base_R_ * h;
  // integral p x p_dot = [Q_zy - Q_yz; Q_xz - Q_zx; Q_yx - Q_xy]; then the wheels' spin about the axle.
  Vector3d angular(all.Q[7] - all.Q[5], all.Q[2] - all.Q[6], all.Q[3] - all.Q[1]);
  angular.y() += model_->base().wheel.spin_inertia * wheel_rates_.sum();
  result.angular_momentum = base_R_ * (angular - com.cross(Vector3d(h)));
  return result;
}

}  // namespace dexcheck
