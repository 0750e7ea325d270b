#include "harness/corrections/link_frames.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "harness/corrections/edits.h"

namespace dexcheck {
namespace {

// Bits of what is wrong under a choice of a frame, as corrections of it would cost.
constexpr double kWrongLine = 15.0;
constexpr double kTurnedLine = 6.0;
constexpr double kWrongBody = 15.0;
constexpr double kConventionBits = 13.0;
constexpr double kOtherJoint = 16.0;
constexpr double kNumberOfOrigin = 24.0;
constexpr double kMissingPosition = 20.0;
constexpr double kWrongOrigin = 40.0;
constexpr double kWrongRotation = 25.0;
constexpr double kWrongLength = 14.0;
constexpr double kRegistered = 7.0;
constexpr size_t kWidth = 8;           ///< States of the walk that are kept,
constexpr size_t kChoices = 3;         ///< and that are returned.
constexpr double kManyFrames = 0.5;    ///< Another frame, where most links have one.
constexpr double kSearchAbove = 30.0;  ///< Registration by what the link carries is tried.
constexpr double kRounding = 2e-6;     ///< m, or rad, added to the digits' tolerance.
constexpr double kSameFrame = 1e-4;    ///< m, or rad, between frames that are not tried both.

/// The axis of a joint on a link, in both files' frames of the link.
struct CarriedAxis {
  bool turns;
  Vector3d point_a, way_a, point_b, way_b;
  double open_angle, open_length;
};

struct FrameState {
  double cost = 0.0;
  std::vector<Pose> X_ab;
};

struct FrameChoice {
  double cost;
  Pose X;
};

Vector3d RemoveAlong(const Vector3d& v, const Vector3d& way) { return v - way * way.dot(v); }

class FrameChooser {
 public:
  explicit FrameChooser(const PrintedPair& pair) : pair_(pair) {
    axes_.resize(pair.a().links.size());
    for (const int link : pair.links()) {
      if (pair.Carrier(link) < 0) continue;
      AddAxis(link, link, Pose::Identity(), Pose::Identity(), {}, {});
      const int j = pair.Partner(link);
      AddAxis(pair.node(link).parent, link, pair.given(link).X, pair.other(j).X, pair.given(link).pose,
              pair.other(j).pose);
    }
  }

  std::vector<ChosenFrames> Run() {
    constexpr double kAtFirst = 3.0;
    constexpr double kFew = 30.0;
    constexpr double kFraction = 0.3;
    other_frame_ = kAtFirst;
    std::vector<FrameState> states = Walk();
    const auto others = CountOthers(states[0].X_ab);
    const auto moving =
        std::ranges::count_if(pair_.links(), [&](int link) { return Moves(pair_.a().link(link)); });
    other_frame_ = others >= std::max(3.0, kFraction * static_cast<double>(moving)) ? kManyFrames : kFew;
    states = Walk();
    std::vector<ChosenFrames> frames;
    for (FrameState& state : states) {
      if (frames.size() == kChoices) break;
      frames.push_back(Finish(std::move(state)));
    }
    return frames;
  }

  std::vector<ChosenFrames> Change(const ChosenFrames& chosen, int link) {
    other_frame_ = chosen.each;
    changed_ = link;
    std::vector<ChosenFrames> frames;
    for (FrameState& state : Walk(&chosen)) {
      const Pose& X = state.X_ab[static_cast<size_t>(link)];
      const auto is_same = [&](const ChosenFrames& other) {
        const Pose& Y = other.X_ab[static_cast<size_t>(link)];
        return (X.matrix() - Y.matrix()).cwiseAbs().maxCoeff() < kSameFrame;
      };
      if (!is_same(chosen) && std::ranges::none_of(frames, is_same))
        frames.push_back(Finish(std::move(state)));
    }
    return frames;
  }

 private:
  [[nodiscard]] ChosenFrames Finish(FrameState state) const {
    const double bits = other_frame_ * CountOthers(state.X_ab);
    return {std::move(state.X_ab), bits, other_frame_};
  }

  static double CountOthers(const std::vector<Pose>& X_ab) {
    return static_cast<double>(
        std::ranges::count_if(X_ab, [](const Pose& X) { return !X.isApprox(Pose::Identity(), 1e-9); }));
  }

  void AddAxis(int carrier, int moved, const Pose& X, const Pose& Y, const PoseTolerance& x,
               const PoseTolerance& y) {
    const PrintedJoint& ours = pair_.a().link(moved).joint;
    const PrintedJoint& theirs = pair_.b().link(pair_.Partner(moved)).joint;
    if (ours.kind != theirs.kind || (ours.kind != JointKind::kHinge && ours.kind != JointKind::kSlide))
      return;
    axes_[static_cast<size_t>(carrier)].push_back({ours.kind == JointKind::kHinge, X * ours.anchor,
                                                   X.linear() * ours.axis.normalized(), Y * theirs.anchor,
                                                   Y.linear() * theirs.axis.normalized(), x.angle + y.angle,
                                                   (x.length + y.length).norm()});
  }

  /// @param kept frames that links have which the changed one does not carry.
  std::vector<FrameState> Walk(const ChosenFrames* kept = nullptr) {
    std::vector<FrameState> states(1);
    states[0].X_ab.assign(pair_.a().links.size(), Pose::Identity());
    if (kept != nullptr) states[0].X_ab = kept->X_ab;
    std::vector<bool> is_chosen(states[0].X_ab.size(), kept == nullptr);
    std::vector<FrameState> next;
    for (const int link : pair_.links()) {
      if (pair_.Carrier(link) < 0) continue;
      const bool is_carried = is_chosen[static_cast<size_t>(pair_.node(link).parent)];
      is_chosen[static_cast<size_t>(link)] = is_carried || link == changed_;
      if (!is_chosen[static_cast<size_t>(link)]) continue;
      next.clear();
      for (FrameState& state : states) {
        const std::vector<FrameChoice> choices =
            ListChoices(link, state.X_ab[static_cast<size_t>(pair_.node(link).parent)]);
        for (const FrameChoice& choice : choices) {
          FrameState& grown = next.emplace_back(state);
          grown.cost += choice.cost;
          grown.X_ab[static_cast<size_t>(link)] = choice.X;
        }
      }
      std::ranges::stable_sort(next, {}, &FrameState::cost);
      if (next.size() > kWidth) next.resize(kWidth);
      states.swap(next);
    }
    return states;
  }

  /// Bits of what the link carries that is wrong when the second file's frame stands at X in the first one's.
  [[nodiscard]] double Weigh(int link, const Pose& X) const {
    double bits = 0.0;
    const Matrix3d& R = X.linear();
    for (const CarriedAxis& axis : axes_[static_cast<size_t>(link)]) {
      const Vector3d way = R * axis.way_b;
      const bool parallel = axis.way_a.cross(way).norm() <= kRounding + axis.open_angle;
      if (!parallel) bits += kWrongLine;
      if (parallel && axis.way_a.dot(way) < 0.0) bits += kTurnedLine;
      if (axis.turns &&
          axis.way_a.cross(X * axis.point_b - axis.point_a).norm() > kRounding + axis.open_length)
        bits += kWrongLine;
    }
    const GivenNode& a = pair_.given(link);
    const GivenNode& b = pair_.other(pair_.Partner(link));
    if (a.body.mass == 0.0 || b.body.mass == 0.0) return bits;
    constexpr double kSameInertia = 1e-5;
    const Matrix3d open =
        a.body_tolerance.inertia + R.cwiseAbs() * b.body_tolerance.inertia * R.cwiseAbs().transpose();
    const Vector3d open_com = a.body_tolerance.com + R.cwiseAbs() * b.body_tolerance.com;
    if (((X * b.body.com - a.body.com).cwiseAbs().array() > kRounding + open_com.array()).any())
      bits += kWrongBody;
    if (((R * b.body.inertia * R.transpose() - a.body.inertia).cwiseAbs().array() >
         kSameInertia * std::abs(a.body.inertia.trace()) + open.array())
            .any())
      bits += kWrongBody;
    return bits;
  }

  [[nodiscard]] static bool IsSame(const Pose& X, const Pose& Y, const PoseTolerance& open) {
    return !IsTurned(X, Y, open.angle) && !IsMoved(X, Y, open.length);
  }

  /// Poses that the first file's link has with a convention undone, or with another joint's origin, with
  /// their bits.
  [[nodiscard]] std::vector<FrameChoice> ListUndone(int link) const {
    std::vector<FrameChoice> poses;
    PrintedLink right;
    const std::vector<ChainOrigin> origins = ListOrigins(pair_.a(), pair_.node(link));
    for (const auto& [k, before, X, after] : origins) {
      const PrintedOrigin& origin = pair_.a().link(k).origin;
      for (const LinkEdit& edit : ListOriginEdits(origin)) {
        right.origin = origin;
        edit.undo(&right);
        poses.push_back({kConventionBits + edit.bits, before * right.origin.CalcPose() * after});
      }
    }
    for (const int other : pair_.links()) {
      if (other != link && pair_.Carrier(other) >= 0)
        poses.push_back({kOtherJoint, origins.back().before * pair_.a().link(other).origin.CalcPose()});
    }
    return poses;
  }

  /// Bits of the origin when both files have one frame.
  [[nodiscard]] double WeighOrigin(int link, const Pose& X_right, const PoseTolerance& open,
                                   const std::vector<FrameChoice>& undone) const {
    const Pose& X = pair_.given(link).X;
    if (std::ranges::any_of(undone,
                            [&](const FrameChoice& choice) { return IsSame(choice.X, X_right, open); }))
      return kConventionBits - 1.0;
    double bits = kWrongOrigin;
    const bool turned = IsTurned(X, X_right, open.angle), moved = IsMoved(X, X_right, open.length);
    if (!turned || !moved) bits = kNumberOfOrigin;
    if (!turned && X.translation().isZero()) bits = kMissingPosition;
    for (const auto& [k, before, own, after] : ListOrigins(pair_.a(), pair_.node(link))) {
      const Pose right = before.inverse() * X_right * after.inverse();
      if (IsMoved(right, own, open.length + Vector3d::Constant(1e-7))) continue;
      bits = std::min(bits, own.linear().isIdentity(1e-12) ? kConventionBits : kNumberOfOrigin + 2.0);
    }
    return bits;
  }

  [[nodiscard]] std::vector<FrameChoice> ListChoices(int link, const Pose& X_ab_P) const {
    constexpr size_t kKept = 4;
    const GivenNode& given = pair_.given(link);
    const GivenNode& other = pair_.other(pair_.Partner(link));
    const Pose X_right = X_ab_P * other.X;
    PoseTolerance open = given.pose;
    open.angle += other.pose.angle + 1e-9;
    open.length += X_ab_P.linear().cwiseAbs() * other.pose.length;
    const PrintedLink& own = pair_.a().link(link);
    const bool same_name = own.name == pair_.b().link(pair_.Partner(link)).name;
    const bool is_frame = own.is_frame || pair_.b().link(pair_.Partner(link)).is_frame;
    const bool is_held =
        own.joint.kind == JointKind::kFixed && same_name && (is_frame || other_frame_ > kManyFrames);
    if (is_held || IsSame(given.X, X_right, open))
      return {{is_held ? 0.0 : Weigh(link, Pose::Identity()), Pose::Identity()}};
    const std::vector<FrameChoice> undone = ListUndone(link);
    std::vector<FrameChoice> choices = {
        {WeighOrigin(link, X_right, open, undone) + Weigh(link, Pose::Identity()), Pose::Identity()}};
    const auto offer = [&](double bits, const Pose& X) { choices.push_back({bits + Weigh(link, X), X}); };
    offer(other_frame_, given.X.inverse() * X_right);
    for (const FrameChoice& pose : undone)
      offer(pose.cost + std::min(other_frame_, 3.0), pose.X.inverse() * X_right);
    std::ranges::stable_sort(choices, {}, &FrameChoice::cost);
    if (choices[0].cost > kSearchAbove || link == changed_) {
      Register(link, X_right, open, &choices);
      std::ranges::stable_sort(choices, {}, &FrameChoice::cost);
    }
    // One of each frame.
    std::vector<FrameChoice> kept;
    const double same = link == changed_ ? kSameFrame : 1e-7;
    for (const FrameChoice& choice : choices) {
      if (kept.size() == (link == changed_ ? 2 : 1) * kKept) break;
      if (std::ranges::none_of(kept, [&](const FrameChoice& k) { return k.X.isApprox(choice.X, same); }))
        kept.push_back(choice);
    }
    return kept;
  }

  /// Frames in which directions and points that the link carries are where the first file has them.
  void Register(int link, const Pose& X_right, const PoseTolerance& open,
                std::vector<FrameChoice>* choices) const {
    const std::vector<CarriedAxis>& axes = axes_[static_cast<size_t>(link)];
    const MassProperties& a = pair_.given(link).body;
    const MassProperties& b = pair_.other(pair_.Partner(link)).body;
    const bool has_bodies = a.mass != 0.0 && b.mass != 0.0;
    for (const Matrix3d& R : ListTurns(axes, has_bodies ? &a : nullptr, has_bodies ? &b : nullptr)) {
      Matrix3d normal = Matrix3d::Zero();
      Vector3d sum = Vector3d::Zero();
      for (const CarriedAxis& axis : axes) {
        if (!axis.turns) continue;
        const Matrix3d across = Matrix3d::Identity() - axis.way_a * axis.way_a.transpose();
        normal += across;
        sum += across * (axis.point_a - R * axis.point_b);
      }
      const auto offer = [&](const Vector3d& t) {
        Pose X = Pose::Identity();
        X.linear() = R;
        X.translation() = t;
        const Pose Z = X_right * X.inverse();
        const Pose& own = pair_.given(link).X;
        double bits = kRegistered + Weigh(link, X);
        if (IsTurned(own, Z, kRounding + open.angle)) bits += kWrongRotation;
        bits += kWrongLength * static_cast<double>(((own.translation() - Z.translation()).cwiseAbs().array() >
                                                    kRounding + open.length.array())
                                                       .count());
        choices->push_back({bits, X});
      };
      if (has_bodies) offer(a.com - R * b.com);
      if (normal.isZero()) continue;
      Eigen::CompleteOrthogonalDecomposition<Matrix3d> solver;
      solver.setThreshold(1e-6);
      offer(solver.compute(normal).solve(sum));
    }
  }

  [[nodiscard]] static std::vector<Matrix3d> ListTurns(const std::vector<CarriedAxis>& axes,
                                                       const MassProperties* a, const MassProperties* b) {
    constexpr double kApart = 1e-5;  // m
    constexpr size_t kMost = 8;
    std::vector<std::pair<Vector3d, Vector3d>> ways;
    for (const CarriedAxis& axis : axes) ways.emplace_back(axis.way_a, axis.way_b);
    const auto add = [&](const Vector3d& u, const Vector3d& v) {
      if (u.norm() > kApart && v.norm() > kApart) ways.emplace_back(u.normalized(), v.normalized());
    };
    if (a != nullptr && !axes.empty())
      add(RemoveAlong(a->com - axes[0].point_a, axes[0].way_a),
          RemoveAlong(b->com - axes[0].point_b, axes[0].way_b));
    for (size_t i = 0; i < axes.size(); ++i) {
      for (size_t k = i + 1; k < axes.size(); ++k)
        add(RemoveAlong(axes[k].point_a - axes[i].point_a, axes[i].way_a),
            RemoveAlong(axes[k].point_b - axes[i].point_b, axes[i].way_b));
    }
    if (ways.size() > kMost) ways.resize(kMost);
    const auto frame = [](const Vector3d& x, const Vector3d& y) {
      Matrix3d R;
      R.col(0) = x;
      R.col(1) = x.cross(y).normalized();
      R.col(2) = x.cross(R.col(1));
      return R;
    };
    std::vector<Matrix3d> turns;
    for (size_t i = 0; i < ways.size(); ++i) {
      for (size_t k = i + 1; k < ways.size(); ++k) {
        for (const double sign : {1.0, -1.0}) {
          if (ways[i].first.cross(ways[k].first).norm() < 1e-4 ||
              ways[i].second.cross(ways[k].second).norm() < 1e-4)
            continue;
          turns.push_back(frame(ways[i].first, ways[k].first) *
                          frame(ways[i].second, sign * ways[k].second).transpose());
        }
      }
    }
    if (a == nullptr) return turns;
    for (const Matrix3d& R : ListAxesTurns(b->inertia, a->inertia)) turns.push_back(R);
    return turns;
  }

  const PrintedPair& pair_;
  std::vector<std::vector<CarriedAxis>> axes_;  // by link
  double other_frame_ = 0.0;
  int changed_ = -1;  // the link whose frame is to be another one
};

}  // namespace

std::vector<ChosenFrames> ChooseFrames(const PrintedPair& pair) { return FrameChooser(pair).Run(); }

std::vector<ChosenFrames> ChangeFrame(const PrintedPair& pair, const ChosenFrames& chosen, int link) {
  return FrameChooser(pair).Change(chosen, link);
}

}  // namespace dexcheck
