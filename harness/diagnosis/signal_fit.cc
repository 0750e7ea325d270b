#include "harness/diagnosis/signal_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/diagnosis/search_limit.h"

namespace dexcheck {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

// Columns agree with what a fault does to this fraction: it is computed from the same numbers.
constexpr double kSignalAccuracy = 1e-9;
// A drift that began since the step before has come so far, beside rounding, at the first.
constexpr double kSinceStep = 1e-6;
// Autocorrelation of noise that is white, times the root of the number of steps.
constexpr double kWhite = 4.0;
constexpr size_t kMostTerms = 3;

Fault MakeFault(const Candidate& candidate, const VectorXd& amplitude, const VectorXd& error, double decay,
                double time_step) {
  Fault fault{candidate.fault, candidate.place, candidate.nominal + amplitude[0],
              error[0],        candidate.unit,  candidate.detail};
  if (candidate.fault == "lag") {
    const double own = std::clamp(amplitude[0], 1e-9, 1.0 - 1e-9);
    fault.value = -time_step / std::log(own);
    fault.error *= fault.value * fault.value / time_step / own;
  } else if (candidate.columns.cols() == 2) {
    fault.value = amplitude.norm();
    fault.error = error.norm();
  } else if (decay > 0.0 && (candidate.fault == "gain" || candidate.fault == "offset")) {
    // The gain is of the lag's input: its output has (1 - d) of it.
    fault.value = candidate.nominal + amplitude[0] / (1.0 - decay);
    fault.error /= 1.0 - decay;
  }
  return fault;
}

/// Whether each step is for itself, and no few values are beside all the rest: those of noise are within 6
/// times its size.
bool IsWhite(const VectorXd& residual) {
  constexpr double kMost = 6.0;
  const Index count = residual.size();
  if (count < kFewestOfNoise) return false;
  const double square = residual.squaredNorm();
  for (Index k = 1; k <= 3; ++k) {
    const double along = residual.head(count - k).dot(residual.tail(count - k)) / square;
    if (std::abs(along) > kWhite / std::sqrt(static_cast<double>(count))) return false;
  }
  return residual.cwiseAbs().maxCoeff() < kMost * std::sqrt(square / static_cast<double>(count));
}

/// Returns the cost of a shape and of the times at which the fault begins and ends, beside what is added.
double CalcCost(const SignalSeries& series, const SignalSteps& steps, const SignalShape& shape, size_t added,
                const SignalFit& fit) {
  const double log_rows = std::log(static_cast<double>(steps.size()));
  const bool adds = fit.is_noise || !fit.selection.terms.empty();
  const int changes = adds ? (steps.first > 0 ? 1 : 0) + (steps.ends ? 1 : 0) : shape.changes;
  double cost = changes * (log_rows + 2.0 * std::log(static_cast<double>(series.got.size())));
  if (!shape.fault.empty())
    cost += shape.parameters * log_rows +
            2.0 * std::log(static_cast<double>(shape.tried) * static_cast<double>(added));
  return cost;
}

SignalFit MakeFit(const SignalSeries& series, const SignalSteps& steps, const SignalShape& shape,
                  double floor, SignalSearch search) {
  const std::vector<Candidate> added = ListAdded(series, steps, shape, search);
  const VectorXd y = ((steps.Take(series.got) - steps.Take(shape.output)) / series.noise).matrix();
  SignalFit fit;
  fit.size = ((steps.Take(series.got) - steps.Take(series.expected)) / series.noise).matrix().norm();
  fit.selection = SelectCauses(y, added, {.most_terms = kMostTerms, .restarts = 8, .floor = floor});
  const std::string place = PlaceOf(series.name);
  if (!shape.fault.empty())
    fit.faults.push_back({shape.fault, place, shape.value, 0.0, shape.unit, shape.detail});
  fit.same.resize(fit.faults.size());
  const double time_step = series.time.size() > 1 ? series.time[1] - series.time[0] : 1.0;
  const auto find = [&](std::string_view fault) {
    for (const CauseTerm& term : fit.selection.terms)
      if (added[term.candidate].fault == fault) return term.amplitude[0];
    return 0.0;
  };
  const double decay = find("lag");
  // A drift that began since the step before, of which many may be missing, has come so far at the first.
  const double unseen = steps.first > 0 ? series.time[steps.first] - series.time[steps.first - 1] : time_step;
  const auto has_come_to = [&](const char* fault, const char* drift) {
    const double since = find(fault) / find(drift);
    return since > 0.0 && std::isfinite(since) && (steps.was_before || since <= (1.0 + kSinceStep) * unseen);
  };
  const bool drifts_to_offset = has_come_to("offset", "drift");
  const bool drifts_to_gain = has_come_to("gain", "drift of the gain");
  for (const CauseTerm& term : fit.selection.terms) {
    const std::string& name = added[term.candidate].fault;
    if ((drifts_to_offset && name == "offset") || (drifts_to_gain && name == "gain")) continue;
    fit.faults.push_back(MakeFault(added[term.candidate], term.amplitude, term.error, decay, time_step));
    std::vector<Fault>& same = fit.same.emplace_back();
    for (const auto& [other, amplitude] : term.same)
      if (added[other].fault != "lag" || IsDecay(amplitude[0]))
        same.push_back(
            MakeFault(added[other], amplitude, VectorXd::Zero(amplitude.size()), decay, time_step));
  }
  const double left = std::sqrt(fit.selection.residual.squaredNorm() / static_cast<double>(y.size()));
  if (left > SignalSeries::kLeft * std::sqrt(floor) && IsWhite(fit.selection.residual)) {
    fit.faults.push_back({"noise, standard deviation", place, left * series.noise,
                          left * series.noise / std::sqrt(2.0 * static_cast<double>(y.size())),
                          series.name.unit, ""});
    fit.same.emplace_back();
    fit.is_noise = true;
  }
  fit.criterion = decay != 0.0 && !IsDecay(decay)
                      ? std::numeric_limits<double>::infinity()
                      : fit.selection.criterion + CalcCost(series, steps, shape, added.size(), fit);
  return fit;
}

/// Names of a fit's faults: what two explanations may have in common.
std::string NamesOf(const std::vector<Fault>& faults) {
  std::string text;
  for (const Fault& fault : faults) text += (text.empty() ? "" : " and ") + fault.fault;
  return text;
}

/// Adds the alternatives of a silent signal: any dead zone that is wide enough, any step that is large
/// enough.
void AddSilence(const SignalSeries& series, double largest, SignalFit* dead) {
  if (dead->faults.size() != 1) return;
  const std::string& place = dead->faults.front().place;
  const std::string& unit = series.name.unit;
  if (series.name.group == "motors")
    dead->same.front().push_back({"dead zone", place, largest, 0.0, unit, "or more"});
  dead->same.front().push_back({"rounding to steps of", place, 2.0 * largest, 0.0, unit, "or more"});
}

}  // namespace

SignalVerdict JudgeSignal(const SignalSeries& series, const std::vector<SignalSeries>& others) {
  SignalVerdict verdict;
  verdict.name = series.name;
  verdict.steps = FindSteps(series);
  const SignalSteps& steps = verdict.steps;
  if (steps.rows.empty()) return verdict;
  const ArrayXd off = steps.Take(series.got) - steps.Take(series.expected);
  const double square = (off / series.noise).square().sum() / static_cast<double>(steps.size());
  const double floor = 1.0 + kSignalAccuracy * kSignalAccuracy * square;
  // A signal that is right at most steps has no noise: its few errors are samples that were lost.
  constexpr Index kRarest = 5;
  const bool differs_often = kRarest * (off.abs() > series.noise).count() >= off.size();
  const auto is_good = [&](const SignalFit& fit) {
    // Noise beside several other faults is what they do not explain.
    constexpr size_t kMostWithNoise = 2;
    return fit.is_possible() && (fit.is_noise ? differs_often && fit.faults.size() <= kMostWithNoise
                                              : fit.selection.left <= SignalSeries::kLeft * std::sqrt(floor));
  };
  std::vector<SignalFit> fits;
  for (const SignalSearch search : {SignalSearch::kPlain, SignalSearch::kSines, SignalSearch::kTurns}) {
    if (!fits.empty() && SearchLimit::IsOver()) break;
    fits.clear();
    for (const SignalShape& shape : ListShapes(series, steps, others))
      fits.push_back(MakeFit(series, steps, shape, floor, search));
    std::sort(fits.begin(), fits.end(),
              [](const SignalFit& a, const SignalFit& b) { return a.criterion < b.criterion; });
    if (is_good(fits.front()) && !fits.front().is_noise) break;
  }
  verdict.is_explained = steps.size() >= kFewestSteps && is_good(fits.front()) &&
                         off.abs().maxCoeff() >= SignalSeries::kFaint * series.noise;
  std::vector<std::string> names;
  for (SignalFit& fit : fits) {
    if (!fit.is_possible()) continue;
    const double odds = 0.5 * (fit.criterion - fits.front().criterion);
    const std::string name = NamesOf(fit.faults);
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    names.push_back(name);
    // An explanation with more faults has simpler ones as a special case.
    const bool is_wider = !verdict.fits.empty() && fit.faults.size() > verdict.fits.front().faults.size();
    if (is_wider && odds < kEqualLogOdds) continue;
    if (verdict.fits.empty() || (odds < kEqualLogOdds && is_good(fit))) {
      verdict.fits.push_back(fit);
    } else if (verdict.rival.empty() && std::isfinite(odds)) {
      verdict.rival = name;
      verdict.log_odds = odds;
    }
  }
  if (verdict.is_explained && steps.Take(series.got).abs().maxCoeff() <= series.noise)
    AddSilence(series, steps.Take(series.expected).abs().maxCoeff(), &verdict.fits.front());
  return verdict;
}

Explanation StartExplanation(const SignalVerdict& verdict, CauseChannel channel) {
  Explanation one;
  one.channel = channel;
  one.from = verdict.steps.from;
  one.to = verdict.steps.to;
  one.ends = verdict.steps.ends;
  one.rival = verdict.rival;
  one.log_odds = verdict.log_odds;
  if (verdict.fits.empty()) return one;
  const CauseSelection& selection = verdict.fits.front().selection;
  one.left = selection.left;
  const double size = verdict.fits.front().size;
  one.fraction = size > 0.0 ? std::max(0.0, 1.0 - selection.residual.squaredNorm() / (size * size)) : 1.0;
  return one;
}

/// One explanation for each fault, with what would do in its place.
void AddExplanations(const SignalVerdict& verdict, CauseChannel channel, Causes* causes) {
  if (verdict.steps.rows.empty()) return;
  Explanation whole = StartExplanation(verdict, channel);
  if (!verdict.is_explained || verdict.fits.empty()) {
    whole.outcome = CauseOutcome::kNotExplained;
    if (!verdict.fits.empty()) whole.faults = verdict.fits.front().faults;
    if (whole.faults.empty()) whole.faults.push_back({kUnknownFault, verdict.name.place, 0.0, 0.0, "", ""});
    causes->push_back(whole);
    return;
  }
  const SignalFit& best = verdict.fits.front();
  const bool single = best.faults.size() == 1;
  for (size_t place = 0; place < best.faults.size(); ++place) {
    Explanation one = whole;
    one.faults = {best.faults[place]};
    one.faults.insert(one.faults.end(), best.same[place].begin(), best.same[place].end());
    for (size_t i = 1; i < verdict.fits.size(); ++i) {
      // Several faults that are replaced together are represented by the first of the others.
      const std::vector<Fault>& others = verdict.fits[i].faults;
      for (size_t k = 0; k < (single ? std::min<size_t>(1, others.size()) : others.size()); ++k) {
        one.faults.push_back(others[k]);
        const std::vector<Fault>& same = verdict.fits[i].same[k];
        one.faults.insert(one.faults.end(), same.begin(), same.end());
      }
    }
    one.SetOutcome();
    causes->push_back(one);
  }
}

}  // namespace dexcheck
