// What it takes to ask a controller that is a program: a step of ProgramController with a program that
// answers at once, less the model that is evaluated in it.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
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

}  // namespace

int main() {
  const dexcheck::testing::ShippedRun run("curve");
  const Setup& setup = run.setup();
  LoopParts parts = MakeLoopParts(
      setup, ECHO_PROGRAM, dexcheck::testing::SourcePath("/controller/parameters/assistant_robot.toml"), 1.0);
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
  fmt::print("a step {:.1f} us, of which the model {:.1f} us; transport {:.1f} us\n", step, terms,
             step - terms);
  return 0;
}
