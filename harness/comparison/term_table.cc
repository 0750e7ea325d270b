#include "harness/comparison/term_table.h"

#include <algorithm>
#include <limits>

#include "harness/base/worst.h"

namespace dexcheck {
namespace {

using C = ScaleContext;
using S = Eigen::Ref<MatrixXd>;
using P = TermParts;
using T = Term;
using Kind = Location::Kind;

constexpr double kNotCompared = std::numeric_limits<double>::infinity();

// Three rotations and the engine's normalised quaternion, of a few roundings each; products of two such
// factors.
constexpr double kObjectErrors = 128.0;

// Least rate of the object that errors of velocities are relative to, m/s and rad/s.
constexpr double kLeastRate = 1e-3;

int FirstLink(const RobotModel& model) { return model.base().type == BaseType::kFixed ? 0 : -1; }

/// Scales a vector over the velocities.
template <auto kScale>
void ScaleVelocities(const C& c, S scale) {
  for (int i = 0; i < scale.rows(); ++i) scale(i, 0) = (c.robot.*kScale)(i);
}
template <auto kScale>
void ScaleWhole(const C& c, S scale) {
  scale.setConstant(Positive((c.robot.*kScale)()));
}
void ScaleMass(const C& c, S scale) {
  for (int col = 0; col < scale.cols(); ++col)
    for (int row = 0; row < scale.rows(); ++row) scale(row, col) = c.robot.CalcMassScale(row, col);
}
void ScalePlaces(const C& c, S scale) { scale.bottomRows<3>().setConstant(c.robot.world_length()); }

/// M of (16): its first rows are along the world's x, y and about z; the others are M_bar's. Of a floating
/// base there is no other choice: M is M_bar.
void ScaleWholeMass(const C& c, S scale) {
  const auto shift = static_cast<int>(scale.rows()) - c.model->num_velocities();
  const int base = shift > 0 ? c.model->num_unreduced_base_velocities() : 0;  // rows that M_bar does not have
  const auto velocity = [&](int i) {
    return i < base ? (i < 2 ? 1.0 : c.robot.length()) : c.robot.CalcVelocityScale(i - shift);
  };
  const auto mass = [&](int i) {
    return i < base ? Positive(c.robot.total_mass()) : c.robot.GetSubtreeMass(i - shift);
  };
  for (int col = 0; col < scale.cols(); ++col)
    for (int row = 0; row < scale.rows(); ++row)
      scale(row, col) = Positive(std::min(mass(row), mass(col)) * velocity(row) * velocity(col));
}

const ContactScales& ContactOf(const C& c, Eigen::Index col) { return c.contacts[static_cast<size_t>(col)]; }
template <auto kScale>
void ScaleContacts(const C& c, S scale) {
  for (Eigen::Index col = 0; col < scale.cols(); ++col) scale.col(col).setConstant(ContactOf(c, col).*kScale);
}

void ScaleInertia(const C& c, S scale) {
  for (Eigen::Index i = 0; i < 36; ++i) scale(i, 0) = i % 6 < 3 ? c.object.mass : c.object.inertia;
}
/// Moments are sums of forces times world coordinates, which cancel to the moment about the centre of mass.
void ScaleWrench(const C& c, double force, S scale) {
  scale.topRows<3>().setConstant(force);
  scale.bottomRows<3>().setConstant(force * c.object.place);
}
void ScaleObjectCoriolis(const C& c, S scale) {
  ScaleWrench(c, c.object.mass * c.object.rate * c.object.rate, scale);
}

constexpr unsigned kRun = kAskedByRun;
constexpr unsigned kTwo = kAskedByConsistency;
constexpr unsigned kAll = kAskedByRun | kAskedByConsistency | kAskedOfPrograms;
constexpr unsigned kTip = kAskedByContacts;
using R = RoundingScales;

// From the base outward and from geometry to dynamics, so that the first failure is the one that the others
// follow from. C_bar is the last that reads the engine's velocities.
constexpr TermEntry kTerms[] = {
    // Direction, and the foot of the perpendicular from the second's point of the axis on the first's axis.
    {T::kJointAxis, "joint_axis", "z_i", "(3), (4)", P::kJoint, 6, kTwo, 1.0,
     [](const C& c, S scale) {
       ScalePlaces(c, scale);
       for (int i = 0; i < scale.cols(); ++i) {
         if (c.model->joint(c.model->joint_of_dof(i)).type == JointType::kPrismatic)
           scale.col(i).tail<3>().setConstant(kNotCompared);
       }
     }},
    {T::kLinkCom, "link_com", "r_i", "(5)", P::kLink, 3, kTwo, 1.0,
     [](const C& c, S scale) {
       for (Eigen::Index i = 0; i < scale.cols(); ++i)
         scale.col(i).setConstant(c.has_mass[static_cast<size_t>(i)] ? c.robot.world_length() : kNotCompared);
     }},
    {T::kLinkInertia, "link_inertia", "I_i", "(16)", P::kLink, 9, kTwo, 2.0,
     [](const C& c, S scale) {
       for (Eigen::Index i = 0; i < scale.cols(); ++i) {
         const int link = static_cast<int>(i) + FirstLink(*c.model);
         const double mass = link < 0 ? c.model->base_with_wheels().mass : c.model->joint(link).body.mass;
         const Matrix3d first = c.first->col(i).reshaped(3, 3);
         scale.col(i).setConstant(CalcInertiaScale(mass, first, c.second->col(i).reshaped(3, 3)));
       }
     }},
    {T::kFramePose, "frame_pose", "^B T_f", "(5)", P::kModelFrame, 12, kRun | kTwo, 1.0, ScalePlaces},
    // Rows of the angular part are pure numbers.
    {T::kJ, "J", "J_f", "(6), (28), (34)", P::kFrameColumns, 6, kRun | kTwo, 1.0,
     [](const C& c, S scale) {
       const int n = c.model->num_velocities();
       for (int i = 0; i < scale.cols(); ++i) {
         const double velocity = c.robot.CalcVelocityScale(i % n);
         scale.col(i).head<3>().setConstant(Positive(velocity));
         scale.col(i).tail<3>().setConstant(Positive(velocity / c.robot.length()));
       }
     },
     true},
    // Acceleration of the frame's origin at constant xi, in its own axes.
    {T::kJDotXi, "J_dot_xi", "d/dt J_f xi", "(46)", P::kFrame, 6, kRun | kTwo, 3.0,
     [](const C& c, S scale) {
       const double rate = c.robot.angular_rate();
       scale.topRows<3>().setConstant(Positive(c.robot.acceleration()));
       scale.bottomRows<3>().setConstant(Positive(rate * rate));
     }},
    {T::kM, "M", "M", "(16)", P::kUnreducedPair, 0, kTwo, 2.0, ScaleWholeMass, true},
    {T::kMBar, "M_bar", "M_bar'", "(18), (42)", P::kVelocityPair, 0, kAll, 2.0, ScaleMass, true},
    {T::kCBarXi, "C_bar_xi", "C_bar' xi", "(18), (42)", P::kVelocity, 0, kAll, 4.0,
     ScaleVelocities<&R::CalcCoriolisScale>},
    // C_ij is a force per velocity.
    {T::kCBar, "C_bar", "C_bar'", "(18), (42)", P::kVelocityPair, 0, kTwo, 4.0,
     [](const C& c, S scale) {
       const double rate = Worst(c.robot.angular_rate(), c.robot.linear_rate() / Positive(c.robot.length()));
       ScaleMass(c, scale);
       scale = (scale * rate).unaryExpr([](double x) { return Positive(x); });
     }},
    // Every entry at once, by its action on a second velocity w. The engine has quarters of the forces at
    // xi + w and xi - w: |xi +- w|^2 / 4 is at most (|xi|^2 + |w|^2) / 2, twice.
    {T::kCBarProduct, "C_bar_w", "C_bar' w", "(18), (42)", P::kVelocity, 0, kTwo, 4.0,
     [](const C& c, S scale) {
       for (int i = 0; i < scale.rows(); ++i)
         scale(i, 0) = c.robot.CalcCoriolisScale(i) + c.robot_at_w.CalcCoriolisScale(i);
     },
     false, "C_bar", T::kCBar},
    {T::kGravity, "gravity", "F_bar'", "(18), (42)", P::kVelocity, 0, kAll, 1.0,
     ScaleVelocities<&R::CalcGravityScale>, true},
    {T::kBias, "bias", "C_bar' xi + F_bar'", "(18), (42)", P::kVelocity, 0, kAskedOfPrograms, 4.0,
     [](const C& c, S scale) {
       for (int i = 0; i < scale.rows(); ++i)
         scale(i, 0) = c.robot.CalcCoriolisScale(i) + c.robot.CalcGravityScale(i);
     }},
    {T::kFriction, "friction", "F_bar'", "(18), (42)", P::kVelocity, 0, kAll, 2.0,
     [](const C& c, S scale) {
       for (int i = 0; i < scale.rows(); ++i) scale(i, 0) = c.robot.CalcFrictionScale(i, c.xi);
     }},
    {T::kKineticEnergy, "kinetic_energy", "xi^T M_bar' xi / 2", "(16)", P::kWhole, 1, kAll, 2.0,
     ScaleWhole<&R::CalcKineticEnergyScale>},
    {T::kPotentialEnergy, "potential_energy", "-", "(16)", P::kWhole, 1, kAll, 1.0,
     ScaleWhole<&R::CalcPotentialEnergyScale>},
    {T::kLinearMomentum, "linear_momentum", "-", "(16)", P::kWhole, 3, kRun | kTwo, 1.0,
     ScaleWhole<&R::CalcMomentumScale>},
    {T::kAngularMomentum, "angular_momentum", "-", "(16)", P::kWhole, 3, kRun | kTwo, 2.0,
     [](const C& c, S scale) {
       scale.setConstant(Positive(c.robot.CalcMomentumScale() * c.robot.length()));
     }},

    {T::kContactFrame, "contact_frame", "g_o_cf", "(22), (39)", P::kContact, 19, kRun | kTip, 1.0,
     [](const C& c, S scale) {
       for (Eigen::Index i = 0; i < scale.cols(); ++i) {
         scale.col(i).setConstant(ContactOf(c, i).position);
         scale.col(i).segment<3>(3).setConstant(ContactOf(c, i).normal);
         scale.col(i).segment<9>(7).setConstant(ContactOf(c, i).normal);
       }
     }},
    {T::kG, "G", "G", "(25)", P::kContact, 18, kRun | kTip, 1.0,
     [](const C& c, S scale) {
       for (Eigen::Index i = 0; i < scale.cols(); ++i) {
         for (Eigen::Index k = 0; k < 18; ++k)
           scale(k, i) = k % 6 < 3 ? ContactOf(c, i).normal : ContactOf(c, i).moment;
       }
     }},
    {T::kJB, "J_B", "J_B'", "(34), (44)", P::kContactColumns, 3, kRun | kTip, 1.0,
     [](const C& c, S scale) {
       const int n = c.model->num_velocities();
       for (int i = 0; i < scale.cols(); ++i)
         scale.col(i).setConstant(c.robot.CalcVelocityScale(i % n) * ContactOf(c, i / n).J_B);
     }},
    {T::kKappaDot, "kappa_dot", "kappa_dot", "(40)", P::kContact, 6, kTip, 1.0,
     ScaleContacts<&ContactScales::relative_twist>},
    {T::kJBDotXi, "J_B_dot_xi", "d/dt J_B' xi", "(46)", P::kContact, 3, kRun, 3.0,
     ScaleContacts<&ContactScales::J_B_dot_xi>},
    {T::kGDotTV, "G_dot_T_V", "d/dt G^T V_Bo", "(46)", P::kContact, 3, kRun, 3.0,
     ScaleContacts<&ContactScales::G_dot_T_V>},

    {T::kObjectPose, "object_pose", "^B T_o", "(8)", P::kObject, 12, kRun | kTwo, 1.0,
     [](const C& c, S scale) { scale.bottomRows<3>().setConstant(c.object.place); }},
    {T::kVBo, "V_Bo", "V^o_Bo = P^-1 X_o_dot", "(8)", P::kObject, 6, kRun | kTwo, 1.0,
     [](const C& c, S scale) { scale.setConstant(c.object.rate); }, false, "P_inv"},
    {T::kMHat, "M_hat", "M_hat", "(19)", P::kObject, 36, kRun, 1.0, ScaleInertia},
    {T::kCHatV, "C_hat_V", "C_hat V_Bo", "(19)", P::kObject, 6, kRun, 1.0, ScaleObjectCoriolis},
    {T::kNo, "N_o", "N_o", "(19)", P::kObject, 6, kRun | kTwo, 1.0,
     [](const C& c, S scale) { ScaleWrench(c, c.object.weight, scale); }},
    {T::kObjectKineticEnergy, "object_kinetic_energy", "V_Bo^T M_hat V_Bo / 2", "(19)", P::kObject, 1,
     kRun | kTwo, 1.0,
     [](const C& c,
        S scale) { scale.setConstant((c.object.mass + c.object.inertia) * c.object.rate * c.object.rate); }},
    {T::kObjectPotentialEnergy, "object_potential_energy", "-", "(19)", P::kObject, 1, kRun, 1.0,
     [](const C& c, S scale) { scale.setConstant(c.object.weight * c.object.place); }},
    {T::kMo, "M_o", "M_o", "(19)", P::kObject, 36, kRun | kTwo, 1.0, ScaleInertia},
    {T::kCoXoDot, "C_o_X_o_dot", "C_o X_o_dot", "(19)", P::kObject, 6, kRun | kTwo, 1.0, ScaleObjectCoriolis},
};
static_assert(std::size(kTerms) == kTermCount);

}  // namespace

std::span<const TermEntry> ListTerms() { return kTerms; }

double CalcBound(const TermEntry& term, int depth) {
  if (term.parts != TermParts::kObject) return CalcRoundingBound(depth, term.factor);
  return term.factor * kObjectErrors * std::numeric_limits<double>::epsilon();
}

std::pair<Eigen::Index, Eigen::Index> CalcShape(const TermEntry& entry, const ScaleContext& c) {
  const RobotModel& model = *c.model;
  const Eigen::Index n = model.num_velocities();
  const Eigen::Index joints = model.num_joints();
  const auto count = [](const auto& list) { return static_cast<Eigen::Index>(list.size()); };
  switch (entry.parts) {
    case P::kJoint:
      return {entry.rows, model.num_dofs()};
    case P::kLink:
      return {entry.rows, joints - FirstLink(model)};
    case P::kModelFrame:
      return {entry.rows, count(model.frames())};
    case P::kFrame:
      return {entry.rows, count(c.frames)};
    case P::kFrameColumns:
      return {entry.rows, n * count(c.frames)};
    case P::kVelocity:
      return {n, 1};
    case P::kVelocityPair:
      return {n, n};
    case P::kUnreducedPair: {
      const Eigen::Index size = n - model.num_base_velocities() + model.num_unreduced_base_velocities();
      return {size, size};
    }
    case P::kContact:
      return {entry.rows, count(c.contact_frames)};
    case P::kContactColumns:
      return {entry.rows, n * count(c.contact_frames)};
    case P::kWhole:
    case P::kObject:
      break;
  }
  return {entry.rows, 1};
}

Location FindLocation(const TermEntry& entry, const ScaleContext& c, Eigen::Index row, Eigen::Index col) {
  const int n = c.model->num_velocities();
  const auto r = static_cast<int>(row);
  const auto i = static_cast<int>(col);
  switch (entry.parts) {
    case P::kJoint:
      return {Kind::kJoint, c.model->joint_of_dof(i), -1};
    case P::kLink:
      return {Kind::kLink, i + FirstLink(*c.model), -1};
    case P::kModelFrame:
      return {Kind::kFrame, i, -1};
    case P::kFrame:
      return {Kind::kFrame, c.frames[static_cast<size_t>(i)], -1};
    case P::kFrameColumns:
      return {Kind::kFrame, c.frames[static_cast<size_t>(i / n)], -1};
    case P::kVelocity:
      return {Kind::kVelocity, r, -1};
    case P::kVelocityPair:
      return {Kind::kVelocityPair, r, i};
    case P::kUnreducedPair: {
      const int shift = c.model->num_unreduced_base_velocities() - c.model->num_base_velocities();
      return {Kind::kVelocityPair, Worst(r - shift, 0), Worst(i - shift, 0)};
    }
    case P::kContact:
      return {Kind::kFrame, c.contact_frames[static_cast<size_t>(i)], -1};
    case P::kContactColumns:
      return {Kind::kFrame, c.contact_frames[static_cast<size_t>(i / n)], -1};
    case P::kObject:
      return {Kind::kObject, -1, -1};
    case P::kWhole:
      break;
  }
  return {};
}

ObjectScales CalcObjectScales(const MassProperties& body, const Vector3d& gravity, double distance,
                              double rate) {
  return {1.0 + distance, Worst(rate, kLeastRate), body.mass, body.inertia.trace(),
          Positive(body.mass * gravity.norm())};
}

}  // namespace dexcheck
