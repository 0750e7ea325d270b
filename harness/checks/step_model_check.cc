#include "harness/checks/step_model_check.h"

#include <utility>

namespace dexcheck {

using BoolArray = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>;

StepModelCheck::StepModelCheck(const Adapter& adapter, std::span<const int> fingertips,
                               OrientationFeedback orientation)
    : adapter_(&adapter),
      fingertips_(fingertips.begin(), fingertips.end()),
      has_coordinates_(orientation == OrientationFeedback::kAngles),
      engine_(adapter, fingertips),
      scales_(adapter.model()) {
  const int n = engine_.size();
  J_.setZero(6, n);
  J_dot_.setZero(6, n);
  J_engine_.setZero(6, n);
  force_.setZero(n);
  J_B_dot_xi_.setZero(3 * static_cast<Eigen::Index>(fingertips_.size()));
  DefineRobotTerms();
  DefineGraspTerms();
  step_errors_.assign(terms_.size(), 0.0);
}

void StepModelCheck::DefineRobotTerms() {
  const RobotModel& model = adapter_->model();
  const int n = engine_.size();
  const auto define = [&](const char* name, double factors, std::vector<Location> where) {
    terms_.emplace_back(name, CalcRoundingBound(model.max_depth(), factors), std::move(where));
  };
  std::vector<Location> poses, jacobians, biases, masses, velocities;
  for (int frame = 0; frame < static_cast<int>(model.frames().size()); ++frame) {
    poses.insert(poses.end(), 12, {Location::Kind::kFrame, frame, -1});
  }
  std::vector<double> jacobian_weights;
  for (int finger = 0; finger < static_cast<int>(fingertips_.size()); ++finger) {
    const Location where{Location::Kind::kFrame, fingertips_[static_cast<size_t>(finger)], -1};
    const std::vector<int>& chain = engine_.chain(finger);
    biases.insert(biases.end(), 6, where);
    jacobians.insert(jacobians.end(), 6 * chain.size(), where);
    BoolArray may_differ = BoolArray::Constant(6, n, false);
    for (const int coordinate : chain) {
      const double scale = scales_.CalcVelocityScale(coordinate);
      jacobian_weights.insert(jacobian_weights.end(), 3, 1.0 / scale);
      jacobian_weights.insert(jacobian_weights.end(), 3, 1.0 / Positive(scale / scales_.length()));
      may_differ.col(coordinate) = true;
    }
    J_zeros_.emplace_back(may_differ);
  }
  BoolArray may_differ = BoolArray::Constant(n, n, false);
  const size_t entries = engine_.mass_entries().size();
  mass_offsets_.resize(2 * entries);
  masses.resize(2 * entries);
  Eigen::ArrayXd mass_weights(2 * static_cast<Eigen::Index>(entries));
  for (size_t i = 0; i < entries; ++i) {
    const auto [row, col] = engine_.mass_entries()[i];
    mass_offsets_[i] = row + col * n;
    mass_offsets_[entries + i] = col + row * n;
    masses[i] = {Location::Kind::kVelocityPair, row, col};
    masses[entries + i] = {Location::Kind::kVelocityPair, col, row};
    const double weight = 1.0 / scales_.CalcMassScale(row, col);
    mass_weights[static_cast<Eigen::Index>(i)] = weight;
    mass_weights[static_cast<Eigen::Index>(entries + i)] = weight;
    may_differ(row, col) = may_differ(col, row) = true;
  }
  other_zeros_.emplace_back(may_differ);
  velocity_weights_.setZero(n);
  for (int i = 0; i < n; ++i) velocity_weights_[i] = 1.0 / scales_.CalcVelocityScale(i);
  for (int i = 0; i < n; ++i) velocities.push_back({Location::Kind::kVelocity, i, -1});

  define("frame_pose", 1.0, poses);
  define("J", 1.0, jacobians);
  define("J_dot_xi", 3.0, biases);
  define("M_bar", 2.0, masses);
  define("C_bar_xi", 4.0, velocities);
  define("gravity", 1.0, velocities);
  define("friction", 2.0, velocities);
  define("kinetic_energy", 2.0, {Location{}});
  define("potential_energy", 1.0, {Location{}});
  define("linear_momentum", 1.0, std::vector<Location>(3));
  define("angular_momentum", 2.0, std::vector<Location>(3));
  term(kJ).weight = Eigen::Map<const Eigen::ArrayXd>(jacobian_weights.data(), term(kJ).size());
  term(kMassMatrix).weight = mass_weights;
  for (int i = 0; i < n; ++i) term(kGravity).weight[i] = 1.0 / scales_.CalcGravityScale(i);
}

void StepModelCheck::Compare(const ModelTerms& robot, const GraspTerms& grasp, const MeasuredState& state,
                             const Pose& X_W0, double when) {
  engine_.SetState(state.q, state.xi, state.X_Bo, state.V_Bo);
  scales_.SetState(robot, state.q, state.xi);
  CompareFrames(robot);
  CompareForces(robot, state);
  CompareEnergies(robot);
  CompareObject(grasp, state);
  CompareMass(robot, when);
  CompareJacobians(robot, when);
  if (with_contacts_) CompareContacts(grasp, state, X_W0, when);
  for (size_t i = 0; i < terms_.size(); ++i) {
    step_errors_[i] = 0.0;
    if (IsOfContacts(i) && !with_contacts_) continue;
    terms_[i].Finish(when);
    step_errors_[i] = terms_[i].step_error();
  }
}

std::vector<CheckRecord> StepModelCheck::records() const {
  std::vector<CheckRecord> records;
  for (const StepTerm& term : terms_) records.push_back(term.record());
  return records;
}

void StepModelCheck::CompareFrames(const ModelTerms& robot) {
  StepTerm& poses = term(kFramePose);
  const double place = 1.0 / scales_.world_length();
  const int frames = static_cast<int>(adapter_->model().frames().size());
  for (int frame = 0; frame < frames; ++frame) {
    const Pose X = robot.CalcFramePose(frame);
    const Pose X_engine = engine_.FramePose(frame);
    const Eigen::Index k = 12 * frame;
    Eigen::Map<Eigen::Matrix<double, 3, 4>>(poses.model.data() + k) = X.matrix().topRows<3>();
    Eigen::Map<Eigen::Matrix<double, 3, 4>>(poses.engine.data() + k) = X_engine.matrix().topRows<3>();
    poses.weight.segment<3>(k + 9).setConstant(place);
  }

  StepTerm& bias = term(kJDotXi);
  const double linear = 1.0 / Positive(scales_.acceleration());
  const double angular = 1.0 / Positive(scales_.angular_rate() * scales_.angular_rate());
  for (size_t finger = 0; finger < fingertips_.size(); ++finger) {
    const auto k = 6 * static_cast<Eigen::Index>(finger);
    Vector6d velocity, acceleration;
    robot.CalcFrameMotion(fingertips_[finger], &velocity, &acceleration);
    const EngineMotion motion = engine_.TipMotion(static_cast<int>(finger));
    bias.model.segment<6>(k) = acceleration;
    bias.engine.segment<3>(k) = motion.a;
    bias.engine.segment<3>(k + 3) = motion.alpha;
    bias.weight.segment<3>(k).setConstant(linear);
    bias.weight.segment<3>(k + 3).setConstant(angular);
  }
}

void StepModelCheck::CompareJacobians(const ModelTerms& robot, double when) {
  StepTerm& jacobian = term(kJ);
  Eigen::Index k = 0;
  for (size_t i = 0; i < fingertips_.size(); ++i) {
    const auto finger = static_cast<int>(i);
    const std::vector<int>& chain = engine_.chain(finger);
    const auto columns = static_cast<Eigen::Index>(chain.size());
    robot.CalcFrameJacobian(fingertips_[i], J_, J_dot_);
    // The body Jacobian has the frame's own axes.
    const Pose X = engine_.FramePose(fingertips_[i]);
    const Matrix3d R_T = X.linear().transpose();
    engine_.CalcTipJacobian(finger, X.translation(), J_engine_.leftCols(columns));
    for (Eigen::Index col = 0; col < columns; ++col, k += 6) {
      jacobian.model.segment<6>(k) = J_.col(chain[static_cast<size_t>(col)]);
      jacobian.engine.segment<3>(k) = R_T * J_engine_.col(col).head<3>();
      jacobian.engine.segment<3>(k + 3) = R_T * J_engine_.col(col).tail<3>();
    }
    const auto scale = [&](Eigen::Index row, Eigen::Index col) {
      const double velocity = scales_.CalcVelocityScale(static_cast<int>(col));
      return row < 3 ? velocity : Positive(velocity / scales_.length());
    };
    const auto where = [&](Eigen::Index, Eigen::Index) {
      return Location{Location::Kind::kFrame, fingertips_[i], -1};
    };
    jacobian.CheckZeros(J_zeros_[i], J_, scale, where, when);
  }
}

void StepModelCheck::CompareMass(const ModelTerms& robot, double when) {
  StepTerm& mass = term(kMassMatrix);
  const Eigen::Index half = engine_.mass().size();
  const double* const M = robot.M().data();
  for (size_t i = 0; i < mass_offsets_.size(); ++i)
    mass.model[static_cast<Eigen::Index>(i)] = M[mass_offsets_[i]];
  mass.engine.head(half) = engine_.mass();
  mass.engine.tail(half) = engine_.mass();
  const auto scale = [&](Eigen::Index row, Eigen::Index col) {
    return scales_.CalcMassScale(static_cast<int>(row), static_cast<int>(col));
  };
  const auto where = [](Eigen::Index row, Eigen::Index col) {
    return Location{Location::Kind::kVelocityPair, static_cast<int>(row), static_cast<int>(col)};
  };
  mass.CheckZeros(other_zeros_[0], robot.M(), scale, where, when);
}

void StepModelCheck::CompareForces(const ModelTerms& robot, const MeasuredState& state) {
  force_.noalias() = robot.C() * state.xi;
  term(kCoriolisForce).model = force_;
  term(kCoriolisForce).engine = engine_.coriolis();
  term(kGravity).model = robot.gravity();
  term(kGravity).engine = engine_.gravity();
  term(kFriction).model = robot.friction();
  term(kFriction).engine = engine_.friction();
  for (int i = 0; i < engine_.size(); ++i) {
    term(kCoriolisForce).weight[i] = 1.0 / scales_.CalcCoriolisScale(i);
    term(kFriction).weight[i] = 1.0 / scales_.CalcFrictionScale(i, state.xi);
  }
}

void StepModelCheck::CompareEnergies(const ModelTerms& robot) {
  const EnergyAndMomentum model = robot.CalcEnergyAndMomentum();
  const EnergyAndMomentum& engine = engine_.energy_and_momentum();
  const auto set = [&](Term which, const auto& model_value, const auto& engine_value, double scale) {
    term(which).model = model_value;
    term(which).engine = engine_value;
    term(which).weight.setConstant(1.0 / scale);
  };
  using One = Eigen::Array<double, 1, 1>;
  const double momentum = Positive(scales_.CalcMomentumScale());
  set(kKineticEnergy, One(model.kinetic), One(engine.kinetic), scales_.CalcKineticEnergyScale());
  set(kPotentialEnergy, One(model.potential), One(engine.potential), scales_.CalcPotentialEnergyScale());
  set(kLinearMomentum, model.linear_momentum.array(), engine.linear_momentum.array(), momentum);
  set(kAngularMomentum, model.angular_momentum.array(), engine.angular_momentum.array(),
      Positive(scales_.CalcMomentumScale() * scales_.length()));
}

}  // namespace dexcheck
