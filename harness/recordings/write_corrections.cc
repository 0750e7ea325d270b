#include "harness/recordings/write_corrections.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <functional>
#include <map>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using tinyxml2::XMLElement;

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
        for (Eigen::Index k = 0; k < a.size(); ++k) {
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

/// xx, yy, zz, xy, xz, yz.
Vector6d PackTensor(const Matrix3d& I) {
  Vector6d entries;
  entries << I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2);
  return entries;
}

MassProperties Move(const MassProperties& body, const Pose& X) {
  return {body.mass, X * body.com, X.linear() * body.inertia * X.linear().transpose()};
}

/// A link's body with what is added to it, in the frame of the part of that name.
MassProperties Correct(const RobotDescription& robot, int link, const TorqueRegressor::BodyVector& change,
                       CorrectedFile* file) {
  const std::string& name = robot.spec.joints[static_cast<size_t>(link)].link;
  const auto part = std::find_if(robot.parts.begin(), robot.parts.end(), [&](const DescribedPart& one) {
    return one.name == name && one.joint == link;
  });
  const bool is_of_part = part != robot.parts.end();
  const Pose X = is_of_part ? part->X_iL : Pose::Identity();
  const MassProperties before =
      is_of_part ? Move(part->body, X) : robot.spec.joints[static_cast<size_t>(link)].body;
  TorqueRegressor::BodyVector after = TorqueRegressor::Pack(before) + change;
  // Each correction is of a body that can be; several together need not be.
  if (!IsBody(after) && IsBody(TorqueRegressor::Pack(before))) {
    after = FindNearestBody(after);
    file->left.push_back("link " + name +
                         ": what was found is together no body that can be; the nearest one is written");
  }
  return Move(TorqueRegressor::Unpack(after), X.inverse());
}

/// The first element of that kind and name below one.
XMLElement* Find(XMLElement* root, const char* kind, const std::string& name) {
  for (XMLElement* one = root->FirstChildElement(); one != nullptr; one = one->NextSiblingElement()) {
    const char* own = one->Attribute("name");
    if (std::string_view(one->Name()) == kind && own != nullptr && name == own) return one;
    if (XMLElement* below = Find(one, kind, name)) return below;
  }
  return nullptr;
}

XMLElement* GetChild(XMLElement* parent, const char* kind, bool is_first = false) {
  if (XMLElement* child = parent->FirstChildElement(kind)) return child;
  XMLElement* child = parent->GetDocument()->NewElement(kind);
  if (is_first) {
    parent->InsertFirstChild(child);
  } else {
    parent->InsertEndChild(child);
  }
  return child;
}

/// An XML file.
class XmlCopy {
 public:
  XmlCopy(const RobotDescription& robot, const std::string& text) : robot_(robot) {
    ParseXml(text, robot.spec.source, &document_);
  }

  std::string Write(const Corrections& corrections, CorrectedFile* file) {
    const bool is_urdf = robot_.format == RobotFormat::kUrdf;
    const auto set = [&](const std::map<int, double>& values, const char* urdf, const char* mjcf) {
      for (const auto& [joint, value] : values) {
        XMLElement* element = GetElement("joint", robot_.spec.joints[static_cast<size_t>(joint)].name);
        if (is_urdf) element = GetChild(element, "dynamics");
        element->SetAttribute(is_urdf ? urdf : mjcf, Show(value).c_str());
      }
    };
    set(corrections.dry, "friction", "frictionloss");
    set(corrections.viscous, "damping", "damping");
    if (is_urdf) {
      for (const auto& [joint, value] : corrections.armature)
        MoveToLeft("joint " + robot_.spec.joints[static_cast<size_t>(joint)].name + ": armature", file);
      if (corrections.gravity) MoveToLeft("world: gravity", file);
    } else {
      set(corrections.armature, "", "armature");
      if (corrections.gravity)
        GetChild(document_.RootElement(), "option", true)
            ->SetAttribute("gravity", Join(*corrections.gravity, " ").c_str());
    }
    for (const auto& [link, change] : corrections.bodies) WriteBody(link, change, is_urdf, file);
    return PrintXml(document_);
  }

 private:
  XMLElement* GetElement(const char* kind, const std::string& name) {
    XMLElement* element = Find(document_.RootElement(), kind, name);
    if (element == nullptr)
      throw InputError(
          fmt::format("{}: {} {}: stands in no element of its own", robot_.spec.source, kind, Quote(name)));
    return element;
  }
  /// What this format has no place for.
  static void MoveToLeft(const std::string& what, CorrectedFile* file) {
    std::erase(file->written, what);
    file->left.push_back(what);
  }

  void WriteBody(int link, const TorqueRegressor::BodyVector& change, bool is_urdf, CorrectedFile* file) {
    const MassProperties body = Correct(robot_, link, change, file);
    XMLElement* inertial =
        GetChild(GetElement(is_urdf ? "link" : "body", robot_.spec.joints[static_cast<size_t>(link)].link),
                 "inertial", true);
    const Vector6d tensor = PackTensor(body.inertia);
    if (!is_urdf) {
      for (const char* other : {"quat", "euler", "axisangle", "xyaxes", "zaxis", "diaginertia"})
        inertial->DeleteAttribute(other);
      inertial->SetAttribute("mass", Show(body.mass).c_str());
      inertial->SetAttribute("pos", Join(body.com, " ").c_str());
      inertial->SetAttribute("fullinertia", Join(tensor, " ").c_str());
      return;
    }
    XMLElement* origin = GetChild(inertial, "origin");
    origin->SetAttribute("xyz", Join(body.com, " ").c_str());
    origin->SetAttribute("rpy", "0 0 0");
    GetChild(inertial, "mass")->SetAttribute("value", Show(body.mass).c_str());
    XMLElement* inertia = GetChild(inertial, "inertia");
    constexpr const char* kEntries[] = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};
    for (int i = 0; i < 6; ++i) inertia->SetAttribute(kEntries[i], Show(tensor[i]).c_str());
  }

  const RobotDescription& robot_;
  tinyxml2::XMLDocument document_;
};

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
      const MassProperties body = Correct(robot_, link, change, file);
      const toml::table& table = GetTable("links", robot_.spec.joints[static_cast<size_t>(link)].link);
      Set(table, "mass", Show(body.mass));
      Set(table, "com", "[" + Join(body.com, ", ") + "]");
      Set(table, "inertia", "[" + Join(PackTensor(body.inertia), ", ") + "]");
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

  /// Of a joint or link: [chain.joints] NAME, with the chain's prefix or without.
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

CorrectedFile WriteCorrections(const RobotDescription& robot, const std::string& text,
                               const RecordingJudgement& judgement) {
  CorrectedFile file;
  const Corrections corrections = Collect(RobotModel(robot.spec), judgement, &file);
  file.text = robot.format == RobotFormat::kToml ? TomlCopy(robot, text).Write(corrections, &file)
                                                 : XmlCopy(robot, text).Write(corrections, &file);
  return file;
}

}  // namespace dexcheck
