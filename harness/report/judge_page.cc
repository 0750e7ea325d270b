#include "harness/report/judge_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "harness/base/files.h"
#include "harness/descriptions/read_description.h"
#include "harness/engine/compiled_model.h"
#include "harness/report/page_frame.h"

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
          "mass=\"1\" diaginertia=\"1 1 1\"/>{}</body>",
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
  std::vector<const TorqueTrace*> rows;  // stretches on both sides of one that was held out have its time
  for (const TorqueTrace& trace : judgement.traces)
    if (trace.recording == 0 && trace.q.allFinite() && (rows.empty() || trace.time > rows.back()->time))
      rows.push_back(&trace);
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

namespace {

using Json = nlohmann::ordered_json;

/// Most of what noise makes stays within so many of its standard deviations.
constexpr double kBand = 2.0;

class JudgePage {
 public:
  JudgePage(const RobotModel& model, const RecordingJudgement& judgement, Json json)
      : model_(model), judgement_(judgement), json_(std::move(json)) {}

  std::string Make(const ReplayData* replay) {
    json_["robot"] = model_.name();
    const auto recordings = static_cast<int>(json_.at("recordings").size());
    for (int i = 0; i < recordings; ++i) json_["begins"].push_back(FindTimeBegin(judgement_, i));
    // The recording's own come first: velocities, positions.
    const size_t own = judgement_.causes.size() - judgement_.found.size();
    for (size_t i = 0; i < judgement_.causes.size(); ++i)
      AddToCause(i < own ? nullptr : &judgement_.found[i - own], &json_.at("causes")[i]);
    std::vector<std::vector<Figure>> figures;
    figures.reserve(static_cast<size_t>(recordings));
    std::vector<PlotGroup> groups;
    for (int i = 0; i < recordings; ++i) figures.push_back(MakeFigures(i));
    for (int i = 0; i < recordings; ++i) {
      const auto at = static_cast<size_t>(i);
      if (figures[at].empty()) continue;
      groups.push_back(
          {recordings > 1 ? json_["recordings"][at].get<std::string>() : "", figures[at], CollectTimes(i)});
    }
    return AssemblePlotPage(model_.name() + ": " + json_["verdict"].get<std::string>(), kJudgeJs,
                            EmbedJson("judgement", json_), groups, replay);
  }

 private:
  /// Its recording; -1 for all.
  void AddToCause(const FoundFault* found, Json* json) const {
    (*json)["recording"] = -1;
    if (found == nullptr) return;
    const TorqueFault& fault = found->fault;
    const int recording = fault.kind == TorqueFault::kPush ? fault.push.recording : fault.recording;
    (*json)["recording"] = recording;
  }

  /// Of a recording in time; nullptr where it has a gap.
  [[nodiscard]] std::vector<const TorqueTrace*> ListTraces(int recording) const {
    std::vector<const TorqueTrace*> all, traces;
    for (const TorqueTrace& trace : judgement_.traces)
      if (trace.recording == recording) all.push_back(&trace);
    std::vector<double> steps;
    for (size_t i = 1; i < all.size(); ++i) steps.push_back(all[i]->time - all[i - 1]->time);
    std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2),
                     steps.end());
    constexpr double kGap = 5.0;  // of usual steps
    const double gap = steps.empty() ? 0.0 : kGap * steps[steps.size() / 2];
    for (const TorqueTrace* trace : all) {
      if (!traces.empty() && trace->time - traces.back()->time > gap) traces.push_back(nullptr);
      traces.push_back(trace);
    }
    return traces;
  }

  [[nodiscard]] VectorXd CollectTimes(int recording) const {
    const std::vector<const TorqueTrace*> traces = ListTraces(recording);
    const double begin = FindTimeBegin(judgement_, recording);
    VectorXd times(static_cast<Eigen::Index>(traces.size()));
    for (size_t row = 0; row < traces.size(); ++row) {
      const double time =
          traces[row] != nullptr ? traces[row]->time : 0.5 * (traces[row - 1]->time + traces[row + 1]->time);
      times[static_cast<Eigen::Index>(row)] = time - begin;
    }
    return times;
  }

  [[nodiscard]] VectorXd Collect(int recording, VectorXd TorqueTrace::*signal, Eigen::Index place) const {
    const std::vector<const TorqueTrace*> traces = ListTraces(recording);
    VectorXd values(static_cast<Eigen::Index>(traces.size()));
    for (size_t row = 0; row < traces.size(); ++row)
      values[static_cast<Eigen::Index>(row)] =
          traces[row] != nullptr ? (traces[row]->*signal)[place] : std::numeric_limits<double>::quiet_NaN();
    return values;
  }

  [[nodiscard]] std::vector<Figure> MakeFigures(int recording) const {
    std::vector<Figure> figures;
    if (ListTraces(recording).empty()) return figures;
    for (const JointJudgement& balance : judgement_.balances) {
      if (balance.recording != recording) continue;
      const auto found = std::find(judgement_.joints.begin(), judgement_.joints.end(), balance.joint);
      const auto place = static_cast<Eigen::Index>(found - judgement_.joints.begin());
      const Joint& joint = model_.joint(balance.joint);
      const std::string unit = joint.type == JointType::kRevolute ? " (N m)" : " (N)";
      const auto collect = [&](VectorXd TorqueTrace::*signal) { return Collect(recording, signal, place); };
      figures.push_back(
          {.name = "torque-" + joint.name,
           .title = joint.name,
           .label = "torque" + unit,
           .curves = {
               {.label = "measured", .values = collect(&TorqueTrace::measured), .color = 0, .wide = true},
               {.label = "model", .values = collect(&TorqueTrace::modelled), .color = 1, .dash = 1},
               {.label = "model and causes", .values = collect(&TorqueTrace::explained), .color = 2}}});
      figures.push_back(
          {.name = "left-" + joint.name,
           .title = "left over",
           .label = "rest" + unit,
           .band = kBand * balance.noise,
           .below = true,
           .curves = {
               {.label = "beyond model and causes", .values = collect(&TorqueTrace::left), .color = 3}}});
    }
    return figures;
  }

  const RobotModel& model_;
  const RecordingJudgement& judgement_;
  Json json_;
};

}  // namespace

std::string MakeJudgePage(const RobotModel& model, const RecordingJudgement& judgement, const Json& json,
                          const ReplayData* replay) {
  return JudgePage(model, judgement, json).Make(replay);
}

}  // namespace dexcheck
