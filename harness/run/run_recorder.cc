#include "harness/run/run_recorder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <set>
#include <utility>

#include "harness/base/files.h"
#include "harness/base/version.h"
#include "harness/engine/engine.h"
#include "harness/engine/machine.h"
#include "harness/engine/mjcf_file.h"
#include "harness/run/own_controller.h"

namespace dexcheck {
namespace {

using Row = std::span<double>;

/// Writes a number, a list, or a vector or matrix expression, into a row.
void Put(double from, Row to) { to[0] = from; }
void Put(const std::vector<double>& from, Row to) { std::ranges::copy(from, to.begin()); }
template <typename Derived>
void Put(const Eigen::DenseBase<Derived>& from, Row to) {
  Eigen::Map<VectorXd>(to.data(), static_cast<Eigen::Index>(to.size())) = from.derived();
}

/// "NAME.PART" for each of the names and parts.
std::vector<std::string> Expand(const std::vector<std::string>& names,
                                std::initializer_list<const char*> parts) {
  std::vector<std::string> columns;
  for (const std::string& name : names) {
    for (const char* part : parts) columns.push_back(name + "." + part);
  }
  return columns;
}

/// A number or a vector of the step.
template <typename Get>
auto Of(Get get) {
  return [get](const StepRecord& step, Row row) { Put(get(step), row); };
}
// The step's member of this name, or what one of its members returns.
#define STEP(member) Of([](const StepRecord& step) -> decltype(auto) { return (step.member); })

/// The law's demand, which a controller of the user's own need not have.
template <typename Member>
auto Demand(Member LawDemand::*member) {
  return [member](const StepRecord& step, Row row) {
    const Member& demand = step.command.demand.*member;
    if (demand.size() == static_cast<Eigen::Index>(row.size())) return Put(demand, row);
    std::fill(row.begin(), row.end(), std::numeric_limits<double>::quiet_NaN());
  };
}

/// Writes a number or a vector for each entry of a list of the step, one after the other.
template <typename List, typename Get>
auto Each(List list, Get get) {
  return [list, get](const StepRecord& step, Row row) {
    const auto& entries = list(step);
    for (size_t i = 0; i < entries.size(); ++i) {
      const size_t width = row.size() / entries.size();
      Put(std::invoke(get, entries[i]), row.subspan(width * i, width));
    }
  };
}

const std::vector<PlantContact>& ListContacts(const StepRecord& step) { return step.response.contacts; }
const std::vector<ContactCoordinates>& ListKappa(const StepRecord& step) { return step.reading.state.kappa; }
const std::vector<ContactCoordinates>& ListFollowed(const StepRecord& step) { return step.followed_kappa; }
Vector5d ReadKappa(const ContactCoordinates& kappa) { return kappa.CalcVector(); }
Vector2d ReadCharts(const ContactCoordinates& kappa) {
  return {static_cast<double>(kappa.alpha_f.chart), static_cast<double>(kappa.alpha_o.chart)};
}

constexpr const char* kPoseUnits = "m, m, m, rad, rad, rad";

/// "m, m, rad"; one alone when all are the same.
std::string JoinUnits(const std::vector<std::string>& units) {
  if (units.empty()) return "1";
  const bool are_same = std::ranges::all_of(units, [&](const auto& unit) { return unit == units.front(); });
  return are_same ? units.front() : fmt::format("{}", fmt::join(units, ", "));
}

struct LogColumns {
  std::vector<std::string> names;
  std::string units;  ///< As JoinUnits has them.
};

/// Columns of what MuJoCo's joints have: "JOINT", of a free joint "JOINT" with the endings of its place and
/// turn, of a ball joint with those of its turn. @param per "" for positions, "/s" for velocities.
LogColumns ListColumns(const mjModel& model, const std::vector<std::string>& places,
                       const std::vector<std::string>& turns, const std::string& turn_unit,
                       const std::string& per) {
  LogColumns columns;
  std::vector<std::string> units;
  for (int joint = 0; joint < model.njnt; ++joint) {
    const auto add = [&](const std::vector<std::string>& endings, const std::string& unit) {
      for (const std::string& ending : endings) {
        columns.names.push_back(NameOf(model, mjOBJ_JOINT, joint) + ending);
        units.push_back(unit);
      }
    };
    const int type = model.jnt_type[joint];
    if (type == mjJNT_FREE) add(places, "m" + per);
    if (type == mjJNT_FREE || type == mjJNT_BALL) add(turns, turn_unit);
    if (type == mjJNT_HINGE || type == mjJNT_SLIDE) add({""}, (type == mjJNT_HINGE ? "rad" : "m") + per);
  }
  columns.units = JoinUnits(units);
  return columns;
}

/// Units of quantities of the base's coordinates followed by the joints'.
/// @param base of the base's coordinates. @param per "" for positions, "/s" for velocities, "/s^2" for
/// accelerations.
std::string ListJointUnits(const RobotModel& model, const std::vector<std::string>& base, const char* per) {
  std::vector<std::string> units;
  std::ranges::transform(base, std::back_inserter(units), [&](const auto& unit) { return unit + per; });
  for (const Joint& joint : model.joints()) {
    units.push_back((joint.type == JointType::kRevolute ? "rad" : "m") + std::string(per));
  }
  return JoinUnits(units);
}

}  // namespace

RunRecorder::RunRecorder(const std::filesystem::path& path, const ClosedLoop& loop, const Setup& setup,
                         const RunInputs& inputs)
    : setup_(&setup), checks_(loop.is_checking() ? &loop.checks() : nullptr), log_(path, loop.num_steps()) {
  const Scenario& scenario = setup.scenario();
  std::string overrides;
  for (const std::string& assignment : scenario.overrides) overrides += assignment + "\n";
  log_.SetText("command", inputs.command);
  if (const OwnControllerOptions& own = scenario.controller; own.exists()) {
    log_.SetText("controller", own.run);
    log_.SetText("controller_folder", own.folder.string());
    log_.SetText("controller_hash", HashController(own));
  }
  log_.SetText("scenario", scenario.name);
  log_.SetText("overrides", overrides);
  log_.SetText("seed", std::to_string(scenario.seed));
  log_.SetText("robot", inputs.robot.filename().string());
  log_.SetText("mjcf", inputs.mjcf.filename().string());
  const int object = setup.adapter().object_body();
  log_.SetText("object_body", object >= 0 ? NameOf(setup.engine(), mjOBJ_BODY, object) : "");
  log_.SetText("mujoco_version", mj_versionString());
  log_.SetText("engine_settings", DescribeSettings(setup.engine(), scenario.plant.implicit_damping
                                                                       ? setup.engine().opt.integrator
                                                                       : mjINT_EULER));
  log_.SetText("dexcheck_version", Version());
  log_.SetText("git_revision", kGitRevision);
  log_.SetText("check_kinds", "0 model, 1 inverse_dynamics, 2 forward_dynamics, 3 assumption, 4 law");
  log_.SetText("machine", DescribeMachine());
  log_.EmbedFile("inputs", "scenario.toml", scenario.text);
  log_.EmbedFile("inputs", "robot/" + inputs.robot.filename().string(), ReadBytes(inputs.robot));
  for (const std::string& file : ListMjcfFiles(inputs.mjcf)) {
    log_.EmbedFile("inputs", "mjcf/" + file, ReadBytes(inputs.mjcf.parent_path() / file, kMostData));
  }
  AddStateSignals();
  if (setup.joints() != nullptr) {
    AddJointSignals();
  } else {
    AddObjectSignals();
    AddContactSignals();
  }
  if (loop.task() != nullptr) AddTaskSignals();
  if (checks_ != nullptr) AddCheckSignals();
  log_.StartRows();
}

void RunRecorder::Add(const std::string& name, const std::string& unit, const std::string& description,
                      std::vector<std::string> columns, Source source,
                      std::map<std::string, double> numbers) {
  const int width = std::max(1, static_cast<int>(columns.size()));
  const int signal = log_.AddSignal({name, unit, description, width, std::move(columns), std::move(numbers)});
  channels_.push_back({signal, std::move(source)});
}

void RunRecorder::AddStateSignals() {
  const RobotModel& model = setup_->model();
  const mjModel& m = setup_->engine();
  std::vector<std::string> q_names, xi_names, tau_names;
  std::vector<std::string> q_base, xi_base;  // units of the base's coordinates
  if (model.num_base_positions() == 3) {
    q_names = {"x_c", "y_c", "phi"};
    q_base = {"m", "m", "rad"};
  }
  if (model.num_base_velocities() == 3) {
    xi_names = tau_names = {"x_dot", "y_dot", "phi_dot"};
    xi_base = q_base;
  }
  if (model.num_base_velocities() == 2) {
    const bool is_twist = model.base().velocity == DriveVelocity::kTwist;
    xi_names = {is_twist ? "v_c" : "theta_dot_r", is_twist ? "w_c" : "theta_dot_l"};
    xi_base = {is_twist ? "m" : "rad", "rad"};
  }
  if (model.base().type == BaseType::kFloating) {
    q_names = {"x", "y", "z", "qw", "qx", "qy", "qz"};
    xi_names = tau_names = {"v_x", "v_y", "v_z", "w_x", "w_y", "w_z"};
  }
  for (const EngineWheel& wheel : setup_->adapter().wheels()) {
    tau_names.push_back(NameOf(m, mjOBJ_JOINT, wheel.joint));
  }
  for (const Joint& joint : model.joints()) {
    for (auto* names : {&q_names, &xi_names, &tau_names}) names->push_back(joint.name);
  }
  // Units of a floating base's coordinates do not stand one by one.
  const bool is_named = model.base().type != BaseType::kFloating;
  const std::string q_units = is_named ? ListJointUnits(model, q_base, "") : "m, rad";
  const std::string xi_units = is_named ? ListJointUnits(model, xi_base, "/s") : "m/s, rad/s";
  const std::string xi_dot_units = is_named ? ListJointUnits(model, xi_base, "/s^2") : "m/s^2, rad/s^2";
  const LogColumns qpos = ListColumns(m, {".x", ".y", ".z"}, {".qw", ".qx", ".qy", ".qz"}, "1", "");
  const LogColumns qvel = ListColumns(m, {".v_x", ".v_y", ".v_z"}, {".w_x", ".w_y", ".w_z"}, "rad/s", "/s");
  const bool moves_joints = setup_->joints() != nullptr;
  Add("engine/qpos", qpos.units, "MuJoCo's positions, quaternions wxyz", qpos.names, STEP(reading.qpos));
  Add("engine/qvel", qvel.units, "MuJoCo's velocities", qvel.names, STEP(reading.qvel));
  Add("q", q_units, "q' as read from the plant", q_names, STEP(reading.state.q));
  Add("xi", xi_units, "reduced velocity as read from the plant", xi_names, STEP(reading.state.xi));
  Add("tau", "N m", moves_joints ? "torques of the joints' law" : "tau' of the computed torque law (55)",
      tau_names, STEP(command.tau));
  if (setup_->scenario().pick_task() == nullptr) {
    Add("law/xi_dot_d", xi_dot_units,
        moves_joints ? "accelerations that the law demands" : "xi_dot_d of (47), which the law demands",
        xi_names, Demand(&LawDemand::xi_dot));
  }
  if (!setup_->scenario().imperfections.is_ideal()) {
    Add("measured/q", q_units, "measured q'", q_names, STEP(measured.state.q));
    Add("measured/xi", xi_units, "measured reduced velocity", xi_names, STEP(measured.state.xi));
    Add("tau_given", "N m", "what the motors made of tau", tau_names, STEP(drive.tau));
  }
  Add("base/tilt", "rad", "angle of the platform against the vertical", {}, STEP(reading.departure.tilt));
  Add("base/height", "m", "height of the axle's midpoint against the model's", {},
      STEP(reading.departure.height));
  if (checks_ == nullptr) return;
  Add("engine/contacts", "1", "contacts of the engine", {}, STEP(response.contact_count));
  Add("engine/constraint_rows", "1",
      "rows of the engine's constraints: contacts, limits, bonds, dry friction", {},
      STEP(response.constraint_rows));
  Add("engine/xi_dot", xi_dot_units, "reduced acceleration of the plant", xi_names, STEP(response.xi_dot));
  Add("model/xi_dot", xi_dot_units,
      moves_joints ? "accelerations that the equations of motion predict"
                   : "reduced acceleration that (46), (48) predict",
      xi_names, STEP(findings.xi_dot_model));
}

void RunRecorder::AddJointSignals() {
  const RobotModel& model = setup_->model();
  std::vector<std::string> names, base;
  if (model.base().type == BaseType::kFloating) {
    names = {"x", "y", "z", "qw", "qx", "qy", "qz"};
    base = {"m", "m", "m", "1", "1", "1", "1"};
  }
  for (const Joint& joint : model.joints()) names.push_back(joint.name);
  Add("joints/q_d", ListJointUnits(model, base, ""), "desired positions of the joints", names,
      STEP(command.joints.q));
  Add("joints/error", ListJointUnits(model, base, ""), "q_d - q", names,
      [](const StepRecord& step, Row row) { Put(step.command.joints.q - step.reading.state.q, row); });
  Add("joints/largest_error", "rad, m", "largest of joints/error", {}, STEP(error.joints));
  if (!setup_->feet().empty()) AddFootSignals();
}

void RunRecorder::AddFootSignals() {
  const std::vector<std::string>& feet = setup_->scenario().joint_task()->stance->feet;
  const std::vector<std::string> xyz = Expand(feet, {"x", "y", "z"});
  Add("law/foot_force", "N", "forces that the law asks of the ground, world axes", xyz,
      Demand(&LawDemand::f_c));
  if (checks_ == nullptr) return;
  Add("foot/force", "N", "forces of the ground on the feet, world axes", xyz, STEP(findings.foot_force));
  Add("foot/force_model", "N", "those of the robot on rigid feet", xyz, STEP(findings.foot_force_model));
  AddSlips("foot", "foot", feet, &StepFindings::foot_slip);
}

void RunRecorder::AddObjectSignals() {
  const std::vector<std::string> pose = {"x", "y", "z", "alpha", "beta", "gamma"};
  Add("object/X_o", kPoseUnits, "pose of the object, ZYZ angles (8)", pose, Of(CalcX_o));
  Add("object/X_d", kPoseUnits, "desired pose of the object", pose, STEP(command.desired.X_d));
  Add("object/V", "m/s, m/s, m/s, rad/s, rad/s, rad/s", "body velocity of the object",
      {"v_x", "v_y", "v_z", "w_x", "w_y", "w_z"}, STEP(reading.state.V_Bo));
  Add("object/error", "m", "X_d - X_o, position", {"x", "y", "z"}, STEP(error.position));
  Add("object/position_error", "m", "distance of the object from its desired place", {},
      STEP(error.position.norm()));
  Add("object/orientation_error", "rad", "angle between the object and its desired orientation", {},
      STEP(error.orientation));
}

void RunRecorder::AddContactSignals() {
  const std::vector<std::string>& tips = setup_->scenario().grasp.fingertips;
  const std::map<std::string, double> mu = {{"mu", setup_->object().friction}};
  const std::vector<std::string> xyz = Expand(tips, {"x", "y", "z"});
  Add("contact/kappa", "rad", "contact coordinates (39)", Expand(tips, {"u_f", "v_f", "u_o", "v_o", "psi"}),
      Each(ListKappa, ReadKappa));
  Add("contact/chart", "1",
      "chart of the fingertip's (u_f, v_f) and of the object's (u_o, v_o) of contact/kappa",
      Expand(tips, {"f", "o"}), Each(ListKappa, ReadCharts));
  if (setup_->scenario().control.kappa == ContactSource::kIntegrated) AddFollowedContacts();
  Add("contact/overlap", "m", "depth to which fingertip and object overlap", tips,
      STEP(reading.state.overlap));
  if (setup_->scenario().pick_task() == nullptr) {
    Add("law/f_c", "N", "f_c of (49), which the law commands, each in its contact frame", xyz,
        Demand(&LawDemand::f_c), mu);
    Add("law/F_N", "N", "internal part F_N of law/f_c, which the grasp-force problem chooses", xyz,
        Demand(&LawDemand::F_N));
  }
  if (checks_ == nullptr) return;
  Add("contact/position", "m", "contact points in the world", xyz,
      Each(ListContacts, &PlantContact::position));
  Add("contact/normal", "1", "normals in the world, into the object", xyz,
      Each(ListContacts, &PlantContact::normal));
  Add("contact/force", "N", "forces of finger on object in the world", xyz,
      Each(ListContacts, &PlantContact::force), mu);
  Add("contact/f_c", "N", "f_c of the engine, each in its contact frame, z into the object", xyz,
      STEP(findings.f_c), mu);
  Add("contact/f_c_model", "N", "f_c that (19), (46), (48) predict", xyz, STEP(findings.f_c_model), mu);
  AddSlips("contact", "fingertip", tips, &StepFindings::fingertip_slip);
  std::vector<std::string> wheels;
  for (const EngineWheel& wheel : setup_->adapter().wheels())
    wheels.push_back(NameOf(setup_->engine(), mjOBJ_JOINT, wheel.joint));
  if (!wheels.empty()) AddSlips("wheel", "wheel", wheels, &StepFindings::wheel_slip);
}

void RunRecorder::AddSlips(const std::string& group, const std::string& what,
                           const std::vector<std::string>& parts,
                           std::vector<SlipState> StepFindings::*states) {
  const auto list = [states](const StepRecord& step) -> const auto& { return step.findings.*states; };
  Add(group + "/slip", "m", "slip of each " + what + " since t = 0", Expand(parts, {"x", "y", "z"}),
      Each(list, &SlipState::distance));
  Add(group + "/cone_use", "1", "tangential force over mu times normal force of each " + what, parts,
      Each(list, &SlipState::cone_use));
}

void RunRecorder::AddFollowedContacts() {
  const std::vector<std::string>& tips = setup_->scenario().grasp.fingertips;
  Add("law/kappa", "rad", "contact coordinates (39) that the law follows by (40) from t = 0",
      Expand(tips, {"u_f", "v_f", "u_o", "v_o", "psi"}), Each(ListFollowed, ReadKappa));
  Add("law/chart", "1", "charts of law/kappa, as contact/chart", Expand(tips, {"f", "o"}),
      Each(ListFollowed, ReadCharts));
  const auto add = [&](const char* name, const char* unit, const char* what, double ContactDrift::*member) {
    Add(name, unit, what, tips,
        Each(
            [](const StepRecord& step) -> const auto& { return step.drift; }, member));
  };
  add("contact/drift_object", "m", "distance of law/kappa's points on the object from contact/kappa's",
      &ContactDrift::object);
  add("contact/drift_fingertip", "m", "of the points on the fingertips, integrated",
      &ContactDrift::fingertip);
  add("contact/drift_psi", "rad", "psi of law/kappa against contact/kappa's", &ContactDrift::psi);
}

void RunRecorder::AddTaskSignals() {
  std::string phases;
  for (int i = 0; i <= static_cast<int>(Phase::kDone); ++i) {
    phases += (i > 0 ? ", " : "") + std::to_string(i) + " " + NameOf(static_cast<Phase>(i));
  }
  Add("task/phase", "1", "phase of the task: " + phases, {}, STEP(command.task.phase));
  Add("task/contacts", "1", "fingertips that the law lets push, bit by bit", {},
      STEP(command.handling.contacts));
  Add("task/weight", "1", "part of the object's stated weight that the hand bears", {},
      STEP(command.task.weight));
  if (checks_ == nullptr) return;
  Add("task/support_force", "N", "upward force on the object by what it lies on", {},
      STEP(response.support_force));
}

void RunRecorder::AddCheckSignals() {
  const Clearance& clearance = checks_->clearance();
  std::set<PairClass> classes;
  for (const WatchedPair& pair : clearance.pairs()) classes.insert(pair.pairs);
  std::vector<std::string> names;
  std::ranges::transform(classes, std::back_inserter(names), [](PairClass pairs) { return NameOf(pairs); });
  if (!classes.empty()) {
    Add("clearance/smallest", "m", "smallest distance so far of bodies that must not touch", names,
        [&clearance, classes](const StepRecord& /*step*/, Row row) {
          size_t i = 0;
          for (const PairClass pairs : classes) row[i++] = clearance.nearest(pairs).distance;
        });
  }
  for (const std::span<const CheckRecord> checks : {checks_->model_checks(), checks_->motion_checks()}) {
    for (const CheckRecord& check : checks) {
      if (!check.applies) continue;
      Add("check/" + check.name, check.unit, check.description, {},
          [&check](const StepRecord& /*step*/, Row row) { row[0] = check.last; },
          {{"bound", check.bound}, {"kind", static_cast<double>(check.kind)}});
    }
  }
}

void RunRecorder::Record(const StepRecord& step) {
  log_.Row(LogWriter::kTime)[0] = step.time;
  for (const Channel& channel : channels_) channel.source(step, log_.Row(channel.signal));
  log_.EndRow();
}

void RunRecorder::Close(const std::string& summary) {
  log_.SetText("summary", summary);
  log_.Close();
}

}  // namespace dexcheck
