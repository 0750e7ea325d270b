#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "controller/model/rigid_body.h"
#include "harness/corrections/candidate_search.h"
#include "harness/corrections/origin_fixes.h"

namespace dexcheck {
namespace {

bool IsSameInertial(const PrintedInertial& a, const PrintedInertial& b) {
  return a.mass.value == b.mass.value && a.origin.t == b.origin.t && a.origin.r == b.origin.r && a.I == b.I;
}

/// Takes what a fault is about from another link.
void TakeOf(const FileFault& fault, const PrintedLink& from, PrintedLink* to) {
  const auto take_place = [](const PrintedOrigin& x, PrintedOrigin* y) {
    y->t = x.t;
    y->half_t = x.half_t;
  };
  if (fault.whole && IsOfBody(fault.of)) {
    to->inertial = from.inertial;
  } else if (fault.whole) {
    to->origin = from.origin;
  } else if (fault.of == SiteKind::kMass) {
    to->inertial->mass = from.inertial->mass;
  } else if (fault.of == SiteKind::kCom) {
    take_place(from.inertial->origin, &to->inertial->origin);
  } else if (fault.of == SiteKind::kPosition) {
    take_place(from.origin, &to->origin);
  } else if (fault.of == SiteKind::kRotation) {
    PrintedOrigin origin = from.origin;
    take_place(to->origin, &origin);
    to->origin = origin;
  } else {
    PrintedInertial inertial = *from.inertial;
    inertial.mass = to->inertial->mass;
    take_place(to->inertial->origin, &inertial.origin);
    to->inertial = inertial;
  }
}

}  // namespace

void CandidateSearch::SearchExchanges() {
  const PrintedRobot& a = pair_.a();
  const double which = std::log2(static_cast<double>(pair_.links().size()));
  std::vector<SiteMask> wrong(a.links.size(), 0);  // of the bodies and places that a link is part of
  for (int n = 0; n < a.size(); ++n) {
    const auto at = static_cast<size_t>(n);
    if (bodies_[at] >= 0) wrong[at] |= wrong_[static_cast<size_t>(bodies_[at])] & kBodyMask;
    for (const int placed : poses_[at]) wrong[at] |= wrong_[static_cast<size_t>(placed)] & kPoseMask;
  }
  for (int n = 0; n < a.size(); ++n) {
    for (int k = n + 1; k < a.size(); ++k) {
      const PrintedLink& one = a.link(n);
      const PrintedLink& two = a.link(k);
      const SiteMask both = wrong[static_cast<size_t>(n)] & wrong[static_cast<size_t>(k)];
      const auto offer = [&](SiteKind of, bool whole, SiteMask mask) {
        EditTrial trial{{CorrectionKind::kExchanged, of}, which + (whole ? 0.0 : 1.0), mask};
        trial.fault.whole = whole;
        trial.fault.other = k;
        trial.values = two.name;
        std::vector<LinkPatch> patches = {{n, one}, {k, two}};
        TakeOf(trial.fault, two, &patches[0].right);
        TakeOf(trial.fault, one, &patches[1].right);
        TryPatches(trial, n, std::move(patches));
      };
      if ((both & kBodyMask) != 0 && one.inertial && two.inertial) {
        offer(SiteKind::kMass, true, kBodyMask);
        for (const SiteKind kind : {SiteKind::kMass, SiteKind::kCom, SiteKind::kInertia}) {
          if ((both & MaskOf(kind)) != 0) offer(kind, false, MaskOf(kind));
        }
      }
      if ((both & kPoseMask) == 0 || one.origin.form == RotationForm::kMdh) continue;
      offer(SiteKind::kPosition, true, kPoseMask);
      for (const SiteKind kind : {SiteKind::kPosition, SiteKind::kRotation}) {
        if ((both & MaskOf(kind)) != 0) offer(kind, false, MaskOf(kind));
      }
    }
  }
  for (const int n : pair_.links()) SearchCopy(n, which);
}

/// A link that has what is right of another link, or what the file says of that.
void CandidateSearch::SearchCopy(int link, double which) {
  const PrintedLink& one = pair_.a().link(link);
  if ((wrong_[static_cast<size_t>(link)] & kBodyMask) == 0 || !one.inertial ||
      pair_.node(link).parts.size() != 1)
    return;
  const BodyNumbers& given = pair_.given(link).body;
  const BodyNumbers& open = pair_.given(link).body_tolerance;
  const BodyNumbers& right = pair_.right(link).body;
  const auto is_near = [](double apart, double open_) { return apart <= 2.0 * open_ + 1e-9; };
  for (const int k : pair_.links()) {
    const PrintedLink& two = pair_.a().link(k);
    if (k == link || !two.inertial) continue;
    const BodyNumbers& other = pair_.right(k).body;
    const bool copied = !is_second_ && IsSameInertial(*one.inertial, *two.inertial);
    const bool is_other = other.mass > 0.0 && is_near(std::abs(given.mass - other.mass), open.mass) &&
                          is_near((given.com - other.com).norm(), open.com.norm()) &&
                          is_near((given.inertia - other.inertia).norm(), open.inertia.norm());
    if (!copied && !is_other) continue;
    EditTrial trial{{CorrectionKind::kOfOther, SiteKind::kMass}, which + (copied ? 0.0 : 1.0), kBodyMask};
    trial.fault.whole = true;
    trial.fault.other = k;
    trial.values = two.name;
    Try(trial, link, [&](const PrintedLink&, PrintedLink* after) {
      const Matrix3d R = after->inertial->origin.CalcRotation();
      after->inertial->mass.value = right.mass;
      after->inertial->origin.t = right.com;
      after->inertial->I = ToEntries(R.transpose() * right.inertia * R);
    });
  }
}

void CandidateSearch::SearchWelds() {
  for (const int link : pair_.links()) SearchAllOrigins(link);
  for (int link = 0; link < pair_.a().size(); ++link) {
    const int home = bodies_[static_cast<size_t>(link)];
    const bool is_welded = pair_.Partner(link) < 0 && !Moves(pair_.a().link(link)) && home >= 0;
    if (is_welded && (wrong_[static_cast<size_t>(home)] & kBodyMask) != 0) SearchWeld(link);
  }
}

/// One convention of all origins that lead to parts of a link and to the joints on it.
void CandidateSearch::SearchAllOrigins(int link) {
  std::vector<int> origins;
  const auto take = [&](int k) {
    if (std::ranges::find(origins, k) == origins.end()) origins.push_back(k);
  };
  bool has_welded = false;
  SiteMask wrong = wrong_[static_cast<size_t>(link)] & kBodyMask;
  for (int k = 0; k < pair_.a().size(); ++k) {
    if (bodies_[static_cast<size_t>(k)] != link || k == link) continue;
    has_welded = true;
    take(k);
  }
  for (const int child : pair_.links()) {
    if (pair_.node(child).parent != link) continue;
    has_welded = has_welded || pair_.node(child).chain.size() > 1;
    wrong |= wrong_[static_cast<size_t>(child)] & kPoseMask;
    for (const int k : pair_.node(child).chain) take(k);
  }
  if (!has_welded || wrong == 0) return;
  const auto offer = [&](const OriginFix& fix, SiteKind kind) {
    std::vector<LinkPatch> patches;
    for (const int k : origins) {
      const PrintedOrigin& origin = pair_.a().link(k).origin;
      if (kind == SiteKind::kRotation ? origin.CalcRotation().isIdentity(1e-12) : origin.t.isZero()) continue;
      LinkPatch& patch = patches.emplace_back(LinkPatch{k, pair_.a().link(k)});
      if (kind == SiteKind::kRotation) {
        FixRotation(fix, pair_.a().link(k).origin, &patch.right.origin);
        if (patch.right.origin.form == RotationForm::kRollPitchYaw ||
            patch.right.origin.form == RotationForm::kEuler) {
          const double most = pair_.a().link(k).origin.r.norm();
          if (most > 0.0) patch.right.origin.half_r *= patch.right.origin.r.norm() / most;
        }
      } else {
        patch.right.origin.t = FixVector(fix, kind, pair_.a().link(k).origin.t);
        if (fix.kind == CorrectionKind::kUnit)
          patch.right.origin.half_t *= ListUnits(kind)[static_cast<size_t>(fix.component)].factor;
      }
    }
    TryPatches({{fix.kind, kind, fix.component}, fix.bits, kPoseMask | kBodyMask, Demand::kSome},
               origins.back(), std::move(patches));
  };
  for (const int k : origins) {
    if (pair_.a().link(k).origin.CalcRotation().isIdentity(1e-12)) continue;
    for (const OriginFix& fix : ListRotationFixes(pair_.a().link(k).origin)) {
      if (fix.kind < CorrectionKind::kMirror && fix.kind != CorrectionKind::kAngleSign &&
          fix.kind != CorrectionKind::kAngleDegrees)
        offer(fix, SiteKind::kRotation);
    }
    break;
  }
  for (const OriginFix& fix : ListVectorFixes(SiteKind::kPosition, Vector3d::Ones()))
    offer(fix, SiteKind::kPosition);
}

/// The origin of what is welded to a link, which shows in the body and in where joints on it stand.
void CandidateSearch::SearchWeld(int link) {
  const int home = bodies_[static_cast<size_t>(link)];
  const PrintedOrigin& origin = pair_.a().link(link).origin;
  const auto trial = [&](CorrectionKind kind, SiteKind of, int component, double bits) {
    return EditTrial{{kind, of, component}, bits, kPoseMask | kBodyMask};
  };
  for (const OriginFix& fix : ListRotationFixes(origin)) {
    Try(trial(fix.kind, SiteKind::kRotation, fix.component, fix.bits), link,
        [&](const PrintedLink& before, PrintedLink* after) {
          FixRotation(fix, before.origin, &after->origin);
        });
  }
  for (const OriginFix& fix : ListVectorFixes(SiteKind::kPosition, origin.t)) {
    Try(trial(fix.kind, SiteKind::kPosition, fix.component, fix.bits), link,
        [&](const PrintedLink& before, PrintedLink* after) {
          after->origin.t = FixVector(fix, SiteKind::kPosition, before.origin.t);
        });
  }
  // What its parts would have to be, in the frame that carries it.
  const Node& node = pair_.node(home);
  Node own = node;
  Node rest = node;
  const auto is_below = [&](int part) {
    for (; part >= 0 && part != link; part = pair_.a().link(part).parent) {
    }
    return part == link;
  };
  std::erase_if(own.parts, [&](int part) { return !is_below(part); });
  std::erase_if(rest.parts, is_below);
  if (own.parts.empty()) return;
  const BodyNumbers& whole = pair_.right(home).body;
  const BodyNumbers others = CalcNodeBody(pair_.a(), rest);
  const BodyNumbers given = CalcNodeBody(pair_.a(), own);
  const double mass = whole.mass - others.mass;
  if (mass <= 1e-9) return;
  const Vector3d com = (whole.mass * whole.com - others.mass * others.com) / mass;
  const Matrix3d inertia = whole.inertia - others.inertia -
                           CalcPointInertia(others.mass, others.com - whole.com) -
                           CalcPointInertia(mass, com - whole.com);
  const Pose X = CalcPartPose(pair_.a(), node, link);
  const Pose carrier = X * origin.CalcPose().inverse();
  const Vector3d own_com = X.inverse() * given.com;
  const Vector3d t = carrier.inverse() * com - origin.CalcRotation() * own_com;
  const Vector3d open =
      Vector3d::Constant(pair_.given(home).body_tolerance.com.norm() * whole.mass / mass + 1e-6);
  EditTrial number = trial(CorrectionKind::kNumber, SiteKind::kPosition, 0,
                           CountEntries(3, origin.t.data(), t.data(), open.data()));
  number.values = DescribeEntries(kAxisNames, origin.t.data(), t.data(), open.data());
  Try(number, link, [&](const PrintedLink&, PrintedLink* after) { after->origin.t = t; });
  const Matrix3d V =
      Eigen::SelfAdjointEigenSolver<Matrix3d>(carrier.linear().transpose() * inertia * carrier.linear())
          .eigenvectors();
  const Matrix3d W =
      Eigen::SelfAdjointEigenSolver<Matrix3d>(X.linear().transpose() * given.inertia * X.linear())
          .eigenvectors();
  const bool is_none = origin.CalcRotation().isIdentity(1e-12);
  for (int signs = 0; signs < 8; ++signs) {
    const Vector3d s((signs & 1) != 0 ? 1.0 : -1.0, (signs & 2) != 0 ? 1.0 : -1.0,
                     (signs & 4) != 0 ? 1.0 : -1.0);
    const Matrix3d R = V * s.asDiagonal() * W.transpose();
    if (R.determinant() < 0.0) continue;
    EditTrial turned = trial(is_none ? CorrectionKind::kMissing : CorrectionKind::kNumber,
                             SiteKind::kRotation, 0, is_none ? 8.0 : 40.0);
    const Vector3d angles = SolveRollPitchYaw(R)[0];
    turned.values =
        fmt::format("roll pitch yaw {:.6g} {:.6g} {:.6g} would be right", angles[0], angles[1], angles[2]);
    Try(turned, link, [&](const PrintedLink&, PrintedLink* after) { after->origin.SetRotation(R); });
  }
}

}  // namespace dexcheck
