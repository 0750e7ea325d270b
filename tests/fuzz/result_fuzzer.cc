// Output of programs: any bytes are arrays, terms of the right sizes, or an InputError that names the file.

#include "harness/descriptions/program_layout.h"
#include "harness/descriptions/urdf_reader.h"
#include "harness/log/npy_file.h"
#include "tests/fuzz/fuzz_target.h"

namespace dexcheck::testing::fuzz {
namespace {

constexpr std::string_view kArm = R"(<robot name="arm"><link name="stand"/>
<link name="upper"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="a" type="continuous"><parent link="stand"/><child link="upper"/><axis xyz="0 0 1"/></joint>
<joint name="b" type="continuous"><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/></joint></robot>)";

void ExpectWhole(const NpyArray& array) {
  size_t count = 1;
  for (const size_t size : array.shape) count *= size;
  Expect(count == array.values.size(), "an array without all its numbers");
}

void ReadTerms(std::string_view text) {
  static const RobotDescription robot = ParseUrdf(kArm, "arm.urdf");
  const std::optional<nlohmann::json> answer = ParseResult(text);
  if (!answer) return;
  Try("answer:", [&] {
    const ProgramLayout layout(robot, *answer, "answer");
    TermResults terms = ReadResult(*answer, layout, VectorXd::Ones(layout.size()), "answer");
    layout.ReadTerms(VectorXd::Zero(2), VectorXd::Zero(2), &terms);
    Expect(terms.M.size() == 0 || (terms.M.rows() == 2 && terms.M.cols() == 2), "M");
    for (const VectorXd* force : {&terms.coriolis, &terms.gravity, &terms.bias, &terms.friction})
      Expect(force->size() == 0 || force->size() == 2, "forces");
  });
}

}  // namespace
}  // namespace dexcheck::testing::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck::testing::fuzz;
  const std::string_view bytes = AsText(data, size);
  Try("M.npy:", [&] { ExpectWhole(dexcheck::ParseNpy(bytes, "M.npy")); });
  ReadTerms(bytes);
  return 0;
}
