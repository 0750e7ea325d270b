#include <memory>
#include <string>

#include "controller/common/errors.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "controller/model/platform.h"
#include "controller/object/euler_zyz.h"
#include "controller/object/object_dynamics.h"
#include "harness/cli/commands.h"
#include "harness/cli/eval_contacts.h"
#include "harness/cli/json_matrix.h"
#include "harness/cli/output_file.h"
#include "harness/cli/run_folder.h"
#include "harness/descriptions/analytic_provider.h"
#include "harness/descriptions/base_convention.h"
#include "harness/descriptions/engine_provider.h"
#include "harness/engine/adapter.h"
#include "harness/engine/engine.h"
#include "harness/scenario/state_file.h"

namespace dexcheck::cli {
namespace {

// Terms of model and engine at one state, as JSON by their names in controller/NOTATION.md; matrices are
// lists of rows.

/// A term of a provider at the state set, of that shape.
MatrixXd ReadTerm(DynamicsProvider* provider, Term term, Eigen::Index rows, Eigen::Index cols = 1) {
  MatrixXd numbers = MatrixXd::Zero(rows, cols);
  provider->Read(term, numbers);
  return numbers;
}

/// Of each frame its pose, J_f, and J_f_dot xi, which is the acceleration at constant xi in the frame's own
/// axes without their turning: R^T d/dt (R v) - omega x v.
void AddFrames(const RobotModel& model, const VectorXd& xi, DynamicsProvider* provider, Json* out) {
  const auto count = static_cast<Eigen::Index>(model.frames().size());
  const Eigen::Index n = xi.size();
  const MatrixXd poses = ReadTerm(provider, Term::kFramePose, 12, count);
  const MatrixXd J = ReadTerm(provider, Term::kJ, 6, n * count);
  const MatrixXd accelerations = ReadTerm(provider, Term::kJDotXi, 6, count);
  Json frames = Json::object();
  Json tips = Json::array();
  for (Eigen::Index i = 0; i < count; ++i) {
    const Frame& frame = model.frames()[static_cast<size_t>(i)];
    Eigen::Matrix4d X = Eigen::Matrix4d::Identity();
    X.topRows<3>() = poses.col(i).reshaped(3, 4);
    const MatrixXd J_f = J.middleCols(i * n, n);
    const Vector6d V = J_f * xi;
    Vector6d J_f_dot_xi = accelerations.col(i);
    J_f_dot_xi.head<3>() -= V.tail<3>().cross(V.head<3>());
    frames[frame.name] = {{"pose", ToRows(X)}, {"J_f", ToRows(J_f)}, {"J_f_dot_xi", ToList(J_f_dot_xi)}};
    if (frame.sphere_radius) tips.push_back(frames[frame.name].at("pose"));
  }
  (*out)["fingertip_pose"] = tips;
  (*out)["frames"] = frames;
}

/// What model and engine have alike, at the state set.
void AddSharedTerms(const RobotModel& model, const VectorXd& xi, DynamicsProvider* provider, Json* out) {
  const Eigen::Index n = xi.size();
  const VectorXd coriolis = ReadTerm(provider, Term::kCBarXi, n);
  const VectorXd gravity = ReadTerm(provider, Term::kGravity, n);
  const VectorXd friction = ReadTerm(provider, Term::kFriction, n);
  const VectorXd F_bar = gravity + friction;
  (*out)["M_bar"] = ToRows(ReadTerm(provider, Term::kMBar, n, n));
  (*out)["C_bar_xi"] = ToList(coriolis);
  (*out)["gravity"] = ToList(gravity);
  (*out)["friction"] = ToList(friction);
  (*out)["F_bar"] = ToList(F_bar);
  (*out)["bias"] = ToList(coriolis + F_bar);
  (*out)["kinetic_energy"] = ReadTerm(provider, Term::kKineticEnergy, 1)(0, 0);
  (*out)["potential_energy"] = ReadTerm(provider, Term::kPotentialEnergy, 1)(0, 0);
  (*out)["linear_momentum"] = ToList(ReadTerm(provider, Term::kLinearMomentum, 3));
  (*out)["angular_momentum"] = ToList(ReadTerm(provider, Term::kAngularMomentum, 3));
  AddFrames(model, xi, provider, out);
}

/// The model's matrices, of which the engine has products alone.
void AddMatrices(const ModelTerms& terms, const VectorXd& xi, Json* out) {
  (*out)["C_bar"] = ToRows(terms.C());
  Matrix6Xd J(6, terms.size());
  Matrix6Xd J_dot(6, terms.size());
  for (size_t i = 0; i < terms.model().frames().size(); ++i) {
    Json& frame = (*out)["frames"][terms.model().frames()[i].name];
    terms.CalcFrameJacobian(static_cast<int>(i), J, J_dot);
    frame["J_f_dot"] = ToRows(J_dot);
    frame["J_f_dot_xi"] = ToList(J_dot * xi);
  }
}

/// Of the robot alone.
DynamicsState MakeState(const State& state) {
  DynamicsState made;
  made.q = state.q;
  made.xi = state.xi;
  return made;
}

/// M, C and F of (16), and for a differential drive the matrices of (2), (12), (13), (15), (17).
void AddUnreducedTerms(const RobotModel& model, const State& state, Json* out) {
  VectorXd q_dot = state.xi;
  if (model.base().type == BaseType::kDifferentialDrive) {
    const Vector2d v = state.xi.head<2>();
    const PlatformConstraint platform = CalcPlatformConstraint(model.base(), state.q.head<3>(), v);
    q_dot.resize(model.num_unreduced_base_velocities() + model.num_dofs());
    q_dot << platform.S_v * v, state.xi.tail(model.num_dofs());
    (*out)["A_v"] = ToRows(platform.A_v);
    (*out)["S_v"] = ToRows(platform.S_v);
    (*out)["S_v_dot"] = ToRows(platform.S_v_dot);
    (*out)["E_v"] = ToRows(platform.E_v);
    (*out)["S_v_T_E_v"] = ToRows(platform.S_v_T_E_v);
  }
  ModelTerms terms(model, Coordinates::kUnreduced);
  terms.SetState(state.q, q_dot);
  terms.CalcDynamics();
  (*out)["M"] = ToRows(terms.M());
  (*out)["C"] = ToRows(terms.C());
  (*out)["F"] = ToList(terms.gravity() + terms.friction());
}

/// What Pinocchio has at the same state of a floating base: [x y z, qx qy qz qw], the origin's velocity in
/// the base's axes.
void AddPinocchioTerms(const ModelTerms& terms, const State& state, Json* out) {
  BaseConvention convention;
  convention.position = BaseConvention::Position::kXyzXyzw;
  convention.linear_in_base = true;
  const BaseConversion conversion(convention);
  TermResults converted;
  converted.M = terms.M();
  converted.gravity = terms.gravity();
  converted.bias = terms.C() * state.xi + terms.gravity();
  conversion.Apply(state.q, state.xi, &converted);
  (*out)["pinocchio"] = {{"q", ToList(conversion.ConvertPositions(state.q))},
                         {"v", ToList(conversion.ConvertVelocities(state.q, state.xi))},
                         {"M", ToRows(converted.M)},
                         {"g", ToList(converted.gravity)},
                         {"nle", ToList(converted.bias)}};
}

void AddObjectTerms(const RobotModel& model, const ObjectState& object, Json* out) {
  const ObjectTerms terms =
      CalcObjectTerms(model.object()->body, model.gravity(), object.X_o, object.X_o_dot);
  (*out)["P"] = ToRows(CalcP(object.X_o));
  (*out)["P_inv"] = ToRows(terms.P_inv);
  (*out)["P_inv_dot"] = ToRows(terms.P_inv_dot);
  (*out)["V_o"] = ToList(terms.V_Bo);
  (*out)["M_o"] = ToRows(terms.M_o);
  (*out)["C_o"] = ToRows(terms.C_o);
  (*out)["N_o"] = ToList(terms.N_o);
}

/// Adds every term of the robot, those of the object when the state has one, and those of the contacts when
/// it has them.
/// @throws SingularityError where the object's ZYZ angles are singular, or where contacts cannot be
/// evaluated.
void AddModelTerms(const RobotModel& model, const State& state, Json* out) {
  ModelTerms terms(model, Coordinates::kReduced);
  terms.SetState(state.q, state.xi);
  terms.CalcDynamics();
  RobotSpec robot = model.spec();
  robot.object.reset();
  AnalyticProvider provider(robot, "model");
  provider.SetState(MakeState(state));
  AddSharedTerms(model, state.xi, &provider, out);
  AddMatrices(terms, state.xi, out);
  AddUnreducedTerms(model, state, out);
  if (model.base().type == BaseType::kFloating) AddPinocchioTerms(terms, state, out);
  try {
    if (state.object) AddObjectTerms(model, *state.object, out);
  } catch (const SingularityError& error) {
    throw InputError(std::string("object.X_o: ") + error.what());
  }
  if (state.contacts) AddContactTerms(terms, state, out);
}

/// The engine's values of the model's terms of the same names: M_bar, C_bar_xi, gravity, friction, F_bar,
/// bias, energies and momenta, fingertip_pose, and pose, J_f, J_f_dot_xi of each frame.
Json EvaluateEngineTerms(const Adapter& adapter, const State& state) {
  EngineProvider provider(adapter, "engine");
  provider.SetState(MakeState(state));
  Json out = Json::object();
  AddSharedTerms(adapter.model(), state.xi, &provider, &out);
  return out;
}

struct EvalRequest {
  std::filesystem::path robot = FindShippedFile("controller/parameters/assistant_robot.toml");
  std::filesystem::path mjcf;
  std::string state_file;
  std::string out = "-";
};

int Run(const EvalRequest& request) {
  const RobotModel model = ReadRobotModel(request.robot);
  const State state = ReadState(request.state_file, model);
  Json out = {{"robot", model.name()},
              {"q", std::vector<double>(state.q.begin(), state.q.end())},
              {"xi", std::vector<double>(state.xi.begin(), state.xi.end())}};
  try {
    AddModelTerms(model, state, &out);
  } catch (const InputError& error) {
    throw InputError(request.state_file + ": " + error.what());
  }
  if (!request.mjcf.empty()) {
    const MjModelPtr engine = LoadMjcf(request.mjcf);
    const Adapter adapter(model, *engine, request.mjcf.string());
    out["engine"] = EvaluateEngineTerms(adapter, state);
  }
  OutputFile(request.out).Write(out.dump(1) + "\n");
  return kSuccess;
}

}  // namespace

void AddEvalCommand(Command app) {
  const auto request = std::make_shared<EvalRequest>();
  Command command = app.AddCommand("eval", "Print every term at one state, as JSON");
  Option robot =
      command.AddOption("--robot FILE.toml", &request->robot, "Parameter file (TOML) of the analytic model");
  command
      .AddOption("--mjcf FILE.xml", &request->mjcf,
                 "The same robot for the engine: adds the engine's values of the terms as \"engine\"")
      .Needs(robot);
  command
      .AddOption("--state STATE.json", &request->state_file,
                 "JSON with q, xi; optionally object, kappa or contact_points, fingers, mu, law")
      .Required();
  Option out = command.AddOption("--out FILE.json", &request->out, "File to write (- for standard output)")
                   .ShowDefault();
  AddJsonOption(command, "the terms", &request->out).Excludes(out);
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
