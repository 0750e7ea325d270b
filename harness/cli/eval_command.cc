// Terms of model and engine at one state, as JSON by their names in controller/NOTATION.md; matrices are
// lists of rows. Or random states, for a program that computes such terms.

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/contact/contact_geometry.h"
#include "controller/contact/grasp_map.h"
#include "controller/contact/shapes.h"
#include "controller/contact/surface.h"
#include "controller/control/trajectory_controller.h"
#include "controller/dynamics/model_terms.h"
#include "controller/grasp/force_closure.h"
#include "controller/model/parameter_reader.h"
#include "controller/model/platform.h"
#include "controller/object/object_dynamics.h"
#include "controller/object/so3.h"
#include "harness/base/files.h"
#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/cli/run_folder.h"
#include "harness/comparison/term_comparison.h"
#include "harness/descriptions/analytic_provider.h"
#include "harness/descriptions/engine_provider.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/result_files.h"
#include "harness/descriptions/term_results.h"
#include "harness/engine/adapter.h"
#include "harness/engine/engine.h"
#include "harness/scenario/state_file.h"

namespace dexcheck::cli {
namespace {

/// A term of a provider at the state set, of that shape.
MatrixXd ReadTerm(DynamicsProvider* provider, Term term, Eigen::Index rows, Eigen::Index cols = 1) {
  MatrixXd numbers = MatrixXd::Zero(rows, cols);
  provider->Read(term, numbers);
  return numbers;
}

/// Adds of each frame its pose, J_f, and J_f_dot xi, which is the acceleration at constant xi in the frame's
/// own axes without their turning: R^T d/dt (R v) - omega x v.
void AddFrames(const RobotModel& model, const VectorXd& xi, DynamicsProvider* provider, Json* out) {
  const auto count = static_cast<Eigen::Index>(model.frames().size());
  const Eigen::Index n = xi.size();
  const MatrixXd poses = ReadTerm(provider, Term::kFramePose, 12, count);
  const MatrixXd J = ReadTerm(provider, Term::kJ, 6, n * count);
  const MatrixXd accelerations = ReadTerm(provider, Term::kJDotXi, 6, count);
  Json frames = Json::object(), tips = Json::array();
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

/// Adds the terms that model and engine both have, of the robot alone: M_bar, C_bar_xi, gravity, friction,
/// F_bar, bias, energies and momenta, fingertip_pose, and pose, J_f, J_f_dot_xi of each frame.
void AddSharedTerms(const RobotModel& model, const State& state, DynamicsProvider* provider, Json* out) {
  DynamicsState at;
  at.q = state.q;
  at.xi = state.xi;
  provider->SetState(at);
  const Eigen::Index n = state.xi.size();
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
  AddFrames(model, state.xi, provider, out);
}

/// The model's matrices, of which the engine has products alone.
void AddMatrices(const ModelTerms& terms, const VectorXd& xi, Json* out) {
  (*out)["C_bar"] = ToRows(terms.C());
  Matrix6Xd J(6, terms.size()), J_dot(6, terms.size());
  for (size_t i = 0; i < terms.model().frames().size(); ++i) {
    Json& frame = (*out)["frames"][terms.model().frames()[i].name];
    terms.CalcFrameJacobian(static_cast<int>(i), J, J_dot);
    frame["J_f_dot"] = ToRows(J_dot);
    frame["J_f_dot_xi"] = ToList(J_dot * xi);
  }
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

/// Adds Pinocchio's coordinates at the same state of a floating base: [x y z, qx qy qz qw], the origin's
/// velocity in the base's axes.
void AddPinocchioTerms(const ModelTerms& terms, const State& state, Json* out) {
  const BaseConversion conversion({.position = BaseConvention::Position::kXyzXyzw, .linear_in_base = true});
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

void AddObjectTerms(const RobotModel& model, const ObjectState& object, Json* out) try {
  const ObjectTerms terms =
      CalcObjectTerms(model.object()->body, model.gravity(), object.X_o, object.X_o_dot);
  (*out)["P"] = ToRows(CalcP(object.X_o));
  (*out)["P_inv"] = ToRows(terms.P_inv);
  (*out)["P_inv_dot"] = ToRows(terms.P_inv_dot);
  (*out)["V_o"] = ToList(terms.V_Bo);
  (*out)["M_o"] = ToRows(terms.M_o);
  (*out)["C_o"] = ToRows(terms.C_o);
  (*out)["N_o"] = ToList(terms.N_o);
} catch (const SingularityError& error) {
  throw InputError(std::string("object.X_o: ") + error.what());
}

// A contact point may be off the surface by the digits that a person writes, m.
constexpr double kOnSurface = 1e-6;

/// kappa of a fingertip that touches the object's surface at a point: the fingertip's point whose normal is
/// opposite.
ContactCoordinates CalcKappaAt(const Surface& fingertip, const Surface& object, const SurfacePoint& alpha_o,
                               const Matrix3d& R_OF) {
  const SurfaceGeometry on_object = object.Evaluate(alpha_o);
  const SurfacePoint alpha_f = fingertip.Project(-R_OF.transpose() * on_object.R.col(2)).alpha;
  // x_cf = R_psi's first column in Sigma_co: [cos psi, -sin psi].
  const Vector3d x_cf = R_OF * fingertip.Evaluate(alpha_f).R.col(0);
  return {alpha_f, alpha_o, std::atan2(-on_object.R.col(1).dot(x_cf), on_object.R.col(0).dot(x_cf))};
}

ContactCoordinates ReadKappa(const ContactState& contacts, Eigen::Index i) {
  const auto kappa = contacts.kappa.row(i);
  return {{kappa[0], kappa[1], 0}, {kappa[2], kappa[3], 0}, kappa[4]};
}

Json DescribeContact(const Contact& contact, const ContactCoordinates& kappa, const std::string& finger) {
  const ContactGeometry& geometry = contact.geometry;
  return {{"finger", finger},
          {"kappa", ToList(kappa.CalcVector())},
          {"charts", {kappa.alpha_f.chart, kappa.alpha_o.chart}},
          {"kappa_dot", ToList(contact.kappa_dot)},
          {"M_f", ToRows(geometry.fingertip.M)},
          {"K_f", ToRows(geometry.fingertip.K)},
          {"T_f", ToList(geometry.fingertip.T.transpose())},
          {"M_o", ToRows(geometry.object.M)},
          {"K_o", ToRows(geometry.object.K)},
          {"T_o", ToList(geometry.object.T.transpose())},
          {"R_psi", ToRows(geometry.R_psi)},
          {"g_f_cf", ToRows(geometry.g_f_cf.matrix())},
          {"g_o_cf", ToRows(geometry.g_o_cf.matrix())}};
}

/// Whether the grasp can resist every wrench (26), and how large a wrench in its weakest direction.
void AddForceClosure(const Matrix6Xd& G, double friction, Json* out) {
  const ForceClosureOptions options;
  const ForceClosureResult result = CalcForceClosure(G, VectorXd::Constant(G.cols() / 3, friction), options);
  Json closed;
  if (result.status == ForceClosureStatus::kForceClosure) closed = true;
  if (result.status == ForceClosureStatus::kNotForceClosure) closed = false;
  (*out)["force_closure"] = {{"mu", friction},
                             {"closed", closed},
                             {"margin", result.margin},
                             {"margin_lower", result.margin_lower},
                             {"weakest_wrench", ToList(result.direction)},
                             {"length", options.length}};
}

/// Sections 4.4 and 5: J_B_pinv, N, xi_c, V_o_dot, xi_dot_d (47), F_o, F_N, f_c (49), tau (55), A (56).
/// @param terms with CalcDynamics done. @param state with object, contacts and law. @param kappa of its
/// contacts.
/// @throws Error where the law has no solution: singular J_B' or G, no contact forces in the cones.
Json CalcLaw(const ModelTerms& terms, const State& state, const Surface& surface,
             std::span<const ContactCoordinates> kappa) {
  const RobotModel& model = terms.model();
  const LawState& wanted = *state.law;
  const ContactState& contacts = *state.contacts;
  const int count = static_cast<int>(contacts.fingertips.size());
  GraspTerms grasp(model, contacts.fingertips, model.object()->body, surface);
  grasp.SetState(terms, state.object->X_o, state.object->X_o_dot, kappa);
  const Vector6d V_o_dot = CalcTrackingAcceleration({wanted.K_v, wanted.K_p}, grasp,
                                                    {wanted.X_d, wanted.X_d_dot, wanted.X_d_ddot});
  ComputedTorque law(model, count);
  law.SetDemand(terms, grasp, V_o_dot, wanted.sigma_prime);
  GraspForceProblem problem(count);
  problem.G = grasp.G();
  problem.F_o = law.F_o();
  problem.mu.setConstant(contacts.friction);
  problem.f_min.setConstant(wanted.f_min);
  problem.f_max.setConstant(wanted.f_max);
  GraspForceSolver solver(count);
  const GraspForceResult& force = solver.Solve(problem);
  RequireGraspForce(force);
  VectorXd F_N(grasp.num_forces());
  law.CalcInternalForce(force.f_c, F_N);
  const VectorXd tau = law.CalcTorque(grasp, F_N);

  Pseudoinverse J_B("J_B'", grasp.num_forces(), terms.size());
  J_B.Factor(grasp.J_B());
  Pseudoinverse G("G", 6, grasp.num_forces());
  G.Factor(grasp.G());
  const MatrixXd J_B_pinv = J_B.CalcMatrix();
  const ObjectTerms& object = grasp.coordinates();
  // (56): M_bar' J_B'^+ G^T P^-1 + J_B'^T G^+ M_o
  const MatrixXd A = terms.M() * J_B_pinv * grasp.G().transpose() * object.P_inv +
                     grasp.J_B().transpose() * G.CalcMatrix() * object.M_o;
  return {{"J_B_pinv", ToRows(J_B_pinv)},
          {"N", ToRows(J_B.CalcProjector())},
          {"xi_c", ToList(law.xi_c())},
          {"V_o_dot", ToList(V_o_dot)},
          {"xi_dot_d", ToList(law.xi_dot_d())},
          {"F_o", ToList(law.F_o())},
          {"F_N", ToList(F_N)},
          {"f_c", ToList(law.f_c())},
          {"tau", ToList(tau)},
          {"A", ToRows(A)}};
}

/// Adds the terms of section 4 for hard fingers at the state's contacts: G, G_dot, J_B, J_B_dot, and for each
/// contact its coordinates, their rates, frames and surface parameters. Without an object the contacts are
/// taken as at rest on both bodies (kappa_dot = 0).
/// @param terms at the state, reduced coordinates.
/// @throws InputError when a contact point is off the surface, or the law has no solution; SingularityError
/// when a chart or (40) is singular.
void AddContactTerms(const ModelTerms& terms, const State& state, Json* out) {
  const RobotModel& model = terms.model();
  const ContactState& contacts = *state.contacts;
  const std::unique_ptr<Surface> object = MakeSurface(model.object()->shape);
  Pose X_Bo = Pose::Identity();
  Vector6d V_o = Vector6d::Zero();
  if (state.object) {
    X_Bo = CalcObjectPose(state.object->X_o);
    V_o = CalcPInverse(state.object->X_o) * state.object->X_o_dot;
  }

  const bool has_points = contacts.points.rows() > 0;
  const auto count = static_cast<Eigen::Index>(contacts.fingertips.size());
  const int n = terms.size();
  std::vector<Contact> grasp;
  std::vector<ContactCoordinates> coordinates;
  MatrixXd J_B(3 * count, n), J_B_dot(3 * count, n);
  Matrix6Xd J_f(6, n), J_f_dot(6, n), G(6, 3 * count), G_dot(6, 3 * count);
  Json list = Json::array();
  for (Eigen::Index i = 0; i < count; ++i) {
    const int frame = contacts.fingertips[static_cast<size_t>(i)];
    const Frame& tip = model.frame(frame);
    const Sphere fingertip(*tip.sphere_radius);
    const Pose X_OF = X_Bo.inverse() * terms.CalcFramePose(frame);
    const std::string entry = fmt::format("{}[{}]: ", has_points ? "contact_points" : "kappa", i);
    terms.CalcFrameJacobian(frame, J_f, J_f_dot);
    ContactCoordinates kappa;
    Contact contact;
    try {
      kappa = has_points ? CalcKappaAt(fingertip, *object, object->Locate(contacts.points.row(i), kOnSurface),
                                       X_OF.linear())
                         : ReadKappa(contacts, i);
      contact.geometry = CalcContactGeometry(fingertip, *object, kappa);
      if (state.object) {
        contact.kappa_dot =
            CalcKappaDot(contact.geometry, CalcRelativeTwist(contact.geometry, J_f * state.xi, V_o));
      }
    } catch (const std::exception& error) {
      throw InputError(entry + error.what());
    }
    CalcContactJacobian(contact, J_f, J_B.middleRows(3 * i, 3));
    CalcContactJacobianDot(contact, J_f, J_f_dot, J_B_dot.middleRows(3 * i, 3));
    Json described = DescribeContact(contact, kappa, tip.name);
    if (state.object) {
      // How far the bodies' contact points are apart: zero where kappa belongs to the state.
      const Vector3d on_fingertip = X_OF * contact.geometry.g_f_cf.translation();
      described["distance"] = (on_fingertip - contact.geometry.g_o_cf.translation()).norm();
    }
    list.push_back(described);
    grasp.push_back(contact);
    coordinates.push_back(kappa);
  }
  CalcGraspMap(grasp, G);
  CalcGraspMapDot(grasp, G_dot);
  (*out)["G"] = ToRows(G);
  (*out)["G_dot"] = ToRows(G_dot);
  (*out)["J_B"] = ToRows(J_B);
  (*out)["J_B_dot"] = ToRows(J_B_dot);
  (*out)["contacts"] = list;
  AddForceClosure(G, contacts.friction, out);
  try {
    if (state.law) (*out)["law"] = CalcLaw(terms, state, *object, coordinates);
  } catch (const InputError&) {
    throw;
  } catch (const Error& error) {
    throw InputError(std::string("law: ") + error.what());
  }
}

/// Adds every term of the robot, and those of object and contacts where the state has them.
/// @throws SingularityError where one of them is singular.
void AddModelTerms(const RobotModel& model, const State& state, Json* out) {
  ModelTerms terms(model, Coordinates::kReduced);
  terms.SetState(state.q, state.xi);
  terms.CalcDynamics();
  RobotSpec robot = model.spec();
  robot.object.reset();
  AnalyticProvider provider(robot, "model");
  AddSharedTerms(model, state, &provider, out);
  AddMatrices(terms, state.xi, out);
  AddUnreducedTerms(model, state, out);
  if (model.base().type == BaseType::kFloating) AddPinocchioTerms(terms, state, out);
  if (state.object) AddObjectTerms(model, *state.object, out);
  if (state.contacts) AddContactTerms(terms, state, out);
}

struct EvalRequest {
  std::filesystem::path robot = FindShippedFile("controller/parameters/assistant_robot.toml");
  std::filesystem::path mjcf;
  std::string state_file;
  std::string out = "-";
  long states = 0;  // 0: the terms at the state of state_file
  std::uint64_t seed = 1;
  UrdfOptions urdf;
};

void WriteStates(const EvalRequest& request) {
  const std::filesystem::path folder = request.out;
  const RobotDescription robot = ReadDescription(request.robot, request.urdf);
  const RobotModel model(robot.spec);
  DynamicsState state;
  state.q.setZero(model.num_positions());
  state.xi.setZero(model.num_velocities());
  const auto rows = static_cast<size_t>(request.states);
  StateTable states{{{rows, static_cast<size_t>(state.q.size())}, {}},
                    {{rows, static_cast<size_t>(state.xi.size())}, {}}};
  for (const StateFeed feed = FeedRandomStates(model, request.states, {}, request.seed); feed(&state);
       ++state.sample) {
    states.q.values.insert(states.q.values.end(), state.q.begin(), state.q.end());
    states.v.values.insert(states.v.values.end(), state.xi.begin(), state.xi.end());
  }
  MakeFolder(folder);
  const auto write = [&](const char* name, const std::string& text) {
    OutputFile file(folder / name);
    file.Write(text);
  };
  write("layout.json", WriteLayout(robot, request.robot.filename().string()));
  write("states.jsonl", WriteStateLines(states));
  write("q.npy", WriteNpy(states.q));
  write("v.npy", WriteNpy(states.v));
}

int Run(const EvalRequest& request) {
  if (request.states > 0) {
    WriteStates(request);
    return kSuccess;
  }
  if (request.state_file.empty()) throw UsageError("eval: --state or --states is required");
  const RobotModel model = ParseRobotModel(ReadBytes(request.robot), std::string(request.robot));
  const State state = ReadState(request.state_file, model);
  Json out = {{"robot", model.name()}, {"q", ToList(state.q)}, {"xi", ToList(state.xi)}};
  try {
    AddModelTerms(model, state, &out);
  } catch (const InputError& error) {
    throw InputError(request.state_file + ": " + error.what());
  } catch (const std::invalid_argument& error) {  // Numbers as large as 1e308 become infinite on the way.
    throw InputError(request.state_file + ": " + error.what());
  }
  if (!request.mjcf.empty()) {
    const MjModelPtr engine = LoadMjcf(request.mjcf);
    const Adapter adapter(model, *engine, request.mjcf.string());
    EngineProvider provider(adapter, "engine");
    AddSharedTerms(model, state, &provider, &out["engine"]);
  }
  OutputFile(request.out).Write(FormatJson(out, /*indent=*/1));
  return kSuccess;
}

}  // namespace

void AddEvalCommand(CLI::App* app) {
  constexpr long kMostStates = 1000000;
  const auto [command, request] = AddRequest<EvalRequest>(
      app, "eval", "Print every term at one state, as JSON; or write random states for your own program",
      {"dexcheck eval arm.toml arm.xml --state state.json",
       "dexcheck eval arm.urdf --states 1000 --out states"});
  CLI::Option* const robot = AddOption(
      command, "ROBOT,--robot", &request->robot,
      "Parameter file (TOML) of the analytic model, the shipped one by default; with --states a URDF or an "
      "MJCF, too");
  CLI::Option* const mjcf =
      AddOption(command, "MJCF,--mjcf", &request->mjcf,
                "The same robot for the engine: adds the engine's values of the terms as \"engine\"")
          ->needs(robot);
  CLI::Option* const state =
      AddOption(command, "--state STATE.json", &request->state_file,
                "JSON with q, xi; optionally object, kappa or contact_points, fingers, mu, law");
  CLI::Option* const out = AddOption(command, "--out FILE.json|DIR", &request->out,
                                     "File to write (- for standard output); with --states a folder")
                               ->capture_default_str();
  CLI::Option* const json = AddJsonOption(command, "the terms", &request->out)->excludes(out);
  CLI::Option* const states = AddOption(command, "--states N", &request->states,
                                        "Write so many random states as layout.json, states.jsonl, q.npy and "
                                        "v.npy, for a program whose results consistency --results reads")
                                  ->check(WholeNumber(1, kMostStates))
                                  ->needs(robot)
                                  ->needs(out)
                                  ->excludes(state)
                                  ->excludes(mjcf)
                                  ->excludes(json);
  AddSeedOption(command, &request->seed, "Seed of the random states")->capture_default_str()->needs(states);
  AddUrdfOptions(command, &request->urdf);
}

}  // namespace dexcheck::cli
