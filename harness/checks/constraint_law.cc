#include "harness/checks/constraint_law.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

#include "controller/common/text.h"
#include "harness/base/worst.h"
#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mujoco_release.h"
#include "harness/engine/robot_tree.h"

namespace dexcheck {
namespace {

constexpr double kTurnErrors = 16.0;  // of one joint's step outward, as rounding_scales.cc has it
constexpr double kSameCentre = 1e-9;  // m; two decimal numbers for one point
constexpr size_t kRoom = 512;         // rows

double PushOnly(double force) { return Worst(0.0, force); }

}  // namespace

bool ConstraintLaw::Applies(const mjModel& engine) {
  return engine.opt.solver != mjSOL_PGS && engine.opt.noslip_iterations == 0 &&
         (engine.opt.enableflags & mjENBL_OVERRIDE) == 0;
}

ConstraintLaw::ConstraintLaw(const RobotModel& model, const ObjectModel* object, const Adapter& adapter,
                             const WholeRobot& whole, double tolerance)
    : model_(&model),
      object_(object),
      adapter_(&adapter),
      unit_(Worst(std::numeric_limits<double>::epsilon(), tolerance)) {
  const mjModel& m = adapter.engine();
  rates_.setZero(whole.size(), 2);
  nu_.setZero(whole.size());
  links_.resize(static_cast<size_t>(whole.model().num_joints()) + 3);
  joints_.assign(static_cast<size_t>(m.njnt), -1);
  for (int j = 0; j < whole.model().num_joints(); ++j)
    joints_[static_cast<size_t>(whole.engine_joint(j))] = j;
  forces_.reserve(kRoom);

  const MjDataPtr reference = MakeData(m);
  mj_kinematics(&m, reference.get());
  WholeRobot there(model, object != nullptr ? &object->body : nullptr, adapter);
  there.SetState(reference->qpos, reference->qvel);
  whole_ = &there;
  qpos_ = reference->qpos;
  FindGeoms(*reference);
  FindWeights(*reference);
  FindAnchors(*reference);
  whole_ = &whole;
}

void ConstraintLaw::FindGeoms(const mjData& reference) {
  const mjModel& m = adapter_->engine();
  for (int pair = 0; pair < m.npair; ++pair)
    pairs_[std::minmax({m.pair_geom1[pair], m.pair_geom2[pair]})] = pair;
  geoms_.resize(static_cast<size_t>(m.ngeom));
  const auto set_sphere = [this](int g, int link, const std::string& name, const Vector3d& center,
                                 double radius) {
    geoms_[static_cast<size_t>(g)] = {name, Shape::kSphere, link, center, Vector3d::Zero(), radius, 0.0};
  };
  for (int g = 0; g < m.ngeom; ++g) {
    Geom& geom = geoms_[static_cast<size_t>(g)];
    const int body = m.geom_bodyid[g];
    geom.link = whole_->FindLink(body);
    geom.name = body > 0 ? NameOf(m, mjOBJ_BODY, body) : NameOf(m, mjOBJ_GEOM, g);
    if (geom.link == WholeRobot::kWorld && m.geom_type[g] == mjGEOM_PLANE) {
      geom.shape = Shape::kPlane;
      geom.center = MapVector(reference.geom_xpos + 3 * g);
      geom.normal = RotationMap(reference.geom_xmat + 9 * g).col(2);
    } else if (geom.link == WholeRobot::kObject && m.geom_type[g] == mjGEOM_SPHERE) {
      if (const auto* const sphere = std::get_if<SolidSphere>(&object_->shape))
        set_sphere(g, geom.link, geom.name, Vector3d::Zero(), sphere->radius);
    } else if (geom.link == WholeRobot::kObject && m.geom_type[g] == mjGEOM_MESH) {
      if (const auto* const torus = std::get_if<SolidTorus>(&object_->shape))
        geom.shape = Shape::kTorus, geom.radius = torus->ring_radius, geom.tube = torus->tube_radius;
    }
    for (const EngineWheel& wheel : adapter_->wheels()) {
      if (body == m.jnt_bodyid[wheel.joint] && m.geom_type[g] == mjGEOM_SPHERE)
        set_sphere(g, geom.link, geom.name, Vector3d::Zero(), model_->base().wheel_radius);
    }
  }
  const std::vector<Frame>& frames = whole_->model().frames();
  for (size_t f = 0; f < frames.size(); ++f) {
    const auto& [name, link, X_LF, radius] = frames[f];
    const int g = radius ? FindTipSphere(m, adapter_->frame_sites()[f], kSameCentre) : -1;
    if (g >= 0) set_sphere(g, link, name, X_LF.translation(), *radius);
  }
}

void ConstraintLaw::FindWeights(const mjData& reference) {
  const mjModel& m = adapter_->engine();
  const Eigen::Index size = whole_->size(), robot = whole_->robot_size();
  std::vector<int> num_bodies(links_.size(), 0);  // by joint
  for (int b = 1; b < m.nbody; ++b) {
    if (m.body_mass[b] > 0.0 && whole_->FindLink(b) >= 0)
      ++num_bodies[static_cast<size_t>(whole_->FindLink(b))];
  }
  MatrixXd M = MatrixXd::Zero(size, size);
  std::vector<Matrix3Xd> J(static_cast<size_t>(m.nbody), Matrix3Xd::Zero(3, size));
  for (Eigen::Index k = 0; k < size; ++k) {
    rates_.col(0) = VectorXd::Unit(size, k);
    nu_.setZero();
    whole_->AddInertia(rates_.col(0), &nu_);
    M.col(k) = nu_;
    ++step_;
    for (int b = 1; b < m.nbody; ++b) {
      const int link = whole_->FindLink(b);
      if (link == WholeRobot::kWorld || link == WholeRobot::kNoLink) continue;
      // A body that is the only one of a link has the link's centre of mass; welded bodies have their own.
      const bool is_alone = link >= 0 && m.body_mass[b] > 0.0 && num_bodies[static_cast<size_t>(link)] == 1;
      const Vector3d center = is_alone ? Locate(link, whole_->model().joint(link).body.com).position
                                       : MapVector(reference.xipos + 3 * b);
      PointMotion motion;
      AddMotion(Follow(link), center, 0.0, 1.0, &motion);
      J[static_cast<size_t>(b)].col(k) = motion.value.col(0).head<3>();
    }
  }
  const MatrixXd W = M.llt().solve(MatrixXd::Identity(size, size));
  // The mean of x^T M^-1 x over the columns x. An error E of M changes it by y^T E y, with y = M^-1 x.
  MatrixXd M_error = M.cwiseAbs();
  M_error.topLeftCorner(robot, robot) = whole_->CalcMassScales();
  M_error *= kTurnErrors * (whole_->model().max_depth() + 1);
  const auto calc_weight = [&](const MatrixXd& x) {
    const MatrixXd y = W * x;
    const double sum = x.cwiseProduct(y).sum();
    if (sum == 0.0) return InverseInertia{};
    return InverseInertia{sum / static_cast<double>(x.cols()),
                          (M_error * y.cwiseAbs()).cwiseProduct(y.cwiseAbs()).sum() / sum};
  };
  for (const Matrix3Xd& jacobian : J) body_weights_.push_back(calc_weight(jacobian.transpose()));
  joint_weights_.resize(joints_.size());
  for (int j = 0; j < whole_->model().num_joints(); ++j) {
    const int entry = whole_->model().num_base_velocities() + whole_->model().dof(j);
    joint_weights_[static_cast<size_t>(whole_->engine_joint(j))] = calc_weight(VectorXd::Unit(size, entry));
  }
}

void ConstraintLaw::FindAnchors(const mjData& reference) {
  const mjModel& m = adapter_->engine();
  anchors_.resize(static_cast<size_t>(m.neq));
  for (int eq = 0; eq < m.neq; ++eq) {
    if (m.eq_type[eq] != mjEQ_CONNECT) continue;
    for (const auto& [side, body] : {std::pair(0, m.eq_obj1id[eq]), std::pair(1, m.eq_obj2id[eq])}) {
      const Pose X = BodyPose(reference, body);
      anchors_[static_cast<size_t>(eq)][static_cast<size_t>(side)] =
          Follow(whole_->FindLink(body)).X.inverse(Eigen::Isometry) *
          (X * MapVector(m.eq_data + mjNEQDATA * eq + 3 * side));
    }
  }
}

const ConstraintLaw::Link& ConstraintLaw::Follow(int link) {
  static const Link kStill;
  if (link == WholeRobot::kWorld || link == WholeRobot::kNoLink) return kStill;
  Link& it = links_[static_cast<size_t>(link + 3)];
  if (it.step == step_) return it;
  it = {step_, whole_->CalcLinkPose(link), kTurnErrors, Vector3d::Zero(), PointMotion{}};
  const RobotModel& model = whole_->model();
  const Vector3d position = it.X.translation();
  it.place_error = position.cwiseAbs();
  auto linear = it.origin.value.topRows<3>(), angular = it.origin.value.bottomRows<3>();
  Eigen::Matrix<double, 3, 2> slid = Eigen::Matrix<double, 3, 2>::Zero(), turned = slid;
  if (link < 0) {
    const bool is_object = link == WholeRobot::kObject;
    const Eigen::Index at = is_object ? whole_->robot_size() : 0;
    if (is_object || model.num_base_velocities() == 6) {
      slid = rates_.middleRows<3>(at);
      turned = it.X.linear() * rates_.middleRows<3>(at + 3);
    } else if (model.num_base_velocities() == 3) {
      slid.topRows<2>() = rates_.topRows<2>();
      turned.row(2) = rates_.row(2);
    }
  } else {
    const Joint& joint = model.joint(link);
    const Link& parent = Follow(joint.parent);
    it.turn_error += parent.turn_error;
    const Eigen::Index at = model.num_base_velocities() + model.dof(link);
    if (joint.type == JointType::kBall) {
      turned = it.X.linear() * rates_.middleRows<3>(at);
    } else if (joint.type == JointType::kPrismatic) {
      slid = it.X.linear().col(2) * rates_.row(at);
    } else {
      turned = it.X.linear().col(2) * rates_.row(at);
      // The angle itself has a rounding error that grows with the number of turns.
      it.turn_error += std::abs(qpos_[adapter_->engine().jnt_qposadr[whole_->engine_joint(link)]]);
    }
    const double swing = it.turn_error * (position - parent.X.translation()).norm();
    it.place_error += parent.place_error + Vector3d::Constant(swing);
    AddMotion(parent, position, swing + position.norm(), 1.0, &it.origin);
  }
  linear += slid;
  angular += turned;
  it.origin.error.row(0) += it.turn_error * slid.colwise().norm().array();
  it.origin.error.row(1) += it.turn_error * turned.colwise().norm().array();
  return it;
}

ConstraintLaw::Point ConstraintLaw::Locate(int link, const Vector3d& in_link) {
  const Link& it = Follow(link);
  const Vector3d position = it.X * in_link;
  return {&it, position,
          it.place_error + position.cwiseAbs() + Vector3d::Constant(it.turn_error * in_link.norm())};
}

void ConstraintLaw::AddMotion(const Link& link, const Vector3d& point, double point_error, double sign,
                              PointMotion* motion) {
  const auto linear = link.origin.value.topRows<3>(), angular = link.origin.value.bottomRows<3>();
  const Vector3d arm = point - link.X.translation();
  motion->value.topRows<3>() += sign * (linear - Skew(arm) * angular);
  motion->value.bottomRows<3>() += sign * angular;
  const Eigen::Array<double, 1, 2> turning = angular.colwise().norm().array();
  const double arm_error = link.place_error.norm() + point_error + kSumErrors * arm.norm();
  motion->error.row(0) += link.origin.error.row(0) + arm.norm() * link.origin.error.row(1) +
                          arm_error * turning + kSumErrors * linear.colwise().norm().array();
  motion->error.row(1) += link.origin.error.row(1) + kSumErrors * turning;
}

EngineContact ConstraintLaw::TakePair(EngineContact contact) const {
  const auto found = pairs_.find(std::minmax({contact.geom1, contact.geom2}));
  if (found == pairs_.end()) return contact;
  const mjModel& m = adapter_->engine();
  const int pair = found->second;
  contact.margin = m.pair_margin[pair] - m.pair_gap[pair];
  for (int i = 0; i < 5; ++i)
    contact.friction[static_cast<size_t>(i)] = Worst(mjMINMU, m.pair_friction[5 * pair + i]);
  std::copy_n(m.pair_solimp + mjNIMP * pair, mjNIMP, contact.solimp.begin());
  std::copy_n(m.pair_solref + mjNREF * pair, mjNREF, contact.solref.begin());
  std::copy_n(GetFrictionReference(m, pair), mjNREF, contact.solref_friction.begin());
  return contact;
}

ConstraintLaw::Place ConstraintLaw::FindPlace(const EngineContact& contact) {
  Place place{contact.position, contact.frame, contact.distance, 0.0, 0.0, 0.0, false};
  const Geom& first = geoms_[static_cast<size_t>(contact.geom1)];
  const Geom& second = geoms_[static_cast<size_t>(contact.geom2)];
  const bool is_on_plane = first.shape == Shape::kPlane;
  const Geom& ball = is_on_plane ? second : first;
  if (ball.shape != Shape::kSphere || (!is_on_plane && second.shape == Shape::kOther)) return place;

  const Point center = Locate(ball.link, ball.center);
  Vector3d normal, error = center.error;  // from the ball; of where it leads
  if (is_on_plane) {
    const Vector3d offset = center.position - first.center;
    normal = -first.normal;
    error += kSumErrors * offset.cwiseAbs();
    place.distance = -normal.dot(offset) - ball.radius;
  } else {
    Point goal = Locate(second.link, second.center);
    double reach = second.radius, along_ring = 0.0;
    error += goal.error;
    if (second.shape == Shape::kTorus) {
      // A torus is a ball that is rolled around its ring, nearest on this side or opposite: the engine's
      // contact is the one at its own distance.
      Vector3d outward = goal.link->X.linear().transpose() * (center.position - goal.position);
      outward.z() = 0.0;
      const double rho = outward.norm();
      reach = second.tube;
      const std::array rings = {Vector3d(goal.link->X * (second.radius / rho * outward)),
                                Vector3d(goal.link->X * (-second.radius / rho * outward))};
      const auto mismatch = [&](const Vector3d& ring) {
        return std::abs((ring - center.position).norm() - reach - ball.radius - contact.distance);
      };
      goal.position = rings[mismatch(rings[0]) <= mismatch(rings[1]) ? 0 : 1];
      error += Vector3d::Constant(goal.link->turn_error * (second.radius + rho));
      along_ring = second.radius / rho * error.norm();  // the distance does not change along it
    }
    const Vector3d offset = goal.position - center.position;
    const double apart = offset.norm();
    normal = offset / apart;
    place.distance = apart - ball.radius - reach;
    place.normal_error = (error.norm() + along_ring) / apart + kSumErrors;
    error += Vector3d::Constant(kSumErrors * (apart + reach + ball.radius));
  }
  const double depth = ball.radius + 0.5 * place.distance;
  place.position = center.position + depth * normal;
  place.distance_error = normal.cwiseAbs().dot(error) + ball.radius;
  place.position_error = error.norm() + depth * place.normal_error;
  // The engine's first tangent, made perpendicular to this normal.
  if (is_on_plane) normal = -normal;
  const Vector3d tangent = contact.frame.row(1).transpose();
  const Vector3d along = (tangent - normal.dot(tangent) * normal).normalized();
  place.frame << normal.transpose(), along.transpose(), normal.cross(along).transpose();
  place.is_own = true;
  return place;
}

InverseInertia ConstraintLaw::AddWeights(int body1, int body2) const {
  const InverseInertia &a = body_weights_[static_cast<size_t>(body1)],
                       &b = body_weights_[static_cast<size_t>(body2)];
  return {a.value + b.value, Worst(a.error, b.error)};
}

template <typename Project>
void ConstraintLaw::SetForces(size_t row, const SoftCone& cone, bool has_own_place, const Project& project) {
  std::array<double, 6> force = cone.CalcFreeForces();
  project(&force);
  for (size_t i = 0; i < cone.size && row + i < forces_.size(); ++i) {
    const double error = cone.CalcForceError(i, force[i]);
    forces_[row + i] = {force[i], unit_ * error + std::numeric_limits<double>::min(), true, has_own_place};
  }
}

void ConstraintLaw::SetJointRow(size_t row) {
  const mjModel& m = adapter_->engine();
  const ConstraintRow& it = response_->rows[row];
  const bool is_limit = it.type == mjCNSTR_LIMIT_JOINT;
  const int id = is_limit ? it.id : m.dof_jntid[it.id], dof = is_limit ? m.jnt_dofadr[id] : it.id;
  const int index = joints_[static_cast<size_t>(id)];
  if (index < 0 || whole_->model().joint(index).type == JointType::kBall) return;
  const Joint& joint = whole_->model().joint(index);
  double side = 1.0, r = 0.0, r_error = 0.0;
  const mjtNum *solref = m.dof_solref + mjNREF * dof, *solimp = m.dof_solimp + mjNIMP * dof;
  if (is_limit) {
    // The engine puts the lower limit first where a joint is near both ends of its range.
    const std::vector<ConstraintRow>& rows = response_->rows;
    const auto is_same = [&](size_t i) {
      return i < rows.size() && rows[i].type == it.type && rows[i].id == id;
    };
    const double q = qpos_[m.jnt_qposadr[id]], above = q - joint.lower, below = joint.upper - q;
    side = is_same(row + 1) || (!is_same(row - 1) && above < below) ? 1.0 : -1.0;
    r = (side > 0.0 ? above : below) - m.jnt_margin[id];
    r_error = std::abs(r) + std::abs(q);
    solref = m.jnt_solref + mjNREF * id, solimp = m.jnt_solimp + mjNIMP * id;
  }
  Softness soft = CalcSoftness(m.opt, solref, solimp, r, r_error);
  if (!is_limit) soft.K = 0.0;
  PointMotion motion;
  motion.value.row(0) << response_->qacc[dof], qvel_[dof];
  SoftCone cone;
  cone.R[0] = cone.CalcR(soft, joint_weights_[static_cast<size_t>(id)]);
  cone.Add(soft, motion, side * Vector6d::Unit(0), 0.0, r, r_error);
  SetForces(row, cone, true, [&](auto* force) {
    double& f = force->front();
    f = is_limit ? PushOnly(f) : std::clamp(f, -joint.dry_friction, joint.dry_friction);
  });
}

void ConstraintLaw::SetConnection(size_t row) {
  const mjModel& m = adapter_->engine();
  const int eq = response_->rows[row].id, bodies[] = {m.eq_obj1id[eq], m.eq_obj2id[eq]};
  PointMotion motion;
  Vector3d apart = Vector3d::Zero(), error = Vector3d::Zero();
  for (int side = 0; side < 2; ++side) {
    const int link = whole_->FindLink(bodies[side]);
    if (link == WholeRobot::kNoLink) return;
    Point point = Locate(link, anchors_[static_cast<size_t>(eq)][static_cast<size_t>(side)]);
    point.error *= 2.0;  // the anchor was located at another pose
    AddMotion(*point.link, point.position, point.error.norm(), side == 0 ? 1.0 : -1.0, &motion);
    apart += (side == 0 ? 1.0 : -1.0) * point.position;
    error += point.error;
  }
  const Softness soft =
      CalcSoftness(m.opt, m.eq_solref + mjNREF * eq, m.eq_solimp + mjNIMP * eq, apart.norm(), error.norm());
  SoftCone cone;
  for (int k = 0; k < 3; ++k) {
    cone.R[cone.size] = cone.CalcR(soft, AddWeights(bodies[0], bodies[1]));
    cone.Add(soft, motion, Vector6d::Unit(k), 0.0, apart[k], error[k]);
  }
  SetForces(row, cone, true, [](auto* /*force*/) {});
}

void ConstraintLaw::SetContact(size_t row) {
  const mjModel& m = adapter_->engine();
  const ConstraintRow& it = response_->rows[row];
  const EngineContact contact = TakePair(response_->engine_contacts[static_cast<size_t>(it.id)]);
  const int link1 = geoms_[static_cast<size_t>(contact.geom1)].link;
  const int link2 = geoms_[static_cast<size_t>(contact.geom2)].link;
  if (link1 == WholeRobot::kNoLink || link2 == WholeRobot::kNoLink) return;
  const Place place = FindPlace(contact);
  PointMotion motion;
  AddMotion(Follow(link2), place.position, place.position_error, 1.0, &motion);
  AddMotion(Follow(link1), place.position, place.position_error, -1.0, &motion);
  const double r = place.distance - contact.margin;
  const Softness soft =
      CalcSoftness(m.opt, contact.solref.data(), contact.solimp.data(), r, place.distance_error);
  const InverseInertia weight = AddWeights(m.geom_bodyid[contact.geom1], m.geom_bodyid[contact.geom2]);
  // Rows of the contact's Jacobian: normal, tangents, spin, rolling.
  const auto along = [&](int k) {
    Vector6d direction = Vector6d::Zero();
    direction.segment<3>(k < 3 ? 0 : 3) = place.frame.row(k % 3);
    return direction;
  };
  const auto& mu = contact.friction;
  const auto push_only = [](auto* force) { force->front() = PushOnly(force->front()); };
  SoftCone cone;
  const double R = cone.CalcR(soft, weight), impratio = Worst(mjMINVAL, m.opt.impratio);
  if (it.type == mjCNSTR_CONTACT_PYRAMIDAL) {
    cone.R[0] = 2.0 * Squared(mu[0]) / impratio * (1.0 + Squared(mu[0])) * R;
    for (int edge = 0; edge < 2 * (contact.dim - 1); ++edge) {
      const double side = edge % 2 == 0 ? 1.0 : -1.0;
      cone.size = 0;
      cone.Add(soft, motion, along(0) + side * mu[static_cast<size_t>(edge / 2)] * along(edge / 2 + 1),
               place.normal_error, r, place.distance_error);
      SetForces(row + static_cast<size_t>(edge), cone, place.is_own, push_only);
    }
    return;
  }
  cone.R[0] = R;
  cone.Add(soft, motion, along(0), place.normal_error, r, place.distance_error);
  if (it.type == mjCNSTR_CONTACT_FRICTIONLESS) return SetForces(row, cone, place.is_own, push_only);
  Softness tangential = CalcSoftness(m.opt, contact.solref_friction.data(), contact.solimp.data(), r, 0.0);
  tangential.K = 0.0;
  for (int k = 1; k < contact.dim; ++k) {
    cone.R[cone.size] = R / impratio * Squared(mu[0] / mu[cone.size - 1]);
    cone.Add(tangential, motion, along(k), place.normal_error, 0.0, 0.0);
  }
  // With g_j = f_j sqrt(R_j / R_0) the metric is Euclid's, and the cone |g| <= slope f_0 is round.
  const double slope = mu[0] / std::sqrt(impratio);
  SetForces(row, cone, place.is_own, [&](std::array<double, 6>* force) {
    double& normal = force->front();
    double tangent = 0.0;
    for (size_t j = 1; j < cone.size; ++j) tangent += Squared((*force)[j] * slope / mu[j - 1]);
    tangent = std::sqrt(tangent);
    if (tangent <= slope * normal) return;
    const double pushed = PushOnly((normal + slope * tangent) / (1.0 + Squared(slope)));
    for (size_t j = 1; j < cone.size; ++j) (*force)[j] *= slope * pushed / tangent;
    normal = pushed;
  });
}

void ConstraintLaw::SetStep(const mjtNum* qpos, const mjtNum* qvel, const PlantResponse& response) {
  ++step_;
  qpos_ = qpos, qvel_ = qvel, response_ = &response;
  for (const auto& [column, rates] :
       {std::pair(0, static_cast<const mjtNum*>(response.qacc.data())), std::pair(1, qvel)}) {
    whole_->ReadRates(rates, &nu_);
    rates_.col(column) = nu_;
  }
  forces_.assign(response.rows.size(), RowForce{});
  for (size_t row = 0; row < forces_.size(); ++row) {
    const auto& [type, id, force] = response.rows[row];
    if (forces_[row].is_predicted) continue;
    if (type == mjCNSTR_FRICTION_DOF || type == mjCNSTR_LIMIT_JOINT) SetJointRow(row);
    if (type == mjCNSTR_EQUALITY && adapter_->engine().eq_type[id] == mjEQ_CONNECT) SetConnection(row);
    if (type >= mjCNSTR_CONTACT_FRICTIONLESS) SetContact(row);
  }
}

std::pair<double, int> ConstraintLaw::FindWorst() const {
  std::pair<double, int> worst = {0.0, -1};
  for (size_t row = 0; row < forces_.size(); ++row) {
    if (!forces_[row].is_predicted) continue;
    const double off = std::abs(response_->rows[row].force - forces_[row].law) / forces_[row].bound;
    if (IsWorse(off, worst.first)) worst = {off, static_cast<int>(row)};
  }
  return worst;
}

std::string ConstraintLaw::DescribeRow(int row) const {
  if (row < 0) return "";
  const mjModel& m = adapter_->engine();
  const auto& [type, id, force] = response_->rows[static_cast<size_t>(row)];
  if (type == mjCNSTR_LIMIT_JOINT) return "limit of joint " + NameOf(m, mjOBJ_JOINT, id);
  if (type == mjCNSTR_FRICTION_DOF) return "dry friction of joint " + NameOf(m, mjOBJ_JOINT, m.dof_jntid[id]);
  if (type == mjCNSTR_EQUALITY)
    return "joint of " + NameOf(m, mjOBJ_BODY, m.eq_obj1id[id]) + " and " +
           NameOf(m, mjOBJ_BODY, m.eq_obj2id[id]);
  const EngineContact& contact = response_->engine_contacts[static_cast<size_t>(id)];
  return "contact of " + geoms_[static_cast<size_t>(contact.geom1)].name + " and " +
         geoms_[static_cast<size_t>(contact.geom2)].name +
         (forces_[static_cast<size_t>(row)].has_own_place ? "" : ", at the engine's place");
}

}  // namespace dexcheck
