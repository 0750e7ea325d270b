#include <fmt/format.h>

#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "controller/model/platform.h"
#include "controller/object/euler_zyz.h"
#include "controller/object/object_dynamics.h"
#include "harness/cli/commands.h"

namespace dexcheck::cli {
namespace {

using Json = nlohmann::ordered_json;

struct Request {
  std::filesystem::path robot = DEXCHECK_DATA_DIR "/controller/parameters/assistant_robot.toml";
  std::string state_file;
  std::string out = "-";
};

Json ToRows(const Eigen::Ref<const MatrixXd>& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(matrix(i, j));
    rows.push_back(row);
  }
  return rows;
}

Json ToList(const Eigen::Ref<const VectorXd>& vector) {
  Json list = Json::array();
  for (const double value : vector) list.push_back(value);
  return list;
}

/// The state file: reads the keys that it knows and refuses all others.
class StateReader {
 public:
  explicit StateReader(std::string file) : file_(std::move(file)) {
    std::ifstream stream(file_);
    if (!stream) Fail("cannot be read");
    json_ = Json::parse(stream, nullptr, /*allow_exceptions=*/false);
    if (json_.is_discarded()) Fail("is not valid JSON");
    if (!json_.is_object()) Fail("must be a JSON object");
    CheckKeys(json_, "", {"q", "xi", "object", "kappa"});
  }

  [[nodiscard]] VectorXd ReadVector(const std::string& key, int size) const {
    return Read(json_, "", key, size);
  }

  [[nodiscard]] bool HasObject() const { return json_.contains("object"); }
  [[nodiscard]] VectorXd ReadObjectVector(const std::string& key) const {
    const Json& object = json_.at("object");
    if (!object.is_object()) Fail("object: must be a JSON object");
    CheckKeys(object, "object.", {"X_o", "X_o_dot"});
    return Read(object, "object.", key, 6);
  }

  [[noreturn]] void Fail(const std::string& problem) const { throw InputError(file_ + ": " + problem); }

 private:
  void CheckKeys(const Json& table, const std::string& prefix, const std::vector<std::string>& known) const {
    for (const auto& item : table.items()) {
      if (std::find(known.begin(), known.end(), item.key()) == known.end())
        Fail(prefix + item.key() + ": unknown key");
    }
  }

  [[nodiscard]] VectorXd Read(const Json& table, const std::string& prefix, const std::string& key,
                              int size) const {
    if (!table.contains(key)) Fail(prefix + key + ": missing");
    const Json& list = table.at(key);
    const std::string expected = fmt::format("must be a list of {} numbers", size);
    if (!list.is_array()) Fail(prefix + key + ": " + expected);
    if (static_cast<int>(list.size()) != size) {
      Fail(fmt::format("{}{}: {}, got {}", prefix, key, expected, list.size()));
    }
    VectorXd values(size);
    for (int i = 0; i < size; ++i) {
      const Json& value = list[static_cast<size_t>(i)];
      if (!value.is_number())
        Fail(fmt::format("{}{}[{}]: must be a number, got {}", prefix, key, i, value.dump()));
      values[i] = value.get<double>();
      if (!std::isfinite(values[i]))
        Fail(fmt::format("{}{}[{}]: must be finite, got {}", prefix, key, i, values[i]));
    }
    return values;
  }

  std::string file_;
  Json json_;
};

void AddRobotTerms(const RobotModel& model, const VectorXd& q, const VectorXd& xi, Json* out) {
  ModelTerms reduced(model, Coordinates::kReduced);
  reduced.SetState(q, xi);
  reduced.CalcDynamics();
  VectorXd q_dot = xi;
  if (model.base().type == BaseType::kDifferentialDrive) {
    const PlatformConstraint platform = CalcPlatformConstraint(model.base(), q.head<3>(), xi.head<2>());
    q_dot.resize(model.num_positions());
    q_dot << platform.S_v * xi.head<2>(), xi.tail(model.num_joints());
    (*out)["A_v"] = ToRows(platform.A_v);
    (*out)["S_v"] = ToRows(platform.S_v);
    (*out)["S_v_dot"] = ToRows(platform.S_v_dot);
    (*out)["E_v"] = ToRows(platform.E_v);
    (*out)["S_v_T_E_v"] = ToRows(platform.S_v_T_E_v);
  }
  ModelTerms unreduced(model, Coordinates::kUnreduced);
  unreduced.SetState(q, q_dot);
  unreduced.CalcDynamics();

  (*out)["M_bar"] = ToRows(reduced.M());
  (*out)["C_bar"] = ToRows(reduced.C());
  const VectorXd F_bar = reduced.gravity() + reduced.friction();
  (*out)["F_bar"] = ToList(F_bar);
  (*out)["bias"] = ToList(reduced.C() * xi + F_bar);
  (*out)["gravity"] = ToList(reduced.gravity());
  (*out)["friction"] = ToList(reduced.friction());
  (*out)["M"] = ToRows(unreduced.M());
  (*out)["C"] = ToRows(unreduced.C());
  (*out)["F"] = ToList(unreduced.gravity() + unreduced.friction());

  const EnergyAndMomentum energy = reduced.CalcEnergyAndMomentum();
  (*out)["kinetic_energy"] = energy.kinetic;
  (*out)["potential_energy"] = energy.potential;
  (*out)["linear_momentum"] = ToList(energy.linear_momentum);
  (*out)["angular_momentum"] = ToList(energy.angular_momentum);

  Matrix6Xd J(6, reduced.size());
  Matrix6Xd J_dot(6, reduced.size());
  Json tips = Json::array();
  Json frames = Json::object();
  for (int frame = 0; frame < static_cast<int>(model.frames().size()); ++frame) {
    reduced.CalcFrameJacobian(frame, J, J_dot);
    const Json pose = ToRows(reduced.CalcFramePose(frame).matrix());
    if (model.frames()[static_cast<size_t>(frame)].sphere_radius) tips.push_back(pose);
    frames[model.frames()[static_cast<size_t>(frame)].name] = {
        {"pose", pose}, {"J_f", ToRows(J)}, {"J_f_dot", ToRows(J_dot)}, {"J_f_dot_xi", ToList(J_dot * xi)}};
  }
  (*out)["fingertip_pose"] = tips;
  (*out)["frames"] = frames;
}

void AddObjectTerms(const RobotModel& model, const StateReader& state, Json* out) {
  if (!model.object()) state.Fail("object: the robot file " + model.spec().source + " has no [object]");
  const Vector6d X_o = state.ReadObjectVector("X_o");
  const Vector6d X_o_dot = state.ReadObjectVector("X_o_dot");
  const ObjectTerms terms = CalcObjectTerms(model.object()->body, model.gravity(), X_o, X_o_dot);
  (*out)["P"] = ToRows(CalcP(X_o));
  (*out)["P_inv"] = ToRows(terms.P_inv);
  (*out)["P_inv_dot"] = ToRows(terms.P_inv_dot);
  (*out)["V_o"] = ToList(terms.V_Bo);
  (*out)["M_o"] = ToRows(terms.M_o);
  (*out)["C_o"] = ToRows(terms.C_o);
  (*out)["N_o"] = ToList(terms.N_o);
}

int Run(const Request& request) {
  const RobotModel model = ReadRobotModel(request.robot);
  const StateReader state(request.state_file);
  const VectorXd q = state.ReadVector("q", model.num_positions());
  const VectorXd xi = state.ReadVector("xi", model.num_velocities());
  Json out = {{"robot", model.name()}, {"q", ToList(q)}, {"xi", ToList(xi)}};
  AddRobotTerms(model, q, xi, &out);
  if (state.HasObject()) {
    try {
      AddObjectTerms(model, state, &out);
    } catch (const SingularityError& error) {
      state.Fail(std::string("object.X_o: ") + error.what());
    }
  }
  WriteFile(request.out, out.dump(1) + "\n");
  return kSuccess;
}

}  // namespace

void AddEvalCommand(CLI::App* app, int* exit_code) {
  const auto request = std::make_shared<Request>();
  CLI::App* command =
      app->add_subcommand("eval", "Print every term of the analytic model at one state, as JSON");
  command->add_option("--robot", request->robot, "Parameter file (TOML) of the analytic model")
      ->type_name("FILE.toml");
  command->add_option("--state", request->state_file, "JSON with q, xi, and optionally object and kappa")
      ->type_name("STATE.json")
      ->required();
  command->add_option("--out", request->out, "File to write (- for standard output)")->capture_default_str();
  command->callback([=] { *exit_code = Run(*request); });
}

}  // namespace dexcheck::cli
