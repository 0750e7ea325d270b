#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/cli/run_folder.h"
#include "harness/log/log_reader.h"
#include "harness/log/mcap_writer.h"

namespace dexcheck::cli {
namespace {

/// Text is handed on in pieces of this size.
constexpr size_t kChunk = size_t{1} << 20;

struct ExportRequest : Outputs {
  std::filesystem::path run_folder;
  std::string csv_file;
  std::string mcap_file;
  std::vector<std::string> patterns;
  long every = 1;
  bool list = false;
};

/// The signals that are wanted, time before all others.
std::vector<SignalInfo> ListWanted(const LogReader& log, const ExportRequest& request) {
  std::vector<SignalInfo> chosen = ChooseSignals(log, request.patterns);
  if (chosen.front().name != log.signals().front().name) chosen.insert(chosen.begin(), log.signals().front());
  return chosen;
}

/// "time [s],object/X_o.x [m],...": name, column and unit.
std::string MakeHeader(const std::vector<SignalInfo>& signals) {
  std::string header;
  for (const SignalInfo& signal : signals) {
    const std::vector<std::string> units = ListUnits(signal);
    for (size_t k = 0; k < units.size(); ++k) {
      if (!header.empty()) header += ',';
      header += QuoteField(NameColumn(signal, k) + " [" + units[k] + "]");
    }
  }
  return header + '\n';
}

/// 17 significant digits, which read back as the same number, and a comma.
void AddNumber(double value, std::string* text) {
  if (std::isnan(value)) {
    *text += "nan,";  // of either sign
  } else {
    fmt::format_to(std::back_inserter(*text), "{:.17g},", value);
  }
}

void WriteCsv(const LogReader& log, const std::vector<SignalInfo>& signals, const ExportRequest& request) {
  OutputFile file(request.csv_file);
  std::vector<RowMatrixXd> values;
  values.reserve(signals.size());
  for (const SignalInfo& signal : signals) values.push_back(log.ReadSignal(signal.name));
  std::string text = MakeHeader(signals);
  for (long row = 0; row < log.rows(); row += request.every) {
    for (const RowMatrixXd& signal : values) {
      for (const double value : signal.row(row)) AddNumber(value, &text);
    }
    text.back() = '\n';
    if (text.size() < kChunk) continue;
    file.Append(text);
    text.clear();
  }
  file.Append(text);
  file.Finish();
}

/// A column's name in a message. Numbers without one are a list, "values".
std::string NameNumber(const SignalInfo& signal, size_t k) {
  return signal.columns.empty() ? "value" : signal.columns[k];
}

bool IsList(const SignalInfo& signal) { return signal.columns.empty() && signal.width > 1; }

nlohmann::json MakeSchema(const SignalInfo& signal) {
  const std::vector<std::string> units = ListUnits(signal);
  nlohmann::json properties;
  for (size_t k = 0; k < units.size() && !IsList(signal); ++k)
    properties[NameNumber(signal, k)] = {{"type", "number"}, {"description", units[k]}};
  if (IsList(signal))
    properties["values"] = {{"type", "array"}, {"items", {{"type", "number"}}}, {"description", signal.unit}};
  return {{"type", "object"},
          {"title", signal.name},
          {"description", signal.description},
          {"properties", properties}};
}

/// A row as JSON, which has no number for what is not finite: null.
nlohmann::json MakeMessage(const SignalInfo& signal, const Eigen::Ref<const Eigen::RowVectorXd>& row) {
  nlohmann::json message;
  for (long k = 0; k < row.size(); ++k) {
    const nlohmann::json number = std::isfinite(row[k]) ? nlohmann::json(row[k]) : nlohmann::json();
    if (IsList(signal)) {
      message["values"].push_back(number);
    } else {
      message[NameNumber(signal, static_cast<size_t>(k))] = number;
    }
  }
  return message;
}

/// A topic for each signal: "/object/X_o". Times count from the log's first row, for none may be below zero.
void WriteMcap(const LogReader& log, const std::vector<SignalInfo>& signals, const ExportRequest& request,
               McapWriter* out) {
  McapWriter& file = *out;
  const VectorXd time = log.ReadSignal("time").col(0);
  std::vector<RowMatrixXd> values;
  std::vector<std::uint16_t> channels;
  for (size_t i = 1; i < signals.size(); ++i) {
    const SignalInfo& signal = signals[i];
    values.push_back(log.ReadSignal(signal.name));
    channels.push_back(file.AddChannel("/" + signal.name, signal.name, MakeSchema(signal).dump()));
  }
  for (long row = 0; row < log.rows(); row += request.every) {
    for (size_t i = 0; i < values.size(); ++i) {
      file.Write(channels[i], time[row] - time[0], MakeMessage(signals[i + 1], values[i].row(row)).dump());
    }
  }
  file.Finish();
}

/// "m, rad": each unit once.
std::string ListDistinctUnits(const SignalInfo& signal) {
  std::vector<std::string> seen;
  std::string text;
  for (const std::string& unit : ListUnits(signal)) {
    if (std::ranges::find(seen, unit) != seen.end()) continue;
    seen.push_back(unit);
    text += (text.empty() ? "" : ", ") + unit;
  }
  return text;
}

void PrintList(const LogReader& log, const std::vector<SignalInfo>& signals) {
  size_t width = 0;
  for (const SignalInfo& signal : signals) width = std::max(width, signal.name.size());
  fmt::print("{} rows\n{:<{}}  {:>7}  {}\n", log.rows(), "signal", width, "numbers", "[unit] description");
  for (const SignalInfo& signal : signals) {
    const std::string line = fmt::format("{:<{}}  {:>7}  [{}] {}", signal.name, width, signal.width,
                                         ListDistinctUnits(signal), signal.description);
    fmt::print("{}\n", Wrap(line, width + 11));
  }
}

Json ToJson(const LogReader& log, const std::vector<SignalInfo>& signals) {
  Json json = {{"rows", log.rows()}, {"signals", Json::array()}};
  for (const SignalInfo& signal : signals) {
    json["signals"].push_back({{"name", signal.name},
                               {"width", signal.width},
                               {"units", ListUnits(signal)},
                               {"columns", signal.columns},
                               {"description", signal.description}});
  }
  return json;
}

int Run(const ExportRequest& request) {
  if (!request.list && request.csv_file.empty() && request.mcap_file.empty() && request.json_file.empty()) {
    throw InputError("export: --csv FILE.csv or --list is required, or --mcap FILE.mcap");
  }
  const LogReader log(request.run_folder / "log.h5");
  const std::vector<SignalInfo> signals = ListWanted(log, request);
  OutputFile json(request.json_file);
  std::optional<McapWriter> messages;
  if (!request.mcap_file.empty()) messages.emplace(request.mcap_file);
  if (request.list) PrintList(log, signals);
  json.Write([&] { return ToJson(log, signals); });
  if (!request.csv_file.empty()) WriteCsv(log, signals, request);
  if (messages) WriteMcap(log, signals, request, &*messages);
  WarnOfCut(request.run_folder, log);
  return kSuccess;
}

}  // namespace

void AddExportCommand(CLI::App* app) {
  const auto [command, request] = AddRequest<ExportRequest>(
      app, "export", "Write a run's log as a table of numbers (CSV) or as messages (MCAP)",
      {"dexcheck export my_run --list", "dexcheck export my_run --csv run.csv --signals 'object/*,tau'"});
  AddOption(command, "RUN_DIR", &request->run_folder, "Folder of the run, with its log.h5")->required();
  CLI::Option* const csv =
      AddOption(command, "--csv FILE.csv", &request->csv_file, "File to write (- for standard output)");
  CLI::Option* const mcap =
      AddOption(command, "--mcap FILE.mcap", &request->mcap_file,
                "File of messages for Foxglove or PlotJuggler, a topic for each signal");
  AddOption(command, "--signals A,B,...", &request->patterns,
            "Only time and these signals, such as object/*,check/M_bar")
      ->delimiter(',')
      ->allow_extra_args(false);
  AddOption(command, "--every N", &request->every, "Only the first of every N rows")
      ->check(WholeNumber(1, std::numeric_limits<int>::max()))
      ->capture_default_str();
  command->add_flag("--list", request->list, "List signals, units and descriptions")
      ->excludes(csv)
      ->excludes(mcap);
  AddJsonOption(command, "what --list prints", &request->json_file);
}

}  // namespace dexcheck::cli
