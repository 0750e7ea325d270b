#include "harness/descriptions/body_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/descriptions/alike_names.h"

namespace dexcheck {
namespace {

enum Column { kLink, kMass, kComX, kIxx = kComX + 3, kColumnCount = kIxx + 6 };
enum class Kind { kNone, kMass, kLength, kInertia };

struct ColumnInfo {
  const char* name;
  const char* other;  ///< Also called so.
  Kind kind;
};
constexpr std::array<ColumnInfo, kColumnCount> kColumns = {{{"link", "name", Kind::kNone},
                                                            {"mass", "m", Kind::kMass},
                                                            {"comx", "x", Kind::kLength},
                                                            {"comy", "y", Kind::kLength},
                                                            {"comz", "z", Kind::kLength},
                                                            {"ixx", "lxx", Kind::kInertia},
                                                            {"iyy", "lyy", Kind::kInertia},
                                                            {"izz", "lzz", Kind::kInertia},
                                                            {"ixy", "lxy", Kind::kInertia},
                                                            {"ixz", "lxz", Kind::kInertia},
                                                            {"iyz", "lyz", Kind::kInertia}}};

struct Unit {
  const char* name;
  double size;
};
constexpr Unit kMassUnits[] = {{"kg", 1.0}, {"g", 1e-3}, {"lb", 0.45359237}, {"t", 1e3}};
constexpr Unit kLengthUnits[] = {{"m", 1.0}, {"mm", 1e-3}, {"cm", 1e-2}, {"in", 0.0254}};

constexpr std::string_view kBlanks = " \t\r\"";

std::vector<std::string> SplitCells(const std::string& line) {
  const char separator = line.find(';') != std::string::npos ? ';' : ',';
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, separator);) cells.emplace_back(Trim(cell, kBlanks));
  return cells;
}

template <size_t count>
std::optional<double> FindUnit(const Unit (&units)[count], const std::string& name) {
  for (const Unit& unit : units) {
    if (name == unit.name) return unit.size;
  }
  return std::nullopt;
}

/// "g", "mm", "kg*m^2", "g mm2": its size in SI.
std::optional<double> ReadUnit(Kind kind, const std::string& text) {
  if (kind == Kind::kMass) return FindUnit(kMassUnits, text);
  if (kind == Kind::kLength) return FindUnit(kLengthUnits, text);
  const size_t gap = text.find_first_of("* ");
  if (gap == std::string::npos || !text.ends_with('2')) return std::nullopt;
  std::string length = text.substr(gap + 1, text.size() - gap - 2);
  if (length.ends_with('^')) length.pop_back();
  const std::optional<double> mass = FindUnit(kMassUnits, text.substr(0, gap));
  const std::optional<double> arm = FindUnit(kLengthUnits, length);
  return mass && arm ? std::optional(*mass * *arm * *arm) : std::nullopt;
}

class BodyTableReader {
 public:
  explicit BodyTableReader(std::string source) : source_(std::move(source)) { index_.fill(-1); }

  std::vector<TabledBody> Read(const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      ++line_;
      line = std::string(Trim(line, kBlanks));
      if (line.empty()) continue;
      if (line.starts_with('#')) {
        ReadRemark(line);
      } else if (index_[kLink] < 0) {
        ReadHeader(SplitCells(line));
      } else {
        ReadRow(SplitCells(line));
      }
    }
    if (bodies_.empty()) Fail("must have a header and a row for each link");
    return std::move(bodies_);
  }

 private:
  [[noreturn]] void Fail(const std::string& problem) const {
    throw InputError(source_ + ":" + std::to_string(line_) + ": " + problem);
  }

  void ReadRemark(const std::string& line) {
    const size_t colon = line.find(':');
    if (SimplifyName(line.substr(0, colon)) != "inertia") return;
    const std::string_view about =
        colon == std::string::npos ? "" : Trim(std::string_view(line).substr(colon + 1), kBlanks);
    if (about != "origin" && about != "com") Fail("inertia: must be origin or com, got " + Quote(about));
    about_origin_ = about == "origin";
  }

  void ReadHeader(const std::vector<std::string>& cells) {
    std::array<double, 4> units = {1.0, 1.0, 1.0, 1.0};  // by kind
    for (size_t i = 0; i < cells.size(); ++i) {
      const size_t open = cells[i].find_first_of("[(");
      const std::string name = SimplifyName(cells[i].substr(0, open));
      const auto* const column = std::ranges::find_if(
          kColumns, [&](const ColumnInfo& info) { return name == info.name || name == info.other; });
      if (column == kColumns.end()) continue;  // a column of no interest
      const auto k = static_cast<size_t>(column - kColumns.begin());
      double& unit = units[static_cast<size_t>(column->kind)];
      if (open != std::string::npos && column->kind != Kind::kNone) {
        const std::string text = cells[i].substr(open + 1, cells[i].find_first_of("])") - open - 1);
        const std::optional<double> size = ReadUnit(column->kind, text);
        if (!size) Fail(std::string(column->name) + ": has no known unit: " + Quote(text));
        unit = *size;
      }
      index_[k] = static_cast<int>(i);
      units_[k] = unit;
    }
    for (size_t k = 0; k < kColumns.size(); ++k) {
      if (index_[k] < 0) Fail(std::string("header: lacks column ") + kColumns[k].name);
    }
  }

  void ReadRow(const std::vector<std::string>& cells) {
    const auto cell = [&](size_t column) {
      const auto i = static_cast<size_t>(index_[column]);
      if (i >= cells.size()) Fail(std::string("lacks ") + kColumns[column].name);
      return cells[i];
    };
    const auto number = [&](size_t column) {
      const std::optional<double> value = ParseNumber<double>(cell(column));
      if (!value || !std::isfinite(*value))
        Fail(std::string(kColumns[column].name) + ": must be a number, got " + Quote(cell(column)));
      return units_[column] * *value;
    };
    TabledBody& row = bodies_.emplace_back();
    row.link = cell(kLink);
    row.line = line_;
    row.body.mass = number(kMass);
    if (row.body.mass < 0.0) Fail("mass: must not be negative");
    row.body.com << number(kComX), number(kComX + 1), number(kComX + 2);
    Vector6d n;
    for (size_t k = 0; k < 6; ++k) n[static_cast<Eigen::Index>(k)] = number(kIxx + k);
    row.body.inertia = ToTensor(n);
    if (about_origin_) row.body.inertia -= CalcPointInertia(row.body.mass, row.body.com);
  }

  std::string source_;
  int line_ = 0;
  bool about_origin_ = false;
  std::array<int, kColumnCount> index_{};     // of the cell, by column
  std::array<double, kColumnCount> units_{};  // in SI
  std::vector<TabledBody> bodies_;
};

}  // namespace

std::vector<TabledBody> ReadBodyTable(const std::string& text, const std::string& source) {
  return BodyTableReader(source).Read(text);
}

RobotDescription PlaceBodies(const std::vector<TabledBody>& bodies, const std::string& source,
                             const RobotDescription& other) {
  RobotDescription robot = other;
  robot.spec.source = source;
  robot.format = RobotFormat::kBodies;
  std::vector<std::string> strange, links;
  for (const TabledBody& row : bodies) {
    const auto part = std::ranges::find(robot.parts, row.link, &DescribedPart::name);
    if (part == robot.parts.end()) {
      links.clear();
      for (const DescribedPart& one : robot.parts) links.push_back(one.name);
      strange.push_back(row.link + SuggestNearest(row.link, links));
      continue;
    }
    part->body = row.body;
    part->states_inertial = true;
    part->line = row.line;
    part->X_LC = Pose::Identity();
  }
  const std::string list = JoinNames(strange);
  if (strange.size() == bodies.size())
    throw InputError(source + ": has no link of " + other.spec.source + ": " + list);
  FuseParts(&robot);
  robot.notes = {source + " has masses, centres of mass and inertias alone; all else is that of " +
                 other.spec.source};
  if (!strange.empty()) robot.notes.push_back("links only in " + source + ": " + list);
  return robot;
}

}  // namespace dexcheck
