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

std::string OfferRepair(const ConsistencyRequest& request, const Comparison& comparison) {
  if (!comparison.causes || comparison.causes->causes.empty()) return "";
  const bool of_second = comparison.causes->of_second;
  const std::filesystem::path& path = of_second ? request.files.mjcf : request.files.robot;
  const std::filesystem::path& other = of_second ? request.files.robot : request.files.mjcf;
  try {
    const DescriptionFile file(path, request.urdf);
    if (!Repair(request, file, DescriptionFile(other, request.urdf), path.parent_path()).agrees) return "";
  } catch (const InputError&) {
    return "";
  }
  return fmt::format("dexcheck diagnose {} {} --write FILE", QuoteForShell(path.string()),
                     QuoteForShell(other.string()));
}

}  // namespace dexcheck::cli
