#include "harness/scenario/start_state.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/contact/contact_geometry.h"
#include "controller/contact/shapes.h"
#include "controller/grasp/finger_placement.h"
#include "controller/object/so3.h"
#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mujoco_release.h"
#include "harness/plant/random_stream.h"

namespace dexcheck {
namespace {

/// Deep enough that the engine sees a contact, less than any grasp force makes it, m.
constexpr double kStartPenetration = 1e-6;

// How far a seed moves the grasp, either way.
constexpr double kVariedJoint = DegToRad(2.0);    // rad
constexpr double kVariedContact = DegToRad(3.0);  // rad on the object,
constexpr double kFarthestContact = 2.5e-3;       // but not farther than this along it, m
constexpr double kVariedPlace = 2e-3;             // m
constexpr double kVariedLay = 0.05;               // m, of an object that lies on a support, either way
constexpr int kMostDraws = 100;                   // until the fingers reach

[[noreturn]] void Fail(const Scenario& scenario, const std::string& key, const std::string& problem) {
  throw InputError(scenario.source + ": " + key + ": " + problem);
}

/// The model at rest in that posture.
ModelTerms MakeKinematics(const RobotModel& model, const VectorXd& q) {
  ModelTerms kinematics(model, Coordinates::kReduced);
  kinematics.SetState(q, VectorXd::Zero(model.num_velocities()));
  return kinematics;
}

VectorXd ReadPosture(const Scenario& scenario, const RobotModel& model) {
  VectorXd q = VectorXd::Zero(model.num_positions());
  for (const auto& [name, angle] : scenario.grasp.joints) {
    q[model.num_base_positions() + RequireJoint(scenario, "grasp.joints_deg", model, name)] = angle;
  }
  return q;
}

void VaryGrasp(const Surface& surface, std::mt19937_64* random, GraspOptions* grasp) {
  const auto draw = [&](double size) { return size * DrawSymmetric(random); };
  for (auto& [name, angle] : grasp->joints) angle += draw(kVariedJoint);
  for (SurfacePoint& contact : grasp->contacts) {
    const Matrix2d M = surface.Evaluate(contact).M;
    SurfacePoint varied = contact;
    varied.u += draw(std::min(kVariedContact, kFarthestContact / M.col(0).norm()));
    varied.v += draw(std::min(kVariedContact, kFarthestContact / M.col(1).norm()));
    if (surface.Contains(varied, 0.0)) contact = varied;
  }
  for (double& x : grasp->X_FO.translation()) x += draw(kVariedPlace);
}

/// Says which contact lies past its fingertip's rim; empty for none.
std::string FindContactPastRim(const GraspOptions& grasp, const RobotModel& model, const Surface& surface,
                               const Hold& hold, const StartState& start) {
  if (!grasp.hemisphere) return "";
  const ModelTerms kinematics = MakeKinematics(model, start.q);
  for (size_t i = 0; i < hold.fingertips.size(); ++i) {
    // The object's outward normal points into the fingertip.
    const Vector3d n = start.X_Bo.linear() * surface.Evaluate(grasp.contacts[i]).R.col(2);
    const Matrix3d R_Bf = kinematics.CalcFramePose(hold.fingertips[i]).linear();
    const Frame& tip = model.frame(hold.fingertips[i]);
    const double distance = CalcRimDistance(*tip.sphere_radius, *grasp.hemisphere, -(R_Bf.transpose() * n));
    if (distance >= 0.0) continue;
    return "the contact of " + Quote(tip.name) + " lies " + FormatNumber(-1e3 * distance, 3) +
           " mm past the rim of its hemisphere";
  }
  return "";
}

/// The fingertips at their contacts. @param start gets the object's place.
FingerPlacement PlaceFingers(const Scenario& scenario, const RobotModel& model, const Surface& surface,
                             const Hold& hold, StartState* start) {
  const GraspOptions& grasp = scenario.grasp;
  const VectorXd q = ReadPosture(scenario, model);
  const int frame = RequireFrame(scenario, "grasp.frame", model, grasp.frame);
  PlaceObject(MakeKinematics(model, q).CalcFramePose(frame) * grasp.X_FO, start);
  if (scenario.control.orientation == OrientationFeedback::kAngles &&
      std::abs(std::sin(start->X_o[4])) < kMinSinBeta) {
    Fail(scenario, "control.orientation",
         "\"angles\" are singular where the object starts, at beta = " + FormatNumber(start->X_o[4]) +
             " rad; take \"rotation\"");
  }
  const bool soft = scenario.plant.type == PlantType::kEngine && !scenario.plant.bonded;
  return SolveFingerPlacement(model, hold.fingertips, surface, start->X_Bo, grasp.contacts, q,
                              {.penetration = soft ? kStartPenetration : 0.0});
}

}  // namespace

int RequireJoint(const Scenario& scenario, const std::string& key, const RobotModel& model,
                 const std::string& name) {
  if (const int joint = model.FindJoint(name); joint >= 0) return joint;
  std::vector<std::string> names;
  for (const Joint& one : model.joints()) names.push_back(one.name);
  Fail(scenario, key, Quote(name) + " is no joint of the model" + SuggestInBrackets(name, names, ""));
}

int RequireFrame(const Scenario& scenario, const std::string& key, const RobotModel& model,
                 const std::string& name) {
  try {
    return model.FindFrame(name);
  } catch (const std::invalid_argument&) {
    Fail(scenario, key, Quote(name) + " is no frame of the model");
  }
}

double DrawSymmetric(std::mt19937_64* random) { return 2.0 * DrawUnit(random) - 1.0; }

void PlaceObject(const Pose& X_Bo, StartState* start) {
  start->X_Bo = X_Bo;
  start->X_o << X_Bo.translation(), CalcAnyZyzAngles(X_Bo.linear());
}

ContactCoordinates FindTipContact(const RobotModel& model, int frame, const Surface& surface,
                                  const Pose& X_of) {
  return FindContact(Sphere(model.tip_radius(frame)), surface, X_of).kappa;
}

Hold FindHold(const Scenario& scenario, const RobotModel& model) {
  Hold hold;
  std::vector<int>& fingertips = hold.fingertips;
  for (const std::string& name : scenario.grasp.fingertips) {
    int frame = -1;
    for (const int tip : model.fingertips()) {
      if (model.frame(tip).name == name) frame = tip;
    }
    if (frame < 0) Fail(scenario, "grasp.fingertips", Quote(name) + " is no fingertip of the model");
    if (std::find(fingertips.begin(), fingertips.end(), frame) != fingertips.end()) {
      Fail(scenario, "grasp.fingertips", Quote(name) + " is named twice");
    }
    fingertips.push_back(frame);
  }
  std::vector<int> users(static_cast<size_t>(model.num_joints()), 0);
  for (const int tip : fingertips) {
    for (const int joint : model.ListChain(model.frame(tip).link)) ++users[static_cast<size_t>(joint)];
  }
  for (int i = 0; i < model.num_joints(); ++i) {
    if (users[static_cast<size_t>(i)] == 0 && scenario.joint_task() == nullptr) hold.idle_joints.push_back(i);
    if (users[static_cast<size_t>(i)] > 1) hold.arm_joints.push_back(i);
  }
  return hold;
}

StartState SolveGrasp(const RobotModel& model, const Surface& surface, const Hold& hold, Scenario* scenario) {
  StartState start;
  std::mt19937_64 random(scenario->seed);
  for (SurfacePoint& contact : scenario->grasp.contacts) {
    contact = PointAtAngles(surface, contact.u, contact.v);
  }
  const GraspOptions as_written = scenario->grasp;
  double residual = 0.0;
  std::string past_rim;
  for (int i = 0; i < (scenario->seed == 0 ? 1 : kMostDraws); ++i) {
    scenario->grasp = as_written;
    if (scenario->seed != 0) VaryGrasp(surface, &random, &scenario->grasp);
    const FingerPlacement placement = PlaceFingers(*scenario, model, surface, hold, &start);
    start.q = placement.q;
    residual = placement.residual;
    if (!placement.reached) continue;
    past_rim = FindContactPastRim(scenario->grasp, model, surface, hold, start);
    if (past_rim.empty()) return start;
  }
  if (!past_rim.empty()) Fail(*scenario, "grasp.contacts_deg", past_rim);
  Fail(*scenario, "grasp.contacts_deg",
       "the fingertips do not reach their contacts within the joint ranges; the farthest stays " +
           FormatNumber(residual) + " m away");
}

StartState PlacePickTask(const RobotModel& model, const Surface& surface, Hold* hold, Scenario* scenario) {
  auto& task = std::get<PickTask>(scenario->task);
  Hand& hand = hold->hand;
  StartState start;
  if (scenario->seed != 0) {
    std::mt19937_64 random(scenario->seed);
    Pose& X_Bo = task.X_Bo;
    X_Bo.translation().x() += kVariedLay * DrawSymmetric(&random);
    X_Bo.translation().y() += kVariedLay * DrawSymmetric(&random);
    X_Bo.linear() = Eigen::AngleAxisd(kPi * DrawSymmetric(&random), Vector3d::UnitZ()) * X_Bo.linear();
  }
  hand.fingertips = hold->fingertips;
  hand.palm_frame = RequireFrame(*scenario, "grasp.frame", model, scenario->grasp.frame);
  std::vector<SurfacePoint>& contacts = task.pick_and_place.plan.contacts;
  contacts.clear();
  for (const SurfacePoint& contact : scenario->grasp.contacts) {
    contacts.push_back(PointAtAngles(surface, contact.u, contact.v));
  }
  for (const std::string& name : task.arm_joints)
    hand.arm_joints.push_back(RequireJoint(*scenario, "task.arm_joints", model, name));
  if (hand.arm_joints.empty()) hand.arm_joints = ListArmJoints(model, hold->fingertips, hand.palm_frame);
  start.q = ReadPosture(*scenario, model);
  PlaceObject(task.X_Bo, &start);
  return start;
}

void MakeBonds(const Scenario& scenario, const Hold& hold, const Surface& surface, RobotPair* robots,
               StartState* start) {
  const RobotModel& model = robots->model;
  const Adapter& adapter = *robots->adapter;
  mjModel& m = *robots->engine;
  const int object = adapter.object_body();
  const MjDataPtr data = MakeDataWithoutContacts(m);
  adapter.SetPositions(start->q, data->qpos);
  mj_kinematics(&m, data.get());
  const ModelTerms kinematics = MakeKinematics(model, start->q);
  for (const int tip : hold.fingertips) {
    const Pose X_Bf = kinematics.CalcFramePose(tip);
    start->kappa.push_back(FindTipContact(model, tip, surface, start->X_Bo.inverse() * X_Bf));
    const ContactGeometry contact =
        CalcContactGeometry(Sphere(model.tip_radius(tip)), surface, start->kappa.back());
    start->bonds.push_back({contact.g_f_cf.translation(), contact.g_o_cf});

    const int body = m.site_bodyid[adapter.frame_sites()[static_cast<size_t>(tip)]];
    int found = -1;
    for (int eq = 0; eq < m.neq; ++eq) {
      if (m.eq_type[eq] == mjEQ_CONNECT && m.eq_obj1id[eq] == body && m.eq_obj2id[eq] == object) found = eq;
    }
    if (found < 0) {
      throw InputError("MJCF: plant.bonded: needs an equality connect from body " +
                       Quote(NameOf(m, mjOBJ_BODY, body)) + " to body " +
                       Quote(NameOf(m, mjOBJ_BODY, object)));
    }
    start->bond_constraints.push_back(found);
    GetEqualityActive(m)[found] = 1;
    SetStiffness(m.pair_solref[0], scenario.plant.contact_impedance, m.eq_solref + mjNREF * found,
                 m.eq_solimp + mjNIMP * found);
    // One point in both bodies.
    const Vector3d on_object = contact.g_o_cf.translation();
    const Vector3d p_B = start->X_Bo * on_object;
    const Pose X_f = BodyPose(*data, body);
    const Vector3d on_finger = X_f.linear().transpose() * (p_B - X_f.translation());
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

}  // namespace dexcheck
