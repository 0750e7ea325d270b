#pragma once

// How a run begins: the grasp solved, the object in its place.

#include <random>
#include <vector>

#include "controller/contact/surface.h"
#include "controller/control/joint_controller.h"
#include "controller/control/joint_motion.h"
#include "controller/handling/pick_plan.h"
#include "harness/plant/observer.h"
#include "harness/scenario/robot_pair.h"

namespace dexcheck {

/// The fingers that hold the object: none, of a robot that follows a motion of its joints.
struct Hold {
  std::vector<int> fingertips;   ///< Frames of the grasp.
  std::vector<int> arm_joints;   ///< On the chains to several of them, from the base outward.
  std::vector<int> idle_joints;  ///< On no chain from the base to one of them: they should stay still.
  Hand hand;                     ///< That does a PickTask; palm_frame -1 for other tasks.
};

/// Posture, object and contacts at the start.
struct StartState {
  VectorXd q;  ///< Holds the object, or a task begins in it.
  Pose X_Bo = Pose::Identity();
  Vector6d X_o = Vector6d::Zero();  ///< On the branch with beta > 0.

  // Points of fingertips that hang on the object by ball joints, by fingertip; empty without.
  std::vector<Bond> bonds;
  std::vector<int> bond_constraints;  ///< The engine's that do it.
  std::vector<ContactCoordinates> kappa;
};

/// A pose and its coordinates.
void PlaceObject(const Pose& X_Bo, StartState* start);

/// The model's joint or frame of this name. @param key of the scenario, for messages. @throws InputError for
/// one that is none.
int RequireJoint(const Scenario& scenario, const std::string& key, const RobotModel& model,
                 const std::string& name);
int RequireFrame(const Scenario& scenario, const std::string& key, const RobotModel& model,
                 const std::string& name);

/// The next random number from -1 to 1.
double DrawSymmetric(std::mt19937_64* random);

/// The fingertips that the scenario names, and what moves them. @throws InputError for one that is none.
Hold FindHold(const Scenario& scenario, const RobotModel& model);

/// The grasp as the scenario has it, or varied at random until the fingertips reach their contacts: the
/// scenario then has the varied one. @throws InputError when they do not.
StartState SolveGrasp(const RobotModel& model, const Surface& surface, const Hold& hold, Scenario* scenario);

/// The begin of a task. The scenario gets the object's random place, `hold` the hand.
/// @throws InputError for a name that is none.
StartState PlacePickTask(const RobotModel& model, const Surface& surface, Hold* hold, Scenario* scenario);

/// Hangs the fingertips on the object. @throws InputError when the engine has no constraints for it.
void MakeBonds(const Scenario& scenario, const Hold& hold, const Surface& surface, RobotPair* robots,
               StartState* start);

/// The point at which the fingertip with this pose in the object's frame touches. @param frame of the model.
ContactCoordinates FindTipContact(const RobotModel& model, int frame, const Surface& surface,
                                  const Pose& X_of);

/// The motion that joints of a robot that holds nothing should follow.
struct JointPlan {
  JointMotion motion;
  JointGains gains;
};

/// Motion and gains of the scenario's JointTask. @param start gets the posture, and the object where the MJCF
/// has it.
/// @throws InputError for a joint that is none, leaves its range or has no gain.
JointPlan MakeJointPlan(const Scenario& scenario, const RobotPair& robots, StartState* start);

}  // namespace dexcheck
