#include "harness/recordings/torque_estimator.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"
#include "harness/recordings/base_motion.h"
#include "harness/recordings/torque_errors.h"

namespace dexcheck {
namespace {

using Eigen::Index;

/// Rounding of sums of products hides what a column has less of beside others.
constexpr double kIndependent = 1e-5;

/// R with R^T R = G, which may be singular, and as many rows as it has independent columns: Cholesky's, of
/// the columns that add most first. @param first columns come before all others; the last one comes last.
MatrixXd CalcFactor(const MatrixXd& G, Index first) {
  constexpr double kAddsNothing = 0.01 * kIndependent * kIndependent;
  const Index n = G.cols(), last = n - 1;
  const VectorXd size =
      G.diagonal().unaryExpr([](double s) { return std::max(s, std::numeric_limits<double>::min()); });
  VectorXd rest = VectorXd::Ones(n);  // 0 of columns that are done
  VectorXd left = G.diagonal().cwiseQuotient(size);
  MatrixXd R(n, n);  // its transpose
  Index rank = 0;
  const auto add = [&](Index pivot) {
    VectorXd row = G.col(pivot) - R.leftCols(rank) * R.row(pivot).head(rank).transpose();
    left[pivot] = 0.0;
    if (!(row[pivot] > 0.0)) return;
    R.col(rank) = rest.cwiseProduct(row) / std::sqrt(row[pivot]);
    left -= R.col(rank++).cwiseAbs2().cwiseQuotient(size);
    rest[pivot] = left[pivot] = left[last] = 0.0;
  };
  left[last] = 0.0;
  for (Index i = 0; i < first; ++i)
    if (left[i] > kAddsNothing) add(i);
  for (Index pivot = 0; left.maxCoeff(&pivot) > kAddsNothing;) add(pivot);
  add(last);
  return R.leftCols(rank).transpose();
}

}  // namespace

TorqueEstimator::TorqueEstimator(RecordingSet* recordings, size_t most_causes)
    : recordings_(recordings), most_causes_(most_causes) {
  do {
    ListFaults();
    Select();
  } while (recordings_->DropUnknownGains());
  if (LowerNoise()) Select();
  if (AddPushes()) {
    excluded_.resize(faults_.size(), false);
    Select();
  }
  while (ExcludeSeconds()) Select();
  WidenErrors();
}

void TorqueEstimator::WidenErrors() {
  if (selection_.terms.empty()) return;
  std::vector<Index> columns(static_cast<size_t>(CountForced(*recordings_)));
  std::iota(columns.begin(), columns.end(), Index{0});
  for (const CauseTerm& term : selection_.terms)
    for (Index k = 0; k < term.error.size(); ++k) columns.push_back(rows_.first[term.candidate] + k);
  const VectorXd errors = CalcClusteredErrors(rows_, CalcLeft(selection_.terms), columns);
  Index at = CountForced(*recordings_);
  for (CauseTerm& term : selection_.terms) {
    term.error = term.error.cwiseMax(errors.segment(at, term.error.size()));
    at += term.error.size();
  }
}

void TorqueEstimator::ListFaults() {
  const std::vector<int> judged = recordings_->ListJudged();
  if (judged.empty())
    throw InputError("the recordings determine no joint's drive gain: nothing can be judged");
  faults_ = ListTorqueFaults(recordings_->model(), judged, static_cast<int>(recordings_->size()),
                             recordings_->refinements(), recordings_->CalcExtents(), recordings_->frames());
  // Torques that hold a robot still reach no limit.
  std::erase_if(faults_, [&](const TorqueFault& one) {
    return (recordings_->has_currents() &&
            (one.kind == TorqueFault::kTorqueGain || one.kind == TorqueFault::kSaturation ||
             one.kind == TorqueFault::kStuckTorque)) ||
           ((*recordings_)[0].motion.stands &&
            (one.kind == TorqueFault::kSaturation || one.kind == TorqueFault::kStuckTorque));
  });
  excluded_.clear();
  // With drives' gains sought, the model's bodies are the scale that shows them.
  for (const TorqueFault& one : faults_)
    excluded_.push_back(recordings_->has_currents() && one.IsOfLoad() && one.kind != TorqueFault::kPayload);
}

void TorqueEstimator::Select() {
  selection_ = {};
  recordings_->ResetWeights();
  constexpr int kRounds = 6;
  constexpr double kLeastGain = 0.9;  // of what was estimated before, taken away at once
  // Times the noise's square: so much is left of a drive that is not known well.
  constexpr double kFarFromKnown = 2.0;
  bool is_known = true;
  for (int round = 0; round < kRounds; ++round) {
    rows_ = MakeTorqueRows(*recordings_, faults_, /*is_held=*/false);
    R_ = CalcFactor(rows_.CalcProducts(), CountForced(*recordings_));
    // A residual that no cause explains weighs as noise does, and is correlated.
    const double before = std::exchange(
        block_size_,
        round > 0 && is_known ? block_size_ : CalcBlockSize(Fit(is_known ? Part::kUsual : Part::kAll)));
    floor_ = is_known ? 1.0 : kFarFromKnown;
    selection_ = SelectAmong();
    if (round + 1 == kRounds || (round > 1 && std::abs(block_size_ - before) < 0.2 * before)) break;
    const VectorXd left = CalcLeft(selection_.terms);
    is_known = IsNoise(left);
    Relinearise();
    Weigh(is_known ? left : Fit(Part::kAll));
    if (recordings_->has_currents()) {
      const VectorXd off = CalcAmplitudes(selection_.terms).head(CountForced(*recordings_));
      recordings_->DivideGains(VectorXd(1.0 + off.array().max(-kLeastGain)));
    }
  }
}

void TorqueEstimator::Relinearise() {
  std::vector<bool> is_found(faults_.size(), false);
  for (const CauseTerm& term : selection_.terms) is_found[term.candidate] = true;
  for (const CauseTerm& term : selection_.terms) {
    TorqueFault& found = faults_[term.candidate];
    VectorXd others = CalcAmplitudes(selection_.terms);
    others.segment(rows_.first[term.candidate], term.amplitude.size()).setZero();
    if (found.kind == TorqueFault::kPush)
      found.push = FindTimes(*recordings_, rows_, rows_.CalcLeft(others), found.push);
    if (found.push.payload >= 0) PlaceMass(recordings_->model(), term.amplitude, &found);
    if (!found.IsOfLoad()) continue;
    // So are those that may have been in its place.
    const VectorXd y = R_.rightCols<1>() - R_.leftCols(others.size()) * others;
    for (size_t i = 0; i < faults_.size(); ++i) {
      const bool is_same = std::ranges::any_of(term.same, [&](const auto& one) { return one.first == i; });
      if (i != term.candidate && (!is_same || is_found[i])) continue;
      if (faults_[i].kind == TorqueFault::kCentre || faults_[i].kind == TorqueFault::kPayload)
        PlaceMass(recordings_->model(),
                  SolveLeastSquares(R_.middleCols(rows_.first[i], CountColumns(faults_[i])), y, kIndependent),
                  &faults_[i]);
    }
  }
  for (size_t i = 0; i < faults_.size(); ++i)
    if (faults_[i].kind == TorqueFault::kTorqueGain && faults_[i].index >= 0)
      ScaleWhole(is_found[i] ? selection_.terms : std::vector<CauseTerm>(), &faults_[i]);
}

void TorqueEstimator::ScaleWhole(const std::vector<CauseTerm>& terms, TorqueFault* gain) const {
  std::vector<ColumnPart>& parts = gain->sums.front();
  parts.resize(1);
  for (const CauseTerm& term : terms) {
    const TorqueFault& found = faults_[term.candidate];
    const bool is_recorded = found.kind == TorqueFault::kTorqueGain || found.kind == TorqueFault::kOffset ||
                             found.kind == TorqueFault::kAllOffsets || found.kind == TorqueFault::kDrift ||
                             found.kind == TorqueFault::kDelay || found.kind == TorqueFault::kStuckTorque ||
                             found.kind == TorqueFault::kPush;
    if (is_recorded) continue;
    for (size_t k = 0; k < found.sums.size(); ++k)
      for (ColumnPart part : found.sums[k]) {
        if (part.joint >= 0 && part.joint != gain->index) continue;
        part.joint = gain->index;
        part.factor *= term.amplitude[static_cast<Index>(k)];
        parts.push_back(part);
      }
  }
}

void TorqueEstimator::Weigh(const VectorXd& left) {
  for (const TorqueRows::Part& part : rows_.parts) {
    double& weight = recordings_->weight(part.recording, part.place);
    const double rms =
        weight * left.segment(part.begin, part.size).norm() / std::sqrt(std::max(1.0, part.samples));
    weight = std::max((*recordings_)[part.recording].noise[static_cast<Index>(part.place)], rms);
  }
}

Index TorqueEstimator::CountForcedRows() const {
  return (R_.leftCols(CountForced(*recordings_)).array() != 0.0).rowwise().any().count();
}

CauseSelection TorqueEstimator::SelectAmong() const {
  const Index width = R_.cols();
  const Index begin = CountForcedRows(), rows = R_.rows() - begin;
  std::vector<Candidate> candidates(faults_.begin(), faults_.end());
  for (size_t i = 0; i < faults_.size(); ++i) {
    candidates[i].columns = R_.block(begin, rows_.first[i], rows, CountColumns(faults_[i]));
    if (excluded_[i]) candidates[i].columns.setZero();
  }
  CauseOptions options;
  for (size_t i = 0; i < faults_.size(); ++i) {
    const TorqueFault& fault = faults_[i];
    if (fault.parameters > 0 || excluded_[i]) continue;
    if (IsPart(fault, Part::kUsual) || fault.kind == TorqueFault::kArmature) options.start.push_back(i);
  }
  options.most_terms = most_causes_;
  options.restarts = 0;
  options.exchanges_pairs = false;
  options.rows = rows_.samples;
  options.noise_block_size = block_size_;
  options.floor = floor_;
  options.independent = kIndependent;
  return SelectCauses(R_.col(width - 1).tail(rows), candidates, options);
}

VectorXd TorqueEstimator::CalcAmplitudes(const std::vector<CauseTerm>& terms) const {
  const Index width = R_.cols() - 1;
  VectorXd a = VectorXd::Zero(width);
  for (const CauseTerm& term : terms)
    a.segment(rows_.first[term.candidate], term.amplitude.size()) = term.amplitude;
  const Index forced = CountForced(*recordings_);
  const Index rows = CountForcedRows();
  const VectorXd right =
      R_.col(width).head(rows) - R_.block(0, forced, rows, width - forced) * a.tail(width - forced);
  if (rows > 0) a.head(forced) = SolveLeastSquares(R_.topLeftCorner(rows, forced), right);
  return a;
}

VectorXd TorqueEstimator::CalcLeft(const std::vector<CauseTerm>& terms) const {
  return rows_.CalcLeft(CalcAmplitudes(terms));
}

bool TorqueEstimator::ExcludeSeconds() {
  bool has_any = false;
  // A payload in all recordings is the link's own.
  std::vector<const CauseTerm*> payloads;
  for (const CauseTerm& term : selection_.terms)
    if (faults_[term.candidate].kind == TorqueFault::kPayload && faults_[term.candidate].recording >= 0)
      payloads.push_back(&term);
  if (payloads.size() > 1 && payloads.size() >= recordings_->size()) {
    const auto least =
        std::ranges::min_element(payloads, {}, [](const CauseTerm* one) { return one->amplitude[0]; });
    excluded_[(*least)->candidate] = has_any = true;
  }
  std::vector<std::tuple<TorqueFault::Kind, int, int>> seen;
  for (const CauseTerm& term : selection_.terms) {
    const TorqueFault& one = faults_[term.candidate];
    const bool is_shape =
        one.kind == TorqueFault::kDryFriction || one.kind == TorqueFault::kStribeckFriction ||
        one.kind == TorqueFault::kSaturation || one.kind == TorqueFault::kMass || one.IsEntry();
    if (one.kind != TorqueFault::kPush && !is_shape) continue;
    const bool is_geometry = one.kind == TorqueFault::kGeometry;
    const std::tuple what(one.kind, one.index,
                          is_geometry ? one.sums.front().front().column.component : one.push.window);
    if (std::find(seen.begin(), seen.end(), what) == seen.end()) {
      seen.push_back(what);
    } else {
      excluded_[term.candidate] = has_any = true;
    }
  }
  return has_any;
}

double TorqueEstimator::CalcHidden(double noise, double left, double samples) const {
  const double candidates = std::log(static_cast<double>(faults_.size()));
  const double needed = 2.0 * (std::log(rows_.samples / block_size_) + 2.0 * candidates) * block_size_;
  return std::sqrt(std::max(0.0, Square(noise) - Square(left)) +
                   Square(noise) * needed / std::max(1.0, samples));
}

double TorqueEstimator::CalcRms(const TorqueRows& rows, const VectorXd& left) const {
  double squares = 0.0;
  for (const TorqueRows::Part& part : rows.parts) {
    const ReadRecording& one = (*recordings_)[part.recording];
    const auto place = static_cast<Index>(part.place);
    squares +=
        left.segment(part.begin, part.size).squaredNorm() * Square(one.weight[place] / one.noise[place]);
  }
  return std::sqrt(squares / std::max(1.0, rows.samples));
}

bool TorqueEstimator::IsPart(const TorqueFault& fault, Part part) {
  using enum TorqueFault::Kind;
  if (part == Part::kAll) return fault.kind != kPush;
  const bool is_usual = fault.kind == kDryFriction || fault.kind == kViscousFriction || fault.kind == kOffset;
  if (part == Part::kUsual || is_usual)
    return is_usual && (part == Part::kUsual || (fault.parameters == 0 && !fault.HasVelocity()));
  return fault.kind == kArmature || (fault.kind >= kMass && fault.kind <= kInertia && !fault.IsEntry());
}

VectorXd TorqueEstimator::FitAmplitudes(Part part, Index* rank) const {
  std::vector<Index> columns;
  std::vector<double> plausible;
  for (Index i = 0; i < CountForced(*recordings_); ++i) columns.push_back(i), plausible.push_back(1.0);
  for (size_t i = 0; i < faults_.size(); ++i) {
    const auto is_this = [i](const CauseTerm& term) { return term.candidate == i; };
    // The times of a push are not exact where they are held out: by no numbers.
    const bool takes_chosen = part == Part::kAll || faults_[i].kind == TorqueFault::kPush;
    const bool is_part =
        IsPart(faults_[i], part) || (takes_chosen && std::ranges::any_of(selection_.terms, is_this));
    for (Index k = 0; k < CountColumns(faults_[i]) && is_part; ++k)
      columns.push_back(rows_.first[i] + k),
          plausible.push_back(faults_[i].scale.size() > 0 ? faults_[i].scale[k]
                                                          : std::max(1.0, std::abs(faults_[i].nominal)));
  }
  const Index y = R_.cols() - 1, width = static_cast<Index>(columns.size());
  const Eigen::Map<const VectorXd> scale(plausible.data(), width);
  MatrixXd C = R_(Eigen::all, columns) * scale.asDiagonal();
  if (rank != nullptr) {
    Eigen::ColPivHouseholderQR<MatrixXd> qr;
    qr.setThreshold(kIndependent);
    *rank = qr.compute(C).rank();
  }
  // Amplitudes that the motion hardly shows stay of plausible size.
  C.conservativeResize(C.rows() + width, Eigen::NoChange);
  C.bottomRows(width).setIdentity();
  VectorXd right = VectorXd::Zero(C.rows());
  right.head(R_.rows()) = R_.col(y);
  VectorXd a = VectorXd::Zero(y);
  a(columns) = Eigen::HouseholderQR<MatrixXd>(C).solve(right).cwiseProduct(scale);
  return a;
}

VectorXd TorqueEstimator::Fit(Part part) const { return rows_.CalcLeft(FitAmplitudes(part, nullptr)); }

double TorqueEstimator::CalcBlockSize(const VectorXd& left) const {
  double blocks = 0.0, of_blocks = 0.0, next = 0.0;
  for (const TorqueRows::Part& part : rows_.parts) {
    const auto values = left.segment(part.begin + part.within, part.size - part.within);
    blocks += static_cast<double>(values.size());
    of_blocks += values.squaredNorm();
    next += values.head(std::max<Index>(values.size() - 1, 0))
                .dot(values.tail(std::max<Index>(values.size() - 1, 0)));
  }
  const double all = left.squaredNorm() / std::max(1.0, rows_.samples);
  if (!(all > 0.0) || !(blocks > 0.0)) return 1.0;
  const double within = std::max(1.0, of_blocks / blocks / all);
  constexpr double kMostAlike = 0.98;
  const double correlation =
      std::clamp(next / std::max(of_blocks, std::numeric_limits<double>::min()), 0.0, kMostAlike);
  constexpr double kFewest = 100.0;
  return std::clamp(within * (1.0 + correlation) / (1.0 - correlation), 1.0,
                    std::max(1.0, rows_.samples / kFewest));
}

HeldPrediction TorqueEstimator::PredictByCauses(const TorqueRows& held) const {
  const VectorXd amplitudes = CalcAmplitudes(selection_.terms);
  HeldPrediction prediction{CountForced(*recordings_), CalcRms(held, held.CalcLeft(amplitudes))};
  for (const CauseTerm& term : selection_.terms)
    if (faults_[term.candidate].kind != TorqueFault::kIntegrator) prediction.numbers += term.amplitude.size();
  // An integrator's share is smooth and less than noise: the search may have left it.
  const VectorXd rest = R_.rightCols<1>() - R_.leftCols(amplitudes.size()) * amplitudes;
  for (size_t i = 0; i < faults_.size(); ++i) {
    if (faults_[i].kind != TorqueFault::kIntegrator) continue;
    const Index columns = CountColumns(faults_[i]);
    const VectorXd change = SolveLeastSquares(R_.middleCols(rows_.first[i], columns), rest, kIndependent);
    VectorXd with = amplitudes;
    with.segment(rows_.first[i], columns) += change;
    const auto amplitude = with.segment(rows_.first[i], columns);
    if (faults_[i].is_possible(amplitude) && (amplitude.array() >= faults_[i].least.array()).all())
      prediction.held_left = std::min(prediction.held_left, CalcRms(held, held.CalcLeft(with)));
  }
  double squares = 0.0;
  for (const TorqueRows::Part& part : held.parts)
    squares += part.samples * Square(CalcInexact(part) / recordings_->noise(part.recording, part.place));
  for (size_t i = 0; i < recordings_->size(); ++i)
    prediction.is_quantised = prediction.is_quantised || (*recordings_)[i].motion.is_quantised;
  prediction.inexact = std::sqrt(squares / std::max(1.0, held.samples));
  return prediction;
}

HeldPrediction TorqueEstimator::PredictByAll(const TorqueRows& held) const {
  Index rank = 0;
  const VectorXd left = held.CalcLeft(FitAmplitudes(Part::kPlain, &rank));
  return {rank, CalcRms(held, left)};
}

bool TorqueEstimator::LowerNoise() {
  const TorqueRows held = MakeTorqueRows(*recordings_, faults_, /*is_held=*/true);
  const HeldPrediction by_causes = PredictByCauses(held);
  if (!by_causes.IsBeatenBy(PredictByAll(held), by_causes.numbers > 0)) return false;
  const VectorXd left = held.CalcLeft(FitAmplitudes(Part::kPlain, nullptr));
  for (const TorqueRows::Part& part : held.parts) {
    // Friction that holds a joint is known to its own size.
    const auto joint = static_cast<size_t>(recordings_->joints()[part.place]);
    if (!(*recordings_)[part.recording].motion.moves[joint]) continue;
    const double rms = recordings_->weight(part.recording, part.place) *
                       left.segment(part.begin, part.size).norm() / std::sqrt(std::max(1.0, part.samples));
    double& noise = recordings_->noise(part.recording, part.place);
    noise = std::min(noise, std::hypot(rms, CalcInexact(part)));
  }
  return true;
}

double TorqueEstimator::CalcInexact(const TorqueRows::Part& part) const {
  // A kink of the acceleration leaves up to 2e-4 of the torque of a stretch without noise.
  constexpr double kFraction = 1.5e-4;
  const Index torque =
      part.balance->Find(part.place, {TorqueColumn::kTorque, recordings_->joints()[part.place]});
  const MatrixXd& products = part.balance->products(part.place);
  return kFraction * std::sqrt(products(torque, torque) / std::max(1.0, part.samples));
}

bool TorqueEstimator::AddPushes() {
  const VectorXd left = CalcLeft(selection_.terms);
  // Beside other causes, noise that stands out for a while is theirs.
  if (!selection_.terms.empty() && CalcRms(rows_, left) <= 1.0) return false;
  const size_t before = faults_.size();
  const MotionExtents extents = recordings_->CalcExtents();
  int windows = 0;
  for (size_t r = 0; r < recordings_->size(); ++r)
    for (Push when : FindPushes(*recordings_, rows_, left, r)) {
      when.window = windows++;
      for (TorqueFault& one : ListPushes(recordings_->model(), recordings_->joints(), when, extents)) {
        one.push = FindTimes(*recordings_, rows_, left, one.push);
        faults_.push_back(std::move(one));
      }
    }
  return faults_.size() > before;
}

}  // namespace dexcheck
