#include "harness/checks/run_checks.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "controller/common/text.h"
#include "harness/base/ranges.h"
#include "harness/base/worst.h"

namespace dexcheck {
namespace {

void ReadModelContacts(const GraspTerms& grasp, const MeasuredState& state, LawTerms* terms) {
  terms->J = grasp.J_B();
  terms->J_dot_xi.noalias() = grasp.J_B_dot() * state.xi;
  terms->G = grasp.G();
  terms->G_dot_T_V.noalias() = grasp.G_dot().transpose() * grasp.V_Bo();
}

void ReadEngineContacts(const EngineProvider& engine, LawTerms* terms) {
  for (size_t i = 0; i < engine.contacts().size(); ++i) {
    const auto row = 3 * static_cast<Eigen::Index>(i);
    const ContactValues& contact = engine.contacts()[i];
    terms->J.middleRows<3>(row) = contact.J_B;
    terms->J_dot_xi.segment<3>(row) = contact.J_B_dot_xi;
    terms->G.middleCols<3>(row) = contact.G;
    terms->G_dot_T_V.segment<3>(row) = contact.G_dot_T_V;
  }
}

/// Reads the law's terms by the engine: all that the table of terms has evaluated on its side. C_bar' and
/// J_B_dot', which multiply only the slip, and X_o's branch of the angles are the model's.
/// @param contacts whether the engine has contacts to compare; it has no bonds, whose terms are the model's.
/// @param terms keeps pointers into model and engine.
void ReadEngineTerms(const EngineProvider& engine, const GraspModel& model, const MeasuredState& state,
                     bool contacts, LawTerms* terms) {
  terms->q = state.q;
  terms->xi = state.xi;
  terms->M = &engine.M();
  terms->C = &model.robot().C();
  terms->J_dot = &model.grasp().J_B_dot();
  if (model.has_coordinates()) terms->X_o = model.grasp().X_o();

  const EngineTerms& robot = engine.terms();
  terms->C_xi = robot.coriolis();
  terms->gravity = robot.gravity();
  terms->friction = robot.friction();
  const ObjectValues& object = engine.object();
  terms->X_Bo.matrix().topRows<3>() = object.pose;
  terms->V_Bo = object.V_Bo;
  terms->M_hat = object.M_hat;
  terms->C_hat_V = object.C_hat_V;
  terms->N_o = object.N_o;
  if (contacts) {
    ReadEngineContacts(engine, terms);
  } else {
    ReadModelContacts(model.grasp(), state, terms);
  }
}

}  // namespace

RunChecks::RunChecks(const Setup& setup, std::span<const Motor> motors, bool knows_law)
    : setup_(&setup),
      model_(setup.plant_adapter(), setup.fingertips(), setup.scenario().control.orientation),
      declared_(setup, motors),
      analyzer_(setup),
      law_(MakeJudgedLaw(setup, knows_law)),
      law_terms_(setup.model().num_positions(), setup.model().num_velocities(),
                 3 * static_cast<int>(setup.fingertips().size())),
      judges_(MakeChecks(setup, law_.get())) {
  if (!setup.start().bonds.empty()) model_.LeaveOutContacts();
  model_.RaiseBounds(setup.scenario().tolerance);
  for (const Judge& judge : judges_) records_.push_back(judge.record);
  if (law_) analyzer_.SetSpectralRadius(law_->CalcSpectralRadius().value_or(0.0));
  if (!declared_.is_ideal()) CheckMeasuredState();
  if (!setup.scenario().imperfections.actuation.saturates()) return;
  const CheckInfo& effort = *FindCheck("actuator_effort");
  limited_ = CheckRecord{.name = std::string(effort.name), .kind = effort.category, .bound = 1.0};
}

void RunChecks::CheckMeasuredState() {
  controller_.emplace(setup_->controller_adapter(), setup_->fingertips(),
                      setup_->scenario().control.orientation);
  // Measured robot, object and contacts need not fit together: contacts are compared at the true state.
  controller_->LeaveOutContacts();
  controller_->RaiseBounds(setup_->scenario().tolerance);
}

void RunChecks::Follow(const StepRecord& step) {
  declared_step_ = &declared_.Follow(step);
  if (!declared_step_->is_measured_right && !controller_) CheckMeasuredState();
}

void RunChecks::Reset(Keep keep) {
  for (CheckRecord& record : records_) {
    const bool is_kept = record.failed && (keep == Keep::kAll || HoldsAlways(record));
    if (is_kept && FindIn(settling_failures_, record.name, &CheckRecord::name) == nullptr)
      settling_failures_.push_back(record);
    record.Reset();
  }
  if (limited_) limited_->Reset();
  for (const Judge& judge : judges_)
    if (judge.state) judge.state->Reset();
  analyzer_.Reset();
  if (law_) law_->Forget();
  if (keep == Keep::kAll) analyzer_.RestartClearance();
}

bool RunChecks::Has(std::string_view name) const {
  return std::ranges::any_of(records_, [&](const CheckRecord& record) { return record.name == name; });
}

const CheckRecord& RunChecks::Find(std::string_view name) const {
  for (const CheckRecord& record : records_)
    if (record.name == name) return record;
  throw std::invalid_argument("no check " + Quote(name));
}

void RunChecks::Evaluate(CheckInfo::Moment moment, double time) {
  for (size_t i = 0; i < judges_.size(); ++i) {
    if ((judges_[i].info->by.moments & moment) != 0) Add(judges_[i], &records_[i], time);
  }
}

void RunChecks::Add(const Judge& judge, CheckRecord* record, double time) {
  if (!record->applies) return;
  const Evaluation found = judge.Evaluate(analysis());
  if (!found) return;
  const bool had_failed = record->failed;
  double value = found->value;
  // The value counts in full up to the bound; above the bound its explained part is subtracted.
  if (!found->residual && found->explained != 0.0 && !std::isnan(value))
    value = Worst(std::min(value, record->bound), value - found->explained);
  record->Add(value, time, found->residual.value_or(found->value), found->explained);
  if (judge.info->by.describe != nullptr && record->failed && !had_failed)
    record->part = judge.info->by.describe(analyzer_, found->part);
  differs_ = differs_ || !(record->last <= record->bound);
}

void RunChecks::JudgeEffort(const StepRecord& step, double time) {
  analyzer_.SetStep(step);
  Evaluate(CheckInfo::kBefore, time);
  if (limited_) limited_->Add(step.drive.effort, time);
}

void RunChecks::JudgeModel(const StepRecord& step) {
  const MeasuredState& state = step.reading.state;
  if (step.command.handling.partial) {
    model_.IncludeContacts(
        std::ranges::all_of(state.overlap, [](double depth) { return depth > -PlantReading::kFar; }));
  }
  const GraspModel& plant = *declared_step_->model;
  model_.Compare(plant.robot(), plant.grasp(), state, step.reading.X_W0, step.time, step.reading.evaluated);
  if (!controller_) return;
  controller_->Compare(step.model->robot(), step.model->grasp(), step.measured.state, step.reading.X_W0,
                       step.time);
  model_.Merge(*controller_);
}

void RunChecks::Look(const StepRecord& step) {
  differs_ = false;
  analyzer_.Begin(step, *declared_step_);
}

void RunChecks::JudgeSettling(const StepRecord& step) {
  Analyze(step);
  if (CompareTorque(step)) analyzer_.SetLaw(unsent_);
  Evaluate(CheckInfo::kSettling, step.time);
}

bool RunChecks::CompareTorque(const StepRecord& step) {
  if (!law_ || !law_->IsComputed(step.command)) return false;
  // Fingertips may still find their places, so contacts are the controller's.
  (controller_ ? *controller_ : model_).SetState(step.model->grasp(), step.measured.state);
  unsent_.torque = law_->CompareTorque(step, ReadLawTerms(step, /*contacts=*/false));
  return true;
}

void RunChecks::JudgeStep(const StepRecord& step) {
  Analyze(step);
  if (law_ && law_->IsComputed(step.command)) CompareLaw(step);
  Evaluate(CheckInfo::kRunning, step.time);
}

void RunChecks::JudgeUnsent(const StepRecord& step) {
  const bool has_law = law_ && law_->IsComputed(step.command);
  if (has_law) JudgeModel(step);
  Look(step);
  if (!has_law) return;
  unsent_.torque = law_->CompareTorque(step, ReadLawTerms(step, /*contacts=*/true));
  analyzer_.SetLaw(unsent_);
  Evaluate(CheckInfo::kUnsent, step.time);
}

void RunChecks::Analyze(const StepRecord& step) {
  Look(step);
  analyzer_.Analyze();
}

const LawTerms& RunChecks::ReadLawTerms(const StepRecord& step, bool contacts) {
  const StepModelCheck& controller = controller_ ? *controller_ : model_;
  contacts = contacts && setup_->start().bonds.empty() && !controller_;
  ReadEngineTerms(controller.engine(), *step.model, step.measured.state, contacts, &law_terms_);
  return law_terms_;
}

void RunChecks::CompareLaw(const StepRecord& step) {
  const bool as_commanded = declared_.is_ideal() && declared_step_->is_measured_right &&
                            step.drive.tau == step.command.tau && step.response.stop_force.size() == 0;
  const LawErrors& errors =
      law_->Compare(step, ReadLawTerms(step, /*contacts=*/true), analyzer_, as_commanded);
  analyzer_.SetLaw(errors);
  if (!law_->follows_error() || step.time < setup_->scenario().expect.from) return;
  position_by_law_ = Worst(position_by_law_, errors.position_by_law);
  orientation_by_law_ = Worst(orientation_by_law_, errors.orientation_by_law);
}

}  // namespace dexcheck
