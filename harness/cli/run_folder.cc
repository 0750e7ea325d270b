#include "harness/cli/run_folder.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <optional>
#include <sstream>
#include <system_error>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/base/interrupts.h"
#include "harness/base/worst.h"
#include "harness/cli/report.h"
#include "harness/engine/machine.h"
#include "harness/engine/mjcf_file.h"
#include "harness/report/run_data.h"

namespace dexcheck::cli {

namespace {

std::filesystem::path OrShipped(const std::string& file, const char* shipped) {
  return file.empty() ? FindShippedFile(shipped) : std::filesystem::path(file);
}

ScenarioFiles Open(const std::filesystem::path& path, const std::vector<std::string>& overrides,
                   std::uint64_t seed) {
  ScenarioFiles files;
  files.scenario = ParseScenario(ReadBytes(path.string()), path.string(), path.parent_path(), overrides);
  files.scenario.seed = seed;
  files.robot = OrShipped(files.scenario.model_file, "controller/parameters/assistant_robot.toml");
  files.mjcf = OrShipped(files.scenario.mjcf_file, "mjcf/scene.xml");
  return files;
}

std::uint64_t ReadSeed(const LogReader& log, const std::filesystem::path& path) {
  const std::string text = log.ReadText("seed");
  if (const auto seed = ParseNumber<std::uint64_t>(text)) return *seed;
  throw InputError(path.string() + ": seed: must be a whole number, got " + Quote(text));
}

/// The overrides, with the removal of each key of the file that says in another word what one of them sets.
std::vector<std::string> Supersede(const std::filesystem::path& file, std::vector<std::string> overrides) {
  static constexpr std::pair<const char*, const char*> kWords[] = {{"K_p", "natural_frequency"},
                                                                   {"K_v", "damping_ratio"}};
  const TomlDocument document(ReadBytes(file.string()), file.string());
  const std::optional<TomlValue> control = document.Open().Find("control");
  if (!control || !control->IsTable()) return overrides;
  const auto sets = [&](const std::string& key) {
    return std::ranges::any_of(overrides, [&](const std::string& assignment) {
      return assignment.starts_with(key + "=") || assignment == key + "-=";
    });
  };
  const auto is_changed = [&](const std::string& key) { return sets("control." + key); };
  if (sets("control")) return overrides;
  const auto prefer = [&](const std::string& key, const std::string& other) {
    const std::optional<TomlValue> replaced = control->AsTable().Find(other);
    if (!replaced || !is_changed(key) || is_changed(other)) return;
    overrides.push_back("control." + other + "-=");
    Warn(fmt::format("note: {}:{}: control.{} has no effect, control.{} is set instead", file.string(),
                     replaced->line(), other, key));
  };
  for (const auto& [gain, word] : kWords) {
    prefer(gain, word);
    prefer(word, gain);
  }
  return overrides;
}

/// Requires a file that a scenario names. @throws InputError that names the scenario and its key, when it is
/// not there.
void RequireFile(const Scenario& scenario, const char* key, const std::string& file) {
  if (file.empty() || ::access(file.c_str(), R_OK) == 0) return;
  throw InputError(
      fmt::format("{}: {}: {}: cannot be read: {}", scenario.source, key, file, std::strerror(errno)));
}

/// Puts a key's line into a table of the text; an own table at its end when it has none.
void InsertKey(const std::string& table, const std::string& line, std::string* text) {
  const std::string header = "[" + table + "]\n";
  const size_t at = text->starts_with(header) ? 0 : text->find("\n" + header);
  if (at == std::string::npos) {
    *text += "\n" + header + line;
  } else {
    text->insert(text->find(header, at) + header.size(), line);
  }
}

}  // namespace

ScenarioFiles FindScenario(const std::string& name_or_file, const std::vector<std::string>& overrides,
                           std::uint64_t seed) {
  const std::filesystem::path path = kScenarios.Find(name_or_file);
  ScenarioFiles files = Open(path, Supersede(path, overrides), seed);
  RequireFile(files.scenario, "model.file", files.scenario.model_file);
  RequireFile(files.scenario, "plant.mjcf", files.scenario.mjcf_file);
  return files;
}

void RequireFree(const std::filesystem::path& folder) {
  std::error_code error;
  if (Exists(folder) && (!std::filesystem::is_empty(folder, error) || error))
    throw InputError(folder.string() + ": already holds files; give a new folder with --out");
}

std::filesystem::path MakeRunFolder(std::filesystem::path path, const std::string& name) {
  if (path.empty()) {
    path = std::filesystem::path("runs") / name;
    for (int i = 2; Exists(path); ++i)
      path = std::filesystem::path("runs") / (name + "-" + std::to_string(i));
  }
  MakeFolder(path);
  RequireFree(path);
  return path;
}

long RunWithProgress(const std::string& label, long rows, bool quiet, Runner* runner, RunRecorder* recorder) {
  ProgressBar bar(label, rows, quiet);
  long done = 0;
  runner->Run(
      [&](const StepRecord& step) {
        if (done++ >= rows) return;  // steps are made while the one before is checked
        if (recorder != nullptr) recorder->Record(step);
        bar.Update(done);
      },
      [&] { return IsInterrupted() || done >= rows; });
  return std::min(done, rows);
}

void WarnOfCut(const std::filesystem::path& run_folder, const LogReader& log) {
  if (const std::string cut = DescribeCut(log); !cut.empty())
    Warn("note: " + run_folder.string() + ": " + cut);
}

RecordedRun::RecordedRun(const std::filesystem::path& folder, const std::vector<std::string>& controller)
    : log_(folder / "log.h5") {
  log_.ExtractFiles("inputs", unpacked_.path());
  std::vector<std::string> overrides;
  std::istringstream lines(log_.ReadText("overrides"));
  for (std::string line; std::getline(lines, line);) {
    // The files are those of the log, wherever they were.
    const bool is_file = line.starts_with("model.file=") || line.starts_with("plant.mjcf=");
    if (!is_file) overrides.push_back(line);
  }
  overrides.insert(overrides.end(), controller.begin(), controller.end());
  files_ = Open(unpacked_.path() / "scenario.toml", overrides, ReadSeed(log_, folder / "log.h5"));
  // A log is data, and may be anybody's.
  const OwnControllerOptions& own = files_.scenario.controller;
  const std::string named = own.exists() ? own.run : log_.FindText("controller");
  if (controller.empty() && !named.empty())
    throw InputError((folder / "log.h5").string() +
                     ": the run had a controller of your own; name it again: --controller " +
                     QuoteForShell(named));
  files_.robot = FindEmbedded(log_, "robot", unpacked_.path());
  files_.mjcf = FindEmbedded(log_, "mjcf", unpacked_.path());
}

bool RecordedRun::was_checked() const {
  return std::ranges::any_of(log_.signals(),
                             [](const SignalInfo& signal) { return signal.name.starts_with("check/"); });
}

ReplayDifference RecordedRun::Compare(const std::filesystem::path& other_log) const {
  const LogReader other(other_log);
  const RowMatrixXd time = log_.ReadSignal("time");
  ReplayDifference first;
  first.rows = log_.rows();
  long first_row = log_.rows();
  for (const SignalInfo& signal : log_.signals()) {
    const std::vector<OldName>& names = ListOldNames();
    const auto replaced = std::ranges::find_if(names, [&](const OldName& name) {
      return name.of == OldName::Of::kReplaced && name.old == signal.name;
    });
    if (replaced != names.end()) {
      first.replaced.push_back(*replaced);
      continue;
    }
    ++first.signals;
    const RowMatrixXd recorded = log_.ReadSignal(signal.name);
    const RowMatrixXd now = other.ReadSignal(signal.name);
    const double scale = MaxAbsFinite(recorded);
    for (long row = 0; row < recorded.rows(); ++row) {
      for (Eigen::Index col = 0; col < recorded.cols(); ++col) {
        const double value = row < now.rows() ? now(row, col) : std::numeric_limits<double>::quiet_NaN();
        const double before = recorded(row, col);
        if (std::bit_cast<std::uint64_t>(before) == std::bit_cast<std::uint64_t>(value)) continue;
        if (!IsSameWithin(kSignalTolerance, before, value, scale)) first.within_rounding = false;
        if (row >= first_row) continue;
        first_row = row;
        first.signal = signal.name;
        first.time = time(row, 0);
        first.recorded = before;
        first.now = value;
      }
    }
  }
  return first;
}

std::filesystem::path FindShippedFile(const std::filesystem::path& name) {
  std::filesystem::path file = FindInstalled("share/dexcheck" / name);
  if (!Exists(file))
    throw InputError(file.string() + ": does not exist: this program's shipped files are missing");
  return file;
}

std::vector<std::string> ShippedKind::ListNames() const {
  std::vector<std::string> names;
  for (const std::filesystem::path& path : ListFolder(FindShippedFile(folder))) {
    if (path.extension() == ".toml") names.push_back(path.stem().string());
  }
  return names;
}

std::filesystem::path ShippedKind::Find(const std::string& name_or_file) const {
  if (IsTomlFile(name_or_file)) {
    RequireKind(name_or_file, name);
    return name_or_file;
  }
  const std::vector<std::string> known = ListNames();
  if (std::ranges::find(known, name_or_file) != known.end())
    return FindShippedFile(folder) / (name_or_file + ".toml");
  const std::string where = *listed != '\0' ? listed : fmt::format("{}", fmt::join(known, ", "));
  throw InputError(fmt::format("{} {}: is neither shipped ({}) nor a TOML file{}", name, Quote(name_or_file),
                               where, SuggestNearest(name_or_file, known)));
}

void RequireKind(const std::filesystem::path& file, std::string_view wanted) {
  struct FileKind {
    const char* name;
    const char* key;  // no other kind has it
    const char* taken_by;
  };
  static constexpr std::array<FileKind, 3> kKinds = {{{"scenario", "duration", "; `dexcheck run` takes it"},
                                                      {"study", "vary", "; `dexcheck study` takes it"},
                                                      {"parameter file of a robot", "gravity", ""}}};
  std::error_code ignored;
  if (file.extension() != ".toml" || !std::filesystem::is_regular_file(file, ignored)) return;
  std::optional<TomlDocument> document;
  try {
    document.emplace(ReadBytes(file.string()), file.string());
  } catch (const InputError&) {
    return;
  }
  const auto found = std::ranges::find_if(
      kKinds, [&](const FileKind& kind) { return document->Open().Find(kind.key).has_value(); });
  if (found != kKinds.end() && found->name != wanted)
    throw InputError(fmt::format("{} is a {}{}", file.string(), found->name, found->taken_by));
}

bool IsTomlFile(const std::string& name) {
  return name.ends_with(".toml") || name.find('/') != std::string::npos;
}

int CopyScenario(const std::string& name, const std::string& out) {
  const std::filesystem::path source = kScenarios.Find(name);
  const ScenarioFiles files = FindScenario(name, {}, 0);
  const std::vector<std::string> parts = ListMjcfFiles(files.mjcf);
  const std::filesystem::path folder = MakeRunFolder(out.empty() ? source.stem().string() : out);
  std::string text = ReadBytes(source.string());
  // The scenario writes the files' paths from its own folder.
  const auto refer = [&](const std::string& stated, const char* table, const char* key,
                         const std::filesystem::path& file) {
    const std::string own = file.filename().string();
    const std::string written =
        std::filesystem::path(stated).lexically_relative(source.parent_path()).generic_string();
    const size_t at = stated.empty() ? std::string::npos : text.find('"' + written + '"');
    if (at == std::string::npos) {
      InsertKey(table, fmt::format("{} = {}\n", key, QuoteToml(own)), &text);
    } else {
      text.replace(at + 1, written.size(), own);
    }
  };
  refer(files.scenario.model_file, "model", "file", files.robot);
  refer(files.scenario.mjcf_file, "plant", "mjcf", files.mjcf);
  WriteFile(folder / files.robot.filename(), ReadBytes(files.robot.string()));
  for (const std::string& part : parts)
    WriteFile(folder / part, ReadBytes(files.mjcf.parent_path() / part, kMostData));
  const std::filesystem::path scenario = folder / source.filename();
  WriteFile(scenario, text);
  FindScenario(scenario.string(), {}, 0);
  fmt::print("{0}: {1}, {2}, {3}\nnext: cd {0} && dexcheck run {1}\n", folder.string(),
             scenario.filename().string(), files.robot.filename().string(), files.mjcf.filename().string());
  return 0;
}

}  // namespace dexcheck::cli
