// Floors, wheels and contacts that are not as they are described, and a solver that stops too soon.

#include <cmath>

#include "harness/engine/engine.h"
#include "harness/injection/fault_kinds.h"

namespace dexcheck {
namespace world_faults {
namespace {

InjectedFault Slope(const FaultContext& context) {
  const double slope = context.draw->Positive(0.02, 0.3);  // degrees
  const double heading = context.draw->Uniform(0.0, 2.0 * kPi);
  InjectedFault fault = FaultAt("world", "slope", slope, slope);
  fault.cause = Cause::kSlope;
  fault.engine = [=](const Setup&, mjModel* m) {
    const double g = mju_norm3(m->opt.gravity), angle = DegToRad(slope);
    m->opt.gravity[0] = g * std::sin(angle) * std::cos(heading);
    m->opt.gravity[1] = g * std::sin(angle) * std::sin(heading);
    m->opt.gravity[2] = -g * std::cos(angle);
  };
  return fault;
}

InjectedFault Gravity(const FaultContext& context) {
  const double factor = 1.0 + context.draw->Size(3e-4, 3e-2);
  const double change = std::abs(factor - 1.0) * mju_norm3(context.setup.engine().opt.gravity);
  InjectedFault fault = FaultAt("world", "gravity off by", change, change);
  fault.engine = [=](const Setup&, mjModel* m) { mju_scl3(m->opt.gravity, m->opt.gravity, factor); };
  return fault;
}

// Wheels, from before the robot settles.

/// Enlarges the radius of what touches the floor of a wheel, 0 the right one or 1, by `by`, m.
void ScaleWheel(const Setup& setup, mjModel* m, size_t wheel, double by) {
  const int body = m->jnt_bodyid[setup.adapter().wheels()[wheel].joint];
  for (int i = 0; i < m->body_geomnum[body]; ++i) {
    const int geom = m->body_geomadr[body] + i;
    if (!CanTouch(*m, geom)) continue;
    m->geom_size[3 * geom] += by;
    m->geom_rbound[geom] += by;
  }
  // The floor stays where it is touched.
  m->body_pos[3 * body + 2] += by;
}

template <bool right, bool left>
InjectedFault Wheels(const FaultContext& context) {
  const Base& base = context.model().base();
  const std::string place =
      right && left ? "wheels" : "wheel " + (right ? base.wheel_joint_right : base.wheel_joint_left);
  const double radius = base.wheel_radius;
  const double change = context.draw->Size(2e-4, 2e-3) * radius;
  InjectedFault fault = FaultAt(place, "radius", radius + change, change);
  fault.cause = Cause::kWheelGeometry;
  fault.from_start = true;
  fault.engine = [=](const Setup& setup, mjModel* m) {
    if (right) ScaleWheel(setup, m, 0, change);
    if (left) ScaleWheel(setup, m, 1, change);
  };
  return fault;
}

InjectedFault WheelDistance(const FaultContext& context) {
  const double distance = context.model().base().wheel_distance;
  const double change = context.draw->Size(1e-3, 1e-2) * distance;
  InjectedFault fault = FaultAt("wheels", "distance", distance + change, change);
  fault.cause = Cause::kWheelGeometry;
  fault.from_start = true;
  fault.engine = [change](const Setup& setup, mjModel* m) {
    for (const size_t wheel : {size_t{0}, size_t{1}}) {
      const int body = m->jnt_bodyid[setup.adapter().wheels()[wheel].joint];
      m->body_pos[3 * body + 1] += (wheel == 0 ? -0.5 : 0.5) * change;
    }
  };
  return fault;
}

// Contacts.

/// Contact pairs of the floor, or else of the object.
void ChangePairs(mjModel* m, bool floor, const std::function<void(int pair)>& change) {
  for (int pair = 0; pair < m->npair; ++pair) {
    const bool has_floor = m->geom_type[m->pair_geom1[pair]] == mjGEOM_PLANE ||
                           m->geom_type[m->pair_geom2[pair]] == mjGEOM_PLANE;
    if (has_floor == floor) change(pair);
  }
}

template <bool kOfFloor>
InjectedFault Slippery(const FaultContext& context) {
  const double mu = kOfFloor ? context.draw->Uniform(0.001, 0.003) : context.draw->Uniform(0.05, 0.1);
  InjectedFault fault = kOfFloor ? FaultAt("wheels slide", Cause::kWheelSlip)
                                 : FaultAt("fingertips slide", Cause::kFingertipSlip);
  fault.engine = [=](const Setup&, mjModel* m) {
    ChangePairs(m, kOfFloor,
                [&](int pair) { m->pair_friction[5 * pair] = m->pair_friction[5 * pair + 1] = mu; });
  };
  return fault;
}

InjectedFault SoftFingertips(const FaultContext& context) {
  InjectedFault fault = FaultAt("soft fingertips", Cause::kContactSoftness);
  const double time_constant = context.draw->Uniform(0.015, 0.03),
               impedance = context.draw->Uniform(0.88, 0.93);
  fault.engine = [=](const Setup&, mjModel* m) {
    ChangePairs(m, false, [&](int pair) {
      m->pair_solref[mjNREF * pair] = time_constant;
      m->pair_solimp[mjNIMP * pair] = m->pair_solimp[mjNIMP * pair + 1] = impedance;
    });
  };
  return fault;
}

InjectedFault Creep(const FaultContext&) {
  InjectedFault fault = FaultAt("contacts creep, impratio 1", Cause::kContactSoftness);
  fault.engine = [](const Setup&, mjModel* m) { m->opt.impratio = 1.0; };
  return fault;
}

/// A fingertip of another size, and what its spheres are bounded by.
InjectedFault FingertipRadius(const FaultContext& context) {
  const auto& tips = context.setup.fingertips();
  const int tip = tips[context.draw->Index(tips.size())];
  const std::string& name = context.model().frames()[static_cast<size_t>(tip)].name;
  const double factor = 1.0 + context.draw->Size(2e-3, 2e-2);
  const double radius = context.model().tip_radius(tip);
  InjectedFault fault = FaultAt("fingertip " + name, "radius", factor * radius, (factor - 1.0) * radius);
  fault.cause = Cause::kContactGeometry;
  fault.from_start = true;
  fault.engine = [=](const Setup& setup, mjModel* m) {
    const int site = setup.adapter().frame_sites()[static_cast<size_t>(tip)];
    const int body = m->site_bodyid[site];
    for (int i = 0; i < m->body_geomnum[body]; ++i) {
      const int geom = m->body_geomadr[body] + i;
      if (!CanTouch(*m, geom) || m->geom_type[geom] != mjGEOM_SPHERE) continue;
      m->geom_rbound[geom] *= factor;
      m->geom_size[3 * geom] *= factor;
    }
  };
  return fault;
}

InjectedFault Solver(const FaultContext&) {
  InjectedFault fault = FaultAt("solver: one conjugate gradient", Cause::kSolver);
  fault.engine = [](const Setup&, mjModel* m) {
    m->opt.solver = mjSOL_CG;
    m->opt.iterations = 1;
  };
  return fault;
}

bool Rolls(const FaultContext& context) { return context.rolls(); }
bool Touches(const FaultContext& context) { return context.holds() && context.setup.start().bonds.empty(); }

constexpr const char* kFloor = "floor";
constexpr const char* kWheels = "wheels";
constexpr const char* kContact = "contact";
constexpr FaultKind kKinds[] = {
    {kFloor, "slope", Slope},
    {kFloor, "gravity", Gravity},
    {kWheels, "radius of both", Wheels<true, true>, Rolls},
    {kWheels, "radius of the right one", Wheels<true, false>, Rolls},
    {kWheels, "radius of the left one", Wheels<false, true>, Rolls},
    {kWheels, "distance", WheelDistance, Rolls},
    {kContact, "wheels slide", Slippery<true>, Rolls},
    {kContact, "fingertips slide", Slippery<false>, Touches},
    {kContact, "soft fingertips", SoftFingertips, Touches},
    {kContact, "creep", Creep, Touches},
    {kContact, "fingertip's radius", FingertipRadius, Touches},
    {"solver", "iterations", Solver, Touches},
};

}  // namespace
}  // namespace world_faults

std::span<const FaultKind> ListWorldFaultKinds() { return world_faults::kKinds; }

}  // namespace dexcheck
