#pragma once

// What the plant's state means in the paper's coordinates.

#include <span>
#include <vector>

#include "controller/contact/contact_geometry.h"
#include "controller/control/grasp_controller.h"
#include "controller/handling/partial_grasp.h"
#include "harness/plant/plant.h"

namespace dexcheck {

/// One fingertip's contact as the engine has it.
struct EngineContact {
  bool touching = false;
  Vector3d position = Vector3d::Zero();  ///< World, m.
  Vector3d normal = Vector3d::Zero();    ///< World, from the fingertip into the object.
  double distance = 0.0;                 ///< m, negative when the bodies overlap.
  Vector3d force = Vector3d::Zero();     ///< World, N, of finger on object; after the forces are known.
};

/// Motion of the base that the paper's coordinates leave out.
struct BaseDeparture {
  double tilt = 0.0;    ///< Angle of the base's z axis against the vertical, rad.
  double height = 0.0;  ///< Of Sigma_0's origin against the model's, m.
};

/// Reads states and accelerations of the plant in q', xi, and the contacts of a grasp. Nothing allocates
/// after construction.
class Observer {
 public:
  /// @param fingertips frames of the grasp. @param surface of the object; outlives this.
  /// @throws InputError when a fingertip or the object has no geom that touches.
  Observer(const Adapter& adapter, std::span<const int> fingertips, const Surface& surface);

  /// The contacts are bonds at these coordinates, made by these constraints of the engine, one for each
  /// fingertip.
  void SetBonds(std::span<const ContactCoordinates> kappa, std::span<const int> constraints);

  /// Gap between fingertip and object from which on they are just far apart, m.
  static constexpr double kFar = 5e-3;

  /// q', xi, object, kappa and overlaps at the plant's state; between BeginStep and EndStep. Of a fingertip
  /// that is far from the object, kappa is the nearest place and the overlap -kFar.
  /// Tilt and height of the base, which q' does not have, are dropped; kappa is where the plant's fingertips
  /// touch.
  void Read(const Plant& plant, MeasuredState* state);
  [[nodiscard]] const BaseDeparture& departure() const { return departure_; }
  /// Pose of Sigma_0 in the world at the state read, tilt and height included.
  [[nodiscard]] const Pose& X_W0() const { return X_W0_; }

  /// xi_dot (n) and V_Bo_dot from the engine's accelerations, after EndStep.
  /// @param state what Read gave before that step.
  void ReadAccelerations(const Plant& plant, const MeasuredState& state, Eigen::Ref<VectorXd> xi_dot,
                         Vector6d* V_Bo_dot) const;

  /// Fingertips that touch the object; between BeginStep and EndStep.
  [[nodiscard]] ContactSet FindTouching(const Plant& plant) const;
  /// Wrench on the object by all else than fingertips, Sigma_o, N and N m, after EndStep.
  [[nodiscard]] Vector6d ReadSupportWrench(const Plant& plant, const Pose& X_Bo) const;

  /// What the engine's solver left over of its own equation of motion of the object, as a wrench like the one
  /// above, after EndStep.
  [[nodiscard]] Vector6d ReadSolverResidual(const Plant& plant, const Pose& X_Bo);

  /// The engine's contacts of the fingertips with their forces, after EndStep.
  [[nodiscard]] std::span<const EngineContact> ReadContacts(const Plant& plant);

  /// Forget the contacts of the last state, from which the search for the next starts.
  void Reset() { has_guess_ = false; }

 private:
  struct BaseRates {
    Vector3d velocity = Vector3d::Zero();  // of Sigma_0's origin, world
    Vector3d omega = Vector3d::Zero();     // world
  };
  void ReadBonds(const Plant& plant);
  [[nodiscard]] int FindFingertip(int geom) const;
  [[nodiscard]] BaseRates ReadBaseRates(const mjData& data) const;
  [[nodiscard]] Vector2d CalcDriveVelocity(double forward, double yaw_rate) const;

  const Adapter* adapter_;
  std::vector<int> fingertips_;
  std::vector<Sphere> tips_;
  const Surface* surface_;
  std::vector<int> tip_sites_;
  std::vector<int> tip_geoms_;
  std::vector<EngineContact> contacts_;
  VectorXd M_qacc_, constraint_force_;  // nv
  std::vector<ContactCoordinates> bond_kappa_;
  std::vector<int> bond_constraints_;
  BaseDeparture departure_;
  Pose X_W0_ = Pose::Identity();
  BaseRates rates_;
  bool has_guess_ = false;
};

}  // namespace dexcheck
