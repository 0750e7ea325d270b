// A joint by modified or classic Denavit-Hartenberg parameters, or by a plain transform with an axis: all say
// the same.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "controller/common/errors.h"
#include "controller/model/parameter_reader.h"
#include "tests/common/files.h"
#include "tests/common/matrix_near.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::row_forms_test {
namespace {

// A few products of rotations and lengths of size 1.
constexpr double kRounding = 1e-15;

const std::string kHead = R"(name = "rows"
gravity = [0, 0, -9.81]
[base]
type = "fixed"
link = "base"
)";

RobotModel Read(const std::string& rest) { return ParseRobotModel(kHead + rest, "rows.toml"); }

Pose Turn(const Vector3d& axis, double angle) { return Pose(Eigen::AngleAxisd(angle, axis)); }

/// The link's own frame in the frame of its joint: where its first frame stands, which the texts put at its
/// origin.
Pose OwnFrame(const RobotModel& model, int joint) {
  if (joint < 0) return Pose::Identity();
  return model.frame(joint).X_LF;
}

/// The link's own frame in its parent's own frame, at q.
Pose CalcOwnPose(const RobotModel& model, int index, double q) {
  const Joint& joint = model.joint(index);
  const bool turns = joint.type == JointType::kRevolute;
  return OwnFrame(model, joint.parent).inverse() * joint.X_PB *
         CalcMdhTransform(joint.mdh.alpha, joint.mdh.a, joint.mdh.q + (turns ? q : 0.0),
                          joint.mdh.d + (turns ? 0.0 : q)) *
         OwnFrame(model, index);
}

const std::string kEntries = R"(
frames = [{ name = "own1", link = "l1" }, { name = "own2", link = "l2" }, { name = "tip", link = "l1", xyz = [0.1, 0.2, 0.3] }]
[chain.joints]
j1 = { range = [-1, 1], damping = 0, armature = 0 }
j2 = { range = [-1, 1], damping = 0, armature = 0 }
[chain.links]
l1 = { mass = 2, com = [0.1, 0.2, 0.3], inertia = [1, 2, 2.5, 0.1, 0.2, 0.3] }
l2 = { mass = 1, com = [0, 0.2, 0], inertia = [1, 1, 1, 0, 0, 0] }
)";

TEST(ClassicRows, PlaceTheLinksFrameBehindTheJoint) {
  const RobotModel model = Read(R"([[chain]]
parent = "base"
convention = "classic"
rows = [
  { joint = "j1", link = "l1", alpha = 0.3, a = 0.5, q = 0.7, d = 0.2 },
  { joint = "j2", link = "l2", type = "prismatic", alpha = -1.1, a = 0.1, q = 0.4, d = 0.6 },
])" + kEntries);
  for (const double q : {0.0, 0.9}) {
    // Rot(z, q) Trans(z, d) Trans(x, a) Rot(x, alpha)
    const Pose first =
        Turn(Vector3d::UnitZ(), 0.7 + q) * Eigen::Translation3d(0.5, 0.0, 0.2) * Turn(Vector3d::UnitX(), 0.3);
    EXPECT_TRUE(MatrixNear(CalcOwnPose(model, 0, q).matrix(), first.matrix(), kRounding));
    const Pose second = Turn(Vector3d::UnitZ(), 0.4) * Eigen::Translation3d(0.1, 0.0, 0.6 + q) *
                        Turn(Vector3d::UnitX(), -1.1);
    EXPECT_TRUE(MatrixNear(CalcOwnPose(model, 1, q).matrix(), second.matrix(), kRounding));
  }
  // The table's values in the link's own frame are converted to frame i.
  const Pose X_iL = Eigen::Translation3d(0.5, 0.0, 0.0) * Turn(Vector3d::UnitX(), 0.3);
  const MassProperties& body = model.joints()[0].body;
  const Vector3d com(0.1, 0.2, 0.3);
  EXPECT_TRUE(MatrixNear(body.com, X_iL * com, kRounding));
  EXPECT_NEAR(body.inertia.trace(), 5.5, 8.0 * kRounding);
  EXPECT_GT((body.inertia - Matrix3d(Vector3d(1, 2, 2.5).asDiagonal())).norm(), 0.1);
  EXPECT_TRUE(MatrixNear(model.frames()[2].X_LF.translation(), X_iL * com, kRounding));
}

TEST(PlainRows, TurnAboutTheirAxis) {
  const RobotModel model = Read(R"([[chain]]
parent = "base"
pose = { xyz = [1, 0, 0] }
rows = [
  { joint = "j1", link = "l1", xyz = [0.1, 0.2, 0.3], rpy = [0.1, 0.2, 0.3], axis = [0.6, 0, -0.8] },
  { joint = "j2", link = "l2", xyz = [0, 0.5, 0], type = "prismatic", axis = "y" },
])" + kEntries);
  const Pose X_PL = Pose(Eigen::Translation3d(1.1, 0.2, 0.3)) * Turn(Vector3d::UnitZ(), 0.3) *
                    Turn(Vector3d::UnitY(), 0.2) * Turn(Vector3d::UnitX(), 0.1);
  for (const double q : {0.0, 0.9}) {
    EXPECT_TRUE(MatrixNear(CalcOwnPose(model, 0, q).matrix(),
                           (X_PL * Turn(Vector3d(0.6, 0.0, -0.8), q)).matrix(), kRounding));
    EXPECT_TRUE(MatrixNear(CalcOwnPose(model, 1, q).translation(), Vector3d(0.0, 0.5 + q, 0.0), kRounding));
  }
}

const std::string kOneRow = R"([[chain]]
parent = "base"
rows = [{ joint = "a_b.c", link = "l1", xyz = [0, 0, 0] }, { joint = "j2", link = "l2", xyz = [1, 0, 0] }]
[chain.joints]
"a_b.c" = { range = [-1, 1], damping = 0, armature = 0 }
j2 = { range = [-1, 1], damping = 0, armature = 0 }
[chain.links]
l2 = { mass = 0, com = [0, 0, 0], inertia = [0, 0, 0, 0, 0, 0] }
[chain.links.l1]
bodies = [
  { mass = 2, inertia = [0.1, 0.2, 0.25, 0, 0, 0] },
  { mass = 2, xyz = [0, 0, 1], rpy_deg = [0, 0, 90], com = [0, 0, 1], inertia = [0.1, 0.2, 0.25, 0, 0, 0] },
]
)";

TEST(OtherForms, BodiesAddUp) {
  const RobotModel model = Read(kOneRow);
  const MassProperties& body = model.joints()[0].body;
  EXPECT_EQ(model.joints()[0].name, "a_b.c");
  EXPECT_EQ(body.mass, 4.0);
  EXPECT_TRUE(MatrixNear(body.com, Vector3d(0.0, 0.0, 1.0), kRounding));
  // The second body is turned by 90 degrees: its x and y change places. Both stand 1 m from the common
  // centre.
  EXPECT_TRUE(MatrixNear(body.inertia, Matrix3d(Vector3d(4.3, 4.3, 0.5).asDiagonal()), 8.0 * kRounding));
}

std::string CatchProblem(const std::string& text, const std::string& original, const std::string& changed) {
  return MessageOf<InputError>([&] { return Read(ReplaceFirst(text, original, changed)); });
}

TEST(OtherForms, AreRefusedInOneLine) {
  EXPECT_EQ(CatchProblem(kOneRow, "xyz = [1, 0, 0]", "xyz = [1, 0, 0], alpha = 0"),
            R"(rows.toml:8: chain[0].rows[1].alpha: must not stand beside "xyz")");
  EXPECT_EQ(CatchProblem(kOneRow, "xyz = [1, 0, 0]", "axis = [1, 1, 0]"),
            "rows.toml:8: chain[0].rows[1].axis: must be a unit vector, got [1, 1, 0]");
  EXPECT_EQ(CatchProblem(kOneRow, "parent", "convention = \"dh\"\nparent"),
            R"(rows.toml:7: chain[0].convention: must be one of "modified", "classic", got "dh")");
  EXPECT_EQ(CatchProblem(kOneRow, "mass = 2, inertia = [0.1", "mass = 2, inertia = [-0.1"),
            "rows.toml:16: chain[0].links.l1.bodies[0].inertia: principal moments of inertia must not be "
            "negative, got [-0.1, 0.2, 0.25]");
  EXPECT_EQ(CatchProblem(kOneRow, "bodies", "mass = 1\nbodies"),
            R"(rows.toml:15: chain[0].links.l1.mass: must not stand beside "bodies")");
}

}  // namespace
}  // namespace dexcheck::testing::row_forms_test
