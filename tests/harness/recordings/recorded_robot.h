#pragma once

// Recordings of a robot that MuJoCo moves, with faults of which the judge is not told. Nothing here uses the
// analytic model.

#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "harness/engine/engine.h"
#include "harness/recordings/channels.h"

namespace dexcheck::testing {

/// Columns by name.
struct RecordedTable {
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;

  [[nodiscard]] std::vector<double>& Get(const std::string& name);
  [[nodiscard]] size_t rows() const { return columns.front().size(); }
};

/// A fault of the robot or of the recording.
struct RecordedFault {
  std::string fault, place;  ///< Names that the judge should report.
  double value = 0.0;        ///< NaN where its size is not compared.
  std::function<void(mjModel*)> change = {};
  std::function<void(double t, const mjModel&, mjData*)> act = {};
  std::function<void(RecordedTable*)> record = {};
};

struct RecordingOptions {
  double duration = 20.0;      ///< s
  double step = 0.002;         ///< Between rows, s; a multiple of the engine's.
  double engine_step = 0.0;    ///< s; 0 for the file's.
  int encoder_bits = 12;       ///< 0 for exact positions.
  double torque_noise = 0.02;  ///< Fraction of each joint's usual torque.
  bool has_velocities = false;
  double velocity_noise = 0.005;  ///< rad/s
  /// Motion of all joints at a time; empty for sines that are drawn.
  std::function<void(double t, VectorXd* q, VectorXd* qd, VectorXd* qdd)> motion = {};
};

/// A motion of sines about a posture under computed torque of the engine's own, drawn from `random`.
RecordedTable RecordRobot(const std::string& mjcf, const std::vector<RecordedFault>& faults,
                          const RecordingOptions& options, std::mt19937* random);

/// One fault of each kind in turn, its place and size drawn.
RecordedFault DrawRecordedFault(const std::string& mjcf, int kind, std::mt19937* random);
int CountRecordedFaultKinds();
/// Returns one of these kinds: a mass at the last link.
int PayloadKind();

/// With a header.
void WriteCsv(const RecordedTable& table, const std::filesystem::path& path);

/// Converts to the judge's form.
Recording ToRecording(const RobotModel& model, const RecordedTable& table);

}  // namespace dexcheck::testing
