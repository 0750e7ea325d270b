#pragma once

// The law (55) as printed, with matrices in X_o, and faulty versions of it.

#include "controller/contact/grasp_map.h"
#include "controller/control/grasp_terms.h"
#include "controller/control/pseudoinverse.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/platform.h"
#include "controller/object/so3.h"
#include "tests/common/linear_algebra.h"
#include "tests/controller/control/grasp_scene.h"

namespace dexcheck::testing {

/// Fault of an implementation.
enum class Fault {
  kNone,
  kNoPlatformRate,   ///< S_v_dot dropped: C_bar' = S'^T C S'.
  kNoCoriolis,       ///< C_bar' dropped.
  kNoContactRate,    ///< kappa_dot = 0 in G_dot and J_B_dot'.
  kTransposedGrasp,  ///< G built from Ad_g of the wrong direction.
};

/// tau' of (55) times E_bar' (n), and A of (56).
struct PrintedLaw {
  VectorXd force;
  Matrix6Xd A_transposed;  ///< 6 x n

  PrintedLaw(const GraspScene& scene, const Pseudoinverse& J_B_pinv, const ObjectGains& gains,
             const DesiredMotion& desired, const VectorXd& sigma_prime, const VectorXd& F_N,
             Fault fault = Fault::kNone) {
    const ModelTerms& robot = scene.robot;
    const GraspTerms& grasp = scene.grasp;
    const ObjectTerms& o = grasp.coordinates();
    MatrixXd C = robot.C();
    MatrixXd G = grasp.G();
    MatrixXd G_dot = grasp.G_dot();
    MatrixXd J_dot = grasp.J_B_dot();
    if (fault == Fault::kNoCoriolis) C.setZero();
    if (fault == Fault::kNoPlatformRate) C = CalcWithoutPlatformRate(scene);
    if (fault == Fault::kNoContactRate) DropContactRate(scene, &G_dot, &J_dot);
    if (fault == Fault::kTransposedGrasp) {
      for (int i = 0; i < grasp.num_contacts(); ++i) {
        const Pose& g = grasp.contacts()[static_cast<size_t>(i)].geometry.g_o_cf;
        G.middleCols(3 * i, 3) = CalcWrenchTransform(g.inverse()).leftCols<3>();
      }
    }
    const MatrixXd J_plus = J_B_pinv.CalcMatrix();
    const MatrixXd N = J_B_pinv.CalcProjector();
    const MatrixXd J_T = grasp.J_B().transpose();
    const MatrixXd G_plus = G.transpose() * CalcInverse(G * G.transpose());
    const VectorXd sigma = scene.xi;
    const Vector6d& X_dot = scene.X_o_dot;
    const Vector6d command = desired.X_d_ddot + gains.K_v.cwiseProduct(desired.X_d_dot - X_dot) +
                             gains.K_p.cwiseProduct(desired.X_d - scene.X_o);
    const VectorXd xi = J_plus * G.transpose() * o.P_inv * X_dot + N * sigma;
    const VectorXd bias =
        J_plus * (G_dot.transpose() * o.P_inv * X_dot + G.transpose() * o.P_inv_dot * X_dot - J_dot * xi) +
        N * sigma_prime;
    const MatrixXd A = robot.M() * J_plus * G.transpose() * o.P_inv + J_T * G_plus * o.M_o;
    A_transposed = A.transpose();
    force = J_T * (G_plus * (o.C_o * X_dot + o.N_o) + F_N) + robot.gravity() + robot.friction() + C * xi +
            robot.M() * bias + A * command;
  }

 private:
  static MatrixXd CalcWithoutPlatformRate(const GraspScene& scene) {
    const PlatformConstraint platform =
        CalcPlatformConstraint(scene.model.base(), scene.q.head<3>(), scene.xi.head<2>());
    const Eigen::Index joints = scene.model.num_joints();
    MatrixXd S = MatrixXd::Zero(3 + joints, 2 + joints);
    S.topLeftCorner<3, 2>() = platform.S_v;
    S.bottomRightCorner(joints, joints).setIdentity();
    ModelTerms unreduced(scene.model, Coordinates::kUnreduced);
    unreduced.SetState(scene.q, S * scene.xi);
    unreduced.CalcDynamics();
    return S.transpose() * unreduced.C() * S;
  }

  static void DropContactRate(const GraspScene& scene, MatrixXd* G_dot, MatrixXd* J_dot) {
    Matrix6Xd J_f(6, scene.robot.size());
    Matrix6Xd J_f_dot(6, scene.robot.size());
    for (int i = 0; i < scene.grasp.num_contacts(); ++i) {
      Contact contact = scene.grasp.contacts()[static_cast<size_t>(i)];
      contact.kappa_dot.setZero();
      scene.robot.CalcFrameJacobian(scene.fingertips[static_cast<size_t>(i)], J_f, J_f_dot);
      CalcContactJacobianDot(contact, J_f, J_f_dot, J_dot->middleRows(3 * i, 3));
    }
    G_dot->setZero();
  }
};

}  // namespace dexcheck::testing
