#include "harness/diagnosis/signal_causes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "controller/model/platform.h"
#include "harness/diagnosis/signal_shapes.h"

namespace dexcheck {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

// Columns agree with what a fault does to this fraction: it is computed from the same numbers.
constexpr double kAccuracy = 1e-9;
// A drift that began since the step before has come so far, beside rounding, at the first.
constexpr double kSinceStep = 1e-6;
// Autocorrelation of noise that is white, times the root of the number of steps.
constexpr double kWhite = 4.0;
constexpr size_t kMostTerms = 3;

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

Fit MakeFit(const SignalSeries& series, const SignalSteps& steps, const SignalShape& shape, double floor,
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
  if (left > kSignalLeft * std::sqrt(floor) && IsWhite(fit.selection.residual)) {
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
  SignalSteps steps;
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
  const SignalSteps& steps = verdict.steps;
  if (steps.rows.empty()) return verdict;
  const double square =
      ((steps.Take(series.got) - steps.Take(series.expected)) / series.noise).square().sum() /
      static_cast<double>(steps.size());
  const double floor = 1.0 + kAccuracy * kAccuracy * square;
  const auto is_good = [&](const Fit& fit) {
    // Noise beside several other faults is what they do not explain.
    constexpr size_t kMostWithNoise = 2;
    return fit.is_possible() && (fit.is_noise ? fit.faults.size() <= kMostWithNoise
                                              : fit.selection.left <= kSignalLeft * std::sqrt(floor));
  };
  std::vector<Fit> fits;
  for (const bool sines : {false, true}) {
    fits.clear();
    for (const SignalShape& shape : ListShapes(series, steps, others))
      fits.push_back(MakeFit(series, steps, shape, floor, sines));
    std::sort(fits.begin(), fits.end(), [](const Fit& a, const Fit& b) { return a.criterion < b.criterion; });
    // Sines fit much: they are looked for where nothing else explains it.
    if (is_good(fits.front()) && !fits.front().is_noise) break;
  }
  const double largest = (steps.Take(series.got) - steps.Take(series.expected)).abs().maxCoeff();
  verdict.is_explained =
      steps.size() >= kFewestSteps && largest >= kSignalFaint * series.noise && is_good(fits.front());
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

/// Whether noise is as large as rounding to these steps makes it: evenly spread, so step / sqrt(12).
bool IsRoundingNoise(const Verdict& verdict, double step) {
  if (verdict.fits.empty() || !verdict.fits.front().is_noise) return false;
  constexpr double kScatter = 0.3;
  const double expected = step / std::sqrt(12.0);
  return std::abs(verdict.fits.front().faults.back().value - expected) <= kScatter * expected;
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
        const bool is_too_small = unheard > 0.0 && unheard <= (rounds ? 0.5 : 1.0) * common.fault.value;
        if (!is_too_small && !(rounds && IsRoundingNoise((*verdicts)[i], common.fault.value))) continue;
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
