#pragma once

// The contact equations (22)-(40) against the engine's motion of the two bodies that touch.

#include <functional>
#include <memory>
#include <vector>

#include "controller/contact/contact_jacobian.h"
#include "controller/contact/grasp_map.h"
#include "controller/contact/rolling.h"
#include "controller/contact/shapes.h"
#include "harness/adapter/velocity_map.h"
#include "harness/checks/check_record.h"
#include "harness/checks/random_states.h"
#include "harness/engine/engine.h"

namespace dexcheck {

/// The model's contact equations. Checks of checks put wrong ones in their place.
struct ContactFormulas {
  std::function<ContactGeometry(const Surface&, const Surface&, const ContactCoordinates&)> geometry =
      [](const Surface& fingertip, const Surface& object, const ContactCoordinates& kappa) {
        return CalcContactGeometry(fingertip, object, kappa);
      };
  std::function<void(const Contact&, Eigen::Ref<Matrix6Xd>)> grasp_map = [](const Contact& contact,
                                                                            Eigen::Ref<Matrix6Xd> G) {
    CalcGraspMap({&contact, 1}, G);
  };
  std::function<void(const Contact&, const Eigen::Ref<const Matrix6Xd>&, Eigen::Ref<MatrixXd>)> jacobian =
      CalcContactJacobian;
  std::function<Vector5d(const ContactGeometry&, const Vector6d&)> kappa_dot = CalcKappaDot;
};

/// Puts the object against one fingertip at random contact coordinates and compares, with the engine's
/// Jacobians of the two bodies at the contact point: g_o_cf, J_B', G, and whether Sigma_cf, moved by (40),
/// stays one frame on both.
class ContactCheck {
 public:
  /// @throws InputError unless the robot has fingertips and an object that is a free torus or another smooth
  /// solid.
  explicit ContactCheck(const Adapter& adapter, ContactFormulas formulas = {});

  /// One contact of one fingertip at q', xi.
  void Compare(const VectorXd& q, const VectorXd& xi, StateSource* source, long sample);

  [[nodiscard]] const std::vector<CheckRecord>& records() const { return records_; }

 private:
  enum Term { kFrame, kJacobian, kGraspMap, kRolling, kTermCount };
  void PlaceObject(const Pose& X_Bo);
  [[nodiscard]] Matrix3Xd CalcPointJacobian(int body, const Vector3d& point, Matrix3Xd* angular) const;

  const Adapter* adapter_;
  ContactFormulas formulas_;
  MjModelPtr engine_;
  MjDataPtr data_;
  VelocityMap map_;
  ModelTerms terms_;
  std::unique_ptr<Surface> object_;
  int object_qpos_ = 0;
  int object_dof_ = 0;
  std::vector<CheckRecord> records_;
};

}  // namespace dexcheck
