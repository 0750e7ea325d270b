#include "harness/base/check_record.h"

#include <nlohmann/json.hpp>

#include "controller/common/text.h"

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

void CheckRecord::Add(double value, double when, double before, double allowed) {
  if (!applies) return;
  const bool is_worst = Note(value, when);
  // Among values that are equal once something is taken off, the one that needed most of its allowance
  // counts.
  const bool needs_more =
      value == worst && CalcFraction(before, bound + allowed) > CalcFraction(residual, bound + allowance);
  if (allowed != 0.0 && (is_worst || needs_more)) {
    residual = before;
    at = when;
  }
  if (is_worst || (allowed != 0.0 && needs_more)) allowance = allowed;
  AddStep(value);
}

double CalcFraction(double value, double bound) {
  if (bound > 0.0) return value / bound;
  return value > 0.0 ? std::numeric_limits<double>::infinity() : 0.0;
}

nlohmann::ordered_json ToJson(const CheckRecord& record, bool timed) {
  nlohmann::ordered_json json = {{"kind", NameOf(record.kind)}};
  const bool is_reached = !timed || IsReached(record);
  if (is_reached) json["max"] = record.worst;
  if (is_reached && record.allowance > 0.0) {
    json["residual"] = record.residual;
    json["allowance"] = record.allowance;
  }
  if (timed && is_reached) json["rms"] = record.rms();
  json["bound"] = record.bound;
  json["unit"] = record.unit;
  if (timed && is_reached) json["at_time_s"] = record.at;
  if (is_reached) {
    json["pass"] = !record.failed;
  } else {
    json["reached"] = false;
  }
  if (record.is_empty) json["empty"] = true;
  if (record.same_source) json["same_source"] = true;
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
  record.allowance = number("allowance");
  record.residual = record.allowance > 0.0 ? number("residual") : record.worst;
  record.at = number("at_time_s");
  record.comparisons = json.value("reached", true) ? 1 : 0;
  record.same_source = json.value("same_source", false);
  record.is_empty = json.value("empty", false);
  record.failed = IsReached(record) && !json.at("pass").get<bool>();
  record.failed_at = number("failed_at_s");
  record.part = json.value("where", "");
  record.count = json.contains("at_time_s") ? 1 : 0;
  return record;
}

const char* DescribeStatus(const CheckRecord& check) {
  if (!IsReached(check)) return "not reached";
  return check.failed ? "FAILS" : check.same_source ? "same source" : "ok";
}

std::string DescribeNumbers(const CheckRecord& check) {
  if (!IsReached(check)) return "not reached";
  const std::string bound = ", bound " + FormatNumber(check.bound, 3);
  if (check.allowance == 0.0) return "worst " + FormatNumber(check.worst, 3) + bound;
  return "residual " + FormatNumber(check.residual, 3) + bound + ", allowance " +
         FormatNumber(check.allowance, 3);
}

std::string CategoryStatus::Describe() const {
  if (failed > 0) return std::to_string(failed) + " of " + std::to_string(checks) + " fail";
  if (!is_asked()) return not_reached > 0 ? "not reached" : "not checked";
  return same_source == checks ? "same source" : "holds";
}

void CategoryStatus::Add(const CheckRecord& check) {
  if (check.is_empty) return;
  if (!IsReached(check)) {
    ++not_reached;
    return;
  }
  if (!is_asked() || CalcFraction(check) > CalcFraction(nearest)) nearest = check;
  ++checks;
  failed += check.failed ? 1 : 0;
  same_source += check.same_source && !check.failed ? 1 : 0;
}

}  // namespace dexcheck
