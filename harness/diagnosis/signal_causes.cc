#include "harness/diagnosis/signal_causes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "controller/model/platform.h"
#include "harness/diagnosis/cause_estimator.h"

namespace dexcheck {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

// Columns agree with what a fault does to this fraction: it is computed from the same numbers.
constexpr double kAccuracy = 1e-9;
// A drift that began since the step before has come so far, beside rounding, at the first.
constexpr double kSinceStep = 1e-6;
// What is left over may be this many times the noise and is explained all the same.
constexpr double kLeft = 30.0;
// Autocorrelation of noise that is white, times the root of the number of steps.
constexpr double kWhite = 4.0;
constexpr double kFaint = 1e3;        // times the noise; of less rounding says what it is
constexpr Index kFewest = 3;          // steps that say anything
constexpr Index kFewestOfNoise = 20;  // and of noise
constexpr size_t kMostTerms = 3;

double SquaredNorm(const ArrayXd& x) { return x.square().sum(); }

/// The steps in which a series differs, and the signal's past there.
struct Steps {
  std::vector<Index> rows;
  double from = 0.0, to = 0.0;  // s
  bool ends = false;            // before the series does
  bool was_before = false;      // whether it may have begun before the series does

  [[nodiscard]] Index size() const { return static_cast<Index>(rows.size()); }
  /// The signal `back` steps before each of them.
  [[nodiscard]] ArrayXd Take(const VectorXd& signal, Index back = 0) const {
    ArrayXd taken(size());
    for (Index i = 0; i < size(); ++i)
      taken[i] = signal[std::max<Index>(0, rows[static_cast<size_t>(i)] - back)];
    return taken;
  }
};

Steps FindSteps(const SignalSeries& series) {
  Steps steps;
  const ArrayXd difference = (series.got - series.expected).array().abs();
  Index first = 0, last = difference.size() - 1;
  while (first <= last && !(difference[first] > series.noise)) ++first;
  while (last > first && !(difference[last] > series.noise)) --last;
  for (Index i = first; i <= last; ++i)
    if (series.has_history[static_cast<size_t>(i)]) steps.rows.push_back(i);
  if (first > last) return steps;
  // What is over so soon is looked at all the same, and what came before was as it is at the first.
  if (static_cast<Index>(steps.rows.size()) < kFewest) {
    steps.rows.clear();
    for (Index i = first; i <= last; ++i) steps.rows.push_back(i);
  }
  steps.was_before = first == 0;
  steps.from = series.time[first];
  steps.to = series.time[last];
  steps.ends = last + StepStore::kHistory < difference.size();
  return steps;
}

/// What a transmission makes of the signal, before gain and offset.
struct Shape {
  std::string fault;  // empty for the signal itself
  std::string unit, detail;
  double value = 0.0;
  int parameters = 0;
  ArrayXd output;
  bool has_gain = true;
  Index tried = 1;  ///< Out of how many this one is the best.
};

/// g = a u_k + b u_(k+1) + c of the whole delay k that fits best, a + b = 1.
void AddDelay(const ArrayXd& got, const SignalSeries& series, const Steps& steps,
              std::vector<Shape>* shapes) {
  double least = std::numeric_limits<double>::infinity();
  Shape best{.fault = "delay",
             .unit = "steps",
             .detail = "",
             .parameters = 1,
             .output = {},
             .tried = StepStore::kHistory};
  for (Index k = 1; k <= StepStore::kHistory; ++k) {
    const ArrayXd late = steps.Take(series.expected, k);
    const double left = SquaredNorm((got - late) - (got - late).mean());
    if (!(left < least)) continue;
    least = left;
    best.value = static_cast<double>(k);
    best.output = late;
  }
  shapes->push_back(best);
  // Between two steps: g - u_k = f (u_(k+1) - u_k).
  for (const Index k : {static_cast<Index>(best.value) - 1, static_cast<Index>(best.value)}) {
    const ArrayXd late = steps.Take(series.expected, k);
    const ArrayXd later = steps.Take(series.expected, k + 1);
    const double square = SquaredNorm(later - late);
    if (!(square > 0.0) || k >= StepStore::kHistory) continue;
    const double f = ((got - late) * (later - late)).sum() / square;
    constexpr double kWhole = 1e-6;
    if (!(f > kWhole && f < 1.0 - kWhole)) continue;
    Shape between = best;
    between.value = static_cast<double>(k) + f;
    between.output = late + f * (later - late);
    between.parameters = 2;
    shapes->push_back(between);
  }
}

/// Whether what has this output for good is over when it would still show.
bool IsRefuted(const SignalSeries& series, const Steps& steps, const VectorXd& output) {
  if (!steps.ends) return false;
  const Index first = static_cast<Index>(steps.rows.back()) + 1, count = output.size() - first;
  return ((output - series.expected).tail(count).array().abs() > kFaint * series.noise).any();
}

void AddLimits(const ArrayXd& u, const ArrayXd& got, const SignalSeries& series, const Steps& steps,
               std::vector<Shape>* shapes) {
  const std::string& unit = series.name.unit;
  const bool is_motor = series.name.group == "motors";
  const double most = got.abs().maxCoeff();
  if (most > 0.0 && most < u.abs().maxCoeff())
    shapes->push_back({"limit", unit, "", most, 1, u.min(most).max(-most), false});
  if (!is_motor) return;
  // Outside of a dead zone |u| - |g| is its half width.
  std::vector<double> less;
  for (Index i = 0; i < u.size(); ++i)
    if (got[i] != 0.0 && got[i] * u[i] > 0.0) less.push_back(std::abs(u[i]) - std::abs(got[i]));
  if (less.empty()) return;
  std::nth_element(less.begin(), less.begin() + static_cast<std::ptrdiff_t>(less.size() / 2), less.end());
  const double zone = less[less.size() / 2];
  if (!(zone > 0.0)) return;
  const ArrayXd all = series.expected.array();
  if (IsRefuted(series, steps, (all.sign() * (all.abs() - zone).max(0.0)).matrix())) return;
  shapes->push_back({"dead zone", unit, "", zone, 1, u.sign() * (u.abs() - zone).max(0.0), false});
}

/// Whole multiples of a step: the largest that divides all, made better by all of them.
void AddSteps(const ArrayXd& u, const ArrayXd& got, const std::string& unit, std::vector<Shape>* shapes) {
  const double rounding = 1e-12 * got.abs().maxCoeff();
  const ArrayXd apart = (got - got[0]).abs();
  double step = apart.maxCoeff() > rounding ? 0.0 : std::abs(got[0]);
  for (double value : apart) {
    // By Euclid's algorithm, in which a remainder of rounding is none.
    while (value > rounding) {
      const double rest = step > 0.0 ? std::abs(std::remainder(value, step)) : 0.0;
      if (step == 0.0) step = value;
      if (!(rest > rounding)) break;
      value = step;
      step = rest;
    }
  }
  // Multiples of what is hardly more than rounding are any values.
  if (!(step > 1e2 * rounding)) return;
  // From few multiples to many, so that each is counted right.
  ArrayXd sorted(2 * got.size());
  sorted << apart, got.abs();
  std::sort(sorted.begin(), sorted.end());
  double along = 0.0, square = 0.0;
  for (const double value : sorted) {
    const double count = std::round(value / step);
    along += count * value;
    square += count * count;
    if (square > 0.0) step = along / square;
  }
  shapes->push_back({"rounding to steps of", unit, "", step, 1, step * (u / step).round(), false});
}

/// The other one of the same kind whose signal this one has.
void AddExchange(const ArrayXd& got, const SignalSeries& series, const Steps& steps,
                 const std::vector<SignalSeries>& others, std::vector<Shape>* shapes) {
  double least = 0.05 * SquaredNorm(got - steps.Take(series.expected));
  Shape best{.fault = "", .unit = "", .detail = "", .parameters = 2, .output = {}, .has_gain = false};
  for (const SignalSeries& other : others) {
    if (other.name.group != series.name.group ||
        (other.name.place == series.name.place && other.name.what == series.name.what))
      continue;
    const ArrayXd signal = steps.Take(other.expected);
    const double left = SquaredNorm(got - signal);
    if (!(left < least)) continue;
    least = left;
    best.fault = "signal of " + other.name.place +
                 (other.name.place == series.name.place ? " " + other.name.what : std::string()) + ", gain";
    best.value = 1.0;
    best.output = signal;
    best.tried = static_cast<Index>(others.size());
  }
  if (!best.fault.empty()) shapes->push_back(best);
}

std::vector<Shape> ListShapes(const SignalSeries& series, const Steps& steps,
                              const std::vector<SignalSeries>& others) {
  const ArrayXd u = steps.Take(series.expected), got = steps.Take(series.got);
  std::vector<Shape> shapes;
  shapes.push_back({.fault = "", .unit = "", .detail = "", .output = u});
  AddDelay(got, series, steps, &shapes);
  AddLimits(u, got, series, steps, &shapes);
  AddSteps(u, got, series.name.unit, &shapes);
  AddExchange(got, series, steps, others, &shapes);
  const bool is_still = (got - got.mean()).abs().maxCoeff() <= series.noise;
  if (is_still && std::abs(got.mean()) > kLeft * series.noise)
    shapes.push_back(
        {"stuck at", series.name.unit, "", got.mean(), 1, ArrayXd::Constant(u.size(), got.mean()), false});
  return shapes;
}

/// A sine of the frequency that explains most of y: parts of its amplitude as columns.
Candidate FindSine(const ArrayXd& y, const ArrayXd& t, const std::string& place, const std::string& unit) {
  // The frequency is one; it is the best of as many as there are steps, which weighs 2 log n as two more
  // would.
  constexpr int kParameters = 3;
  Candidate sine{.fault = "ripple",
                 .place = place,
                 .unit = unit,
                 .columns = MatrixXd(y.size(), 2),
                 .parameters = kParameters};
  const auto set = [&](double w) {
    sine.columns.col(0) = (w * (t - t[0])).sin();
    sine.columns.col(1) = (w * (t - t[0])).cos();
    const VectorXd a = sine.columns.householderQr().solve(y.matrix());
    return (y.matrix() - sine.columns * a).squaredNorm();
  };
  // Two a period at most, and half of one at least, four times as dense as periods in all of the time.
  const double whole = t[t.size() - 1] - t[0];
  const double densest = 0.4 * static_cast<double>(t.size() - 1) / std::max(whole, 1e-12);
  const double grid = 0.25 / std::max(whole, 1e-12);
  const int count = static_cast<int>(std::min(2000.0, densest / grid));
  double best = 2.0 * grid, least = std::numeric_limits<double>::infinity();
  for (int i = 2; i < count; ++i) {
    const double left = set(2.0 * kPi * i * grid);
    if (left < least) least = left, best = i * grid;
  }
  double width = grid;
  for (int i = 0; i < 60; ++i, width *= 0.7) {
    for (const double to : {best - width, best + width}) {
      if (!(to > grid)) continue;
      const double left = set(2.0 * kPi * to);
      if (left < least) least = left, best = to;
    }
  }
  set(2.0 * kPi * best);
  sine.nominal = best;
  return sine;
}

/// Whether an output that goes on with this fraction of itself follows, and neither runs away nor ahead.
bool IsDecay(double decay) {
  constexpr double kLeast = 1e-6;
  return decay > kLeast && decay < 1.0 - kLeast;
}

/// What may be added to a transmission's output.
std::vector<Candidate> ListAdded(const SignalSeries& series, const Steps& steps, const Shape& shape,
                                 bool look_for_sines) {
  const SignalName& name = series.name;
  const std::string place = name.group == "motors" ? name.place : name.place + ", " + name.what;
  std::vector<Candidate> added;
  const auto add = [&](const char* fault, const std::string& unit, const ArrayXd& column,
                       double nominal = 0.0) {
    if (!(column.abs().maxCoeff() > 0.0)) return;
    added.push_back({.fault = fault,
                     .place = place,
                     .unit = unit,
                     .nominal = nominal,
                     .columns = column.matrix() / series.noise});
  };
  const ArrayXd got = steps.Take(series.got);
  const ArrayXd since = steps.Take(series.time) - steps.from;
  if (shape.has_gain) add("gain", "", shape.output, 1.0);
  add("offset", name.unit, ArrayXd::Ones(got.size()));
  add("drift", name.unit + "/s", since);
  if (shape.fault.empty()) {
    add("drift of the gain", "1/s", since * shape.output);
    // g_t - u_t = d (g_(t-1) - u_t) [+ c (u_(t-1) - u_t)]
    const ArrayXd before = steps.Take(series.got, 1) - shape.output;
    const auto is_lag = [](const VectorXd& a) { return IsDecay(a[0]); };
    add("lag", "s", before);
    if (!added.empty() && added.back().fault == "lag") added.back().is_possible = is_lag;
    MatrixXd both(got.size(), 2);
    both << before.matrix() / series.noise,
        (steps.Take(series.expected, 1) - shape.output).matrix() / series.noise;
    // Of any gain and offset, got_t - u_t = 1 (got_(t-1) - u_t) - gain (u_(t-1) - u_t).
    added.push_back({.fault = "lag", .place = place, .unit = "s", .columns = both, .is_possible = is_lag});
  }
  if (series.rate.size() > 0) {
    const ArrayXd rate = steps.Take(series.rate);
    for (const auto& [fault, unit, column] :
         {std::tuple{"viscous friction", name.unit + " s/rad", ArrayXd(-rate)},
          std::tuple{"dry friction", name.unit, ArrayXd(-rate.sign())}}) {
      const size_t count = added.size();
      if (IsRefuted(series, steps, series.expected + series.rate)) continue;
      add(fault, unit, column);
      if (added.size() > count) added.back().is_possible = [](const VectorXd& a) { return a[0] >= 0.0; };
    }
  }
  if (look_for_sines && got.size() >= kFewestOfNoise) {
    Candidate sine = FindSine(got - shape.output, steps.Take(series.time), place, name.unit);
    sine.columns /= series.noise;
    added.push_back(sine);
  }
  return added;
}

Fault MakeFault(const Candidate& candidate, const VectorXd& amplitude, const VectorXd& error, double decay,
                double time_step) {
  Fault fault{candidate.fault, candidate.place, candidate.nominal + amplitude[0],
              error[0],        candidate.unit,  ""};
  if (candidate.fault == "lag") {
    const double own = std::clamp(amplitude[0], 1e-9, 1.0 - 1e-9);
    fault.value = -time_step / std::log(own);
    fault.error *= fault.value * fault.value / time_step / own;
  } else if (candidate.fault == "ripple") {
    fault.value = amplitude.norm();
    fault.error = error.norm();
    fault.detail = "at " + std::to_string(std::lround(candidate.nominal * 100.0) / 100) + " Hz";
  } else if (decay > 0.0 && (candidate.fault == "gain" || candidate.fault == "offset")) {
    // Of what a lag is sent: its own output has (1 - d) of it.
    fault.value = candidate.nominal + amplitude[0] / (1.0 - decay);
    fault.error /= 1.0 - decay;
  }
  return fault;
}

/// A whole explanation of a series.
struct Fit {
  std::vector<Fault> faults;
  std::vector<std::vector<Fault>> same;  // of each fault, what would do in its place
  CauseSelection selection;
  double criterion = 0.0;
  double size = 0.0;  // |y|, whitened
  bool is_noise = false;

  [[nodiscard]] bool is_possible() const { return !faults.empty(); }
};

/// Whether what is left over is noise, each step for itself.
bool IsWhite(const VectorXd& residual) {
  const Index count = residual.size();
  if (count < kFewestOfNoise) return false;
  const double square = residual.squaredNorm();
  for (Index k = 1; k <= 3; ++k) {
    const double along = residual.head(count - k).dot(residual.tail(count - k)) / square;
    if (std::abs(along) > kWhite / std::sqrt(static_cast<double>(count))) return false;
  }
  // Noise has no few values that all the rest is beside.
  return residual.cwiseAbs().maxCoeff() < 6.0 * std::sqrt(square / static_cast<double>(count));
}

Fit MakeFit(const SignalSeries& series, const Steps& steps, const Shape& shape, double floor,
            bool look_for_sines) {
  const std::vector<Candidate> added = ListAdded(series, steps, shape, look_for_sines);
  const VectorXd y = ((steps.Take(series.got) - shape.output) / series.noise).matrix();
  Fit fit;
  fit.size = ((steps.Take(series.got) - steps.Take(series.expected)) / series.noise).matrix().norm();
  fit.selection = SelectCauses(y, added, {.most_terms = kMostTerms, .restarts = 8, .floor = floor});
  fit.criterion =
      fit.selection.criterion + shape.parameters * std::log(static_cast<double>(y.size())) +
      (shape.fault.empty()
           ? 0.0
           : 2.0 * std::log(static_cast<double>(shape.tried) * static_cast<double>(added.size())));
  const std::string place =
      series.name.group == "motors" ? series.name.place : series.name.place + ", " + series.name.what;
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
  // A drift that began since the step before has come so far at the first.
  const auto has_come_to = [&](const char* fault, const char* drift) {
    const double since = find(fault) / find(drift);
    return since > 0.0 && std::isfinite(since) &&
           (steps.was_before || since <= (1.0 + kSinceStep) * time_step);
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
  if (decay != 0.0 && !IsDecay(decay)) fit.criterion = std::numeric_limits<double>::infinity();
  const double left = std::sqrt(fit.selection.residual.squaredNorm() / static_cast<double>(y.size()));
  if (left > kLeft * std::sqrt(floor) && IsWhite(fit.selection.residual)) {
    fit.faults.push_back({"noise, standard deviation", place, left * series.noise,
                          left * series.noise / std::sqrt(2.0 * static_cast<double>(y.size())),
                          series.name.unit, ""});
    fit.same.emplace_back();
    fit.is_noise = true;
  }
  return fit;
}

/// Names of a fit's faults: what two explanations may have in common.
std::string NamesOf(const std::vector<Fault>& faults) {
  std::string text;
  for (const Fault& fault : faults) text += (text.empty() ? "" : " and ") + fault.fault;
  return text;
}

/// The explanations of one series, the most likely first.
struct Verdict {
  const SignalSeries* series = nullptr;
  Steps steps;
  std::vector<Fit> fits;  // that are equally likely
  std::string rival;
  double log_odds = 0.0;
  bool is_explained = false;
  double largest_unheard = 0.0;  // of a signal of which nothing came, else 0
};

/// Of a signal of which nothing came: any dead zone that is wide enough, any step that is large enough.
void AddSilence(const SignalSeries& series, const ArrayXd& u, Verdict* verdict) {
  if (verdict->fits.empty() || verdict->fits.front().faults.size() != 1) return;
  verdict->largest_unheard = u.abs().maxCoeff();
  const Fault& dead = verdict->fits.front().faults.front();
  std::vector<Fault>& same = verdict->fits.front().same.front();
  if (series.name.group == "motors")
    same.push_back({"dead zone", dead.place, verdict->largest_unheard, 0.0, series.name.unit, "or more"});
  same.push_back(
      {"rounding to steps of", dead.place, 2.0 * verdict->largest_unheard, 0.0, series.name.unit, "or more"});
}

Verdict Judge(const SignalSeries& series, const std::vector<SignalSeries>& others) {
  Verdict verdict;
  verdict.series = &series;
  verdict.steps = FindSteps(series);
  const Steps& steps = verdict.steps;
  if (steps.rows.empty()) return verdict;
  const double square = SquaredNorm((steps.Take(series.got) - steps.Take(series.expected)) / series.noise) /
                        static_cast<double>(steps.size());
  const double floor = 1.0 + kAccuracy * kAccuracy * square;
  const auto is_good = [&](const Fit& fit) {
    return fit.is_possible() && (fit.is_noise || fit.selection.left <= kLeft * std::sqrt(floor));
  };
  std::vector<Fit> fits;
  for (const bool sines : {false, true}) {
    fits.clear();
    for (const Shape& shape : ListShapes(series, steps, others))
      fits.push_back(MakeFit(series, steps, shape, floor, sines));
    std::sort(fits.begin(), fits.end(), [](const Fit& a, const Fit& b) { return a.criterion < b.criterion; });
    // Sines fit much: they are looked for where nothing else explains it.
    if (is_good(fits.front()) && !fits.front().is_noise) break;
  }
  const double largest = (steps.Take(series.got) - steps.Take(series.expected)).abs().maxCoeff();
  verdict.is_explained = steps.size() >= kFewest && largest >= kFaint * series.noise && is_good(fits.front());
  std::vector<std::string> names;
  for (Fit& fit : fits) {
    if (!fit.is_possible()) continue;
    const double odds = 0.5 * (fit.criterion - fits.front().criterion);
    const std::string name = NamesOf(fit.faults);
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    names.push_back(name);
    // What has more faults has simpler ones as a special case.
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
    AddSilence(series, steps.Take(series.expected), &verdict);
  return verdict;
}

Explanation Start(const Verdict& verdict, CauseChannel channel) {
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
void Tell(const Verdict& verdict, CauseChannel channel, Causes* causes) {
  if (verdict.steps.rows.empty()) return;
  Explanation whole = Start(verdict, channel);
  if (!verdict.is_explained || verdict.fits.empty()) {
    whole.outcome = CauseOutcome::kNotExplained;
    if (!verdict.fits.empty()) whole.faults = verdict.fits.front().faults;
    if (whole.faults.empty())
      whole.faults.push_back({"differs", verdict.series->name.place, 0.0, 0.0, "", ""});
    causes->push_back(whole);
    return;
  }
  const Fit& best = verdict.fits.front();
  const bool single = best.faults.size() == 1;
  for (size_t place = 0; place < best.faults.size(); ++place) {
    Explanation one = whole;
    one.faults = {best.faults[place]};
    one.faults.insert(one.faults.end(), best.same[place].begin(), best.same[place].end());
    for (size_t i = 1; i < verdict.fits.size(); ++i) {
      // Of several faults that are replaced together, the first of the others stands for all.
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

/// A fault that most of a group have, with the same value: told once.
void TellCommon(std::vector<Verdict>* verdicts, const std::map<std::string, int>& sizes, CauseChannel channel,
                Causes* causes) {
  struct Common {
    std::vector<size_t> members;
    Fault fault;
    std::map<std::string, int> groups;
  };
  std::map<std::string, std::vector<Common>> by_name;
  for (size_t i = 0; i < verdicts->size(); ++i) {
    if (!(*verdicts)[i].is_explained) continue;
    for (const Fit& fit : (*verdicts)[i].fits) {
      if (fit.faults.size() != 1 || fit.is_noise) continue;
      const Fault& fault = fit.faults.front();
      std::vector<Common>& commons = by_name[fault.fault + fault.unit];
      constexpr double kSame = 1e-4;
      auto same = std::find_if(commons.begin(), commons.end(), [&](const Common& common) {
        return std::abs(common.fault.value - fault.value) <=
               kSame * std::abs(common.fault.value) + 3.0 * (fault.error + common.fault.error);
      });
      if (same == commons.end()) same = commons.insert(commons.end(), Common{{}, fault, {}});
      same->members.push_back(i);
      ++same->groups[(*verdicts)[i].series->name.group];
    }
  }
  const Common* most = nullptr;
  for (auto& [name, commons] : by_name) {
    for (Common& common : commons) {
      const bool rounds = common.fault.fault == "rounding to steps of";
      for (size_t i = 0; i < verdicts->size() && (rounds || common.fault.fault == "dead zone"); ++i) {
        const double unheard = (*verdicts)[i].largest_unheard;
        if (!(unheard > 0.0 && unheard <= (rounds ? 0.5 : 1.0) * common.fault.value)) continue;
        if (std::find(common.members.begin(), common.members.end(), i) != common.members.end()) continue;
        common.members.push_back(i);
        ++common.groups[(*verdicts)[i].series->name.group];
      }
      std::sort(common.members.begin(), common.members.end());
      if (most == nullptr || common.members.size() > most->members.size()) most = &common;
    }
  }
  constexpr size_t kSeveral = 3;
  if (most == nullptr || most->members.size() < kSeveral) return;
  int could = 0;
  std::string groups;
  for (const auto& [group, count] : most->groups) {
    could += sizes.at(group);
    groups += (groups.empty() ? "" : ", ") + group;
  }
  if (3 * static_cast<int>(most->members.size()) < could) return;
  Explanation one = Start((*verdicts)[most->members.front()], channel);
  one.outcome = CauseOutcome::kNamed;
  one.faults = {most->fault};
  one.faults.front().place = most->groups.size() > 2 ? "everything that is measured" : "all " + groups;
  for (const size_t i : most->members) {
    const Verdict& verdict = (*verdicts)[i];
    one.from = std::min(one.from, verdict.steps.from);
    one.to = std::max(one.to, verdict.steps.to);
    one.ends = one.ends && verdict.steps.ends;
  }
  // Of an orientation the change is kept, which shows no delay of its own.
  const bool is_late = most->fault.fault == "delay" && most->groups.size() > 2;
  std::vector<Verdict> others;
  for (size_t i = 0; i < verdicts->size(); ++i) {
    const bool is_member = std::find(most->members.begin(), most->members.end(), i) != most->members.end();
    if (is_member || (is_late && (*verdicts)[i].series->name.group == "object orientation")) continue;
    others.push_back(std::move((*verdicts)[i]));
  }
  causes->push_back(one);
  *verdicts = std::move(others);
}

void ExplainChannel(const StepStore& store, bool motors, Causes* causes) {
  const auto expected = store.Get(motors ? StepStore::kTauDeclared : StepStore::kDeclaredReading);
  const auto got = store.Get(motors ? StepStore::kTauReceived : StepStore::kReading);
  const auto rates = store.Get(StepStore::kVelocity);
  const std::vector<SignalName>& names = motors ? store.motors() : store.readings();
  const VectorXd time = store.Get(StepStore::kTime).row(0);
  const Base& base = store.setup().model().base();
  MatrixXd motor_rates = rates;
  if (motors && base.type == BaseType::kDifferentialDrive)
    motor_rates.topRows<2>() = CalcWheelRateMap(base) * rates.topRows(2);
  std::vector<bool> history(static_cast<size_t>(store.size()));
  for (Index i = 0; i < store.size(); ++i) history[static_cast<size_t>(i)] = store.HasHistory(i);
  // Torques pass a gear once and back, relative to the largest of them; readings are copied.
  const double largest = motors ? expected.cwiseAbs().maxCoeff() : 0.0;
  std::vector<SignalSeries> series;
  std::map<std::string, int> sizes;
  for (Index i = 0; i < expected.rows(); ++i) {
    SignalSeries& one = series.emplace_back();
    one.name = names[static_cast<size_t>(i)];
    one.time = time;
    one.expected = expected.row(i);
    one.got = got.row(i);
    if (motors) one.rate = motor_rates.row(i);
    one.has_history = history;
    const double size = std::max({one.expected.cwiseAbs().maxCoeff(), 1e-3 * largest, 1e-3});
    one.noise = (motors ? 1e-14 : 1e-15) * size;
    ++sizes[one.name.group];
  }
  std::vector<Verdict> verdicts;
  for (const SignalSeries& one : series) {
    Verdict verdict = Judge(one, series);
    if (!verdict.steps.rows.empty()) verdicts.push_back(std::move(verdict));
  }
  const CauseChannel channel = motors ? CauseChannel::kActuation : CauseChannel::kMeasurement;
  TellCommon(&verdicts, sizes, channel, causes);
  for (const Verdict& verdict : verdicts) Tell(verdict, channel, causes);
}

}  // namespace

Causes ExplainSignal(const SignalSeries& series, const std::vector<SignalSeries>& others) {
  Causes causes;
  Tell(Judge(series, others), CauseChannel::kActuation, &causes);
  return causes;
}

Causes ExplainSignals(const StepStore& store) {
  Causes causes;
  if (store.size() == 0) return causes;
  for (const bool motors : {true, false}) ExplainChannel(store, motors, &causes);
  return causes;
}

}  // namespace dexcheck
