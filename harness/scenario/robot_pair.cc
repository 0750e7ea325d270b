#include "harness/scenario/robot_pair.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "harness/base/files.h"
#include "harness/comparison/engine_constants.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/mujoco_release.h"
#include "harness/plant/engine_simulation.h"
#include "harness/plant/random_stream.h"

namespace dexcheck {
namespace {

/// Nothing moves in a run but the robot, its base and its object.
void RequireNothingElse(const Adapter& adapter, const std::string& mjcf) {
  if (adapter.other_joints().empty()) return;
  throw InputError(mjcf + ": must have nothing that moves but the robot and its object, has joint " +
                   Quote(NameOf(adapter.engine(), mjOBJ_JOINT, adapter.other_joints().front())));
}

void RequireUsable(const Scenario& scenario, const RobotModel& model) {
  const std::string& robot = model.spec().source;
  if ((model.base().type == BaseType::kFloating) != scenario.stands()) {
    throw InputError(scenario.stands() ? robot + ": base.type: must be \"floating\" to stand on feet"
                                       : robot +
                                             ": base.type: must not be \"floating\" in a run, unless the "
                                             "robot stands on feet ([stance])");
  }
  RequireNoBalls(model, "in a run, whose law has one number for each joint");
  if (!model.object() && scenario.joint_task() == nullptr) {
    throw InputError(robot + ": object: is missing, and the scenario holds one");
  }
}

/// The robot that a rigid plant moves: the scenario's, whatever the controller is made to believe.
std::unique_ptr<RobotModel> ReadRigidModel(const Scenario& scenario, const std::string& robot) {
  if (scenario.plant.type != PlantType::kRigid) return nullptr;
  const auto first = scenario.model_overrides.begin();
  const std::vector<std::string> own(first,
                                     first + static_cast<std::ptrdiff_t>(scenario.own_model_overrides));
  return std::make_unique<RobotModel>(ParseRobotModel(ReadBytes(robot), robot, own));
}

/// Gives contact pairs this friction along the surface, those with a floor or all others.
void SetFriction(double mu, bool of_floors, mjModel* engine) {
  const mjModel& m = *engine;
  for (int pair = 0; pair < m.npair; ++pair) {
    const bool has_floor =
        m.geom_type[m.pair_geom1[pair]] == mjGEOM_PLANE || m.geom_type[m.pair_geom2[pair]] == mjGEOM_PLANE;
    if (has_floor == of_floors) m.pair_friction[5 * pair] = m.pair_friction[5 * pair + 1] = mu;
  }
}

void ApplyFriction(const PlantOptions& plant, mjModel* engine) {
  if (plant.floor_friction) SetFriction(*plant.floor_friction, true, engine);
  if (plant.finger_friction) SetFriction(*plant.finger_friction, false, engine);
}

void ApplyPlantOptions(const PlantOptions& plant, mjModel* engine) {
  mjModel& m = *engine;
  ApplyFriction(plant, engine);
  m.opt.timestep = plant.time_step;
  m.opt.impratio = plant.impratio;
  m.opt.noslip_iterations = plant.noslip_iterations;
  const double time_constant =
      plant.contact_time_constant > 0.0 ? plant.contact_time_constant : 2.0 * plant.time_step;
  for (int pair = 0; pair < m.npair; ++pair) {
    SetStiffness(time_constant, plant.contact_impedance, m.pair_solref + mjNREF * pair,
                 m.pair_solimp + mjNIMP * pair);
  }
  // By default dry friction creeps until (1 - d) f tc / (2 M): by radians a second at joints of little
  // inertia.
  for (int dof = 0; dof < m.nv; ++dof) {
    if (m.dof_frictionloss[dof] > 0.0)
      SetStiffness(time_constant, plant.contact_impedance, m.dof_solref + mjNREF * dof,
                   m.dof_solimp + mjNIMP * dof);
  }
}

/// Lists the pairs, and lets them push when the scenario says so; some MJCFs do by themselves.
void WatchBodies(const Scenario& scenario, const std::string& mjcf, RobotPair* robots) {
  const PlantOptions& plant = scenario.plant;
  robots->watched_pairs = ListWatchedPairs(*robots->engine, *robots->adapter, robots->solids,
                                           plant.allowed_collision_pairs, scenario.source);
  if (!plant.collide) return;
  robots->engine = AddContactPairs(*robots->engine, ListGeoms(*robots), mjcf);
  robots->adapter = std::make_unique<Adapter>(robots->model, *robots->engine, mjcf);
}

}  // namespace

void SetFingerFriction(double mu, mjModel* engine) { SetFriction(mu, false, engine); }

void SetStiffness(double time_constant, double impedance, mjtNum* solref, mjtNum* solimp) {
  solref[0] = time_constant;
  solref[1] = 1.0;
  const mjtNum constant[mjNIMP] = {impedance, impedance, 0.001, 0.5, 2.0};  // the last three without effect
  std::copy_n(constant, mjNIMP, solimp);
}

bool LetsBodiesPush(const PlantOptions& plant, const mjModel& engine) {
  return plant.collide || CollidesByType(engine);
}

std::vector<std::pair<int, int>> ListGeoms(const RobotPair& robots) {
  std::vector<std::pair<int, int>> geoms;
  for (const WatchedPair& pair : robots.watched_pairs) {
    geoms.emplace_back(robots.solids.list[static_cast<size_t>(pair.a)].geom,
                       robots.solids.list[static_cast<size_t>(pair.b)].geom);
  }
  return geoms;
}

std::vector<std::pair<int, int>> ListPushingGeoms(const RobotPair& robots) {
  const mjModel& m = *robots.engine;
  std::vector<bool> is_shape(static_cast<size_t>(m.ngeom), false);
  for (const Solid& solid : robots.solids.list) is_shape[static_cast<size_t>(solid.geom)] = true;
  const auto list_geoms = [&](int solid) {
    const Solid& shape = robots.solids.list[static_cast<size_t>(solid)];
    std::vector<int> geoms = {shape.geom};
    for (int i = 0; i < m.body_geomnum[shape.body]; ++i) {
      const int geom = m.body_geomadr[shape.body] + i;
      if (!is_shape[static_cast<size_t>(geom)] && CanTouch(m, geom)) geoms.push_back(geom);
    }
    return geoms;
  };
  std::vector<std::pair<int, int>> pushing;
  for (const WatchedPair& pair : robots.watched_pairs)
    for (const int a : list_geoms(pair.a))
      for (const int b : list_geoms(pair.b)) pushing.emplace_back(a, b);
  return pushing;
}

RobotPair::RobotPair(const Scenario& scenario, RobotModel the_model, const std::filesystem::path& mjcf,
                     MjModelPtr the_engine)
    : model(std::move(the_model)),
      engine(std::move(the_engine)),
      rigid(ReadRigidModel(scenario, model.spec().source)) {
  RequireUsable(scenario, model);
  solids = ListSolids(*engine);
  adapter = std::make_unique<Adapter>(model, *engine, mjcf.string());
  RequireNothingElse(*adapter, mjcf.string());
  ApplyFriction(scenario.plant, engine.get());
  constants = CheckConstants(*adapter);
  if (scenario.tolerance > 0.0) JudgeByTolerance(scenario.tolerance, &constants);
  WatchBodies(scenario, mjcf.string(), this);
  ApplyPlantOptions(scenario.plant, engine.get());
}

DeclaredMismatch::DeclaredMismatch(RobotModel the_plant, MjModelPtr engine_without, const mjModel& engine,
                                   const RobotModel& model, const std::string& source)
    : plant(std::move(the_plant)),
      without(std::move(engine_without)),
      plant_adapter(plant, engine, source),
      controller_adapter(model, *without, source) {}

namespace {

/// The robot's links and the object, by name: base, joints' links, object.
class Bodies {
 public:
  Bodies(const Adapter& adapter, mjModel* engine, RobotSpec* plant)
      : adapter_(&adapter), engine_(engine), plant_(plant) {
    names_.push_back(plant->base.link);
    for (const Joint& joint : plant->joints) names_.push_back(joint.link);
    if (plant->object) names_.emplace_back("object");
    FindLinkFrames();
  }

  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

  /// A link: the object's centre of mass is where its frame stands.
  [[nodiscard]] size_t FindLink(const std::string& name, const std::string& key,
                                const std::string& source) const {
    const auto end = names_.end() - (plant_->object ? 1 : 0);
    const auto found = std::find(names_.begin(), end, name);
    if (found != end) return static_cast<size_t>(found - names_.begin());
    throw InputError(source + ": " + key + ": is no link of the robot" +
                     SuggestInBrackets(name, {names_.begin(), end}, "") + ", got " + Quote(name));
  }

  /// The base with its wheels.
  void ScaleMass(size_t body, double factor) {
    MassProperties& model = Model(body);
    model.mass *= factor;
    model.inertia *= factor;
    if (body == 0) {
      WheelProperties& wheel = plant_->base.wheel;
      for (double* value : {&wheel.mass, &wheel.spin_inertia, &wheel.transverse_inertia}) *value *= factor;
    }
    for (const int id : EngineBodies(body)) {
      engine_->body_mass[id] *= factor;
      for (int i = 0; i < 3; ++i) engine_->body_inertia[3 * id + i] *= factor;
    }
  }

  void MoveCom(size_t body, const Vector3d& shift) {
    Model(body).com += shift;
    const Vector3d moved = X_engine_link_[body].linear() * shift;
    for (const int id : EngineBodies(body)) {
      if (IsWheel(id)) continue;
      // Bodies that are welded to the link's own are turned against it at most.
      const RotationMap R_own(reference_->xmat + 9 * MainBody(body)), R(reference_->xmat + 9 * id);
      Eigen::Map<Vector3d>(engine_->body_ipos + 3 * id) += R.transpose() * R_own * moved;
      ForgetSameFrame(id);
    }
  }

  void AddPoint(size_t body, double mass, const Vector3d& at) {
    Model(body) = Combine({Model(body), MassProperties{.mass = mass, .com = at}});
    const int id = MainBody(body);
    const Pose X_own = ReadPose(engine_->body_ipos + 3 * id, engine_->body_iquat + 4 * id);
    const Matrix3d R = X_own.linear();
    const MassProperties own{engine_->body_mass[id], X_own.translation(),
                             R * MapVector(engine_->body_inertia + 3 * id).asDiagonal() * R.transpose()};
    const MassProperties both =
        Combine({own, MassProperties{.mass = mass, .com = X_engine_link_[body] * at}});
    engine_->body_mass[id] = both.mass;
    Eigen::Map<Vector3d>(engine_->body_ipos + 3 * id) = both.com;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(both.inertia);
    Matrix3d axes = principal.eigenvectors();
    if (axes.determinant() < 0.0) axes.col(0) *= -1.0;
    Eigen::Map<Vector3d>(engine_->body_inertia + 3 * id) = principal.eigenvalues();
    const Eigen::Quaterniond turned(axes);
    Eigen::Map<Eigen::Vector4d>(engine_->body_iquat + 4 * id) << turned.w(), turned.vec();
    ForgetSameFrame(id);
  }

 private:
  /// The body's inertial frame is no longer where it was: nothing may be taken to stand there.
  void ForgetSameFrame(int id) {
    engine_->body_simple[id] = 0;
    engine_->body_sameframe[id] = 0;
    const auto forget = [id](EngineSize count, const int* bodies, mjtByte* frames) {
      for (int i = 0; i < count; ++i) {
        if (bodies[i] == id && IsInertialFrame(frames[i])) frames[i] = 0;
      }
    };
    forget(engine_->ngeom, engine_->geom_bodyid, engine_->geom_sameframe);
    forget(engine_->nsite, engine_->site_bodyid, engine_->site_sameframe);
  }
  [[nodiscard]] bool IsObject(size_t body) const {
    return plant_->object.has_value() && body == names_.size() - 1;
  }
  MassProperties& Model(size_t body) {
    if (IsObject(body)) return plant_->object->body;
    return body == 0 ? plant_->base.body : plant_->joints[body - 1].body;
  }
  [[nodiscard]] int MainBody(size_t body) const {
    return IsObject(body) ? adapter_->object_body() : adapter_->link_bodies()[body];
  }
  [[nodiscard]] std::vector<int> EngineBodies(size_t body) const {
    if (IsObject(body)) return {adapter_->object_body()};
    return adapter_->welded_bodies()[body];
  }

  [[nodiscard]] bool IsWheel(int id) const {
    const auto& wheels = adapter_->wheels();
    return std::any_of(wheels.begin(), wheels.end(), [&](const EngineWheel& wheel) {
      return engine_->body_weldid[id] == engine_->body_weldid[engine_->jnt_bodyid[wheel.joint]];
    });
  }

  /// Pose of each link's frame in the engine's body of it.
  void FindLinkFrames() {
    const RobotModel& model = adapter_->model();
    const VectorXd q = VectorXd::Zero(model.num_positions());
    ModelTerms kinematics(model, Coordinates::kReduced);
    kinematics.SetState(q, VectorXd::Zero(model.num_velocities()));
    reference_ = MakeDataWithoutContacts(*engine_);
    adapter_->SetPositions(q, reference_->qpos);
    mj_kinematics(engine_, reference_.get());
    for (int i = -1; i < model.num_joints(); ++i) {
      const Pose X_Bb = BodyPose(*reference_, MainBody(static_cast<size_t>(i + 1)));
      X_engine_link_.push_back(X_Bb.inverse() * kinematics.CalcLinkPose(i));
    }
    X_engine_link_.push_back(Pose::Identity());
  }

  const Adapter* adapter_;
  mjModel* engine_;
  RobotSpec* plant_;
  std::vector<std::string> names_;
  MjDataPtr reference_;
  std::vector<Pose> X_engine_link_;
};

/// Gravity as a floor sees it that rises by these angles along x and y.
Vector3d TiltGravity(const Vector3d& gravity, const Vector2d& slope) {
  const Vector3d up = Vector3d(std::tan(slope.x()), std::tan(slope.y()), 1.0).normalized();
  return -gravity.norm() * up;
}

void ScaleJoints(const MismatchOptions& options, const std::string& source, const Adapter& adapter,
                 mjModel* engine, RobotSpec* plant) {
  std::vector<std::string> names;
  std::vector<int> dofs;
  std::vector<double*> damping, armature;
  if (adapter.wheels().size() == 2) {
    // Both wheels are one thing in the model.
    names.emplace_back("wheels");
    dofs.push_back(-1);
    damping.push_back(&plant->base.wheel.damping);
    armature.push_back(&plant->base.wheel.armature);
  }
  for (size_t i = 0; i < plant->joints.size(); ++i) {
    names.push_back(plant->joints[i].name);
    dofs.push_back(adapter.joint_dofs()[i]);
    damping.push_back(&plant->joints[i].damping);
    armature.push_back(&plant->joints[i].armature);
  }
  const auto scale = [&](const ByName& factors, const std::vector<double*>& values, mjtNum* in_engine) {
    const VectorXd by_name = factors.Resolve(names, source);
    for (size_t i = 0; i < names.size(); ++i) {
      const double factor = by_name[static_cast<Eigen::Index>(i)];
      if (factor == 1.0) continue;
      *values[i] *= factor;
      if (dofs[i] >= 0) {
        in_engine[dofs[i]] *= factor;
      } else {
        for (const EngineWheel& wheel : adapter.wheels()) in_engine[wheel.dof] *= factor;
      }
    }
  };
  scale(options.damping, damping, engine->dof_damping);
  scale(options.armature, armature, engine->dof_armature);
}

/// Changes the engine's robot, and says of the change what the checks have to know: `plant` becomes what the
/// engine's robot is now.
/// @param adapter of the controller's model and `engine`, which is changed.
void ApplyMismatch(const MismatchOptions& options, std::uint64_t seed, const std::string& source,
                   const Adapter& adapter, mjModel* engine, RobotSpec* plant) {
  Bodies bodies(adapter, engine, plant);
  const VectorXd mass = options.mass.Resolve(bodies.names(), source);
  const VectorXd within = options.mass_within.Resolve(bodies.names(), source);
  const RandomStream stream(seed, "mismatch.mass_within");
  for (Eigen::Index i = 0; i < mass.size(); ++i) {
    const double factor = mass[i] * (1.0 + within[i] * stream.Symmetric(0, static_cast<std::uint64_t>(i)));
    if (factor != 1.0) bodies.ScaleMass(static_cast<size_t>(i), factor);
  }
  for (const auto& [name, shift] : options.com) {
    bodies.MoveCom(bodies.FindLink(name, "mismatch.com", source), shift);
  }
  for (const Payload& payload : options.payloads) {
    bodies.AddPoint(bodies.FindLink(payload.body, payload.key + ".body", source), payload.mass, payload.at);
  }
  ScaleJoints(options, source, adapter, engine, plant);
  if (options.friction) SetFingerFriction(*options.friction, engine);
  if (!options.slope.isZero(0.0)) plant->gravity = TiltGravity(plant->gravity, options.slope);
  std::copy_n(plant->gravity.data(), 3, engine->opt.gravity);

  DeriveConstants(engine);
}

}  // namespace

void DeclareMismatch(const Scenario& scenario, const std::filesystem::path& mjcf, RobotPair* robots) {
  const MismatchOptions& options = scenario.imperfections.mismatch;
  if (options.is_none()) return;
  const auto copy = [&] { return MjModelPtr(mj_copyModel(nullptr, robots->engine.get())); };
  const auto change = [&](const RobotModel& model, mjModel* engine) {
    RobotSpec spec = model.spec();
    ApplyMismatch(options, scenario.seed, scenario.source, *robots->adapter, engine, &spec);
    return RobotModel(std::move(spec));
  };
  MjModelPtr without = copy();
  if (robots->rigid) *robots->rigid = change(*robots->rigid, copy().get());
  RobotModel plant = change(robots->model, robots->engine.get());
  robots->declared = std::make_unique<DeclaredMismatch>(std::move(plant), std::move(without), *robots->engine,
                                                        robots->model, mjcf.string());
}

}  // namespace dexcheck
