#pragma once

// The paper's own plant: rigid robot and object, rolling contacts, integrated by Runge-Kutta's classical
// method.

#include "controller/contact/contact_geometry.h"
#include "controller/control/constrained_dynamics.h"
#include "controller/model/platform.h"
#include "tests/controller/control/grasp_scene.h"

namespace dexcheck::testing {

/// Integrates q', xi, X_o, X_o_dot, kappa and the work of the actuators.
class IdealSimulation {
 public:
  explicit IdealSimulation(GraspScene* scene)
      : scene_(scene), dynamics_(scene->model, scene->grasp.num_contacts()) {}

  [[nodiscard]] double time() const { return time_; }
  /// Work of E_bar' tau' less that lost in viscous friction since the start, J.
  [[nodiscard]] double work() const { return work_; }

  /// Kinetic and potential energy of robot and object, J.
  [[nodiscard]] double CalcEnergy() const {
    const EnergyAndMomentum robot = scene_->robot.CalcEnergyAndMomentum();
    return robot.kinetic + robot.potential + CalcObjectKineticEnergy(scene_->object, scene_->grasp.V_Bo()) +
           CalcObjectPotentialEnergy(scene_->object, scene_->model.gravity(), scene_->X_o.head<3>());
  }

  /// One step of dt (s). `law(time)` returns E_bar' tau' (n) for the scene's state.
  /// @param project afterwards moves xi back onto (45).
  template <typename Law>
  void Step(double dt, const Law& law, bool project = true) {
    const State start = {scene_->q, scene_->xi, scene_->X_o, scene_->X_o_dot, scene_->kappa};
    const Rate k1 = CalcRate(time_, law);
    SetState(start, k1, dt / 2.0);
    const Rate k2 = CalcRate(time_ + dt / 2.0, law);
    SetState(start, k2, dt / 2.0);
    const Rate k3 = CalcRate(time_ + dt / 2.0, law);
    SetState(start, k3, dt);
    const Rate k4 = CalcRate(time_ + dt, law);
    const Rate mean = (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0;
    SetState(start, mean, dt);
    work_ += dt * mean[mean.size() - 1];
    time_ += dt;
    for (size_t i = 0; i < scene_->kappa.size(); ++i) {
      scene_->kappa[i] =
          NormalizeContact(scene_->grasp.tip(static_cast<int>(i)), scene_->surface, scene_->kappa[i]);
    }
    if (project) {
      scene_->ProjectVelocity();
    } else {
      scene_->SetState();
    }
  }

 private:
  struct State {
    VectorXd q, xi;
    Vector6d X_o, X_o_dot;
    std::vector<ContactCoordinates> kappa;
  };
  /// [q_dot'; xi_dot; X_o_dot; X_o_ddot; kappa_dot of each contact; power].
  using Rate = VectorXd;

  template <typename Law>
  Rate CalcRate(double time, const Law& law) {
    GraspScene& s = *scene_;
    const VectorXd force = law(time);
    const Prediction& p = dynamics_.Predict(s.robot, s.grasp, force);
    const Eigen::Index joints = s.model.num_joints();
    VectorXd q_dot(s.q.size());
    q_dot.head<3>() =
        CalcPlatformConstraint(s.model.base(), s.q.head<3>(), s.xi.head<2>()).S_v * s.xi.head<2>();
    q_dot.tail(joints) = s.xi.tail(joints);
    VectorXd kappa_dot(5 * s.grasp.num_contacts());
    for (int i = 0; i < s.grasp.num_contacts(); ++i) {
      kappa_dot.segment<5>(5 * i) = s.grasp.contacts()[static_cast<size_t>(i)].kappa_dot;
    }
    Rate rate(q_dot.size() + p.xi_dot.size() + 12 + kappa_dot.size() + 1);
    rate << q_dot, p.xi_dot, s.X_o_dot, CalcCoordinateAcceleration(s.grasp, p.V_Bo_dot), kappa_dot,
        s.xi.dot(force - s.robot.friction());
    return rate;
  }

  void SetState(const State& start, const Rate& rate, double dt) {
    const Eigen::Index p = start.q.size();
    const Eigen::Index n = start.xi.size();
    scene_->q = start.q + dt * rate.head(p);
    scene_->xi = start.xi + dt * rate.segment(p, n);
    scene_->X_o = start.X_o + dt * rate.segment<6>(p + n);
    scene_->X_o_dot = start.X_o_dot + dt * rate.segment<6>(p + n + 6);
    for (size_t i = 0; i < start.kappa.size(); ++i) {
      scene_->kappa[i] =
          Displace(start.kappa[i], dt * rate.segment<5>(p + n + 12 + 5 * static_cast<Eigen::Index>(i)));
    }
    scene_->SetState();
  }

  GraspScene* scene_;
  ConstrainedDynamics dynamics_;
  double time_ = 0.0;
  double work_ = 0.0;
};

}  // namespace dexcheck::testing
