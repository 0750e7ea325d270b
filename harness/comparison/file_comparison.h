#pragma once

// Two files that differ, judged by their printed precision.

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/comparison/consistency.h"
#include "harness/comparison/file_causes.h"
#include "harness/comparison/printed_digits.h"
#include "harness/descriptions/program_provider.h"
#include "harness/descriptions/term_results.h"
#include "harness/descriptions/urdf_reader.h"

namespace dexcheck {

/// A number as two files have it.
struct NumberPair {
  std::string component;  ///< "Ixx" of a tensor, "lower" of a range; empty for a single number.
  std::string unit;       ///< Empty where it is not known.
  double first = 0.0, second = 0.0;
};
/// Returns "Ixx: 0.0002 kg m^2 in a.urdf, 0.0001 kg m^2 in b.urdf".
std::string DescribeNumbers(const NumberPair& numbers, const std::string& first, const std::string& second);
/// Returns the numbers of a finding. @param model whose locations it has.
NumberPair TakeNumbers(const ConstantFinding& finding, const RobotModel& model);

/// One number that differs by more than the printed precision.
struct DigitExcess {
  std::string check;
  std::string where;
  NumberPair numbers;
  double units = 0.0;     ///< Difference relative to the precision; infinite where both numbers are exact.
  std::string effect{};   ///< Effect of a constant that one file leaves out.
  bool is_cause = false;  ///< A constant, or a term of geometry or bodies, from which the other terms follow.
  /// Relative precision of a number that agrees within it, where that is too coarse for a verdict; else 0.
  double too_loose = 0.0;
};

/// The number with the coarsest comparison among those that differ by more than rounding.
struct LoosestNumber {
  std::string what;       ///< "inertia of link3"; empty where all agree to rounding.
  double fraction = 0.0;  ///< Precision to which it was compared, relative to its size.
};

/// Brings two descriptions to the same statements, names and frames of links, or parts of both.
/// @throws InputError when they are of two mechanisms.
void CompletePair(const std::vector<std::string>& ignore, const RobotPart& part,
                  std::array<RobotDescription, 2>* sides);

/// How two files differ that do not agree to rounding.
struct DigitVerdict {
  std::array<PrintedDigits, 2> files;
  long states = 0;  ///< Number of states at which terms were judged.
  std::map<std::string, double>
      units;  ///< Worst excess of each check that does not agree to rounding, in units of its precision.
  std::vector<DigitExcess> excesses;  ///< Causes first, the worst first.
  double largest_within = 0.0;  ///< Largest error that the printed precision explains, relative to its scale.
  LoosestNumber loosest;
};

/// Judges the differences above rounding: a number of a file is known to half a unit of its last digit
/// (ReadPrinted). These half units are carried to each constant and term by reading both files again with all
/// numbers moved at random within them (TermComparison::CompareWithin), at the first few states; a single
/// number keeps its own half unit.
/// @param a, b providers of the two files, in the coordinates of `a`.
/// @param part of the robots that was compared. @param result of the comparison by rounding; differences that
/// the printed precision explains pass then, and are no findings.
/// @return nothing, with `result` unchanged, when it agrees, when options.within_digits is false, for a robot
/// on wheels or with an object, and where a file's numbers cannot be moved.
std::optional<DigitVerdict> JudgeByDigits(const std::array<const DescriptionFile*, 2>& files,
                                          const UrdfOptions& urdf, const ConsistencyOptions& options,
                                          DynamicsProvider* a, DynamicsProvider* b, const RobotModel& model,
                                          const RobotPart& part, ConsistencyResult* result);

// Comparison of two files that describe one robot, as `dexcheck consistency A B` makes it.

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

/// Least number of digits to which numbers agree that were rounded when they were printed.
inline constexpr int kDigitsOfRoundedInput = 4;

/// One line for each constant and term that differs: where first, where worst, both values.
struct Differences {
  std::vector<std::string> real;
  std::vector<std::string> rounded;  ///< Those that agree to kDigitsOfRoundedInput digits or more.
  std::string following;             ///< One line for all terms that follow from `real`.
  int digits = 16;                   ///< Digits to which all of `rounded` and everything else agree.
};
/// Lists the numbers that exceed the printed precision, the worst first.
Differences ListExcesses(const DigitVerdict& verdict, const std::string& first, const std::string& second);
Differences SortDifferences(const Comparison& comparison);

/// Constants that differ and that no cause concerns: statements of an MJCF beside the mechanism.
std::vector<std::string> ListOtherDifferences(const Comparison& comparison);

/// The causes, or where there are none all differences, a line each.
std::vector<std::string> ListDifferences(const Comparison& comparison);

}  // namespace dexcheck
