// ParseUrdf: any text is a robot or an InputError that names the file; what is read is a robot indeed.

#include "controller/dynamics/model_terms.h"
#include "harness/descriptions/urdf_reader.h"
#include "tests/fuzz/fuzz_target.h"

namespace dexcheck::testing::fuzz {
namespace {

void UseDescription(const RobotDescription& robot) {
  Expect(!robot.spec.joints.empty(), "a robot without joints");
  Expect(robot.joints.size() == robot.spec.joints.size(), "joints");
  for (const Joint& joint : robot.spec.joints) {
    if (joint.coupling) {
      Expect(
          joint.coupling->leader >= 0 && joint.coupling->leader < static_cast<int>(robot.spec.joints.size()),
          "a coupling without a leader");
    }
  }
  const RobotModel model(robot.spec);
  ModelTerms terms(model);
  terms.SetState(VectorXd::Constant(model.num_positions(), 0.1), VectorXd::Ones(model.num_velocities()));
}

}  // namespace
}  // namespace dexcheck::testing::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck::testing::fuzz;
  return Try("robot.urdf:", [&] { UseDescription(dexcheck::ParseUrdf(AsText(data, size), "robot.urdf")); });
}
