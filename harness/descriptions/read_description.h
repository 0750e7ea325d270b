#pragma once

// Files that describe a robot, each opened once.

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/descriptions/robot_description.h"
#include "harness/descriptions/urdf_reader.h"
#include "harness/engine/engine.h"

namespace dexcheck {

/// Finds the kind of description that a text holds: XML whose root element is <robot> or <mujoco>, or else a
/// parameter file, or a table of bodies when its name ends in .csv. XML without a root element has the format
/// of the name's end, so that an empty .xml is no parameter file.
/// @throws InputError "FILE: must be ..." for other XML.
RobotFormat FindFormat(std::string_view text, const std::filesystem::path& path);

/// A row of a table of bodies as CAD programs export it: masses, centres of mass and inertias of links, no
/// joints.
struct TabledBody {
  std::string link;
  MassProperties body;  ///< In the link's own frame.
  int line = 0;
};

/// Reads lines of values between commas or semicolons under a header of "link", "mass [g]", "com_x [mm]",
/// "com_y", "com_z", "ixx [g*mm^2]", "iyy", "izz", "ixy", "ixz", "iyz". A column without a unit has that of
/// the column before of its kind, or is in SI. Inertias are about the centre of mass, unless a line before
/// says "# inertia: origin".
/// @throws InputError "SOURCE:LINE: ..." for what is missing or no number.
std::vector<TabledBody> ReadBodyTable(const std::string& text, const std::string& source);

/// A parameter file, a URDF, a table of bodies, or an MJCF, which the engine compiles.
class DescriptionFile {
 public:
  /// @throws InputError for a file that cannot be read; also for a URDF or a parameter file that is none.
  explicit DescriptionFile(const std::filesystem::path& path, const UrdfOptions& options = {});
  /// Reads a text that stands for the file's.
  DescriptionFile(std::filesystem::path path, std::string text, const UrdfOptions& options);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] RobotFormat format() const { return format_; }
  [[nodiscard]] const std::string& text() const { return text_; }
  /// Returns the robot that the file describes. @throws InputError for an MJCF that can be no description
  /// (with several free bodies).
  [[nodiscard]] RobotDescription Describe() const;
  /// Returns the robot, or nothing for such an MJCF.
  [[nodiscard]] std::optional<RobotDescription> TryToDescribe() const;
  /// Puts the bodies on another file's robot. @pre the format is kBodies. @throws InputError when it has none
  /// of the links.
  void PlaceOn(const RobotDescription& other);
  /// That robot; none before.
  [[nodiscard]] const std::optional<RobotDescription>& carrier() const { return carrier_; }
  /// The document. @pre the format is kMjcf, here and below.
  [[nodiscard]] const MjcfFile& document() const { return *document_; }
  /// The largest force that joints of an MJCF allow (actuatorfrcrange), by name, N or N m. Engines before 3.0
  /// do not know it.
  [[nodiscard]] const std::map<std::string, double>& force_ranges() const { return force_ranges_; }
  /// Settings of actuators' forces in words that this engine does not know (ListNewerForces).
  [[nodiscard]] const std::vector<std::string>& newer_forces() const { return newer_forces_; }
  /// A copy of the engine's model.
  [[nodiscard]] MjModelPtr CopyEngine() const;

 private:
  std::filesystem::path path_;
  std::string text_;
  RobotFormat format_;
  std::optional<RobotDescription> description_;  // of a parameter file or URDF, or of bodies once placed
  std::vector<TabledBody> bodies_;               // of a table of bodies
  std::optional<RobotDescription> carrier_;      // of a table of bodies
  std::unique_ptr<MjcfFile> document_;           // of an MJCF
  MjModelPtr engine_;                            // of an MJCF
  std::map<std::string, double> force_ranges_;   // FindForceRanges of an MJCF, which the engine may not know
  std::vector<std::string> newer_forces_;
};

/// Reads the robot of one file. @throws InputError as DescriptionFile.
RobotDescription ReadDescription(const std::filesystem::path& path, const UrdfOptions& options = {});

}  // namespace dexcheck
