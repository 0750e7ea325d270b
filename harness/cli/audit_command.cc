#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "controller/common/text.h"
#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/descriptions/audit.h"
#include "harness/descriptions/read_description.h"
#include "harness/engine/mjcf_file.h"

namespace dexcheck::cli {
namespace {

struct AuditRequest : Outputs {
  std::filesystem::path robot;
  UrdfOptions urdf = {.keep_impossible = true};
};

Json ConditionToJson(double value) { return std::isfinite(value) ? Json(value) : Json("infinity"); }

Json ToJson(const AuditRequest& request, const RobotDescription& robot, const AuditResult& result) {
  Json json = {{"robot", request.robot.string()},
               {"verdict", result.IsGood() ? "pass" : "disagreement"},
               {"condition_number", ConditionToJson(result.condition)}};
  json["findings"] = Json::array();
  for (const AuditFinding& finding : result.findings) {
    Json entry = {{"level", NameOf(finding.level)},
                  {"check", finding.check},
                  {"where", finding.where},
                  {"line", finding.line},
                  {"text", finding.text}};
    if (finding.condition_without)
      entry["condition_number_without"] = ConditionToJson(*finding.condition_without);
    json["findings"].push_back(entry);
  }
  json["notes"] = robot.notes;
  for (const std::string& note : ListLoadNotes()) json["notes"].push_back(note);
  return json;
}

std::string FormatCondition(double condition) {
  return std::isfinite(condition) ? fmt::format("{:.2g}", condition) : "infinite";
}

/// @param report gets the answer and what was found.
void AddFindings(const AuditRequest& request, const RobotDescription& robot, const AuditResult& result,
                 Report* report) {
  const std::string file = request.robot.filename().string();
  const auto counted = std::ranges::count_if(
      result.findings, [](const AuditFinding& finding) { return finding.level != AuditLevel::kNote; });
  report->answer = {.word = "GOOD", .sentence = "no impossible and no suspicious values."};
  if (counted > 0)
    report->answer = {
        Answer::Tone::kBad, "FOUND",
        fmt::format("{} {}.", counted,
                    counted == 1 ? "impossible or suspicious value" : "impossible or suspicious values")};
  report->details = fmt::format(
      "\n{}: {}, {} joints, {} links\ncondition number of M: {} (median of random states)\n\n",
      robot.spec.name, file, robot.spec.joints.size(), robot.parts.size(), FormatCondition(result.condition));
  for (const AuditFinding& finding : result.findings) {
    std::string line = fmt::format("{:<11}{}: {} {}", NameOf(finding.level),
                                   finding.line > 0 ? fmt::format("{}:{}", file, finding.line) : file,
                                   Abbreviate(finding.where), finding.text);
    if (finding.condition_without) {
      line += "; with a plausible inertia, M's condition number would be " +
              FormatCondition(*finding.condition_without);
    }
    report->Add(line, 11);
  }
  for (const std::string& note : robot.notes)
    report->Add(fmt::format("{:<11}{}: {}", "note", file, note), 11);
}

/// A case for each kind of check, which fails with all that it found.
void AddCases(const AuditResult& result, Report* report) {
  std::vector<JUnitCase>& cases = report->cases;
  for (const char* check :
       {"mass", "inertia", "density", "com", "mirror", "load", "offset", "range", "axis", "name"})
    cases.push_back({"audit", check});
  for (const AuditFinding& finding : result.findings) {
    auto test = std::ranges::find(cases, finding.check, &JUnitCase::name);
    if (test == cases.end()) test = cases.insert(test, {"audit", finding.check});
    std::string& text = finding.level == AuditLevel::kNote ? test->output : test->failure;
    text += (text.empty() ? "" : "\n") + finding.where + " " + finding.text;
  }
}

int Run(const AuditRequest& request) {
  const RobotDescription robot = ReadDescription(request.robot, request.urdf);
  ReportOutput files(request);
  const AuditResult result = AuditRobot(robot);
  Report report{.data = ToJson(request, robot, result), .suite = "audit." + request.robot.stem().string()};
  AddFindings(request, robot, result, &report);
  AddCases(result, &report);
  if (!result.IsGood()) report.code = kDisagreement;
  return files.Write(report);
}

}  // namespace

void AddAuditCommand(CLI::App* app) {
  const auto [command, request] = AddRequest<AuditRequest>(
      app, "audit", "Find impossible and suspicious values in one description of a robot",
      {"dexcheck audit arm.urdf", "dexcheck audit arm.xml --junit audit.xml"});
  AddOption(command, "FILE", &request->robot, "Parameter file (TOML), URDF or MJCF")
      ->type_name("FILE")
      ->required();
  AddUrdfOptions(command, &request->urdf);
  AddJsonOption(command, "the findings", &request->json_file);
  AddJUnitOption(command, &request->junit_file);
  command->add_flag("--quiet", request->quiet, "Print the verdict only");
}

}  // namespace dexcheck::cli
