#pragma once

// What consistency was asked, what it found, and how that is printed.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "harness/checks/consistency.h"
#include "harness/checks/file_comparison.h"
#include "harness/cli/commands.h"
#include "harness/cli/tolerance_options.h"
#include "harness/descriptions/program_side.h"

namespace dexcheck::cli {

/// What was asked.
struct ConsistencyRequest {
  std::string a, b;  ///< Two descriptions; none with --robot and --mjcf.
  RobotFiles files;
  std::string program;            ///< Command of the shell that stands for B.
  std::filesystem::path answers;  ///< Folder that stands for B.
  ProgramOptions program_options;
  std::vector<std::string> packages;
  bool floating = false;
  ConsistencyOptions options;
  std::string json_file;
  std::string junit_file;
  bool quiet = false;
  ToleranceOptions judging;

  /// What stands for B answers terms, and is no description.
  [[nodiscard]] bool has_answers() const { return !program.empty() || !answers.empty(); }

  /// The results themselves take standard output: a table would spoil them.
  [[nodiscard]] bool PrintsJson() const { return json_file == "-"; }
};

/// Large results first fail, then where to look: what a person reads.
void PrintTable(const ConsistencyRequest& request, const Comparison& comparison);
/// Whether the two agree, and if not, in what and why.
void PrintVerdict(const ConsistencyRequest& request, const Comparison& comparison);
/// The same as JSON.
std::string ToText(const ConsistencyRequest& request, const Comparison& comparison, ExitCode code);

/// The same as a JUnit document.
std::string WriteJUnit(const ConsistencyRequest& request, const Comparison& comparison);

/// Their lines, shares and values.
nlohmann::ordered_json ListHypotheses(const std::vector<Hypothesis>& hypotheses);

/// "  LINE; explains 100 %", and what each values line says below it.
void PrintHypotheses(const std::vector<Hypothesis>& hypotheses);

}  // namespace dexcheck::cli
