#pragma once

// Comparison of two files that describe one robot, as `dexcheck consistency A B` makes it.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/comparison/consistency.h"
#include "harness/comparison/digit_judgement.h"
#include "harness/comparison/file_causes.h"
#include "harness/descriptions/program_provider.h"
#include "harness/descriptions/term_results.h"
#include "harness/descriptions/urdf_reader.h"

namespace dexcheck {

/// A comparison: the model that locations belong to, and the results.
struct Comparison {
  std::filesystem::path first;  ///< An MJCF stands second, if there is one.
  std::filesystem::path second;
  bool with_engine = false;  ///< The second is an MJCF, whose terms are the engine's.
  std::optional<RobotModel> model;
  std::vector<std::string> notes;         ///< Facts that a reader may not expect.
  std::vector<std::string> not_compared;  ///< Parts that only one of them has and no term depends on.
  /// Numbers that both state, that differ and that no term depends on: one line each, with both values.
  std::vector<std::string> without_effect;
  ConsistencyResult result;
  /// Verdict by printed precision, where the two do not agree to rounding; `result` is then that verdict's.
  std::optional<DigitVerdict> digits;
  /// Causes of the differences; none where terms alone are compared, on wheels, and with an object.
  std::optional<FileCauses> causes;
  /// The descriptions as read; none for an MJCF with several free bodies.
  std::optional<RobotDescription> read_first, read_second;

  /// Whether neither terms and constants nor printed numbers differ.
  [[nodiscard]] bool Agrees() const { return result.Agrees() && (!causes || causes->agrees); }
  /// Judges terms, constants and causes by a relative tolerance where that is wider than their bounds.
  void JudgeByTolerance(double tolerance);
};

/// Compares constants and terms of two parameter files, URDFs or MJCFs, and explains how they differ. The
/// second of two MJCFs is the engine's. Files whose joints differ in kind, number or name are compared as far
/// as causes explain it, without terms.
/// @throws InputError for files that cannot be read, and for robots of two mechanisms.
Comparison CompareFiles(
    const std::filesystem::path& a, const std::filesystem::path& b, const UrdfOptions& urdf,
    const ConsistencyOptions& options, const Progress& progress = [](long) { return true; });
/// Compares files that are read already. A table of bodies among them is placed on the other's robot.
Comparison CompareFiles(DescriptionFile* a, DescriptionFile* b, const UrdfOptions& urdf,
                        const ConsistencyOptions& options, const Progress& progress);

/// Returns the relative tolerance by which a run judges two files that agree: 0 where they agree to rounding.
/// Otherwise it is four times the worst error found, rounded up to one digit, since a run visits other
/// states.
double CalcTolerance(const ConsistencyResult& result);

// A description compared with terms of somebody else's: a program, results in files, or functions.

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
