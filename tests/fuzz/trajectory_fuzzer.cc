// ReadTrajectory: any text is a trajectory or an InputError that names the file; a trajectory can be
// evaluated.

#include "controller/common/toml_reader.h"
#include "controller/control/trajectory.h"
#include "tests/fuzz/fuzz_target.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck;
  using namespace dexcheck::testing::fuzz;
  return Try("trajectory.toml:", [&] {
    const TomlDocument document(AsText(data, size), "trajectory.toml");
    TomlTable root = document.Open();
    const std::unique_ptr<Trajectory> trajectory = ReadTrajectory(root)(Vector6d::Ones());
    Expect(trajectory->Evaluate(0.0).X_d == Vector6d::Ones(), "does not start at X_start",
           AsText(data, size));
    for (const double t : {-1.0, 0.3, 1.0, 1e6}) {
      Expect(trajectory->Evaluate(t).X_d.size() == 6, "no motion");
    }
  });
}
