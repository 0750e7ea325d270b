#include "harness/scenario/state_file.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/base/bounded_json.h"
#include "harness/base/files.h"

namespace dexcheck {
namespace {

using Json = nlohmann::json;

// Three hard fingers are the fewest that can balance every wrench.
constexpr size_t kFewestContacts = 3;

/// Reads the keys that it knows and refuses all others. A key is named by its path, such as "object.X_o".
class StateReader {
 public:
  explicit StateReader(const std::string& file) : file_(file) {}

  State Read(std::string_view text, const RobotModel& model) {
    const Json json = Parse(text);
    CheckKeys(json, "", {"q", "xi", "object", "kappa", "contact_points", "fingers", "mu", "law"});
    State state;
    const std::string balls = ListBalls(model);
    state.q =
        ReadVector(Get(json, "", "q"), "q", model.num_positions(), balls.empty() ? "" : balls + " four");
    state.xi =
        ReadVector(Get(json, "", "xi"), "xi", model.num_velocities(), balls.empty() ? "" : balls + " three");
    CheckQuaternions(model, state.q);
    if (json.contains("object")) {
      if (!model.object()) Fail("object", "the robot of " + model.spec().source + " has no [object]");
      state.object = ReadObject(json.at("object"));
    }
    const bool has_contacts = json.contains("kappa") || json.contains("contact_points");
    for (const char* key : {"fingers", "mu"}) {
      if (json.contains(key) && !has_contacts) Fail(key, "needs kappa or contact_points");
    }
    if (has_contacts) state.contacts = ReadContacts(json, model);
    if (json.contains("law")) {
      if (!state.object || !state.contacts) Fail("law", "needs object, and kappa or contact_points");
      state.law = ReadLaw(json.at("law"), model.num_velocities());
    }
    return state;
  }

 private:
  [[noreturn]] void Fail(const std::string& key, const std::string& problem) const {
    throw InputError(file_ + ": " + key + (key.empty() ? "" : ": ") + problem);
  }

  [[nodiscard]] Json Parse(std::string_view text) const {
    if (IsNestedTooDeep(text))
      Fail("", "nested too deeply, more than " + std::to_string(kMostBrackets) + " brackets");
    try {
      return Json::parse(text);
    } catch (const Json::exception& error) {
      Fail("", "not valid JSON: " + Abbreviate(DescribeJsonError(error)));
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

  /// "of which the ball joint "hip" has"; empty without ball joints.
  static std::string ListBalls(const RobotModel& model) {
    std::string names;
    for (const Joint& joint : model.joints()) {
      if (joint.type == JointType::kBall) names += (names.empty() ? "" : ", ") + Quote(joint.name);
    }
    return names.empty() ? "" : " (of which each ball joint, " + Abbreviate(names) + ", has";
  }

  /// Quaternions of a floating base and of ball joints may have any length but zero, since they are
  /// normalised.
  void CheckQuaternions(const RobotModel& model, const VectorXd& q) const {
    const auto check = [&](int first, const std::string& owner) {
      if (q.segment<4>(first).norm() > 0.0) return;
      Fail("q[" + std::to_string(first) + ".." + std::to_string(first + 3) + "]",
           "must be a quaternion qw qx qy qz of " + owner + ", got zeros");
    };
    if (model.base().type == BaseType::kFloating) check(3, "the base " + Quote(model.base().link));
    for (int i = 0; i < model.num_joints(); ++i) {
      const Joint& joint = model.joints()[static_cast<size_t>(i)];
      if (joint.type == JointType::kBall) check(model.position_index(i), "joint " + Quote(joint.name));
    }
  }

  /// @param of_balls what is said of ball joints when the size is wrong.
  [[nodiscard]] VectorXd ReadVector(const Json& list, const std::string& key, int size,
                                    const std::string& of_balls = "") const {
    CheckList(list, key, size, "numbers" + of_balls + (of_balls.empty() ? "" : ")"));
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

  [[nodiscard]] LawState ReadLaw(const Json& law, int velocities) const {
    CheckKeys(law, "law.", {"X_d", "X_d_dot", "X_d_ddot", "K_p", "K_v", "f_min", "f_max", "sigma_prime"});
    const auto six = [&](const char* key) -> Vector6d {
      return ReadVector(Get(law, "law.", key), std::string("law.") + key, 6);
    };
    const auto number = [&](const char* key) {
      const Json& value = Get(law, "law.", key);
      if (!value.is_number())
        Fail(std::string("law.") + key, "must be a number, got " + Abbreviate(value.dump()));
      return value.get<double>();
    };
    LawState state{six("X_d"), six("X_d_dot"),  six("X_d_ddot"), six("K_p"),
                   six("K_v"), number("f_min"), number("f_max"), VectorXd::Zero(velocities)};
    if (!(state.f_min >= 0.0)) Fail("law.f_min", "must not be negative, got " + FormatNumber(state.f_min));
    if (!(state.f_max > state.f_min)) {
      Fail("law.f_max",
           "must be above f_min = " + FormatNumber(state.f_min) + ", got " + FormatNumber(state.f_max));
    }
    if (law.contains("sigma_prime"))
      state.sigma_prime = ReadVector(law.at("sigma_prime"), "law.sigma_prime", velocities);
    return state;
  }

  [[nodiscard]] ContactState ReadContacts(const Json& json, const RobotModel& model) const {
    if (!model.object()) Fail("kappa", "the robot of " + model.spec().source + " has no [object] to touch");
    ContactState contacts;
    if (json.contains("kappa") && json.contains("contact_points"))
      Fail("kappa", "give kappa or contact_points, not both");
    const std::string key = json.contains("kappa") ? "kappa" : "contact_points";
    if (key == "contact_points" && !json.contains("object")) Fail(key, "needs object");
    const Json& rows = json.at(key);
    const auto most = model.fingertips().size();
    if (most < kFewestContacts) {
      Fail(key, "the robot of " + model.spec().source + " has " + std::to_string(most) +
                    " fingertips, needed are " + std::to_string(kFewestContacts));
    }
    if (!rows.is_array() || rows.size() < kFewestContacts || rows.size() > most) {
      Fail(key, "must be a list of " + std::to_string(kFewestContacts) + " to " + std::to_string(most) +
                    " lists, one for each contact, got " +
                    Abbreviate(rows.is_array() ? std::to_string(rows.size()) : rows.dump()));
    }
    const auto count = static_cast<Eigen::Index>(rows.size());
    if (key == "kappa") contacts.kappa.resize(count, 5);
    if (key == "contact_points") contacts.points.resize(count, 3);
    for (Eigen::Index i = 0; i < count; ++i) {
      const std::string entry = key + "[" + std::to_string(i) + "]";
      const Json& row = rows[static_cast<size_t>(i)];
      if (key == "kappa") {
        contacts.kappa.row(i) = ReadVector(row, entry, 5);
      } else {
        contacts.points.row(i) = ReadVector(row, entry, 3);
      }
    }
    contacts.fingertips.assign(model.fingertips().begin(), model.fingertips().begin() + count);
    if (json.contains("fingers")) ReadFingers(json.at("fingers"), model, &contacts.fingertips);
    contacts.friction = model.object()->friction;
    if (json.contains("mu")) {
      const Json& mu = json.at("mu");
      if (!mu.is_number() || !(mu.get<double>() > 0.0))
        Fail("mu", "must be a positive number, got " + Abbreviate(mu.dump()));
      contacts.friction = mu.get<double>();
    }
    return contacts;
  }

  void ReadFingers(const Json& names, const RobotModel& model, std::vector<int>* fingertips) const {
    CheckList(names, "fingers", static_cast<int>(fingertips->size()), "names");
    for (size_t i = 0; i < names.size(); ++i) {
      const std::string entry = "fingers[" + std::to_string(i) + "]";
      const auto is_named = [&](int frame) { return names[i] == model.frame(frame).name; };
      const auto found = std::find_if(model.fingertips().begin(), model.fingertips().end(), is_named);
      if (found == model.fingertips().end())
        Fail(entry, "must name a fingertip, got " + Abbreviate(names[i].dump()));
      if (std::find(fingertips->begin(), fingertips->begin() + static_cast<long>(i), *found) !=
          fingertips->begin() + static_cast<long>(i)) {
        Fail(entry, "names a fingertip again, got " + Abbreviate(names[i].dump()));
      }
      (*fingertips)[i] = *found;
    }
  }

  std::string file_;
};

}  // namespace

State ParseState(std::string_view text, const std::string& source, const RobotModel& model) {
  return StateReader(source).Read(text, model);
}

State ReadState(const std::string& file, const RobotModel& model) {
  return ParseState(ReadBytes(file), file, model);
}

}  // namespace dexcheck
