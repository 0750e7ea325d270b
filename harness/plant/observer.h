#pragma once

// The engine's state in the paper's coordinates.

#include <span>
#include <vector>

#include "controller/contact/contact_geometry.h"
#include "controller/contact/shapes.h"
#include "harness/engine/velocity_map.h"
#include "harness/plant/engine_simulation.h"
#include "harness/plant/plant.h"

namespace dexcheck {

/// Copies the contacts and constraint rows of the step whose forces the engine has computed.
void ReadConstraints(const mjData& data, PlantResponse* response);

/// Reads states and accelerations of the simulation in q', xi, and the contacts of a grasp. Nothing allocates
/// after construction, once the values that are read into have their sizes.
class Observer {
 public:
  /// @param fingertips frames of the grasp, if any. @param surface of the object; outlives this.
  /// Without an object its pose is the identity, at rest.
  /// @throws InputError when a fingertip or the object has no geom that touches.
  Observer(const Adapter& adapter, std::span<const int> fingertips, const Surface& surface);

  /// Makes the contacts bonds at these coordinates, held by these constraints, one for each fingertip.
  void SetBonds(std::span<const ContactCoordinates> kappa, std::span<const int> constraints);

  /// Sets the frames on which the robot stands.
  void SetFeet(std::span<const int> frames);

  /// Reads everything except the support's force; between BeginStep and EndStep.
  void Read(const EngineSimulation& simulation, PlantReading* reading);

  /// Reads everything except the motors' torques; after EndStep, for the step whose reading was read last.
  void Read(const EngineSimulation& simulation, PlantResponse* response);

 private:
  void ReadFeet(const mjModel& m, const mjData& d, std::vector<GroundContact>* feet) const;
  /// Returns the foot on that body that is nearest to a place; -1 without one.
  [[nodiscard]] int FindFoot(const mjModel& m, const mjData& d, int body, const Vector3d& place) const;
  struct BaseRates {
    Vector3d velocity = Vector3d::Zero();  // of Sigma_0's origin, world
    Vector3d omega = Vector3d::Zero();     // world
  };
  void ReadState(const mjData& data, MeasuredState* state);
  void FindContacts(const mjData& data, MeasuredState* state);
  [[nodiscard]] ContactSet FindTouching(const mjModel& m, const mjData& d) const;
  void ReadAccelerations(const mjData& d, PlantResponse* response) const;
  void ReadContacts(const mjModel& m, const mjData& d, std::vector<PlantContact>* contacts) const;
  void ReadBonds(const mjModel& m, const mjData& d, std::vector<PlantContact>* contacts) const;
  [[nodiscard]] Vector6d ReadSupportWrench(const mjModel& m, const mjData& d) const;
  void ReadDryFriction(const mjData& d, VectorXd* friction) const;
  void ReadJointLimits(const mjModel& m, const mjData& d, VectorXd* force) const;
  /// Returns the entry of xi of a degree of freedom's joint; -1 when it is none of the robot's.
  [[nodiscard]] Eigen::Index FindEntry(int dof) const;
  void ReadForces(const mjModel& m, const mjData& d, PlantResponse* response);
  [[nodiscard]] int FindFingertip(int geom) const;
  [[nodiscard]] BaseRates ReadBaseRates(const mjData& data) const;

  const Adapter* adapter_;
  std::vector<int> fingertips_;
  std::vector<Sphere> tips_;
  const Surface* surface_;
  std::vector<int> foot_sites_;
  std::vector<int> tip_sites_;
  std::vector<int> tip_geoms_;
  std::vector<int> tip_bodies_, wheel_bodies_;
  VectorXd constraint_force_;  // nv
  VelocityMap map_;
  std::vector<ContactCoordinates> bond_kappa_;
  std::vector<int> bond_constraints_;
  // Values of the last reading.
  VectorXd qpos_;  // nq
  VectorXd q_, xi_;
  double phi_ = 0.0;
  Pose X_Bo_ = Pose::Identity();
  Vector6d V_Bo_ = Vector6d::Zero();
  Pose X_W0_ = Pose::Identity();
  BaseRates rates_;
  std::vector<ContactCoordinates> kappa_;  // where the search for the next contacts starts
  std::vector<double> overlap_;
};

}  // namespace dexcheck
