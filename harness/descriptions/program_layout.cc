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

constexpr std::pair<const char*, Position> kPositions[] = {
    {"xyz_wxyz", Position::kXyzWxyz}, {"xyz_xyzw", Position::kXyzXyzw}, {"wxyz_xyz", Position::kWxyzXyz}};

/// Index of a key's word among those that it may have; 0 when the key is missing.
size_t ReadChoice(const Json& table, const char* key, std::initializer_list<const char*> words,
                  const std::string& source) {
  if (!table.contains(key)) return 0;
  size_t index = 0;
  std::string list;
  for (const char* word : words) {
    if (table.at(key) == word) return index;
    list += (index++ == 0 ? "" : ", ") + Quote(word);
  }
  Fail(source, std::string("base.") + key,
       "must be one of " + list + ", got " + Abbreviate(table.at(key).dump()));
}

BaseConvention ReadConvention(const Json& table, const std::string& source) {
  if (!table.is_object()) Fail(source, "base", "must be an object, got " + Abbreviate(table.dump()));
  for (const auto& item : table.items()) {
    const std::string& key = item.key();
    if (key == "position" || key == "velocity" || key == "linear_axes" || key == "angular_axes") continue;
    Fail(source, "base." + Abbreviate(key),
         "unknown key, known here are position, velocity, linear_axes, angular_axes");
  }
  BaseConvention convention;
  convention.position =
      kPositions[ReadChoice(table, "position", {"xyz_wxyz", "xyz_xyzw", "wxyz_xyz"}, source)].second;
  convention.angular_first = ReadChoice(table, "velocity", {"linear_angular", "angular_linear"}, source) == 1;
  convention.linear_in_base = ReadChoice(table, "linear_axes", {"world", "base"}, source) == 1;
  convention.angular_in_world = ReadChoice(table, "angular_axes", {"base", "world"}, source) == 1;
  return convention;
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
  std::vector<bool> is_named(names.size(), false);
  for (size_t i = 0; i < list.size(); ++i) {
    const std::string key = "joints[" + std::to_string(i) + "]";
    if (!list[i].is_string()) Fail(source, key, "must be a name, got " + Abbreviate(list[i].dump()));
    const std::string name = list[i].get<std::string>();
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) {
      const std::string nearest = FindNearest(name, names);
      Fail(source, key,
           "must be a joint of " + robot.spec.source +
               (nearest.empty() ? "" : " (did you mean " + Quote(nearest) + "?)") + ", got " + Quote(name));
    }
    const auto joint = static_cast<size_t>(found - names.begin());
    if (is_named[joint]) Fail(source, key, "must be named once, got " + Quote(name) + " again");
    is_named[joint] = true;
    joints.push_back(static_cast<int>(joint));
  }
  SetJoints(std::move(joints));
  std::vector<std::string> missing;
  size_t followers = 0;
  bool only_followers = true;
  for (size_t joint = 0; joint < names.size(); ++joint) {
    followers += robot_joints_[joint].follows ? 1 : 0;
    if (is_named[joint]) continue;
    missing.push_back(names[joint]);
    only_followers = only_followers && robot_joints_[joint].follows;
  }
  is_reduced_ = !missing.empty();
  if (!is_reduced_) return;
  if (!only_followers || missing.size() != followers) {
    Fail(source, "joints", "must be all joints, or all that follow no other; missing: " + JoinNames(missing));
  }
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
  const auto position =
      std::ranges::find_if(kPositions, [&](const auto& one) { return one.second == convention_.position; });
  json["base"] = {{"position", position->first},
                  {"velocity", convention_.angular_first ? "angular_linear" : "linear_angular"},
                  {"linear_axes", convention_.linear_in_base ? "base" : "world"},
                  {"angular_axes", convention_.angular_in_world ? "world" : "base"}};
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
