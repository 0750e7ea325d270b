#include "harness/run/run_recorder.h"

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include "harness/base/files.h"
#include "harness/base/version.h"
#include "harness/engine/machine.h"
#include "harness/engine/mjcf_file.h"
#include "harness/run/log_columns.h"

namespace dexcheck {
namespace {

/// Copies a vector or matrix expression into a row.
template <typename Derived>
void Copy(const Eigen::DenseBase<Derived>& from, std::span<double> to) {
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

using Row = std::span<double>;

/// A number of the step.
template <typename Get>
auto Number(Get get) {
  return [get](const StepRecord& step, Row row) { row[0] = get(step); };
}

/// A vector of the step.
template <typename Get>
auto Vector(Get get) {
  return [get](const StepRecord& step, Row row) { Copy(get(step), row); };
}

/// The law's demand, which a controller of the user's own need not have.
template <typename Member>
auto Demand(Member LawDemand::*member) {
  return [member](const StepRecord& step, Row row) {
    const Member& demand = step.command.demand.*member;
    if (demand.size() == static_cast<Eigen::Index>(row.size())) return Copy(demand, row);
    std::fill(row.begin(), row.end(), std::numeric_limits<double>::quiet_NaN());
  };
}

void Put(double from, Row to) { to[0] = from; }
template <typename Derived>
void Put(const Eigen::DenseBase<Derived>& from, Row to) {
  Copy(from, to);
}

/// Writes a number or a vector for each entry of a list of the step, one after the other.
template <typename List, typename Get>
auto Each(List list, Get get) {
  return [list, get](const StepRecord& step, Row row) {
    const auto& entries = list(step);
    for (size_t i = 0; i < entries.size(); ++i) {
      const size_t width = row.size() / entries.size();
      Put(get(entries[i]), row.subspan(width * i, width));
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

int CountOf(const std::vector<std::string>& names) { return static_cast<int>(names.size()); }

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
                      int width, std::vector<std::string> columns, Source source,
                      std::map<std::string, double> numbers) {
  const int signal = log_.AddSignal({name, unit, description, width, std::move(columns), std::move(numbers)});
  channels_.push_back({signal, std::move(source)});
}

void RunRecorder::AddNumber(const std::string& name, const std::string& unit, const std::string& description,
                            Source source) {
  Add(name, unit, description, 1, {}, std::move(source));
}

void RunRecorder::AddStateSignals() {
  const RobotModel& model = setup_->model();
  const mjModel& m = setup_->engine();
  std::vector<std::string> q_names;
  std::vector<std::string> xi_names;
  std::vector<std::string> tau_names;
  if (model.num_base_positions() == 3) q_names = {"x_c", "y_c", "phi"};
  if (model.num_base_velocities() == 3) xi_names = {"x_dot", "y_dot", "phi_dot"};
  if (model.num_base_velocities() == 2) {
    xi_names = model.base().velocity == DriveVelocity::kTwist
                   ? std::vector<std::string>{"v_c", "w_c"}
                   : std::vector<std::string>{"theta_dot_r", "theta_dot_l"};
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
  // By the base's coordinates; a floating base's have no names of their own.
  const std::vector<std::string> q_base = model.num_base_positions() == 3
                                              ? std::vector<std::string>{"m", "m", "rad"}
                                              : std::vector<std::string>();
  const bool turns_wheels =
      model.num_base_velocities() == 2 && model.base().velocity != DriveVelocity::kTwist;
  const std::vector<std::string> xi_base = model.num_base_velocities() == 3 ? q_base
                                           : turns_wheels ? std::vector<std::string>{"rad", "rad"}
                                           : model.num_base_velocities() == 2
                                               ? std::vector<std::string>{"m", "rad"}
                                               : std::vector<std::string>();
  const bool is_named = model.num_base_positions() == static_cast<int>(q_base.size()) &&
                        model.num_base_velocities() == static_cast<int>(xi_base.size());
  const std::string q_units = is_named ? ListJointUnits(model, q_base, "") : "m, rad";
  const std::string xi_units = is_named ? ListJointUnits(model, xi_base, "/s") : "m/s, rad/s";
  const std::string xi_dot_units = is_named ? ListJointUnits(model, xi_base, "/s^2") : "m/s^2, rad/s^2";
  const LogColumns qpos = ListPositionColumns(m);
  const LogColumns qvel = ListVelocityColumns(m);
  const int n = model.num_velocities();
  const int p = model.num_positions();
  const bool moves_joints = setup_->joints() != nullptr;
  Add("engine/qpos", qpos.units, "MuJoCo's positions, quaternions wxyz", static_cast<int>(m.nq), qpos.names,
      Vector([](const StepRecord& step) -> const auto& { return step.reading.qpos; }));
  Add("engine/qvel", qvel.units, "MuJoCo's velocities", static_cast<int>(m.nv), qvel.names,
      Vector([](const StepRecord& step) -> const auto& { return step.reading.qvel; }));
  Add("q", q_units, "q' as read from the plant", p, q_names,
      Vector([](const StepRecord& step) -> const auto& { return step.reading.state.q; }));
  Add("xi", xi_units, "reduced velocity as read from the plant", n, xi_names,
      Vector([](const StepRecord& step) -> const auto& { return step.reading.state.xi; }));
  Add("tau", "N m", moves_joints ? "torques of the joints' law" : "tau' of the computed torque law (55)", n,
      tau_names, Vector([](const StepRecord& step) -> const auto& { return step.command.tau; }));
  if (setup_->scenario().pick_task() == nullptr) {
    Add("law/xi_dot_d", xi_dot_units,
        moves_joints ? "accelerations that the law demands" : "xi_dot_d of (47), which the law demands", n,
        xi_names, Demand(&LawDemand::xi_dot));
  }
  if (!setup_->scenario().imperfections.is_ideal()) {
    Add("measured/q", q_units, "measured q'", p, q_names,
        Vector([](const StepRecord& step) -> const auto& { return step.measured.state.q; }));
    Add("measured/xi", xi_units, "measured reduced velocity", n, xi_names,
        Vector([](const StepRecord& step) -> const auto& { return step.measured.state.xi; }));
    Add("tau_given", "N m", "what the motors made of tau", n, tau_names,
        Vector([](const StepRecord& step) -> const auto& { return step.drive.tau; }));
  }
  AddNumber("base/tilt", "rad", "angle of the platform against the vertical",
            Number([](const StepRecord& step) { return step.reading.departure.tilt; }));
  AddNumber("base/height", "m", "height of the axle's midpoint against the model's",
            Number([](const StepRecord& step) { return step.reading.departure.height; }));
  if (checks_ == nullptr) return;
  AddNumber("engine/contacts", "1", "contacts of the engine",
            Number([](const StepRecord& step) { return step.response.contact_count; }));
  AddNumber("engine/constraint_rows", "1",
            "rows of the engine's constraints: contacts, limits, bonds, dry friction",
            Number([](const StepRecord& step) { return step.response.constraint_rows; }));
  Add("engine/xi_dot", xi_dot_units, "reduced acceleration of the plant", n, xi_names,
      Vector([](const StepRecord& step) -> const auto& { return step.response.xi_dot; }));
  Add("model/xi_dot", xi_dot_units,
      moves_joints ? "accelerations that the equations of motion predict"
                   : "reduced acceleration that (46), (48) predict",
      n, xi_names, Vector([](const StepRecord& step) -> const auto& { return step.findings.xi_dot_model; }));
}

void RunRecorder::AddJointSignals() {
  const RobotModel& model = setup_->model();
  const int n = model.num_positions();
  std::vector<std::string> names, base;
  if (model.base().type == BaseType::kFloating) {
    names = {"x", "y", "z", "qw", "qx", "qy", "qz"};
    base = {"m", "m", "m", "1", "1", "1", "1"};
  }
  for (const Joint& joint : model.joints()) names.push_back(joint.name);
  Add("joints/q_d", ListJointUnits(model, base, ""), "desired positions of the joints", n, names,
      Vector([](const StepRecord& step) -> const auto& { return step.command.joints.q; }));
  Add("joints/error", ListJointUnits(model, base, ""), "q_d - q", n, names,
      [](const StepRecord& step, Row row) { Copy(step.command.joints.q - step.reading.state.q, row); });
  AddNumber("joints/largest_error", "rad, m", "largest of joints/error",
            Number([](const StepRecord& step) { return step.error.joints; }));
  if (!setup_->feet().empty()) AddFootSignals();
}

void RunRecorder::AddFootSignals() {
  const std::vector<std::string>& feet = setup_->scenario().joint_task()->stance->feet;
  const int count = CountOf(feet);
  const std::vector<std::string> xyz = Expand(feet, {"x", "y", "z"});
  Add("law/foot_force", "N", "forces that the law asks of the ground, world axes", 3 * count, xyz,
      Demand(&LawDemand::f_c));
  if (checks_ == nullptr) return;
  Add("foot/force", "N", "forces of the ground on the feet, world axes", 3 * count, xyz,
      Vector([](const StepRecord& step) -> const auto& { return step.findings.foot_force; }));
  Add("foot/force_model", "N", "those of the robot on rigid feet", 3 * count, xyz,
      Vector([](const StepRecord& step) -> const auto& { return step.findings.foot_force_model; }));
  const auto slips = [](const StepRecord& step) -> const auto& { return step.findings.foot_slip; };
  Add("foot/slip", "m", "slip of each foot since t = 0", 3 * count, xyz,
      Each(slips, [](const SlipState& slip) { return slip.distance; }));
  Add("foot/cone_use", "1", "tangential force over mu times normal force of each foot", count, feet,
      Each(slips, [](const SlipState& slip) { return slip.cone_use; }));
}

void RunRecorder::AddObjectSignals() {
  const std::vector<std::string> pose = {"x", "y", "z", "alpha", "beta", "gamma"};
  Add("object/X_o", kPoseUnits, "pose of the object, ZYZ angles (8)", 6, pose, Vector(CalcX_o));
  Add("object/X_d", kPoseUnits, "desired pose of the object", 6, pose,
      Vector([](const StepRecord& step) -> const auto& { return step.command.desired.X_d; }));
  Add("object/V", "m/s, m/s, m/s, rad/s, rad/s, rad/s", "body velocity of the object", 6,
      {"v_x", "v_y", "v_z", "w_x", "w_y", "w_z"},
      Vector([](const StepRecord& step) -> const auto& { return step.reading.state.V_Bo; }));
  Add("object/error", "m", "X_d - X_o, position", 3, {"x", "y", "z"},
      Vector([](const StepRecord& step) -> const auto& { return step.error.position; }));
  AddNumber("object/position_error", "m", "distance of the object from its desired place",
            Number([](const StepRecord& step) { return step.error.position.norm(); }));
  AddNumber("object/orientation_error", "rad", "angle between the object and its desired orientation",
            Number([](const StepRecord& step) { return step.error.orientation; }));
}

void RunRecorder::AddContactSignals() {
  const std::vector<std::string>& tips = setup_->scenario().grasp.fingertips;
  const int count = CountOf(tips);
  const std::map<std::string, double> mu = {{"mu", setup_->object().friction}};
  const std::vector<std::string> xyz = Expand(tips, {"x", "y", "z"});
  Add("contact/kappa", "rad", "contact coordinates (39)", 5 * count,
      Expand(tips, {"u_f", "v_f", "u_o", "v_o", "psi"}), Each(ListKappa, ReadKappa));
  Add("contact/chart", "1",
      "chart of the fingertip's (u_f, v_f) and of the object's (u_o, v_o) of contact/kappa", 2 * count,
      Expand(tips, {"f", "o"}), Each(ListKappa, ReadCharts));
  if (setup_->scenario().control.kappa == ContactSource::kIntegrated) AddFollowedContacts();
  Add("contact/overlap", "m", "depth to which fingertip and object overlap", count, tips,
      [](const StepRecord& step, Row row) {
        std::copy(step.reading.state.overlap.begin(), step.reading.state.overlap.end(), row.begin());
      });
  if (setup_->scenario().pick_task() == nullptr) {
    Add("law/f_c", "N", "f_c of (49), which the law commands, each in its contact frame", 3 * count, xyz,
        Demand(&LawDemand::f_c), mu);
    Add("law/F_N", "N", "internal part F_N of law/f_c, which the grasp-force problem chooses", 3 * count, xyz,
        Demand(&LawDemand::F_N));
  }
  if (checks_ == nullptr) return;
  Add("contact/position", "m", "contact points in the world", 3 * count, xyz,
      Each(ListContacts, [](const PlantContact& contact) { return contact.position; }));
  Add("contact/normal", "1", "normals in the world, into the object", 3 * count, xyz,
      Each(ListContacts, [](const PlantContact& contact) { return contact.normal; }));
  Add("contact/force", "N", "forces of finger on object in the world", 3 * count, xyz,
      Each(ListContacts, [](const PlantContact& contact) { return contact.force; }), mu);
  Add("contact/f_c", "N", "f_c of the engine, each in its contact frame, z into the object", 3 * count, xyz,
      Vector([](const StepRecord& step) -> const auto& { return step.findings.f_c; }), mu);
  Add("contact/f_c_model", "N", "f_c that (19), (46), (48) predict", 3 * count, xyz,
      Vector([](const StepRecord& step) -> const auto& { return step.findings.f_c_model; }), mu);
  const auto add_slip = [&](const std::string& group, const std::string& what,
                            const std::vector<std::string>& parts,
                            std::vector<SlipState> StepFindings::*states) {
    const auto list = [states](const StepRecord& step) -> const auto& { return step.findings.*states; };
    Add(group + "/slip", "m", "slip of each " + what + " since t = 0", 3 * CountOf(parts),
        Expand(parts, {"x", "y", "z"}), Each(list, [](const SlipState& slip) { return slip.distance; }));
    Add(group + "/cone_use", "1", "tangential force over mu times normal force of each " + what,
        CountOf(parts), parts, Each(list, [](const SlipState& slip) { return slip.cone_use; }));
  };
  add_slip("contact", "fingertip", tips, &StepFindings::fingertip_slip);
  std::vector<std::string> wheels;
  for (const EngineWheel& wheel : setup_->adapter().wheels())
    wheels.push_back(NameOf(setup_->engine(), mjOBJ_JOINT, wheel.joint));
  if (!wheels.empty()) add_slip("wheel", "wheel", wheels, &StepFindings::wheel_slip);
}

void RunRecorder::AddFollowedContacts() {
  const std::vector<std::string>& tips = setup_->scenario().grasp.fingertips;
  const int count = CountOf(tips);
  Add("law/kappa", "rad", "contact coordinates (39) that the law follows by (40) from t = 0", 5 * count,
      Expand(tips, {"u_f", "v_f", "u_o", "v_o", "psi"}), Each(ListFollowed, ReadKappa));
  Add("law/chart", "1", "charts of law/kappa, as contact/chart", 2 * count, Expand(tips, {"f", "o"}),
      Each(ListFollowed, ReadCharts));
  const auto add = [&](const char* name, const char* unit, const char* what, double ContactDrift::*member) {
    Add(name, unit, what, count, tips,
        Each(
            [](const StepRecord& step) -> const auto& { return step.drift; },
            [member](const ContactDrift& drift) { return drift.*member; }));
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
  AddNumber("task/phase", "1", "phase of the task: " + phases,
            Number([](const StepRecord& step) { return step.command.task.phase; }));
  AddNumber("task/contacts", "1", "fingertips that the law lets push, bit by bit",
            Number([](const StepRecord& step) { return step.command.handling.contacts; }));
  AddNumber("task/weight", "1", "part of the object's stated weight that the hand bears",
            Number([](const StepRecord& step) { return step.command.task.weight; }));
  if (checks_ == nullptr) return;
  AddNumber("task/support_force", "N", "upward force on the object by what it lies on",
            Number([](const StepRecord& step) { return step.response.support_force; }));
}

void RunRecorder::AddCheckSignals() {
  const Clearance& clearance = checks_->clearance();
  std::set<PairClass> classes;
  for (const WatchedPair& pair : clearance.pairs()) classes.insert(pair.pairs);
  std::vector<std::string> names;
  for (const PairClass pairs : classes) names.emplace_back(NameOf(pairs));
  if (!classes.empty()) {
    Add("clearance/smallest", "m", "smallest distance so far of bodies that must not touch", CountOf(names),
        names, [&clearance, classes](const StepRecord& /*step*/, Row row) {
          size_t i = 0;
          for (const PairClass pairs : classes) row[i++] = clearance.nearest(pairs).distance;
        });
  }
  for (const std::span<const CheckRecord> checks : {checks_->model_checks(), checks_->motion_checks()}) {
    for (const CheckRecord& check : checks) {
      if (!check.applies) continue;
      Add("check/" + check.name, check.unit, check.description, 1, {},
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
