#include "harness/cli/file_repair.h"

#include <fmt/format.h>

#include "controller/common/errors.h"
#include "harness/base/console.h"
#include "harness/corrections/read_printed.h"

namespace dexcheck::cli {

RepairedFile Repair(const ConsistencyRequest& request, const DescriptionFile& file,
                    const DescriptionFile& other, const std::filesystem::path& folder) {
  PrintedRobot printed = ReadPrintedRobot(file), reference = ReadPrintedRobot(other);
  for (PrintedRobot* const robot : {&printed, &reference}) LeaveOutUnstated(request.ignore, robot);
  LeaveOutUnshared(&printed, &reference);
  return WriteRepaired(file, request.urdf, printed, reference, folder);
}

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

}  // namespace dexcheck::cli
