#include "harness/run/own_controller.h"

#include <unistd.h>

#include <cstdlib>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/base/files.h"

namespace dexcheck {
namespace {

/// The texts of robot and scenario, with a run's changes.
std::string MakeRobotText(const Setup& setup) {
  const std::string& source = setup.model().spec().source;
  return ApplyOverrides(ReadBytes(source), source, setup.scenario().model_overrides);
}

std::string MakeScenarioText(const Scenario& scenario) {
  std::vector<std::string> overrides = scenario.overrides;
  std::erase_if(overrides, IsOfModel);
  return ApplyOverrides(scenario.text, scenario.source, overrides);
}

/// Returns the program that runs a Python file: the main program of the Python module.
std::filesystem::path FindPythonMain(const std::string& name) {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const char* folder : {"python", DEXCHECK_PYTHON_FOLDER}) {
    std::filesystem::path main = program.parent_path() / folder / "dexcheck/__main__.py";
    if (::access(main.c_str(), R_OK) == 0) return main;
  }
  throw InputError(name + ": needs the Python module, which is not in " +
                   (program.parent_path() / DEXCHECK_PYTHON_FOLDER).string());
}

std::unique_ptr<ControllerPeer> StartProgram(const OwnControllerSetup& setup) {
  const std::filesystem::path file = FindControllerFile(setup.own);
  if (file.empty()) return MakeProgramPeer(setup, {"/bin/sh", "-c", "exec " + setup.own.run});
  if (::access(file.c_str(), R_OK) != 0)
    throw InputError(setup.name + ": " + file.string() + ": cannot be read");
  const char* const python = std::getenv("DEXCHECK_PYTHON");
  return MakeProgramPeer(
      setup, {python == nullptr ? "python3" : python, FindPythonMain(setup.name).string(), file.string()});
}

}  // namespace

std::filesystem::path FindControllerFile(const OwnControllerOptions& own) {
  const std::filesystem::path file = (own.folder / own.run).lexically_normal();
  const bool is_one = file.extension() == ".so" || file.extension() == ".py";
  const bool is_command = own.run.find(' ') != std::string::npos && ::access(file.c_str(), F_OK) != 0;
  return is_one && !is_command ? file : std::filesystem::path();
}

std::unique_ptr<Controller> MakeOwnController(const Setup& setup, const Sampling& sampling) {
  const Scenario& scenario = setup.scenario();
  if (scenario.pick_task() != nullptr)
    throw InputError(scenario.source + ": task: is done by no other controller");
  if (scenario.control.kappa == ContactSource::kIntegrated)
    throw InputError(scenario.source + ": control.kappa: other controllers get measured contacts");
  const OwnControllerSetup own{"controller " + scenario.controller.run,
                               &setup.model(),
                               setup.fingertips(),
                               setup.object().body,
                               &setup.surface(),
                               setup.MakeControllerOptions(),
                               sampling,
                               setup.joints(),
                               MakeRobotText(setup),
                               MakeScenarioText(scenario),
                               scenario.controller};
  if (FindControllerFile(own.own).extension() == ".so") return MakeLibraryController(own);
  return MakeProtocolController(StartProgram(own), own);
}

std::string HashController(const OwnControllerOptions& own) {
  const std::filesystem::path file = FindControllerFile(own);
  return file.empty() ? "" : HashBytes(ReadBytes(file, kMostData));
}

void RejectParameter(const OwnControllerSetup& setup, const std::string& parameter, const std::string& why) {
  throw InputError(setup.name + ": controller." + parameter + ": is none of its parameters: it " + why);
}

void RequireTorques(const std::string& who, const Command& command, Eigen::Index n) {
  if (command.tau.size() != n) {
    throw ControllerFailure(who + ": sent " + std::to_string(command.tau.size()) + " torques, must be " +
                            std::to_string(n));
  }
  if (!command.tau.allFinite()) throw ControllerFailure(who + ": sent a torque that is not a number");
}

}  // namespace dexcheck
