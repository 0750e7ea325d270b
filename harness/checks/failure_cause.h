#pragma once

#include <string_view>

namespace dexcheck {

/// Cause of a disagreement of model and engine.
enum class Cause {
  kNone,
  kModel,            ///< The two descriptions differ: constants, kinematics, dynamics, contact geometry.
  kSensing,          ///< The controller's measurements are wrong.
  kControlLaw,       ///< The torques are not those of the law, or the law with these gains misses the
                     ///< expectations.
  kActuator,         ///< The motors gave other torques than were sent.
  kActuatorLimit,    ///< A motor could not give its torque.
  kJointLimit,       ///< A joint reached the end of its range.
  kFingertipSlip,    ///< A fingertip slides: its force is at the edge of the friction cone.
  kFootSlip,         ///< A foot slides or leaves the ground.
  kWheelSlip,        ///< A wheel slides: assumption (1), rolling without slipping.
  kContactSoftness,  ///< Contacts give or creep without sliding.
  kTilt,             ///< The platform does not stay level.
  kSolver,           ///< The engine's solver stopped before its forces fit its motion.
  kUnmodelledForce,  ///< A force acts that neither the model nor the engine's description has.
  kSlope,            ///< The floor is not level: gravity points elsewhere.
  kContactGeometry,  ///< A fingertip or the object has another shape.
  kWheelGeometry,    ///< The wheels' radius or distance is another.
  kCollision,        ///< Two bodies touch that must not.
  kFingertipRim,     ///< A contact has rolled past the rim of a hemispherical fingertip.
  kDeclared,         ///< The scenario's declarations on plant, motors and sensors.
  kUnexplained,      ///< None of these was seen.
};

/// "model", "wheel slip", ...
const char* NameOf(Cause cause);

/// Returns the verdict on a disagreement with this cause, a sentence without capital and full stop; the one
/// of an unexplained disagreement if no cause has this name.
const char* DescribeCause(std::string_view name);

}  // namespace dexcheck
