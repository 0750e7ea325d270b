#include "harness/report/judge_page.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "harness/report/judge_replay.h"
#include "harness/report/page_assets.h"
#include "harness/report/page_frame.h"

namespace dexcheck {
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
  /// Its recording, and what it is at each joint.
  void AddToCause(const FoundFault* found, Json* json) const {
    (*json)["recording"] = -1;
    if (found == nullptr) return;
    const TorqueFault& fault = found->fault;
    const int recording = fault.kind == TorqueFault::kPush ? fault.push.recording : fault.recording;
    (*json)["recording"] = recording;
    using enum TorqueFault::Kind;
    if (fault.kind != kAllDry && fault.kind != kAllFriction && fault.kind != kAllOffsets) return;
    Json parts = Json::array();
    for (size_t k = 0; k < fault.columns.size(); ++k) {
      const ColumnPart& part = fault.columns[k].front();
      const Joint& joint = model_.joint(part.joint);
      const bool turns = joint.type == JointType::kRevolute;
      const bool is_viscous = part.column.kind == TorqueColumn::kViscous;
      const bool is_dry =
          part.column.kind == TorqueColumn::kDry || part.column.kind == TorqueColumn::kFriction;
      const auto at = static_cast<Eigen::Index>(k);
      const double nominal = is_viscous ? joint.damping : is_dry ? joint.dry_friction : 0.0;
      parts.push_back({{"joint", joint.name},
                       {"fault", is_viscous ? "viscous friction"
                                 : is_dry   ? "dry friction"
                                            : "torque offset"},
                       {"value", nominal + found->amplitude[at]},
                       {"standard_error", found->error[at]},
                       {"unit", is_viscous ? (turns ? "N m s/rad" : "N s/m")
                                : turns    ? "N m"
                                           : "N"}});
    }
    (*json)["parts"] = parts;
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
