#pragma once

// Which column of a recording is which quantity of which joint.

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/model/robot_model.h"
#include "harness/descriptions/robot_description.h"
#include "harness/log/recording_reader.h"

namespace dexcheck {

enum class RecordedQuantity { kTime, kPosition, kVelocity, kAcceleration, kTorque, kCurrent, kWrench, kBase };
inline constexpr RecordedQuantity kQuantities[] = {
    RecordedQuantity::kTime,         RecordedQuantity::kPosition, RecordedQuantity::kVelocity,
    RecordedQuantity::kAcceleration, RecordedQuantity::kTorque,   RecordedQuantity::kCurrent,
    RecordedQuantity::kWrench,       RecordedQuantity::kBase};
/// "t", "q", "qd", "qdd", "tau", "current", "wrench", "base": as a file of columns names them.
const char* NameOf(RecordedQuantity quantity);

/// Force and moment: 6; position and unit quaternion, w first: 7; 0 of what joints have.
int CountComponents(RecordedQuantity quantity);

/// A column that is used: quantity = scale * number + offset, in rad, m, s, N m, N, A.
struct Channel {
  RecordedQuantity quantity = RecordedQuantity::kTime;
  int joint = -1;  ///< Or the component of the base's pose, or of wrenches, six for each.
  size_t column = 0;
  double scale = 1.0;
  double offset = 0.0;
  bool states_unit = false;  ///< Whether its name or the file of columns has a unit.
};

/// The frames in which a file gives its links' bodies.
struct LinkFrames {
  std::vector<Pose> X_iL;        ///< By link, in frame i; empty where they are the frames i.
  std::string kind = "frame i";  ///< "link frame" or "body frame".
  std::string file;              ///< Its name.

  [[nodiscard]] Pose Find(int link) const {
    return X_iL.empty() ? Pose::Identity() : X_iL[static_cast<size_t>(link)];
  }
  /// "wrist's link frame of arm.urdf".
  [[nodiscard]] std::string NameOf(const std::string& link) const;
};
LinkFrames ListLinkFrames(const RobotDescription& robot);

/// A body that is declared to be attached in one recording.
struct DeclaredPayload {
  int link = -1;
  double mass = 0.0;                ///< kg
  Vector3d com = Vector3d::Zero();  ///< In frame i, m.
};

/// The place at which a measured wrench acts on the robot.
struct WrenchPlace {
  int link = -1;
  Vector3d point = Vector3d::Zero();  ///< In frame i, m: what the moment is about.
  bool is_world = false;              ///< In world axes; otherwise in the link's own.
  double below = 0.0;  ///< How far the force acts below the point, m: where a sphere touches the ground.
  Matrix3d R_iL = Matrix3d::Identity();  ///< Axes of the link's own frame in frame i.
};

/// A recording that is open, and what its columns are.
struct Recording {
  std::string name;
  std::unique_ptr<RecordingReader> reader;
  std::vector<Channel> channels;
  std::optional<DeclaredPayload> payload;
  std::vector<WrenchPlace> wrenches;  ///< Those without a moment have three channels.
  std::function<Recording()> reopen;  ///< From its begin; empty where that cannot be.

  /// -1 where it has none.
  [[nodiscard]] int FindColumn(RecordedQuantity quantity, int joint) const;
  [[nodiscard]] bool Has(RecordedQuantity quantity) const;
};

/// Opens a recording. Columns are found by a header's words and the joints' names or numbers; a file of
/// columns (TOML) says it otherwise, and may name the files itself.
/// @param columns a file of columns; empty for none.
/// @throws InputError, one line, for columns that cannot be identified, that are missing, or that two
/// quantities share.
/// @param is_complete whether time, positions and torques or currents must be there.
/// @param frames in which a file of columns gives payloads and wrenches.
Recording OpenRecordingOf(const RobotModel& model, const std::filesystem::path& path,
                          const std::filesystem::path& columns, bool is_complete = true,
                          const LinkFrames& frames = {});

/// A robot of which nothing is known but that it has joints: to see what a recording has.
RobotModel MakeUnknownRobot(int joints);

/// A file of columns that says what was found, to start from; where nothing was found, all that it may say.
std::string DescribeColumns(const RobotModel& model, const Recording& recording,
                            const LinkFrames& frames = {});

}  // namespace dexcheck
