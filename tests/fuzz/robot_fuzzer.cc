// ParseRobotModel: any text is a robot or an InputError that names the file; the terms of a robot can be
// calculated.

#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "tests/fuzz/fuzz_target.h"

namespace dexcheck::testing::fuzz {
namespace {

void UseModel(const RobotModel& model) {
  Expect(model.num_joints() > 0, "a robot without joints");
  ModelTerms terms(model);
  terms.SetState(VectorXd::Constant(model.num_positions(), 0.1), VectorXd::Ones(model.num_velocities()));
  for (int frame = 0; frame < static_cast<int>(model.frames().size()); ++frame) {
    Expect(terms.CalcFramePose(frame).matrix().row(3).sum() == 1.0, "not a pose");
  }
}

}  // namespace
}  // namespace dexcheck::testing::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck::testing::fuzz;
  return Try("robot.toml:", [&] { UseModel(dexcheck::ParseRobotModel(AsText(data, size), "robot.toml")); });
}
