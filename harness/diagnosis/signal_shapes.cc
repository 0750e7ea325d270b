#include "harness/diagnosis/signal_shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace dexcheck {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

double SquaredNorm(const ArrayXd& x) { return x.square().sum(); }

/// Whether what has this output for good is over when it would still show.
bool IsRefuted(const SignalSeries& series, const SignalSteps& steps, const VectorXd& output) {
  if (!steps.ends) return false;
  const Index first = static_cast<Index>(steps.rows.back()) + 1, count = output.size() - first;
  return ((output - series.expected).tail(count).array().abs() > kSignalFaint * series.noise).any();
}

/// g = a u_k + b u_(k+1) + c of the whole delay k that fits best, a + b = 1.
void AddDelay(const ArrayXd& got, const SignalSeries& series, const SignalSteps& steps,
              std::vector<SignalShape>* shapes) {
  double least = std::numeric_limits<double>::infinity();
  SignalShape best{.fault = "delay",
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
    SignalShape between = best;
    between.value = static_cast<double>(k) + f;
    between.output = late + f * (later - late);
    between.parameters = 2;
    shapes->push_back(between);
  }
}

void AddLimits(const ArrayXd& u, const ArrayXd& got, const SignalSeries& series, const SignalSteps& steps,
               std::vector<SignalShape>* shapes) {
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
void AddSteps(const ArrayXd& u, const ArrayXd& got, const std::string& unit,
              std::vector<SignalShape>* shapes) {
  // Remainders of remainders have the rounding of all quotients before them.
  const double rounding = 1e-10 * got.abs().maxCoeff();
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
void AddExchange(const ArrayXd& got, const SignalSeries& series, const SignalSteps& steps,
                 const std::vector<SignalSeries>& others, std::vector<SignalShape>* shapes) {
  double least = 0.05 * SquaredNorm(got - steps.Take(series.expected));
  SignalShape best{.fault = "", .unit = "", .detail = "", .parameters = 2, .output = {}, .has_gain = false};
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

}  // namespace

SignalSteps FindSteps(const SignalSeries& series) {
  SignalSteps steps;
  const ArrayXd difference = (series.got - series.expected).array().abs();
  Index first = 0, last = difference.size() - 1;
  while (first <= last && !(difference[first] > series.noise)) ++first;
  while (last > first && !(difference[last] > series.noise)) --last;
  for (Index i = first; i <= last; ++i)
    if (series.has_history[static_cast<size_t>(i)]) steps.rows.push_back(i);
  if (first > last) return steps;
  // What is over so soon is looked at all the same, and what came before was as it is at the first.
  if (static_cast<Index>(steps.rows.size()) < kFewestSteps) {
    steps.rows.clear();
    for (Index i = first; i <= last; ++i) steps.rows.push_back(i);
  }
  steps.was_before = first == 0;
  steps.from = series.time[first];
  steps.to = series.time[last];
  steps.ends = last + StepStore::kHistory < difference.size();
  return steps;
}

std::vector<SignalShape> ListShapes(const SignalSeries& series, const SignalSteps& steps,
                                    const std::vector<SignalSeries>& others) {
  const ArrayXd u = steps.Take(series.expected), got = steps.Take(series.got);
  std::vector<SignalShape> shapes;
  shapes.push_back({.fault = "", .unit = "", .detail = "", .output = u});
  AddDelay(got, series, steps, &shapes);
  AddLimits(u, got, series, steps, &shapes);
  AddSteps(u, got, series.name.unit, &shapes);
  AddExchange(got, series, steps, others, &shapes);
  const bool is_still = (got - got.mean()).abs().maxCoeff() <= series.noise;
  if (is_still && std::abs(got.mean()) > kSignalLeft * series.noise)
    shapes.push_back(
        {"stuck at", series.name.unit, "", got.mean(), 1, ArrayXd::Constant(u.size(), got.mean()), false});
  return shapes;
}

std::string PlaceOf(const SignalName& name) {
  return name.group == "motors" ? name.place : name.place + ", " + name.what;
}

bool IsDecay(double decay) {
  constexpr double kLeast = 1e-6;
  return decay > kLeast && decay < 1.0 - kLeast;
}

std::vector<Candidate> ListAdded(const SignalSeries& series, const SignalSteps& steps,
                                 const SignalShape& shape, bool look_for_sines) {
  const SignalName& name = series.name;
  const std::string place = PlaceOf(name);
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

}  // namespace dexcheck
