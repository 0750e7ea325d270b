#include "harness/checks/contact_compliance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "controller/common/linear_algebra.h"
#include "harness/base/worst.h"
#include "harness/checks/check_table.h"
#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {

namespace {

constexpr double kClosed = 1e-4;   // m
constexpr double kRigid = 1e-6;    // of a row's R: as good as rigid
constexpr double kNothing = 1e-9;  // of the largest eigenvalue: zero but for rounding

/// A row of the engine's constraints.
struct Row {
  int index;
  bool tangential, of_object;
};

std::vector<Row> ListRows(const mjModel& m, const mjData& d, int object) {
  std::vector<Row> rows;
  for (int i = 0; i < d.nefc; ++i) {
    // Bonds hold the object; casters have no friction.
    if (d.efc_type[i] == mjCNSTR_EQUALITY) rows.push_back({i, false, true});
    if (d.efc_type[i] == mjCNSTR_CONTACT_FRICTIONLESS) rows.push_back({i, false, false});
  }
  for (int k = 0; k < d.ncon; ++k) {
    const mjContact& c = d.contact[k];
    if (c.efc_address < 0 || d.efc_type[c.efc_address] != mjCNSTR_CONTACT_ELLIPTIC) continue;
    const bool of_object = m.geom_bodyid[c.geom1] == object || m.geom_bodyid[c.geom2] == object;
    for (int j = 0; j < c.dim; ++j) rows.push_back({c.efc_address + j, j > 0, of_object});
  }
  return rows;
}

Eigen::RowVectorXd ReadRow(const mjModel& m, const mjData& d, int row) {
  if (mj_isSparse(&m) == 0) {
    return Eigen::Map<const Eigen::RowVectorXd>(d.efc_J + static_cast<ptrdiff_t>(row) * m.nv, m.nv);
  }
  Eigen::RowVectorXd values = Eigen::RowVectorXd::Zero(m.nv);
  for (int i = 0; i < d.efc_J_rownnz[row]; ++i) {
    const int at = d.efc_J_rowadr[row] + i;
    values[d.efc_J_colind[at]] = d.efc_J[at];
  }
  return values;
}

double FindFraction(const MatrixXd& A, const VectorXd& R) {
  const VectorXd scale = R.cwiseSqrt().cwiseInverse();
  const MatrixXd S = scale.asDiagonal() * A * scale.asDiagonal();
  const VectorXd values = CalcSymmetricEigenvalues(S);
  for (const double value : values) {
    if (value > kNothing * Largest(values)) return 1.0 / (1.0 + value);
  }
  return 0.0;
}

}  // namespace

ContactSoftness FindContactSoftness(const Adapter& adapter, const Eigen::Ref<const VectorXd>& q,
                                    const Pose& X_Bo) {
  const MjModelPtr model(mj_copyModel(nullptr, &adapter.engine()));
  std::fill_n(model->pair_margin, model->npair, kClosed);
  std::fill_n(model->geom_margin, model->ngeom, kClosed);
  const MjDataPtr data = MakeData(*model);
  adapter.SetPositions(q, data->qpos);
  if (adapter.object_body() >= 0) WriteFreePose(X_Bo, data->qpos + adapter.object_qpos());
  mj_fwdPosition(model.get(), data.get());
  const std::vector<Row> rows = ListRows(*model, *data, adapter.object_body());
  if (rows.empty()) return {};

  const auto nv = static_cast<Eigen::Index>(model->nv);
  const auto count = static_cast<Eigen::Index>(rows.size());
  RowMatrixXd M(nv, nv);
  ExpandMass(*model, *data, M.data());
  MatrixXd J(count, nv);
  VectorXd R(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    J.row(i) = ReadRow(*model, *data, rows[static_cast<size_t>(i)].index);
    R[i] = data->efc_R[rows[static_cast<size_t>(i)].index];
  }
  const MatrixXd A = J * M.llt().solve(J.transpose());
  // With the rows rigid that are not chosen.
  const auto fraction = [&](bool tangential, bool of_object) {
    VectorXd chosen = R;
    for (Eigen::Index i = 0; i < count; ++i) {
      const Row& row = rows[static_cast<size_t>(i)];
      if ((tangential && !row.tangential) || (of_object && !row.of_object)) chosen[i] *= kRigid;
    }
    return FindFraction(A, chosen);
  };
  return {fraction(false, false), fraction(true, false), fraction(false, true), fraction(true, true)};
}

Vector2d CalcRollingTwist(const Base& base, const VectorXd& xi) {
  if (base.velocity == DriveVelocity::kTwist) return xi.head<2>();
  const double r = base.wheel_radius;
  return {0.5 * r * (xi[0] + xi[1]), r * (xi[0] - xi[1]) / base.wheel_distance};
}

Vector2d CalcRollingMismatch(const Base& base, const VectorXd& xi, const Vector2d& rates) {
  const Vector2d twist = CalcRollingTwist(base, xi);
  const double turn = 0.5 * base.wheel_distance * twist[1];
  return Vector2d(twist[0] + turn, twist[0] - turn) - base.wheel_radius * rates;
}

namespace {

// The largest theta (1 - theta).
constexpr double kStiffModes = 0.25;
// What a straight line leaves of the answers of modes is followed over this many steps, some tens of their
// time constants of about two steps, and looked for at this many fractions.
constexpr Eigen::Index kBendSteps = 64;
constexpr int kBendFractions = 8;

/// A rigid plant's contacts are not soft.
ContactSoftness FindSoftness(const Setup& setup) {
  if (setup.scenario().plant.type == PlantType::kRigid) return {};
  return FindContactSoftness(setup.adapter(), setup.start().q, setup.start().X_Bo);
}

/// |d/dt r| of the rigid plant by Euler's method, which leads contacts back to the constraints
/// (rigid_plant.h), beyond what (46) has; 0 of other plants.
double CalcLeadingBack(const PlantOptions& plant, const StepRecord& step, const GraspTerms& grasp) {
  if (plant.type != PlantType::kRigid || plant.integrator != Integrator::kSemiImplicitEuler) return 0.0;
  const double w = 0.5 / plant.time_step;
  double squared = 0.0;
  for (int i = 0; i < grasp.num_contacts(); ++i) {
    Vector3d rate = -2.0 * w * grasp.slip().segment<3>(3 * i) + 0.5 * grasp.slip_bias().segment<3>(3 * i);
    rate.z() += w * w * step.response.contacts[static_cast<size_t>(i)].distance;
    squared += rate.squaredNorm();
  }
  return std::sqrt(squared);
}

}  // namespace

void CalcContactBias(const Setup& setup, const StepRecord& step, const GraspModel& model, VectorXd* bias) {
  const GraspTerms& grasp = model.grasp();
  const PlantOptions& plant = setup.scenario().plant;
  *bias = grasp.slip_bias();
  if (plant.type == PlantType::kRigid) {
    *bias *= plant.integrator == Integrator::kSemiImplicitEuler ? 0.5 : 0.0;
    return;
  }
  const Matrix3d& R_Bo = step.reading.state.X_Bo.linear();
  const Vector6d& V_Bo = grasp.V_Bo();
  Vector3d turning = V_Bo.tail<3>().cross(V_Bo.head<3>());
  if (setup.model().base().type == BaseType::kDifferentialDrive) {
    const Vector6d V_B0 = model.robot().CalcLinkVelocity(-1);
    turning -= R_Bo.transpose() * V_B0.tail<3>().cross(V_B0.head<3>());
  }
  bias->noalias() += grasp.G().topRows<3>().transpose() * turning;
}

ContactCompliance::ContactCompliance(const PlantOptions& plant, const Fraction& normal,
                                     const Fraction& tangential)
    : time_step_(plant.time_step), normal_(normal), tangential_(tangential) {
  const double tc = FindContactTimeConstant(plant);
  b_ = 2.0 / (tc * plant.contact_impedance);
  k_ = 1.0 / (tc * tc * plant.contact_impedance);
  memory_ = std::exp(-time_step_ * normal.contact / tc);
}

void ContactCompliance::Add(const Eigen::Ref<const VectorXd>& force) {
  if (depth_.size() != force.size()) {
    depth_ = -normal_.force / (normal_.contact * k_) * force;
    depth_rate_ = VectorXd::Zero(force.size());
    slip_ = -tangential_.force / (tangential_.contact * b_) * force;
    normal_acceleration_ = tangent_acceleration_ = depth_rate_;
  }
  normal_acceleration_ = -normal_.contact * (b_ * depth_rate_ + k_ * depth_) - normal_.force * force;
  depth_rate_ += time_step_ * normal_acceleration_;
  depth_ += time_step_ * depth_rate_;
  tangent_acceleration_ = -tangential_.contact * b_ * slip_ - tangential_.force * force;
  slip_ += time_step_ * tangent_acceleration_;
}

ModesCompliance::ModesCompliance(const PlantOptions& plant, double normal_fraction,
                                 double tangential_fraction)
    : fraction_(Worst(normal_fraction, tangential_fraction)),
      softest_(plant, ContactCompliance::Fraction::Of(normal_fraction),
               ContactCompliance::Fraction::Of(tangential_fraction)),
      stiffest_(plant, {normal_fraction, 1.0}, {tangential_fraction, 1.0}),
      bends_(VectorXd::Zero(kBendSteps)),
      changes_(VectorXd::Zero(kBendSteps)) {
  // h of the fractions theta s, in columns: along the normal, along the tangent
  std::vector<MatrixXd> answers;
  for (int i = 0; i <= kBendFractions; ++i) {
    const double theta = static_cast<double>(i) / kBendFractions;
    ContactCompliance mode(plant, {1.0, 1.0 - theta * normal_fraction},
                           {1.0, 1.0 - theta * tangential_fraction});
    mode.Add(VectorXd::Zero(1));
    MatrixXd& h = answers.emplace_back(kBendSteps, 2);
    for (Eigen::Index k = 0; k < kBendSteps; ++k) {
      mode.Add(VectorXd::Ones(1));
      h.row(k) << mode.along_normal()[0], mode.along_tangent()[0];
    }
  }
  MatrixXd largest = MatrixXd::Zero(kBendSteps, 2);
  for (int i = 1; i < kBendFractions; ++i) {
    const double theta = static_cast<double>(i) / kBendFractions;
    const MatrixXd bend =
        theta * (answers[static_cast<size_t>(i)] - (1.0 - theta) * answers.front() - theta * answers.back());
    largest = largest.cwiseMax(bend.cwiseAbs());
  }
  bends_ = largest * Vector2d(normal_fraction, tangential_fraction);
}

void ModesCompliance::Add(const Eigen::Ref<const VectorXd>& force) {
  softest_.Add(force);
  stiffest_.Add(force);
  if (force_.size() != force.size()) force_ = force;
  change_ = force - force_;
  force_ = force;
}

double ModesCompliance::CalcSize(const std::function<double(const VectorXd&)>& norm) {
  newest_ = (newest_ + kBendSteps - 1) % kBendSteps;
  changes_[newest_] = norm(change_);
  double bent = 0.0;
  for (Eigen::Index k = 0; k < kBendSteps; ++k) bent += bends_[k] * changes_[(newest_ + k) % kBendSteps];
  // Sums of norms, where orthogonal modes would need no more than roots of sums of squares: the modes are
  // orthogonal only nearly, since normals have a stiffness and tangents have none. What they mix is of the
  // order of s besides: `curve-real` at impedance 0.9, s = 0.61, exceeded the sum by up to 1.24.
  const auto both = [&](const VectorXd& softest, const VectorXd& stiffest) {
    return norm(softest) + kStiffModes * norm(stiffest);
  };
  return (1.0 + fraction_) * (both(softest_.along_normal(), stiffest_.along_normal()) +
                              both(softest_.along_tangent(), stiffest_.along_tangent()) + bent);
}

PredictionCompliance::PredictionCompliance(const Setup& setup)
    : PredictionCompliance(setup, FindSoftness(setup)) {}

PredictionCompliance::PredictionCompliance(const Setup& setup, const ContactSoftness& softness)
    : setup_(&setup),
      mass_(setup.model().base_with_wheels().mass),
      force_(setup.scenario().plant, softness.fraction, softness.tangential_fraction),
      f_c_(setup.scenario().plant, softness.object_fraction, softness.object_tangential_fraction),
      push_(force_),
      grasp_(force_),
      tips_(setup.scenario().plant, ContactCompliance::Fraction::Of(0.0),
            ContactCompliance::Fraction::Whole()),
      tyres_(tips_),
      sideways_(VectorXd::Zero(1)) {
  for (const Joint& joint : setup.model().joints()) mass_ += joint.body.mass;
}

void PredictionCompliance::Follow(const StepRecord& step, const DeclaredStep& declared,
                                  const VectorXd& contact_bias, const VectorXd& force, const VectorXd& f_c,
                                  double uneven, const std::function<double(const VectorXd&)>& norm) {
  const GraspTerms& grasp = declared.model->grasp();
  force_.Add(force);
  f_c_.Add(f_c);
  tips_.Add(contact_bias);
  if (!step.response.wheels.empty()) {
    const VectorXd& xi = step.reading.state.xi;
    const double turn = std::abs(CalcRollingTwist(setup_->model().base(), xi)[1]);
    const double forward = std::abs(CalcRollingTwist(setup_->model().base(), xi)[0]);
    // v w of the platform, and w^2 b / 2 of each wheel about its middle
    sideways_[0] = turn * (forward + 0.5 * setup_->model().base().wheel_distance * turn);
    tyres_.Add(sideways_);
  }
  double held = force_.CalcSize(norm);
  const auto length = [](const VectorXd& f) { return f.norm(); };
  // |f|_M^-1 of a force on all masses is |f| / sqrt(m), |a|_M of their acceleration |a| sqrt(m).
  const double root = std::sqrt(mass_);
  if (!declared.is_ideal) {
    // A push changes contact forces without any torque, and what pushes sideways is held by tyres and is no
    // part of a force on xi.
    push_.Add(declared.push);
    grasp_force_.noalias() = grasp.J_B().transpose() * f_c;
    grasp_.Add(grasp_force_);
    held += grasp_.CalcSize(norm) + push_.CalcSize(length) / root;
  }
  held_ = Worst(held, force_.softest().memory() * held_);
  held_of_f_c_ = Worst(f_c_.CalcSize(length), f_c_.softest().memory() * held_of_f_c_);
  const double tips = Worst(tips_.size(), CalcLeadingBack(setup_->scenario().plant, step, grasp));
  motion_ = held_ + root * (tips + tyres_.size()) + uneven;
  contact_force_ = held_of_f_c_ + setup_->object().body.mass * (tips + motion_ / root);
  sinking_ = norm(force_.softest().rate()) / root;
}

}  // namespace dexcheck
