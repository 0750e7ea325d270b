// Joints, links and objects that are not as they are described, and what pulls at them.

#include <cmath>
#include <limits>

#include "harness/injection/fault_kinds.h"

namespace dexcheck {
namespace body_faults {
namespace {

// Joints.

InjectedFault ChangeJoint(const Joint& joint, const char* name, double nominal, double more,
                          const std::function<void(mjModel*, int id, int dof)>& change) {
  InjectedFault fault = FaultAt("joint " + joint.name, name, nominal + more, more);
  fault.engine = [change, name = joint.name](const Setup&, mjModel* m) {
    const int id = FindId(*m, mjOBJ_JOINT, name);
    change(m, id, m->jnt_dofadr[id]);
  };
  return fault;
}

double DrawForce(const FaultContext& context) { return context.draw->Positive(2e-3, 0.1); }

/// More of a constant that a joint has.
template <double Joint::*constant, mjtNum* mjModel::*by_dof>
InjectedFault AddToJoint(const FaultContext& context) {
  const Joint& joint = context.DrawJoint();
  const double size = DrawForce(context);
  const char* const name = constant == &Joint::armature  ? "armature"
                           : constant == &Joint::damping ? "viscous friction"
                                                         : "dry friction";
  return ChangeJoint(joint, name, joint.*constant, size,
                     [=](mjModel* m, int, int dof) { (m->*by_dof)[dof] += size; });
}

InjectedFault Spring(const FaultContext& context) {
  const double size = DrawForce(context);
  const double relaxed = context.draw->Uniform(0.1, 0.5);
  return ChangeJoint(context.DrawJoint(), "spring", 0.0, size, [=](mjModel* m, int id, int) {
    m->jnt_stiffness[id] = size;
    m->qpos_spring[m->jnt_qposadr[id]] = relaxed;
  });
}

/// A range that ends a little before where the joint begins.
InjectedFault HiddenLimit(const FaultContext& context) {
  const Joint& joint = context.DrawJoint();
  InjectedFault fault =
      FaultAt("joint " + joint.name + ": a hidden limit", Cause::kUnmodelledForce, joint.name);
  const int row = context.model().num_base_positions() + context.model().FindJoint(joint.name);
  fault.engine = [q = context.setup.start().q[row], name = joint.name](const Setup&, mjModel* m) {
    constexpr double kBeyond = 0.0085, kRange = 1.6;  // rad or m
    const int id = FindId(*m, mjOBJ_JOINT, name);
    m->jnt_limited[id] = 1;
    m->jnt_range[2 * id] = q - kRange;
    m->jnt_range[2 * id + 1] = q - kBeyond;
    m->jnt_solref[mjNREF * id] = 0.2;
  };
  return fault;
}

/// A force or torque between the joint's body and the one that carries it.
void PushJoint(const mjModel& m, int joint, double size, mjData* d) {
  const int body = m.jnt_bodyid[joint], parent = m.body_parentid[body];
  const Vector3d push = size * Eigen::Map<const Vector3d>(d->xaxis + 3 * joint);
  const Vector3d arm =
      Eigen::Map<const Vector3d>(d->xipos + 3 * body) - Eigen::Map<const Vector3d>(d->xipos + 3 * parent);
  Vector6d wrench = Vector6d::Zero();
  wrench.segment<3>(m.jnt_type[joint] == mjJNT_SLIDE ? 0 : 3) = push;
  Eigen::Map<Vector6d>(d->xfrc_applied + 6 * body) += wrench;
  if (parent == 0) return;
  wrench.tail<3>() += arm.cross(wrench.head<3>());
  Eigen::Map<Vector6d>(d->xfrc_applied + 6 * parent) -= wrench;
}

/// A torque, or one that grows evenly from a time on.
template <bool kGrows>
InjectedFault Torque(const FaultContext& context) {
  const Joint& joint = context.DrawJoint();
  const double size = DrawForce(context) / (kGrows ? context.duration : 1.0);
  const double begin = kGrows ? context.draw->Uniform(0.0, 0.3 * context.duration) : 0.0;
  InjectedFault fault =
      FaultAt("joint " + joint.name, kGrows ? "torque that grows by" : "torque", size, size);
  fault.forces = [=, name = joint.name](const mjModel& m, double t, mjData* d) {
    PushJoint(m, FindId(m, mjOBJ_JOINT, name), kGrows ? size * std::max(0.0, t - begin) : size, d);
  };
  return fault;
}

// Links and object.

/// A body that the model has as one, too: the engine's may be one of several.
struct Body {
  std::string place, name;
  const MassProperties* mass;
  bool is_object;
};

Body ObjectBody(const FaultContext& context) {
  const std::string& name = context.setup.declared_object().name;
  return {"object " + name, name, &context.setup.declared_object().body, true};
}

Body DrawLink(const FaultContext& context) {
  std::vector<const Joint*> links;
  for (const Joint& joint : context.setup.declared_model().joints()) {
    if (!(joint.body.mass > 0.0)) continue;  // the links between several joints of one body have no other
    const int id = FindId(context.setup.engine(), mjOBJ_BODY, joint.link);
    constexpr double kSame = 1e-6;
    if (std::abs(context.setup.engine().body_mass[id] - joint.body.mass) <= kSame * joint.body.mass)
      links.push_back(&joint);
  }
  const Joint& link = *links[context.draw->Index(links.size())];
  return {"link " + link.link, link.link, &link.body, false};
}

Body DrawBody(const FaultContext& context) {
  return context.holds() && context.setup.has_object() && context.draw->Index(4) == 0 ? ObjectBody(context)
                                                                                      : DrawLink(context);
}

InjectedFault Mass(const FaultContext& context) {
  const Body body = DrawBody(context);
  const double factor = 1.0 + context.draw->Positive(0.01, 0.2);
  InjectedFault fault =
      FaultAt(body.place, "mass", factor * body.mass->mass, (factor - 1.0) * body.mass->mass);
  fault.engine = [name = body.name, factor](const Setup&, mjModel* m) {
    m->body_mass[FindId(*m, mjOBJ_BODY, name)] *= factor;
  };
  return fault;
}

InjectedFault CenterOfMass(const FaultContext& context) {
  const Body body = DrawLink(context);
  const double size = context.draw->Positive(1e-3, 2e-2);
  const Vector3d way = size * context.draw->Direction();
  InjectedFault fault = FaultAt(body.place, "centre of mass off by", size, size);
  fault.engine = [name = body.name, way](const Setup&, mjModel* m) {
    const int id = FindId(*m, mjOBJ_BODY, name);
    for (int k = 0; k < 3; ++k) m->body_ipos[3 * id + k] += way[k];
  };
  return fault;
}

InjectedFault Inertia(const FaultContext& context) {
  const Body body = ObjectBody(context);
  const double factor = 1.0 + context.draw->Positive(0.05, 1.0);
  const double change = (factor - 1.0) * ToEntries(body.mass->inertia).norm();
  InjectedFault fault = FaultAt(body.place, "inertia", change, change);
  fault.engine = [name = body.name, factor](const Setup&, mjModel* m) {
    const int id = FindId(*m, mjOBJ_BODY, name);
    for (int k = 0; k < 3; ++k) m->body_inertia[3 * id + k] *= factor;
  };
  return fault;
}

/// A force, or moment, on a body, all the time or for a while, in a drawn direction of the world.
template <bool is_moment, bool for_a_while>
InjectedFault Push(const FaultContext& context) {
  const double begin = for_a_while ? context.draw->Uniform(0.0, 0.5 * context.duration) : 0.0;
  const double end = for_a_while ? begin + 0.3 * context.duration : std::numeric_limits<double>::infinity();
  const Body body = DrawBody(context);
  const double size = context.draw->Positive(body.is_object ? 1e-3 : 1e-2, body.is_object ? 0.1 : 2.0) *
                      (is_moment ? 0.1 : 1.0);
  const Vector3d push = size * context.draw->Direction();
  InjectedFault fault = FaultAt(body.place, is_moment ? "moment" : "force at its centre of mass", size, size);
  fault.forces = [=, name = body.name](const mjModel& m, double t, mjData* d) {
    if (t < begin || t >= end) return;
    Eigen::Map<Vector3d>(d->xfrc_applied + 6 * FindId(m, mjOBJ_BODY, name) + (is_moment ? 3 : 0)) += push;
  };
  return fault;
}

/// A force that is as strong at the end of the run as others are.
InjectedFault GrowingForce(const FaultContext& context) {
  const Body body = DrawBody(context);
  const double begin = context.draw->Uniform(0.0, 0.3 * context.duration);
  const double rate =
      context.draw->Positive(body.is_object ? 1e-3 : 1e-2, body.is_object ? 0.1 : 2.0) / context.duration;
  const Vector3d growth = rate * context.draw->Direction();
  InjectedFault fault = FaultAt(body.place, "force at its centre of mass that grows by", rate, rate);
  fault.forces = [=, name = body.name](const mjModel& m, double t, mjData* d) {
    Eigen::Map<Vector3d>(d->xfrc_applied + 6 * FindId(m, mjOBJ_BODY, name)) +=
        std::max(0.0, t - begin) * growth;
  };
  return fault;
}

InjectedFault Tether(const FaultContext& context) {
  const Body body = ObjectBody(context);
  const double stiffness = context.draw->Positive(0.1, 2.0);
  const Vector3d fixed = context.setup.start().X_Bo.translation() + 0.12 * context.draw->Direction();
  InjectedFault fault = FaultAt(body.place, "tether", stiffness, stiffness);
  fault.forces = [=, name = body.name](const mjModel& m, double, mjData* d) {
    const int id = FindId(m, mjOBJ_BODY, name);
    Eigen::Map<Vector3d>(d->xfrc_applied + 6 * id) +=
        stiffness * (fixed - Eigen::Map<const Vector3d>(d->xpos + 3 * id));
  };
  return fault;
}

InjectedFault Drag(const FaultContext& context) {
  const Body body = ObjectBody(context);
  const double drag = context.draw->Positive(0.02, 0.5);
  InjectedFault fault = FaultAt(body.place, "drag", drag, drag);
  fault.forces = [=, name = body.name](const mjModel& m, double, mjData* d) {
    const int id = FindId(m, mjOBJ_BODY, name);
    Eigen::Map<Vector3d>(d->xfrc_applied + 6 * id) -=
        drag * Eigen::Map<const Vector3d>(d->qvel + m.jnt_dofadr[m.body_jntadr[id]]);
  };
  return fault;
}

bool HasObject(const FaultContext& context) { return context.holds() && context.setup.has_object(); }
/// Whether the object moves: still things have no inertia or drag that shows.
bool MovesObject(const FaultContext& context) {
  const std::unique_ptr<Trajectory> way = HasObject(context) ? context.setup.MakeTrajectory() : nullptr;
  return way != nullptr && way->Evaluate(0.5 * context.duration).X_d_dot.norm() > 1e-3;
}

constexpr const char* kJoint = "joint";
constexpr const char* kBody = "body";
constexpr FaultKind kKinds[] = {
    {kJoint, "armature", AddToJoint<&Joint::armature, &mjModel::dof_armature>},
    {kJoint, "viscous friction", AddToJoint<&Joint::damping, &mjModel::dof_damping>},
    {kJoint, "dry friction", AddToJoint<&Joint::dry_friction, &mjModel::dof_frictionloss>},
    {kJoint, "spring", Spring},
    {kJoint, "torque", Torque<false>},
    {kJoint, "hidden limit", HiddenLimit},
    {kJoint, "growing torque", Torque<true>},
    {kBody, "mass", Mass},
    {kBody, "centre of mass", CenterOfMass},
    {kBody, "inertia", Inertia, MovesObject},
    {kBody, "force", Push<false, false>},
    {kBody, "moment", Push<true, false>},
    {kBody, "force for a while", Push<false, true>},
    {kBody, "moment for a while", Push<true, true>},
    {kBody, "growing force", GrowingForce},
    {kBody, "tether", Tether, HasObject},
    {kBody, "drag", Drag, MovesObject},
};

}  // namespace
}  // namespace body_faults

std::span<const FaultKind> ListBodyFaultKinds() { return body_faults::kKinds; }

}  // namespace dexcheck
