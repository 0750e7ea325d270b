#include "harness/view/live_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "controller/handling/pick_and_place.h"
#include "harness/engine/compiled_model.h"

namespace dexcheck {
namespace {

using Clock = std::chrono::steady_clock;

/// Later than this, a run that cannot keep up starts its clock anew.
constexpr auto kLongestDelay = std::chrono::milliseconds(100);

std::string Print(const Vector3d& v) { return fmt::format("[{}, {}, {}]", v.x(), v.y(), v.z()); }

}  // namespace

LiveRun::LiveRun(std::unique_ptr<Setup> setup, const RunInputs& inputs, const std::filesystem::path& log,
                 double speed)
    : setup_(std::move(setup)),
      looks_(MakeVisible(LoadMjcf(inputs.mjcf))),
      runner_(std::make_unique<Runner>(*setup_, /*check=*/true)),
      speed_(speed) {
  if (!log.empty()) recorder_.emplace(log, runner_->loop(), *setup_, inputs);
  thread_ = std::thread([this] { Run(); });
}

LiveRun::~LiveRun() {
  Change([&] { quit_ = true; });
  if (thread_.joinable()) thread_.join();
}

void LiveRun::Run() {
  try {
    runner_->Run([this](const StepRecord& step) { Record(step); }, [this] { return Wait(); });
    if (recorder_) recorder_->Close(MakeSummary(*setup_, runner_->loop(), runner_->result()).dump(2) + "\n");
  } catch (...) {
    problem_ = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  finished_ = true;
}

bool LiveRun::Wait() {
  std::unique_lock lock(mutex_);
  if (runner_->loop().record().step == 0) return quit_;  // everything comes to rest first
  changed_.wait(lock, [&] { return quit_ || !paused_ || granted_ > 0; });
  if (quit_) return true;
  if (granted_ > 0) {
    --granted_;
    is_paced_ = false;
  } else {
    const auto step = std::chrono::duration<double>(setup_->scenario().plant.time_step / speed_);
    if (!is_paced_) due_ = Clock::now();
    is_paced_ = true;
    due_ += std::chrono::duration_cast<Clock::duration>(step);
    if (Clock::now() > due_ + kLongestDelay) due_ = Clock::now();
    changed_.wait_until(lock, due_, [&] { return quit_ || paused_ || !is_paced_; });
    if (quit_) return true;
  }
  Disturb();
  return false;
}

void LiveRun::Disturb() {
  const double t = runner_->loop().time();
  constexpr double kRounding = 1e-9;  // of times, s
  if (!force_ || t < held_until_ - kRounding) return;
  DisturbanceOptions one;
  one.key = fmt::format("mouse_force.{}", forces_.size());
  one.body = force_->body;
  one.at = force_->at;
  one.force = force_->force;
  one.begin = t;
  one.duration = std::max(kForceTime, setup_->scenario().plant.time_step);
  runner_->Disturb(one);
  held_until_ = t + one.duration;
  forces_.push_back(fmt::format(
      "disturbance+={{ type = \"pulse\", body = \"{}\", at = {}, force = {}, begin = {}, duration = {} }}",
      one.body, Print(one.at), Print(one.force), one.begin, one.duration));
}

void LiveRun::Record(const StepRecord& step) {
  if (recorder_) recorder_->Record(step);
  ViewFrame view;
  RunFrames& frame = view.frame;
  frame.title = setup_->scenario().name;
  const int object = setup_->adapter().object_body();
  if (object >= 0) {
    frame.object_body = NameOf(setup_->engine(), mjOBJ_BODY, object);
    frame.friction = setup_->object().friction;
  }
  frame.times = {step.time};
  frame.qpos = step.reading.qpos.transpose();
  if (runner_->loop().task() != nullptr) {
    frame.phases = {NameOf(static_cast<Phase>(static_cast<int>(step.command.task.phase)))};
  }
  if (step.command.joints.q.size() > 0) {
    frame.joint_errors = {step.error.joints};
  } else {
    frame.position_errors = {step.error.position.norm()};
    frame.orientation_errors = {step.error.orientation};
    frame.desired_positions = step.command.desired.X_d.head<3>().transpose();
  }
  const auto count = static_cast<long>(step.response.contacts.size());
  for (RowMatrixXd* matrix : {&frame.contact_positions, &frame.contact_forces, &frame.contact_normals}) {
    matrix->resize(1, 3 * count);
  }
  for (long i = 0; i < count; ++i) {
    const PlantContact& contact = step.response.contacts[static_cast<size_t>(i)];
    frame.contact_positions.block<1, 3>(0, 3 * i) = contact.position.transpose();
    frame.contact_forces.block<1, 3>(0, 3 * i) = contact.force.transpose();
    frame.contact_normals.block<1, 3>(0, 3 * i) = contact.normal.transpose();
  }
  const RunChecks& checks = runner_->loop().checks();
  for (const CheckCategory kind : kCheckCategories) {
    CategoryStatus& status = view.categories.emplace_back(CategoryStatus{kind});
    for (const std::span<const CheckRecord> records : {checks.model_checks(), checks.motion_checks()}) {
      for (const CheckRecord& check : records) {
        if (check.kind == kind && check.applies)
          status.Add(check.name, check.worst, check.bound, check.failed);
      }
    }
  }
  view.q = step.reading.state.q;
  view.X_Bo = step.reading.state.X_Bo;
  const std::lock_guard lock(mutex_);
  frames_.push_back(std::move(view));
}

long LiveRun::rows() const {
  const std::lock_guard lock(mutex_);
  return static_cast<long>(frames_.size());
}

double LiveRun::TimeAt(long row) const {
  const std::lock_guard lock(mutex_);
  return frames_[static_cast<size_t>(row)].frame.times.front();
}

ViewFrame LiveRun::Read(long row) const {
  const std::lock_guard lock(mutex_);
  return frames_[static_cast<size_t>(row)];
}

void LiveRun::Change(const std::function<void()>& change) {
  {
    const std::lock_guard lock(mutex_);
    change();
  }
  changed_.notify_all();
}

void LiveRun::SetPaused(bool paused) {
  Change([&] {
    paused_ = paused;
    is_paced_ = false;
  });
}

void LiveRun::Advance() {
  Change([&] { granted_ += paused_ ? 1 : 0; });
}

void LiveRun::SetSpeed(double speed) {
  Change([&] {
    speed_ = speed;
    is_paced_ = false;
  });
}

void LiveRun::SetForce(const std::optional<MouseForce>& force) {
  const std::lock_guard lock(mutex_);
  force_ = force;
}

bool LiveRun::is_finished() const {
  const std::lock_guard lock(mutex_);
  return finished_;
}

void LiveRun::Finish() {
  Change([&] { quit_ = true; });
  if (thread_.joinable()) thread_.join();
  if (problem_) std::rethrow_exception(problem_);
}

bool LiveRun::was_disturbed() const {
  const std::lock_guard lock(mutex_);
  return !forces_.empty();
}

std::vector<std::string> LiveRun::ListOverrides() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> overrides = setup_->scenario().overrides;
  overrides.insert(overrides.end(), forces_.begin(), forces_.end());
  return overrides;
}

}  // namespace dexcheck
