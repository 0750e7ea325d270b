#include "harness/diagnosis/run_causes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/checks/step_analysis.h"
#include "harness/comparison/file_causes.h"
#include "harness/corrections/read_printed.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/diagnosis/search_limit.h"
#include "harness/diagnosis/signal_causes.h"
#include "harness/diagnosis/step_forces.h"
#include "harness/diagnosis/telling.h"

namespace dexcheck {
namespace {

/// The largest that a fault of each unit can be in this robot.
std::map<std::string, double> ListMostPlausible(const StepStore& store) {
  const RobotModel& model = store.setup().model();
  double mass = model.base_with_wheels().mass, reach = 0.0, effort = 0.0;
  for (const Joint& joint : model.joints()) {
    mass += joint.body.mass;
    reach += joint.X_PB.translation().norm() + std::abs(joint.mdh.a) + std::abs(joint.mdh.d);
  }
  const mjModel& engine = store.setup().engine();
  for (int i = 0; i < engine.nu; ++i)
    if (engine.actuator_ctrllimited[i] != 0)
      effort = std::max(effort, std::abs(engine.actuator_ctrlrange[2 * i + 1] * engine.actuator_gear[6 * i]));
  if (store.setup().has_object()) mass += store.setup().declared_object().body.mass;
  constexpr double kMany = 10.0, kEarth = 10.0;  // of anything; m/s^2
  const double weight = mass * kEarth;
  const double torque = kMany * std::max(effort, weight * reach), force = kMany * std::max(effort, weight);
  // Friction that takes all torque at a hundredth of a radian or metre a second.
  constexpr double kSlow = 1e-2;
  return {{"N m", torque},
          {"N", force},
          {"N m s/rad", torque / kSlow},
          {"N s/m", force / kSlow},
          {"kg", kMany * mass},
          {"m/s^2", 2.0 * kEarth},
          {"deg", 90.0},
          {"s", 1.0}};
}

/// Whether such a fault can be. What is no size, and what motion does not show, is none.
bool CanBe(const Fault& fault, const std::map<std::string, double>& most_plausible) {
  if (fault.fault == kUnknownFault || std::isnan(fault.value)) return true;
  const bool is_factor = fault.unit.empty();
  const bool has_no_size = fault.value == 0.0 && !is_factor && fault.error != 0.0;
  if (!std::isfinite(fault.value) || has_no_size) return false;
  // No time, mass, friction and size of a step is negative.
  for (const char* kind : {"delay", "lag", "dead zone", "backlash", "noise", "rounding", "mass", "friction"})
    if (fault.value < 0.0 && !is_factor && fault.fault.find(kind) != std::string::npos) return false;
  const auto most = most_plausible.find(fault.unit);
  return most == most_plausible.end() || std::abs(fault.value) <= most->second;
}

/// Impossible faults are left out; a residual that only they would explain is not explained.
void DropImpossible(const StepStore& store, Causes* causes) {
  const std::map<std::string, double> most = ListMostPlausible(store);
  for (Explanation& one : *causes) {
    // A law can ask for anything.
    if (one.faults.empty() || one.channel == CauseChannel::kLaw) continue;
    const std::string place = one.faults.front().place;
    const auto dropped = std::erase_if(one.faults, [&](const Fault& fault) { return !CanBe(fault, most); });
    if (dropped == 0) continue;
    if (one.faults.empty()) {
      one.faults.push_back({kUnknownFault, place, 0.0, 0.0, "", ""});
      one.outcome = CauseOutcome::kNotExplained;
      one.rival.clear();
    } else if (one.outcome != CauseOutcome::kNotExplained) {
      one.SetOutcome();
    }
  }
}

/// Adds a balance that does not hold, and that the search had no time for.
void AddUnsearched(const StepStore& store, Causes* causes) {
  const auto is_balance = [](const Explanation& one) { return one.channel == CauseChannel::kBalance; };
  if (store.has_misplaced_link() || std::ranges::any_of(*causes, is_balance)) return;
  const ForceSteps steps = ListForceSteps(store);
  if (steps.all.empty()) return;
  Explanation one{.channel = CauseChannel::kBalance, .outcome = CauseOutcome::kNotExplained};
  one.from = store.Row(steps.all.front())[0];
  one.to = store.Row(steps.all.back())[0];
  causes->push_back(one);
}

/// Numbers of two descriptions that are at hand, and not only printed, are known to what the engine's
/// diagonalisation of inertias leaves.
void KnowNumbers(PrintedRobot* robot) {
  constexpr double kKnown = 1e-6;  // of a number
  const auto know = [](double value, double* half) {
    *half = std::min(*half, kKnown * std::abs(value) + 1e-12);
  };
  for (PrintedLink& link : robot->links) {
    for (const LinkNumber& number : ListNumbers(&link.origin)) know(*number.value, number.half);
    if (!link.inertial) continue;
    for (const LinkNumber& number : ListNumbers(&*link.inertial)) know(*number.value, number.half);
  }
}

void Replace(std::string_view from, std::string_view to, std::string* text) {
  for (size_t at = 0; (at = text->find(from, at)) != std::string::npos; at += to.size())
    text->replace(at, from.size(), to);
}

/// Facts of the model's geometry and bodies: "joint elbow: origin differs: d 0.394 in the model, 0.384 in the
/// MJCF". None where the search explains only a part.
Causes ListModelCauses(const RobotModel& model, const mjModel& engine) {
  RobotDescription ours{.spec = model.spec()};
  ours.joints.resize(ours.spec.joints.size());
  FileCauses found;
  try {
    PrintedRobot a = PrintDescription(ours);
    PrintedRobot b = PrintDescription(ReadMjcfDescription(engine, "the MJCF"));
    KnowNumbers(&a);
    KnowNumbers(&b);
    found = FindCauses(std::move(a), std::move(b));
  } catch (const InputError&) {
    return {};  // a scene of several robots
  }
  if (found.agrees || !found.unexplained.empty()) return {};
  Causes causes;
  for (const CorrectionItem& item : found.items) {
    Explanation& one = causes.emplace_back();
    one.channel = CauseChannel::kGeometry;
    one.outcome = CauseOutcome::kObserved;
    one.from = -std::numeric_limits<double>::infinity();
    std::string text = item.text;
    Replace(" here", found.of_second ? " in the MJCF" : " in the model", &text);
    Replace("the other file", found.of_second ? "the model" : "the MJCF", &text);
    one.faults.push_back({kUnknownFault, std::move(text), 0.0, 0.0, "", ""});
  }
  return causes;
}

}  // namespace

Causes ExplainRun(const StepStore& store, double void_from, const SearchOptions& options, bool* stopped) {
  const SearchLimit limit(options.seconds);
  Causes causes;
  const auto add = [&](Causes (*explain)(const StepStore&), const StepStore& from) {
    if (SearchLimit::IsOver()) return;
    Causes found = explain(from);
    std::move(found.begin(), found.end(), std::back_inserter(causes));
  };
  const Setup& setup = store.setup();
  const bool has_other_numbers = !setup.constants().findings.empty();
  if (options.model_fails && !has_other_numbers) causes = ListModelCauses(setup.model(), setup.engine());
  const bool is_other_model = has_other_numbers || !causes.empty();
  add(ExplainGeometry, store);
  add(ExplainSignals, store);
  // The law is judged at contacts that are elsewhere, too.
  if (!is_other_model && (!store.has_misplaced_link() || setup.fingertips().empty())) add(ExplainLaw, store);
  if (!is_other_model) {
    add(ExplainContacts, store);
    add(ExplainRolling, store.GetBefore(void_from));
  }
  // A wheel of another size stands higher or lower, too.
  const auto rolls_otherwise = [](const Explanation& one) {
    return one.channel == CauseChannel::kRolling && one.outcome != CauseOutcome::kNotExplained;
  };
  if (std::ranges::any_of(causes, rolls_otherwise))
    std::erase_if(causes, [](const Explanation& one) {
      return one.channel == CauseChannel::kGeometry && one.faults.front().place.starts_with("wheel ");
    });
  if (!is_other_model && !store.has_misplaced_link()) add(ExplainForces, store);
  if (limit.has_ended() && !is_other_model) AddUnsearched(store, &causes);
  if (stopped != nullptr) *stopped = limit.has_ended();
  DropImpossible(store, &causes);
  std::stable_sort(causes.begin(), causes.end(),
                   [](const Explanation& a, const Explanation& b) { return a.channel < b.channel; });
  return causes;
}

namespace {

using Eigen::Index;

// Rounding of a distance, m, and of how the nearest point moves when a radius changes. A mismatch that is
// hardly more says nothing.
constexpr double kDistanceNoise = 1e-14, kFaintest = 1e-12;
constexpr double kRadiusAccuracy = 1e-4;
// The residual may be this fraction of what there was.
constexpr double kExplainsDistance = 0.99;

/// A body whose contacts come nearer by d when it is larger by d: a fingertip, or the object for all of them.
std::vector<Candidate> ListShapes(const Setup& setup, Index tips, Index steps, double noise) {
  std::vector<Candidate> candidates;
  for (Index i = 0; i < tips; ++i) {
    const int tip = setup.fingertips()[static_cast<size_t>(i)];
    MatrixXd column = MatrixXd::Zero(tips, steps);
    column.row(i).setConstant(-1.0 / noise);
    candidates.push_back({.fault = "radius",
                          .place = "fingertip " + setup.model().frames()[static_cast<size_t>(tip)].name,
                          .unit = "m",
                          .nominal = setup.model().tip_radius(tip),
                          .columns = column.reshaped()});
  }
  candidates.push_back({.fault = "surface further out by",
                        .place = "object " + setup.object().name,
                        .unit = "m",
                        .columns = VectorXd::Constant(tips * steps, -1.0 / noise)});
  return candidates;
}

}  // namespace

Causes ExplainGeometry(const StepStore& store) {
  constexpr double kRounding = 1e-10;  // m and rad
  Causes causes;
  for (const StepStore::Misplaced& one : store.misplaced()) {
    // A wheel of another size stands higher or lower, too.
    const bool is_wheel = one.place.starts_with("wheel ");
    if (is_wheel && one.offset.head<2>().norm() <= kRounding && one.turn <= kRounding) continue;
    const double offset = one.offset.norm(), turn = RadToDeg(one.turn);
    const std::string on = " on " + one.parent;
    Explanation& cause = causes.emplace_back();
    cause.channel = CauseChannel::kGeometry;
    cause.from = one.from;
    cause.fraction = 1.0;
    Fault fault{"turned" + on + " by", one.place, turn, 0.0, "deg", ""};
    if (offset > kRounding) {
      fault.fault = "off its place" + on + " by";
      fault.value = offset, fault.unit = "m",
      fault.detail = FormatVector((one.offset.array().abs() > kRounding).select(one.offset, 0.0), 4);
      if (one.turn > kRounding) fault.detail += " and turned by " + FormatNumber(turn, 4) + " deg";
    }
    if (one.axis_turn > 0.0) {
      const mjModel& engine = store.setup().engine();
      const std::string joint = NameOf(engine, mjOBJ_JOINT, engine.body_jntadr[one.body]);
      fault = {"axis turned by", "joint " + joint, RadToDeg(one.axis_turn), 0.0, "deg", ""};
    }
    cause.faults.push_back(fault);
  }
  return causes;
}

Causes ExplainContacts(const StepStore& store) {
  const auto mismatch = store.Get(StepStore::kContactMismatch);
  if (mismatch.size() == 0 || !(mismatch.cwiseAbs().maxCoeff() > kFaintest)) return {};
  const double size = mismatch.cwiseAbs().maxCoeff();
  const double noise = kDistanceNoise + kRadiusAccuracy * size;
  const std::vector<Candidate> candidates =
      ListShapes(store.setup(), mismatch.rows(), mismatch.cols(), noise);
  const VectorXd y = (mismatch / noise).reshaped();
  const CauseSelection selection =
      SelectCauses(y, candidates, {.noise_block_size = static_cast<double>(mismatch.cols())});
  std::vector<Index> steps(static_cast<size_t>(mismatch.cols()));
  std::iota(steps.begin(), steps.end(), 0);
  return DescribeSelection(StartExplanation(store, CauseChannel::kContact, steps), selection, candidates,
                           DescribeNumber, selection.left <= 1.0 || selection.fraction >= kExplainsDistance);
}

namespace {

// Part of the residual, squared, that wheels explain: those that slip do so with the load. One that is 1 %
// too large in scenario curve explains 0.976.
constexpr double kExplains = 0.95;
// A wheel that is off by more of its size is none of this platform.
constexpr double kLargestError = 0.5;
// Noise is taken for this many times what the explanation leaves.
constexpr double kLevel = 5.0;

/// Two wheels that are off by different amounts are two faults, not one that both have and another of one.
/// One that explains hardly anything beside another is made by a platform that tilts.
CauseSelection SelectWheels(const VectorXd& y, std::vector<Candidate>* candidates,
                            const CauseOptions& options) {
  constexpr double kLeast = 0.05;  // of the fraction that the first explains
  CauseSelection selection = SelectCauses(y, *candidates, options);
  const auto count = std::ranges::count_if(selection.terms, [&](const CauseTerm& term) {
    return (*candidates)[term.candidate].fault == candidates->front().fault;
  });
  if (count > 1 && candidates->front().place == "wheels") {
    candidates->erase(candidates->begin());
    selection = SelectCauses(y, *candidates, options);
  }
  std::vector<Candidate> kept;
  for (const CauseTerm& term : selection.terms)
    if (term.fraction >= kLeast * selection.terms.front().fraction)
      kept.push_back((*candidates)[term.candidate]);
  if (kept.size() == selection.terms.size()) return selection;
  *candidates = kept;
  return SelectCauses(y, *candidates, options);
}

}  // namespace

Causes ExplainRolling(const StepStore& store) {
  const Base& base = store.setup().model().base();
  if (base.type != BaseType::kDifferentialDrive) return {};
  const auto mismatch = store.Get(StepStore::kWheelMismatch);
  const auto rates = store.Get(StepStore::kWheelRates);
  const auto noise = store.Get(StepStore::kWheelNoise);
  std::vector<Index> steps;
  for (Index i = 0; i < store.size(); ++i)
    if (noise(0, i) > 0.0 && noise(1, i) > 0.0) steps.push_back(i);
  if (steps.empty()) return {};
  const auto count = static_cast<Index>(steps.size());
  VectorXd y(2 * count);
  bool fails = false;  // the check
  std::vector<Candidate> candidates;
  for (const auto& [fault, place, nominal] : {std::tuple{"radius", "wheels", base.wheel_radius},
                                              {"distance", "wheels", base.wheel_distance},
                                              {"radius", base.wheel_joint_right.c_str(), base.wheel_radius},
                                              {"radius", base.wheel_joint_left.c_str(), base.wheel_radius}}) {
    const bool is_one = std::string_view(place) != "wheels";
    candidates.push_back({.fault = fault,
                          .place = is_one ? std::string("wheel ") + place : place,
                          .unit = "m",
                          .nominal = nominal,
                          .columns = MatrixXd::Zero(2 * count, 1),
                          .scale = VectorXd::Constant(1, nominal),
                          .is_possible = [nominal = nominal](const VectorXd& a) {
                            return std::abs(a[0]) <= kLargestError * nominal;
                          }});
  }
  for (Index k = 0; k < count; ++k) {
    const Index step = steps[static_cast<size_t>(k)];
    const double turn = CalcRollingTwist(base, store.Get(StepStore::kVelocity).col(step))[1];
    for (const Index wheel : {0, 1}) {
      const Index row = 2 * k + wheel;
      const double unit = 1.0 / noise(wheel, step);
      const double rate = rates(wheel, step) * unit;
      y[row] = mismatch(wheel, step) * unit;
      fails = fails || std::abs(mismatch(wheel, step)) > noise(wheel, step) + store.rolling_bound();
      candidates[0].columns(row, 0) = rate;
      candidates[1].columns(row, 0) = (wheel == 0 ? -0.5 : 0.5) * turn * unit;
      candidates[static_cast<size_t>(2 + wheel)].columns(row, 0) = rate;
    }
  }
  // Slip changes with the load, in some steps.
  constexpr double kAlike = 8.0;
  if (y.squaredNorm() <= static_cast<double>(y.size())) return {};
  const CauseOptions options{.most_terms = 3,
                             .noise_block_size = std::min(kAlike, static_cast<double>(count))};
  CauseSelection selection = SelectWheels(y, &candidates, options);
  const bool explained = selection.fraction >= kExplains;
  if (!explained && !fails) return {};
  if (const double level = kLevel * selection.left; explained && level < 1.0) {
    y /= level;
    for (Candidate& one : candidates) one.columns /= level;
    selection = SelectWheels(y, &candidates, options);
  }
  return DescribeSelection(StartExplanation(store, CauseChannel::kRolling, steps), selection, candidates,
                           DescribeNumber, explained);
}

}  // namespace dexcheck
