#pragma once

// A controller of one's own as a shared library: a class behind Controller, made by a function, and one line:
//
//   std::unique_ptr<dexcheck::Controller> Make(const dexcheck::ControllerContext& context);
//   DEXCHECK_CONTROLLER(Make)
//
// The library is compiled with the headers and the compiler's options of the program that loads it; the
// program refuses one that differs. What the library calls of controller/ is the program's.

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "controller/control/controller.h"
#include "controller/control/grasp_controller.h"
#include "controller/control/joint_controller.h"
#include "controller/control/trajectory_controller.h"

namespace dexcheck {

/// What a controller may know before the run. References outlive the controller.
struct ControllerContext {
  const RobotModel& model;
  const std::vector<int>& fingertips;  ///< Frames of the grasp.
  const MassProperties& object;        ///< In Sigma_o.
  const Surface& surface;              ///< Of the object, Sigma_o.
  /// Gains, weights, posture and forces of the scenario, and where the object starts.
  const GraspControllerOptions& options;
  Sampling sampling;
  /// In a scenario that moves joints, the gains of its law; null otherwise. There the robot holds nothing: no
  /// fingertips, an object that stands for none, no coordinates of it, and no motion of it that Follow could
  /// mean. What the joints should do is in command->joints when Step is called.
  const JointGains* joint_gains = nullptr;
};

/// Number of the interface: it changes with what the classes mean.
inline constexpr int kControllerInterface = 2;

/// What program and library must have in common, as text: the interface, and how the compiler lays out what
/// is handed over.
static inline std::string DescribeControllerInterface() {
  char text[160];
  std::snprintf(text, sizeof(text),
                "%d, Eigen %d.%d.%d aligned to %d, Reading %zu, Command %zu, options %zu bytes",
                kControllerInterface, EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION,
                EIGEN_MAX_ALIGN_BYTES, sizeof(Reading), sizeof(Command), sizeof(GraspControllerOptions));
  return text;
}

}  // namespace dexcheck

/// Names the function that makes the library's controller.
#define DEXCHECK_CONTROLLER(make)                                                                         \
  extern "C" const char* dexcheck_controller_interface() {                                                \
    static const std::string text = dexcheck::DescribeControllerInterface();                              \
    return text.c_str();                                                                                  \
  }                                                                                                       \
  extern "C" dexcheck::Controller* dexcheck_make_controller(const dexcheck::ControllerContext* context) { \
    return make(*context).release();                                                                      \
  }
