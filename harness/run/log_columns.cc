#include "harness/run/log_columns.h"

#include <algorithm>

#include "harness/engine/engine.h"

namespace dexcheck {
namespace {

std::string Join(const std::vector<std::string>& units) {
  if (units.empty()) return "1";
  if (std::all_of(units.begin(), units.end(),
                  [&](const std::string& unit) { return unit == units.front(); })) {
    return units.front();
  }
  std::string text;
  for (const std::string& unit : units) text += (text.empty() ? "" : ", ") + unit;
  return text;
}

/// Columns of one kind of joint, each with the ending of its name and its unit.
struct Part {
  const char* ending;
  const char* unit;
};

LogColumns List(const mjModel& model, const std::vector<Part>& free, const std::vector<Part>& ball,
                const Part& hinge, const Part& slide) {
  LogColumns columns;
  std::vector<std::string> units;
  for (int joint = 0; joint < model.njnt; ++joint) {
    const int type = model.jnt_type[joint];
    const std::vector<Part> parts = type == mjJNT_FREE    ? free
                                    : type == mjJNT_BALL  ? ball
                                    : type == mjJNT_HINGE ? std::vector<Part>{hinge}
                                                          : std::vector<Part>{slide};
    for (const Part& part : parts) {
      columns.names.push_back(NameOf(model, mjOBJ_JOINT, joint) + part.ending);
      units.emplace_back(part.unit);
    }
  }
  columns.units = Join(units);
  return columns;
}

}  // namespace

LogColumns ListPositionColumns(const mjModel& model) {
  const std::vector<Part> turn = {{".qw", "1"}, {".qx", "1"}, {".qy", "1"}, {".qz", "1"}};
  std::vector<Part> free = {{".x", "m"}, {".y", "m"}, {".z", "m"}};
  free.insert(free.end(), turn.begin(), turn.end());
  return List(model, free, turn, {"", "rad"}, {"", "m"});
}

LogColumns ListVelocityColumns(const mjModel& model) {
  const std::vector<Part> turn = {{".w_x", "rad/s"}, {".w_y", "rad/s"}, {".w_z", "rad/s"}};
  std::vector<Part> free = {{".v_x", "m/s"}, {".v_y", "m/s"}, {".v_z", "m/s"}};
  free.insert(free.end(), turn.begin(), turn.end());
  return List(model, free, turn, {"", "rad/s"}, {"", "m/s"});
}

std::string ListJointUnits(const RobotModel& model, const std::vector<std::string>& base, const char* per) {
  std::vector<std::string> units;
  for (const std::string& unit : base) units.push_back(unit + per);
  for (const Joint& joint : model.joints()) {
    units.push_back((joint.type == JointType::kRevolute ? "rad" : "m") + std::string(per));
  }
  return Join(units);
}

}  // namespace dexcheck
