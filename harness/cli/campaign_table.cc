#include "harness/cli/campaign_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <string_view>

#include "harness/base/bounded_json.h"
#include "harness/base/files.h"
#include "harness/base/interrupts.h"
#include "harness/base/process_pool.h"
#include "harness/base/version.h"
#include "harness/cli/report.h"

namespace dexcheck::cli {
namespace {

/// In the order of MutantOutcome.
constexpr std::array<std::string_view, 4> kOutcomes = {"found", "refused", "no effect", "survived"};

/// A line of the table.
struct Row {
  std::string kind;
  int faults = 0, cause_right = 0, part_named = 0, with_part = 0;
  std::array<int, kOutcomes.size()> outcomes{};

  void Add(const Json& fault) {
    ++faults;
    const auto outcome = std::ranges::find(kOutcomes, fault.at("outcome").get<std::string>());
    ++outcomes.at(static_cast<size_t>(outcome - kOutcomes.begin()));
    cause_right += fault.at("cause_right").get<bool>() ? 1 : 0;
    with_part += fault.contains("part_named") ? 1 : 0;
    part_named += fault.value("part_named", false) ? 1 : 0;
  }
};

/// One for each kind, and one for all.
std::vector<Row> SumUp(const std::vector<Json>& faults) {
  std::vector<Row> rows;
  Row all{.kind = "all"};
  for (const Json& fault : faults) {
    const std::string kind = fault.at("kind");
    auto row = std::ranges::find(rows, kind, &Row::kind);
    if (row == rows.end()) row = rows.insert(rows.end(), Row{.kind = kind});
    row->Add(fault);
    all.Add(fault);
  }
  rows.push_back(all);
  return rows;
}

}  // namespace

Json MakeFaultResult(const std::string& kind, const std::string& name, MutantOutcome outcome,
                     bool cause_right, const std::string& remark) {
  return {{"kind", kind},
          {"name", name},
          {"outcome", kOutcomes[static_cast<size_t>(outcome)]},
          {"cause_right", cause_right},
          {"remark", remark}};
}

void Campaign::Resume(const std::string& json_file, const std::vector<std::filesystem::path>& inputs) {
  std::string texts;
  for (const std::filesystem::path& input : inputs) texts += ReadBytes(input.string());
  head["dexcheck_version"] = Version();
  head["inputs_hash"] = std::hash<std::string>()(texts);
  if (json_file.empty() || json_file == "-") return;
  if (SizeOf(json_file) == 0) return;  // a pipe, too
  std::ifstream file(json_file);
  const Json json = ParseJson<Json>(std::string{std::istreambuf_iterator<char>(file), {}});
  if (!json.is_object() || json.value("complete", Json()) != false) return;
  for (const auto& [key, value] : head.items())
    if (!json.contains(key) || json[key] != value) return;
  try {
    faults = json.at("faults").get<std::vector<Json>>();
    for (const Json& fault : faults) static_cast<void>(fault.at("remark").get<std::string>());
    SumUp(faults);
  } catch (const std::exception&) {  // not one of these
    faults.clear();
  }
  if (!faults.empty())
    fmt::print(stderr, "{} of {} faults are in {} already\n", faults.size(), total, json_file);
}

void Campaign::Make(std::uint64_t jobs, bool quiet, const std::function<Json(size_t fault)>& make) {
  const size_t done = faults.size();
  ProgressBar bar("changing", static_cast<long>(total), quiet);
  const auto run = [&](size_t i) { return FormatJson(make(done + i)); };
  const auto take = [&](size_t /*i*/, const std::string& result) {
    faults.push_back(Json::parse(result));
    bar.Update(static_cast<long>(faults.size()));
  };
  RunJobs("a fault", total - done, CountJobs(jobs), run, take, IsInterrupted);
}

Report Campaign::MakeReport() const {
  const std::vector<Row> rows = SumUp(faults);
  const Row& all = rows.back();
  const bool are_all = all.outcomes[3] == 0;
  Report report{
      .answer = {are_all ? Answer::Tone::kGood : Answer::Tone::kBad, are_all ? "ALL FOUND" : "SURVIVORS"},
      .data = head};
  std::string& sentence = report.answer.sentence;
  sentence = fmt::format("{} of {} faults that are possible and have an effect were found", all.outcomes[0],
                         all.outcomes[0] + all.outcomes[3]);
  if (names_causes) sentence += fmt::format("; the cause is right in {}", all.cause_right);
  if (all.with_part > 0) sentence += fmt::format(", the part in {} of {}", all.part_named, all.with_part);
  sentence += ".";
  const bool is_complete = faults.size() == total;
  if (is_complete) {
    report.code = are_all ? kSuccess : kDisagreement;
  } else {
    report.SetIncomplete(static_cast<long>(faults.size()), static_cast<long>(total), "faults were made");
  }
  report.data["complete"] = is_complete;
  std::vector<TableRow> table = {{},
                                 {{"what was wrong", "faults", "found", "refused", "no effect", "survived",
                                   "cause", all.with_part > 0 ? "part" : ""}}};
  for (const Row& row : rows) {
    TableRow& line = table.emplace_back();
    line.cells = {row.kind, std::to_string(row.faults)};
    for (const int count : row.outcomes) line.cells.push_back(std::to_string(count));
    line.cells.push_back(std::to_string(row.cause_right));
    line.cells.push_back(row.with_part > 0 ? fmt::format("{} of {}", row.part_named, row.with_part) : "");
    const auto [found, refused, no_effect, survived] = row.outcomes;
    report.data["kinds"][row.kind] = {{"faults", row.faults},         {"found", found},
                                      {"refused", refused},           {"no_effect", no_effect},
                                      {"survived", survived},         {"cause_right", row.cause_right},
                                      {"part_named", row.part_named}, {"with_a_part", row.with_part}};
  }
  report.AddTable("<>>>>>>>", table);
  report.data["faults"] = faults;
  for (const Json& fault : faults) {
    const std::string remark = fault.at("remark");
    if (!remark.empty()) report.Add(remark);
  }
  return report;
}

}  // namespace dexcheck::cli
