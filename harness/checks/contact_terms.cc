// The contacts' terms: (22)-(40) against the engine's narrow phase and the motion of the two bodies that
// touch.

#include <algorithm>
#include <cmath>

#include "controller/contact/find_contact.h"
#include "controller/contact/rolling.h"
#include "harness/checks/term_table.h"

namespace dexcheck {
namespace {

using C = TermContext;
using N = Eigen::Ref<Eigen::ArrayXd>;
using Kind = Location::Kind;

/// Rounding errors of a contact's place.
void CalcPlaceScales(const RoundingScales& robot, const ContactGeometry& contact, ContactScales* scales) {
  // A fingertip displaced by e over the object moves the contact by (K_f + Kt_o)^-1 K_f e on the object and
  // turns the normal by K_o times that.
  const Matrix2d sum = contact.fingertip.K + contact.R_psi * contact.object.K * contact.R_psi;
  // The smallest eigenvalue. R_psi K_o R_psi is symmetric but for rounding, and hypot knows no negative
  // squares.
  const double half = 0.5 * (sum(0, 0) - sum(1, 1));
  const double least = 0.5 * sum.trace() - std::hypot(half, 0.5 * (sum(0, 1) + sum(1, 0)));
  const double moved = contact.fingertip.K.norm() / least;
  const double length = robot.world_length();
  // On a flat object hardly anything turns the normal but what the search for the contact leaves.
  const double left = kContactConvergence / CalcRoundingBound(robot.depth(), 1.0);
  scales->normal = std::max(1.0 + contact.object.K.norm() * moved * length, left);
  scales->position = (1.0 + moved) * length;
  scales->moment = scales->position + contact.g_o_cf.translation().norm() * scales->normal;
  scales->J_B = scales->normal + scales->position / robot.length();
}

/// Sigma_cf by the engine, in the plant's world and where the projected robot has it.
struct ContactPlace {
  Matrix3d R;
  Vector3d p;
  Matrix3d R_projected;
  Vector3d p_projected;
};

/// Rates of the two bodies' velocities at the contact, as Sigma_cf has them.
void EvaluateRates(const C& c, const Contact& contact, const ContactPlace& place, ContactSides* sides) {
  // Everything in Sigma_cf, which moves over the fingertip at u_f and turns at omega.
  const EngineMotion tip = c.engine->FrameMotion(sides->frame).MoveTo(place.p_projected);
  const EngineMotion object = c.engine->ObjectMotion().MoveTo(place.p);
  const Vector3d v_f = place.R_projected.transpose() * tip.v;
  const Vector3d omega_f = place.R_projected.transpose() * tip.omega;
  const Vector3d v_o = place.R.transpose() * object.v;
  const Vector3d omega_o = place.R.transpose() * object.omega;
  const Vector6d over_tip = CalcFrameTwistOnFingertip(contact.geometry, contact.kappa_dot);
  const Vector3d u_f = over_tip.head<3>();
  Vector3d u_o = v_f + u_f - v_o;
  u_o.z() = 0.0;  // kappa moves within the surfaces, also while the bodies approach
  const Vector3d omega = omega_f + over_tip.tail<3>();
  // d/dt (R_cf^T v_f(p_c)), and the same of the object's velocity at p_c
  ContactValues& engine = sides->engine;
  engine.J_B_dot_xi = place.R_projected.transpose() * tip.a + omega_f.cross(u_f) - omega.cross(v_f);
  engine.G_dot_T_V = place.R.transpose() * object.a + omega_o.cross(u_o) - omega.cross(v_o);
  // Both ways to Sigma_cf: V_f_cf + Ad^-1 V_f = V_o_cf + Ad^-1 V_o.
  engine.relative_twist << v_f - v_o, omega_f - omega_o;
  sides->model.relative_twist = CalcFrameTwistOnObject(contact.geometry, contact.kappa_dot) - over_tip;

  ContactScales& scales = sides->scales;
  const double turning = omega.norm();
  const double linear = c.scales->linear_rate() + u_f.norm();
  const double angular = c.scales->angular_rate() + turning;
  scales.J_B_dot_xi = Positive(linear * angular * scales.normal + scales.position * angular * angular);
  // An error of v_f - v_o is one of u_o, and turns Sigma_cf's rate by the fingertip's curvature.
  const double object_linear = v_o.norm() + u_o.norm();
  const double object_angular = omega_o.norm() + turning;
  const double curvature = contact.geometry.fingertip.K.norm() * scales.position / c.scales->world_length();
  scales.G_dot_T_V = Positive(object_linear * object_angular * scales.normal +
                              scales.position * object_angular * object_angular +
                              c.scales->linear_rate() * (omega_o.norm() + curvature * v_o.norm()));
  // Rolling rates are the relative rates over the surfaces' relative curvature.
  scales.relative_twist = Positive(v_f.norm() + v_o.norm() + over_tip.norm() +
                                   c.scales->world_length() * (omega_f.norm() + omega_o.norm()));
}

const ContactSides& ContactOf(const C& c, int i) { return c.contacts[static_cast<size_t>(i)]; }

/// @param count numbers of each contact; the chain's columns when zero.
template <size_t kCount>
std::vector<TermItem> List(const C& c) {
  std::vector<TermItem> items;
  for (int i = 0; i < static_cast<int>(c.contacts.size()); ++i) {
    const int frame = ContactOf(c, i).frame;
    const size_t count = kCount > 0 ? kCount : 3 * c.engine->chain(frame).size();
    items.push_back({i, std::vector(count, Location{Kind::kFrame, frame, -1})});
  }
  return items;
}

/// A member of ContactValues.
template <auto kMember>
void Model(const C& c, int i, N out) {
  out = (ContactOf(c, i).model.*kMember).reshaped().array();
}
template <auto kMember>
void Engine(const C& c, int i, N out) {
  out = (ContactOf(c, i).engine.*kMember).reshaped().array();
}
/// One scale for all numbers of a contact.
template <auto kScale>
void Weigh(const C& c, int i, N weight) {
  weight.setConstant(1.0 / (ContactOf(c, i).scales.*kScale));
}

std::vector<ZeroPattern> ListJacobianZeros(const C& c) {
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> may_differ;
  may_differ.setConstant(3 * static_cast<Eigen::Index>(c.contacts.size()), c.engine->size(), false);
  for (size_t i = 0; i < c.contacts.size(); ++i) {
    for (const int col : c.engine->chain(c.contacts[i].frame))
      may_differ.block(3 * static_cast<Eigen::Index>(i), col, 3, 1) = true;
  }
  return {ZeroPattern(may_differ)};
}
void CheckJacobianZeros(const C& c, ComparedTerm* term) {
  term->CheckZeros(
      0, *c.J_B,
      [&](Eigen::Index, Eigen::Index col) { return c.scales->CalcVelocityScale(static_cast<int>(col)); },
      [&](Eigen::Index row, Eigen::Index) {
        return Location{Kind::kFrame, c.contacts[static_cast<size_t>(row / 3)].frame, -1};
      },
      c.when);
}

using V = ContactValues;
using S = ContactScales;
constexpr TermGroup kContact = TermGroup::kContact;
constexpr unsigned kBoth = kAskedByRun | kAskedByContacts;

constexpr TermEntry kTerms[] = {
    {"contact_frame", "contact_frame", "g_o_cf", "(22), (39)", kContact, kBoth, 1.0, List<19>,
     Model<&V::frame>, Engine<&V::frame>,
     [](const C& c, int i, N weight) {
       const ContactScales& scales = ContactOf(c, i).scales;
       weight.setConstant(1.0 / scales.position);
       weight.segment<3>(3).setConstant(1.0 / scales.normal);
       weight.segment<9>(7).setConstant(1.0 / scales.normal);
     }},
    {"G", "G", "G", "(25)", kContact, kBoth, 1.0, List<18>, Model<&V::G>, Engine<&V::G>,
     [](const C& c, int i, N weight) {
       for (Eigen::Index k = 0; k < 18; k += 6) {
         weight.segment<3>(k).setConstant(1.0 / ContactOf(c, i).scales.normal);
         weight.segment<3>(k + 3).setConstant(1.0 / ContactOf(c, i).scales.moment);
       }
     }},
    {"J_B", "J_B", "J_B'", "(34), (44)", kContact, kBoth, 1.0, List<0>, Model<&V::J_B>, Engine<&V::J_B>,
     [](const C& c, int i, N weight) {
       Eigen::Index k = 0;
       for (const int col : c.engine->chain(ContactOf(c, i).frame)) {
         weight.segment<3>(k).setConstant(1.0 /
                                          (c.scales->CalcVelocityScale(col) * ContactOf(c, i).scales.J_B));
         k += 3;
       }
     },
     Weighed::kAtEachState, ListJacobianZeros, CheckJacobianZeros},
    {"kappa_dot", "kappa_dot", "kappa_dot", "(40)", kContact, kAskedByContacts, 1.0, List<6>,
     Model<&V::relative_twist>, Engine<&V::relative_twist>, Weigh<&S::relative_twist>},
    {"J_B_dot_xi", "J_B_dot_xi", "d/dt J_B' xi", "(46)", kContact, kAskedByRun, 3.0, List<3>,
     Model<&V::J_B_dot_xi>, Engine<&V::J_B_dot_xi>, Weigh<&S::J_B_dot_xi>},
    {"G_dot_T_V", "G_dot_T_V", "d/dt G^T V_Bo", "(46)", kContact, kAskedByRun, 3.0, List<3>,
     Model<&V::G_dot_T_V>, Engine<&V::G_dot_T_V>, Weigh<&S::G_dot_T_V>},
};

}  // namespace

std::span<const TermEntry> ListContactTerms() { return kTerms; }

void EvaluateContact(const Contact& contact, const Pose& shift, size_t index, TermContext* context) {
  const TermContext& c = *context;
  ContactSides* const sides = &context->contacts[index];
  const Pose& g_o_cf = contact.geometry.g_o_cf;
  const Pose X_oW = c.engine->ObjectPose().inverse(Eigen::Isometry);
  const Pose X_cf = shift * c.engine->FramePose(sides->frame) * contact.geometry.g_f_cf;
  const EngineTouch touch = c.engine->CalcTouch(sides->frame, shift);
  CalcPlaceScales(*c.scales, contact.geometry, &sides->scales);

  ContactValues& model = sides->model;
  model.frame.head<3>() = g_o_cf.translation();
  model.frame.segment<3>(3) = g_o_cf.linear().col(2);
  model.frame.tail<12>() = g_o_cf.matrix().topRows<3>().reshaped();
  ContactValues& engine = sides->engine;
  engine.frame.head<3>() = X_oW * touch.position;
  engine.frame.segment<3>(3) = X_oW.linear() * touch.normal;
  engine.frame[ContactValues::kOverlap] = -touch.distance;
  engine.frame.tail<12>() = (X_oW * X_cf).matrix().topRows<3>().reshaped();

  // Sigma_cf by the engine's normal; where its x axis points about the normal is a convention.
  Matrix3d R_cf;
  R_cf.col(2) = touch.normal;
  R_cf.col(1) = touch.normal.cross(X_cf.linear().col(0)).normalized();
  R_cf.col(0) = R_cf.col(1).cross(R_cf.col(2));
  const ContactPlace place{R_cf, touch.position, shift.linear().transpose() * R_cf,
                           shift.inverse(Eigen::Isometry) * touch.position};
  engine.G = (R_cf.transpose() * c.engine->CalcObjectJacobian(touch.position)).transpose();
  // v + omega x arm at the contact
  const Vector3d arm = place.p_projected - c.engine->FramePose(sides->frame).translation();
  const Matrix6Xd& columns = c.columns[index];
  for (Eigen::Index col = 0; col < columns.cols(); ++col) {
    engine.J_B.col(col) =
        place.R_projected.transpose() * (columns.col(col).head<3>() + columns.col(col).tail<3>().cross(arm));
  }
  EvaluateRates(c, contact, place, sides);
}

}  // namespace dexcheck
