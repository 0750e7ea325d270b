#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "harness/diagnosis/signal_shapes.h"
#include "harness/diagnosis/sine_fit.h"

namespace dexcheck {
namespace {

using Eigen::ArrayXd;

constexpr double kLeastWay = 1e-3;  // rad or m, over which a ripple of the position is looked for

class CouplingList {
 public:
  CouplingList(const SignalSeries& series, const SignalSteps& steps)
      : series_(series), steps_(steps), u_(steps.Take(series.expected)), off_(steps.Take(series.got) - u_) {}

  void AddCrosstalk(const std::vector<SignalSeries>& others) {
    for (const SignalSeries& other : others) {
      const bool is_own = other.name.place == series_.name.place && other.name.what == series_.name.what;
      if (is_own || other.name.group != series_.name.group || other.name.unit != series_.name.unit) continue;
      const std::string what = other.name.place == series_.name.place ? " " + other.name.what : std::string();
      Add("crosstalk of " + other.name.place + what, "", steps_.Take(other.expected));
    }
  }

  void AddNonlinear() {
    Add("gain where positive", "", u_.max(0.0), 1.0);
    Add("gain where negative", "", u_.min(0.0), 1.0);
    const std::string per = "per " + series_.name.unit;
    Add("square", per, u_.square());
    Add("cube", per + " squared", u_.cube());
  }

  void AddFriction() {
    if (series_.rate.size() == 0) return;
    const ArrayXd rate = steps_.Take(series_.rate);
    Add("friction of the squared rate", series_.name.unit + " s^2/rad^2", -rate * rate.abs());
    candidates_.back().is_possible = IsFriction;
    AddSmoothFriction(rate);
  }

  void AddPosition() {
    if (series_.position.size() == 0) return;
    const ArrayXd position = steps_.Take(series_.position);
    if (series_.rate.size() > 0) Add("spring", series_.name.unit + "/rad", -position);
    if (!(position.maxCoeff() - position.minCoeff() > kLeastWay) || off_.size() < kFewestOfNoise) return;
    const Sine sine = FindSine(off_, position);
    candidates_.push_back({.fault = "ripple over the position",
                           .place = PlaceOf(series_.name),
                           .unit = series_.name.unit,
                           .detail = fmt::format("with {:.4g} a turn", 2.0 * kPi * sine.frequency),
                           .columns = sine.columns / series_.noise,
                           .parameters = 3});
  }

  [[nodiscard]] std::vector<Candidate> Take() { return std::move(candidates_); }

 private:
  static bool IsFriction(const VectorXd& a) { return a[0] >= 0.0; }

  void Add(const std::string& fault, const std::string& unit, const ArrayXd& column, double nominal = 0.0) {
    candidates_.push_back({.fault = fault,
                           .place = PlaceOf(series_.name),
                           .unit = unit,
                           .nominal = nominal,
                           .columns = column.matrix() / series_.noise});
  }

  /// -tanh(rate / v) of the v that leaves least.
  void AddSmoothFriction(const ArrayXd& rate) {
    const double fastest = rate.abs().maxCoeff();
    if (!(fastest > 0.0)) return;
    const auto find_left = [&](double log_v) {
      const ArrayXd column = -(rate / std::exp(log_v)).tanh();
      const double amplitude = (column * off_).sum() / column.square().sum();
      return (off_ - amplitude * column).square().sum();
    };
    double best = std::log(fastest), least = std::numeric_limits<double>::infinity();
    const auto consider = [&](double log_v) {
      const double left = find_left(log_v);
      if (left < least) least = left, best = log_v;
    };
    constexpr int kGrid = 60;
    constexpr double kSlowest = 15.0, kStep = kSlowest / kGrid;  // down to 3e-7 of the fastest
    for (int i = 0; i <= kGrid; ++i) consider(std::log(fastest) + 1.0 - i * kStep);
    for (double width = kStep; width > 1e-13; width *= 0.7)
      for (const double to : {best - width, best + width}) consider(to);
    Add("dry friction", series_.name.unit, -(rate / std::exp(best)).tanh());
    candidates_.back().detail = fmt::format("times tanh(rate / {:.4g})", std::exp(best));
    candidates_.back().parameters = 2;
    candidates_.back().is_possible = IsFriction;
  }

  const SignalSeries& series_;
  const SignalSteps& steps_;
  ArrayXd u_, off_;
  std::vector<Candidate> candidates_;
};

}  // namespace

std::vector<Candidate> ListCouplings(const SignalSeries& series, const SignalSteps& steps,
                                     const std::vector<SignalSeries>& others) {
  CouplingList list(series, steps);
  list.AddCrosstalk(others);
  list.AddNonlinear();
  list.AddFriction();
  list.AddPosition();
  std::vector<Candidate> candidates = list.Take();
  std::erase_if(candidates, [](const Candidate& one) { return !(one.columns.cwiseAbs().maxCoeff() > 0.0); });
  return candidates;
}

}  // namespace dexcheck
