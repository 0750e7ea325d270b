#pragma once

// The numbers that the bounds of questions two to five are made of, and what they scale with. Each bound's
// formula stands in step_check_table.h.

namespace dexcheck {

// Bounds. Contacts hold by soft constraints of a time constant tc, two time steps dt unless the scenario says
// otherwise, and an impedance d. With b = 2 / (tc d), k = 1 / (d tc^2) and R = (1 - d) / (d m) of the mass m
// that the contact moves the engine lets
//
//   along a normal   r_ddot = -b r_dot - k r - R f_n
//                    at rest: r = -(1 - d) tc^2 f_n / m
//   along a tangent  v_dot = -b v - R f_t / impratio + J_dot qvel
//                    at rest: v = tc d / 2 J_dot qvel - (1 - d) tc / 2 / impratio f_t / m
//
// J_dot qvel is what (46) has and the engine's constraint has not: at a fingertip the model's J_B_dot' xi -
// G_dot^T V_Bo, and the w x v of object and platform, whose velocities the model takes along axes that turn;
// v w in a curve at a tyre. So fingertips that stick creep, tyres give sideways, the platform sinks and
// tilts, each by a load f / m or an acceleration that is the same whatever the step is; each bound below is
// that of the shipped plant (dt = 1 ms, d = 0.99, impratio = 100) and scales as its formula says (bounds.h).
// Where the paper's assumptions are judged, tc is 2 dt, the least that the engine can step, and impratio 100:
// contacts that a scenario makes softer than that need not be, and are told. Distances grow with time, at
// rates that do not: distances are judged over the last kSlipWindow at most, with kSlipWindow times the
// rate's bound.
//
// The prediction differs from the engine's motion by r_ddot and v_dot, which die out under a constant force,
// and by what tilt leaves. What they come to is computed at each step, from the engine's own A = J M^-1 J^T
// and R and from how the forces change (contact_compliance.h, contact_softness.h), and taken off above the
// bound.

/// Distances are judged from a place between half of this and this ago, s.
inline constexpr double kSlipWindow = 10.0;
/// f_t / m up to which a fingertip may creep, m/s^2: 10 N on a phalanx of 50 g. `hold` has 6, `two-hands`
/// 130.
inline constexpr double kTipLoad = 200.0;
/// f_n / m up to which it may sink in, m/s^2. `hold` has 28, `two-hands` 215.
inline constexpr double kTipPress = 500.0;
/// Acceleration v w in a curve up to which tyres may give, m/s^2. `curve` has 0.03.
inline constexpr double kSideways = 0.1;
/// Acceleration of load at a tyre, over the arm between the tyres, up to which the platform may tilt, 1/s^2.
inline constexpr double kTiltLoad = 250.0;
/// Acceleration of load that comes and goes within tc, over which the platform sinks and its wheels do not
/// roll, m/s^2.
inline constexpr double kRollLoad = 0.5;
// The shipped plant's.
inline constexpr double kShippedTimeConstant = 2e-3;  // s
inline constexpr double kShippedSoftness = 1.0 - 0.99;
inline constexpr double kShippedCreep =
    kShippedSoftness * kShippedTimeConstant / 2.0 / 100.0 * kTipLoad;          // m/s
inline constexpr double kShippedLag = kShippedTimeConstant / 2.0 * kSideways;  // m/s
inline constexpr double kShippedSinking =
    kShippedSoftness * kShippedTimeConstant * kShippedTimeConstant;  // s^2
// Bounds of the law. The engine's terms agree with the model's to some 1e-15 of their scales; the
// pseudoinverses of (47), (49) multiply that by the condition number, which is divided out, and are formed
// from Gram matrices, which have its square. Measured 6e-16 in `curve`, on a condition number of some tens.
inline constexpr double kLawTorqueBound = 1e-12;
// Where contacts slip, (47) plans for xi_c and the rigid system starts from xi: C_bar' (xi - xi_c) and
// J_dot (xi - xi_c) stay, slip speeds of some 1e-6 m/s against rates of the order of 1/s: measured 8e-10 in
// `curve`.
inline constexpr double kLawDemandBound = 1e-8;
// The solver's f_c has a residual of 1e-10 (GraspForceOptions::residual_tolerance), and F_N = f_c - G^+ F_o
// the rounding of G^+ besides.
inline constexpr double kGraspNullBound = 1e-9;
inline constexpr double kGraspConeBound = 1e-9;
// Slope of the grasp-force objective, relative: ten times the tolerance of the solver's slacks, 1e-5.
inline constexpr double kGraspOptimalityBound = 1e-4;
// A torque goes through the gear's ratio once and back: two roundings.
inline constexpr double kTorqueAppliedBound = 1e-14;
// What is left of (48) is compared less the inertia of what the platform does on soft tyres besides rolling,
// less what the solver left over, and less what tilt and slip can come to (StepChecks::CalcUnevenForce). Then
// all of it is rounding of the engine's terms, 1e-14 of forces that cancel, and products of small departures:
// 1e-5 rad of tilt times 1e-2 of the forces that change with it.
inline constexpr double kInverseDynamicsRobotBound = 1e-6;
// What law_demand leaves, over K_p = 400/s^2: 1e-8 of accelerations of some m/s^2, times a condition number
// of some tens. Measured 1.2e-9 m in `curve`.
inline constexpr double kErrorDynamicsBound = 1e-8;
inline constexpr double kOrientationDynamicsBound = 1e-7;
// Rounding of torques, over the least inertia that they drive and over K_p: measured 1e-14 for the Panda.
inline constexpr double kJointDynamicsBound = 1e-11;

// rad, m: rounding of a joint that rests exactly at the end of its range, as fingers of a closed gripper do.
inline constexpr double kJointLimitBound = 1e-12;

// m, for the shipped step of 1 ms: the error of the trapezoidal rule, (rate dt)^2 / 12 of the way. Measured
// 3e-9 at most in the shipped scenarios.
inline constexpr double kKappaBound = 0.1 * (10.0 * 1e-3) * (10.0 * 1e-3) / 12.0;

// Ten times the accuracy of distances between bodies that are apart (solid.h).
inline constexpr double kClearanceBound = 1e-6;

/// What a bound is proportional to; none of them for one that is rounding, or a fraction.
enum class Scaling {
  kNone,
  kCreep,            ///< (1 - d) dt
  kLag,              ///< dt
  kSquaredStep,      ///< dt^2
  kSinking,          ///< (1 - d) dt^2
  kSinkingRate,      ///< (1 - d) tc
  kPosture,          ///< (1 - d) dt^2 / omega_p^2 of the posture task
  kPositionGain,     ///< 1 / K_p, the least of position
  kOrientationGain,  ///< 1 / K_p, the least of orientation
};

}  // namespace dexcheck
