// The robot's terms: geometry, mass matrix, forces, energies.

#include <algorithm>

#include "harness/checks/term_table.h"

namespace dexcheck {
namespace {

using C = TermContext;
using N = Eigen::Ref<Eigen::ArrayXd>;
using Items = std::vector<TermItem>;
using Kind = Location::Kind;
using BoolArray = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>;

constexpr unsigned kBoth = kAskedByRun | kAskedByConsistency;
constexpr unsigned kOnce = kAskedByConsistency;

const RobotModel& ModelOf(const C& c) { return c.adapter->model(); }
const Joint& JointOf(const C& c, int joint) { return ModelOf(c).joints()[static_cast<size_t>(joint)]; }
const LinkInWorld& EngineLink(const C& c, int link) { return c.links[static_cast<size_t>(link + 1)]; }
const MassProperties& BodyOf(const C& c, int link) {
  return link < 0 ? ModelOf(c).base_with_wheels() : JointOf(c, link).body;
}
const FrameJacobian& JacobianOf(const C& c, int i) { return c.jacobians[static_cast<size_t>(i)]; }
int FrameOf(const C& c, int i) { return c.frames[static_cast<size_t>(i)]; }
const std::vector<int>& ChainOf(const C& c, int i) { return c.engine->chain(FrameOf(c, i)); }
Matrix3d TurnedBack(const C& c, int i) { return c.engine->FramePose(FrameOf(c, i)).linear().transpose(); }

TermItem MakeItem(int index, size_t count, Location where) { return {index, std::vector(count, where)}; }

template <size_t kCount>
Items ListWhole(const C&) {
  return {MakeItem(0, kCount, {})};
}
Items ListVelocities(const C& c) {
  TermItem all{0, {}};
  for (int i = 0; i < c.engine->size(); ++i) all.where.push_back({Kind::kVelocity, i, -1});
  return {all};
}
/// Axes of a joint, columns of its frame's rotation: all of a ball joint, else the last.
int CountAxes(const C& c, int joint) { return CountVelocities(JointOf(c, joint).type); }
Items ListAxes(const C& c) {
  Items items;
  for (int i = 0; i < ModelOf(c).num_joints(); ++i) {
    const int place = JointOf(c, i).type == JointType::kPrismatic ? 0 : 3;
    items.push_back(MakeItem(i, static_cast<size_t>(3 * CountAxes(c, i) + place), {Kind::kJoint, i, -1}));
  }
  return items;
}
/// Links that move, the base as -1. @param massive only those with mass on either side.
Items ListLinks(const C& c, size_t count, bool massive) {
  Items items;
  const bool fixed = ModelOf(c).base().type == BaseType::kFixed;  // the world carries no mass
  for (int link = fixed ? 0 : -1; link < ModelOf(c).num_joints(); ++link) {
    if (massive && !(BodyOf(c, link).mass > 0.0 || EngineLink(c, link).mass > 0.0)) continue;
    items.push_back(MakeItem(link, count, {Kind::kLink, link, -1}));
  }
  return items;
}
Items ListFramePoses(const C& c) {
  Items items;
  for (int frame = 0; frame < static_cast<int>(ModelOf(c).frames().size()); ++frame)
    items.push_back(MakeItem(frame, 12, {Kind::kFrame, frame, -1}));
  return items;
}
Items ListFrames(const C& c, bool chains) {
  Items items;
  for (int i = 0; i < static_cast<int>(c.frames.size()); ++i)
    items.push_back(MakeItem(i, chains ? 6 * ChainOf(c, i).size() : 6, {Kind::kFrame, FrameOf(c, i), -1}));
  return items;
}

/// Rows of the angular part are pure numbers.
double ScaleJacobian(const C& c, Eigen::Index row, Eigen::Index col) {
  const double velocity = c.scales->CalcVelocityScale(static_cast<int>(col));
  return Positive(row < 3 ? velocity : velocity / c.scales->length());
}
std::vector<ZeroPattern> ListJacobianZeros(const C& c) {
  std::vector<ZeroPattern> zeros;
  for (int i = 0; i < static_cast<int>(c.frames.size()); ++i) {
    BoolArray may_differ = BoolArray::Constant(6, c.engine->size(), false);
    for (const int col : ChainOf(c, i)) may_differ.col(col) = true;
    zeros.emplace_back(may_differ);
  }
  return zeros;
}
void CheckJacobianZeros(const C& c, ComparedTerm* term) {
  for (size_t i = 0; i < c.frames.size(); ++i) {
    term->CheckZeros(
        i, *c.jacobians[i].J, [&](Eigen::Index row, Eigen::Index col) { return ScaleJacobian(c, row, col); },
        [&](Eigen::Index, Eigen::Index) {
          return Location{Kind::kFrame, c.frames[i], -1};
        },
        c.when);
  }
}

/// M of (16): its first rows are along the world's x, y and about z; the others are M_bar's. Of a floating
/// base there is no other choice: M is M_bar.
Items ListWholeMass(const C& c) {
  const int n = c.unreduced->size();
  const int shift = n - c.robot->size();
  TermItem all{0, {}};
  for (int col = 0; col < n; ++col) {
    for (int row = 0; row < n; ++row)
      all.where.push_back({Kind::kVelocityPair, std::max(row - shift, 0), std::max(col - shift, 0)});
  }
  return {all};
}
void WeighWholeMass(const C& c, int, N weight) {
  const int n = c.unreduced->size();
  const int shift = n - c.robot->size();
  // Rows that M_bar does not have.
  const int base = shift > 0 ? ModelOf(c).num_unreduced_base_velocities() : 0;
  const RoundingScales& scales = *c.scales;
  const auto velocity = [&](int i) {
    return i < base ? (i < 2 ? 1.0 : scales.length()) : scales.CalcVelocityScale(i - shift);
  };
  const auto mass = [&](int i) {
    return i < base ? Positive(scales.total_mass()) : scales.GetSubtreeMass(i - shift);
  };
  for (int i = 0; i < n * n; ++i) {
    weight[i] = 1.0 / Positive(std::min(mass(i % n), mass(i / n)) * velocity(i % n) * velocity(i / n));
  }
}

/// M_bar: the entries that the engine's tree has.
Items ListMassEntries(const C& c) {
  TermItem all{0, {}};
  for (const MassEntry& entry : c.engine->mass_entries())
    all.where.push_back({Kind::kVelocityPair, entry.row, entry.col});
  return {all};
}
void ModelMass(const C& c, int, N out) {
  const double* const M = c.robot->M().data();
  const Eigen::Index n = c.robot->size();
  double* number = out.data();
  for (const MassEntry& entry : c.engine->mass_entries()) *number++ = M[entry.col * n + entry.row];
}
void WeighMass(const C& c, int, N weight) {
  double* number = weight.data();
  for (const MassEntry& entry : c.engine->mass_entries())
    *number++ = 1.0 / c.scales->CalcMassScale(entry.row, entry.col);
}
std::vector<ZeroPattern> ListMassZeros(const C& c) {
  BoolArray may_differ = BoolArray::Constant(c.engine->size(), c.engine->size(), false);
  for (const MassEntry& entry : c.engine->mass_entries()) may_differ(entry.row, entry.col) = true;
  return {ZeroPattern(may_differ)};
}
void CheckMassZeros(const C& c, ComparedTerm* term) {
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

/// A number, or a vector, of EnergyAndMomentum.
template <auto kMember>
void ModelEnergy(const C& c, int, N out) {
  out = Eigen::Map<const Eigen::ArrayXd>(reinterpret_cast<const double*>(&(c.energy.*kMember)), out.size());
}
template <auto kMember>
void EngineEnergy(const C& c, int, N out) {
  const EnergyAndMomentum& energy = c.engine->energy_and_momentum();
  out = Eigen::Map<const Eigen::ArrayXd>(reinterpret_cast<const double*>(&(energy.*kMember)), out.size());
}

using E = EnergyAndMomentum;
constexpr TermGroup kRobot = TermGroup::kRobot;

// From the base outward and from geometry to dynamics, so that the first failure is the one that the others
// follow from. C_bar is the last that reads the engine's velocities.
constexpr TermEntry kTerms[] =
    {
        // Direction, and the foot of the perpendicular from the engine's anchor: where along the axis that
        // stands is
        // a choice of frames.
        {"joint_axis", "joint_axis", "z_i", "(3), (4)", kRobot, kOnce, 1.0, ListAxes,
         [](const C& c, int joint, N out) {
           const Pose X = c.robot->CalcLinkPose(joint);
           if (out.size() == 12) {
             Eigen::Map<Matrix3d>(out.data()) = X.linear();
             out.tail<3>() = X.translation();
             return;
           }
           const Vector3d axis = X.linear().col(2);
           out.head<3>() = axis;
           if (out.size() == 3) return;
           out.tail<3>() = X.translation() + axis.dot(c.engine->JointAnchor(joint) - X.translation()) * axis;
         },
         [](const C& c, int joint, N out) {
           for (int k = 0; k < CountAxes(c, joint); ++k)
             out.segment<3>(3 * k) = c.engine->JointAxis(joint, k);
           if (out.size() > 3) out.tail<3>() = c.engine->JointAnchor(joint);
         },
         [](const C& c, int, N weight) {
           if (weight.size() > 3) weight.tail<3>().setConstant(1.0 / c.scales->world_length());
         }},
        {"link_com", "link_com", "r_i", "(5)", kRobot, kOnce, 1.0,
         [](const C& c) { return ListLinks(c, 3, /*massive=*/true); },
         [](const C& c, int link, N out) {
           out = (c.robot->CalcLinkPose(link) * BodyOf(c, link).com).array();
         },
         [](const C& c, int link, N out) { out = EngineLink(c, link).com.array(); },
         [](const C& c, int, N weight) { weight.setConstant(1.0 / c.scales->world_length()); }},
        {"link_inertia", "link_inertia", "I_i", "(16)", kRobot, kOnce, 2.0,
         [](const C& c) { return ListLinks(c, 9, /*massive=*/false); },
         [](const C& c, int link, N out) {
           const Matrix3d R = c.robot->CalcLinkPose(link).linear();
           Eigen::Map<Matrix3d>(out.data()) = R * BodyOf(c, link).inertia * R.transpose();
         },
         [](const C& c, int link, N out) { Eigen::Map<Matrix3d>(out.data()) = EngineLink(c, link).inertia; },
         [](const C& c, int link, N weight) {
           const MassProperties& body = BodyOf(c, link);
           weight.setConstant(1.0 / CalcInertiaScale(body.mass, body.inertia, EngineLink(c, link).inertia));
         }},
        {"frame_pose", "frame_pose", "^B T_f", "(5)", kRobot, kBoth, 1.0, ListFramePoses,
         [](const C& c, int frame, N out) {
           Eigen::Map<Matrix34d>(out.data()) = c.robot->CalcFramePose(frame).matrix().topRows<3>();
         },
         [](const C& c, int frame, N out) {
           Eigen::Map<Matrix34d>(out.data()) = c.engine->FramePose(frame).matrix().topRows<3>();
         },
         [](const C& c, int, N weight) { weight.tail<3>().setConstant(1.0 / c.scales->world_length()); }},
        // The columns of each frame's chain, in the frame's own axes.
        {"J", "J", "J_f", "(6), (28), (34)", kRobot, kBoth, 1.0,
         [](const C& c) { return ListFrames(c, true); },
         [](const C& c, int i, N out) {
           Eigen::Index k = 0;
           for (const int col : ChainOf(c, i)) {
             out.segment<6>(k) = JacobianOf(c, i).J->col(col);
             k += 6;
           }
         },
         [](const C& c, int i, N out) {
           const Matrix6Xd& columns = c.columns[static_cast<size_t>(i)];
           const Matrix3d R_T = TurnedBack(c, i);
           for (Eigen::Index col = 0; col < columns.cols(); ++col) {
             out.segment<3>(6 * col) = R_T * columns.col(col).head<3>();
             out.segment<3>(6 * col + 3) = R_T * columns.col(col).tail<3>();
           }
         },
         [](const C& c, int i, N weight) {
           double* number = weight.data();
           for (const int col : ChainOf(c, i)) {
             for (int row = 0; row < 6; ++row) *number++ = 1.0 / ScaleJacobian(c, row, col);
           }
         },
         Weighed::kOnce, ListJacobianZeros, CheckJacobianZeros},
        // Acceleration of the frame's origin at constant xi, in its own axes.
        {"J_dot_xi", "J_dot_xi", "d/dt J_f xi", "(46)", kRobot, kBoth, 3.0,
         [](const C& c) { return ListFrames(c, false); },
         [](const C& c, int i, N out) {
           Vector6d V = Vector6d::Zero();
           Vector6d A = Vector6d::Zero();
           for (const int col : ChainOf(c, i)) {
             V += JacobianOf(c, i).J->col(col) * c.xi[col];
             A += JacobianOf(c, i).J_dot->col(col) * c.xi[col];
           }
           // Of the axes' own turn: R^T d/dt (R v) = v_dot + omega x v; omega x omega = 0.
           A.head<3>() += V.tail<3>().cross(V.head<3>());
           out = A.array();
         },
         [](const C& c, int i, N out) {
           const EngineMotion motion = c.engine->FrameMotion(FrameOf(c, i));
           const Matrix3d R_T = TurnedBack(c, i);
           out.head<3>() = R_T * motion.a;
           out.tail<3>() = R_T * motion.alpha;
         },
         [](const C& c, int, N weight) {
           const double rate = c.scales->angular_rate();
           weight.head<3>().setConstant(1.0 / Positive(c.scales->acceleration()));
           weight.tail<3>().setConstant(1.0 / Positive(rate * rate));
         }},
        {"M", "M", "M", "(16)", kRobot, kOnce, 2.0, ListWholeMass,
         [](const C& c, int, N out) { out = c.unreduced->M().reshaped().array(); },
         [](const C& c, int, N out) { out = c.engine_unreduced->M().reshaped().array(); }, WeighWholeMass,
         Weighed::kOnce},
        {"M_bar", "M_bar", "M_bar'", "(18), (42)", kRobot, kBoth, 2.0, ListMassEntries, ModelMass,
         [](const C& c, int, N out) { out = c.engine->mass().array(); }, WeighMass, Weighed::kOnce,
         ListMassZeros, CheckMassZeros},
        {"C_bar_xi", "C_bar_xi", "C_bar' xi", "(18), (42)", kRobot, kBoth, 4.0, ListVelocities,
         [](const C& c, int, N out) { out.matrix().noalias() = c.robot->C() * c.xi; },
         [](const C& c, int, N out) { out = c.engine->coriolis().array(); },
         [](const C& c, int, N weight) {
           for (int i = 0; i < weight.size(); ++i) weight[i] = 1.0 / c.scales->CalcCoriolisScale(i);
         }},
        // Every entry at once, by its action on a second velocity w. The engine has quarters of the forces at
        // xi + w
        // and xi - w: |xi +- w|^2 / 4 is at most (|xi|^2 + |w|^2) / 2, twice.
        {"C_bar", "C_bar", "C_bar'", "(18), (42)", kRobot, kOnce, 4.0, ListVelocities,
         [](const C& c, int, N out) { out.matrix().noalias() = c.robot->C() * c.w; },
         [](const C& c, int, N out) { c.engine->CalcCoriolisProduct(c.xi, c.w, out.matrix()); },
         [](const C& c, int, N weight) {
           for (int i = 0; i < weight.size(); ++i)
             weight[i] = 1.0 / (c.scales->CalcCoriolisScale(i) + c.scales_at_w->CalcCoriolisScale(i));
         }},
        {"gravity", "gravity", "F_bar'", "(18), (42)", kRobot, kBoth, 1.0, ListVelocities,
         [](const C& c, int, N out) { out = c.robot->gravity().array(); },
         [](const C& c, int, N out) { out = c.engine->gravity().array(); },
         [](const C& c, int, N weight) {
           for (int i = 0; i < weight.size(); ++i) weight[i] = 1.0 / c.scales->CalcGravityScale(i);
         },
         Weighed::kOnce},
        {"friction", "friction", "F_bar'", "(18), (42)", kRobot, kBoth, 2.0, ListVelocities,
         [](const C& c, int, N out) { out = c.robot->friction().array(); },
         [](const C& c, int, N out) { out = c.engine->friction().array(); },
         [](const C& c, int, N weight) {
           for (int i = 0; i < weight.size(); ++i) weight[i] = 1.0 / c.scales->CalcFrictionScale(i, c.xi);
         }},
        {"kinetic_energy", "kinetic_energy", "xi^T M_bar' xi / 2", "(16)", kRobot, kBoth, 2.0, ListWhole<1>,
         ModelEnergy<&E::kinetic>, EngineEnergy<&E::kinetic>,
         [](const C& c, int, N weight) { weight.setConstant(1.0 / c.scales->CalcKineticEnergyScale()); }},
        {"potential_energy", "potential_energy", "-", "(16)", kRobot, kBoth, 1.0, ListWhole<1>,
         ModelEnergy<&E::potential>, EngineEnergy<&E::potential>,
         [](const C& c, int, N weight) { weight.setConstant(1.0 / c.scales->CalcPotentialEnergyScale()); }},
        {"linear_momentum", "linear_momentum", "-", "(16)", kRobot, kBoth, 1.0, ListWhole<3>,
         ModelEnergy<&E::linear_momentum>, EngineEnergy<&E::linear_momentum>,
         [](const C& c, int,
            N weight) { weight.setConstant(1.0 / Positive(c.scales->CalcMomentumScale())); }},
        {"angular_momentum", "angular_momentum", "-", "(16)", kRobot, kBoth, 2.0, ListWhole<3>,
         ModelEnergy<&E::angular_momentum>, EngineEnergy<&E::angular_momentum>,
         [](const C& c, int, N weight) {
           weight.setConstant(1.0 / Positive(c.scales->CalcMomentumScale() * c.scales->length()));
         }},
};

}  // namespace

std::span<const TermEntry> ListRobotTerms() { return kTerms; }

}  // namespace dexcheck
