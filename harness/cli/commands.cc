#include "harness/cli/commands.h"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "controller/common/errors.h"

namespace dexcheck::cli {

void AddRobotOptions(CLI::App* command, RobotFiles* files) {
  files->robot = DEXCHECK_DATA_DIR "/controller/parameters/assistant_robot.toml";
  files->mjcf = DEXCHECK_DATA_DIR "/mjcf/scene.xml";
  CLI::Option* robot =
      command->add_option("--robot", files->robot, "Parameter file (TOML) of the analytic model")
          ->type_name("FILE.toml");
  CLI::Option* mjcf =
      command->add_option("--mjcf", files->mjcf, "The same robot for the engine")->type_name("FILE.xml");
  robot->needs(mjcf);
  mjcf->needs(robot);
}

void WriteFile(const std::filesystem::path& path, const std::string& text) {
  if (path == "-") {
    std::fwrite(text.data(), 1, text.size(), stdout);
    return;
  }
  const auto fail = [&] { throw InputError(path.string() + ": cannot be written: " + std::strerror(errno)); };
  const std::filesystem::path partial = path.string() + ".partial-" + std::to_string(::getpid());
  std::FILE* file = std::fopen(partial.c_str(), "wb");
  if (file == nullptr) fail();
  const bool written = std::fwrite(text.data(), 1, text.size(), file) == text.size() &&
                       std::fflush(file) == 0 && ::fsync(::fileno(file)) == 0;
  const int write_error = errno;
  std::fclose(file);
  if (!written || std::rename(partial.c_str(), path.c_str()) != 0) {
    const int reason = written ? errno : write_error;
    std::remove(partial.c_str());
    errno = reason;
    fail();
  }
}

}  // namespace dexcheck::cli
