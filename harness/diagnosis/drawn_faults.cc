#include "harness/diagnosis/drawn_faults.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <random>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

/// What is drawn; the same on every machine.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double Uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  /// Evenly over decades, with either sign.
  double Size(double low, double high) {
    const double size = std::exp(Uniform(std::log(low), std::log(high)));
    return random_() % 2 == 0 ? size : -size;
  }
  size_t Index(size_t count) { return static_cast<size_t>(random_() % count); }
  Vector3d Direction() {
    const double z = Uniform(-1.0, 1.0), angle = Uniform(0.0, 2.0 * kPi), r = std::sqrt(1.0 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }

 private:
  std::mt19937_64 random_;
};

/// One fault and how it should be told.
struct One {
  PlantFault fault;
  Fault truth;
};

One MakeOne(const char* kind, const std::string& place, const std::string& name, double value,
            double change) {
  One one;
  one.fault.name = place + ": " + name + " " + FormatNumber(value, 4);
  one.fault.kind = kind;
  one.truth = {name, place, value, std::abs(change), "", ""};
  return one;
}

using Give = std::function<double(double sent, double t)>;

/// Entry of tau' of a motor.
int DrawEntry(const Setup& setup, Draw* draw) {
  const bool wheels = setup.model().base().type == BaseType::kDifferentialDrive;
  const size_t count = static_cast<size_t>(setup.model().num_dofs() + (wheels ? 2 : 0));
  return static_cast<int>(draw->Index(count)) + (wheels ? 0 : setup.model().num_base_velocities());
}

/// @param make the function of a fresh run.
One Motor(const Setup& setup, int entry, const std::string& name, double value, double change,
          const std::function<Give()>& make) {
  const RobotModel& model = setup.model();
  const Base& base = model.base();
  const int offset = model.num_base_velocities();
  const std::string joint = entry >= offset ? model.dof_name(entry - offset)
                            : entry == 0    ? base.wheel_joint_right
                                            : base.wheel_joint_left;
  One one = MakeOne("motor", "motor " + joint, name, value, change);
  one.fault.motors = [entry, make](const Setup&) -> MotorFault {
    return [entry, give = make()](double t, VectorXd* tau) { (*tau)[entry] = give((*tau)[entry], t); };
  };
  return one;
}

One DrawMotor(const Setup& setup, Draw* draw, const DrawOptions& options) {
  const double duration = options.duration;
  const int entry = DrawEntry(setup, draw);
  const double torque = std::max(std::abs(options.tau[entry]), 1e-6);
  const double dt = setup.scenario().plant.time_step;
  switch (draw->Index(9)) {
    case 0: {
      const double gain = 1.0 + draw->Size(0.005, 0.2);
      return Motor(setup, entry, "gain", gain, gain - 1.0,
                   [gain] { return [gain](double u, double) { return gain * u; }; });
    }
    case 1: {
      const double offset = draw->Size(1e-3, 0.1);
      return Motor(setup, entry, "offset", offset, offset,
                   [offset] { return [offset](double u, double) { return u + offset; }; });
    }
    case 2: {
      const auto steps = 1 + draw->Index(8);
      return Motor(setup, entry, "delay", static_cast<double>(steps), static_cast<double>(steps), [steps] {
        return [steps, sent = std::deque<double>()](double u, double) mutable {
          sent.push_back(u);
          if (sent.size() > steps + 1) sent.pop_front();
          return sent.front();
        };
      });
    }
    case 3: {
      const double time = draw->Uniform(1.0, 20.0) * dt;
      return Motor(setup, entry, "lag", time, time, [time, dt] {
        return [time, dt, given = std::nan("")](double u, double) mutable {
          if (std::isnan(given)) given = u;
          given += (1.0 - std::exp(-dt / time)) * (u - given);
          return given;
        };
      });
    }
    case 4: {
      const double zone = std::abs(draw->Size(0.02, 0.8)) * torque;
      return Motor(setup, entry, "dead zone", zone, zone, [zone] {
        return [zone](double u, double) { return std::abs(u) > zone ? u - std::copysign(zone, u) : 0.0; };
      });
    }
    case 5: {
      const double step = std::abs(draw->Size(1e-3, 0.2)) * torque;
      return Motor(setup, entry, "rounding to steps of", step, step,
                   [step] { return [step](double u, double) { return step * std::round(u / step); }; });
    }
    case 6: {
      const double rate = draw->Size(0.01, 1.0);
      const double begin = draw->Uniform(0.0, 0.3 * duration);
      return Motor(setup, entry, "drift", rate, rate, [rate, begin] {
        return [rate, begin](double u, double t) { return u + rate * std::max(0.0, t - begin); };
      });
    }
    case 7: {
      const double offset = draw->Size(1e-3, 0.1);
      const double begin = draw->Uniform(0.0, 0.5 * duration), end = begin + 0.3 * duration;
      return Motor(setup, entry, "offset", offset, offset, [=] {
        return [=](double u, double t) { return begin <= t && t < end ? u + offset : u; };
      });
    }
    default: {
      const double size = std::abs(draw->Size(1e-4, 1e-2));
      return Motor(setup, entry, "noise, standard deviation", size, 5.0 * size, [size] {
        return [size, random = std::mt19937_64(7)](double u, double) mutable {
          // Of twelve even ones the sum has variance 1.
          double sum = -6.0;
          for (int i = 0; i < 12; ++i) sum += static_cast<double>(random() >> 11) * 0x1p-53;
          return u + size * sum;
        };
      });
    }
  }
}

One DrawSensor(const Setup& setup, Draw* draw, double duration) {
  const RobotModel& model = setup.model();
  const auto joint = static_cast<int>(draw->Index(static_cast<size_t>(model.num_joints())));
  const std::string name = "joint " + model.joints()[static_cast<size_t>(joint)].name;
  const int p = model.position_index(joint);
  const int v = model.num_base_velocities() + model.dof(joint);
  const auto sensor = [&](const std::string& place, const char* fault, double value, double change,
                          const SensorFault& change_state) {
    One one = MakeOne("sensor", place, fault, value, change);
    one.fault.sensors = [change_state](const Setup&) { return change_state; };
    return one;
  };
  const double off = draw->Size(1e-5, 1e-3);
  const double gain = 1.0 + draw->Size(1e-3, 2e-2);
  const bool holds = !setup.fingertips().empty();
  switch (draw->Index(holds ? 9 : 4)) {
    case 0:
      return sensor(name + ", position", "offset", off, off,
                    [p, off](double, MeasuredState* told) { told->q[p] += off; });
    case 1:
      return sensor(name + ", position", "gain", gain, gain - 1.0,
                    [p, gain](double, MeasuredState* told) { told->q[p] *= gain; });
    case 2:
      return sensor(name + ", rate", "gain", gain, gain - 1.0,
                    [v, gain](double, MeasuredState* told) { told->xi[v] *= gain; });
    case 3: {
      const double rate = off / duration;
      return sensor(name + ", position", "drift", rate, rate,
                    [p, rate](double t, MeasuredState* told) { told->q[p] += rate * t; });
    }
    case 4: {
      const auto axis = static_cast<int>(draw->Index(3));
      return sensor("object " + setup.object().name + ", position " + "xyz"[axis], "offset", off, off,
                    [axis, off](double, MeasuredState* told) { told->X_Bo.translation()[axis] += off; });
    }
    case 5: {
      const auto axis = static_cast<int>(draw->Index(3));
      return sensor("object " + setup.object().name + ", velocity " + "xyz"[axis], "offset", off, off,
                    [axis, off](double, MeasuredState* told) { told->V_Bo[axis] += off; });
    }
    default: {
      const size_t tip = draw->Index(setup.fingertips().size());
      const std::string place =
          "fingertip " + model.frames()[static_cast<size_t>(setup.fingertips()[tip])].name;
      const size_t which = draw->Index(3);
      return sensor(place + (which == 0   ? ", contact u on the object"
                             : which == 1 ? ", contact u on the fingertip"
                                          : ", contact angle psi"),
                    "offset", off, off, [=](double, MeasuredState* told) {
                      ContactCoordinates& kappa = told->kappa[tip];
                      (which == 0 ? kappa.alpha_o.u : which == 1 ? kappa.alpha_f.u : kappa.psi) += off;
                    });
    }
  }
}

int FindId(const mjModel& m, mjtObj kind, const std::string& name) {
  const int id = mj_name2id(&m, kind, name.c_str());
  if (id < 0) throw InputError("the plant has nothing called " + Quote(name) + " to make a fault with");
  return id;
}

/// A force or torque between the joint's body and the one that carries it.
void PushJoint(const mjModel& m, int joint, double size, mjData* d) {
  const int body = m.jnt_bodyid[joint], parent = m.body_parentid[body];
  const Vector3d push = size * Eigen::Map<const Vector3d>(d->xaxis + 3 * joint);
  const bool slides = m.jnt_type[joint] == mjJNT_SLIDE;
  const Vector3d arm =
      Eigen::Map<const Vector3d>(d->xipos + 3 * body) - Eigen::Map<const Vector3d>(d->xipos + 3 * parent);
  Vector6d wrench = Vector6d::Zero();
  if (slides) {
    wrench << push, Vector3d::Zero();
  } else {
    wrench << Vector3d::Zero(), push;
  }
  Eigen::Map<Vector6d>(d->xfrc_applied + 6 * body) += wrench;
  if (parent == 0) return;
  wrench.tail<3>() += arm.cross(wrench.head<3>());
  Eigen::Map<Vector6d>(d->xfrc_applied + 6 * parent) -= wrench;
}

One DrawJoint(const Setup& setup, Draw* draw) {
  const RobotModel& model = setup.model();
  const Joint& joint = model.joints()[draw->Index(static_cast<size_t>(model.num_joints()))];
  const auto change = [&](const char* name, double nominal, double more,
                          const std::function<void(mjModel*, int dof, int joint)>& set) {
    One one = MakeOne("joint", "joint " + joint.name, name, nominal + more, more);
    one.fault.engine = [set, name = joint.name](const Setup&, mjModel* m) {
      const int id = FindId(*m, mjOBJ_JOINT, name);
      set(m, m->jnt_dofadr[id], id);
    };
    return one;
  };
  const double size = std::abs(draw->Size(2e-3, 0.1));
  switch (draw->Index(4)) {
    case 0:
      return change("armature", joint.armature, size,
                    [size](mjModel* m, int dof, int) { m->dof_armature[dof] += size; });
    case 1:
      return change("viscous friction", joint.damping, size,
                    [size](mjModel* m, int dof, int) { m->dof_damping[dof] += size; });
    case 2: {
      One one = change("torque", 0.0, size, {});
      one.fault.engine = {};
      one.fault.forces = [name = joint.name, size](const mjModel& m, double, mjData* d) {
        PushJoint(m, FindId(m, mjOBJ_JOINT, name), size, d);
      };
      return one;
    }
    default:
      return change("spring", 0.0, size, [size](mjModel* m, int, int id) {
        m->jnt_stiffness[id] = size;
        m->qpos_spring[m->jnt_qposadr[id]] = 0.2;
      });
  }
}

/// Force or moment, or mass, on a link or the object.
One DrawBody(const Setup& setup, Draw* draw, double duration) {
  const RobotModel& model = setup.model();
  const bool on_object = setup.has_object() && !setup.fingertips().empty() && draw->Index(4) == 0;
  // The engine's body may be one of several that the model has as one.
  std::vector<size_t> links;
  for (size_t i = 0; i < model.joints().size(); ++i) {
    const MassProperties& own = model.joints()[i].body;
    const int id = FindId(setup.engine(), mjOBJ_BODY, model.joints()[i].link);
    constexpr double kSame = 1e-6;
    if (own.mass > 0.0 && std::abs(setup.engine().body_mass[id] - own.mass) <= kSame * own.mass)
      links.push_back(i);
  }
  const size_t link = links[draw->Index(links.size())];
  const std::string body = on_object ? setup.object().name : model.joints()[link].link;
  const std::string place = (on_object ? "object " : "link ") + body;
  const size_t which = draw->Index(4);
  if (which == 0) {
    const double nominal = on_object ? setup.object().body.mass : model.joints()[link].body.mass;
    const double factor = 1.0 + std::abs(draw->Size(0.01, 0.2));
    One one = MakeOne("body", place, "mass", factor * nominal, (factor - 1.0) * nominal);
    one.fault.engine = [body, factor](const Setup&, mjModel* m) {
      m->body_mass[FindId(*m, mjOBJ_BODY, body)] *= factor;
    };
    return one;
  }
  const bool moment = which == 1;
  const double size =
      std::abs(draw->Size(on_object ? 1e-3 : 1e-2, on_object ? 0.1 : 2.0)) * (moment ? 0.1 : 1.0);
  const bool burst = draw->Index(3) == 0;
  const double begin = burst ? draw->Uniform(0.0, 0.5 * duration) : 0.0;
  const double end = burst ? begin + 0.3 * duration : 1e9;
  const Vector3d direction = draw->Direction();
  One one = MakeOne("body", place, moment ? "moment" : "force at its centre of mass", size, size);
  one.fault.forces = [=](const mjModel& m, double t, mjData* d) {
    mjtNum* const wrench = d->xfrc_applied + 6 * FindId(m, mjOBJ_BODY, body) + (moment ? 3 : 0);
    for (int k = 0; k < 3 && begin <= t && t < end; ++k) wrench[k] += size * direction[k];
  };
  return one;
}

/// Another radius of one wheel or both, or another distance, from before the robot settles.
One DrawWheels(const Setup& setup, Draw* draw) {
  const Base& base = setup.model().base();
  const size_t which = draw->Index(4);
  const double change = draw->Size(2e-4, 2e-3) * (which == 3 ? 5.0 * base.wheel_distance : base.wheel_radius);
  One one = which < 2
                ? MakeOne("wheels", "wheel " + (which == 0 ? base.wheel_joint_right : base.wheel_joint_left),
                          "radius", base.wheel_radius + change, change)
            : which == 2 ? MakeOne("wheels", "wheels", "radius", base.wheel_radius + change, change)
                         : MakeOne("wheels", "wheels", "distance", base.wheel_distance + change, change);
  one.fault.from_start = true;
  one.fault.engine = [which, change](const Setup& own, mjModel* m) {
    if (which == 3) MoveWheels(own, m, change);
    for (const size_t wheel : {size_t{0}, size_t{1}})
      if (which == wheel || which == 2) ScaleWheel(own, m, wheel, change);
  };
  return one;
}

One DrawWorld(Draw* draw) {
  const double slope = std::abs(draw->Size(0.02, 0.3));
  const double heading = draw->Uniform(0.0, 2.0 * kPi);
  One one = MakeOne("world", "world", "slope", slope, slope);
  one.fault.engine = [=](const Setup&, mjModel* m) {
    const double g = mju_norm3(m->opt.gravity), angle = DegToRad(slope);
    m->opt.gravity[0] = g * std::sin(angle) * std::cos(heading);
    m->opt.gravity[1] = g * std::sin(angle) * std::sin(heading);
    m->opt.gravity[2] = -g * std::cos(angle);
  };
  return one;
}

One DrawOne(const Setup& setup, Draw* draw, const DrawOptions& options) {
  const double duration = options.duration;
  const bool rolls = setup.model().base().type == BaseType::kDifferentialDrive;
  switch (draw->Index(rolls ? 14 : 13)) {
    case 0:
    case 1:
    case 2:
    case 3:
      return DrawMotor(setup, draw, options);
    case 4:
    case 5:
    case 6:
      return DrawSensor(setup, draw, duration);
    case 7:
    case 8:
      return DrawJoint(setup, draw);
    case 12:
      return DrawWorld(draw);
    case 13:
      return DrawWheels(setup, draw);
    default:
      return DrawBody(setup, draw, duration);
  }
}

/// Both at once.
template <typename Function>
Function Join(Function a, Function b, Function both) {
  return !a ? b : !b ? a : both;
}

void Join(const PlantFault& more, PlantFault* fault) {
  const PlantFault first = *fault;
  fault->name += "; " + more.name;
  fault->kind += " + " + more.kind;
  fault->from_start = first.from_start || more.from_start;
  fault->engine = Join(first.engine, more.engine, decltype(first.engine)([=](const Setup& setup, mjModel* m) {
                         first.engine(setup, m);
                         more.engine(setup, m);
                       }));
  fault->forces =
      Join(first.forces, more.forces, decltype(first.forces)([=](const mjModel& m, double t, mjData* d) {
             first.forces(m, t, d);
             more.forces(m, t, d);
           }));
  fault->motors =
      Join(first.motors, more.motors, decltype(first.motors)([=](const Setup& setup) -> MotorFault {
             return [a = first.motors(setup), b = more.motors(setup)](double t, VectorXd* tau) {
               a(t, tau);
               b(t, tau);
             };
           }));
  fault->sensors =
      Join(first.sensors, more.sensors, decltype(first.sensors)([=](const Setup& setup) -> SensorFault {
             return [a = first.sensors(setup), b = more.sensors(setup)](double t, MeasuredState* told) {
               a(t, told);
               b(t, told);
             };
           }));
}

}  // namespace

std::vector<DrawnFaults> DrawFaults(const Setup& setup, const DrawOptions& options) {
  std::vector<DrawnFaults> drawn;
  for (size_t i = 0; i < options.count; ++i) {
    Draw draw(options.seed * 1000003 + i);
    DrawnFaults& faults = drawn.emplace_back();
    while (faults.truth.size() < options.together) {
      const One one = DrawOne(setup, &draw, options);
      // One place has one fault.
      const bool taken = std::any_of(faults.truth.begin(), faults.truth.end(),
                                     [&](const Fault& other) { return other.place == one.truth.place; });
      if (taken) continue;
      if (faults.truth.empty()) {
        faults.fault = one.fault;
      } else {
        Join(one.fault, &faults.fault);
      }
      faults.each.push_back(one.fault);
      faults.truth.push_back(one.truth);
    }
  }
  return drawn;
}

NamingScore ScoreNames(const std::vector<Fault>& truth, const std::vector<Fault>& all, const Causes& causes) {
  constexpr double kNear = 0.05;
  NamingScore score;
  for (const Fault& one : truth) {
    bool right = false, in_class = false;
    for (const Explanation& explanation : causes) {
      if (explanation.outcome == CauseOutcome::kNotExplained) continue;
      const Fault& first = explanation.faults.front();
      right = right || (explanation.outcome == CauseOutcome::kNamed && one.IsLike(first) &&
                        std::isfinite(first.error) &&
                        std::abs(first.value - one.value) <= std::max(kNear * one.error, 3.0 * first.error));
      in_class = in_class || ((explanation.outcome == CauseOutcome::kNamedClass || std::isinf(first.error)) &&
                              std::any_of(explanation.faults.begin(), explanation.faults.end(),
                                          [&](const Fault& fault) { return one.IsLike(fault); }));
    }
    ++(right ? score.right : in_class ? score.in_class : score.not_explained);
  }
  for (const Explanation& explanation : causes) {
    if (explanation.outcome != CauseOutcome::kNamed) continue;
    const Fault& first = explanation.faults.front();
    const auto of = std::find_if(all.begin(), all.end(), [&](const Fault& one) { return one.IsLike(first); });
    if (of == all.end() || std::abs(first.value - of->value) > std::max(kNear * of->error, 3.0 * first.error))
      ++score.wrong;
  }
  return score;
}

}  // namespace dexcheck
