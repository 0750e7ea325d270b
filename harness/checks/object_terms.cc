// The object's terms of (8) and (19) against the engine's free body, and the table as a whole.

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "controller/common/text.h"
#include "controller/object/object_dynamics.h"
#include "harness/checks/object_rates.h"
#include "harness/checks/term_table.h"

namespace dexcheck {
namespace {

using C = TermContext;
using N = Eigen::Ref<Eigen::ArrayXd>;

// Three rotations and the engine's normalised quaternion, of a few roundings each; products of two such
// factors.
constexpr double kObjectErrors = 128.0;

// Least rate of the object that errors of velocities are relative to, m/s and rad/s.
constexpr double kLeastRate = 1e-3;

template <size_t kCount>
std::vector<TermItem> List(const C&) {
  return {{0, std::vector(kCount, Location{Location::Kind::kObject, -1, -1})}};
}

/// A member of ObjectValues.
template <auto kMember>
void CopyMember(const ObjectValues& values, N out) {
  if constexpr (std::is_same_v<decltype(kMember), double ObjectValues::*>) {
    out[0] = values.*kMember;
  } else {
    out = (values.*kMember).reshaped().array();
  }
}
template <auto kMember>
void Model(const C& c, int, N out) {
  CopyMember<kMember>(c.object_model, out);
}
template <auto kMember>
void Engine(const C& c, int, N out) {
  CopyMember<kMember>(c.object_engine, out);
}

void WeighInertia(const C& c, int, N weight) {
  for (Eigen::Index i = 0; i < 36; ++i)
    weight[i] = 1.0 / (i % 6 < 3 ? c.object_scales.mass : c.object_scales.inertia);
}
/// Moments are sums of forces times world coordinates, which cancel to the moment about the centre of mass.
void WeighWrench(const C& c, double force, N weight) {
  weight.head<3>().setConstant(1.0 / force);
  weight.tail<3>().setConstant(1.0 / (force * c.object_scales.place));
}
void WeighCoriolis(const C& c, int, N weight) {
  WeighWrench(c, c.object_scales.mass * c.object_scales.rate * c.object_scales.rate, weight);
}

using V = ObjectValues;
constexpr TermGroup kBody = TermGroup::kObject;
constexpr TermGroup kCoordinates = TermGroup::kObjectCoordinates;
constexpr unsigned kBoth = kAskedByRun | kAskedByConsistency;

constexpr TermEntry kTerms[] = {
    {"object_pose", "object_pose", "^B T_o", "(8)", kCoordinates, kBoth, 1.0, List<12>, Model<&V::pose>,
     Engine<&V::pose>,
     [](const C& c, int, N weight) { weight.tail<3>().setConstant(1.0 / c.object_scales.place); }},
    {"V_Bo", "P_inv", "V^o_Bo = P^-1 X_o_dot", "(8)", kCoordinates, kBoth, 1.0, List<6>, Model<&V::V_Bo>,
     Engine<&V::V_Bo>, [](const C& c, int, N weight) { weight.setConstant(1.0 / c.object_scales.rate); }},
    {"M_hat", "M_hat", "M_hat", "(19)", kBody, kAskedByRun, 1.0, List<36>, Model<&V::M_hat>,
     Engine<&V::M_hat>, WeighInertia},
    {"C_hat_V", "C_hat_V", "C_hat V_Bo", "(19)", kBody, kAskedByRun, 1.0, List<6>, Model<&V::C_hat_V>,
     Engine<&V::C_hat_V>, WeighCoriolis},
    {"N_o", "N_o", "N_o", "(19)", kBody, kBoth, 1.0, List<6>, Model<&V::N_o>, Engine<&V::N_o>,
     [](const C& c, int, N weight) { WeighWrench(c, c.object_scales.weight, weight); }},
    {"object_kinetic_energy", "object_kinetic_energy", "V_Bo^T M_hat V_Bo / 2", "(19)", kBody, kBoth, 1.0,
     List<1>, Model<&V::kinetic>, Engine<&V::kinetic>,
     [](const C& c, int, N weight) {
       const ObjectScales& s = c.object_scales;
       weight.setConstant(1.0 / ((s.mass + s.inertia) * s.rate * s.rate));
     }},
    {"object_potential_energy", "object_potential_energy", "-", "(19)", kBody, kAskedByRun, 1.0, List<1>,
     Model<&V::potential>, Engine<&V::potential>,
     [](const C& c, int, N weight) {
       weight.setConstant(1.0 / (c.object_scales.weight * c.object_scales.place));
     }},
    {"M_o", "M_o", "M_o", "(19)", kCoordinates, kBoth, 1.0, List<36>, Model<&V::M_o>, Engine<&V::M_o>,
     WeighInertia},
    {"C_o_X_o_dot", "C_o_X_o_dot", "C_o X_o_dot", "(19)", kCoordinates, kBoth, 1.0, List<6>,
     Model<&V::C_o_X_o_dot>, Engine<&V::C_o_X_o_dot>, WeighCoriolis},
};

}  // namespace

std::span<const TermEntry> ListObjectTerms() { return kTerms; }

void EvaluateObject(const MassProperties& body, const Vector3d& gravity, const ObjectCoordinates* coordinates,
                    TermContext* c) {
  const EngineTerms& engine = *c->engine;
  ObjectValues& values = c->object_engine;
  const Pose X = engine.ObjectPose();
  values.pose = X.matrix().topRows<3>();
  values.V_Bo = engine.ObjectVelocity();
  values.M_hat = engine.ObjectInertia();
  values.C_hat_V = engine.ObjectCoriolis();
  values.N_o = engine.ObjectGravity();
  values.kinetic = 0.5 * values.V_Bo.dot(values.M_hat * values.V_Bo);
  values.potential = (X.linear() * values.N_o.head<3>()).dot(X.translation());

  ObjectScales& scales = c->object_scales;
  scales.place = 1.0 + X.translation().norm();
  const Vector6d& V = c->object_model.V_Bo;
  scales.rate = std::max({V.head<3>().norm(), V.tail<3>().norm(), kLeastRate});
  scales.mass = body.mass;
  scales.inertia = body.inertia.trace();
  scales.weight = Positive(body.mass * gravity.norm());
  if (coordinates == nullptr) return;

  const Vector6d& X_o_dot = coordinates->X_o_dot;
  scales.rate = std::max(scales.rate, X_o_dot.tail<3>().cwiseAbs().sum());
  const ObjectRates rates = CalcObjectRates(coordinates->X_o, X_o_dot);
  values.M_o = values.M_hat * rates.P_inv;
  values.C_o_X_o_dot = values.C_hat_V + values.M_hat * rates.bias;
}

std::span<const TermEntry> ListTerms() {
  static const std::vector<TermEntry> kAll = [] {
    std::vector<TermEntry> all;
    for (const auto& part : {ListRobotTerms(), ListContactTerms(), ListObjectTerms()})
      all.insert(all.end(), part.begin(), part.end());
    return all;
  }();
  return kAll;
}

const TermEntry& FindTerm(std::string_view consistency_name) {
  for (const TermEntry& term : ListTerms()) {
    if (term.consistency_name == consistency_name) return term;
  }
  throw std::invalid_argument("no term " + Quote(std::string(consistency_name)));
}

double CalcBound(const TermEntry& term, int depth) {
  if (term.group == TermGroup::kRobot || term.group == TermGroup::kContact)
    return CalcRoundingBound(depth, term.factor);
  return term.factor * kObjectErrors * std::numeric_limits<double>::epsilon();
}

}  // namespace dexcheck
