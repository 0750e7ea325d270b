#include "harness/view/live_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "controller/handling/pick_and_place.h"
#include "harness/base/files.h"
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
      "disturbance+={{ type = \"pulse\", body = {}, at = {}, force = {}, begin = {}, duration = {} }}",
      QuoteToml(one.body), Print(one.at), Print(one.force), one.begin, one.duration));
}

void LiveRun::Record(const StepRecord& step) {
  if (recorder_) recorder_->Record(step);
  RunFrames frame;
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
  for (RowMatrixXd* matrix : {&frame.contact_positions, &frame.contact_forces, &frame.contact_normals})
    matrix->resize(1, 3 * count);
  for (long i = 0; i < count; ++i) {
    const PlantContact& contact = step.response.contacts[static_cast<size_t>(i)];
    frame.contact_positions.block<1, 3>(0, 3 * i) = contact.position.transpose();
    frame.contact_forces.block<1, 3>(0, 3 * i) = contact.force.transpose();
    frame.contact_normals.block<1, 3>(0, 3 * i) = contact.normal.transpose();
  }
  ViewFrame view;
  const RunChecks& checks = runner_->loop().checks();
  for (const CheckCategory kind : kCheckCategories) {
    CategoryStatus& status = view.categories.emplace_back(CategoryStatus{kind});
    for (const std::span<const CheckRecord> records : {checks.model_checks(), checks.motion_checks()}) {
      for (const CheckRecord& check : records) {
        if (check.kind == kind && check.applies) status.Add(check);
      }
    }
  }
  view.run = std::make_shared<RunFrames>(std::move(frame));
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
  return frames_[static_cast<size_t>(row)].run->times.front();
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

namespace {

/// Ten digits: 0.6 for 3 times 0.2, and not 0.6000000000000001.
std::string PrintGain(double number) { return FormatNumber(number, 10); }

std::string PrintGain(const Vector6d& v) {
  return fmt::format("[{}, {}, {}, {}, {}, {}]", PrintGain(v[0]), PrintGain(v[1]), PrintGain(v[2]),
                     PrintGain(v[3]), PrintGain(v[4]), PrintGain(v[5]));
}

/// A key with numbers by joint, each times a factor; nothing when the scenario does not have it.
void Multiply(const ByName& numbers, double factor, std::vector<std::string>* overrides) {
  if (numbers.key.empty() || factor == 1.0) return;
  std::string text = std::isnan(numbers.all) ? "" : ", all = " + PrintGain(factor * numbers.all);
  for (const auto& [name, number] : numbers.groups) {
    text += ", " + QuoteToml(name) + " = " + PrintGain(factor * number);
  }
  overrides->push_back(numbers.key + "={" + text.substr(1) + " }");
}

}  // namespace

std::vector<Slider> MakeGainSliders(const Scenario& scenario) {
  std::vector<Slider> sliders = {{"stiffness K_p"}, {"damping K_v"}};
  if (scenario.joint_task() == nullptr) sliders.push_back({"internal force f_min"});
  return sliders;
}

std::vector<std::string> MakeGainOverrides(const Scenario& scenario, const std::vector<Slider>& sliders) {
  std::vector<std::string> overrides;
  const double stiffness = sliders[0].factor;
  const double damping = sliders[1].factor;
  if (scenario.joint_task() != nullptr) {
    const JointTask& joints = *scenario.joint_task();
    Multiply(joints.natural_frequency, std::sqrt(stiffness), &overrides);
    Multiply(joints.damping_ratio, damping / std::sqrt(stiffness), &overrides);
    Multiply(joints.stiffness, stiffness, &overrides);
    Multiply(joints.damping, damping, &overrides);
    return overrides;
  }
  const ObjectGains& gains = scenario.control.gains;
  if (stiffness != 1.0 || damping != 1.0) {
    const Vector6d K_p = stiffness * gains.K_p;
    const Vector6d K_v = damping * gains.K_v;
    const bool has_frequency = scenario.text.find("natural_frequency") != std::string::npos;
    if (has_frequency) {
      const Vector6d omega = K_p.cwiseSqrt();
      overrides.push_back("control.natural_frequency=" + PrintGain(omega));
      overrides.push_back("control.damping_ratio=" + PrintGain(0.5 * K_v.cwiseQuotient(omega)));
    } else {
      overrides.push_back("control.K_p=" + PrintGain(K_p));
      overrides.push_back("control.K_v=" + PrintGain(K_v));
    }
  }
  if (sliders[2].factor != 1.0) {
    overrides.push_back("control.f_min=" + PrintGain(sliders[2].factor * scenario.control.f_min));
  }
  return overrides;
}

std::string MakeScenarioText(const Scenario& scenario, const std::vector<std::string>& overrides,
                             const std::string& name) {
  constexpr std::string_view kModel = "model.";
  std::vector<std::string> assignments = {"name=" + QuoteToml(name)};
  for (const std::string& assignment : overrides) {
    const bool own = assignment.starts_with("model.file=") || assignment.starts_with("model.overrides");
    if (assignment.starts_with(kModel) && !own) {
      // Of the parameter file; the list of a scenario takes them as they are.
      assignments.push_back("model.overrides+='''" + assignment.substr(kModel.size()) + "'''");
    } else {
      assignments.push_back(assignment);
    }
  }
  const auto add_file = [&](const char* key, const std::string& file) {
    if (!file.empty()) assignments.push_back(key + std::string("=") + QuoteToml(MakeAbsolute(file).string()));
  };
  add_file("model.file", scenario.model_file);
  add_file("plant.mjcf", scenario.mjcf_file);
  if (scenario.controller.exists()) add_file("controller.folder", scenario.controller.folder.string());
  std::string text =
      "# Saved by dexcheck view.\n" + ApplyOverrides(scenario.text, scenario.source, assignments);
  (void)ParseScenario(text, name + ".toml", "", {});
  return text;
}

}  // namespace dexcheck
