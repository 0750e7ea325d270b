#include "harness/cli/state_file.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"

namespace dexcheck::cli {
namespace {

using Json = nlohmann::json;

/// Reads the keys that it knows and refuses all others. A key is named by its path, such as "object.X_o".
class StateReader {
 public:
  explicit StateReader(const std::string& file) : file_(file) {}

  State Read(const RobotModel& model) {
    const Json json = Parse();
    CheckKeys(json, "", {"q", "xi", "object", "kappa"});
    State state;
    state.q = ReadVector(Get(json, "", "q"), "q", model.num_positions());
    state.xi = ReadVector(Get(json, "", "xi"), "xi", model.num_velocities());
    if (json.contains("object")) {
      if (!model.object()) Fail("object", "the robot of " + model.spec().source + " has no [object]");
      state.object = ReadObject(json.at("object"));
    }
    if (json.contains("kappa")) state.kappa = ReadKappa(json.at("kappa"));
    return state;
  }

 private:
  [[noreturn]] void Fail(const std::string& key, const std::string& problem) const {
    throw InputError(file_ + ": " + key + (key.empty() ? "" : ": ") + problem);
  }

  [[nodiscard]] Json Parse() const {
    try {
      return Json::parse(ReadTextFile(file_));
    } catch (const Json::exception& error) {
      // The library's messages begin with "[json.exception.NAME.NUMBER] ".
      const std::string message = error.what();
      const size_t tag = message.find("] ");
      Fail("", "not valid JSON: " + Abbreviate(tag == std::string::npos ? message : message.substr(tag + 2)));
    }
  }

  void CheckKeys(const Json& table, const std::string& prefix, const std::vector<std::string>& known) const {
    const std::string key = prefix.empty() ? "" : prefix.substr(0, prefix.size() - 1);
    if (!table.is_object()) Fail(key, "must be a JSON object, got " + Abbreviate(table.dump()));
    for (const auto& item : table.items()) {
      if (std::find(known.begin(), known.end(), item.key()) != known.end()) continue;
      std::string list;
      for (const std::string& name : known) list += (list.empty() ? "" : ", ") + name;
      Fail(prefix + Abbreviate(item.key()), "unknown key, known here are " + list);
    }
  }

  [[nodiscard]] const Json& Get(const Json& table, const std::string& prefix, const std::string& key) const {
    if (!table.contains(key)) Fail(prefix + key, "missing key");
    return table.at(key);
  }

  void CheckList(const Json& list, const std::string& key, int size, const std::string& what) const {
    const std::string expected = "must be a list of " + std::to_string(size) + " " + what + ", got ";
    if (!list.is_array()) Fail(key, expected + Abbreviate(list.dump()));
    if (list.size() != static_cast<size_t>(size)) Fail(key, expected + std::to_string(list.size()));
  }

  [[nodiscard]] VectorXd ReadVector(const Json& list, const std::string& key, int size) const {
    CheckList(list, key, size, "numbers");
    VectorXd values(size);
    for (int i = 0; i < size; ++i) {
      const Json& value = list[static_cast<size_t>(i)];
      const std::string entry = key + "[" + std::to_string(i) + "]";
      if (!value.is_number()) Fail(entry, "must be a number, got " + Abbreviate(value.dump()));
      values[i] = value.get<double>();
    }
    return values;
  }

  [[nodiscard]] ObjectState ReadObject(const Json& object) const {
    CheckKeys(object, "object.", {"X_o", "X_o_dot"});
    return {ReadVector(Get(object, "object.", "X_o"), "object.X_o", 6),
            ReadVector(Get(object, "object.", "X_o_dot"), "object.X_o_dot", 6)};
  }

  [[nodiscard]] Eigen::Matrix<double, 4, 5> ReadKappa(const Json& rows) const {
    CheckList(rows, "kappa", 4, "lists");
    Eigen::Matrix<double, 4, 5> kappa;
    for (int i = 0; i < 4; ++i) {
      kappa.row(i) = ReadVector(rows[static_cast<size_t>(i)], "kappa[" + std::to_string(i) + "]", 5);
    }
    return kappa;
  }

  std::string file_;
};

}  // namespace

State ReadState(const std::string& file, const RobotModel& model) { return StateReader(file).Read(model); }

}  // namespace dexcheck::cli
