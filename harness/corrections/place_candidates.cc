#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/corrections/candidate_search.h"
#include "harness/corrections/origin_fixes.h"

namespace dexcheck {

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
  SiteMask rotation, position;  ///< What a change of it may put right.
  Demand demand;
};

void CandidateSearch::SearchPlace(int link) {
  const Node& node = pair_.node(link);
  const bool one = node.chain.size() == 1;
  const RightNode& right = pair_.right(link);
  const PoseTolerance& open = pair_.given(link).pose;
  Pose before = Pose::Identity();
  for (const int k : node.chain) {
    Origin origin;
    origin.link = k;
    origin.node = link;
    origin.is_alone = one;
    origin.is_last = k == link;
    origin.extra = one ? 0.0 : std::log2(static_cast<double>(node.chain.size())) + 1.0;
    origin.given = pair_.a().link(k).origin;
    constexpr double kUnprinted = 4.0;
    if (!origin.is_last && origin.given.CalcPose().isApprox(Pose::Identity(), 1e-12))
      origin.extra += kUnprinted;
    const Pose X = origin.given.CalcPose();
    const Pose after = (before * X).inverse() * pair_.given(link).X;
    origin.right = before.inverse() * right.X * after.inverse();
    origin.open_angle = open.angle + right.pose.angle;
    origin.open_length = open.length + right.pose.length;
    if (!one) origin.open_length = Vector3d::Constant(origin.open_length.norm());
    origin.turned = CalcAngle(X.linear().transpose() * origin.right.linear()) > origin.open_angle;
    origin.moved =
        ((X.translation() - origin.right.translation()).cwiseAbs().array() > origin.open_length.array())
            .any();
    origin.rotation = one ? MaskOf(SiteKind::kRotation) : kPoseMask | kBodyMask;
    origin.position = one ? MaskOf(SiteKind::kPosition) : kPoseMask | kBodyMask;
    origin.demand = one ? Demand::kAll : Demand::kSome;
    if (origin.given.form == RotationForm::kMdh) SearchRow(origin);
    if (origin.turned && (one || !origin.moved)) {
      SearchRotation(origin);
      SearchRotationNumbers(origin);
    }
    if (origin.moved && (one || !origin.turned)) SearchPosition(origin);
    if (origin.turned && origin.moved) SearchPose(origin);
    before = before * X;
  }
  if (one) SearchSecond(link);
}

void CandidateSearch::SearchRotation(const Origin& origin) {
  const auto trial = [&](CorrectionKind kind, int component, double bits) {
    return EditTrial{
        {kind, SiteKind::kRotation, component}, bits + origin.extra, origin.rotation, origin.demand};
  };
  for (const OriginFix& fix : ListRotationFixes(origin.given)) {
    Try(trial(fix.kind, fix.component, fix.bits), origin.link,
        [&](const PrintedLink& before, PrintedLink* after) {
          FixRotation(fix, before.origin, &after->origin);
        });
  }
  const Matrix3d& R = origin.right.linear();
  const Matrix3d given = origin.given.CalcRotation();
  const auto turns_quarters = [](const Matrix3d& M) {
    return (M.cwiseAbs().array() - M.cwiseAbs().array().round()).abs().maxCoeff() < 1e-4;
  };
  if (CalcAngle(R) <= origin.open_angle) {
    Try(trial(CorrectionKind::kSurplus, 0, turns_quarters(given) ? 5.0 : 15.0), origin.link,
        [](const PrintedLink&, PrintedLink* after) { after->origin.SetRotation(Matrix3d::Identity()); });
  }
  if (!given.isIdentity(1e-12)) return;
  const bool quarters = turns_quarters(R);
  EditTrial missing = trial(CorrectionKind::kMissing, 0, quarters ? 5.0 : 15.0);
  const Vector3d angles = SolveRollPitchYaw(R)[0];
  missing.values =
      fmt::format("roll pitch yaw {:.6g} {:.6g} {:.6g} would be right", angles[0], angles[1], angles[2]);
  Try(missing, origin.link, [&](const PrintedLink&, PrintedLink* after) { after->origin.SetRotation(R); });
}

void CandidateSearch::SearchRotationNumbers(const Origin& origin) {
  const Matrix3d given = origin.given.CalcRotation();
  const Matrix3d& right = origin.right.linear();
  const double half = std::max(origin.open_angle, 1e-6);
  const Vector3d turn = CalcRotationVector(given.transpose() * right);
  const double angle = turn.norm();
  const auto take = [&](const PrintedLink&, PrintedLink* after) { after->origin.SetRotation(right); };
  const auto offer = [&](CorrectionKind kind, double bits, std::string values) {
    Try({{kind, SiteKind::kRotation}, bits + origin.extra, origin.rotation, origin.demand, std::move(values)},
        origin.link, take);
  };
  const PrintedJoint& joint = pair_.a().link(origin.node).joint;
  const Vector3d axis = joint.axis.normalized();
  if (joint.kind == JointKind::kHinge && origin.is_last) {
    const double across = axis.cross(turn).norm();
    const std::optional<double> left = CountLeft(across / origin.open_angle, angle / origin.open_angle);
    if (left)
      offer(CorrectionKind::kZero, 1.0 + 2.0 * *left + CountBits(angle, half),
            fmt::format("off by {:.6g} deg", RadToDeg(turn.dot(axis))));
  }
  bool is_one_angle = false;
  if (origin.given.form == RotationForm::kRollPitchYaw) {
    const Vector3d r = origin.given.r.head<3>();
    for (int k = 0; k < 3; ++k) {
      // R = L turn(k) Q for the one angle.
      const Matrix3d L = k == 0   ? Matrix3d(TurnAbout(2, r[2]) * TurnAbout(1, r[1]))
                         : k == 1 ? TurnAbout(2, r[2])
                                  : Matrix3d(Matrix3d::Identity());
      const Matrix3d Q = k == 0   ? Matrix3d(Matrix3d::Identity())
                         : k == 1 ? TurnAbout(0, r[0])
                                  : Matrix3d(TurnAbout(1, r[1]) * TurnAbout(0, r[0]));
      const Vector3d solved = CalcRotationVector(L.transpose() * right * Q.transpose());
      Vector3d rest = solved;
      rest[k] = 0.0;
      if (rest.norm() > origin.open_angle + 2e-8) continue;
      is_one_angle = true;
      const double value = std::abs(solved[k]) <= half ? 0.0 : solved[k];
      offer(CorrectionKind::kNumber, 1.0 + std::min(CountBits(value, half), CountBits(angle, half)),
            fmt::format("{} {:.6g}, {:.6g} would be right", kAngleNames[k], r[k], value));
    }
    for (const Vector3d& angles : SolveRollPitchYaw(right)) {
      if (is_one_angle) break;
      const Vector3d near = (angles - r).unaryExpr([](double d) { return std::remainder(d, 2.0 * kPi); }) + r;
      const Vector3d open = Vector3d::Constant(half);
      offer(CorrectionKind::kNumber, 1.0 + CountEntries(3, r.data(), near.data(), open.data()),
            DescribeEntries(kAngleNames, r.data(), near.data(), open.data()));
    }
  }
  if (is_one_angle) return;
  for (int k = 0; k < 3; ++k) {
    Vector3d rest = turn;
    rest[k] = 0.0;
    if (rest.norm() <= origin.open_angle)
      offer(CorrectionKind::kNumber, 2.0 + CountBits(angle, half),
            fmt::format("turned about its own {} by {:.6g} deg", kAxisNames[k], -RadToDeg(turn[k])));
  }
  const Vector3d way = turn / angle;
  constexpr double kThreeAngles = 33.0;
  offer(CorrectionKind::kNumber, kThreeAngles,
        fmt::format("turned by {:.6g} deg about ({:.4g} {:.4g} {:.4g}) of its own", -RadToDeg(angle), way[0],
                    way[1], way[2]));
}

void CandidateSearch::SearchPosition(const Origin& origin) {
  const Vector3d& t = origin.given.t;
  const Vector3d& right = origin.right.translation();
  const auto trial = [&](CorrectionKind kind, int component, double bits) {
    return EditTrial{
        {kind, SiteKind::kPosition, component}, bits + origin.extra, origin.position, origin.demand};
  };
  if (origin.given.form == RotationForm::kMdh) return;
  for (const OriginFix& fix : ListVectorFixes(SiteKind::kPosition, t)) {
    Try(trial(fix.kind, fix.component, fix.bits), origin.link,
        [&](const PrintedLink& before, PrintedLink* after) {
          after->origin.t = FixVector(fix, SiteKind::kPosition, before.origin.t);
        });
  }
  const Vector3d open = origin.open_length;
  EditTrial number = trial(CorrectionKind::kNumber, 0, CountEntries(3, t.data(), right.data(), open.data()));
  number.values = DescribeEntries(kAxisNames, t.data(), right.data(), open.data());
  const auto take = [&](const PrintedLink&, PrintedLink* after) { after->origin.t = right; };
  if (t.isZero()) {
    EditTrial missing = number;
    missing.fault.kind = CorrectionKind::kMissing;
    missing.bits = 3.0 + origin.extra + (origin.is_last ? 0.0 : 8.0) + 0.25 * number.bits;
    Try(missing, origin.link, take);
  }
  const auto turned = [&](CorrectionKind kind, const Matrix3d& R, double bits) {
    if (R.isIdentity(1e-9)) return;
    Try(trial(kind, 0, bits), origin.link,
        [&](const PrintedLink& before, PrintedLink* after) { after->origin.t = R * before.origin.t; });
  };
  for (const Matrix3d& R : {origin.given.CalcRotation(), Matrix3d(origin.right.linear())}) {
    turned(CorrectionKind::kAlongLink, R, 1.0);
    turned(CorrectionKind::kAlongToParent, R.transpose(), 1.0);
    turned(CorrectionKind::kInverse, -R.transpose(), 2.0);
    if (!origin.turned) break;
  }
  Try(number, origin.link, take);
}

void CandidateSearch::SearchPose(const Origin& origin) {
  const auto trial = [&](CorrectionKind kind, int component, double bits) {
    EditTrial made{{kind, SiteKind::kPosition, component},
                   bits + origin.extra,
                   origin.rotation | origin.position,
                   origin.demand};
    made.fault.whole = true;
    return made;
  };
  const auto set = [](const Pose& X, PrintedOrigin* origin_) {
    origin_->SetRotation(X.linear());
    origin_->t = X.translation();
  };
  Try(trial(CorrectionKind::kInverse, 0, 0.0), origin.link,
      [&](const PrintedLink& before, PrintedLink* after) {
        set(before.origin.CalcPose().inverse(), &after->origin);
      });
  for (int k = 0; k < 3; ++k) {
    Try(trial(CorrectionKind::kMirror, k, 0.0), origin.link,
        [&](const PrintedLink& before, PrintedLink* after) {
          const Matrix3d M = MakeMirror(k);
          after->origin.SetRotation(M * before.origin.CalcRotation() * M);
          after->origin.t = M * before.origin.t;
        });
  }
  const auto take = [&](const PrintedLink&, PrintedLink* after) { set(origin.right, &after->origin); };
  const Vector3d angles = SolveRollPitchYaw(origin.right.linear())[0];
  const Vector3d& t = origin.right.translation();
  const std::string values =
      fmt::format("xyz {:.6g} {:.6g} {:.6g}, roll pitch yaw {:.6g} {:.6g} {:.6g} would be right", t[0], t[1],
                  t[2], angles[0], angles[1], angles[2]);
  if (origin.given.CalcPose().isApprox(Pose::Identity(), 1e-12)) {
    EditTrial missing = trial(CorrectionKind::kMissing, 0, origin.is_last ? 25.0 : 33.0);
    missing.values = values;
    Try(missing, origin.link, take);
  }
  if (origin.is_alone) return;
  EditTrial number = trial(CorrectionKind::kNumber, 0, 60.0);
  number.values = values;
  Try(number, origin.link, take);
}

void CandidateSearch::SearchRow(const Origin& origin) {
  const Pose X = origin.given.X_before.inverse() * origin.right;
  const Matrix3d& R = X.linear();
  const double alpha = std::atan2(-R(1, 2), R(2, 2));
  const double q = std::atan2(-R(0, 1), R(0, 0));
  const double d = std::abs(std::cos(alpha)) > 0.5 ? X.translation().z() / std::cos(alpha)
                                                   : -X.translation().y() / std::sin(alpha);
  const double near = std::remainder(q - origin.given.r[1], 2.0 * kPi) + origin.given.r[1];
  const double given[] = {origin.given.r[0], origin.given.t[0], origin.given.r[1], origin.given.t[2]};
  const double right[] = {alpha, X.translation().x(), near, d};
  const double length = std::max(origin.open_length.maxCoeff(), 1e-9);
  const double open[] = {origin.open_angle, length, origin.open_angle, length};
  constexpr const char* kNames[] = {"alpha", "a", "q", "d"};
  const auto set = [](const double(&row)[4], PrintedOrigin* after) {
    after->r[0] = row[0];
    after->t[0] = row[1];
    after->r[1] = row[2];
    after->t[2] = row[3];
  };
  const auto trial = [&](CorrectionKind kind, int component, double bits) {
    EditTrial made{{kind, SiteKind::kPosition, component}, bits, kPoseMask, Demand::kAll};
    made.fault.whole = true;
    return made;
  };
  EditTrial number = trial(CorrectionKind::kNumber, 0, CountEntries(4, given, right, open));
  number.values = DescribeEntries(kNames, given, right, open);
  Try(number, origin.link, [&](const PrintedLink&, PrintedLink* after) { set(right, &after->origin); });
  for (int k = 0; k < 4; ++k) {
    double row[] = {given[0], given[1], given[2], given[3]};
    if (row[k] == 0.0) continue;
    row[k] = -row[k];
    EditTrial sign = trial(CorrectionKind::kSignOf, k, 1.0);
    sign.values = kNames[k];
    Try(sign, origin.link, [&](const PrintedLink&, PrintedLink* after) { set(row, &after->origin); });
    row[k] = k % 2 == 0 ? DegToRad(given[k]) : given[k] * 1e-3;
    EditTrial unit = trial(k % 2 == 0 ? CorrectionKind::kDegrees : CorrectionKind::kUnit, 0, 1.0);
    unit.values = kNames[k];
    Try(unit, origin.link, [&](const PrintedLink&, PrintedLink* after) { set(row, &after->origin); });
  }
}

/// Conventions of the second file's print that would explain a rotation.
void CandidateSearch::SearchSecond(int link) {
  if (!IsWrong(link, SiteKind::kRotation)) return;
  const int j = pair_.Partner(link);
  if (pair_.node_b(j).chain.size() != 1 || pair_.node(link).parent < 0) return;
  const PrintedOrigin& theirs = pair_.b().link(j).origin;
  const Matrix3d goal = pair_.X_ab(pair_.node(link).parent).linear().transpose() *
                        pair_.given(link).X.linear() * pair_.X_ab(link).linear();
  for (const OriginFix& fix : ListRotationFixes(theirs)) {
    if (fix.kind == CorrectionKind::kTurnOwn || fix.kind == CorrectionKind::kTurnParent ||
        fix.kind == CorrectionKind::kMirror || fix.kind == CorrectionKind::kTransposed ||
        fix.kind == CorrectionKind::kAngleSign || fix.kind == CorrectionKind::kAngleDegrees)
      continue;
    const bool of_quaternion =
        fix.kind == CorrectionKind::kScalarFirst || fix.kind == CorrectionKind::kScalarLast;
    if (of_quaternion && theirs.form != RotationForm::kQuaternion) continue;
    PrintedOrigin right = theirs;
    FixRotation(fix, theirs, &right);
    if (CalcAngle(right.CalcRotation().transpose() * goal) >
        2.0 * (pair_.given(link).pose.angle + pair_.other(j).pose.angle))
      continue;
    FileFault fault{fix.kind, SiteKind::kRotation, fix.component};
    fault.in_second = true;
    Add(fault, link, {{SiteKind::kRotation, link}}, fix.bits + 4.0, {}, "");
  }
}

}  // namespace dexcheck
