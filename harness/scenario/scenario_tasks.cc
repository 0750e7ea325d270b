#include <cmath>
#include <limits>
#include <string>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/object/so3.h"
#include "harness/scenario/scenario_reader.h"

namespace dexcheck {
namespace {

/// Position and ZYZ angles; what is missing stays as it is.
void ReadPlace(TomlTable& table, Pose* pose) {
  if (const auto xyz = table.Find("xyz")) pose->translation() = xyz->AsVector<3>();
  if (const auto zyz = table.FindAngles<3>("zyz")) pose->linear() = CalcRotationZyz(*zyz);
}

// ----- [grasp] and [control] of what holds an object

void ReadContacts(TomlTable& table, GraspOptions* grasp) {
  const TomlValue contacts = table.Get("contacts_deg");
  for (const TomlValue& entry : contacts.AsList()) {
    // On the torus: u around its axis, v around its tube. What they mean on the object is found with its
    // surface.
    const Vector2d degrees = entry.AsVector<2>();
    grasp->contacts.push_back({DegToRad(degrees[0]), DegToRad(degrees[1]), 0});
  }
  if (grasp->contacts.size() != grasp->fingertips.size()) {
    contacts.Reject("must have one contact for each of the " + std::to_string(grasp->fingertips.size()) +
                    " fingertips");
  }
  ReadPlace(table, &grasp->X_FO);
}

void ReadGrasp(const TomlValue& value, GraspOptions* grasp) {
  TomlTable table = value.AsTable();
  const TomlValue fingertips = table.Get("fingertips");
  ReadValue(fingertips, Range::kAny, &grasp->fingertips);
  if (grasp->fingertips.size() < 3) fingertips.Reject("needs at least three fingertips to hold an object");
  ReadContacts(table, grasp);
  grasp->frame = table.Get("frame").AsPartName();
  if (const auto pole = table.Find("hemisphere")) {
    grasp->hemisphere = pole->AsVector<3>();
    if (!(grasp->hemisphere->norm() > 0.0)) pole->Fail("must have a direction");
    grasp->hemisphere->normalize();
  }
  if (const auto joints = table.Find("joints_deg")) {
    for (const auto& [name, angle] : joints->AsTable().GetEntries()) {
      grasp->joints.emplace_back(name, DegToRad(angle.AsNumber()));
    }
  }
  table.RejectUnused();
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
void ReadWeight(TomlTable& control_table, ControlOptions* control) {
  const auto value = control_table.Find("weight");
  if (!value) return;
  if (value->IsText()) {
    control->weight = value->AsChoice<RedundancyWeight::Kind>(
        {{"identity", RedundancyWeight::Kind::kIdentity}, {"mass", RedundancyWeight::Kind::kMass}});
    return;
  }
  control->weight = RedundancyWeight::Kind::kDiagonal;
  TomlTable table = value->AsTable();
  ReadKeys<ControlOptions>(table,
                           {{"platform", &ControlOptions::platform_weight, Range::kPositive},
                            {"arm", &ControlOptions::arm_weight, Range::kPositive}},
                           control);
  table.RejectUnused();
}

std::pair<std::string_view, ControlLaw> Named(ControlLaw law) { return {NameOf(law), law}; }

/// @param laws that the task can have.
void ReadLaw(TomlTable& table, std::initializer_list<std::pair<std::string_view, ControlLaw>> laws,
             ControlOptions* control) {
  const auto law = table.Find("law");
  control->names_law = law.has_value();
  if (law) control->law = law->AsChoice(laws);
}

/// The law, and the stiffness and damping of those that have them.
void ReadLaw(TomlTable& table, ControlOptions* control) {
  using Law = ControlLaw;
  ReadLaw(table,
          {Named(Law::kComputedTorque), Named(Law::kPdGravity), Named(Law::kFeedforwardPd),
           Named(Law::kOperationalSpace), Named(Law::kImpedance)},
          control);
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

void ReadControl(const TomlValue& value, const Scenario& scenario, ControlOptions* control) {
  TomlTable table = value.AsTable();
  ReadLaw(table, control);
  ReadGains(table, &control->gains);
  ReadChoice<OrientationFeedback>(
      table, "orientation",
      {{"angles", OrientationFeedback::kAngles}, {"rotation", OrientationFeedback::kRotation}},
      &control->orientation);
  ReadWeight(table, control);
  control->f_max = table.Get("f_max").AsPositive();
  control->mu = table.Get("mu").AsPositive();
  using Options = ControlOptions;
  ReadKeys<Options>(table, {KEY(posture_frequency), KEY(f_min)}, control);
  if (control->f_max <= control->f_min) table.Get("f_max").Fail("must be greater than f_min");
  ReadChoice<ContactSource>(table, "kappa",
                            {{"exact", ContactSource::kExact}, {"integrated", ContactSource::kIntegrated}},
                            &control->kappa);
  if (control->kappa == ContactSource::kIntegrated) {
    if (scenario.pick_task() != nullptr) table.Get("kappa").Reject("contacts of a task come and go");
    if (scenario.plant.bonded) table.Get("kappa").Reject("bonds do not roll");
  }
  if (const auto [error, unit] = table.FindWithAngleUnit("contact_error"); error) {
    control->contact_error = unit * error->AsNumber();
  }
  table.RejectUnused();
}

// ----- [task]

PickTask ReadPickTask(const TomlValue& value) {
  TomlTable table = value.AsTable();
  PickTask task;
  PickAndPlaceOptions& pick = task.pick_and_place;
  (void)table.Get("xyz");
  ReadPlace(table, &task.X_Bo);
  if (const auto joints = table.Find("arm_joints")) ReadValue(*joints, Range::kAny, &task.arm_joints);
  using Options = PickAndPlaceOptions;
  pick.raise.z() = pick.plan.raise = table.Get("raise").AsPositive();
  pick.transport = pick.plan.transport = table.Get("transport").AsVector<3>();
  ReadKeys<Options>(table,
                    {POSITIVE_KEY(approach_time), POSITIVE_KEY(lower_time), POSITIVE_KEY(close_time),
                     POSITIVE_KEY(search_speed), POSITIVE_KEY(grip_time), POSITIVE_KEY(take_over_time),
                     POSITIVE_KEY(raise_time), POSITIVE_KEY(arm_rate), POSITIVE_KEY(transport_time),
                     POSITIVE_KEY(touch_force), POSITIVE_KEY(overload), POSITIVE_KEY(largest_push)},
                    &pick);
  if (const auto opening = table.Find("opening")) pick.plan.opening = opening->AsPositive();
  constexpr long kMaxAttempts = 10;
  if (const auto attempts = table.Find("attempts")) {
    pick.attempts = static_cast<int>(attempts->AsWhole(1, kMaxAttempts));
  }
  table.RejectUnused();
  return task;
}

/// @throws InputError for the first of the problems, "KEY: WHAT", that there is.
void Refuse(const Scenario& scenario, std::initializer_list<std::pair<bool, const char*>> problems) {
  for (const auto& [is_there, problem] : problems) {
    if (is_there) throw InputError(scenario.source + ": " + problem);
  }
}

/// Copies what the task takes from the rest of the scenario. @throws InputError when that does not fit.
void FinishPickTask(const Scenario& scenario, PickTask* task) {
  Refuse(scenario, {{scenario.start != Start::kRest, "start: must be \"rest\" for a task"},
                    {scenario.plant.type != PlantType::kEngine,
                     "plant.type: a task needs contacts that open and close, which a rigid plant has not"},
                    {scenario.control.law != ControlLaw::kComputedTorque,
                     "control.law: a task is done by \"computed_torque\""},
                    {scenario.plant.bonded, "plant.bonded: a task needs contacts that open and close"},
                    {scenario.plant.control_step > scenario.plant.time_step,
                     "plant.control_step: a task decides at every time step"},
                    {scenario.control.orientation != OrientationFeedback::kRotation,
                     "control.orientation: must be \"rotation\" for a task"}});
  PickAndPlaceOptions& pick = task->pick_and_place;
  pick.f_min = scenario.control.f_min;
  pick.posture_frequency = scenario.control.posture_frequency;
  pick.plan.mu = scenario.control.mu;
  pick.plan.X_Po = scenario.grasp.X_FO;
}

// ----- [joint_motion], with its [control]

/// Numbers by joint under `key` (rad, m) or `key`_deg; none when it is missing.
JointNumbers ReadJointNumbers(TomlTable& table, const std::string& key) {
  JointNumbers numbers;
  const auto [value, unit] = table.FindWithAngleUnit(key);
  if (!value) return numbers;
  numbers.key = value->path();
  numbers.in_degrees = unit != 1.0;
  for (const auto& [name, number] : value->AsTable().GetEntries()) {
    numbers.by_name.emplace_back(name, unit * number.AsNumber());
  }
  return numbers;
}

/// Reads way points, each after the one before. @param read makes one at a time.
template <typename Point, typename Read>
void ReadPoints(TomlTable& table, const Read& read, std::vector<Point>* points) {
  for (const TomlValue& entry : table.FindList("points")) {
    TomlTable point = entry.AsTable();
    const TomlValue time = point.Get("time");
    if (time.AsPositive() <= (points->empty() ? 0.0 : points->back().time))
      time.Fail("must be greater than the time before");
    points->push_back(read(point, time.AsPositive()));
    point.RejectUnused();
  }
}

/// Amplitude, frequency and ramp. @param missing the amplitude's key, where it has none.
/// @return the amplitude's unit: 1, or that of degrees.
double ReadSine(const char* missing, TomlTable* table, JointOscillation* one) {
  auto [amplitude, unit] = table->FindWithAngleUnit("amplitude");
  if (!amplitude) amplitude = table->Miss(missing);
  one->amplitude = unit * amplitude->AsNumber();
  const TomlValue frequency = table->Get("frequency");
  one->frequency = frequency.AsPositive();
  // The acceleration has the square of the rate 2 pi f.
  const double rate = 2.0 * kPi * one->frequency;
  if (!std::isfinite(one->amplitude * rate * rate)) frequency.Fail("must not be so large");
  if (const auto time = table->Find("ramp_time")) one->ramp_time = time->AsNotNegative();
  if (const auto time = table->Find("end_time")) {
    one->end_time = time->AsNotNegative();
    if (one->end_time > 0.0 && one->end_time < 2.0 * one->ramp_time)
      time->Fail("must be two ramp_times or 0");
  }
  table->RejectUnused();
  return unit;
}

JointTask::Oscillation ReadOscillation(const TomlValue& value) {
  TomlTable table = value.AsTable();
  JointTask::Oscillation one;
  one.name = table.Get("joint").AsPartName();
  one.key = value.path();
  one.in_degrees = ReadSine("amplitude_deg", &table, &one) != 1.0;
  return one;
}

JointTask ReadJointMotion(const TomlValue& value) {
  TomlTable table = value.AsTable();
  JointTask task;
  task.start = ReadJointNumbers(table, "start");
  const auto read = [](TomlTable& point, double time) -> JointTask::Point {
    JointNumbers joints = ReadJointNumbers(point, "joints");
    if (joints.key.empty()) point.Miss("joints_deg");
    return {time, std::move(joints)};
  };
  ReadPoints(table, read, &task.points);
  for (const TomlValue& entry : table.FindList("oscillations"))
    task.oscillations.push_back(ReadOscillation(entry));
  table.RejectUnused();
  return task;
}

constexpr std::string_view kAxes[] = {"x", "y", "z", "roll", "pitch", "yaw"};

JointOscillation ReadStanceOscillation(const TomlValue& value) {
  TomlTable table = value.AsTable();
  JointOscillation one;
  one.joint = table.Get("axis").AsChoice<int>(
      {{kAxes[0], 0}, {kAxes[1], 1}, {kAxes[2], 2}, {kAxes[3], 3}, {kAxes[4], 4}, {kAxes[5], 5}});
  const bool turns = one.joint >= 3;
  if (const auto angle = table.Find("amplitude_deg"); angle && !turns)
    angle->Fail("must be in m, under the key without _deg");
  ReadSine(turns ? "amplitude_deg" : "amplitude", &table, &one);
  return one;
}

StanceTask ReadStance(const TomlValue& value) {
  TomlTable table = value.AsTable();
  StanceTask task;
  const TomlValue feet = table.Get("feet");
  ReadValue(feet, Range::kAny, &task.feet);
  if (task.feet.size() < 3) feet.Reject("needs at least three feet, or corners of feet, to stand on");
  using Options = StanceTask;
  (void)table.Get("mu");
  (void)table.Get("f_max");
  ReadKeys<Options>(table, {POSITIVE_KEY(mu), KEY(f_min), POSITIVE_KEY(f_max)}, &task);
  if (task.f_max <= task.f_min) table.Get("f_max").Fail("must be greater than f_min");
  const auto read = [](TomlTable& point, double time) -> JointWayPoint {
    return {time, ReadCoordinates(point, "xyz", "rpy")};
  };
  ReadPoints(table, read, &task.points);
  for (const TomlValue& entry : table.FindList("oscillations"))
    task.oscillations.push_back(ReadStanceOscillation(entry));
  table.RejectUnused();
  return task;
}

void ReadJointControl(const TomlValue& value, ControlOptions* control, JointTask* task) {
  TomlTable table = value.AsTable();
  using Law = ControlLaw;
  ReadLaw(table, {Named(Law::kComputedTorque), Named(Law::kPdGravity), Named(Law::kFeedforwardPd)}, control);
  // Nothing is X_o here.
  control->orientation = OrientationFeedback::kRotation;
  (void)table.Get("natural_frequency");
  (void)table.Get("damping_ratio");
  for (const char* key : {"stiffness", "damping"}) {
    const auto value_of_key = table.Find(key);
    if (value_of_key && control->law == ControlLaw::kComputedTorque) {
      value_of_key->Reject("has no meaning for the law " + Quote(NameOf(control->law)));
    }
  }
  // A joint that no name fits has no number, which the setup refuses.
  for (ByName* numbers : {&task->natural_frequency, &task->damping_ratio, &task->stiffness, &task->damping}) {
    numbers->all = std::numeric_limits<double>::quiet_NaN();
  }
  using Options = JointTask;
  ReadKeys<Options>(table,
                    {KEY(natural_frequency), KEY(damping_ratio), KEY(stiffness), KEY(damping), KEY(coulomb),
                     KEY(viscous), POSITIVE_KEY(coulomb_velocity)},
                    task);
  table.RejectUnused();
}

}  // namespace

void ReadTask(TomlTable& root, Scenario* scenario) {
  root.RejectTogether("task", {"trajectory", "start_error"});
  const auto pick = root.Find("task");
  if (pick) scenario->task = ReadPickTask(*pick);
  root.RejectTogether("joint_motion", {"grasp", "task", "trajectory", "start_error"});
  root.RejectTogether("stance", {"grasp", "task", "trajectory", "start_error"});
  if (const auto motion = root.Find("joint_motion")) {
    JointTask task = ReadJointMotion(*motion);
    ReadJointControl(root.Get("control"), &scenario->control, &task);
    if (const auto stance = root.Find("stance")) task.stance = ReadStance(*stance);
    const bool moves = !task.points.empty() || !task.oscillations.empty();
    const bool stands = task.stance.has_value();
    scenario->task = std::move(task);
    return Refuse(
        *scenario,
        {{scenario->start != Start::kRest, "start: must be \"rest\" for a motion of joints"},
         {stands && moves, "joint_motion: joints of a robot that stands follow its body ([stance])"},
         {stands && scenario->plant.type != PlantType::kEngine,
          "plant.type: feet need contacts that hold and slip, which a rigid plant has not"},
         {scenario->plant.bonded, "plant.bonded: a motion of joints has no contacts"}});
  }
  // All that are missing are named together.
  const TomlValue grasp = root.Get("grasp");
  const TomlValue control = root.Get("control");
  const auto trajectory = pick ? std::nullopt : std::optional(root.Get("trajectory"));
  ReadGrasp(grasp, &scenario->grasp);
  ReadControl(control, *scenario, &scenario->control);
  if (auto* const task = std::get_if<PickTask>(&scenario->task)) return FinishPickTask(*scenario, task);
  TrajectoryTask task;
  if (const auto error = root.Find("start_error")) {
    TomlTable table = error->AsTable();
    task.start_error = ReadCoordinates(table, "xyz", "zyz");
    table.RejectUnused();
  }
  TomlTable table = trajectory->AsTable();
  task.trajectory = ReadTrajectory(table);
  scenario->task = std::move(task);
}

}  // namespace dexcheck
