#pragma once

// A controller of one's own as a shared library: a class behind Controller, made by a function, and one line:
//
//   std::unique_ptr<dexcheck::Controller> Make(const dexcheck::ControllerContext& context);
//   DEXCHECK_CONTROLLER(Make)
//
// The library is compiled with the headers and the compiler's options of the program that loads it; the
// program refuses one that differs. What the library calls of controller/ is the program's.

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "controller/control/controller.h"
#include "controller/control/joint_controller.h"
#include "controller/control/trajectory_controller.h"

namespace dexcheck {

/// The parameters that a run gives its controller: "controller.NAME" of the scenario.
class ControllerParameters {
 public:
  explicit ControllerParameters(std::vector<std::pair<std::string, double>> given)
      : given_(std::move(given)) {}

  /// The number under this name; `otherwise` where the run gives none. A run that gives a number for which
  /// its controller never asks is refused.
  [[nodiscard]] double Get(const std::string& name, double otherwise) const {
    asked_.push_back(name);
    const auto found = std::ranges::find_if(given_, [&](const auto& part) { return part.first == name; });
    return found == given_.end() ? otherwise : found->second;
  }

  [[nodiscard]] const std::vector<std::pair<std::string, double>>& given() const { return given_; }
  /// The names that were asked for so far.
  [[nodiscard]] const std::vector<std::string>& asked() const { return asked_; }

 private:
  std::vector<std::pair<std::string, double>> given_;
  mutable std::vector<std::string> asked_;
};

/// Data that a controller may use before the run. References outlive the controller.
struct ControllerContext {
  const RobotModel& model;
  const std::vector<int>& fingertips;  ///< Frames of the grasp.
  const MassProperties& object;        ///< In Sigma_o.
  const Surface& surface;              ///< Of the object, Sigma_o.
  /// Gains, weights, posture and forces of the scenario, and where the object starts.
  const GraspControllerOptions& options;
  Sampling sampling;  ///< Torques must be the same for sampling.hold calls of Step from the first one on.
  /// In a scenario that moves joints, the gains of its law; null otherwise. There the robot holds nothing: no
  /// fingertips, an object that stands for none, no coordinates of it, and no motion of it that Follow could
  /// mean. What the joints should do is in command->joints when Step is called.
  const JointGains* joint_gains = nullptr;
  const ControllerParameters* parameters = nullptr;  ///< From interface 3 on; never null there.
};

/// Number of the interface: it changes with what the classes mean. A library of interface 2, which knows no
/// parameters, is still loaded.
inline constexpr int kControllerInterface = 3;
inline constexpr int kOldestControllerInterface = 2;

/// Text that must be equal in program and library: the interface's number, and the compiler's layout of the
/// types that are passed.
static inline std::string DescribeControllerInterface(int interface = kControllerInterface) {
  char text[160];
  std::snprintf(text, sizeof(text),
                "%d, Eigen %d.%d.%d aligned to %d, Reading %zu, Command %zu, options %zu bytes", interface,
                EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION, EIGEN_MAX_ALIGN_BYTES,
                sizeof(Reading), sizeof(Command), sizeof(GraspControllerOptions));
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
