#include "harness/diagnosis/plant_faults.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <random>
#include <utility>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

using TauIndices = std::vector<Eigen::Index>;

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
PlantFault Lag(const std::string& joint, double share) {
  PlantFault fault{
      (joint.empty() ? "all motors" : "motor " + joint) + ": follow by " + FormatNumber(share) + " a step",
      "motor", Cause::kActuator, joint.empty() ? "motors" : joint};
  fault.motors = [joint, share](const Setup& setup) -> MotorFault {
    return [joint, share, i = joint.empty() ? 0 : MotorOf(setup, joint), given = VectorXd()](
               double, VectorXd* tau) mutable {
      if (given.size() == 0) given = *tau;
      given += share * (*tau - given);
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

void AddMotorFaults(std::vector<PlantFault>* faults) {
  const auto add = [&](PlantFault fault) { faults->push_back(std::move(fault)); };
  add(OneMotor("r_elbow", "gain 0.99", [](double sent, double) { return 0.99 * sent; }));
  add(OneMotor("r_shoulder_pitch", "gain 1.001", [](double sent, double) { return 1.001 * sent; }));
  add(OneMotor("rf1_2", "gain 1.02", [](double sent, double) { return 1.02 * sent; }));
  add(OneMotor("wheel_right", "gain 0.98", [](double sent, double) { return 0.98 * sent; }));
  add(OneMotor("rf4_2", "the wrong sign", [](double sent, double) { return -sent; }));
  add(OneMotor("rf3_3", "dead", [](double, double) { return 0.0; }));
  add(OneMotor("r_elbow", "0.05 N m too much", [](double sent, double) { return sent + 0.05; }));
  add(OneMotor("rf2_3", "0.001 N m too much", [](double sent, double) { return sent + 1e-3; }));
  add(OneMotor("wheel_left", "0.01 N m too much", [](double sent, double) { return sent + 0.01; }));
  add(OneMotor("r_wrist_flexion", "dry friction of 0.01 N m", [](double sent, double) {
    return std::abs(sent) > 0.01 ? sent - std::copysign(0.01, sent) : 0.0;
  }));
  add(OneMotor("r_elbow", "at most 1 N m", [](double sent, double) { return std::clamp(sent, -1.0, 1.0); }));
  add(OneMotor("waist_pitch", "a ripple of 0.02 N m at 30 Hz",
               [](double sent, double t) { return sent + 0.02 * std::sin(2.0 * kPi * 30.0 * t); }));
  add(AllMotors("gain 0.999", [](double sent, double) { return 0.999 * sent; }));
  add(AllMotors("steps of 0.01 N m", [](double sent, double) { return 0.01 * std::round(sent / 0.01); }));
  add(Delay("", 1));
  add(Delay("", 5));
  add(Delay("r_elbow", 3));
  add(Delay("wheel_left", 2));
  add(Lag("", 0.5));
  add(Lag("r_shoulder_roll", 0.1));
  add(Exchange("rf1_2", "rf2_2"));
  add(EngineMotor("r_elbow", "gain 1.01",
                  [](mjModel* m, int i) { m->actuator_gainprm[mjNGAIN * i] *= 1.01; }));
  add(EngineMotor("r_wrist_deviation", "0.1 N m s/rad of damping", [](mjModel* m, int i) {
    m->actuator_biastype[i] = mjBIAS_AFFINE;
    m->actuator_biasprm[mjNBIAS * i + 2] = -0.1;
  }));
}

// Joints and links.

PlantFault JointForce(const std::string& joint, const std::string& what,
                      void (*change)(mjModel*, int joint, int dof)) {
  PlantFault fault{"joint " + joint + ": " + what, "joint", Cause::kUnmodelledForce, joint};
  fault.engine = [joint, change](const Setup&, mjModel* m) {
    change(m, JointId(*m, joint), DofOf(*m, joint));
  };
  return fault;
}

/// A force (world, N) and a moment (N m) at a body's centre of mass, from `begin` to `end`, s.
PlantFault Push(const std::string& body, const std::string& what, const Vector3d& force,
                const Vector3d& moment, double begin = 0.0, double end = 1e9) {
  PlantFault fault{"body " + body + ": " + what, body == "torus" ? "object" : "link", Cause::kUnmodelledForce,
                   body};
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

PlantFault Body(const std::string& body, const std::string& what, void (*change)(mjModel*, int body)) {
  PlantFault fault{"body " + body + ": " + what, body == "torus" ? "object" : "link",
                   Cause::kUnmodelledForce};
  if (body == "torus") fault.part = body;
  fault.engine = [body, change](const Setup&, mjModel* m) { change(m, BodyId(*m, body)); };
  return fault;
}

void AddForces(std::vector<PlantFault>* faults) {
  const auto add = [&](PlantFault fault) { faults->push_back(std::move(fault)); };
  const auto spring = [](mjModel* m, int joint, int) {
    // Relaxed at zero: it pulls at once.
    m->jnt_stiffness[joint] = 0.5;
  };
  const auto weak_spring = [](mjModel* m, int joint, int) { m->jnt_stiffness[joint] = 5e-3; };
  add(JointForce("r_elbow", "a spring of 0.5 N m/rad", spring));
  add(JointForce("rf2_3", "a spring of 0.005 N m/rad", weak_spring));
  add(JointForce("r_shoulder_pitch", "0.1 N m s/rad of damping",
                 [](mjModel* m, int, int dof) { m->dof_damping[dof] += 0.1; }));
  add(JointForce("wheel_right", "0.05 N m s/rad of damping",
                 [](mjModel* m, int, int dof) { m->dof_damping[dof] += 0.05; }));
  add(JointForce("r_elbow", "dry friction of 0.05 N m",
                 [](mjModel* m, int, int dof) { m->dof_frictionloss[dof] = 0.05; }));
  add(JointForce("r_wrist_flexion", "0.01 kg m^2 of armature",
                 [](mjModel* m, int, int dof) { m->dof_armature[dof] += 0.01; }));
  add(JointForce("wheel_left", "0.01 kg m^2 of armature",
                 [](mjModel* m, int, int dof) { m->dof_armature[dof] += 0.01; }));
  add(JointForce("r_elbow", "a hidden stop", [](mjModel* m, int joint, int) {
    m->jnt_limited[joint] = 1;
    m->jnt_range[2 * joint] = -0.1;
    m->jnt_range[2 * joint + 1] = 1.475;
    m->jnt_solref[mjNREF * joint] = 0.2;
  }));
  add(Push("r_forearm", "1 N to the left", {0.0, 1.0, 0.0}, Vector3d::Zero()));
  add(Push("r_palm", "0.2 N down", {0.0, 0.0, -0.2}, Vector3d::Zero()));
  add(Push("torso", "2 N back", {-2.0, 0.0, 0.0}, Vector3d::Zero()));
  add(Push("platform", "5 N ahead for 10 ms", {5.0, 0.0, 0.0}, Vector3d::Zero(), 0.02, 0.03));
  add(Push("l_forearm", "0.5 N ahead", {0.5, 0.0, 0.0}, Vector3d::Zero()));
  add(Body("r_forearm", "0.1 kg more", [](mjModel* m, int body) { m->body_mass[body] += 0.1; }));
  add(Body("platform", "1 % more mass", [](mjModel* m, int body) { m->body_mass[body] *= 1.01; }));
  add(Push("torus", "0.01 N ahead", {0.01, 0.0, 0.0}, Vector3d::Zero()));
  add(Push("torus", "0.1 N up for 5 ms", {0.0, 0.0, 0.1}, Vector3d::Zero(), 0.02, 0.025));
  add(Push("torus", "0.001 N m about the vertical", Vector3d::Zero(), {0.0, 0.0, 1e-3}));
  add(Body("torus", "1 % more mass", [](mjModel* m, int body) { m->body_mass[body] *= 1.01; }));
  add(Body("torus", "twice the inertia", [](mjModel* m, int body) {
    for (int k = 0; k < 3; ++k) m->body_inertia[3 * body + k] *= 2.0;
  }));
  PlantFault tether{"body torus: a tether of 1 N/m", "object", Cause::kUnmodelledForce, "torus"};
  tether.forces = [](const mjModel& m, double, mjData* d) {
    const int body = BodyId(m, "torus");
    const mjtNum* const p = d->xpos + 3 * body;
    const Vector3d fixed(0.35, -0.25, 0.7);
    for (int k = 0; k < 3; ++k) d->xfrc_applied[6 * body + k] = fixed[k] - p[k];
  };
  add(tether);
  PlantFault drag{"body torus: drag of 0.1 N s/m", "object", Cause::kUnmodelledForce, "torus"};
  drag.forces = [](const mjModel& m, double, mjData* d) {
    const int body = BodyId(m, "torus");
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

void ScaleWheel(mjModel* m, const char* geom, double by) {
  m->geom_size[3 * FindId(*m, mjOBJ_GEOM, geom)] += by;
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

void AddWorldFaults(std::vector<PlantFault>* faults) {
  const auto add = [&](PlantFault fault) { faults->push_back(std::move(fault)); };
  add(World("floor: rises by 0.05 degrees ahead", "floor", Cause::kSlope, "0.05 deg",
            [](const Setup&, mjModel* m) { Tilt(m, DegToRad(0.05), 0.0); }));
  add(World("floor: falls by 0.1 degrees to the left", "floor", Cause::kSlope, "0.1 deg",
            [](const Setup&, mjModel* m) { Tilt(m, 0.0, DegToRad(0.1)); }));
  add(World("gravity: 0.1 % stronger", "floor", Cause::kUnmodelledForce, "gravity",
            [](const Setup&, mjModel* m) { m->opt.gravity[2] *= 1.001; }));
  add(World(
      "wheels: both 0.1 mm larger", "wheels", Cause::kWheelGeometry, "wheel",
      [](const Setup&, mjModel* m) {
        ScaleWheel(m, "wheel_right_geom", 1e-4);
        ScaleWheel(m, "wheel_left_geom", 1e-4);
      },
      true));
  add(World(
      "wheels: the left one 0.05 mm smaller", "wheels", Cause::kWheelGeometry, "wheel_left",
      [](const Setup&, mjModel* m) { ScaleWheel(m, "wheel_left_geom", -5e-5); }, true));
  add(World(
      "wheels: 2 mm farther apart", "wheels", Cause::kWheelGeometry, "wheel",
      [](const Setup&, mjModel* m) {
        m->body_pos[3 * BodyId(*m, "wheel_right") + 1] -= 1e-3;
        m->body_pos[3 * BodyId(*m, "wheel_left") + 1] += 1e-3;
      },
      true));
  add(World("contacts: fingertips slide, mu = 0.15", "contacts", Cause::kFingertipSlip, "",
            [](const Setup&, mjModel* m) { SetFriction(m, false, 0.15); }));
  add(World("contacts: wheels slide, mu = 0.002", "contacts", Cause::kWheelSlip, "",
            [](const Setup&, mjModel* m) { SetFriction(m, true, 0.002); }));
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

Eigen::Index PositionOf(const Setup& setup, const char* joint) {
  return setup.model().num_base_positions() + setup.model().FindJoint(joint);
}

void AddSensorFaults(std::vector<PlantFault>* faults) {
  const auto add = [&](PlantFault fault) { faults->push_back(std::move(fault)); };
  add(Sensor("angle of r_elbow 0.0001 rad off", "r_elbow", [](const Setup& setup) -> SensorFault {
    return [i = PositionOf(setup, "r_elbow")](double, MeasuredState* told) { told->q[i] += 1e-4; };
  }));
  add(Sensor("angle of rf1_3 with noise", "rf1_3", [](const Setup& setup) -> SensorFault {
    return [i = PositionOf(setup, "rf1_3"), random = std::mt19937(1)](double, MeasuredState* told) mutable {
      told->q[i] += 1e-5 * (2.0 * static_cast<double>(random()) * 0x1p-32 - 1.0);
    };
  }));
  add(Sensor(
      "rate of r_shoulder_pitch times 1.01", "r_shoulder_pitch", [](const Setup& setup) -> SensorFault {
        return [i = MotorOf(setup, "r_shoulder_pitch")](double, MeasuredState* told) { told->xi[i] *= 1.01; };
      }));
  add(Sensor("heading 0.001 rad off", "heading", [](const Setup&) -> SensorFault {
    return [](double, MeasuredState* told) { told->q[2] += 1e-3; };
  }));
  add(Sensor("object 0.1 mm aside", "object", [](const Setup&) -> SensorFault {
    return [](double, MeasuredState* told) { told->X_Bo.translation().y() += 1e-4; };
  }));
  add(Sensor("object's velocity times 0.99", "object", [](const Setup&) -> SensorFault {
    return [](double, MeasuredState* told) { told->V_Bo *= 0.99; };
  }));
  add(Sensor("everything 1 step late", "", [](const Setup&) -> SensorFault {
    return [before = std::vector<MeasuredState>()](double, MeasuredState* told) mutable {
      before.push_back(*told);
      *told = before.size() > 1 ? before[before.size() - 2] : before.back();
      if (before.size() > 2) before.erase(before.begin());
    };
  }));
  add(Sensor("first contact 0.01 rad off", "rf1_tip", [](const Setup&) -> SensorFault {
    return [](double, MeasuredState* told) { told->kappa[0].alpha_o.u += 0.01; };
  }));
}

}  // namespace

std::vector<PlantFault> ListPlantFaults() {
  std::vector<PlantFault> faults;
  AddMotorFaults(&faults);
  AddForces(&faults);
  AddWorldFaults(&faults);
  AddSensorFaults(&faults);
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
  if (forces_) forces_(simulation.model(), time_, &simulation.data());
  plant_->EndStep(tau_);
  time_ += time_step();
}

}  // namespace dexcheck
