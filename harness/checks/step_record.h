#pragma once

// One step of a run as values, which checks, log, summary, studies and viewers read.

#include <algorithm>
#include <limits>
#include <vector>

#include "controller/contact/contact_geometry.h"
#include "controller/control/controller.h"
#include "controller/control/grasp_terms.h"
#include "harness/base/worst.h"
#include "harness/plant/motor_drive.h"
#include "harness/plant/plant.h"

namespace dexcheck {

/// Difference of one contact as it was followed from the contact as it is.
struct ContactDrift {
  double object = 0.0;     ///< Difference of the point alpha_o on the object, m.
  double fingertip = 0.0;  ///< Difference of the point alpha_f on the fingertip, m.
  double psi = 0.0;        ///< Difference of the angle of contact, rad.

  /// The larger of each.
  void Raise(const ContactDrift& other) {
    object = Worst(object, other.object);
    fingertip = Worst(fingertip, other.fingertip);
    psi = Worst(psi, other.psi);
  }
};

/// Writes a followed contact in the charts of the measured one; unchanged where the two are too far apart.
void FollowCharts(const Surface& tip, const Surface& object, const ContactCoordinates& measured,
                  ContactCoordinates* followed);

/// Returns the difference in the charts of the measured contact.
ContactDrift CalcContactDrift(const Surface& tip, const Surface& object, ContactCoordinates followed,
                              const ContactCoordinates& measured);

/// Distance of the object from its desired pose.
struct TrackingError {
  Vector3d position = Vector3d::Zero();  ///< X_d - X_o, world, m.
  double orientation = 0.0;              ///< Angle between R_Bo and R_Bd, rad.
  double joints = 0.0;                   ///< Largest of a joint that follows a motion of its own, rad or m.
};

/// Slip of one contact, from the plant's own velocities.
struct SlipState {
  bool touching = false;
  Vector3d velocity = Vector3d::Zero();  ///< Tangential, in the frame of the other body, m/s.
  Vector3d distance = Vector3d::Zero();  ///< Its integral, m.
  Vector3d creep = Vector3d::Zero();     ///< The part of it that is dt J_dot qvel (step_bounds.h), m.
  /// The rest of the distance at the beginning of the slip window, and of the next one.
  Vector3d window = Vector3d::Zero(), next_window = Vector3d::Zero();
  double cone_use = 0.0;     ///< |tangential force| / (mu normal force); 1 slides.
  double cone_margin = 0.0;  ///< mu normal force - |tangential force|, N.
};

/// Results of the checks at a step, besides their records.
struct StepFindings {
  VectorXd f_c;  ///< 3N, N: the plant's contact forces, each in its Sigma_cf as the model has it.
  /// Prediction of the rigid constrained system (19), (46), (48) under the same torques: xi_dot (n) and f_c
  /// (3N) of the last step that was predicted.
  VectorXd xi_dot_model, f_c_model;
  Vector6d V_Bo_dot_model = Vector6d::Zero();  ///< Its prediction for the object, Sigma_o.
  std::vector<SlipState> fingertip_slip, wheel_slip, foot_slip;
  /// 3m, N: the ground's forces on the feet of a robot that stands, world axes, by plant and rigid system.
  VectorXd foot_force, foot_force_model;

  // Totals of all steps so far.
  long contacts_lost = 0;                                              ///< Contacts of fingertips that broke.
  double least_cone_margin = std::numeric_limits<double>::infinity();  ///< Least margin of a fingertip, N.
};

/// One step: values at its beginning, except for the response. When a step fails, values after the failure
/// are those of the step before.
struct StepRecord {
  long step = 0;      ///< Steps of the run that are complete, this one included; 0 before.
  double time = 0.0;  ///< s; below zero while everything comes to rest.
  PlantReading reading;
  Reading measured;  ///< The controller's measurement of it.
  Command command;
  DriveOutput drive;  ///< Torques that the motors made of the command.
  PlantResponse response;
  TrackingError error;
  /// The model as the controller evaluated it, at the measured state; until the next step.
  const GraspModel* model = nullptr;
  /// kappa (39) as a controller that follows its contacts has them, and the distance of each from its true
  /// place. Empty for other controllers.
  std::vector<ContactCoordinates> followed_kappa;
  std::vector<ContactDrift> drift;
  StepFindings findings;  ///< Without checks empty.
};

/// Returns the pose of the object, with the angles on the controller's branch where it uses them.
[[nodiscard]] Vector6d CalcX_o(const StepRecord& step);

/// Calculates how far contacts are from where the controller followed them to; empty unless it follows them.
void CalcContactDrifts(const StepRecord& step, std::vector<ContactDrift>* drift);

/// Returns how far the object, or joints, are from the command's targets.
[[nodiscard]] TrackingError CalcTrackingError(const StepRecord& step);

}  // namespace dexcheck
