#include "harness/cli/init_sources.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/checks/file_comparison.h"
#include "harness/cli/init_motion.h"
#include "harness/cli/init_stance.h"
#include "harness/cli/run_folder.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/urdf_reader.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/xml.h"

namespace dexcheck::cli {

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

void StateFriction(const std::vector<Joint>& joints, MjcfFile* mjcf) {
  VisitElements(mjcf->root(), [&](XMLElement* element) {
    if (std::string_view(element->Name()) != "joint") return;
    for (const Joint& joint : joints) {
      if (ReadAttribute(*element, "name") != joint.name) continue;
      element->SetAttribute("damping", FormatNumber(joint.damping).c_str());
      element->SetAttribute("frictionloss", FormatNumber(joint.dry_friction).c_str());
    }
  });
}

namespace {

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

InitSources ReadSources(const InitRequest& request) {
  const std::string text = ReadBytes(request.robot);
  const RobotFormat format = FindFormat(text, request.robot);
  InitSources sources;
  if (format == RobotFormat::kMjcf) {
    if (!request.mjcf.empty())
      throw InputError(request.mjcf.string() + ": must stand beside a URDF, got two MJCFs");
    sources.mjcf = AdaptForRun(request.robot, {});
    sources.robot = DescriptionFile(request.robot, sources.mjcf->Print(), {}).Describe();
    return sources;
  }
  if (format != RobotFormat::kUrdf)
    throw InputError(request.robot.string() + ": must be a URDF or an MJCF, is a parameter file");
  const std::string source = request.robot.string();
  sources.robot = ParseUrdf(text, source);
  sources.rates = ReadUrdfLimits(text, source, "velocity");
  const std::map<std::string, double> limits = ReadUrdfLimits(text, source, "effort");
  if (!request.mjcf.empty()) {
    sources.mjcf = AdaptForRun(request.mjcf, limits);
    // A URDF need not say how its root moves; the MJCF does.
    const RobotDescription other = DescriptionFile(request.mjcf, sources.mjcf->Print(), {}).Describe();
    if (!sources.robot.states_base && other.spec.base.type == BaseType::kFloating)
      sources.robot = ParseUrdf(text, source, {.floating = true});
    return sources;
  }
  const std::vector<int> legs = FindLegs(sources.robot);
  if (!sources.robot.states_base && !legs.empty()) {
    Warn(fmt::format("{}: floats, on {} legs that are alike; what hangs on a link \"world\" is fixed", source,
                     legs.size()));
    sources.robot = ParseUrdf(text, source, {.floating = true});
  }
  MendForEngine(&sources.robot);
  ReduceFriction(source, &sources.robot);
  sources.mjcf = std::make_unique<MjcfFile>(WriteMjcf(sources.robot, request.robot.filename().string()),
                                            source + " as an MJCF");
  if (sources.robot.spec.base.type == BaseType::kFloating)
    AddLegShapes(sources.robot, legs, sources.mjcf.get());
  AddMotors(sources.mjcf.get(), limits);
  return sources;
}

void AddSky(MjcfFile* mjcf) {
  bool has_sky = false;
  VisitElements(mjcf->root(), [&](XMLElement* element) {
    has_sky |= std::string_view(element->Name()) == "texture" && ReadAttribute(*element, "type") == "skybox";
  });
  if (has_sky) return;
  XMLElement* const sky = RequireSection(mjcf->root(), "asset")->InsertNewChildElement("texture");
  constexpr const char* kSky[][2] = {{"type", "skybox"},         {"builtin", "gradient"},
                                     {"rgb1", "0.90 0.93 0.95"}, {"rgb2", "0.42 0.55 0.68"},
                                     {"width", "256"},           {"height", "1536"}};
  for (const auto& [attribute, value] : kSky) sky->SetAttribute(attribute, value);
}

std::map<std::string, double> ReadMotorLimits(const mjModel& m) {
  std::map<std::string, double> limits;
  for (int i = 0; i < m.nu; ++i) {
    if (m.actuator_ctrllimited[i] != 0)
      limits[NameOf(m, mjOBJ_ACTUATOR, i)] = m.actuator_ctrlrange[2 * i + 1];
  }
  return limits;
}

std::map<std::string, double> ReadHome(const mjModel& m) {
  std::map<std::string, double> home;
  for (int joint = 0; m.nkey > 0 && joint < m.njnt; ++joint) {
    if (m.jnt_type[joint] == mjJNT_HINGE || m.jnt_type[joint] == mjJNT_SLIDE)
      home[NameOf(m, mjOBJ_JOINT, joint)] = m.key_qpos[m.jnt_qposadr[joint]];
  }
  return home;
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

}  // namespace dexcheck::cli
