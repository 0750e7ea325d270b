#pragma once

// Values of checks that take more than a line (check_table.cc).

#include "harness/checks/check_table.h"
#include "harness/checks/step_analysis.h"

namespace dexcheck {

/// What is left of (48), less what tilt, slip and sinking of the platform can make of it, relative.
Evaluation EvaluateRobotDynamics(const StepAnalysis& step);
/// A wheel's rim against the platform above it, (1), m/s.
Evaluation EvaluateRolling(const StepAnalysis& step);
/// Of a fingertip that touches: the plant's distance less that of the declared shapes, m.
Evaluation EvaluateContactDistance(const StepAnalysis& step);
/// Of a hemispherical fingertip, m.
Evaluation EvaluateRim(const StepAnalysis& step);
std::string DescribeFoot(const StepAnalysis& step, int part);
std::string DescribeFingertip(const StepAnalysis& step, int part);
/// How far a joint is beyond its range, rad or m.
Evaluation EvaluateJointLimit(const StepAnalysis& step);
std::string DescribeJoint(const StepAnalysis& step, int part);
/// "r_palm and bench", of the step's largest force between bodies.
std::string DescribeCollision(const StepAnalysis& step, int part);
/// Movement of joints that do not carry the object, since the beginning, rad.
std::unique_ptr<StatefulJudge> MakeIdleJointsJudge(const Setup& setup);
/// kappa integrated by (40) from how fingertip and object moved, against where the contacts are, m.
std::unique_ptr<StatefulJudge> MakeKappaJudge(const Setup& setup);

}  // namespace dexcheck
