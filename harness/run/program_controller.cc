#include "harness/run/program_controller.h"

#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <Eigen/LU>
#include <array>
#include <cerrno>
#include <cstring>

#include "controller/common/text.h"
#include "controller/control/controller_protocol.h"
#include "controller/model/platform.h"
#include "harness/plant/plant.h"

namespace dexcheck {
namespace {

// How much more time than for an answer a program has to start.
constexpr double kGreetingFraction = 10.0;
// Time in which a program that has closed its output may end, s, before it is asked no more.
constexpr double kEndTime = 0.5;

timeval ToTime(double seconds) {
  timeval time{};
  time.tv_sec = static_cast<time_t>(seconds);
  time.tv_usec = static_cast<suseconds_t>(1e6 * (seconds - static_cast<double>(time.tv_sec)));
  if (time.tv_sec == 0 && time.tv_usec == 0) time.tv_usec = 1;  // 0 would wait for ever
  return time;
}

GraspModel MakeModel(const OwnControllerSetup& setup) {
  return {*setup.model, setup.fingertips, setup.object, *setup.surface, setup.options};
}

}  // namespace

ProgramController::ProgramController(const std::string& command, const OwnControllerSetup& setup)
    : name_("controller " + Quote(command)),
      setup_(setup),
      model_(MakeModel(setup)),
      sigma_prime_(VectorXd::Zero(setup.model->num_velocities())) {
  if (setup.model->base().type == BaseType::kDifferentialDrive) {
    wheels_inverse_ = CalcWheelRateMap(setup.model->base()).transpose().inverse();
  }
  if (setup.joints != nullptr) joints_.emplace(setup.joints->motion, setup.sampling.time_step);
  Start(command);
  try {
    Greet();
  } catch (...) {
    Stop();
    throw;
  }
}

void ProgramController::Start(const std::string& command) {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw RunFailure(name_ + ": " + std::strerror(errno));
  }
  socket_ = ends[0];
  SetTimeLimit(kGreetingFraction * setup_.time_limit);

  const int theirs = ends[1];
  try {
    process_.emplace(name_, Program{{"/bin/sh", "-c", "exec " + command}, theirs, theirs});
  } catch (const Error& error) {
    close(theirs);
    close(socket_);
    throw RunFailure(error.what());
  }
  close(theirs);
}

void ProgramController::SetTimeLimit(double seconds) {
  time_limit_ = seconds;
  const timeval limit = ToTime(seconds);
  setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
  setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof(limit));
}

void ProgramController::Greet() {
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
  hello.time_step = setup_.sampling.time_step;
  Eigen::Map<Vector6d>(hello.K_v) = setup_.options.gains.K_v;
  Eigen::Map<Vector6d>(hello.K_p) = setup_.options.gains.K_p;
  hello.mu = setup_.options.mu;
  hello.f_min = setup_.options.f_min;
  hello.f_max = setup_.options.f_max;
  hello.barrier_weight = setup_.options.force.barrier_weight;
  Send(&hello, sizeof(hello));
  Send(setup_.robot_text.data(), setup_.robot_text.size());
  Send(setup_.scenario_text.data(), setup_.scenario_text.size());
  if (joints_) {
    for (const VectorXd* gain : {&setup_.joints->gains.K_p, &setup_.joints->gains.K_v}) {
      Send(gain->data(), static_cast<size_t>(gain->size()) * sizeof(double));
    }
  }

  dexcheck_hello_answer answer{};
  Receive(&answer, sizeof(answer));
  if (std::memcmp(answer.magic, DEXCHECK_MAGIC, sizeof(DEXCHECK_MAGIC)) != 0) {
    throw RunFailure(name_ + ": does not speak the protocol of controller_protocol.h");
  }
  if (answer.protocol != DEXCHECK_PROTOCOL) {
    throw RunFailure(name_ + ": speaks protocol " + std::to_string(answer.protocol) + ", this program " +
                     std::to_string(DEXCHECK_PROTOCOL));
  }
  wants_terms_ = (answer.flags & DEXCHECK_TERMS) != 0;
  tells_F_N_ = (answer.flags & DEXCHECK_TELLS_F_N) != 0;
  const size_t p = hello.positions, n = hello.velocities, N = count, k = 3 * N;
  size_t doubles = 1 + 18 + p + n + 12 + 6 + 6 + 5 * N + N + N + 1;
  if (joints_) doubles += 3 * n;
  if (wants_terms_) doubles += 2 * n * n + 2 * n + 2 * k * n + 12 * k + 36 + 12 + n + 4;
  request_.assign(1 + doubles, 0.0);
  SetTimeLimit(setup_.time_limit);
}

ProgramController::~ProgramController() { Stop(); }

void ProgramController::Stop() {
  if (socket_ < 0) return;
  const dexcheck_message end{DEXCHECK_END, 0};
  (void)!send(socket_, &end, sizeof(end), MSG_NOSIGNAL | MSG_DONTWAIT);
  close(socket_);
  socket_ = -1;
  TellEnd();
  process_.reset();
}

std::string ProgramController::TellEnd() {
  const std::optional<ProcessEnd> end = process_->WaitFor(kEndTime);
  return end ? end->Describe() : "";
}

void ProgramController::Send(const void* data, size_t size) {
  const char* from = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t sent = send(socket_, from, size, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      throw RunFailure(name_ + ": read nothing for " + FormatNumber(time_limit_) + " s");
    }
    if (sent < 0) {
      const std::string end = TellEnd();
      throw RunFailure(name_ + ": " + (end.empty() ? "closed its standard input" : end));
    }
    from += sent;
    size -= static_cast<size_t>(sent);
  }
}

void ProgramController::Receive(void* data, size_t size) {
  char* to = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t got = recv(socket_, to, size, MSG_WAITALL);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      throw RunFailure(name_ + ": did not answer within " + FormatNumber(time_limit_) + " s");
    }
    if (got <= 0) {
      const std::string end = TellEnd();
      throw RunFailure(name_ + ": " + (end.empty() ? "closed its standard output" : end));
    }
    to += got;
    size -= static_cast<size_t>(got);
  }
}

void ProgramController::FillRequest(const Reading& reading, double t, const Command& command) {
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

void ProgramController::Begin(double /*t*/, const Reading& /*reading*/) {
  if (joints_) joints_->Begin();
  const dexcheck_message begin{DEXCHECK_BEGIN, 0};
  Send(&begin, sizeof(begin));
}

void ProgramController::Step(const Reading& reading, double t, Command* command) {
  if (motion_ == nullptr) throw std::logic_error("ProgramController: Step before Follow");
  command->tracks = true;
  command->handling = Handling{};
  command->force_seconds = 0.0;
  command->force_solves = 0;
  if (joints_) {
    joints_->Fill(reading, t, command);
    command->computes_joints = true;
  } else {
    command->desired = TrajectoryController::EvaluateDesired(*motion_, t, setup_.sampling.time_step);
  }
  model_.SetState(reading.state);
  FillRequest(reading, t, *command);
  dexcheck_message message{DEXCHECK_STEP, static_cast<uint32_t>(filled_ - 1)};
  static_assert(sizeof(message) == sizeof(double));
  std::memcpy(request_.data(), &message, sizeof(message));
  Send(request_.data(), filled_ * sizeof(double));

  const auto n = static_cast<size_t>(setup_.model->num_velocities());
  const size_t k = tells_F_N_ ? 3 * setup_.fingertips.size() : 0;
  Receive(&message, sizeof(message));
  if (message.type != DEXCHECK_STEP || message.doubles != n + k) {
    throw RunFailure(name_ + ": answered with message " + std::to_string(message.type) + " of " +
                     std::to_string(message.doubles) + " numbers, must be " + std::to_string(DEXCHECK_STEP) +
                     " of " + std::to_string(n + k));
  }
  command->tau.resize(static_cast<Eigen::Index>(n));
  Receive(command->tau.data(), n * sizeof(double));
  command->demand.F_N.resize(static_cast<Eigen::Index>(k));
  if (k > 0) {
    Receive(command->demand.F_N.data(), k * sizeof(double));
    command->force_solves = 1;
  }
  RequireTorques(name_, *command, setup_.model->num_velocities());
}

}  // namespace dexcheck
