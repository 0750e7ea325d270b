// AdaptMjcf: any text becomes a copy that needs no further change, or an InputError that names the file.

#include "harness/engine/mjcf_passes.h"
#include "tests/fuzz/fuzz_target.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck::testing::fuzz;
  return Try("robot.xml", [&] {
    dexcheck::MjcfFile once(AsText(data, size), "robot.xml");
    dexcheck::AdaptMjcf(&once);
    for (const dexcheck::MjcfChange& change : once.changes()) Expect(change.line >= 0, "a line below zero");
    dexcheck::MjcfFile twice(once.Print(), "robot.xml");
    dexcheck::AdaptMjcf(&twice);
    Expect(twice.changes().empty(), "a copy that is not for 2.2.2", once.Print());
  });
}
