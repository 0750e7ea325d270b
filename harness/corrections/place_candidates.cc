#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "harness/corrections/candidate_search.h"

namespace dexcheck {
namespace {

bool TurnsQuarters(const Matrix3d& R) {
  return (R.cwiseAbs().array() - R.cwiseAbs().array().round()).abs().maxCoeff() < 1e-4;
}

/// Bits of an angle: few of quarter turns.
double CountAngle(double angle, double half) {
  constexpr double kQuarter = 5.0;
  const bool is_quarter = std::abs(std::remainder(angle, kPi / 2.0)) <= std::max(half, 1e-4);
  return is_quarter ? kQuarter : CountBits(angle, half);
}

std::string ShowAngles(const Matrix3d& R) {
  return "roll pitch yaw " + ShowVector(SolveRollPitchYaw(R)[0]) + " rad";
}

LinkUndo TakeRotation(const Matrix3d& R) {
  return [R](PrintedLink* link) { link->origin.SetRotation(R); };
}

}  // namespace

struct CandidateSearch::Origin {
  int link;       ///< Whose origin it is,
  int node;       ///< and the link that it places.
  bool is_alone;  ///< Whether no other origin is on the way.
  bool is_last;
  double extra;  ///< Bits of which origin of the way.
  PrintedOrigin given;
  Pose right;          ///< Where it would put the link right by itself.
  bool turned, moved;  ///< What is wrong of it.
  double open_angle;
  Vector3d open_length;

  [[nodiscard]] EditTrial Make(CorrectionKind kind, SiteKind of, double bits, std::string values = "",
                               bool whole = false) const {
    EditTrial trial{{kind, of}, bits + extra, kPoseMask | kBodyMask, std::move(values), whole};
    trial.fault.whole = whole;
    return trial;
  }
};

void CandidateSearch::SearchPlace(int link) {
  const Node& node = pair_.node(link);
  const bool one = node.chain.size() == 1;
  const RightNode& right = pair_.right(link);
  const PoseTolerance& open = pair_.given(link).pose;
  for (const auto& [k, before, X, after] : ListOrigins(pair_.a(), node)) {
    Origin origin;
    origin.link = k;
    origin.node = link;
    origin.is_alone = one;
    origin.is_last = k == link;
    origin.extra = one ? 0.0 : std::log2(static_cast<double>(node.chain.size())) + 1.0;
    origin.given = pair_.a().link(k).origin;
    constexpr double kUnprinted = 4.0;
    if (!origin.is_last && X.isApprox(Pose::Identity(), 1e-12)) origin.extra += kUnprinted;
    origin.right = before.inverse() * right.X * after.inverse();
    origin.open_angle = open.angle + right.pose.angle;
    origin.open_length = open.length + right.pose.length;
    if (!one) origin.open_length = Vector3d::Constant(origin.open_length.norm());
    origin.turned = IsTurned(X, origin.right, origin.open_angle);
    origin.moved = IsMoved(X, origin.right, origin.open_length);
    EditFrames frames{{X}};
    if (origin.turned) frames.X_PL.push_back(origin.right);
    const bool turns = origin.turned && (one || !origin.moved);
    const bool moves = origin.moved && (one || !origin.turned);
    for (const LinkEdit& edit : ListOriginEdits(origin.given, frames)) {
      const bool whole = edit.fault.whole;
      const bool is_shift = edit.fault.kind == CorrectionKind::kInverse && moves;
      const bool is_tried =
          whole ? origin.given.form == RotationForm::kMdh || is_shift || (origin.turned && origin.moved)
                : (edit.fault.of == SiteKind::kRotation ? turns : moves);
      if (is_tried)
        Try({edit.fault, edit.bits + origin.extra, kPoseMask | kBodyMask, "", whole}, k, edit.undo);
    }
    if (origin.given.form == RotationForm::kMdh) {
      SearchRowNumbers(origin);
    } else {
      if (moves) SearchPositionNumbers(origin);
      if (origin.turned && origin.moved) SearchPoseNumbers(origin);
    }
    if (turns) SearchRotationNumbers(origin);
  }
}

std::pair<double, std::string> CandidateSearch::CompareReferences(const Origin& origin) const {
  const int partner = pair_.Partner(origin.node);
  if (!origin.is_last || partner < 0 || !pair_.AreMjcfs()) return {};
  const double ours = pair_.a().link(origin.node).joint.ref, theirs = pair_.b().link(partner).joint.ref;
  return {theirs - ours, DescribeRight(fmt::format("ref {:.6g}", ours), fmt::format("{:.6g}", theirs))};
}

void CandidateSearch::SearchRotationNumbers(const Origin& origin) {
  const Matrix3d given = origin.given.CalcRotation();
  const Matrix3d right = origin.right.linear();
  const double half = std::max(origin.open_angle, 1e-6);
  const Vector3d turn = CalcRotationVector(given.transpose() * right);
  const double angle = turn.norm();
  const auto offer = [&](CorrectionKind kind, double bits, std::string values) {
    Try(origin.Make(kind, SiteKind::kRotation, bits, std::move(values)), origin.link, TakeRotation(right));
  };
  // A row has its own candidates, but for a turn of what stands before it.
  const bool is_row =
      origin.given.form == RotationForm::kMdh && origin.given.X_before.linear().isIdentity(1e-12);
  if (!is_row && CalcAngle(right) <= origin.open_angle)
    offer(CorrectionKind::kSurplus, TurnsQuarters(given) ? 5.0 : 8.0, "");
  if (!is_row && given.isIdentity(1e-12)) {
    const Vector3d none = Vector3d::Zero(), open = Vector3d::Constant(half);
    const double bits = CompareEntries(kAngleNames, none, SolveRollPitchYaw(right)[0], open, "").bits;
    offer(CorrectionKind::kMissing, TurnsQuarters(right) ? 3.5 : 4.0 + 0.35 * bits,
          ShowAngles(right) + " in the other file");
  }
  const PrintedJoint& joint = pair_.a().link(origin.node).joint;
  const Vector3d axis = joint.axis.normalized();
  const auto [ref, refs] = CompareReferences(origin);
  if (ref != 0.0 && joint.kind == JointKind::kHinge && (turn + ref * axis).norm() <= half)
    offer(CorrectionKind::kZero, 0.5, refs);
  if (joint.kind == JointKind::kHinge && origin.is_last) {
    const double across = axis.cross(turn).norm();
    const std::optional<double> left = CountLeft(across / origin.open_angle, angle / origin.open_angle);
    if (left)
      offer(CorrectionKind::kZero,
            1.0 + 2.0 * *left + (CalcAngle(right) <= half ? CountBits(0.0, half) : CountAngle(angle, half)),
            fmt::format("off by {:.6g} deg", RadToDeg(turn.dot(axis))));
  }
  if (is_row) return;
  bool is_one_angle = false;
  if (origin.given.form == RotationForm::kRollPitchYaw) {
    const Vector3d r = origin.given.r.head<3>();
    for (int k = 0; k < 3; ++k) {
      // R = L turn(k) Q for the one angle.
      Matrix3d L = Matrix3d::Identity(), Q = Matrix3d::Identity();
      for (int m = 2; m > k; --m) L *= TurnAbout(m, r[m]);
      for (int m = k - 1; m >= 0; --m) Q *= TurnAbout(m, r[m]);
      const Vector3d solved = CalcRotationVector(L.transpose() * right * Q.transpose());
      Vector3d rest = solved;
      rest[k] = 0.0;
      if (rest.norm() > origin.open_angle + 2e-8) continue;
      is_one_angle = true;
      const double value = std::abs(solved[k]) <= half ? 0.0 : solved[k];
      offer(CorrectionKind::kNumber, 1.0 + std::min(CountBits(value, half), CountBits(angle, half)),
            fmt::format("{} {}", kAngleNames[k], DescribeRight(r[k], value, " rad")));
    }
    for (const Vector3d& angles : SolveRollPitchYaw(right)) {
      if (is_one_angle) break;
      const Vector3d near = (angles - r).unaryExpr([](double d) { return std::remainder(d, 2.0 * kPi); }) + r;
      const auto [bits, values] =
          CompareEntries(kAngleNames, r, near, Vector3d(Vector3d::Constant(half)), " rad");
      offer(CorrectionKind::kNumber, 1.0 + bits, values);
    }
  }
  if (is_one_angle) return;
  for (int k = 0; k < 3; ++k) {
    Vector3d rest = turn;
    rest[k] = 0.0;
    if (rest.norm() <= origin.open_angle)
      offer(CorrectionKind::kNumber, 2.0 + CountAngle(angle, half),
            fmt::format("turned about its own {} by {:.6g} deg", kAxisNames[k], -RadToDeg(turn[k])));
  }
  const Vector3d way = turn / angle;
  constexpr double kThreeAngles = 33.0;
  offer(CorrectionKind::kNumber, kThreeAngles,
        fmt::format("turned by {:.6g} deg about ({}) of its own", -RadToDeg(angle), ShowVector(way)));
}

void CandidateSearch::SearchPositionNumbers(const Origin& origin) {
  const Vector3d& t = origin.given.t;
  const Vector3d right = origin.right.translation();
  const Vector3d open = origin.open_length;
  const auto [bits, values] = CompareEntries(kAxisNames, t, right, open, " m");
  const auto take = [right](PrintedLink* link) { link->origin.t = right; };
  const PrintedJoint& joint = pair_.a().link(origin.node).joint;
  const auto [ref, refs] = CompareReferences(origin);
  const Vector3d apart = right - t + origin.given.CalcRotation() * joint.axis.normalized() * ref;
  if (ref != 0.0 && joint.kind == JointKind::kSlide &&
      (apart.cwiseAbs().array() <= open.array() + 1e-9).all())
    Try(origin.Make(CorrectionKind::kZero, SiteKind::kPosition, 0.5, refs), origin.link, take);
  if (t.isZero())
    Try(origin.Make(CorrectionKind::kMissing, SiteKind::kPosition,
                    3.0 + (origin.is_last ? 0.0 : 8.0) + 0.25 * (bits + origin.extra), values),
        origin.link, take);
  Try(origin.Make(CorrectionKind::kNumber, SiteKind::kPosition, bits, values), origin.link, take);
}

void CandidateSearch::SearchPoseNumbers(const Origin& origin) {
  const Vector3d t = origin.right.translation();
  const Matrix3d R = origin.right.linear();
  const std::string values = fmt::format("xyz {} m, {} in the other file", ShowVector(t), ShowAngles(R));
  const auto offer = [&](CorrectionKind kind, double bits) {
    Try(origin.Make(kind, SiteKind::kPosition, bits, values, true), origin.link, [=](PrintedLink* link) {
      link->origin.SetRotation(R);
      link->origin.t = t;
    });
  };
  if (origin.given.CalcPose().isApprox(Pose::Identity(), 1e-12))
    offer(CorrectionKind::kMissing, origin.is_last ? 25.0 : 33.0);
  if (!origin.is_alone) offer(CorrectionKind::kNumber, 60.0);
}

void CandidateSearch::SearchRowNumbers(const Origin& origin) {
  PrintedOrigin row = origin.given;
  row.SetRow(origin.right);
  const auto list = [](const PrintedOrigin& o) { return Vector4d(o.r[0], o.t[0], o.r[1], o.t[2]); };
  const Vector4d given = list(origin.given), right = list(row);
  const double length = std::max(origin.open_length.maxCoeff(), 1e-9);
  const Vector4d open(origin.open_angle, length, origin.open_angle, length);
  constexpr const char* kNames[] = {"alpha", "a", "q", "d"};
  // Numbers are printed in degrees.
  const auto show = [](const Vector4d& numbers) -> Vector4d {
    return numbers.cwiseProduct(Vector4d(RadToDeg(1.0), 1.0, RadToDeg(1.0), 1.0));
  };
  const auto [bits, values] = CompareEntries(kNames, show(given), show(right), show(open), "");
  Try(origin.Make(CorrectionKind::kNumber, SiteKind::kPosition, bits, values, true), origin.link,
      [row](PrintedLink* link) { link->origin = row; });
}

/// One convention of all origins that lead to parts of a link and to the joints on it.
void CandidateSearch::SearchAllOrigins(int link) {
  std::vector<int> origins;
  bool has_welded = false;
  SiteMask wrong = WrongOf(link) & kBodyMask;
  for (int k = 0; k < pair_.a().size(); ++k) {
    if (BodyOf(k) != link || k == link) continue;
    has_welded = true;
    origins.push_back(k);
  }
  for (const int child : pair_.links()) {
    if (pair_.node(child).parent != link) continue;
    has_welded = has_welded || pair_.node(child).chain.size() > 1;
    wrong |= WrongOf(child) & kPoseMask;
    for (const int k : pair_.node(child).chain) {
      if (!Contains(origins, k)) origins.push_back(k);
    }
  }
  if (!has_welded || wrong == 0) return;
  std::vector<LinkEdits> lists;
  for (const int k : origins) {
    const PrintedOrigin& origin = pair_.a().link(k).origin;
    lists.push_back({k, ListOriginEdits(origin)});
    std::erase_if(lists.back().edits, [&](const LinkEdit& edit) {
      return edit.fault.whole || edit.fault.kind == CorrectionKind::kTurnOwn ||
             edit.fault.kind == CorrectionKind::kTurnParent || edit.fault.kind == CorrectionKind::kMirror ||
             (edit.fault.of == SiteKind::kPosition && origin.t.isZero());
    });
  }
  TryTogether(lists, origins.back(), kPoseMask | kBodyMask, false);
}

/// The origin of what is welded to a link, which shows in the body and in where joints on it stand.
void CandidateSearch::SearchWeld(int link) {
  const int home = BodyOf(link);
  const PrintedRobot& a = pair_.a();
  if (pair_.Partner(link) >= 0 || Moves(a.link(link)) || home < 0 || (WrongOf(home) & kBodyMask) == 0) return;
  const PrintedOrigin origin = a.link(link).origin;
  for (const LinkEdit& edit : ListOriginEdits(origin)) {
    if (!edit.fault.whole) Try({edit.fault, edit.bits}, link, edit.undo);
  }
  // The right body of its parts, in the frame that carries it.
  const Node& node = pair_.node(home);
  Node own = node;
  Node others = node;
  const auto is_below = [&](int part) {
    for (; part >= 0 && part != link; part = a.link(part).parent) {
    }
    return part == link;
  };
  std::erase_if(own.parts, [&](int part) { return !is_below(part); });
  std::erase_if(others.parts, is_below);
  if (own.parts.empty()) return;
  const MassProperties& whole = pair_.right(home).body;
  const std::optional<MassProperties> alone = Subtract(whole, CalcNodeBody(a, others));
  if (!alone) return;
  const Pose X = CalcPartPose(a, node, link);
  const MassProperties right = ExpressIn(*alone, origin.CalcPose() * X.inverse());
  const MassProperties given = ExpressIn(CalcNodeBody(a, own), X.inverse());
  const Vector3d t = right.com - origin.CalcRotation() * given.com;
  const Vector3d open =
      Vector3d::Constant(pair_.given(home).body_tolerance.com.norm() * whole.mass / alone->mass + 1e-6);
  const auto [bits, values] = CompareEntries(kAxisNames, origin.t, t, open, " m");
  const bool is_missing = origin.t.isZero();
  Try({{is_missing ? CorrectionKind::kMissing : CorrectionKind::kNumber, SiteKind::kPosition},
       is_missing ? 3.0 + 0.25 * bits : bits,
       kPoseMask | kBodyMask,
       values},
      link, [t, open](PrintedLink* part) {
        part->origin.t = t;
        part->origin.half_t = open;
      });
  const bool is_none = origin.CalcRotation().isIdentity(1e-12);
  for (const Matrix3d& R : ListAxesTurns(given.inertia, right.inertia)) {
    Try({{is_none ? CorrectionKind::kMissing : CorrectionKind::kNumber, SiteKind::kRotation},
         is_none ? 8.0 : 40.0,
         kPoseMask | kBodyMask,
         ShowAngles(R) + " in the other file"},
        link, TakeRotation(R));
  }
}

}  // namespace dexcheck
