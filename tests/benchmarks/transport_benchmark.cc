// Measures the cost of a step of a user's own controller beyond its law: a step of each kind, less the model
// that is evaluated in it. The laws are those of harness/examples, or do nothing, so that the rest is their
// computation and the transport.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "controller/control/trajectory.h"
#include "harness/run/loop_parts.h"
#include "tests/common/paths.h"
#include "tests/harness/run/shipped_run.h"

namespace {

using namespace dexcheck;  // NOLINT: a main program

/// Median time of a call, us.
template <typename Work>
double Measure(const Work& work) {
  constexpr int kCalls = 5001;
  std::vector<double> times;
  for (int i = 0; i < kCalls; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    times.push_back(
        std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
  }
  std::nth_element(times.begin(), times.begin() + kCalls / 2, times.end());
  return times[kCalls / 2];
}

void MeasureController(const std::string& scenario, const std::string& run, const std::string& what) {
  std::vector<std::string> overrides;
  if (!run.empty()) overrides = NameController(run, std::filesystem::current_path());
  const dexcheck::testing::ShippedRun shipped(scenario, overrides);
  const Setup& setup = shipped.setup();
  LoopParts parts = MakeLoopParts(setup);
  PlantReading reading;
  parts.plant->BeginStep();
  parts.plant->Read(&reading);
  const auto rest = MakeLineTrajectory(setup.start().X_o, Vector6d::Zero(), 0.0);
  parts.controller->Follow(*rest);
  const Reading measured{reading.state, reading.touch};
  Command command;
  const double step = Measure([&] { parts.controller->Step(measured, 0.0, &command); });
  GraspModel model(setup.model(), setup.fingertips(), setup.object().body, setup.surface(),
                   setup.MakeControllerOptions());
  const double terms = Measure([&] { model.SetState(reading.state); });
  fmt::print("{:<12} {:<34} step {:7.1f} us, model {:6.1f} us, beyond it {:7.1f} us\n", scenario, what, step,
             terms, step - terms);
}

}  // namespace

int main() {
  const std::string examples = dexcheck::testing::SourcePath("/harness/examples/");
  MeasureController("panda-reach", "", "built in");
  MeasureController("panda-reach", JOINT_LAW, "library in C++, the same law");
  MeasureController("panda-reach", JOINT_PD, "library in C, PD with gravity");
  MeasureController("panda-reach", ECHO_CONTROLLER, "program in C, no law");
  MeasureController("panda-reach", examples + "numpy_joint_law.py", "Python, the same law");
  MeasureController("panda-reach", SILENT_LAW, "Python, no law");
  MeasureController("curve", "", "built in");
  MeasureController("curve", PAPER_LAW, "library in C++, the same law");
  MeasureController("curve", ECHO_CONTROLLER, "program in C, no law");
  MeasureController("curve", SILENT_LAW, "Python, no law");
  return 0;
}
