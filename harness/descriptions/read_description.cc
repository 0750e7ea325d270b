#include "harness/descriptions/read_description.h"

#include <algorithm>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/parameter_reader.h"
#include "controller/model/rigid_body.h"
#include "harness/base/files.h"
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

DescriptionFile::DescriptionFile(std::filesystem::path path, const UrdfOptions& options)
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
