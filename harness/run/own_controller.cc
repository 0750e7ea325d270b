#include "harness/run/own_controller.h"

#include <unistd.h>

#include <Eigen/LU>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/toml_reader.h"
#include "controller/model/platform.h"
#include "harness/base/files.h"

namespace dexcheck {
namespace {

/// The texts of robot and scenario, with a run's changes.
std::string MakeRobotText(const Setup& setup) {
  const std::string& source = setup.model().spec().source;
  return ApplyOverrides(ReadBytes(source), source, setup.scenario().model_overrides);
}

std::string MakeScenarioText(const Scenario& scenario) {
  std::vector<std::string> overrides = scenario.overrides;
  std::erase_if(overrides, IsOfModel);
  return ApplyOverrides(scenario.text, scenario.source, overrides);
}

/// Returns the program that runs a Python file: the main program of the Python module.
std::filesystem::path FindPythonMain(const std::string& name) {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const char* folder : {"python", DEXCHECK_PYTHON_FOLDER}) {
    std::filesystem::path main = program.parent_path() / folder / "dexcheck/__main__.py";
    if (::access(main.c_str(), R_OK) == 0) return main;
  }
  throw InputError(name + ": needs the Python module, which is not in " +
                   (program.parent_path() / DEXCHECK_PYTHON_FOLDER).string());
}

std::unique_ptr<ControllerPeer> StartProgram(const OwnControllerSetup& setup) {
  const std::filesystem::path file = FindControllerFile(setup.own());
  if (file.empty()) return MakeProgramPeer(setup, {"/bin/sh", "-c", "exec " + setup.own().run});
  if (::access(file.c_str(), R_OK) != 0)
    throw InputError(setup.name + ": " + file.string() + ": cannot be read");
  const char* const python = std::getenv("DEXCHECK_PYTHON");
  return MakeProgramPeer(
      setup, {python == nullptr ? "python3" : python, FindPythonMain(setup.name).string(), file.string()});
}

}  // namespace

std::filesystem::path FindControllerFile(const OwnControllerOptions& own) {
  const std::filesystem::path file = (own.folder / own.run).lexically_normal();
  const bool is_one = file.extension() == ".so" || file.extension() == ".py";
  const bool is_command = own.run.find(' ') != std::string::npos && ::access(file.c_str(), F_OK) != 0;
  return is_one && !is_command ? file : std::filesystem::path();
}

std::unique_ptr<Controller> MakeOwnController(const Setup& setup, const Sampling& sampling) {
  const Scenario& scenario = setup.scenario();
  if (scenario.pick_task() != nullptr)
    throw InputError(scenario.source + ": task: is done by no other controller");
  if (scenario.control.kappa == ContactSource::kIntegrated)
    throw InputError(scenario.source + ": control.kappa: other controllers get measured contacts");
  const OwnControllerSetup own{setup, sampling, "controller " + scenario.controller.run, MakeRobotText(setup),
                               MakeScenarioText(scenario)};
  if (FindControllerFile(own.own()).extension() == ".so") return MakeLibraryController(own);
  return MakeProtocolController(StartProgram(own), own);
}

std::string HashController(const OwnControllerOptions& own) {
  const std::filesystem::path file = FindControllerFile(own);
  return file.empty() ? "" : HashBytes(ReadBytes(file, kMostData));
}

void OwnControllerSetup::RejectParameter(const std::string& parameter, const std::string& why) const {
  throw InputError(name + ": controller." + parameter + ": is none of its parameters: it " + why);
}

OwnController::OwnController(const OwnControllerSetup& setup) : setup_(setup) {
  if (setup.setup.joints() != nullptr)
    joints_.emplace(setup.setup.joints()->motion, setup.sampling.time_step);
}

bool OwnController::CountStep(const Reading& reading, double t, Command* command) {
  const bool is_due = steps_until_due_ == 0;
  steps_until_due_ = is_due ? setup_.sampling.hold - 1 : steps_until_due_ - 1;
  if (joints_) {
    joints_->Fill(reading, t, command);
    command->computes_joints = is_due;
  }
  return is_due;
}

void OwnController::RequireTorques(const Command& command) const {
  const Eigen::Index n = setup_.setup.model().num_velocities();
  if (command.tau.size() != n) {
    throw ControllerFailure(setup_.name + ": sent " + std::to_string(command.tau.size()) +
                            " torques, must be " + std::to_string(n));
  }
  if (!command.tau.allFinite()) throw ControllerFailure(setup_.name + ": sent a torque that is not a number");
}

namespace {

class ProtocolController final : public OwnController {
 public:
  ProtocolController(std::unique_ptr<ControllerPeer> peer, const OwnControllerSetup& setup)
      : OwnController(setup),
        peer_(std::move(peer)),
        options_(setup.setup.MakeControllerOptions()),
        model_(robot(), setup.setup.fingertips(), setup.setup.object().body, setup.setup.surface(), options_),
        sigma_prime_(VectorXd::Zero(robot().num_velocities())) {
    if (robot().base().type == BaseType::kDifferentialDrive) {
      wheels_inverse_ = CalcWheelRateMap(robot().base()).transpose().inverse();
    }
    Greet();
  }

  void Follow(const Trajectory& motion) override {
    motion_ = &motion;
    Restart();
  }

  void Begin(double /*t*/, const Reading& /*reading*/) override {
    BeginMotion();
    peer_->Begin();
  }

  void Step(const Reading& reading, double t, Command* command) override {
    if (motion_ == nullptr) throw std::logic_error("ProtocolController: Step before Follow");
    command->tracks = true;
    command->handling = Handling{};
    command->force_seconds = 0.0;
    command->force_solves = 0;
    if (!joints_)
      command->desired = TrajectoryController::EvaluateDesired(*motion_, t, setup_.sampling.time_step);
    const bool is_due = CountStep(reading, t, command);
    model_.SetState(reading.state);
    if (!is_due) return;
    FillRequest(reading, t, *command);
    peer_->Step({request_.data(), filled_}, torques_);
    const Eigen::Map<const VectorXd> all(torques_.data(), static_cast<Eigen::Index>(torques_.size()));
    const Eigen::Index n = robot().num_velocities();
    command->tau = all.head(n);
    command->demand.F_N = all.tail(all.size() - n);
    if (all.size() > n) command->force_solves = 1;
    RequireTorques(*command);
  }
  [[nodiscard]] const GraspModel& model() const override { return model_; }

 private:
  [[nodiscard]] const RobotModel& robot() const { return setup_.setup.model(); }

  void Greet() {
    const RobotModel& model = robot();
    const auto count = static_cast<uint32_t>(setup_.setup.fingertips().size());
    dexcheck_hello hello{};
    std::memcpy(hello.magic, DEXCHECK_MAGIC, sizeof(DEXCHECK_MAGIC));
    hello.protocol = DEXCHECK_PROTOCOL;
    hello.positions = static_cast<uint32_t>(model.num_positions());
    hello.velocities = static_cast<uint32_t>(model.num_velocities());
    hello.contacts = count;
    hello.robot_bytes = static_cast<uint32_t>(setup_.robot_text.size());
    hello.scenario_bytes = static_cast<uint32_t>(setup_.scenario_text.size());
    hello.time_step = setup_.sampling.time_step * static_cast<double>(setup_.sampling.hold);
    Eigen::Map<Vector6d>(hello.K_v) = options_.gains.K_v;
    Eigen::Map<Vector6d>(hello.K_p) = options_.gains.K_p;
    hello.mu = options_.mu;
    hello.f_min = options_.f_min;
    hello.f_max = options_.f_max;
    hello.barrier_weight = options_.force.barrier_weight;
    std::vector<double> gains;
    if (joints_) {
      const JointGains& joint_gains = setup_.setup.joints()->gains;
      for (const VectorXd* gain : {&joint_gains.K_p, &joint_gains.K_v})
        gains.insert(gains.end(), gain->begin(), gain->end());
    }

    const uint32_t flags = peer_->Greet(hello, gains);
    if ((flags & DEXCHECK_PARAMETERS) != 0) {
      peer_->SetParameters();
    } else if (!setup_.own().parameters.empty()) {
      setup_.RejectParameter(setup_.own().parameters.front().first, "takes none");
    }
    wants_terms_ = (flags & DEXCHECK_TERMS) != 0;
    const size_t p = hello.positions, n = hello.velocities, N = count, k = 3 * N;
    size_t doubles = 1 + 18 + p + n + 12 + 6 + 6 + 5 * N + N + N + 1;
    if (joints_) doubles += 3 * n;
    if (wants_terms_) doubles += 2 * n * n + 2 * n + 2 * k * n + 12 * k + 36 + 12 + n + 4;
    request_.assign(1 + doubles, 0.0);
    torques_.assign(n + ((flags & DEXCHECK_TELLS_F_N) != 0 ? k : 0), 0.0);
  }

  void FillRequest(const Reading& reading, double t, const Command& command) {
    filled_ = 1;
    const auto add = [&](const auto& matrix) {
      for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
        for (Eigen::Index col = 0; col < matrix.cols(); ++col) request_[filled_++] = matrix(row, col);
      }
    };
    const MeasuredState& state = reading.state;
    request_[filled_++] = t;
    add(command.desired.X_d);
    add(command.desired.X_d_dot);
    add(command.desired.X_d_ddot);
    add(state.q);
    add(state.xi);
    add(state.X_Bo.linear());
    add(state.X_Bo.translation());
    add(state.V_Bo);
    if (model_.has_coordinates()) {
      add(model_.grasp().X_o());
    } else {
      add(Vector6d::Zero());
    }
    for (const ContactCoordinates& kappa : state.kappa) add(kappa.CalcVector());
    for (const double overlap : state.overlap) request_[filled_++] = overlap;
    for (size_t i = 0; i < state.kappa.size(); ++i) {
      request_[filled_++] = Contains(reading.touch.fingertips, i) ? 1.0 : 0.0;
    }
    request_[filled_++] = reading.touch.support_force;
    if (joints_) {
      add(command.joints.q);
      add(command.joints.q_dot);
      add(command.joints.q_ddot);
    }
    if (!wants_terms_) return;
    const ModelTerms& terms = model_.robot();
    const GraspTerms& grasp = model_.grasp();
    options_.posture.CalcAcceleration(state.q, state.xi, sigma_prime_);
    add(terms.M());
    add(terms.C());
    add(terms.gravity());
    add(terms.friction());
    add(grasp.J_B());
    add(grasp.J_B_dot());
    add(grasp.G());
    add(grasp.G_dot());
    add(grasp.body().M_hat);
    add(Vector6d(grasp.body().C_hat * grasp.V_Bo()));
    add(grasp.body().N_o);
    add(sigma_prime_);
    add(wheels_inverse_);
  }

  std::unique_ptr<ControllerPeer> peer_;
  GraspControllerOptions options_;
  GraspModel model_;
  VectorXd sigma_prime_;                            // n
  Matrix2d wheels_inverse_ = Matrix2d::Identity();  // inverse of the wheels' block of E_bar'
  const Trajectory* motion_ = nullptr;
  bool wants_terms_ = false;
  std::vector<double> request_;  // the message, with one double before it for the header
  size_t filled_ = 0;
  std::vector<double> torques_;  // n, and 3 N of F_N where it is reported
};

}  // namespace

std::unique_ptr<Controller> MakeProtocolController(std::unique_ptr<ControllerPeer> peer,
                                                   const OwnControllerSetup& setup) {
  return std::make_unique<ProtocolController>(std::move(peer), setup);
}

}  // namespace dexcheck
