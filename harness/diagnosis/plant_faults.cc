#include "harness/diagnosis/plant_faults.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <random>
#include <utility>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

// On an arm of seven joints, how many carry on from here to what it holds.
constexpr size_t kTorso = 7;  // of a waist, where there is one
constexpr size_t kShoulder = 6;
constexpr size_t kUpperArm = 5;
constexpr size_t kElbow = 3;
constexpr size_t kWrist = 2;
constexpr size_t kHand = 1;
constexpr size_t kPalm = 0;

/// Where a robot can be hurt: the joints that carry what it holds, or of a robot that holds nothing all of
/// them, those of each finger, and those that do neither. Fewer joints than asked for stand for several.
class Roles {
 public:
  explicit Roles(const Setup& setup) : setup_(setup) {
    const std::vector<Joint>& joints = setup.model().joints();
    std::vector<bool> carries(joints.size(), setup.fingertips().empty());
    for (const int joint : setup.hold().arm_joints) carries[static_cast<size_t>(joint)] = true;
    for (const int tip : setup.fingertips()) {
      std::vector<int> own;
      int joint = setup.model().frames()[static_cast<size_t>(tip)].link;
      for (; joint >= 0; joint = joints[static_cast<size_t>(joint)].parent) {
        if (!carries[static_cast<size_t>(joint)]) own.insert(own.begin(), joint);
      }
      if (!own.empty()) fingers_.push_back(own);
    }
    for (size_t i = 0; i < joints.size(); ++i) {
      if (carries[i]) arm_.push_back(static_cast<int>(i));
    }
    if (arm_.empty()) arm_ = fingers_.front();  // a hand alone
  }

  [[nodiscard]] const Setup& setup() const { return setup_; }
  [[nodiscard]] bool has_wheels() const { return !setup_.adapter().wheels().empty(); }
  [[nodiscard]] bool holds() const { return !setup_.fingertips().empty(); }
  [[nodiscard]] size_t fingers() const { return fingers_.size(); }
  [[nodiscard]] std::string object() const { return setup_.object().name; }

  [[nodiscard]] const Joint& Arm(size_t from_palm) const {
    return JointOf(arm_[arm_.size() - 1 - std::min(from_palm, arm_.size() - 1)]);
  }
  /// @param finger, joint counted from 1.
  [[nodiscard]] const Joint& Finger(size_t finger, size_t joint) const {
    const std::vector<int>& own = fingers_[std::min(finger, fingers_.size()) - 1];
    return JointOf(own[std::min(joint, own.size()) - 1]);
  }
  /// One that should stay still; null where there is none.
  [[nodiscard]] const Joint* Idle() const {
    const std::vector<int>& idle = setup_.hold().idle_joints;
    return idle.empty() ? nullptr : &JointOf(idle[std::min<size_t>(kElbow, idle.size() - 1)]);
  }
  /// Where it begins, rad or m.
  [[nodiscard]] double StartOf(const std::string& joint) const {
    return setup_.start().q[setup_.model().num_base_positions() + setup_.model().FindJoint(joint)];
  }

 private:
  [[nodiscard]] const Joint& JointOf(int index) const {
    return setup_.model().joints()[static_cast<size_t>(index)];
  }

  const Setup& setup_;
  std::vector<int> arm_;
  std::vector<std::vector<int>> fingers_;
};

/// Of a torque or force: "N m" or "N".
std::string UnitOf(const Joint& joint) { return joint.type == JointType::kPrismatic ? "N" : "N m"; }
std::string AngleUnitOf(const Joint& joint) { return joint.type == JointType::kPrismatic ? "m" : "rad"; }

/// Entry of tau' of a joint or wheel.
Eigen::Index MotorOf(const Setup& setup, const std::string& joint) {
  const Base& base = setup.model().base();
  if (joint == base.wheel_joint_right) return 0;
  if (joint == base.wheel_joint_left) return 1;
  return setup.model().num_base_velocities() + setup.model().FindJoint(joint);
}

int FindId(const mjModel& m, mjtObj kind, const std::string& name) {
  const int id = mj_name2id(&m, kind, name.c_str());
  if (id < 0) throw InputError("the plant has nothing called " + Quote(name) + " to make a fault with");
  return id;
}
int JointId(const mjModel& m, const std::string& name) { return FindId(m, mjOBJ_JOINT, name); }
int BodyId(const mjModel& m, const std::string& name) { return FindId(m, mjOBJ_BODY, name); }
int DofOf(const mjModel& m, const std::string& joint) { return m.jnt_dofadr[JointId(m, joint)]; }

// Motors.

/// A motor's torque as a function of what it is sent, of time, and of nothing that was before.
PlantFault OneMotor(const std::string& joint, const std::string& how, double (*give)(double sent, double t)) {
  PlantFault fault{"motor " + joint + ": " + how, "motor", Cause::kActuator, joint};
  fault.motors = [joint, give](const Setup& setup) -> MotorFault {
    return [i = MotorOf(setup, joint), give](double t, VectorXd* tau) { (*tau)[i] = give((*tau)[i], t); };
  };
  return fault;
}

PlantFault AllMotors(const std::string& how, double (*give)(double sent, double t)) {
  PlantFault fault{"all motors: " + how, "motor", Cause::kActuator, "motors"};
  fault.motors = [give](const Setup&) -> MotorFault {
    return [give](double t, VectorXd* tau) {
      for (double& torque : *tau) torque = give(torque, t);
    };
  };
  return fault;
}

/// @param joint empty for all.
PlantFault Delay(const std::string& joint, size_t steps) {
  PlantFault fault{
      (joint.empty() ? "all motors" : "motor " + joint) + ": " + std::to_string(steps) + " steps late",
      "motor", Cause::kActuator, joint.empty() ? "motors" : joint};
  fault.motors = [joint, steps](const Setup& setup) -> MotorFault {
    return [joint, steps, i = joint.empty() ? 0 : MotorOf(setup, joint), sent = std::deque<VectorXd>()](
               double, VectorXd* tau) mutable {
      sent.push_back(*tau);
      if (sent.size() > steps + 1) sent.pop_front();
      if (joint.empty()) {
        *tau = sent.front();
      } else {
        (*tau)[i] = sent.front()[i];
      }
    };
  };
  return fault;
}

/// a' = (sent - a) / time: what is given follows what is sent.
PlantFault Lag(const std::string& joint, double fraction) {
  PlantFault fault{
      (joint.empty() ? "all motors" : "motor " + joint) + ": follow by " + FormatNumber(fraction) + " a step",
      "motor", Cause::kActuator, joint.empty() ? "motors" : joint};
  fault.motors = [joint, fraction](const Setup& setup) -> MotorFault {
    return [joint, fraction, i = joint.empty() ? 0 : MotorOf(setup, joint), given = VectorXd()](
               double, VectorXd* tau) mutable {
      if (given.size() == 0) given = *tau;
      given += fraction * (*tau - given);
      if (joint.empty()) {
        *tau = given;
      } else {
        (*tau)[i] = given[i];
      }
    };
  };
  return fault;
}

PlantFault Exchange(const std::string& a, const std::string& b) {
  PlantFault fault{"motors " + a + " and " + b + " exchanged", "motor", Cause::kActuator};
  fault.motors = [a, b](const Setup& setup) -> MotorFault {
    return [i = MotorOf(setup, a), j = MotorOf(setup, b)](double, VectorXd* tau) {
      std::swap((*tau)[i], (*tau)[j]);
    };
  };
  return fault;
}

/// In the engine, where nobody sent it.
PlantFault EngineMotor(const std::string& joint, const std::string& how,
                       void (*change)(mjModel*, int motor)) {
  PlantFault fault{"motor " + joint + " in the engine: " + how, "motor", Cause::kActuator, joint};
  fault.engine = [joint, change](const Setup&, mjModel* m) {
    const int id = JointId(*m, joint);
    for (int i = 0; i < m->nu; ++i) {
      if (m->actuator_trntype[i] == mjTRN_JOINT && m->actuator_trnid[2 * i] == id) change(m, i);
    }
  };
  return fault;
}

/// Half of the torque that it is sent first.
PlantFault WeakMotor(const std::string& joint) {
  PlantFault fault{"motor " + joint + ": at most half of its first torque", "motor", Cause::kActuator, joint};
  fault.motors = [joint](const Setup& setup) -> MotorFault {
    return [i = MotorOf(setup, joint), most = -1.0](double, VectorXd* tau) mutable {
      if (most < 0.0) most = 0.5 * std::abs((*tau)[i]);
      (*tau)[i] = std::clamp((*tau)[i], -most, most);
    };
  };
  return fault;
}

void AddMotorFaults(const Roles& roles, std::vector<PlantFault>* faults) {
  const auto add = [&](PlantFault fault) { faults->push_back(std::move(fault)); };
  const Joint& elbow = roles.Arm(kElbow);
  const Joint& shoulder = roles.Arm(kShoulder);
  const Joint& hand = roles.Arm(kHand);
  const Joint& torso = roles.Arm(kTorso);
  const Base& base = roles.setup().model().base();
  add(OneMotor(elbow.name, "gain 0.99", [](double sent, double) { return 0.99 * sent; }));
  add(OneMotor(shoulder.name, "gain 1.001", [](double sent, double) { return 1.001 * sent; }));
  if (roles.has_wheels()) {
    add(OneMotor(base.wheel_joint_right, "gain 0.98", [](double sent, double) { return 0.98 * sent; }));
    add(OneMotor(base.wheel_joint_left, "0.01 N m too much",
                 [](double sent, double) { return sent + 0.01; }));
    add(Delay(base.wheel_joint_left, 2));
  }
  if (roles.fingers() > 0) {
    const Joint& weak = roles.Finger(2, 3);
    add(OneMotor(roles.Finger(1, 2).name, "gain 1.02", [](double sent, double) { return 1.02 * sent; }));
    add(OneMotor(roles.Finger(4, 2).name, "the wrong sign", [](double sent, double) { return -sent; }));
    add(OneMotor(roles.Finger(3, 3).name, "dead", [](double, double) { return 0.0; }));
    add(OneMotor(weak.name, "0.001 " + UnitOf(weak) + " too much",
                 [](double sent, double) { return sent + 1e-3; }));
  }
  add(OneMotor(elbow.name, "0.05 " + UnitOf(elbow) + " too much",
               [](double sent, double) { return sent + 0.05; }));
  add(OneMotor(hand.name, "dry friction of 0.01 " + UnitOf(hand), [](double sent, double) {
    return std::abs(sent) > 0.01 ? sent - std::copysign(0.01, sent) : 0.0;
  }));
  add(WeakMotor(elbow.name));
  add(OneMotor(torso.name, "a ripple of 0.02 " + UnitOf(torso) + " at 30 Hz",
               [](double sent, double t) { return sent + 0.02 * std::sin(2.0 * kPi * 30.0 * t); }));
  add(AllMotors("gain 0.999", [](double sent, double) { return 0.999 * sent; }));
  add(AllMotors("steps of 0.01 N m", [](double sent, double) { return 0.01 * std::round(sent / 0.01); }));
  add(Delay("", 1));
  add(Delay("", 5));
  add(Delay(elbow.name, 3));
  add(Lag("", 0.5));
  add(Lag(roles.Arm(kUpperArm).name, 0.1));
  if (roles.fingers() > 1) {
    add(Exchange(roles.Finger(1, 2).name, roles.Finger(2, 2).name));
  } else if (elbow.name != hand.name) {
    add(Exchange(elbow.name, hand.name));
  }
  add(EngineMotor(elbow.name, "gain 1.01",
                  [](mjModel* m, int i) { m->actuator_gainprm[mjNGAIN * i] *= 1.01; }));
  const Joint& wrist = roles.Arm(kWrist);
  add(EngineMotor(wrist.name, "0.1 " + UnitOf(wrist) + " s/" + AngleUnitOf(wrist) + " of damping",
                  [](mjModel* m, int i) {
                    m->actuator_biastype[i] = mjBIAS_AFFINE;
                    m->actuator_biasprm[mjNBIAS * i + 2] = -0.1;
                  }));
}

// Joints, links and what is held.

constexpr const char* kLink = "link";
constexpr const char* kObject = "object";

PlantFault JointForce(const std::string& joint, const std::string& what,
                      const std::function<void(mjModel*, int joint, int dof)>& change) {
  PlantFault fault{"joint " + joint + ": " + what, "joint", Cause::kUnmodelledForce, joint};
  fault.engine = [joint, change](const Setup&, mjModel* m) {
    change(m, JointId(*m, joint), DofOf(*m, joint));
  };
  return fault;
}

/// A force (world, N) and a moment (N m) at a body's centre of mass, from `begin` to `end`, s.
/// @param kind "link" or "object".
PlantFault Push(const char* kind, const std::string& body, const std::string& what, const Vector3d& force,
                const Vector3d& moment, double begin = 0.0, double end = 1e9) {
  PlantFault fault{"body " + body + ": " + what, kind, Cause::kUnmodelledForce, body};
  fault.forces = [=](const mjModel& m, double t, mjData* d) {
    mjtNum* const wrench = d->xfrc_applied + 6 * BodyId(m, body);
    const double on = begin <= t && t < end ? 1.0 : 0.0;
    for (int k = 0; k < 3; ++k) {
      wrench[k] = on * force[k];
      wrench[3 + k] = on * moment[k];
    }
  };
  return fault;
}

PlantFault Body(const char* kind, const std::string& body, const std::string& what,
                void (*change)(mjModel*, int body)) {
  PlantFault fault{"body " + body + ": " + what, kind, Cause::kUnmodelledForce};
  if (kind == kObject) fault.part = body;
  fault.engine = [body, change](const Setup&, mjModel* m) { change(m, BodyId(*m, body)); };
  return fault;
}

/// A spring of a joint that pulls at once: relaxed at zero, or where the joint begins there aside of it.
PlantFault Spring(const Roles& roles, const Joint& joint, double stiffness) {
  const std::string what =
      "a spring of " + FormatNumber(stiffness) + " " + UnitOf(joint) + "/" + AngleUnitOf(joint);
  constexpr double kAside = 0.1;
  const double relaxed = std::abs(roles.StartOf(joint.name)) > kAside ? 0.0 : kAside;
  return JointForce(joint.name, what, [stiffness, relaxed](mjModel* m, int id, int) {
    m->jnt_stiffness[id] = stiffness;
    m->qpos_spring[m->jnt_qposadr[id]] = relaxed;
  });
}

PlantFault Damping(const std::string& joint, const std::string& unit, double more) {
  return JointForce(joint, FormatNumber(more) + " " + unit + " of damping",
                    [more](mjModel* m, int, int dof) { m->dof_damping[dof] += more; });
}

PlantFault Armature(const std::string& joint, const std::string& unit) {
  return JointForce(joint, "0.01 " + unit + " of armature",
                    [](mjModel* m, int, int dof) { m->dof_armature[dof] += 0.01; });
}

void AddJointForces(const Roles& roles, std::vector<PlantFault>* faults) {
  const auto add = [&](PlantFault fault) { faults->push_back(std::move(fault)); };
  const auto damping_unit = [](const Joint& joint) { return UnitOf(joint) + " s/" + AngleUnitOf(joint); };
  const Joint& elbow = roles.Arm(kElbow);
  const Joint& shoulder = roles.Arm(kShoulder);
  const Joint& hand = roles.Arm(kHand);
  add(Spring(roles, elbow, 0.5));
  if (roles.fingers() > 0) add(Spring(roles, roles.Finger(2, 3), 5e-3));
  add(Damping(shoulder.name, damping_unit(shoulder), 0.1));
  if (roles.has_wheels()) {
    const Base& base = roles.setup().model().base();
    add(Damping(base.wheel_joint_right, "N m s/rad", 0.05));
    add(Armature(base.wheel_joint_left, "kg m^2"));
  }
  add(JointForce(elbow.name, "dry friction of 0.05 " + UnitOf(elbow),
                 [](mjModel* m, int, int dof) { m->dof_frictionloss[dof] = 0.05; }));
  add(Armature(hand.name, hand.type == JointType::kPrismatic ? "kg" : "kg m^2"));
  add(JointForce(elbow.name, "a hidden stop", [q = roles.StartOf(elbow.name)](mjModel* m, int joint, int) {
    constexpr double kBeyond = 0.0085;  // the joint begins beyond it
    constexpr double kRange = 1.6;
    m->jnt_limited[joint] = 1;
    m->jnt_range[2 * joint] = q - kRange;
    m->jnt_range[2 * joint + 1] = q - kBeyond;
    m->jnt_solref[mjNREF * joint] = 0.2;
  }));
}

void AddLinkForces(const Roles& roles, std::vector<PlantFault>* faults) {
  const auto add = [&](PlantFault fault) { faults->push_back(std::move(fault)); };
  const std::string& forearm = roles.Arm(kElbow).link;
  const Vector3d none = Vector3d::Zero();
  add(Push(kLink, forearm, "1 N to the left", {0.0, 1.0, 0.0}, none));
  add(Push(kLink, roles.Arm(kPalm).link, "0.2 N down", {0.0, 0.0, -0.2}, none));
  add(Push(kLink, roles.Arm(kTorso).link, "2 N back", {-2.0, 0.0, 0.0}, none));
  if (roles.has_wheels()) {
    const std::string& platform = roles.setup().model().base().link;
    add(Push(kLink, platform, "5 N ahead for 10 ms", {5.0, 0.0, 0.0}, none, 0.02, 0.03));
    add(Body(kLink, platform, "1 % more mass", [](mjModel* m, int body) { m->body_mass[body] *= 1.01; }));
  }
  if (const Joint* idle = roles.Idle()) {
    add(Push(kLink, idle->link, "0.5 N ahead", {0.5, 0.0, 0.0}, none));
  }
  add(Body(kLink, forearm, "0.1 kg more", [](mjModel* m, int body) { m->body_mass[body] += 0.1; }));
}

void AddObjectForces(const Roles& roles, std::vector<PlantFault>* faults) {
  const auto add = [&](PlantFault fault) { faults->push_back(std::move(fault)); };
  const std::string object = roles.object();
  const Vector3d none = Vector3d::Zero();
  add(Push(kObject, object, "0.01 N ahead", {0.01, 0.0, 0.0}, none));
  add(Push(kObject, object, "0.1 N up for 5 ms", {0.0, 0.0, 0.1}, none, 0.02, 0.025));
  add(Push(kObject, object, "0.001 N m about the vertical", none, {0.0, 0.0, 1e-3}));
  add(Body(kObject, object, "1 % more mass", [](mjModel* m, int body) { m->body_mass[body] *= 1.01; }));
  add(Body(kObject, object, "twice the inertia", [](mjModel* m, int body) {
    for (int k = 0; k < 3; ++k) m->body_inertia[3 * body + k] *= 2.0;
  }));
  PlantFault tether{"body " + object + ": a tether of 1 N/m", kObject, Cause::kUnmodelledForce, object};
  const Vector3d fixed = roles.setup().start().X_Bo.translation() + Vector3d(0.05, 0.05, -0.1);
  tether.forces = [object, fixed](const mjModel& m, double, mjData* d) {
    const int body = BodyId(m, object);
    const mjtNum* const p = d->xpos + 3 * body;
    for (int k = 0; k < 3; ++k) d->xfrc_applied[6 * body + k] = fixed[k] - p[k];
  };
  add(tether);
  PlantFault drag{"body " + object + ": drag of 0.1 N s/m", kObject, Cause::kUnmodelledForce, object};
  drag.forces = [object](const mjModel& m, double, mjData* d) {
    const int body = BodyId(m, object);
    const mjtNum* const v = d->qvel + m.jnt_dofadr[m.body_jntadr[body]];
    for (int k = 0; k < 3; ++k) d->xfrc_applied[6 * body + k] = -0.1 * v[k];
  };
  add(drag);
}

// The world, wheels and contacts.

PlantFault World(const std::string& name, const std::string& kind, Cause cause, const std::string& part,
                 void (*change)(const Setup&, mjModel*), bool from_start = false) {
  PlantFault fault{name, kind, cause, part};
  fault.from_start = from_start;
  fault.engine = change;
  return fault;
}

/// Gravity as on a floor that rises by `pitch` (rad) ahead and falls by `roll` to the left.
void Tilt(mjModel* m, double pitch, double roll) {
  const double g = -m->opt.gravity[2];
  m->opt.gravity[0] = -g * std::sin(pitch);
  m->opt.gravity[1] = g * std::cos(pitch) * std::sin(roll);
  m->opt.gravity[2] = -g * std::cos(pitch) * std::cos(roll);
}

/// @param wheel 0, the right one, or 1.
int WheelBody(const Setup& setup, const mjModel& m, size_t wheel) {
  return m.jnt_bodyid[setup.adapter().wheels()[wheel].joint];
}

/// Pairs of the floor, or of the object.
void ChangePairs(mjModel* m, bool floor, const std::function<void(int pair)>& change) {
  for (int pair = 0; pair < m->npair; ++pair) {
    const bool has_floor = m->geom_type[m->pair_geom1[pair]] == mjGEOM_PLANE ||
                           m->geom_type[m->pair_geom2[pair]] == mjGEOM_PLANE;
    if (has_floor == floor) change(pair);
  }
}

void SetFriction(mjModel* m, bool floor, double mu) {
  ChangePairs(m, floor, [&](int pair) { m->pair_friction[5 * pair] = m->pair_friction[5 * pair + 1] = mu; });
}

void Soften(mjModel* m, bool floor, double time_constant, double impedance) {
  ChangePairs(m, floor, [&](int pair) {
    m->pair_solref[mjNREF * pair] = time_constant;
    m->pair_solimp[mjNIMP * pair] = m->pair_solimp[mjNIMP * pair + 1] = impedance;
  });
}

void AddWheelFaults(const Roles& roles, std::vector<PlantFault>* faults) {
  const auto add = [&](PlantFault fault) { faults->push_back(std::move(fault)); };
  add(World(
      "wheels: both 0.1 mm larger", "wheels", Cause::kWheelGeometry, "wheel",
      [](const Setup& setup, mjModel* m) {
        for (const size_t wheel : {size_t{0}, size_t{1}}) ScaleWheel(setup, m, wheel, 1e-4);
      },
      true));
  add(World(
      "wheels: the left one 0.05 mm smaller", "wheels", Cause::kWheelGeometry,
      roles.setup().model().base().wheel_joint_left,
      [](const Setup& setup, mjModel* m) { ScaleWheel(setup, m, 1, -5e-5); }, true));
  add(World(
      "wheels: 2 mm farther apart", "wheels", Cause::kWheelGeometry, "wheel",
      [](const Setup& setup, mjModel* m) { MoveWheels(setup, m, 2e-3); }, true));
  add(World("contacts: wheels slide, mu = 0.002", "contacts", Cause::kWheelSlip, "",
            [](const Setup&, mjModel* m) { SetFriction(m, true, 0.002); }));
}

void AddWorldFaults(const Roles& roles, std::vector<PlantFault>* faults) {
  const auto add = [&](PlantFault fault) { faults->push_back(std::move(fault)); };
  add(World("floor: rises by 0.05 degrees ahead", "floor", Cause::kSlope, "slope 0.05",
            [](const Setup&, mjModel* m) { Tilt(m, DegToRad(0.05), 0.0); }));
  add(World("floor: falls by 0.1 degrees to the left", "floor", Cause::kSlope, "slope 0.1",
            [](const Setup&, mjModel* m) { Tilt(m, 0.0, DegToRad(0.1)); }));
  add(World("gravity: 0.1 % stronger", "floor", Cause::kUnmodelledForce, "gravity",
            [](const Setup&, mjModel* m) { m->opt.gravity[2] *= 1.001; }));
  if (roles.has_wheels()) AddWheelFaults(roles, faults);
  if (!roles.holds()) return;
  add(World("contacts: fingertips slide, mu = 0.15", "contacts", Cause::kFingertipSlip, "",
            [](const Setup&, mjModel* m) { SetFriction(m, false, 0.15); }));
  add(World("contacts: soft fingertips", "contacts", Cause::kContactSoftness, "",
            [](const Setup&, mjModel* m) { Soften(m, false, 0.02, 0.9); }));
  add(World("contacts: creep, impratio 1", "contacts", Cause::kContactSoftness, "",
            [](const Setup&, mjModel* m) { m->opt.impratio = 1.0; }));
  add(World("solver: one conjugate gradient", "solver", Cause::kSolver, "", [](const Setup&, mjModel* m) {
    m->opt.solver = mjSOL_CG;
    m->opt.iterations = 1;
  }));
}

// Sensors.

PlantFault Sensor(const std::string& name, const std::string& part,
                  std::function<SensorFault(const Setup&)> make) {
  PlantFault fault{"sensor: " + name, "sensor", Cause::kSensing, part};
  fault.sensors = std::move(make);
  return fault;
}

Eigen::Index PositionOf(const Setup& setup, const std::string& joint) {
  return setup.model().num_base_positions() + setup.model().FindJoint(joint);
}

void AddObjectSensorFaults(const Roles& roles, std::vector<PlantFault>* faults) {
  const auto add = [&](PlantFault fault) { faults->push_back(std::move(fault)); };
  add(Sensor("object 0.1 mm aside", "object", [](const Setup&) -> SensorFault {
    return [](double, MeasuredState* told) { told->X_Bo.translation().y() += 1e-4; };
  }));
  add(Sensor("object's velocity times 0.99", "object", [](const Setup&) -> SensorFault {
    return [](double, MeasuredState* told) { told->V_Bo *= 0.99; };
  }));
  const RobotModel& model = roles.setup().model();
  const std::string& tip = model.frames()[static_cast<size_t>(roles.setup().fingertips().front())].name;
  add(Sensor("first contact 0.01 rad off", tip, [](const Setup&) -> SensorFault {
    return [](double, MeasuredState* told) { told->kappa[0].alpha_o.u += 0.01; };
  }));
}

void AddSensorFaults(const Roles& roles, std::vector<PlantFault>* faults) {
  const auto add = [&](PlantFault fault) { faults->push_back(std::move(fault)); };
  const Joint& off = roles.Arm(kElbow);
  add(Sensor("angle of " + off.name + " 0.0001 " + AngleUnitOf(off) + " off", off.name,
             [joint = off.name](const Setup& setup) -> SensorFault {
               return [i = PositionOf(setup, joint)](double, MeasuredState* told) { told->q[i] += 1e-4; };
             }));
  const Joint& noisy = roles.fingers() > 0 ? roles.Finger(1, 3) : roles.Arm(kHand);
  add(Sensor("angle of " + noisy.name + " with noise", noisy.name,
             [joint = noisy.name](const Setup& setup) -> SensorFault {
               return [i = PositionOf(setup, joint), random = std::mt19937(1)](double,
                                                                               MeasuredState* told) mutable {
                 told->q[i] += 1e-5 * (2.0 * static_cast<double>(random()) * 0x1p-32 - 1.0);
               };
             }));
  const std::string& fast = roles.Arm(kShoulder).name;
  add(Sensor("rate of " + fast + " times 1.01", fast, [fast](const Setup& setup) -> SensorFault {
    return [i = MotorOf(setup, fast)](double, MeasuredState* told) { told->xi[i] *= 1.01; };
  }));
  if (roles.has_wheels()) {
    add(Sensor("heading 0.001 rad off", "heading", [](const Setup&) -> SensorFault {
      return [](double, MeasuredState* told) { told->q[2] += 1e-3; };
    }));
  }
  add(Sensor("everything 1 step late", "", [](const Setup&) -> SensorFault {
    return [before = std::vector<MeasuredState>()](double, MeasuredState* told) mutable {
      before.push_back(*told);
      *told = before.size() > 1 ? before[before.size() - 2] : before.back();
      if (before.size() > 2) before.erase(before.begin());
    };
  }));
  if (roles.holds()) AddObjectSensorFaults(roles, faults);
}

}  // namespace

void ScaleWheel(const Setup& setup, mjModel* m, size_t wheel, double by) {
  const int body = WheelBody(setup, *m, wheel);
  for (int i = 0; i < m->body_geomnum[body]; ++i) {
    const int geom = m->body_geomadr[body] + i;
    if (!CanTouch(*m, geom)) continue;
    m->geom_size[3 * geom] += by;
    m->geom_rbound[geom] += by;
  }
  // The floor stays where it is touched.
  m->body_pos[3 * body + 2] += by;
}

void MoveWheels(const Setup& setup, mjModel* m, double by) {
  m->body_pos[3 * WheelBody(setup, *m, 0) + 1] -= 0.5 * by;
  m->body_pos[3 * WheelBody(setup, *m, 1) + 1] += 0.5 * by;
}

std::vector<PlantFault> ListPlantFaults(const Setup& setup) {
  const Roles roles(setup);
  std::vector<PlantFault> faults;
  AddMotorFaults(roles, &faults);
  AddJointForces(roles, &faults);
  AddLinkForces(roles, &faults);
  if (roles.holds()) AddObjectForces(roles, &faults);
  AddWorldFaults(roles, &faults);
  AddSensorFaults(roles, &faults);
  return faults;
}

FaultyPlant::FaultyPlant(const Setup& setup, std::unique_ptr<EnginePlant> plant, const PlantFault& fault)
    : plant_(std::move(plant)), forces_(fault.forces) {
  if (fault.engine) plant_->simulation().Change([&](mjModel* m) { fault.engine(setup, m); });
  if (fault.motors) motors_ = fault.motors(setup);
}

void FaultyPlant::EndStep(const Eigen::Ref<const VectorXd>& tau) {
  EngineSimulation& simulation = plant_->simulation();
  tau_ = tau;
  if (motors_) motors_(time_, &tau_);
  const int size = 6 * simulation.model().nbody;
  mjtNum* const forces = simulation.data().xfrc_applied;
  const std::vector<mjtNum> declared(forces, forces + size);
  if (forces_) forces_(simulation.model(), time_, &simulation.data());
  plant_->EndStep(tau_);
  std::copy(declared.begin(), declared.end(), forces);
  time_ += time_step();
}

}  // namespace dexcheck
