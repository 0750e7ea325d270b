#pragma once

// The quantities of a run that its log records.

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "harness/log/log_writer.h"
#include "harness/run/closed_loop.h"

namespace dexcheck {

/// Files of a run's inputs, which the log keeps.
struct RunInputs {
  std::filesystem::path robot;
  std::filesystem::path mjcf;
  std::string command;  ///< The command line.
};

/// Writes log.h5 of one run.
class RunRecorder {
 public:
  /// @throws InputError when the log cannot be written.
  RunRecorder(const std::filesystem::path& path, const ClosedLoop& loop, const Setup& setup,
              const RunInputs& inputs);

  /// Records a step; allocates nothing.
  void Record(const StepRecord& step);
  /// Adds the summary and finishes the file.
  void Close(const std::string& summary);

 private:
  using Source = std::function<void(const StepRecord& step, std::span<double> row)>;
  /// Adds one quantity. @param columns names of its numbers; none of a single number. @param numbers
  /// attributes.
  void Add(const std::string& name, const std::string& unit, const std::string& description,
           std::vector<std::string> columns, Source source, std::map<std::string, double> numbers = {});
  void AddStateSignals();
  void AddJointSignals();
  void AddFootSignals();
  void AddObjectSignals();
  void AddContactSignals();
  /// Adds slip and use of the friction cone of each part. @param what it is: "fingertip".
  void AddSlips(const std::string& group, const std::string& what, const std::vector<std::string>& parts,
                std::vector<SlipState> StepFindings::*states);
  void AddFollowedContacts();
  void AddTaskSignals();
  void AddCheckSignals();

  const Setup* setup_;
  const RunChecks* checks_;  // null without
  LogWriter log_;
  struct Channel {
    int signal;
    Source source;
  };
  std::vector<Channel> channels_;
};

}  // namespace dexcheck
