// ParseState: any text is a state of the right sizes or an InputError that names the file.

#include "controller/model/parameter_reader.h"
#include "harness/scenario/state_file.h"
#include "tests/fuzz/fuzz_target.h"

namespace dexcheck::testing::fuzz {
namespace {

// Two joints, four fingertips, an object: few enough numbers for a fuzzer to find a state.
constexpr std::string_view kHand = R"(
name = "hand"
gravity = [0, 0, -9.81]

[base]
type = "fixed"
link = "palm"

[template.finger]
frames = [
  { name = "left", link = "wrist", xyz = [0, 0.03, 0.1], sphere_radius = 0.01 },
  { name = "right", link = "wrist", xyz = [0, -0.03, 0.1], sphere_radius = 0.01 },
  { name = "thumb", link = "wrist", xyz = [0.03, 0, 0.1], sphere_radius = 0.01 },
  { name = "heel", link = "wrist", xyz = [-0.03, 0, 0.1], sphere_radius = 0.01 },
]
rows = [
  { joint = "pan", link = "mount", alpha = 0, a = 0, q = 0, d = 0.1 },
  { joint = "tilt", link = "wrist", alpha_deg = 90, a = 0, q = 0, d = 0 },
]
[template.finger.joints]
pan = { range = [-1, 1], damping = 0.1, armature = 0.01 }
tilt = { range = [-1, 1], damping = 0.1, armature = 0.01 }
[template.finger.links]
mount = { mass = 1, com = [0, 0, 0], inertia = [0.1, 0.1, 0.1, 0, 0, 0] }
wrist = { mass = 1, com = [0, 0, 0], inertia = [0.1, 0.1, 0.1, 0, 0, 0] }

[[chain]]
parent = "palm"
template = "finger"

[object]
body = "torus"
shape = "torus"
ring_radius = 0.035
tube_radius = 0.011
mass = 0.2
friction = 0.8
)";

void ExpectSizes(const State& state, const RobotModel& model) {
  Expect(state.q.size() == model.num_positions() && state.q.allFinite(), "q");
  Expect(state.xi.size() == model.num_velocities() && state.xi.allFinite(), "xi");
  if (!state.contacts) return;
  const ContactState& contacts = *state.contacts;
  const auto count = static_cast<Eigen::Index>(contacts.fingertips.size());
  Expect(count >= 3 && count <= static_cast<Eigen::Index>(model.fingertips().size()), "fingertips");
  Expect((contacts.kappa.rows() == count) != (contacts.points.rows() == count), "contacts");
  Expect(contacts.kappa.allFinite() && contacts.points.allFinite(), "contacts");
  Expect(contacts.friction > 0.0, "friction");
}

}  // namespace
}  // namespace dexcheck::testing::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck::testing::fuzz;
  static const dexcheck::RobotModel model = dexcheck::ParseRobotModel(kHand, "hand.toml");
  return Try("state.json:",
             [&] { ExpectSizes(dexcheck::ParseState(AsText(data, size), "state.json", model), model); });
}
