#pragma once

#include <string_view>

namespace dexcheck {

/// Cause of a disagreement of model and engine. Where checks of one rank fail in the same step, the cause
/// that stands first here explains the others.
enum class Cause {
  kNone,
  kSensing,          ///< The controller's measurements are wrong.
  kModel,            ///< The two descriptions differ: constants, kinematics, dynamics, contact geometry.
  kActuator,         ///< The motors gave other torques than were sent.
  kUnexplained,      ///< None of these was seen.
  kControlLaw,       ///< The torques are not those of the law, or the law with these gains misses the
                     ///< expectations.
  kFingertipRim,     ///< A contact has rolled past the rim of a hemispherical fingertip.
  kContactSoftness,  ///< Contacts give or creep without sliding.
  kCollision,        ///< Two bodies touch that must not.
  kSolver,           ///< The engine's solver stopped before its forces fit its motion.
  kTilt,             ///< The platform does not stay level.
  kActuatorLimit,    ///< A motor could not give its torque.
  kFingertipSlip,    ///< A fingertip slides: its force is at the edge of the friction cone.
  kWheelSlip,        ///< A wheel slides: assumption (1), rolling without slipping.
  kContactGeometry,  ///< A fingertip or the object has another shape.
  kWheelGeometry,    ///< The wheels' radius or distance is another.
  kFootSlip,         ///< A foot slides or leaves the ground.
  kSlope,            ///< The floor is not level: gravity points elsewhere.
  kUnmodelledForce,  ///< A force acts that neither the model nor the engine's description has.
  kJointLimit,       ///< A joint reached the end of its range.
  kDeclared,         ///< The scenario's declarations on plant, motors and sensors.
};

/// "model", "wheel slip", ...
const char* NameOf(Cause cause);

/// Returns the verdict on a disagreement with this cause, a sentence without capital and full stop; the one
/// of an unexplained disagreement if no cause has this name.
const char* DescribeCause(std::string_view name);

}  // namespace dexcheck
