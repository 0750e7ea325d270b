#include "harness/descriptions/read_description.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/parameter_reader.h"
#include "controller/model/rigid_body.h"
#include "harness/base/files.h"
#include "harness/descriptions/alike_names.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/engine/mjcf_passes.h"

namespace dexcheck {

namespace {

/// The name of the first element; empty when the text does not begin as XML does.
std::string_view FindRootElement(std::string_view text) {
  const auto skip_to = [&](std::string_view end) {
    const size_t at = text.find(end);
    text.remove_prefix(at == std::string_view::npos ? text.size() : at + end.size());
  };
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // byte order mark
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    if (text.starts_with("<?")) {
      skip_to("?>");
    } else if (text.starts_with("<!--")) {
      skip_to("-->");
    } else if (text.starts_with("<!")) {
      skip_to(">");
    } else {
      break;
    }
  }
  if (!text.starts_with("<")) return {};
  text.remove_prefix(1);
  return text.substr(0, text.find_first_of(" \t\r\n/>"));
}

/// @param X_iL the link's own frame, in which its file gives the body.
void AddPart(const std::string& name, const MassProperties& body, int joint, const Pose& X_iL,
             RobotDescription* robot) {
  DescribedPart& part = robot->parts.emplace_back();
  part.name = name;
  part.body = X_iL.isApprox(Pose::Identity(), 0.0) ? body : ExpressIn(body, X_iL.inverse());
  part.joint = joint;
  part.X_iL = X_iL;
}

RobotDescription ReadTable(const std::string& text, const std::string& source) {
  RobotDescription robot;
  robot.is_imported = text.find(kImportMark) != std::string::npos;
  std::vector<WrittenRow> rows;
  robot.spec = ParseRobotModel(text, source, {}, &rows).spec();
  robot.joints.resize(robot.spec.joints.size());
  if (robot.spec.base.type != BaseType::kFixed)
    AddPart(robot.spec.base.link, robot.spec.base.body, -1, Pose::Identity(), &robot);
  for (size_t i = 0; i < robot.spec.joints.size(); ++i) {
    const Joint& joint = robot.spec.joints[i];
    static_cast<WrittenRow&>(robot.joints[i]) = rows[i];
    robot.joints[i].largest_angle = rows[i].rpy.cwiseAbs().maxCoeff();
    AddPart(joint.link, joint.body, static_cast<int>(i), rows[i].X_iL, &robot);
  }
  NoteImpossibleBodies(&robot);
  return robot;
}

}  // namespace

RobotFormat FindFormat(std::string_view text, const std::filesystem::path& path) {
  const std::string_view root = FindRootElement(text);
  if (root == "robot" || (root.empty() && path.extension() == ".urdf")) return RobotFormat::kUrdf;
  if (root == "mujoco" || (root.empty() && path.extension() == ".xml")) return RobotFormat::kMjcf;
  if (root.empty() && path.extension() == ".csv") return RobotFormat::kBodies;
  if (root.empty()) return RobotFormat::kToml;
  if (root == "mujocoinclude") {
    throw InputError(path.string() +
                     ": is a part for <include> (<mujocoinclude>); give the file that includes it");
  }
  throw InputError(path.string() +
                   ": must be a parameter file (TOML), a URDF (<robot>) or an MJCF (<mujoco>), got " +
                   Quote("<" + std::string(root) + ">"));
}

namespace {

enum Column { kLink, kMass, kComX, kIxx = kComX + 3, kColumnCount = kIxx + 6 };
enum class Kind { kNone, kMass, kLength, kInertia };

struct ColumnInfo {
  const char* name;
  const char* other;  ///< Also called so.
  Kind kind;
};
constexpr ColumnInfo kColumns[kColumnCount] = {
    {"link", "name", Kind::kNone},  {"mass", "m", Kind::kMass},     {"comx", "x", Kind::kLength},
    {"comy", "y", Kind::kLength},   {"comz", "z", Kind::kLength},   {"ixx", "lxx", Kind::kInertia},
    {"iyy", "lyy", Kind::kInertia}, {"izz", "lzz", Kind::kInertia}, {"ixy", "lxy", Kind::kInertia},
    {"ixz", "lxz", Kind::kInertia}, {"iyz", "lyz", Kind::kInertia}};

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
      if (column == std::end(kColumns)) continue;  // a column of no interest
      const auto k = static_cast<size_t>(column - kColumns);
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
    for (size_t k = 0; k < kColumnCount; ++k) {
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

namespace {

/// The other description's robot with these bodies in the place of its links' own.
RobotDescription PlaceBodies(const std::vector<TabledBody>& bodies, const std::string& source,
                             const RobotDescription& other) {
  RobotDescription robot = other;
  robot.spec.source = source;
  robot.format = RobotFormat::kBodies;
  std::vector<std::string> strange, links;
  for (const TabledBody& row : bodies) {
    DescribedPart* const part = FindIn(robot.parts, row.link, &DescribedPart::name);
    if (part == nullptr) {
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

}  // namespace

DescriptionFile::DescriptionFile(const std::filesystem::path& path, const UrdfOptions& options)
    : DescriptionFile(path, ReadBytes(path), options) {}

DescriptionFile::DescriptionFile(std::filesystem::path path, std::string text, const UrdfOptions& options)
    : path_(std::move(path)), text_(std::move(text)), format_(FindFormat(text_, path_)) {
  switch (format_) {
    case RobotFormat::kUrdf:
      description_ = ParseUrdf(text_, path_.string(), options);
      break;
    case RobotFormat::kMjcf:
      document_ = std::make_unique<MjcfFile>(path_, &text_);
      force_ranges_ = FindForceRanges(*document_);
      newer_forces_ = ListNewerForces(*document_);
      engine_ = LoadMjcf(document_.get());
      break;
    case RobotFormat::kToml:
      description_ = ReadTable(text_, path_.string());
      break;
    case RobotFormat::kBodies:
      bodies_ = ReadBodyTable(text_, path_.string());
  }
}

void DescriptionFile::PlaceOn(const RobotDescription& other) {
  carrier_ = other;
  description_ = PlaceBodies(bodies_, path_.string(), other);
}

RobotDescription DescriptionFile::Describe() const {
  if (format_ == RobotFormat::kBodies && !description_)
    throw InputError(path_.string() + ": is a table of bodies, which has no joints; dexcheck consistency " +
                     "compares it with a URDF, an MJCF or a parameter file");
  if (description_) return *description_;
  return ReadMjcfDescription(*engine_, path_.string());
}

std::optional<RobotDescription> DescriptionFile::TryToDescribe() const {
  try {
    return Describe();
  } catch (const InputError&) {
    return std::nullopt;
  }
}

MjModelPtr DescriptionFile::CopyEngine() const { return MjModelPtr(mj_copyModel(nullptr, engine_.get())); }

RobotDescription ReadDescription(const std::filesystem::path& path, const UrdfOptions& options) {
  return DescriptionFile(path, options).Describe();
}

}  // namespace dexcheck
