#include <fmt/format.h>

#include <optional>
#include <string>

#include "controller/common/errors.h"
#include "harness/base/console.h"
#include "harness/base/interrupts.h"
#include "harness/cli/consistency_report.h"
#include "harness/comparison/file_differences.h"
#include "harness/corrections/read_printed.h"
#include "harness/corrections/write_repaired.h"
#include "harness/engine/mjcf_file.h"

namespace dexcheck::cli {
namespace {

/// Returns the text of `file` with the causes corrected by which it differs from `other`.
/// @param folder in which the text will stand. @throws InputError for what its format has no place for.
RepairedFile Repair(const ConsistencyRequest& request, const DescriptionFile& file,
                    const DescriptionFile& other, const std::filesystem::path& folder) {
  PrintedRobot printed = ReadPrintedRobot(file), reference = ReadPrintedRobot(other);
  for (PrintedRobot* const robot : {&printed, &reference}) LeaveOutUnstated(request.ignore, robot);
  LeaveOutUnshared(&printed, &reference);
  return WriteRepaired(file, printed, reference, folder);
}

struct DiagnoseRequest : ConsistencyRequest {
  std::string repaired_file;
};

Json ToJson(const DiagnoseRequest& request, const Comparison& comparison) {
  Json json = {{"robot", request.files.robot.string()},
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
  ReportOutput files(request);
  OutputFile output(request.repaired_file);
  ProgressBar bar("comparing", request.options.samples, request.quiet);
  const Comparison comparison =
      Compare(request, &first, &second, [&](long samples) { return bar.GoOn(samples); });
  bar.Finish();
  RepairTrial repair;
  if (files.prints()) repair = TryRepair(request, comparison);
  if (output.exists()) repair.command.clear();  // it is being written
  Report report{.answer = MakeAnswer(request, comparison, repair), .data = ToJson(request, comparison)};
  if (IsInterrupted()) {
    report.failure = "interrupted";
  } else {
    if (output.exists())
      report.last = Wrap(WriteRepair(request, first, &second, comparison, &output), 2) + "\n";
    report.code = comparison.Agrees() ? kSuccess : kDisagreement;
  }
  return files.Write(report);
}

}  // namespace

RepairTrial TryRepair(const ConsistencyRequest& request, const Comparison& comparison) {
  constexpr int kStates = 50;
  if (!comparison.causes || comparison.causes->items.empty()) return {};
  const bool of_second = comparison.causes->of_second;
  const std::filesystem::path& path = of_second ? request.files.mjcf : request.files.robot;
  const std::filesystem::path& other = of_second ? request.files.robot : request.files.mjcf;
  try {
    const DescriptionFile file(path, request.urdf);
    DescriptionFile reference(other, request.urdf);
    RepairedFile repaired = Repair(request, file, reference, path.parent_path());
    if (!repaired.agrees || repaired.text == file.text()) return {};
    DescriptionFile written(path, std::move(repaired.text), request.urdf);
    ConsistencyRequest short_request = request;
    short_request.options.samples = kStates;
    const Comparison again = Compare(short_request, &written, &reference, [](long) { return true; });
    if (!again.Agrees()) return {"", ListDifferences(again).front()};
  } catch (const InputError&) {
    return {};
  }
  return {fmt::format("dexcheck diagnose {} {} --write FILE", QuoteForShell(path.string()),
                      QuoteForShell(other.string())),
          ""};
}

void AddDiagnoseCommand(CLI::App* app) {
  const auto [command, request] = AddRequest<DiagnoseRequest>(
      app, "diagnose", "Say why two descriptions differ, and repair the first",
      {"dexcheck diagnose arm.urdf arm.xml", "dexcheck diagnose arm.urdf arm.xml --write repaired.urdf"});
  AddFileOptions(command, "The description that may be wrong: parameter file (TOML), URDF or MJCF",
                 "Another one of the same robot; without both, the shipped pair", &request->files);
  AddUrdfOptions(command, &request->urdf);
  AddJudgingOptions(command, request);
  AddIgnoreOption(command, &request->ignore);
  const auto is_file = [](const std::string& name) {
    return name == "-" ? "must be a file, got -" : std::string();
  };
  AddOption(command, "--write FILE", &request->repaired_file,
            "Write the first description corrected, and compare it with the second")
      ->check(is_file);
  AddJsonOption(command, "the results", &request->json_file);
  command->add_flag("--quiet", request->quiet, "No progress");
}

}  // namespace dexcheck::cli
