#include "harness/cli/copy_scenario.h"

#include <fmt/format.h>

#include <vector>

#include "harness/base/files.h"
#include "harness/cli/commands.h"
#include "harness/cli/output_file.h"
#include "harness/cli/run_folder.h"
#include "harness/engine/mjcf_file.h"

namespace dexcheck::cli {
namespace {

namespace fs = std::filesystem;

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

int CopyScenario(const std::string& name, const std::string& out) {
  const fs::path source = kScenarios.Find(name);
  const ScenarioFiles files = FindScenario(name, {}, 0);
  const std::vector<std::string> parts = ListMjcfFiles(files.mjcf);
  const RunFolder folder(out.empty() ? source.stem().string() : out, "");
  std::string text = ReadTextFile(source.string());
  // As the scenario writes the files: from its own folder.
  const auto refer = [&](const std::string& stated, const char* table, const char* key,
                         const fs::path& file) {
    const std::string own = file.filename().string();
    const std::string written = fs::path(stated).lexically_relative(source.parent_path()).generic_string();
    const size_t at = stated.empty() ? std::string::npos : text.find('"' + written + '"');
    if (at == std::string::npos) {
      InsertKey(table, fmt::format("{} = \"{}\"\n", key, own), &text);
    } else {
      text.replace(at + 1, written.size(), own);
    }
  };
  refer(files.scenario.model_file, "model", "file", files.robot);
  refer(files.scenario.mjcf_file, "plant", "mjcf", files.mjcf);
  WriteFile(folder.path() / files.robot.filename(), ReadTextFile(files.robot.string()));
  for (const std::string& part : parts) CopyInto(files.mjcf.parent_path() / part, folder.path() / part);
  const fs::path scenario = folder.path() / source.filename();
  WriteFile(scenario, text);
  FindScenario(scenario.string(), {}, 0);
  fmt::print("{0}: {1}, {2}, {3}\nnext: cd {0} && dexcheck run {1}\n", folder.path().string(),
             scenario.filename().string(), files.robot.filename().string(), files.mjcf.filename().string());
  return kSuccess;
}

void WriteFile(const fs::path& path, const std::string& text) { OutputFile(path).Write(text); }

void CopyInto(const fs::path& from, const fs::path& to) {
  fs::create_directories(to.parent_path());
  WriteFile(to, ReadBytes(from));
}

}  // namespace dexcheck::cli
