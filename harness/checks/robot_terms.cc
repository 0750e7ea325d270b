// The robot's terms: geometry, mass matrix, forces, energies.

#include <algorithm>

#include "harness/checks/term_table.h"

namespace dexcheck {
namespace {

using Numbers = Eigen::ArrayXd;
using Context = TermContext;
using Kind = Location::Kind;
using BoolArray = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>;
using Block34 = Eigen::Matrix<double, 3, 4>;

constexpr unsigned kBoth = kAskedByRun | kAskedByConsistency;
constexpr unsigned kOnce = kAskedByConsistency;

const RobotModel& ModelOf(const Context& c) { return c.adapter->model(); }

/// Calls visit(link) for the links that move, the base as -1.
template <typename Visit>
void ForEachLink(const Context& c, const Visit& visit) {
  const bool fixed = ModelOf(c).base().type == BaseType::kFixed;  // the world carries no mass
  for (int link = fixed ? 0 : -1; link < ModelOf(c).num_joints(); ++link) visit(link);
}

const MassProperties& BodyOf(const Context& c, int link) {
  return link < 0 ? ModelOf(c).base_with_wheels() : ModelOf(c).joints()[static_cast<size_t>(link)].body;
}

/// The same for those that carry mass on either side: without any there is no centre.
template <typename Visit>
void ForEachMass(const Context& c, const Visit& visit) {
  ForEachLink(c, [&](int link) {
    if (BodyOf(c, link).mass > 0.0 || c.links[static_cast<size_t>(link + 1)].mass > 0.0) visit(link);
  });
}

bool IsRevolute(const Context& c, int joint) {
  return ModelOf(c).joints()[static_cast<size_t>(joint)].type == JointType::kRevolute;
}

std::vector<Location> ListVelocities(const Context& c) {
  std::vector<Location> where;
  for (int i = 0; i < c.engine->size(); ++i) where.push_back({Kind::kVelocity, i, -1});
  return where;
}

std::vector<Location> ListOne(const Context&) { return {Location{}}; }
std::vector<Location> ListThree(const Context&) { return std::vector<Location>(3); }

/// Weights by the scale of each velocity coordinate.
template <typename Scale>
void SetWeights(Numbers& weight, const Scale& scale) {
  for (Eigen::Index i = 0; i < weight.size(); ++i) weight[i] = 1.0 / scale(static_cast<int>(i));
}

// joint_axis: direction, and the foot of the perpendicular from the engine's anchor, whose place along the
// axis is a choice of frames.

std::vector<Location> ListAxes(const Context& c) {
  std::vector<Location> where;
  for (int i = 0; i < ModelOf(c).num_joints(); ++i)
    where.insert(where.end(), IsRevolute(c, i) ? 6 : 3, {Kind::kJoint, i, -1});
  return where;
}
void ModelAxes(const Context& c, Numbers& out) {
  Eigen::Index k = 0;
  for (int i = 0; i < ModelOf(c).num_joints(); ++i) {
    const Pose X = c.robot->CalcLinkPose(i);
    const Vector3d axis = X.linear().col(2);
    out.segment<3>(k) = axis;
    k += 3;
    if (!IsRevolute(c, i)) continue;
    out.segment<3>(k) = X.translation() + axis.dot(c.engine->JointAnchor(i) - X.translation()) * axis;
    k += 3;
  }
}
void EngineAxes(const Context& c, Numbers& out) {
  Eigen::Index k = 0;
  for (int i = 0; i < ModelOf(c).num_joints(); ++i) {
    out.segment<3>(k) = c.engine->JointAxis(i);
    k += 3;
    if (!IsRevolute(c, i)) continue;
    out.segment<3>(k) = c.engine->JointAnchor(i);
    k += 3;
  }
}
void WeighAxes(const Context& c, Numbers& weight) {
  Eigen::Index k = 0;
  for (int i = 0; i < ModelOf(c).num_joints(); ++i) {
    k += 3;
    if (!IsRevolute(c, i)) continue;
    weight.segment<3>(k).setConstant(1.0 / c.scales->world_length());
    k += 3;
  }
}

std::vector<Location> ListMasses(const Context& c) {
  std::vector<Location> where;
  ForEachMass(c, [&](int link) { where.insert(where.end(), 3, {Kind::kLink, link, -1}); });
  return where;
}
void ModelCenters(const Context& c, Numbers& out) {
  Eigen::Index k = 0;
  ForEachMass(c, [&](int link) {
    out.segment<3>(k) = c.robot->CalcLinkPose(link) * BodyOf(c, link).com;
    k += 3;
  });
}
void EngineCenters(const Context& c, Numbers& out) {
  Eigen::Index k = 0;
  ForEachMass(c, [&](int link) {
    out.segment<3>(k) = c.links[static_cast<size_t>(link + 1)].com;
    k += 3;
  });
}
void WeighPlaces(const Context& c, Numbers& weight) { weight.setConstant(1.0 / c.scales->world_length()); }

std::vector<Location> ListInertias(const Context& c) {
  std::vector<Location> where;
  ForEachLink(c, [&](int link) { where.insert(where.end(), 9, {Kind::kLink, link, -1}); });
  return where;
}
void ModelInertias(const Context& c, Numbers& out) {
  Eigen::Index k = 0;
  ForEachLink(c, [&](int link) {
    const Matrix3d R = c.robot->CalcLinkPose(link).linear();
    Eigen::Map<Matrix3d>(out.data() + k) = R * BodyOf(c, link).inertia * R.transpose();
    k += 9;
  });
}
void EngineInertias(const Context& c, Numbers& out) {
  Eigen::Index k = 0;
  ForEachLink(c, [&](int link) {
    Eigen::Map<Matrix3d>(out.data() + k) = c.links[static_cast<size_t>(link + 1)].inertia;
    k += 9;
  });
}
void WeighInertias(const Context& c, Numbers& weight) {
  Eigen::Index k = 0;
  ForEachLink(c, [&](int link) {
    const double by_model = BodyOf(c, link).inertia.trace();
    const double by_engine = c.links[static_cast<size_t>(link + 1)].inertia.trace();
    weight.segment<9>(k).setConstant(1.0 / Positive(std::max(by_model, by_engine)));
    k += 9;
  });
}

std::vector<Location> ListFramePoses(const Context& c) {
  std::vector<Location> where;
  for (int frame = 0; frame < static_cast<int>(ModelOf(c).frames().size()); ++frame)
    where.insert(where.end(), 12, {Kind::kFrame, frame, -1});
  return where;
}
void ModelFramePoses(const Context& c, Numbers& out) {
  for (Eigen::Index k = 0; k < out.size(); k += 12)
    Eigen::Map<Block34>(out.data() + k) =
        c.robot->CalcFramePose(static_cast<int>(k / 12)).matrix().topRows<3>();
}
void EngineFramePoses(const Context& c, Numbers& out) {
  for (Eigen::Index k = 0; k < out.size(); k += 12)
    Eigen::Map<Block34>(out.data() + k) = c.engine->FramePose(static_cast<int>(k / 12)).matrix().topRows<3>();
}
void WeighFramePoses(const Context& c, Numbers& weight) {
  for (Eigen::Index k = 0; k < weight.size(); k += 12)
    weight.segment<3>(k + 9).setConstant(1.0 / c.scales->world_length());
}

// J: the columns of each frame's chain, in the frame's own axes.

std::vector<Location> ListJacobians(const Context& c) {
  std::vector<Location> where;
  for (const int frame : c.frames) {
    where.insert(where.end(), 6 * c.engine->chain(frame).size(), {Kind::kFrame, frame, -1});
  }
  return where;
}
void ModelJacobians(const Context& c, Numbers& out) {
  Eigen::Index k = 0;
  for (size_t i = 0; i < c.frames.size(); ++i) {
    for (const int col : c.engine->chain(c.frames[i])) {
      out.segment<6>(k) = c.jacobians[i].J->col(col);
      k += 6;
    }
  }
}
void EngineJacobians(const Context& c, Numbers& out) {
  Eigen::Index k = 0;
  for (size_t i = 0; i < c.frames.size(); ++i) {
    const Matrix3d R_T = c.engine->FramePose(c.frames[i]).linear().transpose();
    for (Eigen::Index col = 0; col < c.columns[i].cols(); ++col, k += 6) {
      out.segment<3>(k) = R_T * c.columns[i].col(col).head<3>();
      out.segment<3>(k + 3) = R_T * c.columns[i].col(col).tail<3>();
    }
  }
}
/// Rows of the angular part are pure numbers.
double ScaleJacobian(const Context& c, Eigen::Index row, Eigen::Index col) {
  const double velocity = c.scales->CalcVelocityScale(static_cast<int>(col));
  return row < 3 ? velocity : Positive(velocity / c.scales->length());
}
void WeighJacobians(const Context& c, Numbers& weight) {
  Eigen::Index k = 0;
  for (const int frame : c.frames) {
    for (const int col : c.engine->chain(frame)) {
      for (int row = 0; row < 6; ++row) weight[k++] = 1.0 / ScaleJacobian(c, row, col);
    }
  }
}
std::vector<ZeroPattern> ListJacobianZeros(const Context& c) {
  std::vector<ZeroPattern> zeros;
  for (const int frame : c.frames) {
    BoolArray may_differ = BoolArray::Constant(6, c.engine->size(), false);
    for (const int col : c.engine->chain(frame)) may_differ.col(col) = true;
    zeros.emplace_back(may_differ);
  }
  return zeros;
}
void CheckJacobianZeros(const Context& c, ComparedTerm* term) {
  for (size_t i = 0; i < c.frames.size(); ++i) {
    term->CheckZeros(
        i, *c.jacobians[i].J, [&](Eigen::Index row, Eigen::Index col) { return ScaleJacobian(c, row, col); },
        [&](Eigen::Index, Eigen::Index) {
          return Location{Kind::kFrame, c.frames[i], -1};
        },
        c.when);
  }
}

// J_dot_xi: acceleration of a frame's origin at constant xi, in its own axes.

std::vector<Location> ListAccelerations(const Context& c) {
  std::vector<Location> where;
  for (const int frame : c.frames) where.insert(where.end(), 6, {Kind::kFrame, frame, -1});
  return where;
}
void ModelAccelerations(const Context& c, Numbers& out) {
  for (size_t i = 0; i < c.frames.size(); ++i) {
    Vector6d V = Vector6d::Zero();
    Vector6d A = Vector6d::Zero();
    for (const int col : c.engine->chain(c.frames[i])) {
      V += c.jacobians[i].J->col(col) * c.xi[col];
      A += c.jacobians[i].J_dot->col(col) * c.xi[col];
    }
    // Of the axes' own turn: R^T d/dt (R v) = v_dot + omega x v; omega x omega = 0.
    A.head<3>() += V.tail<3>().cross(V.head<3>());
    out.segment<6>(6 * static_cast<Eigen::Index>(i)) = A;
  }
}
void EngineAccelerations(const Context& c, Numbers& out) {
  Eigen::Index k = 0;
  for (const int frame : c.frames) {
    const EngineMotion motion = c.engine->FrameMotion(frame);
    const Matrix3d R_T = c.engine->FramePose(frame).linear().transpose();
    out.segment<3>(k) = R_T * motion.a;
    out.segment<3>(k + 3) = R_T * motion.alpha;
    k += 6;
  }
}
void WeighAccelerations(const Context& c, Numbers& weight) {
  const double rate = c.scales->angular_rate();
  for (Eigen::Index k = 0; k < weight.size(); k += 6) {
    weight.segment<3>(k).setConstant(1.0 / Positive(c.scales->acceleration()));
    weight.segment<3>(k + 3).setConstant(1.0 / Positive(rate * rate));
  }
}

// M of (16): its first three rows are along the world's x, y and about z; the others are M_bar's.

std::vector<Location> ListWholeMass(const Context& c) {
  const int n = c.unreduced->size();
  const int shift = n - c.robot->size();
  std::vector<Location> where;
  for (int col = 0; col < n; ++col) {
    for (int row = 0; row < n; ++row)
      where.push_back({Kind::kVelocityPair, std::max(row - shift, 0), std::max(col - shift, 0)});
  }
  return where;
}
void ModelWholeMass(const Context& c, Numbers& out) { out = c.unreduced->M().reshaped(); }
void EngineWholeMass(const Context& c, Numbers& out) { out = c.engine_unreduced->M().reshaped(); }
void WeighWholeMass(const Context& c, Numbers& weight) {
  const int n = c.unreduced->size();
  const int shift = n - c.robot->size();
  const int base = ModelOf(c).num_base_positions();
  const RoundingScales& scales = *c.scales;
  const auto velocity = [&](int i) {
    return i < base ? (i < 2 ? 1.0 : scales.length()) : scales.CalcVelocityScale(i - shift);
  };
  const auto mass = [&](int i) {
    return i < base ? Positive(scales.total_mass()) : scales.GetSubtreeMass(i - shift);
  };
  for (int col = 0; col < n; ++col) {
    for (int row = 0; row < n; ++row) {
      weight[col * n + row] = 1.0 / Positive(std::min(mass(row), mass(col)) * velocity(row) * velocity(col));
    }
  }
}

// M_bar: the entries that the engine's tree has.

std::vector<Location> ListMassEntries(const Context& c) {
  std::vector<Location> where;
  for (const MassEntry& entry : c.engine->mass_entries())
    where.push_back({Kind::kVelocityPair, entry.row, entry.col});
  return where;
}
void ModelMass(const Context& c, Numbers& out) {
  const double* const M = c.robot->M().data();
  const Eigen::Index n = c.robot->size();
  double* number = out.data();
  for (const MassEntry& entry : c.engine->mass_entries()) *number++ = M[entry.col * n + entry.row];
}
void EngineMass(const Context& c, Numbers& out) { out = c.engine->mass(); }
void WeighMass(const Context& c, Numbers& weight) {
  double* number = weight.data();
  for (const MassEntry& entry : c.engine->mass_entries())
    *number++ = 1.0 / c.scales->CalcMassScale(entry.row, entry.col);
}
std::vector<ZeroPattern> ListMassZeros(const Context& c) {
  BoolArray may_differ = BoolArray::Constant(c.engine->size(), c.engine->size(), false);
  for (const MassEntry& entry : c.engine->mass_entries()) may_differ(entry.row, entry.col) = true;
  return {ZeroPattern(may_differ)};
}
void CheckMassZeros(const Context& c, ComparedTerm* term) {
  term->CheckZeros(
      0, c.robot->M(),
      [&](Eigen::Index row, Eigen::Index col) {
        return c.scales->CalcMassScale(static_cast<int>(row), static_cast<int>(col));
      },
      [](Eigen::Index row, Eigen::Index col) {
        return Location{Kind::kVelocityPair, static_cast<int>(row), static_cast<int>(col)};
      },
      c.when);
}

void ModelCoriolis(const Context& c, Numbers& out) { out.matrix().noalias() = c.robot->C() * c.xi; }
void EngineCoriolis(const Context& c, Numbers& out) { out = c.engine->coriolis(); }
void WeighCoriolis(const Context& c, Numbers& weight) {
  SetWeights(weight, [&](int i) { return c.scales->CalcCoriolisScale(i); });
}

// C_bar: every entry at once, by its action on a second velocity w. The engine has quarters of the forces at
// xi + w and xi - w: |xi +- w|^2 / 4 is at most (|xi|^2 + |w|^2) / 2, twice.
void ModelCoriolisMatrix(const Context& c, Numbers& out) { out.matrix().noalias() = c.robot->C() * c.w; }
void EngineCoriolisMatrix(const Context& c, Numbers& out) {
  c.engine->CalcCoriolisProduct(c.xi, c.w, out.matrix());
}
void WeighCoriolisMatrix(const Context& c, Numbers& weight) {
  SetWeights(weight,
             [&](int i) { return c.scales->CalcCoriolisScale(i) + c.scales_at_w->CalcCoriolisScale(i); });
}

void ModelGravity(const Context& c, Numbers& out) { out = c.robot->gravity(); }
void EngineGravity(const Context& c, Numbers& out) { out = c.engine->gravity(); }
void WeighGravity(const Context& c, Numbers& weight) {
  SetWeights(weight, [&](int i) { return c.scales->CalcGravityScale(i); });
}

void ModelFriction(const Context& c, Numbers& out) { out = c.robot->friction(); }
void EngineFriction(const Context& c, Numbers& out) { out = c.engine->friction(); }
void WeighFriction(const Context& c, Numbers& weight) {
  SetWeights(weight, [&](int i) { return c.scales->CalcFrictionScale(i, c.xi); });
}

/// A number of EnergyAndMomentum on either side.
template <double EnergyAndMomentum::*kEnergy>
void ModelEnergy(const Context& c, Numbers& out) {
  out[0] = c.energy.*kEnergy;
}
template <double EnergyAndMomentum::*kEnergy>
void EngineEnergy(const Context& c, Numbers& out) {
  out[0] = c.engine->energy_and_momentum().*kEnergy;
}
template <Vector3d EnergyAndMomentum::*kMomentum>
void ModelMomentum(const Context& c, Numbers& out) {
  out = (c.energy.*kMomentum).array();
}
template <Vector3d EnergyAndMomentum::*kMomentum>
void EngineMomentum(const Context& c, Numbers& out) {
  out = (c.engine->energy_and_momentum().*kMomentum).array();
}
void WeighKinetic(const Context& c, Numbers& weight) {
  weight.setConstant(1.0 / c.scales->CalcKineticEnergyScale());
}
void WeighPotential(const Context& c, Numbers& weight) {
  weight.setConstant(1.0 / c.scales->CalcPotentialEnergyScale());
}
void WeighMomentum(const Context& c, Numbers& weight) {
  weight.setConstant(1.0 / Positive(c.scales->CalcMomentumScale()));
}
void WeighAngularMomentum(const Context& c, Numbers& weight) {
  weight.setConstant(1.0 / Positive(c.scales->CalcMomentumScale() * c.scales->length()));
}

using E = EnergyAndMomentum;
constexpr TermGroup kGroup = TermGroup::kRobot;

// From the base outward and from geometry to dynamics, so that the first failure is the one that the others
// follow from. C_bar is the last that reads the engine's velocities.
constexpr TermEntry kTerms[] = {
    {"joint_axis", "joint_axis", "z_i", "(3), (4)", kGroup, kOnce, 1.0, ListAxes, ModelAxes, EngineAxes,
     WeighAxes},
    {"link_com", "link_com", "r_i", "(5)", kGroup, kOnce, 1.0, ListMasses, ModelCenters, EngineCenters,
     WeighPlaces},
    {"link_inertia", "link_inertia", "I_i", "(16)", kGroup, kOnce, 2.0, ListInertias, ModelInertias,
     EngineInertias, WeighInertias},
    {"frame_pose", "frame_pose", "^B T_f", "(5)", kGroup, kBoth, 1.0, ListFramePoses, ModelFramePoses,
     EngineFramePoses, WeighFramePoses},
    {"J", "J", "J_f", "(6), (28), (34)", kGroup, kBoth, 1.0, ListJacobians, ModelJacobians, EngineJacobians,
     WeighJacobians, Weighed::kOnce, ListJacobianZeros, CheckJacobianZeros},
    {"J_dot_xi", "J_dot_xi", "d/dt J_f xi", "(46)", kGroup, kBoth, 3.0, ListAccelerations, ModelAccelerations,
     EngineAccelerations, WeighAccelerations},
    {"M", "M", "M", "(16)", kGroup, kOnce, 2.0, ListWholeMass, ModelWholeMass, EngineWholeMass,
     WeighWholeMass, Weighed::kOnce},
    {"M_bar", "M_bar", "M_bar'", "(18), (42)", kGroup, kBoth, 2.0, ListMassEntries, ModelMass, EngineMass,
     WeighMass, Weighed::kOnce, ListMassZeros, CheckMassZeros},
    {"C_bar_xi", "C_bar_xi", "C_bar' xi", "(18), (42)", kGroup, kBoth, 4.0, ListVelocities, ModelCoriolis,
     EngineCoriolis, WeighCoriolis},
    {"C_bar", "C_bar", "C_bar'", "(18), (42)", kGroup, kOnce, 4.0, ListVelocities, ModelCoriolisMatrix,
     EngineCoriolisMatrix, WeighCoriolisMatrix},
    {"gravity", "gravity", "F_bar'", "(18), (42)", kGroup, kBoth, 1.0, ListVelocities, ModelGravity,
     EngineGravity, WeighGravity, Weighed::kOnce},
    {"friction", "friction", "F_bar'", "(18), (42)", kGroup, kBoth, 2.0, ListVelocities, ModelFriction,
     EngineFriction, WeighFriction},
    {"kinetic_energy", "kinetic_energy", "xi^T M_bar' xi / 2", "(16)", kGroup, kBoth, 2.0, ListOne,
     ModelEnergy<&E::kinetic>, EngineEnergy<&E::kinetic>, WeighKinetic},
    {"potential_energy", "potential_energy", "-", "(16)", kGroup, kBoth, 1.0, ListOne,
     ModelEnergy<&E::potential>, EngineEnergy<&E::potential>, WeighPotential},
    {"linear_momentum", "linear_momentum", "-", "(16)", kGroup, kBoth, 1.0, ListThree,
     ModelMomentum<&E::linear_momentum>, EngineMomentum<&E::linear_momentum>, WeighMomentum},
    {"angular_momentum", "angular_momentum", "-", "(16)", kGroup, kBoth, 2.0, ListThree,
     ModelMomentum<&E::angular_momentum>, EngineMomentum<&E::angular_momentum>, WeighAngularMomentum},
};

}  // namespace

std::span<const TermEntry> ListRobotTerms() { return kTerms; }

}  // namespace dexcheck
