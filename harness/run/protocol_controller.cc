#include <Eigen/LU>
#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include "controller/control/joint_controller.h"
#include "controller/model/platform.h"
#include "harness/run/own_controller.h"

namespace dexcheck {
namespace {

class ProtocolController final : public Controller {
 public:
  ProtocolController(std::unique_ptr<ControllerPeer> peer, const OwnControllerSetup& setup)
      : setup_(setup),
        peer_(std::move(peer)),
        model_(*setup.model, setup.fingertips, setup.object, *setup.surface, setup.options),
        sigma_prime_(VectorXd::Zero(setup.model->num_velocities())) {
    if (setup.model->base().type == BaseType::kDifferentialDrive) {
      wheels_inverse_ = CalcWheelRateMap(setup.model->base()).transpose().inverse();
    }
    if (setup.joints != nullptr) joints_.emplace(setup.joints->motion, setup.sampling.time_step);
    Greet();
  }

  void Follow(const Trajectory& motion) override {
    motion_ = &motion;
    steps_until_due_ = 0;
  }

  void Begin(double /*t*/, const Reading& /*reading*/) override {
    if (joints_) joints_->Begin();
    steps_until_due_ = 0;
    peer_->Begin();
  }

  void Step(const Reading& reading, double t, Command* command) override {
    if (motion_ == nullptr) throw std::logic_error("ProtocolController: Step before Follow");
    command->tracks = true;
    command->handling = Handling{};
    command->force_seconds = 0.0;
    command->force_solves = 0;
    const bool is_due = steps_until_due_ == 0;
    if (joints_) {
      joints_->Fill(reading, t, command);
      command->computes_joints = is_due;
    } else {
      command->desired = TrajectoryController::EvaluateDesired(*motion_, t, setup_.sampling.time_step);
    }
    model_.SetState(reading.state);
    if (!is_due) {
      --steps_until_due_;
      return;
    }
    steps_until_due_ = setup_.sampling.hold - 1;
    FillRequest(reading, t, *command);
    peer_->Step({request_.data(), filled_}, torques_);
    const Eigen::Map<const VectorXd> all(torques_.data(), static_cast<Eigen::Index>(torques_.size()));
    const Eigen::Index n = setup_.model->num_velocities();
    command->tau = all.head(n);
    command->demand.F_N = all.tail(all.size() - n);
    if (all.size() > n) command->force_solves = 1;
    RequireTorques(setup_.name, *command, n);
  }
  [[nodiscard]] const GraspModel& model() const override { return model_; }

 private:
  void Greet() {
    const RobotModel& model = *setup_.model;
    const auto count = static_cast<uint32_t>(setup_.fingertips.size());
    dexcheck_hello hello{};
    std::memcpy(hello.magic, DEXCHECK_MAGIC, sizeof(DEXCHECK_MAGIC));
    hello.protocol = DEXCHECK_PROTOCOL;
    hello.positions = static_cast<uint32_t>(model.num_positions());
    hello.velocities = static_cast<uint32_t>(model.num_velocities());
    hello.contacts = count;
    hello.robot_bytes = static_cast<uint32_t>(setup_.robot_text.size());
    hello.scenario_bytes = static_cast<uint32_t>(setup_.scenario_text.size());
    hello.time_step = setup_.sampling.time_step * static_cast<double>(setup_.sampling.hold);
    Eigen::Map<Vector6d>(hello.K_v) = setup_.options.gains.K_v;
    Eigen::Map<Vector6d>(hello.K_p) = setup_.options.gains.K_p;
    hello.mu = setup_.options.mu;
    hello.f_min = setup_.options.f_min;
    hello.f_max = setup_.options.f_max;
    hello.barrier_weight = setup_.options.force.barrier_weight;
    std::vector<double> gains;
    if (joints_) {
      for (const VectorXd* gain : {&setup_.joints->gains.K_p, &setup_.joints->gains.K_v})
        gains.insert(gains.end(), gain->begin(), gain->end());
    }

    const uint32_t flags = peer_->Greet(hello, gains);
    if ((flags & DEXCHECK_PARAMETERS) != 0) {
      peer_->SetParameters();
    } else if (!setup_.own.parameters.empty()) {
      RejectParameter(setup_, setup_.own.parameters.front().first, "takes none");
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
    const ModelTerms& robot = model_.robot();
    const GraspTerms& grasp = model_.grasp();
    setup_.options.posture.CalcAcceleration(state.q, state.xi, sigma_prime_);
    add(robot.M());
    add(robot.C());
    add(robot.gravity());
    add(robot.friction());
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

  OwnControllerSetup setup_;
  std::unique_ptr<ControllerPeer> peer_;
  GraspModel model_;
  VectorXd sigma_prime_;                            // n
  Matrix2d wheels_inverse_ = Matrix2d::Identity();  // inverse of the wheels' block of E_bar'
  const Trajectory* motion_ = nullptr;
  std::optional<JointDemand> joints_;
  bool wants_terms_ = false;
  long steps_until_due_ = 0;
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
