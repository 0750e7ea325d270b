#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/cli/run_folder.h"
#include "harness/report/page.h"

namespace dexcheck::cli {
namespace {

struct ReportRequest : Outputs {
  std::filesystem::path run_folder;
  std::string out;
  bool no_replay = false;
  std::string tex_file;
};

/// Pictures alone.
RunScene MakeStillScene(const RunData& run, const std::filesystem::path& folder) {
  RunScene scene = MakeRunScene(run, folder);
  scene.replay.reset();
  return scene;
}

int Run(const ReportRequest& request) {
  OutputFile json_file(request.json_file), tex_file(request.tex_file);
  RequirePageName(request.out);
  RequireKind(request.run_folder, "run's folder");
  ReportFiles files = MakeReportFiles(request.run_folder);
  if (!request.out.empty()) files = {request.out, {}};
  WriteRunReport(request.run_folder, files, request.no_replay ? MakeStillScene : MakeRunScene);
  json_file.Write([&] { return Json{{"page", files.page.string()}, {"figures", files.figures.string()}}; });
  tex_file.Write([&] { return MakeTexTable(RunData(request.run_folder)); });
  const bool prints = !json_file.is_stdout() && !tex_file.is_stdout();
  if (!request.quiet && prints) fmt::print("{}\n", files.page.string());
  return kSuccess;
}

}  // namespace

void AddReportCommand(CLI::App* app) {
  const auto [command, request] =
      AddRequest<ReportRequest>(app, "report", "Write a recorded run's report: one page and its figures",
                                {"dexcheck report my_run", "dexcheck report my_run --tex results.tex"});
  AddOption(command, "RUN_DIR", &request->run_folder, "Folder of the run")->required()->type_name("");
  AddOption(command, "--page FILE.html", &request->out,
            "Write only the page, here (default: report.html and figures/ in RUN_DIR)");
  command->add_flag("--no-replay", request->no_replay, "Leave out the replay in three dimensions");
  command->add_flag("--quiet", request->quiet, "Print nothing");
  AddJsonOption(command, "where page and figures are", &request->json_file);
  AddOption(command, "--tex FILE.tex", &request->tex_file,
            "Also write a LaTeX table of results, commit and command (- for standard output)");
}

}  // namespace dexcheck::cli
