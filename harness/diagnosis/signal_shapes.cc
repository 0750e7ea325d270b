#include "harness/diagnosis/signal_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "harness/diagnosis/sine_fit.h"

namespace dexcheck {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

double SquaredNorm(const ArrayXd& x) { return x.square().sum(); }

/// The signal so many steps before; the first where there is none.
VectorXd Shift(const VectorXd& signal, Index back) {
  VectorXd late = signal;
  late.tail(signal.size() - back) = signal.head(signal.size() - back);
  late.head(back).setConstant(signal[0]);
  return late;
}

class ShapeList {
 public:
  ShapeList(const SignalSeries& series, const SignalSteps& steps)
      : series_(series), steps_(steps), u_(steps.Take(series.expected)), got_(steps.Take(series.got)) {}

  void Add(SignalShape shape) {
    shape.changes = CountChanges(shape);
    shapes_.push_back(std::move(shape));
  }

  /// A fault that Transmit knows.
  void Add(const char* fault, const std::string& unit, double value, bool has_gain, int parameters = 1,
           Index tried = 1) {
    Add({.fault = fault,
         .unit = unit,
         .value = value,
         .parameters = parameters,
         .output = Transmit({fault, "", value, 0.0, "", ""}, series_),
         .has_gain = has_gain,
         .tried = tried});
  }

  /// g = a u_k + b u_(k+1) + c of the whole delay k that fits best, a + b = 1.
  void AddDelay() {
    double least = std::numeric_limits<double>::infinity();
    Index best = 1;
    for (Index k = 1; k <= StepStore::kHistory; ++k) {
      const ArrayXd off = got_ - steps_.Take(series_.expected, k);
      const double left = SquaredNorm(off - off.mean());
      if (left < least) least = left, best = k;
    }
    Add("delay", "steps", static_cast<double>(best), true, 1, StepStore::kHistory);
    // Between two steps: g - u_k = f (u_(k+1) - u_k).
    for (const Index k : {best - 1, best}) {
      const ArrayXd late = steps_.Take(series_.expected, k);
      const ArrayXd later = steps_.Take(series_.expected, k + 1);
      const double square = SquaredNorm(later - late);
      if (!(square > 0.0) || k >= StepStore::kHistory) continue;
      const double f = ((got_ - late) * (later - late)).sum() / square;
      constexpr double kWhole = 1e-6;
      if (f > kWhole && f < 1.0 - kWhole)
        Add("delay", "steps", static_cast<double>(k) + f, true, 2, StepStore::kHistory);
    }
  }

  void AddLimits() {
    const std::string& unit = series_.name.unit;
    const double most = got_.abs().maxCoeff();
    // Positions have no limit: encoders count on.
    const bool has_limit = series_.name.group != "joint positions";
    if (has_limit && most > 0.0 && most < u_.abs().maxCoeff()) Add("limit", unit, most, false);
    if (series_.name.group != "motors") return;
    // Outside of a dead zone |u| - |g| is its half width.
    std::vector<double> less;
    for (Index i = 0; i < u_.size(); ++i)
      if (got_[i] != 0.0 && got_[i] * u_[i] > 0.0) less.push_back(std::abs(u_[i]) - std::abs(got_[i]));
    const double zone = Median(std::move(less));
    if (zone > 0.0 && !IsRefuted(series_, steps_, Transmit({"dead zone", "", zone, 0.0, "", ""}, series_)))
      Add("dead zone", unit, zone, false);
  }

  /// Whole multiples of a step: the largest that divides all, made better by all of them.
  void AddSteps() {
    // A difference of multiples, each off by the noise, and what of it the step before them was off.
    constexpr double kRemainder = 8.0;
    const double largest = got_.abs().maxCoeff(), exact = 1e-10 * largest;
    const double rounding = std::max(exact, kRemainder * series_.noise);
    const Index count = got_.size() - 1;
    if (!((got_ - got_[0]).abs().maxCoeff() > rounding)) return AddOneStep();
    // From few multiples to many, so that each is counted right, and the step is known better with each.
    ArrayXd apart(2 * count);
    apart << (got_.tail(count) - got_[0]).abs(), (got_.tail(count) - got_.head(count)).abs();
    std::sort(apart.begin(), apart.end());
    double step = 0.0;
    for (const double whole : apart) {
      // By Euclid's algorithm, in which a remainder of rounding is none.
      for (double value = whole; value > rounding;) {
        const double rest = step > 0.0 ? std::abs(std::remainder(value, step)) : 0.0;
        if (step == 0.0) step = value;
        if (!(rest > rounding)) break;
        value = step;
        step = rest;
      }
      if (whole > rounding) step = whole / std::round(whole / step);
    }
    // Multiples of what is hardly more than rounding are any values.
    if (!(step > 1e2 * exact)) return;
    // The best step is the one that leaves least, with the largest value as many of it.
    const double count_of_largest = std::round(largest / step);
    double least = std::numeric_limits<double>::infinity();
    const int tried = rounding > exact ? 100 : 0;  // on each side
    for (int i = -tried; i <= tried; ++i) {
      const double one = (largest + i * series_.noise / std::max(1, tried)) / count_of_largest;
      const double left = SquaredNorm(got_ - one * (u_ / one).round());
      if (left < least) least = left, step = one;
    }
    Add("rounding to steps of", series_.name.unit, step, false);
  }

  /// The other one of the same kind whose signal this one has.
  void AddExchange(const std::vector<SignalSeries>& others) {
    double least = 0.05 * SquaredNorm(got_ - u_);
    SignalShape best{.parameters = 2, .has_gain = false};
    for (const SignalSeries& other : others) {
      if (other.name.group != series_.name.group ||
          (other.name.place == series_.name.place && other.name.what == series_.name.what))
        continue;
      const double left = SquaredNorm(got_ - steps_.Take(other.expected));
      if (!(left < least)) continue;
      least = left;
      best.fault = "signal of " + other.name.place +
                   (other.name.place == series_.name.place ? " " + other.name.what : std::string()) +
                   ", gain";
      best.value = 1.0;
      best.output = other.expected;
      best.tried = static_cast<Index>(others.size());
    }
    if (!best.fault.empty()) Add(best);
  }

  void AddStuck() {
    const bool is_still = got_.maxCoeff() - got_.minCoeff() <= series_.noise;
    if (is_still && std::abs(got_[0]) > SignalSeries::kLeft * series_.noise)
      Add("stuck at", series_.name.unit, got_[0], false);
  }

  /// The moved part follows at a distance, on both sides.
  void AddPlay() {
    const ArrayXd off = got_ - u_;
    const double half = off.abs().maxCoeff();
    constexpr double kBothSides = 0.9, kMost = 0.1;  // rad or m, of any gear's play
    if (series_.name.group != "joint positions" || half > kMost || off.maxCoeff() < kBothSides * half ||
        -off.minCoeff() < kBothSides * half)
      return;
    Add("play", series_.name.unit, half, false);
  }

  [[nodiscard]] std::vector<SignalShape> Take() { return std::move(shapes_); }

 private:
  /// Adds the largest step that divides a signal of only one value.
  void AddOneStep() {
    constexpr double kCoarsest = 2.0 * kPi / 1024.0;  // rad or m, of the coarsest encoders of robots' joints
    const double least = 2.0 * (got_ - u_).abs().maxCoeff();
    const bool is_coarse =
        series_.name.group == "joint positions" ? least > kCoarsest : std::abs(got_[0]) > series_.coarsest;
    if (std::abs(got_[0]) < least || is_coarse) return;
    Add("rounding to steps of", series_.name.unit, std::abs(got_[0]), false);
  }

  [[nodiscard]] int CountChanges(const SignalShape& shape) const {
    // The past of the first steps is not known, and only what is late needs it.
    const bool is_late = shape.fault == "delay";
    const auto differs = [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i)
        if ((!is_late || series_.has_history[static_cast<size_t>(i)]) &&
            std::abs(shape.output[i] - series_.got[i]) > SignalSeries::kLeft * series_.noise)
          return 1;
      return 0;
    };
    return differs(0, steps_.first) + (steps_.ends ? differs(steps_.last + 1, series_.got.size()) : 0);
  }

  const SignalSeries& series_;
  const SignalSteps& steps_;
  ArrayXd u_, got_;
  std::vector<SignalShape> shapes_;
};

constexpr double kLeastWay = 1e-3;  // rad or m, over which a ripple of the position is looked for

bool IsFriction(const VectorXd& a) { return a[0] >= 0.0; }

class AddedList {
 public:
  AddedList(const SignalSeries& series, const SignalSteps& steps, const SignalShape& shape)
      : series_(series),
        steps_(steps),
        unit_(series.name.unit),
        output_(steps.Take(shape.output)),
        off_(steps.Take(series.got) - output_) {
    if (shape.has_gain) Add("gain", "", output_, 1.0);
    Add("offset", unit_, ArrayXd::Ones(off_.size()));
    const ArrayXd since = steps_.Take(series_.time) - steps_.from;
    Add("drift", unit_ + "/s", since);
    if (shape.fault.empty()) {
      Add("drift of the gain", "1/s", since * output_);
      AddLag();
    }
    if (series_.rate.size() == 0 || IsRefuted(series_, steps_, series_.expected + series_.rate)) return;
    const ArrayXd rate = steps_.Take(series_.rate);
    Add("viscous friction", unit_ + " s/rad", -rate, 0.0, IsFriction);
    Add("dry friction", unit_, -rate.sign(), 0.0, IsFriction);
  }

  void AddTurns() {
    if (series_.position.size() == 0) return;
    const ArrayXd position = steps_.Take(series_.position);
    if (position.maxCoeff() - position.minCoeff() > kLeastWay)
      AddRipple("ripple over the position", "with {:.4g} a turn", 2.0 * kPi, position);
  }

  /// The frequency is the best of as many as there are steps, which weighs 2 log n as two numbers would.
  void AddRipple(const char* fault, const char* detail, double per, const ArrayXd& over) {
    if (off_.size() < kFewestOfNoise) return;
    const Sine sine = FindSine(off_, over);
    Add(fault, unit_, sine.columns);
    candidates_.back().detail = fmt::format(fmt::runtime(detail), per * sine.frequency);
    candidates_.back().parameters = 3;
  }

  [[nodiscard]] std::vector<Candidate> Take() { return std::move(candidates_); }

 private:
  /// @param columns that are not all zero.
  void Add(const std::string& fault, const std::string& unit, const MatrixXd& columns, double nominal = 0.0,
           const std::function<bool(const VectorXd&)>& is_possible = nullptr) {
    if (!(columns.cwiseAbs().maxCoeff() > 0.0)) return;
    candidates_.push_back({.fault = fault,
                           .place = PlaceOf(series_.name),
                           .unit = unit,
                           .nominal = nominal,
                           .columns = columns / series_.noise,
                           .is_possible = is_possible});
  }

  /// g_t - u_t = d (g_(t-1) - u_t) [+ c (u_(t-1) - u_t)]
  void AddLag() {
    const auto is_lag = [](const VectorXd& a) { return IsDecay(a[0]); };
    MatrixXd both(off_.size(), 2);
    both << (steps_.Take(series_.got, 1) - output_).matrix(),
        (steps_.Take(series_.expected, 1) - output_).matrix();
    Add("lag", "s", both.leftCols(1), 0.0, is_lag);
    // With any gain and offset, got_t - u_t = 1 (got_(t-1) - u_t) - gain (u_(t-1) - u_t).
    Add("lag", "s", both, 0.0, is_lag);
  }

  const SignalSeries& series_;
  const SignalSteps& steps_;
  const std::string& unit_;
  ArrayXd output_, off_;
  std::vector<Candidate> candidates_;
};

VectorXd TransmitAlways(const Fault& fault, const SignalSeries& series) {
  const VectorXd& u = series.expected;
  const ArrayXd size = u.array().abs();
  const double value = fault.value;
  if (fault.fault == "gain") return value * u;
  if (fault.fault == "offset") return u.array() + value;
  if (fault.fault == "stuck at") return VectorXd::Constant(u.size(), value);
  if (fault.fault == "limit") return u.cwiseMin(value).cwiseMax(-value);
  if (fault.fault == "dead zone") return u.array().sign() * (size - value).max(0.0);
  if (fault.fault == "rounding to steps of") return value * (u.array() / value).round();
  if (fault.fault != "delay") return {};
  const Index last = u.size() - 1, whole = std::min(static_cast<Index>(value), last);
  const VectorXd late = Shift(u, whole);
  return late + (value - std::floor(value)) * (Shift(u, std::min(whole + 1, last)) - late);
}

VectorXd FollowAtDistance(double half, const SignalSeries& series) {
  VectorXd output = series.got;
  const VectorXd& time = series.time;
  for (Index i = 1; i < output.size(); ++i)
    if (time[i] - time[i - 1] <= 1.5 * (time[1] - time[0]))  // not after a gap
      output[i] = std::clamp(output[i - 1], series.expected[i] - half, series.expected[i] + half);
  return output;
}

}  // namespace

VectorXd Transmit(const Fault& fault, const SignalSeries& series, Index begin) {
  const VectorXd& u = series.expected;
  if (fault.fault == "play") return FollowAtDistance(fault.value, series);
  const bool is_lag = fault.fault == "lag" && u.size() > 1;
  VectorXd output = is_lag ? u : TransmitAlways(fault, series);
  if (output.size() == 0) return output;
  output.head(begin) = u.head(begin);
  if (!is_lag) return output;
  // Until it begins it keeps up.
  const double decay = CalcDecay(fault, series);
  if (begin == 0) output[0] = series.got[0];
  for (Index i = std::max<Index>(begin, 1); i < u.size(); ++i)
    output[i] = decay * output[i - 1] + (1.0 - decay) * u[i];
  return output;
}

double CalcDecay(const Fault& lag, const SignalSeries& series) {
  return std::exp(-(series.time[1] - series.time[0]) / lag.value);
}

SignalSteps FindSteps(const SignalSeries& series) {
  SignalSteps steps;
  const ArrayXd difference = (series.got - series.expected).array().abs();
  Index first = 0, last = difference.size() - 1;
  while (first <= last && !(difference[first] > series.noise)) ++first;
  while (last > first && !(difference[last] > series.noise)) --last;
  for (Index i = first; i <= last; ++i)
    if (series.has_history[static_cast<size_t>(i)]) steps.rows.push_back(i);
  if (first > last) return steps;
  // Short events are kept; the history before the first sample is taken as constant.
  if (static_cast<Index>(steps.rows.size()) < kFewestSteps) {
    steps.rows.clear();
    for (Index i = first; i <= last; ++i) steps.rows.push_back(i);
  }
  steps.first = first;
  steps.last = last;
  steps.was_before = first == 0;
  steps.from = std::isnan(series.from) ? series.time[first] : series.from;
  steps.to = std::isnan(series.to) ? series.time[last] : series.to;
  steps.ends = last + StepStore::kHistory < difference.size();
  return steps;
}

std::vector<SignalShape> ListShapes(const SignalSeries& series, const SignalSteps& steps,
                                    const std::vector<SignalSeries>& others) {
  ShapeList shapes(series, steps);
  shapes.Add({.output = series.expected});
  shapes.AddDelay();
  shapes.AddLimits();
  shapes.AddSteps();
  shapes.AddExchange(others);
  shapes.AddStuck();
  shapes.AddPlay();
  return shapes.Take();
}

std::vector<Candidate> ListAdded(const SignalSeries& series, const SignalSteps& steps,
                                 const SignalShape& shape, SignalSearch search) {
  AddedList list(series, steps, shape);
  if (search == SignalSearch::kTurns && shape.fault.empty()) list.AddTurns();
  if (search == SignalSearch::kSines) list.AddRipple("ripple", "at {:.4g} Hz", 1.0, steps.Take(series.time));
  return list.Take();
}

bool IsRefuted(const SignalSeries& series, const SignalSteps& steps, const VectorXd& output) {
  if (!steps.ends) return false;
  const Index count = output.size() - 1 - steps.last;
  return ((output - series.expected).tail(count).array().abs() > SignalSeries::kFaint * series.noise).any();
}

std::string PlaceOf(const SignalName& name) {
  return name.group == "motors" ? name.place : name.place + ", " + name.what;
}

bool IsDecay(double decay) {
  constexpr double kLeast = 1e-6;
  return decay > kLeast && decay < 1.0 - kLeast;
}

}  // namespace dexcheck
