#include "harness/scenario/scenario.h"

#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/base/files.h"
#include "harness/scenario/scenario_reader.h"

namespace dexcheck {
namespace {

constexpr double kMaxSteps = 1e8;
/// s. Contacts settle within some of their time constants, 2 ms each, and posture within some periods of its
/// task; whatever has not come to rest by then, never will.
constexpr double kMaxSettle = 100.0;

std::string ReadPath(TomlTable& table, std::string_view key, const std::filesystem::path& folder) {
  const auto value = table.Find(key);
  return value ? (folder / value->AsText()).lexically_normal().string() : "";
}

void ReadModel(const TomlValue& value, const std::filesystem::path& folder, Scenario* scenario) {
  TomlTable table = value.AsTable();
  scenario->model_file = ReadPath(table, "file", folder);
  for (const TomlValue& entry : table.FindList("overrides"))
    scenario->model_overrides.push_back(entry.AsText());
  scenario->own_model_overrides = scenario->model_overrides.size();
  table.RejectUnused();
}

/// "engine", or one of the rigid plants, for which the engine's keys mean nothing.
void ReadPlantType(TomlTable& table, PlantOptions* plant) {
  enum class Choice { kEngine, kRigid, kRigidEuler };
  auto choice = Choice::kEngine;
  ReadChoice<Choice>(
      table, "type",
      {{"engine", Choice::kEngine}, {"rigid", Choice::kRigid}, {"rigid_euler", Choice::kRigidEuler}},
      &choice);
  if (choice == Choice::kEngine) return;
  plant->type = PlantType::kRigid;
  if (choice == Choice::kRigidEuler) plant->integrator = Integrator::kSemiImplicitEuler;
  for (const char* key : {"contact_time_constant", "contact_impedance", "impratio", "noslip_iterations",
                          "bonded", "implicit_damping", "floor_friction", "collide"}) {
    if (const auto value = table.Find(key)) value->Reject("has no meaning for a rigid plant");
  }
}

void ReadPlant(const TomlValue& value, const std::filesystem::path& folder, Scenario* scenario) {
  constexpr long kMaxNoslipIterations = 1000;
  TomlTable table = value.AsTable();
  PlantOptions& plant = scenario->plant;
  scenario->mjcf_file = ReadPath(table, "mjcf", folder);
  ReadPlantType(table, &plant);
  using Options = PlantOptions;
  ReadKeys<Options>(
      table,
      {POSITIVE_KEY(time_step), KEY(control_step), KEY(contact_time_constant),
       POSITIVE_KEY(contact_impedance), POSITIVE_KEY(impratio), KEY(bonded), KEY(implicit_damping),
       POSITIVE_KEY(floor_friction), POSITIVE_KEY(finger_friction), KEY(collide)},
      &plant);
  const double steps = plant.control_step / plant.time_step;
  constexpr double kMostSteps = 1e6, kRounding = 1e-6;
  if (std::abs(steps - std::round(steps)) > kRounding || steps > kMostSteps)
    table.Get("control_step").Fail("must be a multiple of time_step, of at most a million");
  if (plant.contact_impedance >= 1.0) table.Get("contact_impedance").Fail("must be less than 1");
  if (const auto count = table.Find("noslip_iterations")) {
    plant.noslip_iterations = static_cast<int>(count->AsWhole(0, kMaxNoslipIterations));
  }
  for (const TomlValue& entry : table.FindList("allowed_collision_pairs")) {
    const std::vector<TomlValue> bodies = entry.AsList();
    if (bodies.size() != 2) entry.Reject("must name two bodies");
    plant.allowed_collision_pairs.emplace_back(bodies[0].AsPartName(), bodies[1].AsPartName());
  }
  table.RejectUnused();
}

/// @param of_joints whether joints follow a motion, and no object does.
void ReadExpectation(const TomlValue& value, bool of_joints, Expectation* expect) {
  TomlTable table = value.AsTable();
  using Options = Expectation;
  ReadKeys<Options>(table, {KEY(from)}, expect);
  if (!of_joints) ReadKeys<Options>(table, {POSITIVE_KEY(position)}, expect);
  const auto [angle, unit] = table.FindWithAngleUnit(of_joints ? "joints" : "orientation");
  if (angle) (of_joints ? expect->joints : expect->orientation) = unit * angle->AsPositive();
  table.RejectUnused();
}

void ReadController(const TomlValue& value, const std::filesystem::path& folder,
                    OwnControllerOptions* controller) {
  TomlTable table = value.AsTable();
  const auto run = table.Find("run");
  if (!run) value.Reject("needs \"run\": a library (.so), a Python file (.py) or a command");
  controller->run = run->AsText();
  if (controller->run.empty()) run->Fail("must be a library (.so), a Python file (.py) or a command");
  const auto own_folder = table.Find("folder");
  controller->folder = MakeAbsolute(own_folder ? folder / own_folder->AsText() : folder).lexically_normal();
  using Options = OwnControllerOptions;
  ReadKeys<Options>(table, {POSITIVE_KEY(time_limit)}, controller);
  for (const auto& [name, number] : table.GetEntries()) {
    if (name != "run" && name != "folder" && name != "time_limit")
      controller->parameters.emplace_back(name, number.AsNumber());
  }
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

void RequireFewSteps(TomlTable& root, const Scenario& scenario) {
  const double step = scenario.plant.time_step;
  if (scenario.duration < step) root.Get("duration").Fail("must be at least one time step");
  if (scenario.duration / step > kMaxSteps) root.Get("duration").Fail("must be at most 1e8 time steps");
  if (scenario.settle / step <= kMaxSteps) return;
  if (const auto settle = root.Find("settle")) settle->Fail("must be at most 1e8 time steps");
  root.Get("plant").AsTable().Get("time_step").Fail("is too small to settle in 1e8 time steps");
}

/// @param scenario text, source and overrides.
Scenario ReadScenario(TomlTable& root, const std::filesystem::path& folder,
                      const std::vector<std::string>& model_overrides, Scenario scenario) {
  root.RejectOthersThan({"name",         "description", "duration", "settle",     "start",   "start_error",
                         "tolerance",    "model",       "plant",    "grasp",      "task",    "trajectory",
                         "joint_motion", "stance",      "control",  "controller", "sensing", "actuation",
                         "disturbance",  "mismatch",    "bounds",   "expect"});
  scenario.name = root.Get("name").AsName();
  if (const auto description = root.Find("description")) scenario.description = description->AsText();
  scenario.duration = root.Get("duration").AsPositive();
  scenario.start = root.Get("start").AsChoice<Start>({{"moving", Start::kMoving}, {"rest", Start::kRest}});
  using Options = Scenario;
  ReadKeys<Options>(root, {POSITIVE_KEY(settle), KEY(tolerance)}, &scenario);
  if (scenario.settle > kMaxSettle) root.Get("settle").Fail("must be at most 100 s");
  if (scenario.tolerance >= 1.0) root.Get("tolerance").Fail("must be below 1");
  if (const auto model = root.Find("model")) ReadModel(*model, folder, &scenario);
  scenario.model_overrides.insert(scenario.model_overrides.end(), model_overrides.begin(),
                                  model_overrides.end());
  if (const auto plant = root.Find("plant")) ReadPlant(*plant, folder, &scenario);
  ReadTask(root, &scenario);
  if (const auto controller = root.Find("controller"))
    ReadController(*controller, folder, &scenario.controller);
  scenario.imperfections = ReadImperfections(root, scenario.plant.time_step);
  if (scenario.stands() && !scenario.imperfections.sensing.is_exact())
    throw InputError(scenario.source + ": sensing: a robot that stands is measured exactly");
  if (const auto bounds = root.Find("bounds")) {
    for (const auto& [name, value] : bounds->AsTable().GetEntries()) {
      scenario.bounds.emplace_back(name, value.AsNotNegative());
    }
    if (!scenario.overrides.empty()) scenario.written = ReadWritten(scenario.text, scenario.source, folder);
  }
  if (const auto expect = root.Find("expect")) {
    ReadExpectation(*expect, scenario.joint_task() != nullptr, &scenario.expect);
  }
  RequireFewSteps(root, scenario);
  return scenario;
}

}  // namespace

std::vector<std::string> NameController(const std::string& run, const std::filesystem::path& folder) {
  return {"controller.run=" + QuoteToml(run),
          "controller.folder=" + QuoteToml(MakeAbsolute(folder).lexically_normal().string())};
}

bool IsOfModel(std::string_view assignment) {
  return assignment.starts_with("model.") && !assignment.starts_with("model.file=") &&
         !assignment.starts_with("model.overrides");
}

ScenarioDocument::ScenarioDocument(const std::string& text, const std::string& source,
                                   std::filesystem::path folder)
    : document_(text, source), text_(text), source_(source), folder_(std::move(folder)) {}

void ScenarioDocument::Override(const std::string& assignment) {
  if (IsOfModel(assignment)) {
    model_overrides_.push_back(assignment.substr(std::string_view("model.").size()));
  } else {
    document_.Override(assignment);
  }
  overrides_.push_back(assignment);
}

void ScenarioDocument::Set(const std::string& path, double value) {
  const std::string assignment = path + "=" + FormatNumber(value);
  if (IsOfModel(assignment)) return Override(assignment);
  document_.Set(path, value);
  overrides_.push_back(assignment);
}

Scenario ScenarioDocument::Read() const {
  Scenario scenario;
  scenario.text = text_;
  scenario.source = source_;
  scenario.overrides = overrides_;
  return document_.Read(
      [&](TomlTable root) { return ReadScenario(root, folder_, model_overrides_, scenario); });
}

Scenario ParseScenario(const std::string& text, const std::string& source,
                       const std::filesystem::path& folder, const std::vector<std::string>& overrides) {
  ScenarioDocument document(text, source, folder);
  for (const std::string& assignment : overrides) document.Override(assignment);
  return document.Read();
}

double ReadNumber(const TomlValue& value, Range range) {
  if (range == Range::kAny) return value.AsNumber();
  return range == Range::kPositive ? value.AsPositive() : value.AsNotNegative();
}

void ReadValue(const TomlValue& value, Range range, double* target) { *target = ReadNumber(value, range); }

void ReadValue(const TomlValue& value, Range range, std::optional<double>* target) {
  *target = ReadNumber(value, range);
}

void ReadValue(const TomlValue& value, Range /*range*/, bool* target) { *target = value.AsFlag(); }

void ReadValue(const TomlValue& value, Range range, ByName* target) {
  target->key = value.path();
  if (!value.IsTable()) {
    target->all = ReadNumber(value, range);
    return;
  }
  for (const auto& [name, entry] : value.AsTable().GetEntries()) {
    target->groups.emplace_back(name, ReadNumber(entry, range));
  }
}

void ReadValue(const TomlValue& value, Range /*range*/, Vector3d* target) { *target = value.AsVector<3>(); }

void ReadValue(const TomlValue& value, Range /*range*/, std::vector<std::string>* target) {
  for (const TomlValue& entry : value.AsList()) target->push_back(entry.AsPartName());
}

}  // namespace dexcheck
