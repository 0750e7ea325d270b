#include "harness/scenario/scenario.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "controller/common/errors.h"
#include "controller/object/euler_zyz.h"
#include "harness/scenario/scenario_imperfections.h"
#include "harness/scenario/scenario_joints.h"

namespace dexcheck {
namespace {

constexpr double kMaxSteps = 1e8;
/// s. Contacts settle within some of their time constants, 2 ms each, and posture within some periods of its
/// task; whatever has not come to rest by then, never will.
constexpr double kMaxSettle = 100.0;

double ReadOr(TomlTable& table, std::string_view key, double otherwise,
              double (TomlValue::*read)() const = &TomlValue::AsPositive) {
  const auto value = table.Find(key);
  return value ? ((*value).*read)() : otherwise;
}

std::string ReadPath(TomlTable& table, std::string_view key, const std::filesystem::path& folder) {
  const auto value = table.Find(key);
  return value ? (folder / value->AsText()).lexically_normal().string() : "";
}

void ReadModel(const TomlValue& value, const std::filesystem::path& folder, Scenario* scenario) {
  TomlTable table = value.AsTable();
  scenario->model_file = ReadPath(table, "file", folder);
  if (const auto list = table.Find("overrides")) {
    for (const TomlValue& entry : list->AsList()) scenario->model_overrides.push_back(entry.AsText());
    scenario->own_model_overrides = scenario->model_overrides.size();
  }
  table.RejectUnused();
}

/// "engine", or one of the rigid plants, for which the engine's keys mean nothing.
void ReadPlantType(TomlTable& table, PlantOptions* plant) {
  const auto type = table.Find("type");
  if (!type) return;
  enum class Choice { kEngine, kRigid, kRigidEuler };
  const auto choice = type->AsChoice<Choice>(
      {{"engine", Choice::kEngine}, {"rigid", Choice::kRigid}, {"rigid_euler", Choice::kRigidEuler}});
  if (choice == Choice::kEngine) return;
  plant->type = PlantType::kRigid;
  if (choice == Choice::kRigidEuler) plant->integrator = Integrator::kSemiImplicitEuler;
  for (const char* key : {"contact_time_constant", "contact_impedance", "impratio", "noslip_iterations",
                          "bonded", "implicit_damping", "floor_friction", "collide"}) {
    if (const auto value = table.Find(key)) value->Reject("has no meaning for a rigid plant");
  }
}

/// [["BODY", "BODY"], ...]
void ReadMayTouch(const TomlValue& value, PlantOptions* plant) {
  for (const TomlValue& entry : value.AsList()) {
    const std::vector<TomlValue> bodies = entry.AsList();
    if (bodies.size() != 2) entry.Reject("must name two bodies");
    plant->allowed_collision_pairs.emplace_back(bodies[0].AsName(), bodies[1].AsName());
  }
}

void ReadPlant(const TomlValue& value, const std::filesystem::path& folder, Scenario* scenario) {
  constexpr long kMaxNoslipIterations = 1000;
  TomlTable table = value.AsTable();
  PlantOptions& plant = scenario->plant;
  scenario->mjcf_file = ReadPath(table, "mjcf", folder);
  ReadPlantType(table, &plant);
  plant.time_step = ReadOr(table, "time_step", plant.time_step);
  plant.control_step = ReadOr(table, "control_step", 0.0, &TomlValue::AsNotNegative);
  plant.contact_time_constant = ReadOr(table, "contact_time_constant", 0.0, &TomlValue::AsNotNegative);
  plant.contact_impedance = ReadOr(table, "contact_impedance", plant.contact_impedance);
  if (plant.contact_impedance >= 1.0) table.Get("contact_impedance").Fail("must be less than 1");
  plant.impratio = ReadOr(table, "impratio", plant.impratio);
  if (const auto count = table.Find("noslip_iterations")) {
    plant.noslip_iterations = static_cast<int>(count->AsWhole(0, kMaxNoslipIterations));
  }
  if (const auto flag = table.Find("bonded")) plant.bonded = flag->AsFlag();
  if (const auto flag = table.Find("implicit_damping")) plant.implicit_damping = flag->AsFlag();
  if (const auto mu = table.Find("floor_friction")) plant.floor_friction = mu->AsPositive();
  if (const auto mu = table.Find("finger_friction")) plant.finger_friction = mu->AsPositive();
  if (const auto flag = table.Find("collide")) plant.collide = flag->AsFlag();
  if (const auto pairs = table.Find("allowed_collision_pairs")) ReadMayTouch(*pairs, &plant);
  table.RejectUnused();
}

SurfacePoint ReadContact(const TomlValue& value) {
  // On the torus: u around its axis, v around its tube. What they mean on the object is found with its
  // surface.
  const Vector2d degrees = value.AsVector<2>();
  return {DegToRad(degrees[0]), DegToRad(degrees[1]), 0};
}

void ReadContacts(TomlTable& table, GraspOptions* grasp) {
  const TomlValue contacts = table.Get("contacts_deg");
  for (const TomlValue& entry : contacts.AsList()) grasp->contacts.push_back(ReadContact(entry));
  if (grasp->contacts.size() != grasp->fingertips.size()) {
    contacts.Reject("must have one contact for each of the " + std::to_string(grasp->fingertips.size()) +
                    " fingertips");
  }
  if (const auto xyz = table.Find("xyz")) grasp->X_FO.translation() = xyz->AsVector<3>();
  if (const auto zyz = table.FindAngles<3>("zyz")) grasp->X_FO.linear() = CalcRotationZyz(*zyz);
}

/// @param planned whether a task chooses the contacts.
void ReadGrasp(const TomlValue& value, bool planned, Scenario* scenario) {
  TomlTable table = value.AsTable();
  GraspOptions& grasp = scenario->grasp;
  const TomlValue fingertips = table.Get("fingertips");
  for (const TomlValue& entry : fingertips.AsList()) grasp.fingertips.push_back(entry.AsName());
  if (grasp.fingertips.size() < 3) fingertips.Reject("needs at least three fingertips to hold an object");
  if (!planned) {
    ReadContacts(table, &grasp);
  } else if (const auto xyz = table.Find("xyz")) {
    grasp.hold_at = xyz->AsVector<3>();
  }
  grasp.frame = table.Get("frame").AsName();
  if (const auto pole = table.Find("hemisphere")) {
    grasp.hemisphere = pole->AsVector<3>();
    if (!(grasp.hemisphere->norm() > 0.0)) pole->Fail("must have a direction");
    grasp.hemisphere->normalize();
  }
  if (const auto joints = table.Find("joints_deg")) {
    for (const auto& [name, angle] : joints->AsTable().GetEntries()) {
      grasp.joints.emplace_back(name, DegToRad(angle.AsNumber()));
    }
  }
  table.RejectUnused();
}

void ReadTask(const TomlValue& value, Scenario* scenario) {
  TomlTable table = value.AsTable();
  TaskOptions task;
  PickAndPlaceOptions& pick = task.pick_and_place;
  task.X_Bo.translation() = table.Get("xyz").AsVector<3>();
  if (const auto zyz = table.FindAngles<3>("zyz")) task.X_Bo.linear() = CalcRotationZyz(*zyz);
  if (const auto joints = table.Find("arm_joints")) {
    for (const TomlValue& entry : joints->AsList()) task.arm_joints.push_back(entry.AsName());
  }
  pick.raise.z() = pick.plan.raise = table.Get("raise").AsPositive();
  pick.transport = pick.plan.transport = table.Get("transport").AsVector<3>();
  pick.plan.support = table.Get("support_height").AsNumber();
  constexpr std::pair<const char*, double PickAndPlaceOptions::*> kNumbers[] = {
      {"approach_time", &PickAndPlaceOptions::approach_time},
      {"lower_time", &PickAndPlaceOptions::lower_time},
      {"close_time", &PickAndPlaceOptions::close_time},
      {"search_speed", &PickAndPlaceOptions::search_speed},
      {"grip_time", &PickAndPlaceOptions::grip_time},
      {"take_over_time", &PickAndPlaceOptions::take_over_time},
      {"raise_time", &PickAndPlaceOptions::raise_time},
      {"arm_rate", &PickAndPlaceOptions::arm_rate},
      {"transport_time", &PickAndPlaceOptions::transport_time},
      {"touch_force", &PickAndPlaceOptions::touch_force},
      {"overload", &PickAndPlaceOptions::overload},
      {"largest_push", &PickAndPlaceOptions::largest_push},
  };
  for (const auto& [key, member] : kNumbers) pick.*member = ReadOr(table, key, pick.*member);
  pick.plan.opening = ReadOr(table, "opening", pick.plan.opening);
  constexpr long kMaxAttempts = 10;
  if (const auto attempts = table.Find("attempts")) {
    pick.attempts = static_cast<int>(attempts->AsWhole(1, kMaxAttempts));
  }
  table.RejectUnused();
  scenario->task = task;
}

/// What a task takes from the rest of the scenario. @throws InputError when that does not fit a task.
void FinishTask(Scenario* scenario) {
  const auto require = [&](bool holds, const char* problem) {
    if (!holds) throw InputError(scenario->source + ": " + problem);
  };
  require(scenario->start == Start::kRest, "start: must be \"rest\" for a task");
  require(scenario->plant.type == PlantType::kEngine,
          "plant.type: a task needs contacts that open and close, which a rigid plant has not");
  require(scenario->control.law == ControlLaw::kComputedTorque,
          "control.law: a task is done by \"computed_torque\"");
  require(!scenario->plant.bonded, "plant.bonded: a task needs contacts that open and close");
  require(scenario->plant.control_step <= scenario->plant.time_step,
          "plant.control_step: a task decides at every time step");
  require(scenario->control.orientation == OrientationFeedback::kRotation,
          "control.orientation: must be \"rotation\" for a task");
  PickAndPlaceOptions& pick = scenario->task->pick_and_place;
  pick.f_min = scenario->control.f_min;
  pick.posture_frequency = scenario->control.posture_frequency;
  pick.plan.mu = scenario->control.mu;
  pick.plan.hemisphere = scenario->grasp.hemisphere;
}

/// K_p or the natural frequency of (57), and K_v or the damping ratio.
void ReadGains(TomlTable& table, ObjectGains* gains) {
  table.RejectTogether("K_p", {"natural_frequency"});
  table.RejectTogether("K_v", {"damping_ratio"});
  Vector6d omega;
  const auto frequency = table.Find("natural_frequency");
  if (frequency) {
    omega = frequency->AsVectorOrNumber<6>();
    gains->K_p = omega.cwiseAbs2();
    if ((omega.array() < 0.0).any()) frequency->Fail("must not be negative");
  } else {
    gains->K_p = table.Get("K_p").AsVectorOrNumber<6>();
    omega = gains->K_p.cwiseMax(0.0).cwiseSqrt();
  }
  const auto K_v = table.Find("K_v");
  const auto zeta = K_v || !(frequency || table.Find("damping_ratio"))
                        ? std::nullopt
                        : std::optional(table.Get("damping_ratio"));
  gains->K_v = zeta ? Vector6d(2.0 * zeta->AsVectorOrNumber<6>().cwiseProduct(omega))
                    : table.Get("K_v").AsVectorOrNumber<6>();
}

/// "identity", "mass", or { platform, arm }: a diagonal with 1 for all other joints.
void ReadWeight(const TomlValue& value, ControlOptions* control) {
  if (value.IsText()) {
    control->weight = value.AsChoice<RedundancyWeight::Kind>(
        {{"identity", RedundancyWeight::Kind::kIdentity}, {"mass", RedundancyWeight::Kind::kMass}});
    return;
  }
  TomlTable table = value.AsTable();
  control->weight = RedundancyWeight::Kind::kDiagonal;
  control->platform_weight = ReadOr(table, "platform", 1.0);
  control->arm_weight = ReadOr(table, "arm", 1.0);
  table.RejectUnused();
}

/// The law, and the stiffness and damping of those that have them.
void ReadLaw(TomlTable& table, ControlOptions* control) {
  if (const auto law = table.Find("law")) {
    control->law = law->AsChoice<ControlLaw>({{"computed_torque", ControlLaw::kComputedTorque},
                                              {"pd_gravity", ControlLaw::kPdGravity},
                                              {"feedforward_pd", ControlLaw::kFeedforwardPd},
                                              {"operational_space", ControlLaw::kOperationalSpace},
                                              {"impedance", ControlLaw::kImpedance}});
    control->names_law = true;
  }
  const auto read = [&](const char* key, bool has_it, std::optional<Vector6d>* result) {
    const auto value = table.Find(key);
    if (!value) return;
    if (!has_it) value->Reject("has no meaning for the law " + Quote(NameOf(control->law)));
    *result = value->AsVectorOrNumber<6>();
    if (((*result)->array() < 0.0).any()) value->Fail("must not be negative");
  };
  read("stiffness", HasStiffness(control->law), &control->stiffness);
  read("damping", HasStiffness(control->law) && control->law != ControlLaw::kImpedance, &control->damping);
}

void ReadControl(const TomlValue& value, Scenario* scenario) {
  TomlTable table = value.AsTable();
  ControlOptions& control = scenario->control;
  ReadLaw(table, &control);
  ReadGains(table, &control.gains);
  if (const auto choice = table.Find("orientation")) {
    control.orientation = choice->AsChoice<OrientationFeedback>(
        {{"angles", OrientationFeedback::kAngles}, {"rotation", OrientationFeedback::kRotation}});
  }
  if (const auto weight = table.Find("weight")) ReadWeight(*weight, &control);
  control.posture_frequency =
      ReadOr(table, "posture_frequency", control.posture_frequency, &TomlValue::AsNotNegative);
  control.f_min = ReadOr(table, "f_min", 0.0, &TomlValue::AsNotNegative);
  control.f_max = table.Get("f_max").AsPositive();
  if (control.f_max <= control.f_min) table.Get("f_max").Fail("must be greater than f_min");
  control.mu = table.Get("mu").AsPositive();
  if (const auto choice = table.Find("kappa")) {
    control.kappa = choice->AsChoice<ContactSource>(
        {{"exact", ContactSource::kExact}, {"integrated", ContactSource::kIntegrated}});
    if (control.kappa == ContactSource::kIntegrated) {
      if (scenario->task) choice->Reject("contacts of a task come and go");
      if (scenario->plant.bonded) choice->Reject("bonds do not roll");
    }
  }
  if (const auto [error, unit] = table.FindWithAngleUnit("contact_error"); error) {
    control.contact_error = unit * error->AsNumber();
  }
  table.RejectUnused();
}

/// @param joints whether joints follow a motion, and no object does.
void ReadExpectation(const TomlValue& value, bool joints, Expectation* expect) {
  TomlTable table = value.AsTable();
  expect->from = ReadOr(table, "from", 0.0, &TomlValue::AsNotNegative);
  if (joints) {
    if (const auto [error, unit] = table.FindWithAngleUnit("joints"); error) {
      expect->joints = unit * error->AsPositive();
    }
    return table.RejectUnused();
  }
  if (const auto position = table.Find("position")) expect->position = position->AsPositive();
  if (const auto [orientation, unit] = table.FindWithAngleUnit("orientation"); orientation) {
    expect->orientation = unit * orientation->AsPositive();
  }
  table.RejectUnused();
}

/// The file by itself; null when it needs overrides to be a scenario.
std::shared_ptr<const Scenario> ReadWritten(const std::string& text, const std::string& source,
                                            const std::filesystem::path& folder) {
  try {
    return std::make_shared<const Scenario>(ParseScenario(text, source, folder, {}));
  } catch (const InputError&) {
    return nullptr;
  }
}

/// @param scenario what is known of it before its file is read.
Scenario ReadScenario(TomlTable& root, const std::filesystem::path& folder,
                      const std::vector<std::string>& model_overrides, Scenario scenario) {
  root.RejectOthersThan({"name",        "description", "duration",     "settle",  "start",
                         "start_error", "tolerance",   "model",        "plant",   "grasp",
                         "task",        "trajectory",  "joint_motion", "control", "sensing",
                         "actuation",   "disturbance", "mismatch",     "bounds",  "expect"});
  scenario.name = root.Get("name").AsName();
  if (const auto description = root.Find("description")) scenario.description = description->AsText();
  scenario.duration = root.Get("duration").AsPositive();
  scenario.settle = ReadOr(root, "settle", 1.0);
  if (scenario.settle > kMaxSettle) root.Get("settle").Fail("must be at most 100 s");
  scenario.start = root.Get("start").AsChoice<Start>({{"moving", Start::kMoving}, {"rest", Start::kRest}});
  if (const auto error = root.Find("start_error")) {
    TomlTable table = error->AsTable();
    if (const auto xyz = table.Find("xyz")) scenario.start_error.head<3>() = xyz->AsVector<3>();
    if (const auto zyz = table.FindAngles<3>("zyz")) scenario.start_error.tail<3>() = *zyz;
    table.RejectUnused();
  }
  if (const auto tolerance = root.Find("tolerance")) {
    scenario.tolerance = tolerance->AsNotNegative();
    if (scenario.tolerance >= 1.0) tolerance->Fail("must be below 1");
  }
  if (const auto model = root.Find("model")) ReadModel(*model, folder, &scenario);
  scenario.model_overrides.insert(scenario.model_overrides.end(), model_overrides.begin(),
                                  model_overrides.end());
  if (const auto plant = root.Find("plant")) ReadPlant(*plant, folder, &scenario);
  root.RejectTogether("task", {"trajectory", "start_error"});
  if (const auto task = root.Find("task")) ReadTask(*task, &scenario);
  root.RejectTogether("joint_motion", {"grasp", "task", "trajectory", "start_error"});
  if (const auto motion = root.Find("joint_motion")) {
    scenario.joint_motion = ReadJointMotion(*motion);
    ReadJointControl(root.Get("control"), &scenario);
    RequireJointMotion(scenario);
  } else {
    // First, so that all that are missing are told together.
    const TomlValue grasp = root.Get("grasp");
    const TomlValue control = root.Get("control");
    if (!scenario.task) (void)root.Get("trajectory");
    ReadGrasp(grasp, scenario.task.has_value(), &scenario);
    ReadControl(control, &scenario);
  }
  if (scenario.task) FinishTask(&scenario);
  scenario.imperfections = ReadImperfections(&root, scenario.plant.time_step);
  if (const auto bounds = root.Find("bounds")) {
    for (const auto& [name, value] : bounds->AsTable().GetEntries()) {
      scenario.bounds.emplace_back(name, value.AsNotNegative());
    }
    if (!scenario.overrides.empty()) scenario.written = ReadWritten(scenario.text, scenario.source, folder);
  }
  if (const auto expect = root.Find("expect"))
    ReadExpectation(*expect, scenario.joint_motion.has_value(), &scenario.expect);
  if (scenario.duration < scenario.plant.time_step)
    root.Get("duration").Fail("must be at least one time step");
  if (scenario.duration / scenario.plant.time_step > kMaxSteps) {
    root.Get("duration").Fail("must be at most 1e8 time steps");
  }
  if (scenario.settle / scenario.plant.time_step > kMaxSteps) {
    if (const auto settle = root.Find("settle")) settle->Fail("must be at most 1e8 time steps");
    root.Get("plant").AsTable().Get("time_step").Fail("is too small to settle in 1e8 time steps");
  }
  if (scenario.task || scenario.joint_motion) return scenario;
  TomlTable trajectory = root.Get("trajectory").AsTable();
  scenario.trajectory = ReadTrajectory(trajectory);
  return scenario;
}

}  // namespace

std::string_view FindModelKey(std::string_view key) {
  constexpr std::string_view kModel = "model.";
  const bool own = key == "model.file" || key.starts_with("model.overrides");
  return key.starts_with(kModel) && !own ? key.substr(kModel.size()) : std::string_view();
}

TomlDocument OpenScenario(const std::string& text, const std::string& source,
                          const std::vector<std::string>& overrides,
                          std::vector<std::string>* model_overrides) {
  TomlDocument document(text, source);
  for (const std::string& assignment : overrides) {
    const std::string_view key = std::string_view(assignment).substr(0, assignment.find('='));
    const std::string_view model_key = FindModelKey(key);
    if (model_key.empty()) {
      document.Override(assignment);
    } else {
      model_overrides->push_back(assignment.substr(key.size() - model_key.size()));
    }
  }
  return document;
}

Scenario ParseScenario(const TomlDocument& document, Scenario named, const std::filesystem::path& folder,
                       const std::vector<std::string>& model_overrides) {
  return document.Read([&](TomlTable root) { return ReadScenario(root, folder, model_overrides, named); });
}

Scenario ParseScenario(const std::string& text, const std::string& source,
                       const std::filesystem::path& folder, const std::vector<std::string>& overrides) {
  Scenario scenario;
  scenario.text = text;
  scenario.source = source;
  scenario.overrides = overrides;
  std::vector<std::string> model_overrides;
  const TomlDocument document = OpenScenario(text, source, overrides, &model_overrides);
  return ParseScenario(document, std::move(scenario), folder, model_overrides);
}

}  // namespace dexcheck
