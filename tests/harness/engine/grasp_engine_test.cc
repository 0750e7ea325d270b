// G, J_B', their rates and V_o against the engine's contact Jacobian at random grasps of the torus.

#include <gtest/gtest.h>

#include <random>

#include "controller/contact/contact_geometry.h"
#include "controller/contact/grasp_map.h"
#include "controller/contact/shapes.h"
#include "controller/dynamics/model_terms.h"
#include "controller/grasp/finger_placement.h"
#include "controller/model/parameter_reader.h"
#include "harness/engine/adapter.h"
#include "harness/engine/engine.h"
#include "harness/engine/velocity_map.h"
#include "tests/common/linear_algebra.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::grasp_engine_test {
namespace {

constexpr int kFingers = 4;

// World coordinates of some 2 m, chains of 13 joints: measured 2e-15 for the Jacobians (lengths up to 2 m).
constexpr double kRounding = 2e-14;

/// A grasp of the torus by the right hand, in both worlds, with random velocities.
class RandomGrasp : public ::testing::Test {
 protected:
  RandomGrasp()
      : model_(ReadRobotModel(SourcePath("/controller/parameters/assistant_robot.toml"))),
        engine_(LoadMjcf(SourcePath("/mjcf/scene.xml"))),
        adapter_(model_, *engine_, "scene.xml"),
        map_(adapter_, Coordinates::kReduced),
        data_(MakeData(*engine_)),
        terms_(model_),
        torus_(0.035, 0.011),
        tip_(0.009) {
    engine_->opt.jacobian = mjJAC_DENSE;  // efc_J as plain rows
    // Fingertips that just touch: the sign of a gap of rounding size must not decide whether there is a
    // contact.
    for (int pair = 0; pair < engine_->npair; ++pair) engine_->pair_margin[pair] = 1e-6;
  }

  double Draw(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  /// Draws posture and torus until the fingers reach; false after many failures.
  bool DrawGrasp() {
    const auto tips = std::span(model_.fingertips()).first(kFingers);
    for (int attempt = 0; attempt < 200; ++attempt) {
      VectorXd q(model_.num_positions());
      q.head<3>() << Draw(-1, 1), Draw(-1, 1), Draw(-kPi, kPi);
      for (int i = 0; i < model_.num_joints(); ++i) {
        const Joint& joint = model_.joint(i);
        q[3 + i] = i < 16 ? Draw(joint.lower, joint.upper) : Draw(0.0, 0.5);
      }
      terms_.SetState(q, VectorXd::Zero(terms_.size()));
      const Pose X_palm = terms_.CalcFramePose(model_.FindFrame("r_palm_frame"));
      Pose X_in_palm = Pose::Identity();
      X_in_palm.translation() = Vector3d(Draw(-4e-3, 4e-3), Draw(-4e-3, 4e-3), Draw(0.12, 0.13));
      X_in_palm.linear() = (Eigen::AngleAxisd(Draw(-0.1, 0.1), Vector3d::UnitX()) *
                            Eigen::AngleAxisd(Draw(-0.1, 0.1), Vector3d::UnitY()))
                               .toRotationMatrix();
      X_Bo_ = X_palm * X_in_palm;
      std::vector<SurfacePoint> targets;
      for (const double degrees : {125.0, 90.0, 55.0, -90.0}) {
        targets.push_back({DegToRad(degrees) + Draw(-0.1, 0.1), Draw(-0.3, 0.3), 0});
      }
      const FingerPlacement placement = SolveFingerPlacement(model_, tips, torus_, X_Bo_, targets, q);
      if (!placement.reached) continue;
      q_ = placement.q;
      SetVelocities();
      return true;
    }
    return false;
  }

  /// Random xi, and a V_o that keeps the contacts closed (slip and spin are free), in model and engine.
  void SetVelocities() {
    xi_.resize(terms_.size());
    for (double& rate : xi_) rate = Draw(-1.0, 1.0);
    for (double& rate : V_o_) rate = Draw(-0.2, 0.2);
    terms_.SetState(q_, xi_);
    CalcModelContacts();
    Eigen::Matrix<double, kFingers, 6> normal_rows;
    Eigen::Matrix<double, kFingers, 1> approach;
    for (int i = 0; i < kFingers; ++i) {
      normal_rows.row(i) = G_.col(3 * i + 2).transpose();
      approach[i] = J_B_.row(3 * i + 2) * xi_;
    }
    V_o_ += CalcPseudoinverse(normal_rows) * (approach - normal_rows * V_o_);
    CalcModelContacts();
    SetEngineState();
  }

  /// Contacts, kappa_dot, G, J_B' and their rates at q_, xi_, V_o_.
  void CalcModelContacts() {
    contacts_.clear();
    const int n = terms_.size();
    G_.resize(6, 3 * kFingers);
    G_dot_.resize(6, 3 * kFingers);
    J_B_.resize(3 * kFingers, n);
    J_B_dot_.resize(3 * kFingers, n);
    Matrix6Xd J_f(6, n);
    Matrix6Xd J_f_dot(6, n);
    for (int i = 0; i < kFingers; ++i) {
      const int frame = model_.fingertips()[static_cast<size_t>(i)];
      const Pose X_OF = X_Bo_.inverse() * terms_.CalcFramePose(frame);
      const FoundContact found = FindContact(tip_, torus_, X_OF);
      ASSERT_NEAR(found.gap, 0.0, kRounding);
      terms_.CalcFrameJacobian(frame, J_f, J_f_dot);
      Contact contact;
      contact.geometry = CalcContactGeometry(tip_, torus_, found.kappa);
      contact.kappa_dot =
          CalcKappaDot(contact.geometry, CalcRelativeTwist(contact.geometry, J_f * xi_, V_o_));
      contacts_.push_back(contact);
      CalcContactJacobian(contact, J_f, J_B_.middleRows(3 * i, 3));
      CalcContactJacobianDot(contact, J_f, J_f_dot, J_B_dot_.middleRows(3 * i, 3));
    }
    CalcGraspMap(contacts_, G_);
    CalcGraspMapDot(contacts_, G_dot_);
  }

  void SetEngineState() {
    adapter_.SetPositions(q_, data_->qpos);
    const int joint = engine_->body_jntadr[adapter_.object_body()];
    mjtNum* const pose = data_->qpos + engine_->jnt_qposadr[joint];
    const Eigen::Quaterniond rotation(X_Bo_.linear());
    const double values[7] = {X_Bo_.translation().x(),
                              X_Bo_.translation().y(),
                              X_Bo_.translation().z(),
                              rotation.w(),
                              rotation.x(),
                              rotation.y(),
                              rotation.z()};
    mju_copy(pose, values, 7);
    map_.SetState(q_, xi_);
    map_.Expand(xi_, data_->qvel);
    object_dof_ = engine_->jnt_dofadr[joint];
    const Vector3d v_world = X_Bo_.linear() * V_o_.head<3>();
    mju_copy3(data_->qvel + object_dof_, v_world.data());
    const Vector3d omega = V_o_.tail<3>();
    mju_copy3(data_->qvel + object_dof_ + 3, omega.data());
    mj_fwdPosition(engine_.get(), data_.get());
    mj_fwdVelocity(engine_.get(), data_.get());
  }

  /// The engine's contact of finger i with the torus.
  const mjContact* FindEngineContact(int finger) const {
    const int site =
        adapter_.frame_sites()[static_cast<size_t>(model_.fingertips()[static_cast<size_t>(finger)])];
    for (int i = 0; i < data_->ncon; ++i) {
      const mjContact& contact = data_->contact[i];
      const int body1 = engine_->geom_bodyid[contact.geom1];
      const int body2 = engine_->geom_bodyid[contact.geom2];
      if (body1 == engine_->site_bodyid[site] && body2 == adapter_.object_body()) return &contact;
    }
    return nullptr;
  }

  /// Contact frame Sigma_cf of finger i in the world.
  Pose CalcContactFrame(int finger) const {
    return X_Bo_ * contacts_[static_cast<size_t>(finger)].geometry.g_o_cf;
  }

  std::mt19937 random_{20223};
  RobotModel model_;
  MjModelPtr engine_;
  Adapter adapter_;
  VelocityMap map_;
  MjDataPtr data_;
  ModelTerms terms_;
  Torus torus_;
  Sphere tip_;
  VectorXd q_;
  VectorXd xi_;
  Pose X_Bo_;
  Vector6d V_o_;
  std::vector<Contact> contacts_;
  Matrix6Xd G_, G_dot_;
  MatrixXd J_B_, J_B_dot_;
  int object_dof_ = 0;
};

TEST_F(RandomGrasp, ContactJacobianIsTheEngines) {
  for (int trial = 0; trial < 50; ++trial) {
    ASSERT_TRUE(DrawGrasp());
    const int nv = static_cast<int>(engine_->nv);
    for (int finger = 0; finger < kFingers; ++finger) {
      const mjContact* contact = FindEngineContact(finger);
      ASSERT_NE(contact, nullptr);
      const Pose X_cf = CalcContactFrame(finger);
      // Row 0 of the engine's frame is the normal from fingertip to torus, our z axis.
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> frame(contact->frame);
      EXPECT_TRUE(MatrixNear(frame.row(0).transpose(), X_cf.linear().col(2), 1e-13));
      EXPECT_TRUE(MatrixNear(Eigen::Map<const Vector3d>(contact->pos), X_cf.translation(), kRounding));

      // efc_J of an elliptic contact: velocity of the torus against the fingertip, in the engine's contact
      // frame.
      ASSERT_EQ(contact->dim, 3);
      const RowMatrixXd efc_J =
          Eigen::Map<const RowMatrixXd>(data_->efc_J + contact->efc_address * nv, 3, nv);
      const Matrix3d turn = X_cf.linear().transpose() * frame.transpose();  // engine's frame to Sigma_cf
      const RowMatrixXd relative = -(turn * efc_J);
      MatrixXd T = MatrixXd::Zero(nv, terms_.size());
      for (int i = 0; i < terms_.size(); ++i) map_.Expand(VectorXd::Unit(terms_.size(), i), T.col(i).data());
      const MatrixXd J_engine = relative * T;
      EXPECT_TRUE(MatrixNear(J_B_.middleRows(3 * finger, 3), J_engine, kRounding));

      // The object's columns: qvel = [R v; omega] of its body velocity.
      Matrix6d B = Matrix6d::Identity();
      B.topLeftCorner<3, 3>() = X_Bo_.linear();
      const MatrixXd G_T_engine = -relative.middleCols(object_dof_, 6) * B;
      EXPECT_TRUE(MatrixNear(G_.middleCols(3 * finger, 3).transpose(), G_T_engine, kRounding));

      // Both together: the relative velocity that the engine's constraint sees.
      const Vector3d slip =
          J_B_.middleRows(3 * finger, 3) * xi_ - G_.middleCols(3 * finger, 3).transpose() * V_o_;
      const VectorXd slip_engine = relative * Eigen::Map<const VectorXd>(data_->qvel, nv);
      ASSERT_GT(slip.norm(), 1e-3);
      EXPECT_TRUE(MatrixNear(slip, slip_engine, 10.0 * kRounding));
    }
  }
}

/// Acceleration of a body's material point at `point` when the coordinates' rates do not change, world axes.
Vector3d CalcPointAcceleration(const mjModel* m, const mjData* d, int body, const Vector3d& point,
                               Vector3d* velocity, Vector3d* omega) {
  mjtNum v[6];
  mjtNum a[6];
  mj_objectVelocity(m, d, mjOBJ_XBODY, body, v, 0);
  mj_objectAcceleration(m, d, mjOBJ_XBODY, body, a, 0);
  const Eigen::Map<const Vector3d> origin(d->xpos + 3 * body);
  const Vector3d arm = point - origin;
  *omega = Vector3d(v[0], v[1], v[2]);
  *velocity = Vector3d(v[3], v[4], v[5]) + omega->cross(arm);
  const Vector3d alpha(a[0], a[1], a[2]);
  return Vector3d(a[3], a[4], a[5]) + alpha.cross(arm) + omega->cross(omega->cross(arm));
}

TEST_F(RandomGrasp, RatesAreTheEnginesAccelerations) {
  mju_zero3(engine_->opt.gravity);
  for (int trial = 0; trial < 50; ++trial) {
    ASSERT_TRUE(DrawGrasp());
    // Engine accelerations at constant xi and V_o.
    mju_zero(data_->qacc, static_cast<int>(engine_->nv));
    map_.ExpandBias(data_->qacc);
    const Vector3d omega_o_world = X_Bo_.linear() * V_o_.tail<3>();
    const Vector3d turning = omega_o_world.cross(X_Bo_.linear() * V_o_.head<3>());
    mju_copy3(data_->qacc + object_dof_, turning.data());
    mj_rnePostConstraint(engine_.get(), data_.get());
    for (int finger = 0; finger < kFingers; ++finger) {
      const size_t i = static_cast<size_t>(finger);
      const Pose X_cf = CalcContactFrame(finger);
      const int site = adapter_.frame_sites()[static_cast<size_t>(model_.fingertips()[i])];
      const int tip_body = engine_->site_bodyid[site];
      Vector3d v_f, v_o, omega_f, omega_o;
      const Vector3d a_f =
          CalcPointAcceleration(engine_.get(), data_.get(), tip_body, X_cf.translation(), &v_f, &omega_f);
      const Vector3d a_o = CalcPointAcceleration(engine_.get(), data_.get(), adapter_.object_body(),
                                                 X_cf.translation(), &v_o, &omega_o);
      // The contact frame moves over the fingertip at kappa_dot.
      const Vector6d over_tip = CalcFrameTwistOnFingertip(contacts_[i].geometry, contacts_[i].kappa_dot);
      const Vector3d point_over_f = X_cf.linear() * over_tip.head<3>();
      const Vector3d omega_cf = omega_f + X_cf.linear() * over_tip.tail<3>();
      const Vector3d point_over_o = v_f + point_over_f - v_o;
      // d/dt of R_cf^T (v_f(p_c) - v_o(p_c)) with p_c moving over both bodies.
      const Vector3d rate =
          a_f + omega_f.cross(point_over_f) - a_o - omega_o.cross(point_over_o) - omega_cf.cross(v_f - v_o);
      const Vector3d expected = X_cf.linear().transpose() * rate;
      const Vector3d actual =
          J_B_dot_.middleRows(3 * finger, 3) * xi_ - G_dot_.middleCols(3 * finger, 3).transpose() * V_o_;
      ASSERT_GT(expected.norm(), 1e-3);
      // Accelerations of up to 100 m/s^2, formed from rates of 10 rad/s.
      EXPECT_TRUE(MatrixNear(actual, expected, 1e-13 * (1.0 + a_f.norm() + omega_cf.norm() * v_f.norm())));
    }
  }
}

}  // namespace
}  // namespace dexcheck::testing::grasp_engine_test
