#include "harness/recordings/column_names.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <set>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

/// Words that logs use for a quantity.
constexpr std::pair<RecordedQuantity, std::string_view> kWords[] = {
    {RecordedQuantity::kTime, " t time timestamp stamp secs seconds "},
    {RecordedQuantity::kPosition, " q pos position positions angle qpos theta "},
    {RecordedQuantity::kVelocity, " qd dq vel velocity velocities qvel qdot speed xi "},
    {RecordedQuantity::kAcceleration, " qdd ddq acc acceleration qacc qddot "},
    {RecordedQuantity::kTorque, " tau torque torques effort efforts trq force "},
    {RecordedQuantity::kCurrent, " current currents amps i "}};
/// Commanded values are no measurement.
constexpr std::string_view kCommanded =
    " cmd command commanded des desired target setpoint ref reference d error ext ";

bool Has(std::string_view list, const std::string& word) { return list.find(" " + word + " ") != list.npos; }

constexpr Unit kUnits[] = {
    {"s", RecordedQuantity::kTime, 1.0},
    {"ms", RecordedQuantity::kTime, 1e-3},
    {"us", RecordedQuantity::kTime, 1e-6},
    {"ns", RecordedQuantity::kTime, 1e-9},
    {"rad", RecordedQuantity::kPosition, 1.0},
    {"deg", RecordedQuantity::kPosition, kPi / 180.0},
    {"\xc2\xb0", RecordedQuantity::kPosition, kPi / 180.0},  // a degree sign
    {"m", RecordedQuantity::kPosition, 1.0},
    {"mm", RecordedQuantity::kPosition, 1e-3},
    {"turn", RecordedQuantity::kPosition, 2.0 * kPi},
    {"nm", RecordedQuantity::kTorque, 1.0},
    {"n", RecordedQuantity::kTorque, 1.0},
    {"mnm", RecordedQuantity::kTorque, 1e-3},
    {"a", RecordedQuantity::kCurrent, 1.0},
    {"ma", RecordedQuantity::kCurrent, 1e-3},
};

bool IsLetter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
bool IsDigit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

/// Words and numbers of a name.
std::vector<std::string> SplitWords(const std::string& name) {
  std::vector<std::string> words;
  for (size_t i = 0; i < name.size(); ++i) {
    const bool is_letter = IsLetter(name[i]), is_digit = IsDigit(name[i]);
    if (!is_letter && !is_digit) continue;
    const bool goes_on =
        i > 0 && !words.empty() && (is_letter ? IsLetter(name[i - 1]) : IsDigit(name[i - 1]));
    if (goes_on) {
      words.back() += name[i];
    } else {
      words.emplace_back(1, name[i]);
    }
  }
  return words;
}

/// The last place of a joint's name that is no part of a longer word or number; npos for none.
size_t FindName(const std::string& name, const std::string& own) {
  for (size_t at = name.rfind(own); at != std::string::npos && !own.empty(); at = name.rfind(own, at - 1)) {
    const size_t end = at + own.size();
    const bool goes_on =
        end < name.size() &&
        (IsLetter(own.back()) ? IsLetter(name[end]) : IsDigit(own.back()) && IsDigit(name[end]));
    if (!goes_on && (at == 0 || (!IsLetter(name[at - 1]) && !IsDigit(name[at - 1])))) return at;
    if (at == 0) break;
  }
  return std::string::npos;
}

/// The meaning of a column's name.
struct NamedColumn {
  std::optional<RecordedQuantity> quantity;
  int joint = -1;
  int number = -1;  // instead of a joint's name
  double scale = 1.0;
  bool states_unit = false;
  bool is_commanded = false;
};

/// The unit that a header has in brackets behind a name, "tau_1 [N m]", "q1 (deg)", "ratio [1]", which is
/// taken off; a number right behind a word is an index: "q[0]". None where there are no brackets.
std::optional<std::string> TakeUnit(std::string* name) {
  const size_t end = name->find_last_not_of(' ');
  if (end == std::string::npos || ((*name)[end] != ']' && (*name)[end] != ')')) return std::nullopt;
  const size_t begin = name->rfind((*name)[end] == ']' ? '[' : '(', end);
  if (begin == std::string::npos || begin == 0) return std::nullopt;
  std::string unit = name->substr(begin + 1, end - begin - 1);
  const bool is_index = !unit.empty() && std::ranges::all_of(unit, IsDigit) && (*name)[begin - 1] != ' ';
  if (is_index) return std::nullopt;
  name->resize(begin);
  return unit;
}

/// A unit in brackets gives the scale, or says that the column is of another quantity, or of none.
void ApplyUnit(const std::string& written, NamedColumn* column) {
  if (!column->quantity) return;
  const Unit* unit = FindUnit(written, *column->quantity);
  // Currents are often called efforts.
  const bool is_current = unit == nullptr && *column->quantity == RecordedQuantity::kTorque &&
                          FindUnit(written, RecordedQuantity::kCurrent) != nullptr;
  if (is_current) {
    column->quantity = RecordedQuantity::kCurrent;
    unit = FindUnit(written, RecordedQuantity::kCurrent);
  }
  const auto is_unit_of = [&](RecordedQuantity other) { return FindUnit(written, other) != nullptr; };
  if (unit != nullptr) {
    column->scale = unit->scale;
    column->states_unit = true;
  } else if (std::ranges::any_of(kQuantities, is_unit_of) || Has(" 1 - % ", written)) {
    column->quantity.reset();
  }
}

NamedColumn ReadName(const RobotModel& model, const std::string& written) {
  NamedColumn column;
  std::string name = ToLower(written);
  const std::optional<std::string> unit = TakeUnit(&name);
  const bool is_time =
      Has(kWords[0].second, name.substr(0, name.find_last_not_of(' ') + 1));  // whatever joints are called
  size_t longest = 0, at = 0;
  for (int joint = 0; joint < model.num_joints(); ++joint) {
    const std::string own = ToLower(model.joint(joint).name);
    const size_t found = is_time ? std::string::npos : FindName(name, own);
    if (found == std::string::npos || own.size() <= longest) continue;
    longest = own.size();
    at = found;
    column.joint = joint;
  }
  if (column.joint >= 0) name.replace(at, longest, "/");
  const std::vector<std::string> words = SplitWords(name);
  for (const std::string& word : words) {
    const auto* const quantity =
        std::ranges::find_if(kWords, [&](const auto& one) { return Has(one.second, word); });
    const bool is_unit = column.quantity && FindUnit(word, *column.quantity) != nullptr;
    if (Has(kCommanded, word)) {
      column.is_commanded = true;
    } else if (is_unit) {
      column.scale = FindUnit(word, *column.quantity)->scale;
      column.states_unit = true;
    } else if (quantity != std::end(kWords) && !(word == "t" && words.size() > 2)) {
      column.quantity = quantity->first;
    } else if (IsDigit(word[0]) && word.size() < 4) {
      column.number = std::stoi(word);
    }
  }
  if (unit) ApplyUnit(*unit, &column);
  return column;
}

std::string WithoutUnit(std::string name) {
  TakeUnit(&name);
  return name.substr(0, name.find_last_not_of(' ') + 1);
}

/// Returns the number of a base's pose, by the last word and those before it; -1 for none. A run's log calls
/// it "q.qw".
int FindPoseComponent(const std::vector<std::string>& words) {
  constexpr std::string_view kComponents[] = {"x", "y", "z", "qw", "qx", "qy", "qz"};
  const auto has = [&](std::string_view list) {
    return std::ranges::any_of(words, [&](const std::string& word) { return Has(list, word); });
  };
  if (!has(" base root trunk torso pelvis pose ") && !(words.size() == 2 && words[0] == "q")) return -1;
  const bool is_turned = has(" quat quaternion orientation rotation ") && words.back().size() == 1;
  const std::string component = (is_turned ? "q" : "") + words.back();
  const auto* const found = std::ranges::find(kComponents, component);
  return found == std::end(kComponents) ? -1 : static_cast<int>(found - kComponents);
}

}  // namespace

std::span<const Unit> ListUnits() { return kUnits; }

/// The unit of a quantity; positions' units serve their rates, too.
const Unit* FindUnit(std::string name, RecordedQuantity quantity) {
  name = ToLower(std::move(name));
  std::erase_if(name, [](char c) { return c == ' ' || c == '*' || c == '.'; });
  if (const size_t dot = name.find("\xc2\xb7"); dot != std::string::npos) name.erase(dot, 2);
  // "rad/s", "deg/s^2"
  if (const size_t slash = name.find('/'); slash != std::string::npos) name.resize(slash);
  if (quantity == RecordedQuantity::kVelocity || quantity == RecordedQuantity::kAcceleration)
    quantity = RecordedQuantity::kPosition;
  const auto found = std::find_if(std::begin(kUnits), std::end(kUnits), [&](const Unit& unit) {
    return unit.name == name && unit.quantity == quantity;
  });
  return found == std::end(kUnits) ? nullptr : found;
}

std::vector<Channel> GuessChannels(const RobotModel& model, const std::vector<std::string>& names) {
  std::vector<NamedColumn> columns;
  int least = 1;  // numbers count from 0 or from 1
  std::set<RecordedQuantity>
      named;  // where joints have names, a number is no joint's: "qpos.#0.x" of a free one
  for (const std::string& name : names) {
    const NamedColumn& column = columns.emplace_back(ReadName(model, name));
    if (column.quantity && column.number >= 0) least = std::min(least, column.number);
    if (column.quantity && column.joint >= 0) named.insert(*column.quantity);
  }
  std::vector<Channel> channels;
  std::set<std::pair<RecordedQuantity, int>> seen;
  for (size_t i = 0; i < columns.size(); ++i) {
    const NamedColumn& column = columns[i];
    if (!column.quantity || column.is_commanded) continue;
    int joint = -1;
    if (*column.quantity != RecordedQuantity::kTime) {
      joint = column.joint;
      if (joint < 0 && column.number >= 0 && !named.contains(*column.quantity)) joint = column.number - least;
      // A robot of one joint needs no number.
      if (joint < 0 && model.num_joints() == 1) joint = 0;
      if (joint < 0 || joint >= model.num_joints()) continue;
    }
    if (seen.emplace(*column.quantity, joint).second)
      channels.push_back({*column.quantity, joint, i, column.scale, 0.0, column.states_unit});
  }
  // A pose has all of its numbers.
  std::vector<Channel> pose;
  for (size_t i = 0; i < names.size(); ++i) {
    const NamedColumn& column = columns[i];
    const bool is_rate = column.quantity && *column.quantity != RecordedQuantity::kPosition;
    const int component = column.joint >= 0 || column.is_commanded || is_rate
                              ? -1
                              : FindPoseComponent(SplitWords(ToLower(WithoutUnit(names[i]))));
    if (component >= 0 && seen.emplace(RecordedQuantity::kBase, component).second)
      pose.push_back({RecordedQuantity::kBase, component, i});
  }
  if (static_cast<int>(pose.size()) == CountComponents(RecordedQuantity::kBase))
    channels.insert(channels.end(), pose.begin(), pose.end());
  return channels;
}

void GuessFeet(const RobotModel& model, const std::vector<std::string>& names, Recording* recording) {
  for (const Frame& frame : model.frames()) {
    const auto first = std::ranges::find(names, "foot/force." + frame.name + ".x", WithoutUnit);
    if (first == names.end() || frame.link < 0) continue;
    const auto column = static_cast<size_t>(first - names.begin());
    for (int k = 0; k < 3; ++k)
      recording->channels.push_back({RecordedQuantity::kWrench,
                                     6 * static_cast<int>(recording->wrenches.size()) + k,
                                     column + static_cast<size_t>(k)});
    recording->wrenches.push_back(
        {frame.link, frame.X_LF.translation(), /*is_world=*/true, frame.sphere_radius.value_or(0.0)});
  }
}

}  // namespace dexcheck
