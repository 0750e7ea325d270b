#pragma once

// The paper's own simulation: (46) and (48) integrated, without an engine.
//
//   q_dot' = S' xi,  p_dot = R_Bo v,  R_dot = R_Bo [omega]x,  kappa_dot by (40)
//   [xi_dot; V_o_dot; f_c] by ConstrainedDynamics under E_bar' tau' and pushes, both held during a time step
//
// Bodies are rigid, wheels roll and fingertips stick and stay closed, whatever the forces are: friction
// cones, normal forces and traction are reported and limit nothing. Drift of the integration off the
// constraints is corrected: with r = J_B' xi - G^T V_o and the gaps g between the bodies,
//
//   d/dt r = -2 w r + [0; 0; w^2 g]            per contact
//
// which on the constraints is (46). w is constant for Runge-Kutta's method, 20/s, and 1 / (2 h) for Euler's,
// h the time step: the contact of engines, with a time constant of 2 h.

#include <memory>
#include <span>
#include <vector>

#include "controller/contact/contact_geometry.h"
#include "controller/control/constrained_dynamics.h"
#include "controller/control/grasp_terms.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/platform.h"
#include "harness/engine/velocity_map.h"
#include "harness/plant/plant.h"

namespace dexcheck {

struct RigidPlantOptions {
  double time_step = 1e-3;  ///< s.
  Integrator integrator = Integrator::kRungeKutta4;
  double finger_friction = 1.0;  ///< mu, by which the use of the friction cones is counted.
};

/// Nothing allocates in a step, once the values that are read into have their sizes.
class RigidPlant final : public Plant {
 public:
  /// @param model of robot and object. @param adapter for the engine's coordinates, which draw the scene;
  /// both outlive this. @param fingertips frames of the grasp; none for a robot that holds nothing. @param
  /// motors by entry of tau'. @throws as GraspTerms and MakeSurface.
  RigidPlant(const RobotModel& model, const Adapter& adapter, std::span<const int> fingertips,
             std::span<const Motor> motors, const RigidPlantOptions& options);

  [[nodiscard]] double time_step() const override { return options_.time_step; }
  [[nodiscard]] std::span<const Motor> motors() const override { return motors_; }

  void BeginStep() override;
  void Read(PlantReading* reading) override;
  void Push(std::span<const Wrench> wrenches) override { wrenches_.assign(wrenches.begin(), wrenches.end()); }
  void EndStep(const Eigen::Ref<const VectorXd>& tau) override;
  void Read(PlantResponse* response) override;

  void Place(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo) override;
  void AddVelocity(const MeasuredState& state, const Vector3d& v) override;
  void Translate(const Vector3d& way) override;

 private:
  struct State {
    VectorXd q, xi;
    Pose X_Bo = Pose::Identity();
    Vector6d V_Bo = Vector6d::Zero();
    std::vector<ContactCoordinates> kappa;
  };
  /// Time derivatives. The object's turn is counted from the step's beginning: R_Bo = R_start exp([turn]x).
  struct Rate {
    VectorXd q_dot, xi_dot;
    Vector3d p_dot = Vector3d::Zero();
    Vector3d turn_dot = Vector3d::Zero();
    Vector6d V_Bo_dot = Vector6d::Zero();
    VectorXd kappa_dot;  // 5 each
    VectorXd f_c;        // k, N
  };

  void FindContacts();
  void CalcCoordinateRates(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& xi,
                           VectorXd* q_dot) const;
  /// Terms and rates at a state whose object has turned by `turn` since the step's beginning.
  void Evaluate(const State& state, const Vector3d& turn, Rate* rate);
  /// Evaluates them for a robot that holds nothing, whose terms are evaluated.
  void EvaluateFree(const State& state, Rate* rate);
  /// Stores the results of Evaluate for the response.
  void KeepResponse();
  void StepRungeKutta();
  void StepEuler();
  /// state = start + dt rate; returns the turn.
  Vector3d Displace(const State& start, const Rate& rate, double dt, State* state) const;
  void RequireFinite() const;

  const RobotModel* model_;
  const Adapter* adapter_;
  bool holds_;  // an object
  std::unique_ptr<Surface> surface_;
  std::vector<Motor> motors_;
  RigidPlantOptions options_;
  ModelTerms robot_;
  GraspTerms grasp_;
  ConstrainedDynamics dynamics_;
  ActuationMap actuation_;
  VelocityMap velocity_map_;

  State state_, stage_;
  Rate k1_, k2_, k3_, k4_;
  bool has_contacts_ = false;     // whether kappa is near the contacts
  std::vector<double> gaps_;      // m, at the step's beginning
  std::vector<double> overlaps_;  // their opposites
  VectorXd force_, pushed_;       // E_bar' tau' (n), and with the pushes on the robot
  std::vector<Wrench> wrenches_;  // held during a step
  VectorXd tau_;                  // n
  VectorXd stabilisation_;        // k, m/s^2
  double time_ = 0.0;

  // Values of the last step, at its beginning.
  Pose X_Bo_before_ = Pose::Identity();
  std::vector<Pose> g_o_cf_before_;
  std::vector<double> gaps_before_;
  VectorXd f_c_before_, slip_before_;  // k
};

}  // namespace dexcheck
