#include "tests/common/run_program.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <stdexcept>

namespace dexcheck::testing {
namespace {

constexpr int kCannotStart = 127;

void Redirect(int descriptor, const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (file < 0 || ::dup2(file, descriptor) < 0) ::_exit(kCannotStart);
}

/// The child's side of the fork.
[[noreturn]] void Execute(const std::vector<std::string>& command, const ProgramOptions& options,
                          const std::filesystem::path& captured) {
  Redirect(STDOUT_FILENO, options.out.value_or(captured / "out"));
  Redirect(STDERR_FILENO, options.err.value_or(captured / "err"));
  for (const int stream : options.closed) ::close(stream);
  if (!options.folder.empty() && ::chdir(options.folder.c_str()) != 0) ::_exit(kCannotStart);
  for (const auto& [name, value] : options.environment) ::setenv(name.c_str(), value.c_str(), 1);
  if (options.largest_file) {
    const rlimit limit{*options.largest_file, *options.largest_file};
    if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) ::_exit(kCannotStart);
  }
  for (const int signal : {SIGHUP, SIGPIPE}) std::signal(signal, SIG_DFL);  // nohup's are ignored
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  ::alarm(options.seconds);
  ::execvp(arguments[0], arguments.data());
  ::_exit(kCannotStart);
}

}  // namespace

Program::Program(const std::vector<std::string>& command, const ProgramOptions& options) {
  pid_ = ::fork();
  if (pid_ < 0) throw std::runtime_error("cannot start " + command.front());
  if (pid_ == 0) Execute(command, options, captured_.path());
}

Program::~Program() {
  if (pid_ < 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

void Program::Signal(int signal) const { ::kill(pid_, signal); }

ProgramResult Program::Wait() {
  int status = 0;
  if (::waitpid(std::exchange(pid_, -1), &status, 0) < 0) throw std::runtime_error("cannot wait");
  ProgramResult result;
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  if (std::filesystem::exists(captured_.path() / "out")) result.out = ReadText(captured_.path() / "out");
  if (std::filesystem::exists(captured_.path() / "err")) result.err = ReadText(captured_.path() / "err");
  return result;
}

ProgramResult RunProgram(const std::vector<std::string>& command, const ProgramOptions& options) {
  return Program(command, options).Wait();
}

}  // namespace dexcheck::testing
