#pragma once

// A small run whose every number follows from its place, with a verdict of one's choice.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/log/log_writer.h"

namespace dexcheck::testing {

inline constexpr double kReportStep = 1e-3;  // s

struct ReportRun {
  long rows = 400;
  bool has_summary = true;
  bool has_wheels = true;
  bool has_law = false;  ///< Whether it reports the forces that the law commands.
  std::string verdict = "disagreement";
  std::string scenario = "sample";
  std::string description = "made <by> hand & \"quoted\"";
};

/// Object along x: 0.5 + t; desired 1 mm ahead.
inline double ReportObjectX(double t) { return 0.5 + t; }

/// Value of the failing check "wheel_slip" (bound 1e-3 m): it passes its bound at the second of three thirds.
inline double ReportSlip(long row, long rows) { return row < rows / 3 ? 1e-5 : 4e-3; }

/// Summary as `dexcheck run` writes it, with checks in an order that the report must change.
inline std::string MakeReportSummary(const ReportRun& run) {
  nlohmann::ordered_json json = {
      {"scenario", run.scenario}, {"description", run.description},
      {"verdict", run.verdict},   {"failure", ""},
      {"interrupted", false},     {"simulated_s", kReportStep * static_cast<double>(run.rows)}};
  const bool fails = run.verdict == "disagreement";
  json["tracking"] = {{"position_error_max_m", 1e-3}, {"orientation_error_max_rad", 2e-4}};
  json["attribution"] = {{"cause", fails ? "wheel slip" : "none"},
                         {"evidence", fails ? "wheel_slip 0.004 (bound 0.001)" : ""},
                         {"checks", nlohmann::ordered_json::object()}};
  if (fails) json["attribution"]["checks"]["wheel_slip"] = "wheel slip";
  json["checks"]["link_mass"] = {{"kind", "model"}, {"max", 0.0}, {"bound", 1e-14}, {"pass", true}};
  const auto add = [&](const char* name, const char* kind, const char* unit, double max, double bound) {
    json["checks"][name] = {{"kind", kind},
                            {"max", max},
                            {"rms", max},
                            {"bound", bound},
                            {"unit", unit},
                            {"at_time_s", 0.25},
                            {"pass", !(max > bound)},
                            {"description", std::string("what ") + name + " is"}};
    if (max > bound) json["checks"][name]["failed_at_s"] = 0.133;
  };
  add("M_bar", "model", "1", 1e-16, 1e-13);
  add("inverse_dynamics_robot", "inverse_dynamics", "1", 5e-6, 1e-5);
  add("contact_force", "forward_dynamics", "1", 1e-9, 1e-6);
  add("wheel_slip", "assumption", "m", fails ? 4e-3 : 1e-5, 1e-3);
  return json.dump(2);
}

/// Writes FOLDER/log.h5, and the folder when it is not there.
inline void WriteReportRun(const std::filesystem::path& folder, const ReportRun& run = {}) {
  std::filesystem::create_directories(folder);
  LogWriter log(folder / "log.h5", std::max(run.rows, 1L));
  log.SetText("scenario", run.scenario);
  log.SetText("command", "dexcheck run sample --set 'a=<b>'");
  log.SetText("overrides", "duration=0.4\nmu=0.5\n");
  log.SetText("seed", "7");
  log.SetText("robot", "robot.toml");
  log.SetText("mjcf", "scene.xml");
  log.SetText("dexcheck_version", "0.0.1");
  log.SetText("git_revision", "0123abc-dirty");
  log.SetText("mujoco_version", "2.2.2");
  log.EmbedFile("inputs", "scenario.toml", "name = \"sample\"  # </pre><script>alert(1)</script>\n");
  log.EmbedFile("inputs", "robot/robot.toml", "name = \"robot\"\n");
  log.EmbedFile("inputs", "mjcf/scene.xml", "<mujoco/>\n");
  const std::vector<std::string> pose = {"x", "y", "z", "alpha", "beta", "gamma"};
  const std::vector<std::string> joints = {run.has_wheels ? "wheel_right" : "ankle",
                                           "waist_yaw",
                                           "r_elbow",
                                           "l_elbow",
                                           "rf1_1",
                                           "rf1_2",
                                           "lf1_1",
                                           "tail"};
  const int X_o = log.AddSignal({"object/X_o", "m, rad", "pose", 6, pose, {}});
  const int X_d = log.AddSignal({"object/X_d", "m, rad", "desired pose", 6, pose, {}});
  const int e_p = log.AddSignal({"object/position_error", "m", "error", 1, {}, {}});
  const int e_o = log.AddSignal({"object/orientation_error", "rad", "error", 1, {}, {}});
  const int q = log.AddSignal({"q", "m, rad", "positions", 4, {"x_c", "y_c", "phi", "r_elbow"}, {}});
  const int tau = log.AddSignal({"tau", "N m", "torques", 8, joints, {}});
  const int overlap = log.AddSignal({"contact/overlap", "m", "overlap", 1, {"rf1_tip"}, {}});
  const int f_c = log.AddSignal(
      {"contact/f_c", "N", "forces", 3, {"rf1_tip.x", "rf1_tip.y", "rf1_tip.z"}, {{"mu", 0.5}}});
  const int commanded =
      run.has_law ? log.AddSignal({"law/f_c", "N", "forces", 3, {"rf1_tip.x", "rf1_tip.y", "rf1_tip.z"}, {}})
                  : -1;
  std::vector<int> checks;
  const std::vector<std::pair<const char*, std::map<std::string, double>>> names = {
      {"M_bar", {{"bound", 1e-13}, {"kind", 0.0}}},
      {"inverse_dynamics_robot", {{"bound", 1e-5}, {"kind", 1.0}}},
      {"contact_force", {{"bound", 1e-6}, {"kind", 2.0}}},
      {"wheel_slip", {{"bound", 1e-3}, {"kind", 3.0}}}};
  for (const auto& [name, attributes] : names) {
    checks.push_back(log.AddSignal({std::string("check/") + name, "1", "check", 1, {}, attributes}));
  }
  log.StartRows();
  for (long row = 0; row < run.rows; ++row) {
    const double t = kReportStep * static_cast<double>(row);
    log.Row(LogWriter::kTime)[0] = t;
    for (const int pose_signal : {X_o, X_d}) {
      const std::span<double> values = log.Row(pose_signal);
      values[0] = ReportObjectX(t) + (pose_signal == X_d ? 1e-3 : 0.0);
      for (size_t k = 1; k < 6; ++k) values[k] = 0.1 * static_cast<double>(k);
    }
    log.Row(e_p)[0] = 1e-3;
    log.Row(e_o)[0] = 2e-4 * (1.0 + std::sin(20.0 * t));
    log.Row(q)[0] = t;
    for (size_t k = 0; k < joints.size(); ++k) log.Row(tau)[k] = static_cast<double>(k) + std::cos(10.0 * t);
    log.Row(overlap)[0] = 1e-6;
    log.Row(f_c)[0] = 0.3;
    log.Row(f_c)[1] = 0.4;
    log.Row(f_c)[2] = 2.0;
    if (run.has_law) {
      log.Row(commanded)[0] = log.Row(commanded)[1] = 0.0;
      log.Row(commanded)[2] = 2.5;
    }
    const double values[] = {row % 50 == 7 ? 0.0 : 1e-16, 5e-6, 1e-9, ReportSlip(row, run.rows)};
    for (size_t k = 0; k < checks.size(); ++k) log.Row(checks[k])[0] = values[k];
    log.EndRow();
  }
  if (run.has_summary) log.SetText("summary", MakeReportSummary(run));
  log.Close();
}

}  // namespace dexcheck::testing
