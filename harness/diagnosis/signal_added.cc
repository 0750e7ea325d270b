#include <fmt/format.h>

#include <string>
#include <utility>

#include "harness/diagnosis/signal_shapes.h"
#include "harness/diagnosis/sine_fit.h"

namespace dexcheck {
namespace {

using Eigen::ArrayXd;

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

}  // namespace

std::vector<Candidate> ListAdded(const SignalSeries& series, const SignalSteps& steps,
                                 const SignalShape& shape, SignalSearch search) {
  AddedList list(series, steps, shape);
  if (search == SignalSearch::kTurns && shape.fault.empty()) list.AddTurns();
  if (search == SignalSearch::kSines) list.AddRipple("ripple", "at {:.4g} Hz", 1.0, steps.Take(series.time));
  return list.Take();
}

}  // namespace dexcheck
