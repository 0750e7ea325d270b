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

Eigen::Map<const VectorXd> MapRow(const NpyArray& array, long sample) {
  size_t width = 1;
  for (size_t i = 1; i < array.shape.size(); ++i) width *= array.shape[i];
  return {array.values.data() + static_cast<size_t>(sample) * width, static_cast<Eigen::Index>(width)};
}

ProgramLayout ReadLayout(const std::filesystem::path& path, const RobotDescription& robot) {
  if (!Exists(path)) return ProgramLayout(robot);
  const std::optional<Json> json = ParseResult(ReadBytes(path));
  if (!json) throw InputError(path.string() + ": must be a JSON object");
  return {robot, *json, path.string()};
}

}  // namespace

StateTable DrawStates(const RobotDescription& robot, long count, const StateRange& range,
                      std::uint64_t seed) {
  const RobotModel model(robot.spec);
  const auto rows = static_cast<size_t>(count);
  const auto positions = static_cast<size_t>(model.num_positions());
  const auto velocities = static_cast<size_t>(model.num_velocities());
  StateTable states{{{rows, positions}, {}}, {{rows, velocities}, {}}};
  StateSource source(model, range, seed);
  VectorXd q(model.num_positions());
  VectorXd xi(model.num_velocities());
  for (long sample = 0; sample < count; ++sample) {
    source.DrawPositions(&q);
    source.DrawVelocity(&xi);
    states.q.values.insert(states.q.values.end(), q.begin(), q.end());
    states.v.values.insert(states.v.values.end(), xi.begin(), xi.end());
  }
  return states;
}

std::string WriteStateLines(const StateTable& states) {
  std::string lines;
  for (size_t sample = 0; sample < states.q.shape[0]; ++sample) {
    const auto q = MapRow(states.q, static_cast<long>(sample));
    const auto v = MapRow(states.v, static_cast<long>(sample));
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
  const auto find = [&](const std::string& term, const std::vector<size_t>& shape) {
    const std::string file = term + ".npy";
    if (Exists(folder_ / file)) terms_.emplace(term, ReadArray(file, shape));
  };
  for (const char* term : {"M", "C"}) find(term, {count, n, n});
  for (const char* term : {"c", "g", "h", "friction"}) find(term, {count, n});
  for (const char* term : {"kinetic_energy", "potential_energy"}) find(term, {count});
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
    const auto state = static_cast<long>(sample);
    lines_[sample] =
        ReadResult(json, layout(), layout().WriteVelocities(Row(q_, state), Row(v_, state)), source);
    seen[sample] = true;
  }
  const auto missing = std::ranges::find(seen, false);
  if (missing == seen.end()) return;
  throw InputError(path.string() + ": must have a line for each state, got none for state " +
                   std::to_string(missing - seen.begin()));
}

bool ResultFiles::ReadState(DynamicsState* state) const {
  if (state->sample >= count_) return false;
  state->q = Row(q_, state->sample);
  state->xi = Row(v_, state->sample);
  return true;
}

NpyArray ResultFiles::ReadArray(const std::string& file, const std::vector<size_t>& shape) const {
  const std::string source = (folder_ / file).string();
  NpyArray array = Check(ParseNpy(ReadBytes(folder_ / file, kMostData), source), source, shape);
  if (file != "q.npy" && file != "v.npy") return array;
  for (size_t i = 0; i < array.values.size(); ++i) {
    if (std::isfinite(array.values[i])) continue;
    throw InputError(source + ": must have finite numbers, got " + FormatNumber(array.values[i]) +
                     " in state " + std::to_string(i / shape[1]));
  }
  return array;
}

NpyArray ResultFiles::Check(NpyArray array, const std::string& source, const std::vector<size_t>& shape) {
  if (array.shape != shape) {
    throw InputError(source + ": must be " + DescribeShape(shape) + ", got " + DescribeShape(array.shape));
  }
  return array;
}

VectorXd ResultFiles::Row(const NpyArray& array, long sample) { return MapRow(array, sample); }

VectorXd ResultFiles::FindRow(const std::string& term, long sample) const {
  const auto found = terms_.find(term);
  return found == terms_.end() ? VectorXd() : Row(found->second, sample);
}

TermResults ResultFiles::Evaluate(long sample, const VectorXd& q, const VectorXd& xi) {
  TermResults terms;
  if (!lines_.empty()) {
    terms = lines_[static_cast<size_t>(sample)];
    layout().ReadTerms(q, xi, &terms);
    return terms;
  }
  const Eigen::Index n = layout().size();
  const auto matrix = [&](const char* term) {
    // Rows as NumPy has them.
    const VectorXd numbers = FindRow(term, sample);
    return numbers.size() == 0 ? MatrixXd() : MatrixXd(Eigen::Map<const RowMatrixXd>(numbers.data(), n, n));
  };
  terms.M = matrix("M");
  terms.coriolis = FindRow("c", sample);
  const MatrixXd C = matrix("C");
  if (C.size() > 0 && terms.coriolis.size() == 0) terms.coriolis = C * layout().WriteVelocities(q, xi);
  terms.gravity = FindRow("g", sample);
  terms.bias = FindRow("h", sample);
  terms.friction = FindRow("friction", sample);
  terms.AddBias();
  const VectorXd kinetic = FindRow("kinetic_energy", sample);
  const VectorXd potential = FindRow("potential_energy", sample);
  if (kinetic.size() > 0) terms.kinetic = kinetic[0];
  if (potential.size() > 0) terms.potential = potential[0];
  layout().ReadTerms(q, xi, &terms);
  return terms;
}

}  // namespace dexcheck
