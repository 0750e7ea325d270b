#pragma once

// The program under test, and two robots small enough to be read at a glance.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/common/paths.h"
#include "tests/common/run_program.h"

namespace dexcheck::testing {

/// Command that runs dexcheck with these arguments.
inline std::vector<std::string> DexcheckCommand(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), testing::ProgramPath());
  return arguments;
}

inline ProgramResult RunDexcheck(const std::vector<std::string>& arguments,
                                 const ProgramOptions& options = {}) {
  return RunProgram(DexcheckCommand(arguments), options);
}

/// Success when the program refused its input: exit code 2, nothing on standard output, and one line of
/// readable length on standard error that contains all of `parts`.
inline ::testing::AssertionResult IsRefused(const ProgramResult& result,
                                            const std::vector<std::string>& parts) {
  constexpr size_t kReadable = 700;
  const auto fail = [&](const std::string& problem) {
    return ::testing::AssertionFailure() << problem << "; exit code " << result.exit_code << ", out \""
                                         << result.out << "\", err \"" << result.err << "\"";
  };
  if (result.exit_code != 2) return fail("exit code must be 2");
  if (!result.out.empty()) return fail("standard output must be empty");
  if (std::count(result.err.begin(), result.err.end(), '\n') != 1 || result.err.back() != '\n' ||
      !result.err.starts_with("dexcheck: ")) {
    return fail("standard error must be one line of the program");
  }
  if (result.err.size() > kReadable) return fail("the line is too long to read");
  for (const std::string& part : parts) {
    if (result.err.find(part) == std::string::npos) return fail("the line lacks \"" + part + "\"");
  }
  return ::testing::AssertionSuccess();
}

/// Shipped files.
inline const std::string kParameters = testing::SourcePath("/controller/parameters/");
inline const std::string kMjcf = testing::SourcePath("/mjcf/");
inline const std::vector<std::string> kPandaFiles = {"--robot", kParameters + "panda.toml", "--mjcf",
                                                     kMjcf + "panda.xml"};

/// A fixed base with two hinges.
inline const std::string kTwoLinksToml = R"(name = "two links"
gravity = [0.0, 0.0, -9.81]

[base]
type = "fixed"
link = "stand"

[[chain]]
parent = "stand"
rows = [
  { joint = "shoulder", link = "upper", alpha_deg = 0, a = 0, q = 0, d = 0.1 },
  { joint = "elbow", link = "lower", alpha_deg = -90, a = 0.3, q = 0, d = 0 },
]
frames = [{ name = "tip", link = "lower", xyz = [0.2, 0.0, 0.0] }]
[chain.joints]
shoulder = { range = [-2.0, 2.0], damping = 0.10, armature = 0.01 }
elbow = { range = [-1.0, 1.0], damping = 0.05, armature = 0.02 }
[chain.links]
upper = { mass = 1.5, com = [0.1, 0.0, 0.0], inertia = [0.01, 0.02, 0.02, 0, 0, 0] }
lower = { mass = 0.8, com = [0.1, 0.0, 0.0], inertia = [0.01, 0.01, 0.01, 0, 0, 0] }
)";

inline const std::string kTwoLinksMjcf = R"(<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="stand">
      <body name="upper" pos="0 0 0.1">
        <joint name="shoulder" axis="0 0 1" damping="0.10" armature="0.01" limited="true" range="-2 2"/>
        <inertial pos="0.1 0 0" mass="1.5" diaginertia="0.01 0.02 0.02"/>
        <body name="lower" pos="0.3 0 0" quat="1 -1 0 0">
          <joint name="elbow" axis="0 0 1" damping="0.05" armature="0.02" limited="true" range="-1 1"/>
          <inertial pos="0.1 0 0" mass="0.8" diaginertia="0.01 0.01 0.01"/>
          <site name="tip" pos="0.2 0 0"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
)";

}  // namespace dexcheck::testing
