#include "harness/descriptions/program_layout.h"

#include <algorithm>
#include <initializer_list>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"
#include "controller/common/text.h"
#include "harness/base/bounded_json.h"

namespace dexcheck {
namespace {

using Json = nlohmann::json;
using Position = BaseConvention::Position;

[[noreturn]] void Fail(const std::string& source, const std::string& key, const std::string& problem) {
  throw InputError(source + ": " + key + ": " + problem);
}

/// A key of `base`, and its words by the choices of a convention; the first is the default.
struct BaseKey {
  const char* name;
  std::vector<std::string> words;
};
const BaseKey kBaseKeys[] = {{"position", {"xyz_wxyz", "xyz_xyzw", "wxyz_xyz"}},
                             {"velocity", {"linear_angular", "angular_linear"}},
                             {"linear_axes", {"world", "base"}},
                             {"angular_axes", {"base", "world"}}};

BaseConvention ReadConvention(const Json& table, const std::string& source) {
  if (!table.is_object()) Fail(source, "base", "must be an object, got " + Abbreviate(table.dump()));
  size_t choices[std::size(kBaseKeys)] = {};
  for (const auto& item : table.items()) {
    const int key = IndexOf(kBaseKeys, std::string_view(item.key()), &BaseKey::name);
    if (key < 0)
      Fail(source, "base." + Abbreviate(item.key()),
           "unknown key, known here are position, velocity, linear_axes, angular_axes");
    const std::vector<std::string>& words = kBaseKeys[key].words;
    const auto word =
        std::ranges::find_if(words, [&](const std::string& one) { return item.value() == one; });
    if (word == words.end()) {
      std::string list;
      for (const std::string& one : words) list += (list.empty() ? "" : ", ") + Quote(one);
      Fail(source, "base." + item.key(),
           "must be one of " + list + ", got " + Abbreviate(item.value().dump()));
    }
    choices[key] = static_cast<size_t>(word - words.begin());
  }
  return {static_cast<Position>(choices[0]), choices[1] == 1, choices[2] == 1, choices[3] == 1};
}

/// Reads a number, a list of n numbers, or a list of n such lists.
void ReadNumbers(const Json& json, int dimensions, size_t n, const std::string& key,
                 const std::string& source, std::vector<double>* numbers) {
  if (dimensions == 0) {
    if (!json.is_number()) Fail(source, key, "must be a number, got " + Abbreviate(json.dump()));
    return numbers->push_back(json.get<double>());
  }
  if (!json.is_array() || json.size() != n)
    Fail(source, key,
         "must be a list of " + std::to_string(n) + (dimensions == 2 ? " rows" : " numbers") + ", got " +
             (json.is_array() ? std::to_string(json.size()) : Abbreviate(json.dump())));
  for (size_t i = 0; i < n; ++i)
    ReadNumbers(json[i], dimensions - 1, n, key + "[" + std::to_string(i) + "]", source, numbers);
}

}  // namespace

ProgramLayout::ProgramLayout(const RobotDescription& robot)
    : base_(robot.spec.base.type == BaseType::kFloating ? 6 : 0), base_positions_(base_ > 0 ? 7 : 0) {
  if (base_ == 0 && robot.spec.base.type != BaseType::kFixed) {
    throw InputError(robot.spec.source + ": base: must be fixed or floating to be compared with a program");
  }
  const RobotModel model(robot.spec);
  for (int i = 0; i < model.num_joints(); ++i) {
    const Joint& joint = model.joint(i);
    robot_joints_.push_back({joint.name, model.position_index(i), CountPositions(joint.type), model.dof(i),
                             CountVelocities(joint.type), joint.coupling.has_value()});
  }
  SetJoints(ListIndices(robot_joints_.size()));
}

void ProgramLayout::SetJoints(std::vector<int> joints) {
  joints_ = std::move(joints);
  velocities_.clear();
  num_positions_ = base_positions_;
  for (const int index : joints_) {
    const NamedJoint& joint = robot_joints_[static_cast<size_t>(index)];
    num_positions_ += joint.num_positions;
    for (int k = 0; k < joint.num_velocities; ++k) velocities_.push_back(joint.velocity + k);
  }
  places_ = ListIndices(velocities_.size());
  std::ranges::sort(places_, [this](int a, int b) {
    return velocities_[static_cast<size_t>(a)] < velocities_[static_cast<size_t>(b)];
  });
}

ProgramLayout::ProgramLayout(const RobotDescription& robot, const Json& json, const std::string& source)
    : ProgramLayout(robot) {
  if (json.contains("base")) {
    if (base_ == 0) Fail(source, "base", "must not be given, the base is fixed");
    convention_ = ReadConvention(json.at("base"), source);
  }
  if (!json.contains("joints")) return;
  const Json& list = json.at("joints");
  if (!list.is_array()) Fail(source, "joints", "must be a list of names, got " + Abbreviate(list.dump()));
  std::vector<std::string> names;
  for (const NamedJoint& joint : robot_joints_) names.push_back(joint.name);
  std::vector<int> joints;
  for (size_t i = 0; i < list.size(); ++i) {
    const std::string key = "joints[" + std::to_string(i) + "]";
    if (!list[i].is_string()) Fail(source, key, "must be a name, got " + Abbreviate(list[i].dump()));
    const std::string name = list[i].get<std::string>();
    const int found = IndexOf(names, name);
    if (found < 0) {
      Fail(source, key,
           "must be a joint of " + robot.spec.source + SuggestInBrackets(name, names) + ", got " +
               Quote(name));
    }
    if (Contains(joints, found)) Fail(source, key, "must be named once, got " + Quote(name) + " again");
    joints.push_back(found);
  }
  SetJoints(std::move(joints));
  std::vector<std::string> missing, followers;
  for (size_t joint = 0; joint < names.size(); ++joint) {
    if (robot_joints_[joint].follows) followers.push_back(names[joint]);
    if (!Contains(joints_, static_cast<int>(joint))) missing.push_back(names[joint]);
  }
  is_reduced_ = !missing.empty();
  if (is_reduced_ && missing != followers)
    Fail(source, "joints", "must be all joints, or all that follow no other; missing: " + JoinNames(missing));
}

nlohmann::ordered_json ProgramLayout::ToJson() const {
  nlohmann::ordered_json json;
  json["joints"] = nlohmann::ordered_json::array();
  for (const int joint : joints_) json["joints"].push_back(robot_joints_[static_cast<size_t>(joint)].name);
  // Only where a number of entries does not follow from the number of names.
  const auto is_ball = [this](int joint) {
    return robot_joints_[static_cast<size_t>(joint)].num_positions > 1;
  };
  if (std::ranges::any_of(joints_, is_ball)) {
    json["balls"] = nlohmann::ordered_json::array();
    for (const int joint : joints_) {
      if (is_ball(joint)) json["balls"].push_back(robot_joints_[static_cast<size_t>(joint)].name);
    }
  }
  if (base_ == 0) return json;
  const size_t choices[] = {static_cast<size_t>(convention_.position), convention_.angular_first ? 1U : 0U,
                            convention_.linear_in_base ? 1U : 0U, convention_.angular_in_world ? 1U : 0U};
  for (size_t k = 0; k < std::size(kBaseKeys); ++k)
    json["base"][kBaseKeys[k].name] = kBaseKeys[k].words[choices[k]];
  return json;
}

VectorXd ProgramLayout::WritePositions(const VectorXd& q) const {
  VectorXd written(num_positions());
  if (base_ > 0) written.head<7>() = BaseConversion(convention_).ConvertPositions(q).head<7>();
  Eigen::Index at = base_positions_;
  for (const int index : joints_) {
    const NamedJoint& joint = robot_joints_[static_cast<size_t>(index)];
    written.segment(at, joint.num_positions) = q.segment(joint.position, joint.num_positions);
    at += joint.num_positions;
  }
  return written;
}

VectorXd ProgramLayout::WriteVelocities(const VectorXd& q, const VectorXd& xi) const {
  VectorXd written(size());
  if (base_ > 0) written.head<6>() = BaseConversion(convention_).ConvertVelocities(q, xi).head<6>();
  for (size_t i = 0; i < velocities_.size(); ++i)
    written[base_ + static_cast<int>(i)] = xi[base_ + velocities_[i]];
  return written;
}

void ProgramLayout::ReadTerms(const VectorXd& q, const VectorXd& xi, TermResults* terms) const {
  std::vector<Eigen::Index> from;
  for (int i = 0; i < base_; ++i) from.push_back(i);
  for (const int place : places_) from.push_back(base_ + place);
  for (VectorXd* const force : terms->forces()) {
    if (force->size() > 0) *force = VectorXd((*force)(from));
  }
  if (terms->M.size() > 0) terms->M = MatrixXd(terms->M(from, from));
  if (base_ == 0) return;
  // The rate of the conversion lies in the base's entries alone.
  VectorXd own = VectorXd::Zero(static_cast<Eigen::Index>(from.size()));
  own.head<6>() = xi.head<6>();
  BaseConversion(convention_).Restore(q, own, terms);
}

std::optional<Json> ParseResult(std::string_view text) {
  Json result = ParseJson<Json>(text);
  return result.is_object() ? std::optional(std::move(result)) : std::nullopt;
}

TermResults ReadResult(const Json& json, const ProgramLayout& layout, const VectorXd& v,
                       const std::string& source) {
  if (std::ranges::none_of(kResultKeys, [&](const ResultKey& key) { return json.contains(key.name); })) {
    throw InputError(source +
                     ": must have M, C, c, g, h, friction, kinetic_energy or potential_energy, got " +
                     Abbreviate(json.dump()));
  }
  return CollectTerms(v, [&](const ResultKey& key) {
    std::vector<double> numbers;
    if (json.contains(key.name))
      ReadNumbers(json.at(key.name), key.dimensions, static_cast<size_t>(layout.size()), key.name, source,
                  &numbers);
    return numbers;
  });
}

}  // namespace dexcheck
