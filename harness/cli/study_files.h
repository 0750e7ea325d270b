#pragma once

#include <cstdint>
#include <string>

#include "harness/study/trial.h"

namespace dexcheck::cli {

/// A shipped study by name, or a TOML file, with its scenario. @throws InputError.
StudyInputs FindStudy(const std::string& name_or_file);

/// A study's array job.
struct SlurmJob {
  std::uint64_t tasks = 1;  ///< Parts of the study.
  /// Most elements of the array. Slurm's MaxArraySize, 1001 unless configured, is one more than the largest
  /// index.
  std::uint64_t array_size = 1000;
  std::uint64_t cpus = 1;      ///< Processors of an element, each for a trial at a time.
  std::uint64_t throttle = 0;  ///< Elements at a time; 0 for any.
  std::string time;            ///< As sbatch --time; empty for the partition's.
  std::string memory;          ///< As sbatch --mem; empty for the partition's.
};

/// What is wrong with a text as sbatch's --time and --mem; empty when nothing is.
std::string CheckSlurmTime(const std::string& text);
std::string CheckSlurmMemory(const std::string& text);

/// The text of a batch script whose array makes the study, a shard for each task; killed and requeued
/// elements go on where they were.
/// @param name_or_file as typed.
std::string MakeSlurmScript(const StudyInputs& inputs, const std::string& name_or_file, const SlurmJob& job);

}  // namespace dexcheck::cli
