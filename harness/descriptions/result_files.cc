#include "harness/descriptions/result_files.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/files.h"

namespace dexcheck {
namespace {

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

std::string DescribeShape(const std::vector<size_t>& shape) {
  std::string text;
  for (const size_t size : shape) text += (text.empty() ? "" : " x ") + std::to_string(size);
  return text.empty() ? "one number" : text;
}

/// The numbers of one state.
Eigen::Map<const VectorXd> MapRow(const NpyArray& array, size_t sample) {
  const size_t width = array.values.size() / array.shape[0];
  return {array.values.data() + sample * width, static_cast<Eigen::Index>(width)};
}

ProgramLayout ReadLayout(const std::filesystem::path& path, const RobotDescription& robot) {
  if (!Exists(path)) return ProgramLayout(robot);
  const std::optional<Json> json = ParseResult(ReadBytes(path));
  if (!json) throw InputError(path.string() + ": must be a JSON object");
  return {robot, *json, path.string()};
}

}  // namespace

std::string WriteStateLines(const StateTable& states) {
  std::string lines;
  for (size_t sample = 0; sample < states.q.shape[0]; ++sample) {
    const auto q = MapRow(states.q, sample), v = MapRow(states.v, sample);
    const OrderedJson line = {{"id", sample},
                              {"q", std::vector<double>(q.begin(), q.end())},
                              {"v", std::vector<double>(v.begin(), v.end())}};
    lines += line.dump() + "\n";
  }
  return lines;
}

std::string WriteLayout(const RobotDescription& robot, const std::string& origin) {
  const ProgramLayout layout(robot);
  OrderedJson json = layout.ToJson();
  const Vector3d& g = robot.spec.gravity;
  json["robot"] = robot.spec.name;
  json["source"] = origin;
  json["gravity"] = {g[0], g[1], g[2]};
  return json.dump(2, ' ', false, OrderedJson::error_handler_t::replace) + "\n";
}

ResultFiles::ResultFiles(const std::filesystem::path& folder, const RobotDescription& robot)
    : LayoutProvider(ReadLayout(folder / "layout.json", robot)), folder_(folder), name_(folder.string()) {
  const RobotModel model(robot.spec);
  q_ = ParseNpy(ReadBytes(folder / "q.npy", kMostData), (folder / "q.npy").string());
  const size_t count = q_.shape.empty() ? 0 : q_.shape[0];
  count_ = static_cast<long>(count);
  if (count == 0) throw InputError((folder / "q.npy").string() + ": must have states, got none");
  q_ = ReadArray("q.npy", {count, static_cast<size_t>(model.num_positions())});
  v_ = ReadArray("v.npy", {count, static_cast<size_t>(model.num_velocities())});
  if (Exists(folder_ / "results.jsonl")) {
    ReadLines(folder_ / "results.jsonl");
    return;
  }
  const auto n = static_cast<size_t>(layout().size());
  for (const ResultKey& key : kResultKeys) {
    std::vector<size_t> shape = {count};
    shape.resize(shape.size() + static_cast<size_t>(key.dimensions), n);
    const std::string file = std::string(key.name) + ".npy";
    if (Exists(folder_ / file)) terms_.emplace(key.name, ReadArray(file, shape));
  }
  if (!terms_.empty()) return;
  throw InputError(folder.string() +
                   ": must have results: M.npy, C.npy, c.npy, g.npy, h.npy, friction.npy, "
                   "kinetic_energy.npy, potential_energy.npy or results.jsonl, got none");
}

void ResultFiles::ReadLines(const std::filesystem::path& path) {
  lines_.resize(static_cast<size_t>(count_));
  std::vector<bool> seen(lines_.size(), false);
  std::istringstream text(ReadBytes(path, kMostData));
  long number = 0;
  for (std::string line; std::getline(text, line);) {
    const std::string source = path.string() + ":" + std::to_string(++number);
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const std::optional<Json> parsed = ParseResult(line);
    if (!parsed) throw InputError(source + ": must be a JSON object (NaN and Infinity are none)");
    const Json& json = *parsed;
    // Without ids the lines are in the order of the states.
    const Json id = json.value("id", Json(number - 1));
    if (!id.is_number_integer() || id < 0 || id >= count_) {
      throw InputError(source + ": id: must be a number of a state below " + std::to_string(count_) +
                       ", got " + Abbreviate(id.dump()));
    }
    const auto sample = id.get<size_t>();
    lines_[sample] =
        ReadResult(json, layout(), layout().WriteVelocities(MapRow(q_, sample), MapRow(v_, sample)), source);
    seen[sample] = true;
  }
  const auto missing = std::ranges::find(seen, false);
  if (missing == seen.end()) return;
  throw InputError(path.string() + ": must have a line for each state, got none for state " +
                   std::to_string(missing - seen.begin()));
}

bool ResultFiles::ReadState(DynamicsState* state) const {
  if (state->sample >= count_) return false;
  state->q = MapRow(q_, static_cast<size_t>(state->sample));
  state->xi = MapRow(v_, static_cast<size_t>(state->sample));
  return true;
}

NpyArray ResultFiles::ReadArray(const std::string& file, const std::vector<size_t>& shape) const {
  const std::string source = (folder_ / file).string();
  NpyArray array = ParseNpy(ReadBytes(folder_ / file, kMostData), source);
  if (array.shape != shape)
    throw InputError(source + ": must be " + DescribeShape(shape) + ", got " + DescribeShape(array.shape));
  if (file != "q.npy" && file != "v.npy") return array;
  for (size_t i = 0; i < array.values.size(); ++i) {
    if (std::isfinite(array.values[i])) continue;
    throw InputError(source + ": must have finite numbers, got " + FormatNumber(array.values[i]) +
                     " in state " + std::to_string(i / shape[1]));
  }
  return array;
}

TermResults ResultFiles::Evaluate(long sample, const VectorXd& q, const VectorXd& xi) {
  const auto state = static_cast<size_t>(sample);
  TermResults terms;
  if (!lines_.empty()) {
    terms = lines_[state];
  } else {
    terms = CollectTerms(layout().WriteVelocities(q, xi), [&](const ResultKey& key) {
      const auto found = terms_.find(key.name);
      if (found == terms_.end()) return std::vector<double>();
      const auto row = MapRow(found->second, state);
      return std::vector<double>(row.begin(), row.end());
    });
  }
  layout().ReadTerms(q, xi, &terms);
  return terms;
}

}  // namespace dexcheck
