#pragma once

// What the commands that compare descriptions of a robot have in common.

#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/cli/commands.h"

namespace dexcheck::cli {

/// --digits and --tolerance: how published numbers, which are rounded when printed, are judged.
struct ToleranceOptions {
  int digits = 0;                   ///< 0: not given.
  std::optional<double> tolerance;  ///< Relative, wider than rounding.

  /// The relative tolerance; none: by rounding.
  [[nodiscard]] std::optional<double> Find() const {
    return digits > 0 ? std::pow(10.0, -digits) : tolerance;
  }
};

/// Adds the two options, of which one may be given. @returns them.
inline std::array<Option, 2> AddToleranceOptions(Command command, ToleranceOptions* options) {
  constexpr int kMostDigits = 15;
  const Option digits = command
                            .AddOption("--digits N", &options->digits,
                                       "Agreement to this many digits of a term's scale is enough")
                            .Check(WholeNumber(1, kMostDigits));
  const Option tolerance =
      command.AddOption("--tolerance REL", &options->tolerance, "The same as a relative tolerance")
          .Check(Fraction())
          .Excludes(digits);
  return {digits, tolerance};
}

/// What is compared, and where the results go.
struct ComparisonRequest {
  std::string a, b;  ///< Two descriptions; none with --robot and --mjcf.
  RobotFiles files;
  UrdfOptions urdf;
  ToleranceOptions judging;
  std::string json_file;
  std::string junit_file;
  bool quiet = false;

  /// Puts A and B where --robot and --mjcf would stand. @param command for messages.
  void TakeFiles(const std::string& command) {
    if (a.empty()) return;
    if (b.empty()) throw InputError(command + ": two files must be given, got " + Quote(a));
    files = {a, b};
  }
  /// To what two files agree.
  [[nodiscard]] std::string DescribeTolerance() const {
    const std::optional<double> tolerance = judging.Find();
    return tolerance ? FormatNumber(*tolerance, 6) : "rounding";
  }
};

/// Adds --robot and --mjcf, and A and B in their place.
inline void AddFileOptions(Command command, const std::string& help_a, const std::string& help_b,
                           ComparisonRequest* request) {
  const Option robot = AddRobotOptions(command, &request->files);
  command.AddOption("A", &request->a, help_a).TypeName("FILE").Excludes(robot);
  command.AddOption("B", &request->b, help_b).TypeName("FILE");
}

}  // namespace dexcheck::cli
