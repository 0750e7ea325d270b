#pragma once

#include <filesystem>
#include <string>

namespace dexcheck::cli {

/// Two recordings against each other, by a model of the robot.
struct RecordingPair {
  std::filesystem::path model, first, second, columns;
  std::string json_file;
  bool quiet = false;
};

/// Prints how far they are apart and what differs. @return the exit code: 1 where something differs.
int CompareTwoRecordings(const RecordingPair& pair);

}  // namespace dexcheck::cli
