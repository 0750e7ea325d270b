#include "controller/grasp/touch_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dexcheck::grasp_internal {

TouchChooser::TouchChooser(const HandReach& hand, double mu, double length, TouchScore score)
    : hand_(hand), mu_(mu), length_(length), score_(score) {
  constexpr int kDirections = 244;
  for (Eigen::Index k = 0; k < 6; ++k) {
    directions_.emplace_back(Vector6d::Unit(k));
    directions_.emplace_back(-Vector6d::Unit(k));
  }
  const JointRange cube{-VectorXd::Ones(6), VectorXd::Ones(6)};
  for (int k = 1; k <= kDirections; ++k) directions_.emplace_back(cube.CalcSpreadPoint(k).normalized());
}

VectorXd TouchChooser::CalcSupports(const Touch& touch) const {
  Eigen::Matrix<double, 6, 3> G = touch.G;
  G.bottomRows<3>() /= length_;
  VectorXd supports(static_cast<Eigen::Index>(directions_.size()));
  for (size_t k = 0; k < directions_.size(); ++k) {
    const Vector3d g = G.transpose() * directions_[k];
    supports[static_cast<Eigen::Index>(k)] = g.z() + mu_ * g.head<2>().norm();
  }
  return supports;
}

void TouchChooser::SetSupports(std::vector<Touch>* touches) const {
  for (Touch& touch : *touches) touch.supports = CalcSupports(touch);
}

std::optional<TouchChoice> TouchChooser::Choose(const std::vector<std::vector<Touch>>& touches,
                                                const HandClearance& clearance, double arm_margin,
                                                int num_starts) const {
  constexpr double kGolden = 0.6180339887498949;
  constexpr int kSweeps = 6;
  for (const std::vector<Touch>& list : touches) {
    if (list.empty()) return {};
  }
  const size_t n = touches.size();
  std::optional<TouchChoice> best;
  VectorXd others;
  for (int start = 0; start < num_starts; ++start) {
    TouchChoice choice;
    for (size_t i = 0; i < n; ++i) {
      const double x = kGolden * start * static_cast<double>(i + 1);
      choice.indices.push_back(
          static_cast<size_t>((x - std::floor(x)) * static_cast<double>(touches[i].size())));
    }
    const auto chosen = [&](size_t i) -> const Touch& { return touches[i][choice.indices[i]]; };
    const auto fits = [&](size_t i, const Touch& touch) {
      for (size_t j = 0; j < n; ++j) {
        if (j != i && !hand_.AreApart(i, touch, j, chosen(j), clearance)) return false;
      }
      return true;
    };
    bool apart = false;
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      bool changed = false;
      apart = true;
      for (size_t i = 0; i < n; ++i) {
        others.setConstant(static_cast<Eigen::Index>(directions_.size()),
                           -std::numeric_limits<double>::infinity());
        for (size_t j = 0; j < n; ++j) {
          if (j != i) others = others.cwiseMax(chosen(j).supports);
        }
        double margin = arm_margin;
        for (size_t j = 0; j < n; ++j) {
          if (j != i) margin = std::min(margin, chosen(j).joint_margin);
        }
        size_t index = choice.indices[i];
        choice.score = -std::numeric_limits<double>::infinity();
        apart = fits(i, touches[i][index]);
        if (apart) {
          choice.bound = others.cwiseMax(chosen(i).supports).minCoeff();
          choice.score = score_.Calc(choice.bound, std::min(margin, chosen(i).joint_margin));
        }
        for (size_t k = 0; k < touches[i].size(); ++k) {
          const Touch& touch = touches[i][k];
          const double bound = others.cwiseMax(touch.supports).minCoeff();
          const double score = score_.Calc(bound, std::min(margin, touch.joint_margin));
          if (score <= choice.score || !fits(i, touch)) continue;
          choice.bound = bound;
          choice.score = score;
          index = k;
          apart = true;
        }
        changed = changed || index != choice.indices[i];
        choice.indices[i] = index;
      }
      if (!changed) break;
    }
    // The last finger fits to all others; the others must to each other.
    for (size_t i = 0; i + 1 < n && apart; ++i) apart = fits(i, chosen(i));
    if (apart && (!best || choice.bound > best->bound)) best = choice;
  }
  return best;
}

ForceClosureResult TouchChooser::Measure(const std::vector<const Touch*>& touches) {
  const auto n = static_cast<Eigen::Index>(touches.size());
  Matrix6Xd G(6, 3 * n);
  for (Eigen::Index i = 0; i < n; ++i) G.middleCols<3>(3 * i) = touches[static_cast<size_t>(i)]->G;
  ForceClosureOptions options;
  options.length = length_;
  ForceClosureResult result = CalcForceClosure(G, VectorXd::Constant(n, mu_), options);
  Vector6d direction = result.direction;
  direction.tail<3>() /= length_;
  directions_.push_back(direction.normalized());
  return result;
}

}  // namespace dexcheck::grasp_internal
