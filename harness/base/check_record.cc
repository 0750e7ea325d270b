#include "harness/base/check_record.h"

#include <nlohmann/json.hpp>

namespace dexcheck {
namespace {

std::string DescribeVelocity(int coordinate, const RobotModel& model, int base_velocities) {
  if (coordinate >= base_velocities) return model.dof_name(coordinate - base_velocities);
  static constexpr const char* kUnreduced[] = {"x_dot", "y_dot", "phi_dot"};
  static constexpr const char* kTwist[] = {"v_c", "w_c"};
  static constexpr const char* kWheelRates[] = {"thetadot_r", "thetadot_l"};
  static constexpr const char* kFloating[] = {"v_x", "v_y", "v_z", "w_x", "w_y", "w_z"};
  if (base_velocities == 6) return kFloating[coordinate];
  if (base_velocities == 3) return kUnreduced[coordinate];
  return model.base().velocity == DriveVelocity::kTwist ? kTwist[coordinate] : kWheelRates[coordinate];
}

}  // namespace

const char* NameOf(CheckCategory kind) {
  static constexpr const char* kNames[] = {"model", "inverse_dynamics", "forward_dynamics", "assumption",
                                           "law"};
  return kNames[static_cast<size_t>(kind)];
}

std::string Describe(const Location& where, const RobotModel& model, int base_velocities) {
  switch (where.kind) {
    case Location::Kind::kJoint: {
      const Joint& joint = model.joint(where.first);
      return "joint " + joint.name + " on link " + model.link_name(joint.parent);
    }
    case Location::Kind::kLink:
      return "link " + model.link_name(where.first);
    case Location::Kind::kFrame: {
      const Frame& frame = model.frame(where.first);
      return "frame " + frame.name + " on link " + model.link_name(frame.link);
    }
    case Location::Kind::kVelocity:
      return DescribeVelocity(where.first, model, base_velocities);
    case Location::Kind::kVelocityPair:
      return "(" + DescribeVelocity(where.first, model, base_velocities) + ", " +
             DescribeVelocity(where.second, model, base_velocities) + ")";
    case Location::Kind::kWheel:
      return "joint " + (where.first == 0 ? model.base().wheel_joint_right : model.base().wheel_joint_left);
    case Location::Kind::kObject:
      return "object " + (model.object() ? model.object()->name : std::string());
    case Location::Kind::kWhole:
      return "robot";
  }
  return "robot";
}

const char* TitleOf(CheckCategory category) {
  static constexpr const char* kTitles[] = {"Model", "Inverse dynamics", "Forward dynamics", "Assumptions",
                                            "Law"};
  return kTitles[static_cast<size_t>(category)];
}

double CalcFraction(double value, double bound) {
  if (bound > 0.0) return value / bound;
  return value > 0.0 ? std::numeric_limits<double>::infinity() : 0.0;
}

nlohmann::ordered_json ToJson(const CheckRecord& record, bool timed) {
  nlohmann::ordered_json json = {{"kind", NameOf(record.kind)}, {"max", record.worst}};
  if (timed) json["rms"] = record.rms();
  json["bound"] = record.bound;
  json["unit"] = record.unit;
  if (timed) json["at_time_s"] = record.at;
  json["pass"] = !record.failed;
  if (timed && record.failed) json["failed_at_s"] = record.failed_at;
  if (!record.part.empty()) json["where"] = record.part;
  if (!record.description.empty()) json["description"] = record.description;
  return json;
}

CheckRecord ReadCheck(const std::string& name, const nlohmann::json& json) {
  const auto number = [&](const char* key) {
    const auto value = json.find(key);
    if (value == json.end()) return 0.0;
    return value->is_number() ? value->get<double>() : std::numeric_limits<double>::infinity();
  };
  CheckRecord record;
  record.name = name;
  record.kind = CheckCategory::kAssumption;
  for (const CheckCategory kind : kCheckCategories) {
    if (json.at("kind").get<std::string>() == NameOf(kind)) record.kind = kind;
  }
  record.unit = json.value("unit", "1");
  record.description = json.value("description", "");
  record.bound = number("bound");
  record.worst = number("max");
  record.at = number("at_time_s");
  record.failed = !json.at("pass").get<bool>();
  record.failed_at = number("failed_at_s");
  record.part = json.value("where", "");
  record.count = json.contains("at_time_s") ? 1 : 0;
  return record;
}

void CategoryStatus::Add(const std::string& name, double value, double its_bound, bool fails) {
  if (!is_asked() || CalcFraction(value, its_bound) > fraction()) {
    check = name;
    worst = value;
    bound = its_bound;
  }
  ++checks;
  failed += fails ? 1 : 0;
}

}  // namespace dexcheck
