#include "harness/scenario/runnable_robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <tuple>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/parameter_reader.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/urdf_reader.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/xml.h"

namespace dexcheck {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;

void TakeAssets(const fs::path& folder, MjcfFile* mjcf) {
  int count = 0;
  for (const AssetFile& asset : ListAssetFiles(mjcf->root())) {
    // The engine names an asset that has no name by its file.
    if (asset.element->Attribute("name") == nullptr)
      asset.element->SetAttribute("name", asset.path.stem().c_str());
    const std::string to = fmt::format("assets/{}-{}", ++count, asset.path.filename().string());
    WriteFile(folder / to, ReadBytes(mjcf->folder() / asset.path, kMostData));
    asset.element->SetAttribute(asset.attribute, to.c_str());
  }
  for (XMLElement* compiler : ListChildren(mjcf->root(), "compiler")) {
    for (const char* key : {"assetdir", "meshdir", "texturedir", "strippath"}) compiler->DeleteAttribute(key);
  }
}

void LeaveOutBaseContacts(MjcfFile* mjcf) {
  const std::vector<std::string> pairs = ExcludeBaseContacts(mjcf);
  if (!pairs.empty())
    Warn(mjcf->source() + ": contacts of neighbours at a joint left out: " + JoinNames(pairs));
}

MjModelPtr Load(const MjcfFile& mjcf) { return LoadMjcfText(mjcf.PrintFor(CurrentFolder()), mjcf.source()); }

RobotDescription Describe(const fs::path& file, const MjcfFile& mjcf) {
  return DescriptionFile(file, mjcf.PrintFor(MakeAbsolute(file).parent_path()), {}).Describe();
}

namespace {

/// Changes what the engine refuses of a description that an MJCF is made of, and warns of it: ranges without
/// width, inertias that no body has, of which the nearest stand, links that move and have no mass.
void MendForEngine(RobotDescription* robot) {
  constexpr double kLeast = 1e-12;  // kg, kg m^2
  std::vector<std::string> ranges, bodies, points;
  for (size_t i = 0; i < robot->spec.joints.size(); ++i) {
    Joint& joint = robot->spec.joints[i];
    if (robot->joints[i].states_range && joint.lower >= joint.upper) {
      robot->joints[i].states_range = false;
      std::tie(joint.lower, joint.upper) = std::pair(-kPi, kPi);
      ranges.push_back(joint.name);
    }
    const Matrix3d possible = FindNearestInertia(joint.body.inertia);
    if (possible != joint.body.inertia) bodies.push_back(joint.link);
    joint.body.inertia = possible;
    if (joint.body.mass > kLeast && possible.trace() > kLeast) continue;
    points.push_back(joint.link);
    joint.body.mass = std::max(joint.body.mass, 1e-3);
    joint.body.inertia += 1e-6 * Matrix3d::Identity();
  }
  if (!ranges.empty()) Warn("ranges of no width are left out: " + JoinNames(ranges));
  if (!bodies.empty())
    Warn("no body has the inertia that these links state, the nearest that one can have is written: " +
         JoinNames(bodies));
  if (!points.empty())
    Warn("joints move these links, which have no mass or no inertia; 1 g and 1e-6 kg m^2 are written: " +
         JoinNames(points));
}

/// Reduces friction that stops a joint within less than 10 ms; dry friction from 1 rad/s or 1 m/s.
/// @returns the joints that it warns of.
std::vector<Joint> ReduceFriction(const std::string& source, RobotDescription* robot) {
  constexpr double kLeast = 0.01;  // s
  const RobotModel model = ParseRobotModel(WriteParameters(*robot, source), source);
  const VectorXd inertia = CalcJointInertias(model);
  std::vector<std::string> names;
  std::vector<Joint> reduced;
  for (int i = 0; i < model.num_joints(); ++i) {
    Joint& joint = robot->spec.joints[static_cast<size_t>(i)];
    const double most = inertia[i] / kLeast;
    if (std::max(joint.damping, joint.dry_friction) <= most) continue;
    names.push_back(
        fmt::format("{} ({:.3g} to {:.3g})", joint.name, std::max(joint.damping, joint.dry_friction), most));
    joint.damping = std::min(joint.damping, most);
    joint.dry_friction = std::min(joint.dry_friction, most);
    reduced.push_back(joint);
  }
  if (!names.empty()) Warn("friction that would stop a joint within 10 ms is reduced: " + JoinNames(names));
  return reduced;
}

/// Writes the friction of joints into their elements, whatever their classes have.
void StateFriction(const std::vector<Joint>& joints, MjcfFile* mjcf) {
  for (XMLElement* element : ListElements(mjcf->root(), "joint")) {
    const Joint* const joint = FindIn(joints, ReadAttribute(*element, "name"), &Joint::name);
    if (joint == nullptr) continue;
    element->SetAttribute("damping", FormatNumber(joint->damping).c_str());
    element->SetAttribute("frictionloss", FormatNumber(joint->dry_friction).c_str());
  }
}

/// A run's law has one number for each joint.
void RequireJoints(const std::string& source, const RobotDescription& robot) {
  if (robot.spec.joints.empty()) throw InputError(source + ": has no joint that moves");
  for (const Joint& joint : robot.spec.joints) {
    if (joint.type == JointType::kBall)
      throw InputError(source + ": joint " + Quote(joint.name) +
                       ": must not be a ball joint in a run, whose law has one number for each joint");
  }
}

/// The user's MJCF with motors, as a run needs it.
std::unique_ptr<MjcfFile> AdaptForRun(const fs::path& source, std::map<std::string, double> limits) {
  auto mjcf = std::make_unique<MjcfFile>(source);
  // The MJCF's own come first.
  std::map<std::string, double> own = FindForceRanges(*mjcf);
  own.merge(limits);
  KeepMechanism(mjcf.get());
  AdaptMjcf(mjcf.get());
  StateNewDefaults(mjcf.get());
  RequireExactSolver(mjcf.get());
  LeaveOutOthers(*Load(*mjcf), mjcf.get());
  NameParts(mjcf.get());
  if (!mjcf->changes().empty()) Warn(mjcf->SummarizeChanges());
  AddMotors(mjcf.get(), own);
  LeaveOutBaseContacts(mjcf.get());
  return mjcf;
}

}  // namespace

RunnableRobot ReadRunnableRobot(const fs::path& file, const fs::path& mjcf) {
  const std::string text = ReadBytes(file), source = file.string();
  const RobotFormat format = FindFormat(text, file);
  RunnableRobot made;
  if (format == RobotFormat::kMjcf) {
    if (!mjcf.empty()) throw InputError(mjcf.string() + ": must stand beside a URDF, got two MJCFs");
    made.mjcf = AdaptForRun(file, {});
    made.robot = Describe(file, *made.mjcf);
    RequireJoints(source, made.robot);
    StateFriction(ReduceFriction(source, &made.robot), made.mjcf.get());
    return made;
  }
  if (format != RobotFormat::kUrdf)
    throw InputError(source + ": must be a URDF or an MJCF, is a parameter file");
  made.robot = ParseUrdf(text, source);
  RequireJoints(source, made.robot);
  std::map<std::string, double> limits;
  for (size_t i = 0; i < made.robot.joints.size(); ++i) {
    const DescribedJoint& joint = made.robot.joints[i];
    const std::string& name = made.robot.spec.joints[i].name;
    if (joint.velocity_limit > 0.0) made.rates[name] = joint.velocity_limit;
    if (joint.forces) limits[name] = joint.forces->upper;
  }
  if (!mjcf.empty()) {
    made.mjcf = AdaptForRun(mjcf, limits);
    // A URDF need not say how its root moves; the MJCF does.
    if (!made.robot.states_base && Describe(mjcf, *made.mjcf).spec.base.type == BaseType::kFloating)
      made.robot = ParseUrdf(text, source, {.floating = true});
    return made;
  }
  MendForEngine(&made.robot);
  ReduceFriction(source, &made.robot);
  made.mjcf =
      std::make_unique<MjcfFile>(WriteMjcf(made.robot, file.filename().string()), source + " as an MJCF");
  AddMotors(made.mjcf.get(), limits);
  return made;
}

void AddSky(MjcfFile* mjcf) {
  for (const XMLElement* texture : ListElements(mjcf->root(), "texture"))
    if (ReadAttribute(*texture, "type") == "skybox") return;
  XMLElement* const sky = RequireSection(mjcf->root(), "asset")->InsertNewChildElement("texture");
  SetAttributes({{"type", "skybox"},
                 {"builtin", "gradient"},
                 {"rgb1", "0.90 0.93 0.95"},
                 {"rgb2", "0.42 0.55 0.68"},
                 {"width", "256"},
                 {"height", "1536"}},
                sky);
}

std::map<std::string, double> ReadMotorLimits(const mjModel& m) {
  std::map<std::string, double> limits;
  for (int i = 0; i < m.nu; ++i) {
    if (m.actuator_ctrllimited[i] != 0)
      limits[NameOf(m, mjOBJ_ACTUATOR, i)] = m.actuator_ctrlrange[2 * i + 1];
  }
  return limits;
}

JointPositions ReadHome(const mjModel& m) {
  JointPositions home;
  for (int joint = 0; m.nkey > 0 && joint < m.njnt; ++joint) {
    if (m.jnt_type[joint] == mjJNT_HINGE || m.jnt_type[joint] == mjJNT_SLIDE)
      home[NameOf(m, mjOBJ_JOINT, joint)] = m.key_qpos[m.jnt_qposadr[joint]];
  }
  return home;
}

void FreeCoupledJoints(RobotDescription* robot) {
  std::vector<std::string> names;
  for (Joint& joint : robot->spec.joints) {
    if (joint.coupling) names.push_back(joint.name);
    joint.coupling.reset();
  }
  if (!names.empty()) Warn("joints that follow others get motors of their own: " + JoinNames(names));
}

void FreeMotors(const std::vector<std::string>& names, MjcfFile* mjcf) {
  if (names.empty()) return;
  for (XMLElement* section : ListChildren(mjcf->root(), "actuator")) {
    for (XMLElement* motor : ListChildren(section)) {
      if (std::find(names.begin(), names.end(), ReadAttribute(*motor, "name")) != names.end())
        motor->SetAttribute("ctrllimited", "false");
    }
  }
  Warn("motors whose limits do not carry the robot along the motion run without them: " + JoinNames(names));
}

}  // namespace dexcheck
