#pragma once

// Recordings of anybody's robot: times and signals as rows of numbers, read one after another.

#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace dexcheck {

/// One file. Every member throws InputError, one line that names file, row and what is wrong.
class RecordingReader {
 public:
  virtual ~RecordingReader() = default;

  /// Names of the columns: a header's, a message's fields ("position.elbow"), a signal's ("tau.elbow"); empty
  /// texts where the file names none. All rows have as many numbers.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  [[nodiscard]] bool has_names() const { return has_names_; }
  /// "CSV", "MCAP of sensor_msgs/msg/JointState", ...
  [[nodiscard]] const std::string& format() const { return format_; }

  /// The next row; numbers that it lacks are NaN. @return false at the end.
  virtual bool Next(std::vector<double>* row) = 0;
  /// Location of the last row: "FILE:LINE", "FILE: message 3".
  [[nodiscard]] virtual std::string Where() const = 0;

 protected:
  static constexpr double kMissing =
      std::numeric_limits<double>::quiet_NaN();  ///< A number that a row lacks.

  std::vector<std::string> names_;
  bool has_names_ = false;
  std::string format_;
};

/// Opens a recording by what is in it: text (CSV and the like, with a header or without one; "-" is standard
/// input), MCAP, a folder or file of a ROS 2 bag, HDF5, NumPy (.npy, .npz), a run's log.
/// @param topic of messages; empty for the only one that has joints.
/// @param width numbers of a row, where a text has them on lines of their own; 0 for one row a line.
std::unique_ptr<RecordingReader> OpenRecording(const std::filesystem::path& path,
                                               const std::string& topic = "", size_t width = 0);

/// Whether its bytes come only once: standard input ("-"), a pipe. It is read as text.
bool IsReadOnce(const std::filesystem::path& path);

/// Rows that are in memory.
class TableReader : public RecordingReader {
 public:
  /// @param columns by name, all of one length.
  TableReader(std::string source, std::string format, std::vector<std::string> names,
              std::vector<std::vector<double>> columns);
  bool Next(std::vector<double>* row) override;
  [[nodiscard]] std::string Where() const override;

 private:
  std::string source_;
  std::vector<std::vector<double>> columns_;
  size_t row_ = 0;
};

/// Messages with times, whose fields are numbers by name; those of one time are one row.
struct TimedMessage {
  double time = 0.0;  ///< s
  std::vector<std::pair<std::string, double>> fields;
};

/// sensor_msgs/msg/JointState as ROS 2 packs it (CDR): fields "position.JOINT", "velocity.JOINT",
/// "effort.JOINT"; its own stamp is its time. @throws InputError "WHERE: ..." of bytes that are none.
TimedMessage ParseJointState(std::string_view cdr, const std::string& where);

/// Reads a message in JSON: a JointState, or the numbers of any object, "a.b.0"; `time` is kept unless the
/// message has a stamp.
TimedMessage ParseJsonMessage(std::string_view json, double time, const std::string& where);

// One for each kind of file.
std::unique_ptr<RecordingReader> OpenTextRecording(const std::filesystem::path& path, size_t width);
std::unique_ptr<RecordingReader> OpenMcapRecording(const std::filesystem::path& path,
                                                   const std::string& topic);
std::unique_ptr<RecordingReader> OpenBagRecording(const std::filesystem::path& path,
                                                  const std::string& topic);
std::unique_ptr<RecordingReader> OpenNumpyRecording(const std::filesystem::path& path);
std::unique_ptr<RecordingReader> OpenHdf5Recording(const std::filesystem::path& path);

}  // namespace dexcheck
