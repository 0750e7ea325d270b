#include "harness/scenario/setup.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/contact/find_contact.h"
#include "controller/contact/fingertip_rim.h"
#include "controller/contact/object_surface.h"
#include "controller/contact/shapes.h"
#include "controller/model/parameter_reader.h"
#include "controller/object/euler_zyz.h"
#include "harness/engine/add_contact_pairs.h"
#include "harness/engine/data_without_contacts.h"
#include "harness/engine/mujoco_release.h"
#include "harness/engine/remove_looks.h"
#include "harness/scenario/mismatch.h"

namespace dexcheck {
namespace {

/// Nothing moves in a run but the robot, its base and its object.
void RequireNothingElse(const Adapter& adapter, const std::string& mjcf) {
  if (adapter.other_joints().empty()) return;
  throw InputError(mjcf + ": must have nothing that moves but the robot and its object, has joint " +
                   Quote(NameOf(adapter.engine(), mjOBJ_JOINT, adapter.other_joints().front())));
}

/// Deep enough that the engine sees a contact, less than any grasp force makes it, m.
constexpr double kStartPenetration = 1e-6;

// How far a seed moves the grasp, either way.
constexpr double kVariedJoint = DegToRad(2.0);    // rad
constexpr double kVariedContact = DegToRad(3.0);  // rad on the object,
constexpr double kFarthestContact = 2.5e-3;       // but not farther than this along it, m
constexpr double kVariedPlace = 2e-3;             // m
constexpr double kVariedLay = 0.05;               // m, of an object that lies on a support, either way
constexpr int kMostDraws = 100;                   // until the fingers reach

RobotModel ReadModel(const Scenario& scenario, const std::filesystem::path& robot) {
  return ParseRobotModel(ReadTextFile(robot.string()), robot.string(), scenario.model_overrides);
}

/// Critically damped, of constant impedance, whatever the MJCF says.
void SetStiffness(double time_constant, double impedance, mjtNum* solref, mjtNum* solimp) {
  solref[0] = time_constant;
  solref[1] = 1.0;
  const mjtNum constant[mjNIMP] = {impedance, impedance, 0.001, 0.5, 2.0};  // the last three without effect
  std::copy_n(constant, mjNIMP, solimp);
}

/// The robot that a rigid plant moves: the scenario's, whatever the controller is made to believe.
std::unique_ptr<RobotModel> ReadPlantModel(const Scenario& scenario, const std::filesystem::path& robot) {
  if (scenario.plant.type != PlantType::kRigid) return nullptr;
  const std::vector<std::string>& all = scenario.model_overrides;
  const std::vector<std::string> own(all.begin(),
                                     all.begin() + static_cast<std::ptrdiff_t>(scenario.own_model_overrides));
  return std::make_unique<RobotModel>(ParseRobotModel(ReadTextFile(robot.string()), robot.string(), own));
}

/// From -1 to 1.
double Draw(std::mt19937_64* random) { return 2.0 * static_cast<double>((*random)() >> 11) * 0x1p-53 - 1.0; }

[[noreturn]] void Fail(const Scenario& scenario, const std::string& key, const std::string& problem) {
  throw InputError(scenario.source + ": " + key + ": " + problem);
}

}  // namespace

Setup::Setup(const Scenario& scenario, const std::filesystem::path& robot, const std::filesystem::path& mjcf)
    : Setup(scenario, robot, mjcf, LoadMjcf(mjcf)) {}

Setup::Setup(const Scenario& scenario, const std::filesystem::path& robot, const std::filesystem::path& mjcf,
             MjModelPtr engine)
    : Setup(scenario, ReadModel(scenario, robot), mjcf, std::move(engine)) {}

Setup::Setup(const Scenario& scenario, RobotModel model, const std::filesystem::path& mjcf, MjModelPtr engine)
    : scenario_(scenario),
      model_(std::move(model)),
      plant_model_(ReadPlantModel(scenario, model_.spec().source)),
      engine_(std::move(engine)) {
  const std::string& robot = model_.spec().source;
  if (model_.base().type == BaseType::kFloating) {
    throw InputError(robot + ": base.type: must not be \"floating\" in a run, whose law drives the base");
  }
  RequireNoBalls(model_, "in a run, whose law has one number for each joint");
  if (!model_.object() && !scenario_.joint_motion) {
    throw InputError(robot + ": object: is missing, and the scenario holds one");
  }
  solids_ = ListSolids(*engine_);
  std::vector<int> pushing;
  if (scenario_.plant.collide) {
    for (const Solid& solid : solids_.list) pushing.push_back(solid.geom);
  }
  RemoveLooks(engine_.get(), pushing);
  adapter_ = std::make_unique<Adapter>(model_, *engine_, mjcf.string());
  RequireNothingElse(*adapter_, mjcf.string());
  constants_ = CheckConstants(*adapter_);
  if (scenario_.tolerance > 0.0) JudgeByTolerance(scenario_.tolerance, &constants_);
  WatchSolids(mjcf.string());
  ApplyPlantOptions();
  try {
    // What holds nothing needs no surface.
    surface_ = scenario_.joint_motion ? std::make_unique<Sphere>(1.0) : MakeSurface(model_.object()->shape);
  } catch (const std::invalid_argument& error) {
    throw InputError(robot + ": " + error.what());
  }
  FindFingertips();
  if (scenario_.joint_motion) {
    PlaceJoints();
  } else {
    FindGrasp();
  }
  if (scenario_.plant.bonded) MakeBonds();
  if (!scenario_.imperfections.mismatch.is_none()) MakeMismatch(mjcf.string());
}

void Setup::WatchSolids(const std::string& mjcf) {
  watched_pairs_ = ListWatchedPairs(*engine_, *adapter_, solids_, scenario_.plant.allowed_collision_pairs,
                                    scenario_.source);
  if (!scenario_.plant.collide) return;
  solids_ = ListSolids(*engine_);  // the same, with the numbers that their geoms have now
  std::vector<std::pair<int, int>> geoms;
  for (const WatchedPair& pair : watched_pairs_) {
    geoms.emplace_back(solids_.list[static_cast<size_t>(pair.a)].geom,
                       solids_.list[static_cast<size_t>(pair.b)].geom);
  }
  engine_ = AddContactPairs(*engine_, geoms);
  adapter_ = std::make_unique<Adapter>(model_, *engine_, mjcf);
}

void Setup::MakeMismatch(const std::string& mjcf) {
  controller_engine_ = MjModelPtr(mj_copyModel(nullptr, engine_.get()));
  const auto change = [&](const RobotModel& model, mjModel* engine) {
    RobotSpec spec = model.spec();
    ApplyMismatch(scenario_.imperfections.mismatch, scenario_.seed, scenario_.source, *adapter_, engine,
                  &spec);
    return RobotModel(std::move(spec));
  };
  if (plant_model_) {
    const MjModelPtr scratch(mj_copyModel(nullptr, engine_.get()));
    plant_model_ = std::make_unique<RobotModel>(change(*plant_model_, scratch.get()));
  }
  known_model_.emplace(change(model_, engine_.get()));
  plant_side_ = std::make_unique<Adapter>(*known_model_, *engine_, mjcf);
  controller_side_ = std::make_unique<Adapter>(model_, *controller_engine_, mjcf);
}

PartContext Setup::MakePartContext() const {
  return {&model_, fingertips_.size(), scenario_.plant.time_step, scenario_.seed, scenario_.source};
}

void Setup::ApplyPlantOptions() {
  const PlantOptions& plant = scenario_.plant;
  mjModel& m = *engine_;
  m.opt.timestep = plant.time_step;
  m.opt.impratio = plant.impratio;
  m.opt.noslip_iterations = plant.noslip_iterations;
  const double time_constant =
      plant.contact_time_constant > 0.0 ? plant.contact_time_constant : 2.0 * plant.time_step;
  for (int pair = 0; pair < m.npair; ++pair) {
    SetStiffness(time_constant, plant.contact_impedance, m.pair_solref + mjNREF * pair,
                 m.pair_solimp + mjNIMP * pair);
    const bool has_floor =
        m.geom_type[m.pair_geom1[pair]] == mjGEOM_PLANE || m.geom_type[m.pair_geom2[pair]] == mjGEOM_PLANE;
    const std::optional<double>& mu = has_floor ? plant.floor_friction : plant.finger_friction;
    if (mu) m.pair_friction[5 * pair] = m.pair_friction[5 * pair + 1] = *mu;
  }
}

void Setup::FindFingertips() {
  for (const std::string& name : scenario_.grasp.fingertips) {
    int frame = -1;
    for (const int tip : model_.fingertips()) {
      if (model_.frames()[static_cast<size_t>(tip)].name == name) frame = tip;
    }
    if (frame < 0) Fail(scenario_, "grasp.fingertips", Quote(name) + " is no fingertip of the model");
    if (std::find(fingertips_.begin(), fingertips_.end(), frame) != fingertips_.end()) {
      Fail(scenario_, "grasp.fingertips", Quote(name) + " is named twice");
    }
    fingertips_.push_back(frame);
  }
  std::vector<int> users(static_cast<size_t>(model_.num_joints()), 0);
  for (const int tip : fingertips_) {
    int joint = model_.frames()[static_cast<size_t>(tip)].link;
    for (; joint >= 0; joint = model_.joints()[static_cast<size_t>(joint)].parent) {
      ++users[static_cast<size_t>(joint)];
    }
  }
  for (int i = 0; i < model_.num_joints(); ++i) {
    if (users[static_cast<size_t>(i)] == 0 && !scenario_.joint_motion) idle_joints_.push_back(i);
    if (users[static_cast<size_t>(i)] > 1) arm_joints_.push_back(i);
  }
}

void Setup::FindGrasp() {
  std::mt19937_64 random(scenario_.seed);
  if (scenario_.task) return PlaceTask(&random);
  for (SurfacePoint& contact : scenario_.grasp.contacts) {
    contact = PointAtAngles(*surface_, contact.u, contact.v);
  }
  const GraspOptions given = scenario_.grasp;
  double residual = 0.0;
  std::string past_rim;
  for (int i = 0; i < (scenario_.seed == 0 ? 1 : kMostDraws); ++i) {
    scenario_.grasp = given;
    if (scenario_.seed != 0) VaryGrasp(&random);
    const FingerPlacement placement = SolveGrasp();
    q_start_ = placement.q;
    residual = placement.residual;
    if (!placement.reached) continue;
    past_rim = FindContactPastRim();
    if (past_rim.empty()) return;
  }
  if (!past_rim.empty()) Fail(scenario_, "grasp.contacts_deg", past_rim);
  Fail(scenario_, "grasp.contacts_deg",
       "the fingertips do not reach their contacts within the joint ranges; the farthest stays " +
           FormatNumber(residual) + " m away");
}

std::string Setup::FindContactPastRim() const {
  const GraspOptions& grasp = scenario_.grasp;
  if (!grasp.hemisphere) return "";
  ModelTerms kinematics(model_, Coordinates::kReduced);
  kinematics.SetState(q_start_, VectorXd::Zero(model_.num_velocities()));
  for (size_t i = 0; i < fingertips_.size(); ++i) {
    // The object's outward normal points into the fingertip.
    const Vector3d n = X_Bo_start_.linear() * surface_->Evaluate(grasp.contacts[i]).R.col(2);
    const Matrix3d R_Bf = kinematics.CalcFramePose(fingertips_[i]).linear();
    const Frame& tip = model_.frames()[static_cast<size_t>(fingertips_[i])];
    const double distance = CalcRimDistance(*tip.sphere_radius, *grasp.hemisphere, -(R_Bf.transpose() * n));
    if (distance >= 0.0) continue;
    return "the contact of " + Quote(tip.name) + " lies " + FormatNumber(-1e3 * distance, 3) +
           " mm past the rim of its hemisphere";
  }
  return "";
}

void Setup::VaryGrasp(std::mt19937_64* random) {
  const auto draw = [&](double size) { return size * Draw(random); };
  GraspOptions& grasp = scenario_.grasp;
  for (auto& [name, angle] : grasp.joints) angle += draw(kVariedJoint);
  for (SurfacePoint& contact : grasp.contacts) {
    const Matrix2d M = surface_->Evaluate(contact).M;
    SurfacePoint varied = contact;
    varied.u += draw(std::min(kVariedContact, kFarthestContact / M.col(0).norm()));
    varied.v += draw(std::min(kVariedContact, kFarthestContact / M.col(1).norm()));
    if (surface_->Contains(varied, 0.0)) contact = varied;
  }
  for (double& x : grasp.X_FO.translation()) x += draw(kVariedPlace);
}

VectorXd Setup::ReadPosture() const {
  VectorXd q = VectorXd::Zero(model_.num_positions());
  for (const auto& [name, angle] : scenario_.grasp.joints) {
    const int joint = model_.FindJoint(name);
    if (joint < 0) Fail(scenario_, "grasp.joints_deg", Quote(name) + " is no joint of the model");
    q[model_.num_base_positions() + joint] = angle;
  }
  return q;
}

int Setup::FindGraspFrame() const {
  try {
    return model_.FindFrame(scenario_.grasp.frame);
  } catch (const std::invalid_argument&) {
    Fail(scenario_, "grasp.frame", Quote(scenario_.grasp.frame) + " is no frame of the model");
  }
}

void Setup::PlaceTask(std::mt19937_64* random) {
  if (scenario_.seed != 0) {
    Pose& X_Bo = scenario_.task->X_Bo;
    X_Bo.translation().x() += kVariedLay * Draw(random);
    X_Bo.translation().y() += kVariedLay * Draw(random);
    X_Bo.linear() = Eigen::AngleAxisd(kPi * Draw(random), Vector3d::UnitZ()) * X_Bo.linear();
  }
  hand_.fingertips = fingertips_;
  hand_.palm_frame = FindGraspFrame();
  hand_.hold_at = scenario_.grasp.hold_at;
  const double tip_radius = *model_.frames()[static_cast<size_t>(fingertips_.front())].sphere_radius;
  scenario_.task->pick_and_place.plan.half_length = CalcContactHalfLength(model_.object()->shape, tip_radius);
  for (const std::string& name : scenario_.task->arm_joints) {
    const int joint = model_.FindJoint(name);
    if (joint < 0) Fail(scenario_, "task.arm_joints", Quote(name) + " is no joint of the model");
    hand_.arm_joints.push_back(joint);
  }
  if (hand_.arm_joints.empty()) hand_.arm_joints = ListArmJoints(model_, fingertips_, hand_.palm_frame);
  q_start_ = ReadPosture();
  X_Bo_start_ = scenario_.task->X_Bo;
  X_start_ << X_Bo_start_.translation(), CalcAnyZyzAngles(X_Bo_start_.linear());
}

FingerPlacement Setup::SolveGrasp() {
  const GraspOptions& grasp = scenario_.grasp;
  const VectorXd q = ReadPosture();
  ModelTerms kinematics(model_, Coordinates::kReduced);
  kinematics.SetState(q, VectorXd::Zero(model_.num_velocities()));
  X_Bo_start_ = kinematics.CalcFramePose(FindGraspFrame()) * grasp.X_FO;
  X_start_ << X_Bo_start_.translation(), CalcAnyZyzAngles(X_Bo_start_.linear());
  if (scenario_.control.orientation == OrientationFeedback::kAngles &&
      std::abs(std::sin(X_start_[4])) < kMinSinBeta) {
    Fail(scenario_, "control.orientation",
         "\"angles\" are singular where the object starts, at beta = " + FormatNumber(X_start_[4]) +
             " rad; take \"rotation\"");
  }
  const bool soft = scenario_.plant.type == PlantType::kEngine && !scenario_.plant.bonded;
  return SolveFingerPlacement(model_, fingertips_, *surface_, X_Bo_start_, grasp.contacts, q,
                              {.penetration = soft ? kStartPenetration : 0.0});
}

void Setup::MakeBonds() {
  mjModel& m = *engine_;
  const int object = adapter_->object_body();
  const MjDataPtr data = MakeDataWithoutContacts(m);
  adapter_->SetPositions(q_start_, data->qpos);
  mj_kinematics(&m, data.get());
  ModelTerms kinematics(model_, Coordinates::kReduced);
  kinematics.SetState(q_start_, VectorXd::Zero(model_.num_velocities()));
  for (const int tip : fingertips_) {
    const Pose X_Bf = kinematics.CalcFramePose(tip);
    const Sphere sphere(*model_.frames()[static_cast<size_t>(tip)].sphere_radius);
    kappa_start_.push_back(FindContact(sphere, *surface_, X_Bo_start_.inverse() * X_Bf).kappa);
    const ContactGeometry contact = CalcContactGeometry(sphere, *surface_, kappa_start_.back());
    bonds_.push_back({contact.g_f_cf.translation(), contact.g_o_cf});

    const int body = m.site_bodyid[adapter_->frame_sites()[static_cast<size_t>(tip)]];
    int found = -1;
    for (int eq = 0; eq < m.neq; ++eq) {
      if (m.eq_type[eq] == mjEQ_CONNECT && m.eq_obj1id[eq] == body && m.eq_obj2id[eq] == object) found = eq;
    }
    if (found < 0) {
      throw InputError("MJCF: plant.bonded: needs an equality connect from body " +
                       Quote(NameOf(m, mjOBJ_BODY, body)) + " to body " +
                       Quote(NameOf(m, mjOBJ_BODY, object)));
    }
    bond_constraints_.push_back(found);
    GetEqualityActive(m)[found] = 1;
    SetStiffness(m.pair_solref[0], scenario_.plant.contact_impedance, m.eq_solref + mjNREF * found,
                 m.eq_solimp + mjNIMP * found);
    // The same point in both bodies.
    const Vector3d on_object = contact.g_o_cf.translation();
    const Vector3d p_B = X_Bo_start_ * on_object;
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(data->xmat + 9 * body);
    const Vector3d on_finger = R.transpose() * (p_B - Eigen::Map<const Vector3d>(data->xpos + 3 * body));
    std::copy_n(on_finger.data(), 3, m.eq_data + mjNEQDATA * found);
    std::copy_n(on_object.data(), 3, m.eq_data + mjNEQDATA * found + 3);
  }
  // A pair whose margin is below any distance never touches.
  for (int pair = 0; pair < m.npair; ++pair) {
    const bool has_object =
        m.geom_bodyid[m.pair_geom1[pair]] == object || m.geom_bodyid[m.pair_geom2[pair]] == object;
    if (has_object) m.pair_margin[pair] = -1.0;
  }
}

GraspControllerOptions Setup::MakeControllerOptions() const {
  const ControlOptions& control = scenario_.control;
  GraspControllerOptions options(model_);
  options.law = control.law;
  options.gains = control.gains;
  options.orientation = control.orientation;
  options.weight.kind = control.weight;
  if (control.weight == RedundancyWeight::Kind::kDiagonal) {
    const int base = model_.num_base_velocities();
    options.weight.w.setOnes(model_.num_velocities());
    options.weight.w.head(base).setConstant(control.platform_weight);
    for (const int joint : arm_joints_) options.weight.w[base + joint] = control.arm_weight;
  }
  options.posture.q_posture = q_start_.tail(model_.num_joints());
  options.posture.stiffness.setConstant(control.posture_frequency * control.posture_frequency);
  // The platform has no posture; damped, it would hold the object back.
  options.posture.damping.tail(model_.num_joints()).setConstant(2.0 * control.posture_frequency);
  options.X_o_start = X_start_;
  options.bonds = bonds_;
  options.mu = control.mu;
  options.f_min = control.f_min;
  options.f_max = control.f_max;
  if (HasStiffness(control.law) && !scenario_.joint_motion) options.stiffness = FindStiffness(options);
  return options;
}

ObjectStiffness Setup::FindStiffness(const GraspControllerOptions& options) const {
  GraspModel model(model_, fingertips_, object().body, *surface_, options);
  MeasuredState state{q_start_,     VectorXd::Zero(model_.num_velocities()),
                      X_Bo_start_,  Vector6d::Zero(),
                      kappa_start_, std::vector<double>(fingertips_.size(), 0.0)};
  if (kappa_start_.empty()) {
    ModelTerms kinematics(model_, Coordinates::kReduced);
    kinematics.SetState(state.q, state.xi);
    for (const int tip : fingertips_) {
      const Sphere sphere(*model_.frames()[static_cast<size_t>(tip)].sphere_radius);
      const Pose X_of = X_Bo_start_.inverse() * kinematics.CalcFramePose(tip);
      state.kappa.push_back(FindContact(sphere, *surface_, X_of).kappa);
    }
  }
  model.SetState(state);
  ObjectSpaceInertia inertia(model_, static_cast<int>(fingertips_.size()));
  inertia.Compute(model.robot(), model.grasp());
  const ControlOptions& control = scenario_.control;
  ObjectStiffness stiffness = CalcStiffness(control.gains, inertia.Lambda(), X_Bo_start_.linear());
  if (control.stiffness) stiffness.K = *control.stiffness;
  if (control.damping) stiffness.D = *control.damping;
  return stiffness;
}

}  // namespace dexcheck
