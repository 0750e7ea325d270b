// Preloaded into the program, stands for a MuJoCo library of another version, or for a fault of the
// program.

#include <cstdlib>
#include <stdexcept>

extern "C" int mj_version() {
  if (std::getenv("TEST_MISTAKE") != nullptr) throw std::invalid_argument("size: must be positive, got -1");
  return 231;
}
