#include "harness/diagnosis/force_problem.h"

#include <algorithm>
#include <cmath>

#include "controller/common/linear_algebra.h"
#include "harness/diagnosis/search_limit.h"
#include "harness/diagnosis/telling.h"

namespace dexcheck {
namespace {

using Eigen::Index;
using namespace force_fault;

// Columns agree with what a fault does to this fraction: platforms tilt, and wheels slip, by as much.
constexpr double kAccuracy = 1e-4;
// A residual of this many times the noise is explained all the same.
constexpr double kLeft = 3.0;
// And of what there is to explain, squared, at least this fraction.
constexpr double kLeastFraction = 0.99;
// Noise is taken for this many times what the explanation leaves, down to rounding, in bounds of the checks,
// and to what columns are known to, those of a platform to less; found anew so often.
constexpr double kOfLeft = 5.0, kRounding = 1e-4, kExact = 1e-7, kExactOnWheels = 2e-5;
constexpr int kMostLevels = 4;
// Effect in units of the noise, root mean square, of an inertia that another centre of mass does not make.
constexpr double kBeyond = 3.0;
constexpr Index kMostSteps = 20;      // that are looked at
constexpr Index kMostGrowing = 1000;  // pushes that grow, from all times that are tried

/// An explanation of all steps is one of those from that time on, s.
void SetBegin(const StepStore& store, const Segment& all, double since, Explanation* one) {
  const auto time = store.Get(StepStore::kTime);
  const auto first = std::find_if(all.begin(), all.end() - 1, [&](Index i) { return time(0, i) > since; });
  const Explanation later = StartExplanation(store, one->channel, Segment(first, all.end()));
  one->from = later.from, one->unseen_before = later.unseen_before;
}

/// Returns the key of a push that grows.
std::string NameGrowing(const Candidate& push) { return push.place + push.fault + kGrows; }

/// Returns whether a candidate pushes independently of the motion.
bool IsPush(const Candidate& one) {
  return one.fault == "torque" || one.fault == kForce || one.fault == "moment";
}

}  // namespace

ForceProblem::ForceProblem(const StepStore& store, StepForces* forces, const Segment& segment, double level,
                           Growth growth)
    : store_(store), forces_(forces), growth_(growth), is_faint_(level < 1.0) {
  const auto count = static_cast<Index>(segment.size());
  steps_ = std::min(count, kMostSteps);
  for (Index i = 0; i < steps_; ++i)
    used_.push_back(segment[static_cast<size_t>(steps_ == 1 ? 0 : i * (count - 1) / (steps_ - 1))]);
  forces->SetGravity(forces->model().gravity());
  // Errors of the columns hide what is smaller on the same side, robot or object.
  level_.setConstant(level);
  Build();
  first_level_ = level * (1.0 + (kAccuracy * CalcSizes(whole_y_)).array().square()).sqrt();
  const bool rolls = forces->model().base().type == BaseType::kDifferentialDrive;
  const Vector2d exact(rolls ? kExactOnWheels : kExact, kExact);
  least_level_ = (exact / kAccuracy).cwiseProduct(first_level_).cwiseMax(kRounding);
  SetLevel(first_level_);
  Complete();
}

bool ForceProblem::IsExplained(double fraction, double left) const {
  if (left <= 1.0 && !is_faint_) return fraction > 0.0;
  return fraction >= kLeastFraction && left <= kLeft;
}

void ForceProblem::FixTerms(const Terms& known) {
  known_ = known;
  Complete();
}

bool ForceProblem::ExplainConstant(const Segment& segment, Causes* causes) {
  terms_ = {};
  is_exact_ = LeavesRounding(y_);
  if (!known_.amplitudes.empty() && CalcLeft(y_) <= 1.0) return true;
  CauseSelection selection = Select();
  if (growth_ == Growth::kWithin && !SearchLimit::IsOver() && NarrowGrowing(selection)) selection = Select();
  if (!IsExplained(selection.fraction, selection.left)) return false;
  for (const CauseTerm& term : selection.terms) {
    const Candidate& one = candidates_[term.candidate];
    terms_.count += term.amplitude.size();
    if (one.fault == kForceAtPoint) {
      terms_.points.push_back({one.place, term.amplitude, one.fitted});
    } else {
      terms_.amplitudes.push_back(term);
    }
  }
  if (ExplainJoint(segment, selection, causes)) return true;
  Causes found =
      DescribeSelection(StartExplanation(store_, CauseChannel::kBalance, segment), selection, candidates_,
                        [&](const Candidate& one, const VectorXd& amplitude, const VectorXd& error) {
                          return MakeForceFault(one, amplitude, error, forces_->model());
                        });
  for (size_t i = 0; i < found.size(); ++i) {
    const CauseTerm& term = selection.terms[i];
    const Candidate& one = candidates_[term.candidate];
    if (one.fault.ends_with(kGrows))
      SetBegin(store_, segment, CalcGrowthBegin(term.amplitude, one.nominal), &found[i]);
  }
  std::move(found.begin(), found.end(), std::back_inserter(*causes));
  return true;
}

bool ForceProblem::ExplainJoint(const Segment& segment, const CauseSelection& selection,
                                Causes* causes) const {
  if (selection.terms.size() < 2) return false;
  const std::string& place = candidates_[selection.terms.front().candidate].place;
  const bool is_of_one =
      std::all_of(selection.terms.begin(), selection.terms.end(),
                  [&](const CauseTerm& term) { return candidates_[term.candidate].place == place; });
  if (is_exact_ && !is_of_one) return false;
  for (const Free& torque : FitAll({"torque"})) {
    const bool leaves_noise = torque.residual.squaredNorm() <= static_cast<double>(y_.size());
    const bool is_joint = is_of_one && candidates_[torque.candidate].place == place;
    if (!is_joint && (is_exact_ || !leaves_noise)) continue;
    Explanation one = DescribeFree(segment, torque);
    for (const CauseTerm& term : selection.terms)
      one.faults.push_back(
          MakeForceFault(candidates_[term.candidate], term.amplitude, term.error, forces_->model()));
    causes->push_back(one);
    return true;
  }
  return false;
}

void ForceProblem::ExplainChanging(const Segment& segment, Causes* causes) const {
  const std::vector<Free> all = FitAll({"torque", kForce, "moment", "force and moment"});
  if (all.empty()) return;
  Explanation one = DescribeFree(segment, all.front());
  if (!IsExplained(one.fraction, one.left)) one.outcome = CauseOutcome::kNotExplained;
  for (size_t i = 1; i < all.size() && one.rival.empty(); ++i) {
    const double odds = 0.5 * (all[i].criterion - all.front().criterion);
    if (odds >= kEqualLogOdds) {
      one.SetRival(candidates_[all[i].candidate], odds);
    } else {
      one.faults.push_back(DescribeFree(segment, all[i]).faults.front());
    }
  }
  causes->push_back(one);
}

std::vector<ForceProblem::Free> ForceProblem::FitAll(std::initializer_list<const char*> faults) const {
  std::vector<Free> all;
  for (size_t i = 0; i < candidates_.size(); ++i)
    if (std::ranges::find(faults, candidates_[i].fault) != faults.end()) all.push_back(FitFree(i));
  std::ranges::stable_sort(all, {}, &Free::criterion);
  return all;
}

ForceProblem::Free ForceProblem::FitFree(size_t index) const {
  const Candidate& candidate = candidates_[index];
  Free free{.candidate = index, .residual = y_};
  for (Index k = 0; k < steps_; ++k) {
    const Index begin = k * forces_->rows();
    const MatrixXd C = candidate.columns.middleRows(begin, forces_->rows());
    auto left = free.residual.segment(begin, forces_->rows());
    constexpr double kIndependent = 1e-3;
    const VectorXd a = SolveLeastSquares(C, left, kIndependent);
    left -= C * a;
    free.largest = std::max(free.largest, a.head(std::min<Index>(3, a.size())).norm());
  }
  const double rows = static_cast<double>(y_.size());
  free.criterion = rows * std::log(1.0 + free.residual.squaredNorm() / rows) +
                   static_cast<double>(candidate.columns.cols() * steps_) * std::log(rows);
  return free;
}

Explanation ForceProblem::DescribeFree(const Segment& segment, const Free& free) const {
  const Candidate& candidate = candidates_[free.candidate];
  Explanation one = StartExplanation(store_, CauseChannel::kBalance, segment);
  one.fraction = 1.0 - free.residual.squaredNorm() / y_.squaredNorm();
  one.left = std::sqrt(free.residual.squaredNorm() / static_cast<double>(y_.size()));
  one.outcome = CauseOutcome::kNamedClass;
  one.faults.push_back({candidate.fault + kChanges, candidate.place, free.largest, 0.0, candidate.unit, ""});
  return one;
}

void ForceProblem::Build() {
  const Index rows = forces_->rows();
  whole_y_.resize(rows * steps_);
  candidates_.clear();
  noise_.clear();
  turns_.clear();
  forces_->SetLevel(level_);
  for (Index i = 0; i < steps_; ++i) {
    forces_->SetStep(used_[static_cast<size_t>(i)]);
    noise_.push_back(forces_->noise());
    turns_.push_back(forces_->ListTurns());
    whole_y_.segment(i * rows, rows) = forces_->CalcResidual();
    forces_->AddColumns(i * rows, steps_, &candidates_);
  }
  AddGrowing();
  NameStuckBearings();
  constant_ = candidates_.size();
}

void ForceProblem::SetLevel(const Vector2d& level) {
  const Index rows = forces_->rows();
  candidates_.resize(constant_);
  for (Index i = 0; i < steps_; ++i) {
    const StepNoise& noise = noise_[static_cast<size_t>(i)];
    noise.ChangeLevel(level_, level, whole_y_.segment(i * rows, rows));
    for (Candidate& one : candidates_)
      noise.ChangeLevel(level_, level, one.columns.middleRows(i * rows, rows));
  }
  level_ = level;
}

void ForceProblem::Complete() {
  candidates_.resize(constant_);
  y_ = whole_y_;
  for (const CauseTerm& term : known_.amplitudes) {
    Candidate& one = candidates_[term.candidate];
    y_ -= one.columns * term.amplitude;
    one.is_possible = [](const VectorXd&) { return false; };  // once more
  }
  for (const ForceAtPoint& force : known_.points)
    candidates_.push_back(MakeForceAtPoint(force, turns_, candidates_));
  AddForcesAtPoints(y_, turns_, forces_->reach(), &candidates_);
}

void ForceProblem::AddGrowing() {
  std::vector<Candidate> pushes;
  std::copy_if(candidates_.begin(), candidates_.end(), std::back_inserter(pushes), IsPush);
  if (!growing_.empty())
    std::erase_if(pushes, [&](const Candidate& one) { return growing_.count(NameGrowing(one)) == 0; });
  // With many of them, not each time of their begin is tried.
  const auto skipped = static_cast<Index>(pushes.size()) * steps_ / kMostGrowing;
  // With one step they are only there to be known.
  for (Index first = 0; first + 1 < std::max<Index>(2, steps_); first += 1 + skipped) {
    for (const Candidate& push : pushes) candidates_.push_back(MakeGrowing(push, first, skipped));
    if (growth_ == Growth::kBefore) break;
  }
}

bool ForceProblem::NarrowGrowing(const CauseSelection& selection) {
  for (const CauseTerm& term : selection.terms)
    if (const Candidate& one = candidates_[term.candidate]; one.fault.ends_with(kGrows))
      growing_.insert(one.place + one.fault);
  if (growing_.empty()) return false;
  level_ = first_level_;
  Build();
  Complete();
  return true;
}

Candidate ForceProblem::MakeGrowing(const Candidate& push, Index first, Index skipped) const {
  const auto time = store_.Get(StepStore::kTime);
  const auto time_of = [&](Index k) { return time(0, used_[static_cast<size_t>(k)]); };
  const double slack = store_.size() > 1 ? 2.0 * (time(0, 1) - time(0, 0)) : 0.0;
  const Index rows = forces_->rows(), width = push.columns.cols();
  Candidate growing = push;
  growing.fault += kGrows;
  growing.unit += "/s";
  growing.nominal = store_.last_time();
  growing.scale = push.scale.replicate(2, 1);
  growing.columns = MatrixXd::Zero(rows * steps_, 2 * width);
  for (Index k = first; k < steps_; ++k) {
    const auto at = push.columns.middleRows(k * rows, rows);
    growing.columns.middleRows(k * rows, rows) << (time_of(k) - growing.nominal) * at, at;
  }
  // A push that began before all that is kept did not show yet.
  MatrixXd shows = push.columns.middleRows(first * rows, rows);
  noise_[static_cast<size_t>(first)].ChangeLevel(level_, Vector2d::Ones(), shows);
  const double earliest = (first > skipped ? time_of(first - 1 - skipped) : time(0, 0)) - slack;
  growing.is_possible = [=, steps = steps_, last = time_of(std::min(first + skipped, steps_ - 1)) + slack,
                         end = growing.nominal](const VectorXd& a) {
    const double since = CalcGrowthBegin(a, end);
    const double hidden = (earliest - since) * (shows * a.head(width)).norm();
    return steps > 1 && since <= last && hidden <= std::sqrt(static_cast<double>(rows));
  };
  return growing;
}

void ForceProblem::NameStuckBearings() {
  const RobotModel& model = forces_->model();
  for (Candidate& one : candidates_) {
    if (one.fault != kBearing) continue;
    Index row = model.num_base_velocities();
    while (one.place != "joint " + model.dof_name(static_cast<int>(row) - model.num_base_velocities())) ++row;
    // rad/s or m/s, and of the largest friction, which is one and the same wherever it slides
    constexpr double kSlides = 1e-4, kLargest = 1.0 - 1e-9;
    int sliding = 0;
    for (const Index step : used_)
      sliding += static_cast<int>(std::abs(store_.Get(StepStore::kVelocity)(row, step)) > kSlides &&
                                  std::abs(store_.Get(StepStore::kDryFriction)(row, step)) >=
                                      kLargest * one.nominal);
    if (4 * sliding < steps_) one.fault = kStuckBearing;
  }
}

Vector2d ForceProblem::CalcSizes(const VectorXd& y) const {
  const Index n = forces_->rows() - 6;
  Vector2d square = Vector2d::Zero();
  for (Index k = 0; k < steps_; ++k) {
    VectorXd robot = y.segment(k * (n + 6), n);
    const MatrixXd& U = noise_[static_cast<size_t>(k)].uneven;
    robot -= U * (U.transpose() * robot);
    square += Vector2d(robot.squaredNorm(), y.segment<6>(k * (n + 6) + n).squaredNorm());
  }
  return (square.array() / (static_cast<double>(steps_) * Vector2d(n, 6).array())).sqrt();
}

double ForceProblem::CalcLeft(const VectorXd& y) const {
  const Index n = forces_->rows() - 6;
  double square = 0.0;
  for (Index k = 0; k < steps_; ++k) {
    square += (level_[0] / first_level_[0] * y.segment(k * (n + 6), n)).squaredNorm() +
              (level_[1] / first_level_[1] * y.segment<6>(k * (n + 6) + n)).squaredNorm();
  }
  return std::sqrt(square / static_cast<double>(y.size()));
}

bool ForceProblem::LeavesRounding(const VectorXd& y) const {
  return (level_.cwiseProduct(CalcSizes(y)).array() <= least_level_.array()).all();
}

CauseSelection ForceProblem::Select() {
  Vector2d level = level_;  // of the best
  const auto select = [&](const Vector2d& at) {
    SetLevel(at);
    Complete();
    return SelectOnce();
  };
  CauseSelection best = SelectOnce();
  if (best.terms.empty()) best = select(level = kFaint * level);
  for (int i = 0; i < kMostLevels && IsExplained(best.fraction, best.left) && !SearchLimit::IsOver(); ++i) {
    const Vector2d lower =
        (kOfLeft * level_.cwiseProduct(CalcSizes(best.residual))).cwiseMax(least_level_).cwiseMin(level_);
    if ((lower.array() > 0.5 * level_.array()).all()) break;
    CauseSelection next = select(lower);
    if (!IsExplained(next.fraction, next.left) || SearchLimit::IsOver()) break;
    best = next;
    level = lower;
  }
  if (!IsExplained(best.fraction, best.left) || is_exact_ || SearchLimit::IsOver()) return best;
  // The noise level was estimated from the residual: more faults that leave but rounding are likelier.
  if (CauseSelection exact = select(least_level_); is_exact_) return exact;
  return select(level);
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
    const ForceAtPoint start{one.place, term.amplitude, one.fitted};
    const auto refined = RefinePoint(y_, turns_, forces_->reach(), start, beside, candidates_);
    if (!refined) continue;
    one = MakeForceAtPoint(*refined, turns_, candidates_);
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
    one.columns = CalcCenterColumns(one.place, term.amplitude, more, candidates_);
    is_refined = true;
  }
  return is_refined;
}

CauseSelection ForceProblem::SelectRefined() {
  // A single step cannot distinguish faults.
  const CauseOptions options{.most_terms = std::min<size_t>(5, used_.size()),
                             .noise_block_size = static_cast<double>(steps_)};
  CauseSelection selection = SelectCauses(y_, candidates_, options);
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
  const auto find = [&](const char* fault) {
    return std::ranges::find_if(candidates_, [&](const Candidate& other) {
      return other.fault == fault && other.place == one.place;
    });
  };
  const Vector6d beyond =
      term.amplitude.tail<6>() - ToEntries(CalcPointInertia(find("mass")->nominal, term.amplitude.head<3>()));
  return (find("inertia")->columns * beyond).norm() <= kBeyond * std::sqrt(static_cast<double>(y_.size()));
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

CauseSelection ForceProblem::SelectOnce() {
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
    Complete();
    selection = SelectRefined();
    break;
  }
  selection.left = CalcLeft(selection.residual);
  is_exact_ = LeavesRounding(selection.residual);
  return selection;
}

}  // namespace dexcheck
