#include "harness/engine/engine_terms.h"

#include <algorithm>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"
#include "controller/common/text.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

/// Calculates qfrc_passive, tendons included, after positions (mj_comPos) and velocities (mj_comVel):
/// springs, damping, fluid. The engine's mj_passive alone uses old lengths and rates of tendons.
void CalcPassiveForces(const mjModel& model, mjData* data) {
  if (model.ntendon > 0) {
    mj_tendon(&model, data);
    CalcTendonVelocities(model, data);
  }
  mj_passive(&model, data);
}

/// Whether passive forces depend on the places of geoms: tendons wrap around them, a fluid flows about them.
bool ForcesNeedGeoms(const mjModel& model) {
  const auto is_geom = [](int type) { return type == mjWRAP_SPHERE || type == mjWRAP_CYLINDER; };
  if (std::any_of(model.wrap_type, model.wrap_type + model.nwrap, is_geom)) return true;
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (model.geom_fluid[mjNFLUID * geom] != 0.0) return true;
  }
  return false;
}

}  // namespace

EngineTerms::EngineTerms(const Adapter& adapter, Coordinates coordinates, std::span<const int> frames)
    : adapter_(&adapter),
      engine_(mj_copyModel(nullptr, &adapter.engine())),
      data_(MakeDataWithoutContacts(*engine_)),
      map_(adapter, coordinates),
      base_size_(static_cast<int>(map_.base_columns().cols())),
      carrying_dofs_(static_cast<int>(map_.base_dofs().size() - adapter.wheels().size())),
      object_body_(adapter.object_body()) {
  const auto nv = static_cast<int>(engine_->nv);
  const int n = map_.size();
  for (const std::vector<int>& welded : adapter.welded_bodies()) {
    robot_bodies_.insert(robot_bodies_.end(), welded.begin(), welded.end());
  }
  q_.setZero(adapter.model().num_positions());
  M_.setZero(n, n);
  mass_nv_.setZero(nv, nv);
  for (VectorXd* of_engine : {&force_nv_, &bracket_nv_}) of_engine->setZero(nv);
  for (VectorXd* vector : {&coriolis_, &gravity_, &friction_, &other_velocity_, &other_force_})
    vector->setZero(n);
  FindObject();
  ListChains(frames);
  ListMass();
  // Gravity is formed from the masses' places, so that the bias force is Coriolis alone.
  mju_zero(engine_->opt.gravity, 3);
}

EngineTerms::EngineTerms(const Adapter& adapter, Coordinates coordinates)
    : EngineTerms(adapter, coordinates, ListIndices(adapter.model().frames().size())) {
  DropGeoms();
}

EngineTerms::EngineTerms(const Adapter& adapter, std::span<const int> fingertips)
    : EngineTerms(adapter, Coordinates::kReduced, fingertips) {
  if (object_body_ < 0) throw InputError("parameters: a grasp needs an object");
  RequireObject();
  FindTouchingGeoms(fingertips);
  DropGeoms();
}

void EngineTerms::DropGeoms() {
  // Geoms that touch are placed by CalcTouch. Forces depend on the others in hardly any robot.
  if (!ForcesNeedGeoms(*engine_)) engine_->ngeom = 0;
}

void EngineTerms::FindObject() {
  if (object_body_ < 0) return;
  const int joint = engine_->body_jntadr[object_body_];
  has_object_ = engine_->body_jntnum[object_body_] == 1 && engine_->jnt_type[joint] == mjJNT_FREE;
}

void EngineTerms::RequireObject() const {
  if (has_object_) return;
  throw InputError("MJCF: body " + Quote(NameOf(*engine_, mjOBJ_BODY, object_body_)) +
                   ": must move by a free joint");
}

void EngineTerms::FindTouchingGeoms(std::span<const int> fingertips) {
  for (const int frame : fingertips)
    chains_[static_cast<size_t>(frame)].tip_geom = adapter_->RequireTipGeom(frame);
  for (int g = 0; g < engine_->ngeom; ++g) {
    if (engine_->geom_bodyid[g] == object_body_ && CanTouch(*engine_, g)) object_geoms_.push_back(g);
  }
  if (object_geoms_.empty()) {
    throw InputError("MJCF: body " + Quote(NameOf(*engine_, mjOBJ_BODY, object_body_)) +
                     ": needs a geom that can touch");
  }
}

void EngineTerms::ListChains(std::span<const int> frames) {
  const std::vector<int>& joint_dofs = adapter_->joint_dofs();
  chains_.resize(adapter_->model().frames().size());
  for (const int frame : frames) {
    Chain& chain = chains_[static_cast<size_t>(frame)];
    for (int i = 0; i < base_size_; ++i) chain.coordinates.push_back(i);
    std::vector<bool> moves(static_cast<size_t>(engine_->nv), false);
    for (int body = body_of(frame); body > 0; body = engine_->body_parentid[body]) {
      for (int k = 0; k < engine_->body_dofnum[body]; ++k)
        moves[static_cast<size_t>(engine_->body_dofadr[body] + k)] = true;
    }
    for (size_t i = 0; i < joint_dofs.size(); ++i) {
      if (!moves[static_cast<size_t>(joint_dofs[i])]) continue;
      chain.coordinates.push_back(base_size_ + static_cast<int>(i));
      chain.dofs.push_back(joint_dofs[i]);
    }
  }
}

void EngineTerms::SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity,
                           const Pose& X_Bo, const Vector6d& V_Bo, const EvaluatedPositions& evaluated) {
  // Forces of tendons and fluids need more than places of bodies.
  const bool takes = engine_->ngeom == 0 && engine_->ntendon == 0;
  const EvaluatedPositions taken = takes ? evaluated : EvaluatedPositions{};
  q_ = q;
  SetPositions(q, X_Bo, taken);
  SetVelocities(q, velocity, V_Bo);
  CalcMass(taken.data == nullptr ? *data_ : *taken.data);
  CalcForces();
  CalcBodyAccelerations();
  CalcEnergyAndMomentum();
}

void EngineTerms::SetPositions(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo,
                               const EvaluatedPositions& evaluated) {
  const mjModel* m = engine_.get();
  mjData* d = data_.get();
  adapter_->SetPositions(q, d->qpos);
  if (has_object_) WriteFreePose(X_Bo, d->qpos + adapter_->object_qpos());
  tilt_.setIdentity();
  if (evaluated.data != nullptr) {
    tilt_ = evaluated.X_W0 * BasePose().inverse(Eigen::Isometry);
    return TakePositions(*evaluated.data);
  }
  mj_kinematics(m, d);
  mj_comPos(m, d);
  MakeMass(*m, d);
}

void EngineTerms::TakePositions(const mjData& from) {
  const mjModel& m = *engine_;
  mjData* d = data_.get();
  const auto take = [](const mjtNum* values, mjtNum* own, EngineSize count) {
    std::copy_n(values, count, own);
  };
  take(from.xpos, d->xpos, 3 * m.nbody);
  take(from.xquat, d->xquat, 4 * m.nbody);
  take(from.xmat, d->xmat, 9 * m.nbody);
  take(from.xipos, d->xipos, 3 * m.nbody);
  take(from.ximat, d->ximat, 9 * m.nbody);
  take(from.site_xpos, d->site_xpos, 3 * m.nsite);
  take(from.site_xmat, d->site_xmat, 9 * m.nsite);
  take(from.subtree_com, d->subtree_com, 3 * m.nbody);
  take(from.cinert, d->cinert, 10 * m.nbody);
  take(from.cdof, d->cdof, 6 * m.nv);
}

void EngineTerms::SetVelocities(const Eigen::Ref<const VectorXd>& q,
                                const Eigen::Ref<const VectorXd>& velocity, const Vector6d& V_Bo) {
  mjData* d = data_.get();
  map_.SetState(q, velocity, tilt_.linear());
  map_.Expand(velocity, d->qvel);
  map_.ExpandBias(d->qacc);
  if (has_object_) {
    // qvel = [R v; omega]; the rates of a constant V_Bo are [omega x R v; 0].
    const Matrix3d R = ObjectRotation();
    const Vector3d v = R * V_Bo.head<3>();
    const Vector3d turning = (R * V_Bo.tail<3>()).cross(v);
    mju_copy3(d->qvel + adapter_->object_dof(), v.data());
    mju_copy3(d->qvel + adapter_->object_dof() + 3, V_Bo.data() + 3);
    mju_copy3(d->qacc + adapter_->object_dof(), turning.data());
    mju_zero3(d->qacc + adapter_->object_dof() + 3);
  }
  mj_comVel(engine_.get(), d);
}

void EngineTerms::ListMass() {
  std::vector<int> own(static_cast<size_t>(engine_->nv), -1);
  for (size_t i = 0; i < adapter_->joint_dofs().size(); ++i)
    own[static_cast<size_t>(adapter_->joint_dofs()[i])] = base_size_ + static_cast<int>(i);
  for (int row = 0; row < engine_->nv; ++row) {
    int steps = 0;
    for (int col = row; col >= 0; col = engine_->dof_parentid[col], ++steps) {
      const int address = FindMassEntry(*engine_, row, steps);
      const int own_row = own[static_cast<size_t>(row)], own_col = own[static_cast<size_t>(col)];
      if (address >= 0) mass_entries_.push_back({row, col, address, own_row, own_col});
    }
  }
}

void EngineTerms::CalcMass(const mjData& evaluated) {
  const mjtNum* const entries = GetMassEntries(evaluated);
  for (const MassEntry& one : mass_entries_) {
    const double value = entries[one.address];
    mass_nv_(one.row, one.col) = mass_nv_(one.col, one.row) = value;
    if (one.own_row >= 0 && one.own_col >= 0)
      M_(one.own_row, one.own_col) = M_(one.own_col, one.own_row) = value;
  }
  const MatrixXd& T = map_.base_columns();
  const int* const base = map_.base_dofs().data();
  const int* const joints = adapter_->joint_dofs().data();
  for (Eigen::Index col = 0; col < base_size_; ++col) {
    for (Eigen::Index row = 0; row < base_size_; ++row) {
      double sum = 0.0;
      for (Eigen::Index j = 0; j < T.rows(); ++j) {
        double momentum = 0.0;
        for (Eigen::Index i = 0; i < T.rows(); ++i) momentum += mass_nv_(base[i], base[j]) * T(i, row);
        sum += momentum * T(j, col);
      }
      M_(row, col) = sum;
    }
  }
  for (Eigen::Index row = base_size_; row < M_.rows(); ++row) {
    const int dof = joints[row - base_size_];
    for (Eigen::Index col = 0; col < base_size_; ++col) {
      double sum = 0.0;
      // The wheels carry no joints.
      for (int k = 0; k < carrying_dofs_; ++k) sum += mass_nv_(dof, base[k]) * T(k, col);
      M_(row, col) = M_(col, row) = sum;
    }
  }
}

void EngineTerms::CalcForces() {
  const mjModel* m = engine_.get();
  mjData* d = data_.get();
  CalcBiasForce();
  map_.ProjectForce(force_nv_.data(), coriolis_);
  if (has_object_) object_coriolis_ = ObjectForce();

  // A dof moves its subtree's centre of mass by v + omega x p, both about the whole tree's centre of mass.
  const Vector3d g = MapVector(adapter_->engine().opt.gravity), tilted = tilt_.linear() * g;
  const int object = has_object_ ? adapter_->object_dof() : m->nv;
  for (int i = 0; i < m->nv; ++i) {
    const bool is_object = i >= object && i < object + 6;
    const int body = m->dof_bodyid[i];
    const Vector3d arm =
        MapVector(d->subtree_com + 3 * body) - MapVector(d->subtree_com + 3 * m->body_rootid[body]);
    const Vector3d moved = MapVector(d->cdof + 6 * i + 3) + MapVector(d->cdof + 6 * i).cross(arm);
    force_nv_[i] = -m->body_subtreemass[body] * (is_object ? g : tilted).dot(moved);
  }
  map_.ProjectForce(force_nv_.data(), gravity_);
  if (has_object_) object_gravity_ = ObjectForce();

  CalcPassiveForces(*m, d);
  map_.ProjectForce(d->qfrc_passive, friction_);
  friction_ = -friction_;
}

void EngineTerms::CalcBiasForce() {
  // bias + M T_dot velocity; the engine's recursion leaves out the armature.
  mj_rne(engine_.get(), data_.get(), 1, force_nv_.data());
  for (int i = 0; i < engine_->nv; ++i) force_nv_[i] += engine_->dof_armature[i] * data_->qacc[i];
}

void EngineTerms::CalcCoriolis(const Eigen::Ref<const VectorXd>& velocity, Eigen::Ref<VectorXd> result) {
  map_.SetState(q_, velocity);
  map_.Expand(velocity, data_->qvel);
  map_.ExpandBias(data_->qacc);
  mj_comVel(engine_.get(), data_.get());
  CalcBiasForce();
  map_.ProjectForce(force_nv_.data(), result);
}

void EngineTerms::CalcCoriolisProduct(const Eigen::Ref<const VectorXd>& velocity,
                                      const Eigen::Ref<const VectorXd>& w, Eigen::Ref<VectorXd> result) {
  other_velocity_ = velocity + w;
  CalcCoriolis(other_velocity_, result);
  other_velocity_ = velocity - w;
  CalcCoriolis(other_velocity_, other_force_);
  result -= other_force_;
  map_.ExpandBracket(q_, velocity, w, bracket_nv_.data());
  mj_mulM(engine_.get(), data_.get(), force_nv_.data(), bracket_nv_.data());
  // A ball's rotors have one inertia in all directions of its rates, and no gyroscopic forces.
  for (const int dof : adapter_->joint_dofs()) {
    if (engine_->jnt_type[engine_->dof_jntid[dof]] == mjJNT_BALL)
      force_nv_[dof] -= engine_->dof_armature[dof] * bracket_nv_[dof];
  }
  map_.ProjectForce(force_nv_.data(), other_force_);
  result = 0.25 * result + 0.5 * other_force_;
}

void EngineTerms::CalcBodyAccelerations() {
  const mjModel& m = *engine_;
  mjData* d = data_.get();
  mju_zero(d->cacc, 6);
  for (int body = 1; body < m.nbody; ++body) {
    Eigen::Map<Vector6d> a(d->cacc + 6 * body);
    a = Eigen::Map<const Vector6d>(d->cacc + 6 * m.body_parentid[body]);
    for (int k = 0; k < m.body_dofnum[body]; ++k) {
      const int dof = m.body_dofadr[body] + k;
      a += d->qvel[dof] * Eigen::Map<const Vector6d>(d->cdof_dot + 6 * dof) +
           d->qacc[dof] * Eigen::Map<const Vector6d>(d->cdof + 6 * dof);
    }
  }
}

void EngineTerms::CalcEnergyAndMomentum() {
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
  Vector3d com = Vector3d::Zero();
  if (total_mass > 0.0) com = mass_moment / total_mass;
  energy_.angular_momentum = Turn(about_origin - com.cross(energy_.linear_momentum));
  energy_.linear_momentum = Turn(energy_.linear_momentum);
  energy_.com = Move(com);
  energy_.potential = -MapVector(adapter_->engine().opt.gravity).dot(total_mass * energy_.com);
}

}  // namespace dexcheck
