#include "harness/diagnosis/force_problem.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "controller/common/linear_algebra.h"
#include "harness/diagnosis/run_causes.h"
#include "harness/diagnosis/search_limit.h"
#include "harness/diagnosis/telling.h"

namespace dexcheck {
namespace {

using Eigen::Index;
using namespace force_fault;

// A residual of this many times the noise is explained all the same; and one that is this part of what there
// was, squared: an effect beside it that nothing names.
constexpr double kLeft = 3.0, kLeftPart = 1e-12;
constexpr size_t kFew = 2;  // faults that may leave such an effect: more of them are made to fit
// Effect in units of the noise, root mean square, of an inertia that another centre of mass does not make.
constexpr double kBeyond = 3.0;
// Fraction from which on columns that depend on the sizes of faults are made anew with these.
constexpr double kNearly = 0.9;
// Part of a column beside others that is no rounding, in all steps and in one.
constexpr double kIndependent = 1e-12, kIndependentAtStep = 1e-9;
constexpr Index kMostGrowing = 1000;  // pushes that grow, from all times that are tried

/// Returns the key of a push that grows.
std::string NameGrowing(const Candidate& push) { return push.place + push.fault + kGrows; }

/// Returns whether a candidate pushes independently of the motion.
bool IsPush(const Candidate& one) {
  return one.fault == "torque" || one.fault == kForce || one.fault == "moment";
}

/// Returns whether a fault may come and go: forces, and not what the robot is.
bool MayEnd(const Candidate& one) {
  return one.fault == "torque" || one.fault.starts_with("force") || one.fault.starts_with("moment");
}

/// Returns whether a fault may begin in a run: something may be picked up, too.
bool MayBegin(const Candidate& one) { return MayEnd(one) || one.fault == "mass" || one.fault == "payload"; }

}  // namespace

ForceProblem::ForceProblem(const StepStore& store, StepForces* forces, const ForceSteps& steps, Growth growth)
    : store_(store),
      forces_(forces),
      steps_(steps),
      growth_(growth),
      count_(static_cast<Index>(steps.rows.size())) {
  forces->SetGravity(forces->model().gravity());
  Build();
}

bool ForceProblem::IsExplained(const CauseSelection& selection) {
  const bool is_whole = selection.left <= kLeft;
  return selection.fraction > 0.0 &&
         (is_whole || (selection.terms.size() <= kFew && 1.0 - selection.fraction <= kLeftPart));
}

bool ForceProblem::ExplainConstant(Causes* causes) {
  CauseSelection selection = Select();
  if (growth_ == Growth::kWithin && !SearchLimit::IsOver() && NarrowGrowing(selection)) selection = Select();
  if (!IsExplained(selection)) return false;
  if (ExplainJoint(selection, causes)) return true;
  Causes found =
      DescribeSelection(StartExplanation(store_, CauseChannel::kBalance, steps_.all), selection, candidates_,
                        [&](const Candidate& one, const VectorXd& amplitude, const VectorXd& error) {
                          return MakeForceFault(one, amplitude, error, forces_->model());
                        });
  for (size_t i = 0; i < found.size(); ++i) SetTimes(selection.terms[i], &found[i]);
  std::move(found.begin(), found.end(), std::back_inserter(*causes));
  return true;
}

void ForceProblem::SetTimes(const CauseTerm& term, Explanation* one) const {
  const Candidate& candidate = candidates_[term.candidate];
  const StepRange& within = within_[term.candidate];
  if (within.begin > 0) {
    one->from = steps_.rows[static_cast<size_t>(within.begin)][0];
    one->unseen_before = 0.0;
  }
  if (within.end < count_) {
    one->to = steps_.rows[static_cast<size_t>(within.end - 1)][0];
    one->unseen_after = 0.0;
    one->ends = true;
  }
  if (!candidate.fault.ends_with(kGrows)) return;
  const double since = CalcGrowthBegin(term.amplitude, candidate.nominal);
  const auto time = store_.Get(StepStore::kTime);
  const std::vector<Index>& all = steps_.all;
  const auto first = std::find_if(all.begin(), all.end() - 1, [&](Index i) { return time(0, i) > since; });
  const Explanation later = StartExplanation(store_, one->channel, std::vector<Index>(first, all.end()));
  one->from = later.from, one->unseen_before = later.unseen_before;
}

bool ForceProblem::ExplainJoint(const CauseSelection& selection, Causes* causes) const {
  // A soft stop of a joint is exactly a spring, friction and armature.
  const size_t fewest = is_exact_ ? 3 : 2;
  if (selection.terms.size() < fewest) return false;
  const std::string& place = candidates_[selection.terms.front().candidate].place;
  const bool is_of_one =
      std::all_of(selection.terms.begin(), selection.terms.end(),
                  [&](const CauseTerm& term) { return candidates_[term.candidate].place == place; });
  if (is_exact_ && !is_of_one) return false;
  for (const Free& torque : FitAll({"torque"})) {
    const bool leaves_noise = torque.residual.squaredNorm() <= static_cast<double>(y_.size());
    const bool is_joint = is_of_one && candidates_[torque.candidate].place == place;
    if (!is_joint && !leaves_noise) continue;
    Explanation one = DescribeFree(torque);
    for (const CauseTerm& term : selection.terms)
      one.faults.push_back(
          MakeForceFault(candidates_[term.candidate], term.amplitude, term.error, forces_->model()));
    causes->push_back(one);
    return true;
  }
  return false;
}

void ForceProblem::ExplainChanging(Causes* causes) const {
  const std::vector<Free> all = FitAll({"torque", kForce, "moment", "force and moment"});
  if (all.empty()) return;
  Explanation one = DescribeFree(all.front());
  // A wrench at the end of an arm explains whatever its joints do.
  const Free& best = all.front();
  const bool says_nothing = best.spans_rows && candidates_[best.candidate].fault != "torque";
  if (!(one.left <= kLeft) || says_nothing) one.outcome = CauseOutcome::kNotExplained;
  for (size_t i = 1; i < all.size() && one.rival.empty(); ++i) {
    const double odds = 0.5 * (all[i].criterion - all.front().criterion);
    if (odds >= kEqualLogOdds) {
      one.SetRival(candidates_[all[i].candidate], odds);
    } else {
      one.faults.push_back(DescribeFree(all[i]).faults.front());
    }
  }
  causes->push_back(one);
}

std::vector<ForceProblem::Free> ForceProblem::FitAll(std::initializer_list<const char*> faults) const {
  std::vector<Free> all;
  for (size_t i = 0; i < constant_; ++i)
    if (std::ranges::find(faults, candidates_[i].fault) != faults.end()) all.push_back(FitFree(i));
  std::ranges::stable_sort(all, {}, &Free::criterion);
  return all;
}

ForceProblem::Free ForceProblem::FitFree(size_t index) const {
  const Candidate& candidate = candidates_[index];
  Free free{.candidate = index, .residual = y_};
  for (Index k = 0; k < count_; ++k) {
    const Index begin = k * forces_->rows();
    const MatrixXd C = candidate.columns.middleRows(begin, forces_->rows());
    auto left = free.residual.segment(begin, forces_->rows());
    const VectorXd a = SolveLeastSquares(C, left, kIndependentAtStep);
    left -= C * a;
    const auto used = (C.array() != 0.0).rowwise().any().count();
    free.spans_rows = free.spans_rows || (used > 0 && C.cols() >= used);
    free.largest = std::max(free.largest, a.head(std::min<Index>(3, a.size())).norm());
  }
  const double rows = static_cast<double>(y_.size());
  free.criterion = rows * std::log(1.0 + free.residual.squaredNorm() / rows) +
                   static_cast<double>(candidate.columns.cols() * count_) * std::log(rows);
  return free;
}

Explanation ForceProblem::DescribeFree(const Free& free) const {
  const Candidate& candidate = candidates_[free.candidate];
  Explanation one = StartExplanation(store_, CauseChannel::kBalance, steps_.all);
  one.fraction = 1.0 - free.residual.squaredNorm() / y_.squaredNorm();
  one.left = std::sqrt(free.residual.squaredNorm() / static_cast<double>(y_.size()));
  one.outcome = CauseOutcome::kNamedClass;
  one.faults.push_back({candidate.fault + kChanges, candidate.place, free.largest, 0.0, candidate.unit, ""});
  return one;
}

void ForceProblem::Build() {
  const Index rows = forces_->rows();
  y_.resize(rows * count_);
  candidates_.clear();
  turns_.clear();
  for (Index i = 0; i < count_; ++i) {
    forces_->SetStep(steps_.rows[static_cast<size_t>(i)]);
    turns_.push_back(forces_->ListTurns());
    y_.segment(i * rows, rows) = forces_->CalcResidual();
    forces_->AddColumns(i * rows, count_, &candidates_);
  }
  constant_ = candidates_.size();
  AddGrowing();
  NameStuckBearings();
  within_.assign(candidates_.size(), {0, count_});
  AddProfiles();
  AddForcesAtPoints(y_, turns_, forces_->reach(), &candidates_);
  within_.resize(candidates_.size(), {0, count_});
}

MatrixXd ForceProblem::Mask(MatrixXd columns, const StepRange& within) const {
  const Index rows = forces_->rows();
  columns.topRows(within.begin * rows).setZero();
  columns.bottomRows((count_ - within.end) * rows).setZero();
  return columns;
}

VectorXd ForceProblem::CalcChange(size_t jump) const {
  const Index row = steps_.begins[jump];
  return steps_.changes[jump].cwiseQuotient(store_.CalcNoise(steps_.rows[static_cast<size_t>(row)]));
}

std::vector<size_t> ForceProblem::RankAt(size_t jump) const {
  constexpr size_t kFewest = 4, kMost = 12;  // more only of those that explain all
  constexpr double kWhole = 1e-6;            // of the change, squared, what that leaves
  const Index rows = forces_->rows();
  const Index begin = steps_.begins[jump];
  const VectorXd change = CalcChange(jump);
  // By their columns: what each leaves. Of torques, several of which may begin or end at once, the largest.
  std::map<Index, std::vector<std::pair<double, size_t>>> ranked;
  for (size_t i = 0; i < constant_; ++i) {
    if (!MayBegin(candidates_[i])) continue;
    const MatrixXd C = candidates_[i].columns.middleRows(begin * rows, rows);
    const bool is_torque = candidates_[i].fault == "torque";
    ranked[is_torque ? 0 : C.cols()].emplace_back((change - C * SolveLeastSquares(C, change)).squaredNorm(),
                                                  i);
  }
  std::vector<size_t> chosen;
  for (auto& [width, some] : ranked) {
    std::sort(some.begin(), some.end());
    for (size_t k = 0; k < std::min(kMost, some.size()); ++k)
      if (k < kFewest || some[k].first < kWhole * change.squaredNorm()) chosen.push_back(some[k].second);
  }
  return chosen;
}

void ForceProblem::AddProfiles() {
  std::vector<std::vector<size_t>> chosen;
  for (size_t j = 0; j < steps_.begins.size(); ++j) chosen.push_back(RankAt(j));
  const auto add = [&](size_t candidate, const StepRange& within, size_t jump) {
    Candidate one = candidates_[candidate];
    one.columns = Mask(std::move(one.columns), within);
    one.parameters += 1;
    if (one.fault == "force and moment") {
      const Index rows = forces_->rows(), begin = steps_.begins[jump];
      const MatrixXd columns = candidates_[candidate].columns.middleRows(begin * rows, rows);
      const VectorXd wrench = SolveLeastSquares(columns, CalcChange(jump));
      if (auto point =
              MakeForceOfWrench(one.place, wrench, within, begin, forces_->reach(), turns_, candidates_)) {
        point->parameters += 1;
        candidates_.push_back(*std::move(point));
        within_.push_back(within);
      }
    }
    candidates_.push_back(std::move(one));
    within_.push_back(within);
  };
  for (size_t j = 0; j < chosen.size(); ++j) {
    const Index begin = steps_.begins[j];
    for (const size_t candidate : chosen[j]) {
      add(candidate, {begin, count_}, j);
      if (!MayEnd(candidates_[candidate])) continue;
      add(candidate, {0, begin}, j);
      for (size_t later = j + 1; later < chosen.size(); ++later)
        if (std::ranges::find(chosen[later], candidate) != chosen[later].end())
          add(candidate, {begin, steps_.begins[later]}, j);
    }
  }
}

void ForceProblem::AddGrowing() {
  std::vector<Candidate> pushes;
  std::copy_if(candidates_.begin(), candidates_.end(), std::back_inserter(pushes), IsPush);
  if (!growing_.empty())
    std::erase_if(pushes, [&](const Candidate& one) { return growing_.count(NameGrowing(one)) == 0; });
  // With many of them, not each time of their begin is tried.
  const auto skipped = static_cast<Index>(pushes.size()) * count_ / kMostGrowing;
  // With one step they are only there to be known.
  for (Index first = 0; first + 1 < std::max<Index>(2, count_); first += 1 + skipped) {
    for (const Candidate& push : pushes) candidates_.push_back(MakeGrowing(push, first, skipped));
    if (growth_ == Growth::kBefore) break;
  }
}

bool ForceProblem::NarrowGrowing(const CauseSelection& selection) {
  for (const CauseTerm& term : selection.terms)
    if (const Candidate& one = candidates_[term.candidate]; one.fault.ends_with(kGrows))
      growing_.insert(one.place + one.fault);
  if (growing_.empty()) return false;
  Build();
  return true;
}

Candidate ForceProblem::MakeGrowing(const Candidate& push, Index first, Index skipped) const {
  const auto time = store_.Get(StepStore::kTime);
  const auto time_of = [&](Index k) { return steps_.rows[static_cast<size_t>(k)][0]; };
  constexpr double kRounding = 1e-9;  // s
  const Index rows = forces_->rows(), width = push.columns.cols();
  Candidate growing = push;
  growing.fault += kGrows;
  growing.unit += "/s";
  growing.nominal = store_.last_time();
  growing.scale = push.scale.replicate(2, 1);
  growing.columns = MatrixXd::Zero(rows * count_, 2 * width);
  for (Index k = first; k < count_; ++k) {
    const auto at = push.columns.middleRows(k * rows, rows);
    growing.columns.middleRows(k * rows, rows) << (time_of(k) - growing.nominal) * at, at;
  }
  // A push that began before all that is kept did not show yet.
  const MatrixXd shows = push.columns.middleRows(first * rows, rows);
  const double before = store_.size() > 1 ? 2.0 * time(0, 0) - time(0, 1) : time(0, 0);
  const double earliest = (first > skipped ? time_of(first - 1 - skipped) : before) - kRounding;
  growing.is_possible = [=, steps = count_, last = time_of(std::min(first + skipped, count_ - 1)) + kRounding,
                         end = growing.nominal](const VectorXd& a) {
    const double since = CalcGrowthBegin(a, end);
    const double hidden = (earliest - since) * (shows * a.head(width)).norm();
    return steps > 1 && since <= last && hidden <= kFails * std::sqrt(static_cast<double>(rows));
  };
  return growing;
}

void ForceProblem::NameStuckBearings() {
  const RobotModel& model = forces_->model();
  for (Candidate& one : candidates_) {
    if (one.fault != kBearing) continue;
    int dof = 0;
    while (one.place != "joint " + model.dof_name(dof)) ++dof;
    const Index row = model.num_base_velocities() + dof;
    // rad/s or m/s, and of the largest friction, which is one and the same wherever it slides
    constexpr double kSlides = 1e-4, kLargest = 1.0 - 1e-9;
    int sliding = 0;
    for (const VectorXd& step : steps_.rows)
      sliding += static_cast<int>(
          std::abs(store_.Part(step, StepStore::kMotionVelocity)[row]) > kSlides &&
          std::abs(store_.Part(step, StepStore::kDryFriction)[forces_->FindDryFriction(dof)]) >=
              kLargest * one.nominal);
    if (4 * sliding < count_) one.fault = kStuckBearing;
  }
}

double ForceProblem::CalcLeft(const VectorXd& y) {
  return y.norm() / std::sqrt(static_cast<double>(y.size()));
}

bool ForceProblem::RefinePoints(const CauseSelection& selection) {
  if (selection.terms.size() < 2) return false;
  bool is_refined = false;
  for (const CauseTerm& term : selection.terms) {
    Candidate& one = candidates_[term.candidate];
    if (one.fault != kForceAtPoint) continue;
    MatrixXd beside(y_.size(), 0);
    for (const CauseTerm& other : selection.terms) {
      if (other.candidate == term.candidate) continue;
      const MatrixXd& columns = candidates_[other.candidate].columns;
      beside.conservativeResize(Eigen::NoChange, beside.cols() + columns.cols());
      beside.rightCols(columns.cols()) = columns;
    }
    auto refined = RefinePoint(y_, turns_, forces_->reach(), one, term.amplitude, within_[term.candidate],
                               beside, candidates_);
    if (!refined) continue;
    refined->parameters = one.parameters;
    one = *std::move(refined);
    is_refined = true;
  }
  return is_refined;
}

bool ForceProblem::RefineCenters(const CauseSelection& selection) {
  bool is_refined = false;
  for (const CauseTerm& term : selection.terms) {
    Candidate& one = candidates_[term.candidate];
    if (one.fault != kCenterAlone) continue;
    double more = 0.0;  // kg
    for (const CauseTerm& other : selection.terms) {
      const Candidate& beside = candidates_[other.candidate];
      const bool is_mass = beside.fault == "mass" || beside.fault == kMassWithInertia;
      if (is_mass && beside.place == one.place) more += other.amplitude[0];
    }
    one.columns =
        Mask(CalcCenterColumns(one.place, term.amplitude, more, candidates_), within_[term.candidate]);
    is_refined = true;
  }
  return is_refined;
}

CauseSelection ForceProblem::SelectRefined() {
  // A single step cannot distinguish faults.
  const CauseOptions options{.most_terms = std::min<size_t>(5, steps_.rows.size()),
                             .exchanges_pairs = !growing_.empty(),
                             .least_gain = 0.5 * static_cast<double>(y_.size()),
                             .independent = kIndependent};
  CauseSelection selection = SelectCauses(y_, candidates_, options);
  if (selection.fraction < kNearly) return selection;
  if (!SearchLimit::IsOver() && RefinePoints(selection)) selection = SelectCauses(y_, candidates_, options);
  // Columns of a centre of mass depend on where it is.
  constexpr int kMostRefinements = 3;
  for (int i = 0; i < kMostRefinements && !SearchLimit::IsOver() && RefineCenters(selection); ++i)
    selection = SelectCauses(y_, candidates_, options);
  return selection;
}

bool ForceProblem::IsOneBody(const CauseTerm& term) const {
  const Candidate& one = candidates_[term.candidate];
  if ((one.fault != kCenter && one.fault != "payload") || !term.error.allFinite()) return true;
  if (one.fault == "payload") return IsPossibleLoad(term.amplitude, term.error);
  const double mass = FindCandidate(candidates_, "mass", one.place).nominal;
  const Vector6d beyond =
      term.amplitude.tail<6>() - ToEntries(CalcPointInertia(mass, term.amplitude.head<3>()));
  return (FindCandidate(candidates_, "inertia", one.place).columns * beyond).norm() <=
         kBeyond * std::sqrt(static_cast<double>(y_.size()));
}

CauseSelection ForceProblem::SelectPlain() {
  std::vector<std::pair<Candidate*, VectorXd>> hidden;
  for (Candidate& one : candidates_) {
    if (one.fault != "payload" && one.fault != kCenter) continue;
    hidden.emplace_back(&one, one.scale);
    one.scale.setZero();  // shows nothing
  }
  CauseSelection plain = SelectRefined();
  for (auto& [one, scale] : hidden) one->scale = scale;
  return plain;
}

CauseSelection ForceProblem::Select() {
  CauseSelection selection = SelectRefined();
  const bool is_possible =
      std::ranges::all_of(selection.terms, [&](const CauseTerm& term) { return IsOneBody(term); });
  const bool has_payload = std::ranges::any_of(
      selection.terms, [&](const CauseTerm& term) { return candidates_[term.candidate].fault == "payload"; });
  if ((has_payload || !is_possible) && !SearchLimit::IsOver()) {
    const CauseSelection plain = SelectPlain();
    const bool is_likelier = !is_possible || plain.criterion < selection.criterion;
    if (is_likelier && plain.left <= std::max(1.0, selection.left) && !SearchLimit::IsOver())
      selection = plain;
  }
  // No body has it, and there was no time to find what has.
  if (!is_possible && SearchLimit::IsOver()) return {.residual = y_};
  for (const CauseTerm& term : selection.terms) {
    if (SearchLimit::IsOver()) break;
    if (candidates_[term.candidate].place != kWorld || selection.terms.size() == 1) continue;
    // Masses that differ fall as all do.
    const Vector3d& g = forces_->model().gravity();
    const bool is_size = candidates_[term.candidate].fault == kGravitySize;
    const Vector3d change = is_size ? Vector3d(term.amplitude[0] * g.normalized()) : Vector3d(term.amplitude);
    if (!forces_->SetGravity(g + change)) break;
    Build();
    selection = SelectRefined();
    break;
  }
  selection.left = CalcLeft(selection.residual);
  is_exact_ = selection.left <= 1.0;
  return selection;
}

Causes ExplainForces(const StepStore& store) {
  Causes causes;
  const ForceSteps steps = ListForceSteps(store);
  if (steps.all.empty()) return causes;
  StepForces forces(store);
  ForceProblem problem(store, &forces, steps);
  const bool is_explained = problem.ExplainConstant(&causes);
  if ((is_explained && problem.is_exact()) || SearchLimit::IsOver()) return causes;
  // One that grows from a time on.
  ForceProblem growing(store, &forces, steps, ForceProblem::Growth::kWithin);
  Causes grown;
  if (growing.ExplainConstant(&grown) && growing.is_exact() && !SearchLimit::IsOver()) return grown;
  if (!is_explained) problem.ExplainChanging(&causes);
  return causes;
}

}  // namespace dexcheck
