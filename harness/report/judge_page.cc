#include <algorithm>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "harness/base/files.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/read_description.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/xml.h"
#include "harness/report/page.h"
#include "harness/report/page_frame.h"

namespace dexcheck {

namespace {

constexpr const char* kFloor = "recorded floor";

/// An MJCF of a model's joints, its links without shapes, over a floor. Joint i is called "i".
std::unique_ptr<MjcfFile> MakeSkeleton(const RobotModel& model, const std::string& source) {
  RobotDescription robot;
  robot.spec = model.spec();
  robot.spec.base.link = "base";
  for (Joint& joint : robot.spec.joints) {
    joint.name = joint.link = std::to_string(robot.joints.size());
    joint.body = {1.0, joint.body.com, Matrix3d::Identity()};
    robot.joints.emplace_back().states_range = false;
  }
  std::vector<Frame>& frames = robot.spec.frames;
  for (Frame& frame : frames) frame.name = std::to_string(&frame - frames.data());
  auto mjcf = std::make_unique<MjcfFile>(WriteMjcf(robot, "a model"), source);
  SetAttributes(
      {{"name", kFloor}, {"type", "plane"}, {"size", "3 3 1"}, {"contype", "0"}, {"conaffinity", "0"}},
      RequireSection(mjcf->root(), "worldbody")->InsertNewChildElement("geom"));
  return mjcf;
}

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
  const auto mjcf = is_mjcf ? std::make_unique<MjcfFile>(file) : MakeSkeleton(model, file.string());
  const MjModelPtr scene = LoadVisible(mjcf.get());
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
using Traces = std::vector<const TorqueTrace*>;

/// A recording's rows in time; nullptr where it has a gap.
Traces ListTraces(const RecordingJudgement& judgement, int recording) {
  Traces all, traces;
  for (const TorqueTrace& trace : judgement.traces)
    if (trace.recording == recording) all.push_back(&trace);
  std::vector<double> steps;
  for (size_t i = 1; i < all.size(); ++i) steps.push_back(all[i]->time - all[i - 1]->time);
  constexpr double kGap = 5.0;  // of usual steps
  const double gap = kGap * Median(std::move(steps));
  for (const TorqueTrace* trace : all) {
    if (!traces.empty() && trace->time - traces.back()->time > gap) traces.push_back(nullptr);
    traces.push_back(trace);
  }
  return traces;
}

/// Times of the rows, s; in a gap its middle. @param begin that times are counted from.
VectorXd CollectTimes(const Traces& traces, double begin) {
  VectorXd times(static_cast<Eigen::Index>(traces.size()));
  for (size_t row = 0; row < traces.size(); ++row) {
    const double time =
        traces[row] != nullptr ? traces[row]->time : 0.5 * (traces[row - 1]->time + traces[row + 1]->time);
    times[static_cast<Eigen::Index>(row)] = time - begin;
  }
  return times;
}

/// For each joint its torques, and below them their residuals.
std::vector<Figure> MakeFigures(const RobotModel& model, const RecordingJudgement& judgement, int recording,
                                const Traces& traces) {
  // Most of what noise makes stays within so many of its standard deviations.
  constexpr double kBand = 2.0;
  std::vector<Figure> figures;
  if (traces.empty()) return figures;
  for (const JointJudgement& balance : judgement.balances) {
    if (balance.recording != recording) continue;
    const auto place = std::ranges::find(judgement.joints, balance.joint) - judgement.joints.begin();
    const Joint& joint = model.joint(balance.joint);
    const std::string unit = joint.type == JointType::kRevolute ? " (N m)" : " (N)";
    const auto collect = [&](VectorXd TorqueTrace::*signal) {
      VectorXd values(static_cast<Eigen::Index>(traces.size()));
      std::ranges::transform(traces, values.begin(), [&](const TorqueTrace* trace) {
        return trace != nullptr ? (trace->*signal)[place] : std::numeric_limits<double>::quiet_NaN();
      });
      return values;
    };
    figures.push_back(
        {.name = "torque-" + joint.name,
         .title = joint.name,
         .label = "torque" + unit,
         .curves = {{.label = "measured", .values = collect(&TorqueTrace::measured), .wide = true},
                    {.label = "model", .values = collect(&TorqueTrace::modelled), .color = 1, .dash = 1},
                    {.label = "model and causes", .values = collect(&TorqueTrace::explained), .color = 2}}});
    figures.push_back(
        {.name = "left-" + joint.name,
         .title = "left",
         .label = "torque left" + unit,
         .band = kBand * balance.noise,
         .below = true,
         .curves = {
             {.label = "left by model and causes", .values = collect(&TorqueTrace::left), .color = 3}}});
  }
  return figures;
}

}  // namespace

std::string MakeJudgePage(const RobotModel& model, const RecordingJudgement& judgement, const Json& judged,
                          const ReplayData* replay) {
  Json json = judged;
  json["robot"] = model.name();
  // The recording's own causes come first: velocities, positions. They hold for all.
  const size_t own = judgement.causes.size() - judgement.found.size();
  for (size_t i = 0; i < judgement.causes.size(); ++i) {
    const TorqueFault* const fault = i < own ? nullptr : &judgement.found[i - own].fault;
    json.at("causes")[i]["recording"] = fault == nullptr                    ? -1
                                        : fault->kind == TorqueFault::kPush ? fault->push.recording
                                                                            : fault->recording;
  }
  const size_t recordings = json.at("recordings").size();
  std::vector<std::vector<Figure>> figures(recordings);
  std::vector<PlotGroup> groups;
  for (size_t i = 0; i < recordings; ++i) {
    const int recording = static_cast<int>(i);
    const double begin = FindTimeBegin(judgement, recording);
    json["begins"].push_back(begin);
    const Traces traces = ListTraces(judgement, recording);
    figures[i] = MakeFigures(model, judgement, recording, traces);
    if (figures[i].empty()) continue;
    groups.push_back({recordings > 1 ? json["recordings"][i].get<std::string>() : "", figures[i],
                      CollectTimes(traces, begin)});
  }
  return AssemblePlotPage(model.name() + ": " + json["verdict"].get<std::string>(), kJudgeJs,
                          EmbedJson("judgement", json), groups, replay);
}

}  // namespace dexcheck
