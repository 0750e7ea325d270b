#pragma once

// A description compared with terms of somebody else's: a program, results in files, or functions.

#include <filesystem>
#include <string>

#include "harness/comparison/file_comparison.h"
#include "harness/descriptions/program_provider.h"
#include "harness/descriptions/term_results.h"

namespace dexcheck {

/// Results to compare with a description: a program's command, or a folder with result files.
struct ResultsSource {
  std::string program;
  std::filesystem::path results;
  ProgramOptions program_options;
};

/// Compares a description with the results of a program, run now or in files; the terms of an MJCF are the
/// engine's. Other conventions are tried for a floating base whose terms disagree.
Comparison CompareResults(const std::filesystem::path& file, const ResultsSource& source,
                          const UrdfOptions& urdf, const ConsistencyOptions& options,
                          const Progress& progress);

/// Compares functions with a parameter file, a URDF, or an MJCF, whose terms are the engine's.
Comparison CompareFunctions(const std::filesystem::path& file, const TermFunctions& functions,
                            const UrdfOptions& urdf, const ConsistencyOptions& options);

}  // namespace dexcheck
