#include "harness/recordings/write_corrections.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <functional>
#include <map>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/corrections/read_printed.h"
#include "harness/corrections/write_repaired.h"

namespace dexcheck {
namespace {

/// The model's numbers that change.
struct Corrections {
  std::map<int, double> dry, viscous, armature;       // by joint
  std::map<int, TorqueRegressor::BodyVector> bodies;  // by link: what is added
  std::optional<Vector3d> gravity;
};

Corrections Collect(const RobotModel& model, const RecordingJudgement& judgement, CorrectedFile* file) {
  Corrections corrections;
  for (size_t i = 0; i < judgement.found.size(); ++i) {
    const TorqueFault& fault = judgement.found[i].fault;
    const VectorXd& a = judgement.found[i].amplitude;
    const auto add_body = [&] {
      TorqueRegressor::BodyVector& body =
          corrections.bodies.emplace(fault.index, TorqueRegressor::BodyVector::Zero()).first->second;
      for (size_t k = 0; k < fault.sums.size(); ++k)
        for (const ColumnPart& part : fault.sums[k])
          body[part.column.component] += part.factor * a[static_cast<Eigen::Index>(k)];
    };
    const auto add = [&](std::map<int, double>* values, int joint, double before, double change) {
      values->emplace(joint, before).first->second += change;
    };
    if (!judgement.found[i].is_named) {
      file->left.push_back(fault.place + ": " + fault.fault + ", or another cause");
      continue;
    }
    bool is_written = fault.recording < 0;
    switch (fault.kind) {
      case TorqueFault::kDryFriction:
      case TorqueFault::kViscousFriction:
      case TorqueFault::kAllDry:
      case TorqueFault::kAllFriction:
      case TorqueFault::kArmature:
        for (Eigen::Index k = 0; k < (fault.HasVelocity() ? 1 : a.size()); ++k) {
          const TorqueColumn& column = fault.sums[static_cast<size_t>(k)].front().column;
          const Joint& joint = model.joint(column.index);
          const bool is_viscous = column.kind == TorqueColumn::kViscous;
          if (column.kind == TorqueColumn::kAcceleration) {
            add(&corrections.armature, column.index, joint.armature, a[k]);
          } else {
            add(is_viscous ? &corrections.viscous : &corrections.dry, column.index,
                is_viscous ? joint.damping : joint.dry_friction, a[k]);
          }
        }
        break;
      case TorqueFault::kMass:
      case TorqueFault::kCentre:
      case TorqueFault::kInertia:
      case TorqueFault::kPayload:
        if (is_written) add_body();
        break;
      case TorqueFault::kGravity:
        corrections.gravity = model.gravity() + a.head<3>();
        break;
      default:
        is_written = false;
    }
    (is_written ? file->written : file->left).push_back(fault.place + ": " + fault.fault);
  }
  return corrections;
}

std::string Show(double value) { return fmt::format("{:.10g}", value); }

template <typename Vector>
std::string Join(const Vector& values, const char* separator) {
  std::string text;
  for (Eigen::Index i = 0; i < values.size(); ++i) text += (i == 0 ? "" : separator) + Show(values[i]);
  return text;
}

/// A link's body with what is added to it, in the frame of its file.
class CorrectedBody {
 public:
  CorrectedBody(const RobotDescription& robot, int link)
      : name_(robot.spec.joints[static_cast<size_t>(link)].link),
        before_(robot.spec.joints[static_cast<size_t>(link)].body) {
    const auto part = std::ranges::find_if(
        robot.parts, [&](const DescribedPart& one) { return one.name == name_ && one.joint == link; });
    if (part == robot.parts.end()) return;
    X_ = part->X_iL;
    before_ = ExpressIn(part->body, X_);
  }

  [[nodiscard]] MassProperties Add(const TorqueRegressor::BodyVector& change, CorrectedFile* file) const {
    TorqueRegressor::BodyVector after = TorqueRegressor::Pack(before_) + change;
    // Each correction is of a body that can be; several together need not be.
    if (!IsBody(after) && IsBody(TorqueRegressor::Pack(before_))) {
      after = FindNearestBody(after);
      file->left.push_back("link " + name_ +
                           ": what was found is together no body that can be; the nearest one is written");
    }
    return ExpressIn(TorqueRegressor::Unpack(after), X_.inverse());
  }

 private:
  std::string name_;
  Pose X_ = Pose::Identity();  // of the part in frame i
  MassProperties before_;      // in frame i
};

/// Says that the format has no place for a correction.
void MoveToLeft(const std::string& what, CorrectedFile* file) {
  std::erase(file->written, what);
  file->left.push_back(what);
}

/// An XML file's robot with the corrections.
PrintedRobot CorrectPrinted(const RobotDescription& robot, PrintedRobot printed,
                            const Corrections& corrections, CorrectedFile* file) {
  const bool is_urdf = robot.format == RobotFormat::kUrdf;
  const auto find = [&](auto is_it, const std::string& what) -> PrintedLink& {
    const auto link = std::ranges::find_if(printed.links, is_it);
    if (link == printed.links.end())
      throw InputError(
          fmt::format("{}: {}: stands in no element of its own", robot.spec.source, Quote(what)));
    return *link;
  };
  const auto set = [&](JointScalar scalar, const std::map<int, double>& values) {
    for (const auto& [joint, value] : values) {
      const std::string& name = robot.spec.joints[static_cast<size_t>(joint)].name;
      find([&](const PrintedLink& one) { return one.joint.name == name; }, name)
          .joint.scalars[static_cast<size_t>(scalar)] = PrintedScalar{value};
    }
  };
  set(JointScalar::kFriction, corrections.dry);
  set(JointScalar::kDamping, corrections.viscous);
  if (!is_urdf) {
    set(JointScalar::kArmature, corrections.armature);
    if (corrections.gravity) printed.gravity = corrections.gravity;
  } else {
    for (const auto& [joint, value] : corrections.armature)
      MoveToLeft("joint " + robot.spec.joints[static_cast<size_t>(joint)].name + ": armature", file);
    if (corrections.gravity) MoveToLeft("world: gravity", file);
  }
  for (const auto& [link, change] : corrections.bodies) {
    const std::string& name = robot.spec.joints[static_cast<size_t>(link)].link;
    PrintedLink& one = find([&](const PrintedLink& each) { return each.name == name; }, name);
    if (!one.inertial) one.inertial.emplace();
    const MassProperties body = CorrectedBody(robot, link).Add(change, file);
    const Matrix3d R = one.inertial->origin.CalcRotation();
    one.inertial->mass.value = body.mass;
    one.inertial->origin.t = body.com;
    one.inertial->I = ToEntries(R.transpose() * body.inertia * R);
  }
  return printed;
}

/// A parameter file, in whose text single values are replaced.
class TomlCopy {
 public:
  TomlCopy(const RobotDescription& robot, const std::string& text)
      : robot_(robot), text_(text), root_(toml::parse(text)) {
    for (size_t at = 0; at != std::string::npos;
         at = text.find('\n', at), at += at == std::string::npos ? 0 : 1)
      lines_.push_back(at);
  }

  std::string Write(const Corrections& corrections, CorrectedFile* file) {
    const auto set = [&](const std::map<int, double>& values, const char* key) {
      for (const auto& [joint, value] : values)
        Set(GetTable("joints", robot_.spec.joints[static_cast<size_t>(joint)].name), key, Show(value));
    };
    set(corrections.dry, "dry_friction");
    set(corrections.viscous, "damping");
    set(corrections.armature, "armature");
    for (const auto& [link, change] : corrections.bodies) {
      const MassProperties body = CorrectedBody(robot_, link).Add(change, file);
      const toml::table& table = GetTable("links", robot_.spec.joints[static_cast<size_t>(link)].link);
      Set(table, "mass", Show(body.mass));
      Set(table, "com", "[" + Join(body.com, ", ") + "]");
      Set(table, "inertia", "[" + Join(ToEntries(body.inertia), ", ") + "]");
    }
    if (corrections.gravity) Set(root_, "gravity", "[" + Join(*corrections.gravity, ", ") + "]");
    std::sort(edits_.begin(), edits_.end(), [](const Edit& a, const Edit& b) { return a.begin > b.begin; });
    for (const Edit& edit : edits_) text_.replace(edit.begin, edit.end - edit.begin, edit.text);
    return text_;
  }

 private:
  struct Edit {
    size_t begin, end;
    std::string text;
  };

  /// Finds the table of a joint or link: [chain.joints] NAME, with the chain's prefix or without.
  const toml::table& GetTable(const char* kind, const std::string& name) const {
    const toml::array* chains = root_["chain"].as_array();
    for (size_t i = 0; chains != nullptr && i < chains->size(); ++i) {
      const toml::table* chain = (*chains)[i].as_table();
      if (chain == nullptr) continue;
      const std::string prefix = (*chain)["prefix"].value_or(std::string());
      const toml::table* own = (*chain)[kind].as_table();
      for (auto it = own == nullptr ? toml::table::const_iterator() : own->begin();
           own != nullptr && it != own->end(); ++it)
        if (it->second.is_table() && prefix + std::string(it->first.str()) == name)
          return *it->second.as_table();
    }
    throw InputError(
        fmt::format("{}: {} has no table of its own under {} (dexcheck import writes a file that has)",
                    robot_.spec.source, Quote(name), kind));
  }

  [[nodiscard]] size_t OffsetOf(const toml::source_position& at) const {
    return lines_[at.line - 1] + at.column - 1;
  }

  void Set(const toml::table& table, const char* key, const std::string& value) {
    if (const toml::node* node = table.get(key)) {
      edits_.push_back({OffsetOf(node->source().begin), OffsetOf(node->source().end), value});
    } else if (table.is_inline()) {
      const size_t brace = text_.rfind('}', OffsetOf(table.source().end) - 1);
      const size_t end = text_.find_last_not_of(" \t", brace - 1) + 1;
      edits_.push_back({end, end, fmt::format("{}{} = {}", table.empty() ? "" : ", ", key, value)});
    } else {
      throw InputError(fmt::format("{}: line {}: has no {} that could be changed", robot_.spec.source,
                                   table.source().begin.line, key));
    }
  }

  const RobotDescription& robot_;
  std::string text_;
  toml::table root_;
  std::vector<size_t> lines_;
  std::vector<Edit> edits_;
};

}  // namespace

CorrectedFile WriteCorrections(const DescriptionFile& source, const RecordingJudgement& judgement,
                               const std::filesystem::path& folder) {
  const RobotDescription robot = source.Describe();
  CorrectedFile file;
  const Corrections corrections = Collect(RobotModel(robot.spec), judgement, &file);
  if (robot.format == RobotFormat::kToml) {
    file.text = TomlCopy(robot, source.text()).Write(corrections, &file);
    return file;
  }
  const PrintedRobot before = ReadPrintedRobot(source);
  file.text = WriteXml(source, before, CorrectPrinted(robot, before, corrections, &file), folder);
  return file;
}

}  // namespace dexcheck
