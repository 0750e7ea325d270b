#include "harness/report/judge_replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "harness/base/files.h"
#include "harness/descriptions/read_description.h"
#include "harness/engine/compiled_model.h"

namespace dexcheck {
namespace {

constexpr const char* kFloor = "recorded floor";

std::string ToText(const Pose& X) {
  const Vector3d p = X.translation();
  const Eigen::Quaterniond q(X.linear());
  return fmt::format("pos=\"{:.9g} {:.9g} {:.9g}\" quat=\"{:.9g} {:.9g} {:.9g} {:.9g}\"", p.x(), p.y(), p.z(),
                     q.w(), q.x(), q.y(), q.z());
}

/// An MJCF of a model's joints, its links without shapes. Joint i is called "i".
class SkeletonText {
 public:
  explicit SkeletonText(const RobotModel& model) : model_(model) {}

  std::string Make() const {
    return "<mujoco><compiler angle=\"radian\"/><worldbody><geom name=\"" + std::string(kFloor) +
           "\" type=\"plane\" size=\"3 3 1\" contype=\"0\" conaffinity=\"0\"/><body " +
           ToText(model_.base().X_B0) + ">" + Children(-1) + "</body></worldbody></mujoco>";
  }

 private:
  [[nodiscard]] std::string Children(int parent) const {
    std::string text;
    for (const Frame& frame : model_.frames())
      if (frame.link == parent) text += "<site " + ToText(frame.X_LF) + "/>";
    for (int i = 0; i < model_.num_joints(); ++i) {
      const Joint& joint = model_.joint(i);
      if (joint.parent != parent) continue;
      const Pose X = joint.X_PB * CalcMdhTransform(joint.mdh.alpha, joint.mdh.a, joint.mdh.q, joint.mdh.d);
      const Vector3d com = joint.body.com;
      text += fmt::format(
          "<body {}><joint name=\"{}\" type=\"{}\" axis=\"0 0 1\"/><inertial pos=\"{:.9g} {:.9g} {:.9g}\" "
          "mass=\"1\" "
          "diaginertia=\"1 1 1\"/>{}</body>",
          ToText(X), i, joint.type == JointType::kPrismatic ? "slide" : "hinge", com.x(), com.y(), com.z(),
          Children(i));
    }
    return text;
  }

  const RobotModel& model_;
};

/// Below all that moves, at most at 0.
void PlaceFloor(const RunFrames& frames, mjModel* scene) {
  const int floor = mj_name2id(scene, mjOBJ_GEOM, kFloor);
  if (floor < 0) return;
  const MjDataPtr data = MakeDataWithoutContacts(*scene);
  double lowest = 0.0;
  for (long row = 0; row < frames.rows(); ++row) {
    mju_copy(data->qpos, frames.qpos.row(row).data(), static_cast<int>(scene->nq));
    mj_kinematics(scene, data.get());
    for (int geom = 0; geom < scene->ngeom; ++geom)
      if (geom != floor) lowest = std::min(lowest, data->geom_xpos[3 * geom + 2] - scene->geom_rbound[geom]);
  }
  // A base that stands on it reaches a little below.
  constexpr double kBase = 0.1;
  scene->geom_pos[3 * floor + 2] = lowest > -kBase ? 0.0 : lowest;
}

}  // namespace

double FindTimeBegin(const RecordingJudgement& judgement, int recording) {
  constexpr double kClock = 1e5;  // s
  const bool is_one = judgement.traces.empty() || judgement.traces.back().recording == 0;
  for (const TorqueTrace& trace : judgement.traces)
    if (trace.recording == recording) return is_one && trace.time < kClock ? 0.0 : trace.time;
  return 0.0;
}

std::optional<ReplayData> MakeMotionReplay(const RobotModel& model, const std::filesystem::path& file,
                                           const RecordingJudgement& judgement) {
  const bool has_ball = std::any_of(model.joints().begin(), model.joints().end(),
                                    [](const Joint& joint) { return joint.type == JointType::kBall; });
  if (has_ball || model.base().type != BaseType::kFixed) return std::nullopt;
  const bool is_mjcf = FindFormat(ReadBytes(file), file) == RobotFormat::kMjcf;
  const MjModelPtr scene =
      MakeVisible(is_mjcf ? LoadMjcf(file) : LoadMjcfText(SkeletonText(model).Make(), file.string()));
  RunFrames frames;
  frames.source = file.string();
  frames.title = model.name();
  std::vector<const TorqueTrace*> rows;
  for (const TorqueTrace& trace : judgement.traces)
    if (trace.recording == 0 && trace.q.allFinite()) rows.push_back(&trace);
  if (rows.size() < 2) return std::nullopt;
  frames.qpos = Eigen::Map<const VectorXd>(scene->qpos0, scene->nq)
                    .transpose()
                    .replicate(static_cast<long>(rows.size()), 1);
  for (size_t row = 0; row < rows.size(); ++row)
    frames.times.push_back(rows[row]->time - FindTimeBegin(judgement, 0));
  for (int i = 0; i < model.num_joints(); ++i) {
    const int joint =
        mj_name2id(scene.get(), mjOBJ_JOINT, (is_mjcf ? model.joint(i).name : std::to_string(i)).c_str());
    if (joint < 0) return std::nullopt;
    for (size_t row = 0; row < rows.size(); ++row)
      frames.qpos(static_cast<long>(row), scene->jnt_qposadr[joint]) = rows[row]->q[i];
  }
  CheckRunFrames(*scene, frames);
  PlaceFloor(frames, scene.get());
  return MakeReplayData(*scene, frames);
}

}  // namespace dexcheck
