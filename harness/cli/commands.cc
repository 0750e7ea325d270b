#include "harness/cli/commands.h"

#include <charconv>
#include <string>
#include <system_error>

#include "controller/common/text.h"
#include "harness/cli/shipped_files.h"

namespace dexcheck::cli {

void AddRobotOptions(CLI::App* command, RobotFiles* files) {
  files->robot = FindShippedFile("controller/parameters/assistant_robot.toml");
  files->mjcf = FindShippedFile("mjcf/scene.xml");
  CLI::Option* robot =
      command->add_option("--robot", files->robot, "Parameter file (TOML) of the analytic model")
          ->type_name("FILE.toml");
  CLI::Option* mjcf =
      command->add_option("--mjcf", files->mjcf, "The same robot for the engine")->type_name("FILE.xml");
  robot->needs(mjcf);
  mjcf->needs(robot);
}

CLI::Validator WholeNumber(std::uint64_t least, std::uint64_t most) {
  const auto check = [least, most](const std::string& text) -> std::string {
    std::uint64_t value = 0;
    const char* const end = text.data() + text.size();
    const std::from_chars_result result = std::from_chars(text.data(), end, value);
    if (result.ec == std::errc() && result.ptr == end && least <= value && value <= most) return {};
    return "must be a whole number from " + std::to_string(least) + " to " + std::to_string(most) + ", got " +
           Quote(text);
  };
  return {check, ""};
}

}  // namespace dexcheck::cli
