// Every surface that can be held, under a body's name of its own: run, report, render.

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::held_objects_test {
namespace {

/// An object in place of the shipped torus, of about its size, held where that is.
struct HeldObject {
  const char* body;
  const char* geom;   ///< MJCF: attributes of its geom.
  const char* asset;  ///< MJCF besides.
  const char* shape;  ///< Shape in the parameter file.
};

void PrintTo(const HeldObject& object, std::ostream* out) { *out << object.body; }

const HeldObject kObjects[] = {
    {"ball", R"(type="sphere" size="0.046" mass="0.2")", "", "shape = \"sphere\"\nradius = 0.046"},
    {"can", R"(type="cylinder" size="0.046 0.03" mass="0.2")", "",
     "shape = \"cylinder\"\nradius = 0.046\nlength = 0.06"},
    {"egg", R"(type="ellipsoid" size="0.05 0.046 0.06" mass="0.2")", "",
     "shape = \"ellipsoid\"\nsemi_axes = [0.05, 0.046, 0.06]"},
    {"brick", R"(type="box" size="0.06 0.046 0.05" mass="0.2")", "",
     "shape = \"box\"\nsize = [0.12, 0.092, 0.1]"},
    {"doughnut", R"(type="mesh" mesh="torus" user="0.035 0.011" mass="0")",
     R"(<size nuser_geom="2"/><asset><mesh name="torus" file="torus.msh"/></asset>)",
     "shape = \"torus\"\nring_radius = 0.035\ntube_radius = 0.011"}};

// Up, aside and turned: fingertips roll, and the contacts bear changing forces.
constexpr const char* kMotion =
    "trajectory={ type = 'point_to_point', xyz = [0, 5e-5, 1e-4], zyz_deg = [0.1, 0.1, 0.1], duration = 0.3 "
    "}";

class HeldObjects : public CommandTest, public ::testing::WithParamInterface<HeldObject> {
 protected:
  /// Writes robot, scene and scenario. @param geom of the MJCF.
  void WriteFiles(const std::string& geom) {
    const HeldObject& object = GetParam();
    const std::string name = object.body;
    const std::filesystem::path source = SourcePath();
    const std::filesystem::path mjcf = Path("mjcf");
    if (!std::filesystem::exists(mjcf)) {
      std::filesystem::copy(source / "mjcf", mjcf, std::filesystem::copy_options::recursive);
      std::filesystem::copy(source / "tests/harness/objects/held_pairs.xml", mjcf);
    }
    const std::string inertial = geom.find("mesh") == std::string::npos
                                     ? ""
                                     : "<inertial pos=\"0 0 0\" mass=\"0.2\" diaginertia=\"0.000137625 "
                                       "0.000137625 0.00026315\"/>";
    WriteText(mjcf / "held.xml",
              "<mujoco>" + std::string(object.asset) +
                  "<include file=\"robot.xml\"/><include file=\"stage.xml\"/><worldbody><body name=\"" +
                  name + "\" pos=\"0.6 -0.22 0.05\"><freejoint/>" + inertial + "<geom name=\"held_geom\" " +
                  geom +
                  " contype=\"0\" conaffinity=\"0\"/></body></worldbody>"
                  "<include file=\"held_pairs.xml\"/></mujoco>\n");
    const std::string robot = ReadText(source / "controller/parameters/assistant_robot.toml");
    Write("robot.toml", robot.substr(0, robot.find("[object]")) + "[object]\nbody = \"" + name +
                            "\"\nmass = 0.2\nfriction = 0.8\n" + object.shape + "\n");
    WriteChanged("hold.toml", ReadText(source / "harness/shipped/scenarios/hold.toml"), "[grasp]",
                 "[model]\nfile = \"robot.toml\"\n[plant]\nmjcf = \"mjcf/held.xml\"\n[grasp]");
  }

  /// The checks of a run that must end so.
  [[nodiscard]] Json RunHold(int exit_code) const {
    Expect(exit_code, Words("run hold.toml --set duration=0.3 --no-report --out run --set") + Words{kMotion});
    return ReadJson("run/summary.json").at("checks");
  }
};

TEST_P(HeldObjects, AreRunReportedAndDrawn) {
  WriteFiles(GetParam().geom);
  const Json checks = RunHold(0);
  for (const char* check :
       {"contact_frame", "G", "J_B", "J_B_dot_xi", "G_dot_T_V", "inverse_dynamics_object"})
    EXPECT_GT(checks[check]["max"].get<double>(), 0.0) << check;
  Expect(0, "report run");
  EXPECT_THAT(Read("run/report.html"), HasSubstr("contact_frame"));
  Expect(0, "render run --still 0.2 --forces --size 160x120 --camera grasp --out still.png");
  EXPECT_GT(std::filesystem::file_size(Path("still.png")), 1000U);
}

// A size that only one side has is found before anything moves, and at each step where fingertips touch: no
// formula of that contact is on both sides, be it the engine's (sphere, box) or exact_collision.cc's.
TEST_P(HeldObjects, OfAnotherSizeAreNamed) {
  std::string geom = GetParam().geom;
  geom = geom.find("0.046") != std::string::npos ? ReplaceOnce(geom, "0.046", "0.0461")
                                                 : ReplaceOnce(geom, "0.011", "0.0111");
  WriteFiles(geom);
  const Json checks = RunHold(1);
  for (const char* check : {"object_shape", "contact_frame", "contact_distance"})
    EXPECT_EQ(checks[check]["pass"], false) << check;
}

INSTANTIATE_TEST_SUITE_P(Surfaces, HeldObjects, ::testing::ValuesIn(kObjects),
                         [](const auto& info) { return std::string(info.param.body); });

}  // namespace
}  // namespace dexcheck::testing::held_objects_test
