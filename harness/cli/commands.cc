#include "harness/cli/commands.h"

#include "harness/checks/consistency.h"
#include "harness/cli/shipped_files.h"

namespace dexcheck::cli {

Option AddRobotOptions(Command command, RobotFiles* files) {
  files->robot = FindShippedFile("controller/parameters/assistant_robot.toml");
  files->mjcf = FindShippedFile("mjcf/scene.xml");
  Option robot = command.AddOption("--robot", &files->robot, "Parameter file (TOML) of the analytic model")
                     .TypeName("FILE.toml");
  Option mjcf =
      command.AddOption("--mjcf", &files->mjcf, "The same robot for the engine").TypeName("FILE.xml");
  robot.Needs(mjcf);
  mjcf.Needs(robot);
  return robot;
}

Option AddJsonOption(Command command, const std::string& what, std::string* file) {
  return command
      .AddOption("--json", file,
                 "Write " + what + " to this file; without one, or with -, print them and nothing else")
      .TypeName("[FILE.json]");
}

Option AddJUnitOption(Command command, std::string* file) {
  return command.AddOption("--junit", file, "Write each check as a test case of JUnit's XML to this file")
      .TypeName("FILE.xml");
}

Option AddIgnoreOption(Command command, std::vector<std::string>* ignore) {
  return command
      .AddOption("--ignore", ignore,
                 "What the two need not share of joints: armature, damping, friction, coupling to others")
      .TypeName("WORD,...")
      .Delimiter(',')
      .OneOf({kIgnorable[0], kIgnorable[1], kIgnorable[2], kIgnorable[3]});
}

}  // namespace dexcheck::cli
