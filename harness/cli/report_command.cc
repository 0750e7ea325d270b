#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "harness/cli/commands.h"
#include "harness/cli/make_report.h"

namespace dexcheck::cli {
namespace {

struct Request {
  std::filesystem::path run_folder;
  std::string out;
  bool quiet = false;
};

}  // namespace

void AddReportCommand(CLI::App* app, int* exit_code) {
  const auto request = std::make_shared<Request>();
  CLI::App* command =
      app->add_subcommand("report", "Write a recorded run's report: one page and its figures");
  command->add_option("RUN_DIR", request->run_folder, "Folder of the run")->required()->type_name("");
  command
      ->add_option("--out", request->out,
                   "Write only the page, here (default: report.html and figures/ in RUN_DIR)")
      ->type_name("FILE.html");
  command->add_flag("--quiet", request->quiet, "Print nothing");
  command->callback([=] {
    ReportFiles files = MakeReportFiles(request->run_folder);
    if (!request->out.empty()) files = {request->out, {}};
    MakeReport(request->run_folder, files);
    if (!request->quiet) fmt::print("{}\n", files.page.string());
    *exit_code = kSuccess;
  });
}

}  // namespace dexcheck::cli
