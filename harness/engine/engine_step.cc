#include "harness/engine/engine_step.h"

#include <algorithm>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Vector3d MapVector(const mjtNum* v) { return {v[0], v[1], v[2]}; }

int FindTipGeom(const mjModel& model, int site) {
  const int body = model.site_bodyid[site];
  for (int g = 0; g < model.ngeom; ++g) {
    if (model.geom_bodyid[g] == body && model.geom_type[g] == mjGEOM_SPHERE && CanTouch(model, g)) return g;
  }
  throw InputError("MJCF: site " + Quote(NameOf(model, mjOBJ_SITE, site)) +
                   ": its body needs a sphere that can touch");
}

/// Dofs from `dof` to the root, itself included.
int CountAncestors(const mjModel& model, int dof) {
  int count = 0;
  for (int i = dof; i >= 0; i = model.dof_parentid[i]) ++count;
  return count;
}

}  // namespace

EngineStep::EngineStep(const Adapter& adapter, std::span<const int> fingertips)
    : adapter_(&adapter),
      engine_(mj_copyModel(nullptr, &adapter.engine())),
      data_(MakeData(*engine_)),
      map_(adapter, Coordinates::kReduced),
      base_size_(adapter.model().num_base_velocities()),
      carrying_dofs_(static_cast<int>(map_.base_dofs().size() - adapter.wheels().size())),
      object_body_(adapter.object_body()) {
  const int nv = engine_->nv;
  const int n = map_.size();
  for (const std::vector<int>& welded : adapter.welded_bodies()) {
    robot_bodies_.insert(robot_bodies_.end(), welded.begin(), welded.end());
  }
  const Eigen::Index base_dofs = map_.base_columns().rows();
  base_mass_.setZero(base_dofs, base_dofs);
  force_nv_.setZero(nv);
  coriolis_.setZero(n);
  gravity_.setZero(n);
  friction_.setZero(n);
  J_nv_.setZero(6, nv);
  object_force_.setZero(12);
  FindObject();
  ListMassEntries();
  ListChains(fingertips);

  // Gravity is formed from the masses' places, so that the bias force is Coriolis alone. Of the geoms only
  // those that touch are needed, and placed where they are.
  mju_zero(engine_->opt.gravity, 3);
  engine_->ngeom = 0;
}

void EngineStep::FindObject() {
  if (object_body_ < 0) throw InputError("parameters: a grasp needs an object");
  const std::string key = "MJCF: body " + Quote(NameOf(*engine_, mjOBJ_BODY, object_body_)) + ": ";
  const int joint = engine_->body_jntadr[object_body_];
  if (engine_->body_jntnum[object_body_] != 1 || engine_->jnt_type[joint] != mjJNT_FREE) {
    throw InputError(key + "must move by a free joint");
  }
  object_qpos_ = engine_->jnt_qposadr[joint];
  object_dof_ = engine_->jnt_dofadr[joint];
  for (int g = 0; g < engine_->ngeom; ++g) {
    if (engine_->geom_bodyid[g] == object_body_ && CanTouch(*engine_, g)) object_geoms_.push_back(g);
  }
  if (object_geoms_.empty()) throw InputError(key + "needs a geom that can touch");
}

void EngineStep::ListMassEntries() {
  const mjModel& m = *engine_;
  for (int row = 0; row < base_size_; ++row) {
    for (int col = 0; col <= row; ++col) mass_entries_.push_back({row, col});
  }
  const std::vector<int>& dofs = adapter_->joint_dofs();
  for (size_t i = 0; i < dofs.size(); ++i) {
    for (int col = 0; col < base_size_; ++col)
      mass_entries_.push_back({base_size_ + static_cast<int>(i), col});
    // A row of qM goes from the diagonal to the root, where the base's dofs are.
    base_entries_.push_back(m.dof_Madr[dofs[i]] + CountAncestors(m, dofs[i]) - 1);
  }
  std::vector<int> coordinate(static_cast<size_t>(m.nv), -1);
  for (size_t i = 0; i < dofs.size(); ++i) {
    coordinate[static_cast<size_t>(dofs[i])] = base_size_ + static_cast<int>(i);
  }
  for (const int dof : dofs) {
    int address = m.dof_Madr[dof];
    for (int other = dof; other >= 0; other = m.dof_parentid[other], ++address) {
      const int row = coordinate[static_cast<size_t>(dof)];
      const int col = coordinate[static_cast<size_t>(other)];
      if (col < 0) continue;
      mass_entries_.push_back({std::max(row, col), std::min(row, col)});
      joint_entries_.push_back(address);
    }
  }
  mass_.setZero(static_cast<Eigen::Index>(mass_entries_.size()));
}

void EngineStep::ListChains(std::span<const int> fingertips) {
  const RobotModel& model = adapter_->model();
  std::vector<bool> needed(static_cast<size_t>(engine_->nbody), false);
  for (const int frame : fingertips) {
    const int site = adapter_->frame_sites()[static_cast<size_t>(frame)];
    tip_sites_.push_back(site);
    tip_bodies_.push_back(engine_->site_bodyid[site]);
    tip_geoms_.push_back(FindTipGeom(*engine_, site));
    for (int body = tip_bodies_.back(); body > 0; body = engine_->body_parentid[body]) {
      needed[static_cast<size_t>(body)] = true;
    }
    std::vector<int> chain;
    for (int i = model.frames()[static_cast<size_t>(frame)].link; i >= 0;
         i = model.joints()[static_cast<size_t>(i)].parent) {
      chain.insert(chain.begin(), base_size_ + i);
    }
    std::vector<int> dofs;
    dofs.reserve(chain.size());
    for (const int coordinate : chain) {
      dofs.push_back(adapter_->joint_dofs()[static_cast<size_t>(coordinate - base_size_)]);
    }
    for (int i = base_size_ - 1; i >= 0; --i) chain.insert(chain.begin(), i);
    chains_.push_back(chain);
    chain_dofs_.push_back(dofs);
  }
  needed[static_cast<size_t>(object_body_)] = true;
  for (int body = 1; body < engine_->nbody; ++body) {
    if (needed[static_cast<size_t>(body)]) moving_bodies_.push_back(body);
  }
}

void EngineStep::SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& xi,
                          const Pose& X_Bo, const Vector6d& V_Bo) {
  SetPositions(q, X_Bo);
  SetVelocities(q, xi, V_Bo);
  CalcMass();
  CalcForces();
  CalcBodyAccelerations();
  CalcEnergyAndMomentum();
}

void EngineStep::SetPositions(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo) {
  const mjModel* m = engine_.get();
  mjData* d = data_.get();
  adapter_->SetPositions(q, d->qpos);
  mjtNum* const pose = d->qpos + object_qpos_;
  const Eigen::Quaterniond rotation(X_Bo.linear());
  for (int k = 0; k < 3; ++k) pose[k] = X_Bo.translation()[k];
  pose[3] = rotation.w();
  pose[4] = rotation.x();
  pose[5] = rotation.y();
  pose[6] = rotation.z();
  mj_kinematics(m, d);
  mj_comPos(m, d);
  mj_crb(m, d);
}

void EngineStep::SetVelocities(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& xi,
                               const Vector6d& V_Bo) {
  mjData* d = data_.get();
  map_.SetState(q, xi);
  map_.Expand(xi, d->qvel);
  map_.ExpandBias(d->qacc);
  // qvel = [R v; omega]; the rates of a constant V_Bo are [omega x R v; 0].
  const Matrix3d R = ObjectRotation();
  const Vector3d v = R * V_Bo.head<3>();
  const Vector3d turning = (R * V_Bo.tail<3>()).cross(v);
  for (int k = 0; k < 3; ++k) {
    d->qvel[object_dof_ + k] = v[k];
    d->qvel[object_dof_ + 3 + k] = V_Bo[3 + k];
    d->qacc[object_dof_ + k] = turning[k];
    d->qacc[object_dof_ + 3 + k] = 0.0;
  }
  mj_comVel(engine_.get(), d);
}

void EngineStep::CalcMass() {
  const mjModel& m = *engine_;
  const mjtNum* const qM = data_->qM;
  const MatrixXd& T = map_.base_columns();
  const std::vector<int>& dofs = map_.base_dofs();
  // T^T M T among the base and the wheels, which hang on it.
  for (Eigen::Index i = 0; i < base_mass_.rows(); ++i) {
    const int dof = dofs[static_cast<size_t>(i)];
    int address = m.dof_Madr[dof];
    for (int other = dof; other >= 0; other = m.dof_parentid[other], ++address) {
      const Eigen::Index j = other == dof ? i : other - dofs[0];
      base_mass_(i, j) = base_mass_(j, i) = qM[address];
    }
  }
  Eigen::Index entry = 0;
  for (int row = 0; row < base_size_; ++row) {
    for (int col = 0; col <= row; ++col) {
      double sum = 0.0;
      for (Eigen::Index j = 0; j < T.rows(); ++j) sum += base_mass_.col(j).dot(T.col(row)) * T(j, col);
      mass_[entry++] = sum;
    }
  }
  for (const int address : base_entries_) {
    for (int col = 0; col < base_size_; ++col) {
      double sum = 0.0;
      for (int k = 0; k < carrying_dofs_; ++k) sum += qM[address - k] * T(k, col);
      mass_[entry++] = sum;
    }
  }
  for (const int address : joint_entries_) mass_[entry++] = qM[address];
}

void EngineStep::CalcForces() {
  const mjModel* m = engine_.get();
  mjData* d = data_.get();
  const auto object_rows = [&] { return force_nv_.segment<6>(object_dof_); };

  // T^T (bias + M T_dot xi); the engine's recursion leaves out the armature.
  mj_rne(m, d, 1, force_nv_.data());
  for (int i = 0; i < m->nv; ++i) force_nv_[i] += m->dof_armature[i] * d->qacc[i];
  map_.ProjectForce(force_nv_.data(), coriolis_);
  object_force_.head<6>() = object_rows();

  // A dof moves the centre of mass of what it carries by v + omega x p, both about the whole tree's centre of
  // mass.
  const Vector3d g = MapVector(adapter_->engine().opt.gravity);
  for (int i = 0; i < m->nv; ++i) {
    const int body = m->dof_bodyid[i];
    const Vector3d arm =
        MapVector(d->subtree_com + 3 * body) - MapVector(d->subtree_com + 3 * m->body_rootid[body]);
    const Vector3d moved = MapVector(d->cdof + 6 * i + 3) + MapVector(d->cdof + 6 * i).cross(arm);
    force_nv_[i] = -m->body_subtreemass[body] * g.dot(moved);
  }
  map_.ProjectForce(force_nv_.data(), gravity_);
  object_force_.tail<6>() = object_rows();

  mj_passive(m, d);
  map_.ProjectForce(d->qfrc_passive, friction_);
  friction_ = -friction_;
}

void EngineStep::CalcBodyAccelerations() {
  const mjModel& m = *engine_;
  mjData* d = data_.get();
  mju_zero(d->cacc, 6);
  for (const int body : moving_bodies_) {
    Eigen::Map<Vector6d> a(d->cacc + 6 * body);
    a = Eigen::Map<const Vector6d>(d->cacc + 6 * m.body_parentid[body]);
    for (int k = 0; k < m.body_dofnum[body]; ++k) {
      const int dof = m.body_dofadr[body] + k;
      a += d->qvel[dof] * Eigen::Map<const Vector6d>(d->cdof_dot + 6 * dof) +
           d->qacc[dof] * Eigen::Map<const Vector6d>(d->cdof + 6 * dof);
    }
  }
}

void EngineStep::CalcEnergyAndMomentum() {
  const mjModel& m = *engine_;
  const mjData* d = data_.get();
  energy_ = EnergyAndMomentum{};
  double total_mass = 0.0;
  Vector3d mass_moment = Vector3d::Zero();
  Vector3d about_origin = Vector3d::Zero();
  for (const int body : robot_bodies_) {
    // About the centre of mass of the body's tree: inertia (xx, yy, zz, xy, xz, yz), mass times centre of
    // mass, mass.
    const mjtNum* I = d->cinert + 10 * body;
    const Vector3d omega = MapVector(d->cvel + 6 * body);
    const Vector3d v = MapVector(d->cvel + 6 * body + 3);
    const Vector3d mc = MapVector(I + 6);
    const Vector3d p = I[9] * v + omega.cross(mc);
    Vector3d L = mc.cross(v);
    L[0] += I[0] * omega[0] + I[3] * omega[1] + I[4] * omega[2];
    L[1] += I[3] * omega[0] + I[1] * omega[1] + I[5] * omega[2];
    L[2] += I[4] * omega[0] + I[5] * omega[1] + I[2] * omega[2];
    energy_.kinetic += 0.5 * (omega.dot(L) + v.dot(p));
    energy_.linear_momentum += p;
    const Vector3d center = MapVector(d->subtree_com + 3 * m.body_rootid[body]);
    about_origin += L + center.cross(p);
    total_mass += I[9];
    mass_moment += I[9] * center + mc;
  }
  const auto add_rotor = [&](int dof) {
    energy_.kinetic += 0.5 * m.dof_armature[dof] * d->qvel[dof] * d->qvel[dof];
  };
  for (const int dof : map_.base_dofs()) add_rotor(dof);
  for (const int dof : adapter_->joint_dofs()) add_rotor(dof);
  if (total_mass > 0.0) energy_.com = mass_moment / total_mass;
  energy_.potential = -MapVector(adapter_->engine().opt.gravity).dot(mass_moment);
  energy_.angular_momentum = about_origin - energy_.com.cross(energy_.linear_momentum);
}

}  // namespace dexcheck
