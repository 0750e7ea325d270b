#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>

#include "harness/base/console.h"
#include "harness/base/interrupts.h"
#include "harness/cli/file_repair.h"
#include "harness/cli/output_file.h"
#include "harness/cli/terminal.h"
#include "harness/comparison/file_differences.h"
#include "harness/engine/mjcf_file.h"

namespace dexcheck::cli {
namespace {

struct DiagnoseRequest : ConsistencyRequest {
  std::string repaired_file;
};

nlohmann::ordered_json ToJson(const DiagnoseRequest& request, const Comparison& comparison) {
  nlohmann::ordered_json json = {{"robot", request.files.robot.string()},
                                 {"mjcf", request.files.mjcf.string()},
                                 {"mujoco", mj_versionString()},
                                 {"verdict", comparison.Agrees() ? "pass" : "disagreement"}};
  if (const std::optional<double> tolerance = request.judging.Find()) json["tolerance"] = *tolerance;
  json["notes"] = ListLoadNotes();
  for (const std::string& note : comparison.notes) json["notes"].push_back(note);
  AddCauses(comparison, &json);
  return json;
}

/// Writes the first file with its causes corrected, and compares it with the second. @returns the last line.
std::string WriteRepair(const DiagnoseRequest& request, const DescriptionFile& first, DescriptionFile* second,
                        const Comparison& comparison, OutputFile* output) {
  const std::string nothing = request.repaired_file + " is not written: ";
  const std::string a = first.path().filename().string();
  const std::string b = second->path().filename().string();
  if (comparison.Agrees()) return nothing + a + " agrees with " + b;
  if (!comparison.causes || comparison.causes->items.empty()) return nothing + "no cause is known";
  if (comparison.causes->of_second) {
    const std::string command = TryRepair(request, comparison).command;
    return nothing + "the cause is in " + b + (command.empty() ? "" : "; it is repaired by " + command);
  }
  const std::filesystem::path path = request.repaired_file;
  std::string text;
  try {
    text = Repair(request, first, *second, path.parent_path()).text;
  } catch (const InputError& error) {
    return nothing + error.what();
  }
  if (text == first.text()) return nothing + "no cause of these is one that can be written";
  output->Write(text);
  DescriptionFile repaired(path, std::move(text), request.urdf);
  const Comparison again = Compare(request, &repaired, second, [](long) { return !IsInterrupted(); });
  const std::string name = path.filename().string();
  if (again.Agrees()) return Paint(Tone::kGood, "REPAIRED") + ": " + name + " agrees with " + b;
  return fmt::format("{} still differs from {}: {}", name, b, ListDifferences(again).front());
}

int Run(DiagnoseRequest request) {
  constexpr int kStates = 200;
  request.TakeFiles("diagnose");
  request.options.samples = kStates;
  request.options.ignore = request.ignore;
  DescriptionFile first(request.files.robot, request.urdf);
  DescriptionFile second(request.files.mjcf, request.urdf);
  CatchInterrupts();
  ResultFile json(request.json_file);
  std::optional<OutputFile> output;
  if (!request.repaired_file.empty()) output.emplace(request.repaired_file);
  ProgressBar bar("comparing", request.options.samples, request.quiet);
  const Comparison comparison =
      Compare(request, &first, &second, [&](long samples) { return bar.GoOn(samples); });
  bar.Finish();
  json.Write([&] { return ToJson(request, comparison); });
  if (!json.TakesStdout()) {
    RepairTrial repair = TryRepair(request, comparison);
    if (output) repair.command.clear();  // it is being written
    PrintAnswer(MakeAnswer(request, comparison, repair));
  }
  if (IsInterrupted()) return ReportFailure("interrupted");
  if (output) {
    const std::string line = WriteRepair(request, first, &second, comparison, &*output);
    if (!json.TakesStdout()) fmt::print("{}\n", Wrap(line, 2));
  }
  return comparison.Agrees() ? kSuccess : kDisagreement;
}

}  // namespace

void AddDiagnoseCommand(Command app) {
  const auto request = std::make_shared<DiagnoseRequest>();
  Command command = app.AddCommand("diagnose", "Say why two descriptions differ, and repair the first");
  AddFileOptions(command, "The description that may be wrong: parameter file (TOML), URDF or MJCF",
                 "Another one of the same robot; without both, the shipped pair", &request->files);
  AddUrdfOptions(command, &request->urdf);
  AddJudgingOptions(command, request.get());
  AddIgnoreOption(command, &request->ignore);
  const auto is_file = [](const std::string& name) {
    return name == "-" ? "must be a file, got -" : std::string();
  };
  command
      .AddOption(
          "--write FILE", &request->repaired_file,
          "Write the first description with its causes corrected to this file, and compare it with the "
          "second")
      .Check(is_file);
  AddJsonOption(command, "the results", &request->json_file);
  command.AddFlag("--quiet", &request->quiet, "No progress");
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
