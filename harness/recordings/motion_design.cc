#include "harness/recordings/motion_design.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlopt.hpp>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"
#include "controller/control/trajectory.h"
#include "harness/plant/random_stream.h"
#include "harness/recordings/torque_rows.h"

namespace dexcheck {
namespace {

using Eigen::Index;

constexpr int kSeries = 2 * SeriesMotion::kHarmonics;
constexpr double kMargin = 0.99;  // of limits, between the instants at which they are held

/// Faults whose sizes a motion is to determine: one candidate for each number.
std::vector<TorqueFault> ListDesignedFaults(const RobotModel& model, const std::vector<int>& joints) {
  std::vector<TorqueFault> faults = ListTorqueFaults(model, joints, 1);
  std::erase_if(faults, [](const TorqueFault& fault) {
    using enum TorqueFault::Kind;
    const bool is_variant =
        fault.parameters > 0 || fault.IsEntry() || (fault.kind == kPayload && fault.sums.size() > 4);
    const bool is_of_all = fault.index < 0 && fault.kind != kGravity;
    const bool is_left_out = fault.kind == kDelay || fault.kind == kLoadFriction || fault.kind == kDrift ||
                             fault.kind == kSquareFriction || fault.kind == kElasticity;
    return is_variant || is_of_all || is_left_out;
  });
  return faults;
}

class MotionDesigner {
 public:
  MotionDesigner(const RobotModel& model, const MotionLimits& limits, const MotionDesignOptions& options)
      : model_(model),
        limits_(limits),
        options_(options),
        joints_(ListIndices(model.num_joints())),
        faults_(ListDesignedFaults(model, joints_)),
        regressor_(model),
        best_{SeriesMotion(0.5 * (limits.lower + limits.upper), options.duration), {}, {}} {
    constexpr double kStep = 0.05;  // s
    const auto count = static_cast<Index>(std::ceil(options.duration / kStep));
    for (Index g = 0; g <= count; ++g) {
      times_.push_back(options.duration * static_cast<double>(g) / static_cast<double>(count));
      bases_.push_back(best_.motion.CalcBasis(times_.back()));
    }
  }

  MotionDesign Run() {
    const std::vector<double> first = DrawFirst();
    nlopt::opt method(nlopt::LN_SBPLX, static_cast<unsigned>(first.size()));
    method.set_lower_bounds(-1.0);
    method.set_upper_bounds(1.0);
    constexpr double kFirstStep = 0.2;
    method.set_initial_step(kFirstStep);
    method.set_max_objective([](const std::vector<double>& x, std::vector<double>& /*gradient*/,
                                void* self) { return static_cast<MotionDesigner*>(self)->Evaluate(x); },
                             this);
    std::vector<double> x = first;
    double value = 0.0;
    try {
      method.optimize(x, value);
    } catch (const nlopt::forced_stop&) {       // all are tried, or the user interrupted
    } catch (const nlopt::roundoff_limited&) {  // as near as it gets
    }
    Finish();
    return best_;
  }

 private:
  static constexpr double kImpossible = 1e6;

  [[nodiscard]] bool GoesOn() const {
    return best_.evaluations < options_.evaluations && (!options_.go_on || options_.go_on(best_.evaluations));
  }

  /// The best of some motions that are drawn, by which noise and plausible sizes are set.
  std::vector<double> DrawFirst() {
    std::mt19937_64 random(options_.seed);
    const auto draw = [&] {
      std::vector<double> x(static_cast<size_t>(model_.num_joints()) * (kSeries + 1));
      std::generate(x.begin(), x.end(), [&] { return 2.0 * DrawUnit(&random) - 1.0; });
      return x;
    };
    std::vector<double> best = draw();
    SetScales(MakeMotion(best));
    constexpr int kDraws = 40;
    double most = -2.0 * kImpossible;
    for (int i = 0; i < kDraws && GoesOn(); ++i) {
      const std::vector<double> x = draw();
      const double value = Evaluate(x);
      if (value <= most) continue;
      most = value;
      best = x;
    }
    return best;
  }

  /// @param x by joint: its place in the range, then its coefficients, all from -1 to 1. What they make of
  /// them is as large as the limits allow.
  [[nodiscard]] SeriesMotion MakeMotion(const std::vector<double>& x) const {
    SeriesMotion motion = best_.motion;
    for (int i = 0; i < model_.num_joints(); ++i) {
      const double* const own = x.data() + static_cast<size_t>(i) * (kSeries + 1);
      const double half = 0.5 * (limits_.upper[i] - limits_.lower[i]);
      constexpr double kFarthest = 0.8;  // of the range
      const double off = kFarthest * half * own[0];
      motion.centre()[i] = 0.5 * (limits_.lower[i] + limits_.upper[i]) + off;
      const Eigen::Map<const VectorXd> coefficients(own + 1, kSeries);
      motion.coefficients().row(i) =
          half * FindFactor(i, motion.centre()[i], half * coefficients) * coefficients.transpose();
    }
    FollowLeaders(&motion);
    return motion;
  }

  /// By which a joint's coefficients are to be reduced.
  [[nodiscard]] double FindFactor(int joint, double centre, const VectorXd& coefficients) const {
    double factor = 1.0;
    const auto hold = [&](double value, double limit) {
      if (value * factor > kMargin * limit) factor = kMargin * limit / value;
    };
    for (const auto& basis : bases_) {
      const Vector3d at = basis * coefficients;
      hold(at[0], limits_.upper[joint] - centre);
      hold(-at[0], centre - limits_.lower[joint]);
      hold(std::abs(at[1]), limits_.velocity[joint]);
      hold(std::abs(at[2]), limits_.acceleration[joint]);
    }
    return factor;
  }

  void FollowLeaders(SeriesMotion* motion) const {
    for (int i = 0; i < model_.num_joints(); ++i) {
      const std::optional<JointCoupling>& coupling = model_.joint(i).coupling;
      if (!coupling) continue;
      motion->centre()[i] = coupling->multiplier * motion->centre()[coupling->leader] + coupling->offset;
      motion->coefficients().row(i) =
          coupling->multiplier * motion->coefficients().row(coupling->leader).eval();
    }
  }

  /// @return the largest torques. @param balance may be null.
  VectorXd Follow(const SeriesMotion& motion, TorqueBalance* balance, VectorXd* squares) {
    constexpr size_t kEvery = 4;
    RecordedSample sample;
    sample.jerk = sample.snap = VectorXd::Zero(model_.num_joints());
    sample.torque_rate = VectorXd::Zero(model_.num_joints());
    sample.most_torque = VectorXd::Constant(model_.num_joints(), std::numeric_limits<double>::infinity());
    sample.friction.resize(model_.num_joints(), kFrictionShapes);
    const MatrixXd shape_velocities = ListShapeVelocities(0.5 * limits_.velocity);
    VectorXd largest = VectorXd::Zero(model_.num_joints());
    const std::vector<bool> all(joints_.size(), true);
    const size_t count = (times_.size() + kEvery - 1) / kEvery;
    for (size_t g = 0; g < times_.size(); g += kEvery) {
      sample.time = sample.passed = times_[g];
      motion.Calc(times_[g], &sample.q, &sample.qd, &sample.qdd);
      sample.direction = sample.qd.cwiseSign();
      for (int i = 0; i < model_.num_joints(); ++i)
        sample.friction.row(i) = CalcFrictionShapes(sample.qd[i], shape_velocities.row(i));
      sample.torque = CalcMotionTorques(sample.q, sample.qd, sample.qdd, &regressor_);
      largest = largest.cwiseMax(sample.torque.cwiseAbs());
      if (squares != nullptr) *squares += sample.torque.cwiseAbs2() / static_cast<double>(count);
      if (balance != nullptr) balance->Add(sample, all);
    }
    return largest;
  }

  /// Noise of each joint, and how large faults may be, by the torques of a first motion.
  void SetScales(const SeriesMotion& first) {
    VectorXd squares = VectorXd::Zero(model_.num_joints());
    Follow(first, nullptr, &squares);
    constexpr double kLeast = 1e-3, kNoise = 0.01;
    const VectorXd usual = squares.cwiseSqrt().cwiseMax(kLeast * squares.cwiseSqrt().maxCoeff());
    noise_ = kNoise * usual;
    if (options_.recorded != nullptr)
      for (size_t k = 0; k < options_.recorded->joints().size(); ++k)
        noise_[options_.recorded->joints()[k]] = (*options_.recorded)[0].noise[static_cast<Index>(k)];
    std::vector<double> scales;
    for (const TorqueFault& fault : faults_) {
      const VectorXd size = ChooseScale(fault, usual);
      scales.insert(scales.end(), size.begin(), size.end());
    }
    scales_ = Eigen::Map<const VectorXd>(scales.data(), static_cast<Index>(scales.size()));
    known_ = MatrixXd::Identity(scales_.size(), scales_.size());
    if (options_.recorded == nullptr) return;
    known_ += Scale(MakeTorqueRows(*options_.recorded, faults_, false).CalcProducts(),
                    CountForced(*options_.recorded));
  }

  [[nodiscard]] VectorXd ChooseScale(const TorqueFault& fault, const VectorXd& usual) const {
    if (fault.scale.size() > 0) return fault.scale;
    constexpr double kFraction = 0.1, kAngle = 0.02;
    const auto of_joint = [&](double per) { return kFraction * usual[fault.index] / per; };
    using enum TorqueFault::Kind;
    double size = kFraction;  // of a gain
    if (fault.kind == kDryFriction || fault.kind == kOffset) size = of_joint(1.0);
    if (fault.kind == kViscousFriction) size = of_joint(limits_.velocity[fault.index]);
    if (fault.kind == kArmature) size = of_joint(limits_.acceleration[fault.index]);
    if (fault.kind == kZero) size = kAngle;
    if (fault.kind == kMass) size = kFraction * fault.nominal;
    return VectorXd::Constant(static_cast<Index>(fault.sums.size()), size);
  }

  /// S I S of a part of an information matrix. @param first column of the faults.
  [[nodiscard]] MatrixXd Scale(const MatrixXd& information, Index first) const {
    const Index n = scales_.size();
    return scales_.asDiagonal() * information.block(first, first, n, n) * scales_.asDiagonal();
  }

  /// S W^T W S of a motion.
  [[nodiscard]] MatrixXd CalcInformation(const TorqueBalance& balance) const {
    MatrixXd information = MatrixXd::Zero(scales_.size(), scales_.size());
    for (size_t place = 0; place < joints_.size(); ++place) {
      const Eigen::SparseMatrix<double> map = MapColumns(balance, place, 0, faults_);
      const double rows = options_.rate * options_.duration / balance.samples(place);
      const double weight = rows / (noise_[static_cast<Index>(place)] * noise_[static_cast<Index>(place)]);
      const MatrixXd part = balance.products(place) * map;
      information += weight * (map.transpose() * part);
    }
    return Scale(information, 0);
  }

  /// Returns by how much limits are exceeded.
  [[nodiscard]] double CalcExcess(const SeriesMotion& motion, const VectorXd& largest) const {
    double excess = (largest.cwiseQuotient(limits_.torque).array() - 1.0).max(0.0).sum();
    if (!options_.calc_overlap) return excess;
    VectorXd q, qd, qdd;
    for (const double time : times_) {
      motion.Calc(time, &q, &qd, &qdd);
      excess += options_.calc_overlap(q);
    }
    return excess;
  }

  double Evaluate(const std::vector<double>& x) {
    if (!GoesOn()) throw nlopt::forced_stop();
    ++best_.evaluations;
    const SeriesMotion motion = MakeMotion(x);
    TorqueBalance balance(model_, joints_, false);
    const VectorXd largest = Follow(motion, &balance, nullptr);
    const double excess = CalcExcess(motion, largest);
    if (excess > 0.0) return -kImpossible * (1.0 + excess);
    balance.Finish();
    const MatrixXd information = CalcInformation(balance);
    const Eigen::LLT<MatrixXd> factor(known_ + information);
    const double value = factor.matrixLLT().diagonal().array().log().sum();
    if (value > value_) {
      value_ = value;
      best_.motion = motion;
      best_.torque = largest;
      information_ = information;
    }
    return value;
  }

  void Finish() {
    if (information_.size() == 0)
      throw InputError(
          model_.spec().source +
          ": no motion within the limits was found; wider limits, or another seed, may have one");
    const MatrixXd after = known_ + information_;
    best_.combinations = static_cast<int>(scales_.size());
    best_.known_before = CountKnown(known_);
    best_.known_after = CountKnown(after);
    const VectorXd before_errors = CalcErrors(known_), after_errors = CalcErrors(after);
    std::vector<double> counts;
    Index at = 0;
    for (const TorqueFault& fault : faults_) {
      auto found = std::find_if(best_.errors.begin(), best_.errors.end(),
                                [&](const ExpectedError& one) { return one.fault == fault.fault; });
      if (found == best_.errors.end()) {
        found = best_.errors.insert(found, {fault.fault, 0.0, 0.0});
        counts.push_back(0.0);
      }
      const Index columns = CountColumns(fault);
      found->before += before_errors.segment(at, columns).sum();
      found->after += after_errors.segment(at, columns).sum();
      counts[static_cast<size_t>(found - best_.errors.begin())] += static_cast<double>(columns);
      at += columns;
    }
    for (size_t k = 0; k < counts.size(); ++k) {
      best_.errors[k].before /= counts[k];
      best_.errors[k].after /= counts[k];
    }
  }

  static int CountKnown(const MatrixXd& information) {
    constexpr double kThird = 9.0;
    return static_cast<int>((CalcSymmetricEigenvalues(information).array() > kThird).count());
  }
  static VectorXd CalcErrors(const MatrixXd& information) {
    return information.llt()
        .solve(MatrixXd::Identity(information.rows(), information.cols()))
        .diagonal()
        .cwiseSqrt();
  }

  const RobotModel& model_;
  const MotionLimits& limits_;
  const MotionDesignOptions& options_;
  std::vector<int> joints_;
  std::vector<TorqueFault> faults_;
  TorqueRegressor regressor_;
  MotionDesign best_;
  double value_ = -kImpossible;
  MatrixXd information_;  // of the best
  std::vector<double> times_;
  std::vector<Eigen::Matrix<double, 3, kSeries>> bases_;  // at these
  VectorXd noise_;                                        // of a row, by joint
  VectorXd scales_;                                       // plausible sizes, by column
  MatrixXd known_;                                        // S W^T W S of what was recorded, and 1
};

}  // namespace

SeriesMotion::SeriesMotion(const VectorXd& centre, double duration)
    : centre_(centre), duration_(duration), coefficients_(MatrixXd::Zero(centre.size(), kSeries)) {}

Eigen::Matrix<double, 3, 2 * SeriesMotion::kHarmonics> SeriesMotion::CalcBasis(double time) const {
  constexpr double kRamp = 0.15;    // of the duration
  constexpr double kPeriod = 10.0;  // of the first harmonic, s
  const double ramp = kRamp * duration_;
  ScalarMotion rise = CalcMinJerk(std::min(time, duration_ - time), ramp);
  if (time >= 0.5 * duration_) rise.s_dot *= -1.0;
  Eigen::Matrix<double, 3, kSeries> basis;
  for (int k = 0; k < kHarmonics; ++k) {
    const double w = 2.0 * kPi * (k + 1) / kPeriod;
    const double s = std::sin(w * time), c = std::cos(w * time);
    const Vector3d sine(s, w * c, -w * w * s), cosine(c, -w * s, -w * w * c);
    for (const auto& [column, f] : {std::pair(k, sine), std::pair(kHarmonics + k, cosine)})
      basis.col(column) << rise.s * f[0], rise.s_dot * f[0] + rise.s * f[1],
          rise.s_ddot * f[0] + 2.0 * rise.s_dot * f[1] + rise.s * f[2];
  }
  return basis;
}

void SeriesMotion::Calc(double time, VectorXd* q, VectorXd* qd, VectorXd* qdd) const {
  const MatrixXd moved = coefficients_ * CalcBasis(time).transpose();
  *q = centre_ + moved.col(0);
  *qd = moved.col(1);
  *qdd = moved.col(2);
}

VectorXd CalcMotionTorques(const VectorXd& q, const VectorXd& qd, const VectorXd& qdd,
                           TorqueRegressor* regressor) {
  VectorXd torques(regressor->size());
  regressor->SetMotion(q, qd, qdd);
  regressor->CalcTorques(torques);
  for (int i = 0; i < regressor->size(); ++i) {
    const Joint& joint = regressor->model().joint(i);
    const double direction = qd[i] == 0.0 ? 0.0 : std::copysign(1.0, qd[i]);
    torques[i] += joint.damping * qd[i] + joint.dry_friction * direction;
  }
  return torques;
}

MotionDesign DesignMotion(const RobotModel& model, const MotionLimits& limits,
                          const MotionDesignOptions& options) {
  if (model.base().type != BaseType::kFixed)
    throw InputError(model.spec().source + ": base: must be fixed where a motion of the joints is designed");
  return MotionDesigner(model, limits, options).Run();
}

}  // namespace dexcheck
