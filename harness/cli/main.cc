// dexcheck: is my analytic model, and the controller built on it, right?

#include <fmt/format.h>

#include <exception>

#include "controller/common/errors.h"
#include "harness/cli/commands.h"

int main(int argc, char** argv) {
  using namespace dexcheck;
  CLI::App app("Validates analytic robot models and controllers against MuJoCo.", "dexcheck");
  app.set_version_flag("--version", DEXCHECK_VERSION);
  app.require_subcommand(1);
  int exit_code = cli::kSuccess;
  cli::AddConsistencyCommand(&app, &exit_code);
  cli::AddEvalCommand(&app, &exit_code);
  try {
    app.parse(argc, argv);
    return exit_code;
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "dexcheck: {} (see dexcheck --help)\n", error.what());
    return cli::kInputError;
  } catch (const InputError& error) {
    fmt::print(stderr, "dexcheck: {}\n", error.what());
    return cli::kInputError;
  } catch (const std::invalid_argument& error) {
    fmt::print(stderr, "dexcheck: {}\n", error.what());
    return cli::kInputError;
  } catch (const std::exception& error) {
    fmt::print(stderr, "dexcheck: {}\n", error.what());
    return cli::kFailure;
  }
}
