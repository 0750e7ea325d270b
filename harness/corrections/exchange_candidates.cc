#include <algorithm>
#include <bit>
#include <cmath>

#include "harness/corrections/candidate_search.h"

namespace dexcheck {
namespace {

using Kind = CorrectionKind;

/// Takes what a fault is about from another link.
void TakeOf(const FileFault& fault, const PrintedLink& from, PrintedLink* to) {
  if (fault.whole && IsOfBody(fault.of)) {
    to->inertial = from.inertial;
  } else if (fault.whole) {
    const Pose X_before = to->origin.X_before;  // of rows of a table
    to->origin = from.origin;
    to->origin.X_before = X_before;
  } else if (fault.of == SiteKind::kMass) {
    to->inertial->mass = from.inertial->mass;
  } else if (fault.of == SiteKind::kCom) {
    to->inertial->origin.TakePlace(from.inertial->origin);
  } else if (fault.of == SiteKind::kPosition) {
    to->origin.TakePlace(from.origin);
  } else if (fault.of == SiteKind::kRotation) {
    PrintedOrigin origin = from.origin;
    origin.TakePlace(to->origin);
    to->origin = origin;
  } else {
    PrintedInertial inertial = *from.inertial;
    inertial.mass = to->inertial->mass;
    inertial.origin.TakePlace(to->inertial->origin);
    to->inertial = inertial;
  }
}

}  // namespace

void CandidateSearch::SearchExchanges() {
  const PrintedRobot& a = pair_.a();
  const double which = std::log2(static_cast<double>(pair_.links().size()));
  std::vector<SiteMask> wrong(a.links.size(), 0);  // of the bodies and places that a link is part of
  for (int n = 0; n < a.size(); ++n) {
    SiteMask& mask = wrong[static_cast<size_t>(n)];
    if (BodyOf(n) >= 0) mask |= WrongOf(BodyOf(n)) & kBodyMask;
    for (const int placed : PosesOf(n)) mask |= WrongOf(placed) & kPoseMask;
  }
  for (int n = 0; n < a.size(); ++n) {
    for (int k = n + 1; k < a.size(); ++k) {
      const PrintedLink one = a.link(n);
      const PrintedLink two = a.link(k);
      const SiteMask both = wrong[static_cast<size_t>(n)] & wrong[static_cast<size_t>(k)];
      if ((both & (kBodyMask | kPoseMask)) == 0) continue;
      const auto offer = [&](SiteKind of, bool whole, SiteMask mask) {
        EditTrial trial{{Kind::kExchanged, of}, which + (whole ? 0.0 : 1.0), mask, two.name};
        trial.fault.whole = whole;
        trial.fault.other = k;
        const auto take = [&](const PrintedLink& from) {
          return [fault = trial.fault, from](PrintedLink* to) { TakeOf(fault, from, to); };
        };
        Try(trial, n, {{n, take(two)}, {k, take(one)}});
      };
      if ((both & kBodyMask) != 0 && one.inertial && two.inertial) {
        offer(SiteKind::kMass, true, kBodyMask);
        for (const SiteKind kind : kBodyKinds) {
          if ((both & MaskOf(kind)) != 0) offer(kind, false, MaskOf(kind));
        }
      }
      if ((both & kPoseMask) == 0) continue;
      const bool is_row = one.origin.form == RotationForm::kMdh;
      if (is_row != (two.origin.form == RotationForm::kMdh)) continue;
      offer(SiteKind::kPosition, true, kPoseMask);
      if (is_row) continue;
      if ((both & kPoseMask) == kPoseMask) SearchTurnedExchange(n, k, which);
      for (const SiteKind kind : {SiteKind::kPosition, SiteKind::kRotation}) {
        if ((both & MaskOf(kind)) != 0) offer(kind, false, MaskOf(kind));
      }
    }
  }
  for (const int n : pair_.links()) SearchCopy(n, which);
}

/// Two origins that are exchanged, one or both of which have a convention of their rotation beside.
void CandidateSearch::SearchTurnedExchange(int n, int k, double which) {
  const PrintedLink one = pair_.a().link(n);
  const PrintedLink two = pair_.a().link(k);
  FileFault fault{Kind::kExchanged, SiteKind::kPosition};
  fault.other = k;
  const auto take = [&](const PrintedLink& from, const LinkUndo& undo = {}) -> LinkUndo {
    return [=, whole = FileFault{.kind = Kind::kExchanged, .whole = true}](PrintedLink* to) {
      TakeOf(whole, from, to);
      if (undo) undo(to);
    };
  };
  const size_t begin = found_.size();
  const bool are_placed = Try({fault, 0.0, MaskOf(SiteKind::kPosition)}, n, {{n, take(two)}, {k, take(one)}});
  found_.resize(begin);
  if (!are_placed) return;
  fault.whole = true;
  const EditTrial trial{fault, which, kPoseMask, two.name};
  const auto offer = [&](const LinkEdit& edit, const LinkUndo& at_n, const LinkUndo& at_k,
                         std::vector<int> links) {
    if (!Try(trial, n, {{n, take(two, at_n)}, {k, take(one, at_k)}})) return;
    found_.back().beside = {edit.fault, std::move(links), edit.bits};
  };
  const std::vector<LinkEdit> edits = ListRotationEdits(one.origin), others = ListRotationEdits(two.origin);
  for (const LinkEdit& edit : others) {
    offer(edit, edit.undo, {}, {n});
    const auto is_same = [&](const LinkEdit& other) { return IsSameFault(other.fault, edit.fault); };
    const auto same = std::ranges::find_if(edits, is_same);
    if (same != edits.end()) offer(edit, edit.undo, same->undo, {n, k});
  }
  for (const LinkEdit& edit : edits) offer(edit, {}, edit.undo, {k});
}

/// A link that has what is right of another link, or what the file says of that.
void CandidateSearch::SearchCopy(int link, double which) {
  const PrintedLink& one = pair_.a().link(link);
  // Robots have equal parts: a single quantity that differs, or an inertial that one file lacks, is no copy.
  if (std::popcount(WrongOf(link) & kBodyMask) < 2 || !(pair_.right(link).body.mass > 0.0)) return;
  if (!one.inertial || pair_.node(link).parts.size() != 1) return;
  const MassProperties& given = pair_.given(link).body;
  const MassProperties& open = pair_.given(link).body_tolerance;
  const MassProperties right = pair_.right(link).body;
  const auto is_near = [](double apart, double open_) { return apart <= 2.0 * open_ + 1e-9; };
  for (const int k : pair_.links()) {
    const PrintedLink& two = pair_.a().link(k);
    if (k == link || !two.inertial) continue;
    const MassProperties& other = pair_.right(k).body;
    const bool copied = !is_second_ && !IsOther(one.inertial, two.inertial);
    const bool is_other = other.mass > 0.0 && is_near(std::abs(given.mass - other.mass), open.mass) &&
                          is_near((given.com - other.com).norm(), open.com.norm()) &&
                          is_near((given.inertia - other.inertia).norm(), open.inertia.norm());
    // Two equal links say nothing, nor does a link whose frame alone differs.
    const MassProperties& own = pair_.other(pair_.Partner(link)).body;
    const MassProperties& theirs = pair_.other(pair_.Partner(k)).body;
    const bool is_twin = is_near((own.com - theirs.com).norm(), open.com.norm()) &&
                         is_near((own.inertia - theirs.inertia).norm(), open.inertia.norm());
    if ((!copied && !is_other) || (is_twin && own.mass == theirs.mass)) continue;
    EditTrial trial{{Kind::kOfOther, SiteKind::kMass}, which + (copied ? 0.0 : 1.0), kBodyMask, two.name};
    trial.fault.whole = true;
    trial.fault.other = k;
    Try(trial, link, GiveBody(right));
  }
}

/// The link with the rotation, or the inertia, that would be right.
PrintedLink CandidateSearch::TakeRight(int link, SiteMask mask) const {
  PrintedLink made = pair_.a().link(link);
  if ((mask & kPoseMask) != 0) {
    made.origin.SetRotation(pair_.right(link).X.linear());
  } else if (made.inertial) {
    const Matrix3d R = made.inertial->origin.CalcRotation();
    made.inertial->I = ToEntries(R.transpose() * pair_.right(link).body.inertia * R);
  }
  return made;
}

/// Conventions of the second file's print that would explain what differs at a link.
void CandidateSearch::SearchSecond(int link) {
  constexpr double kOfSecond = 4.0;
  const SiteMask wrong = WrongOf(link) & (kPoseMask | kBodyMask);
  const int j = pair_.Partner(link);
  const Node& node = pair_.node_b(j);
  if (wrong == 0) return;
  PrintedLink& there = pair_.mutable_b()->link(j);
  const PrintedLink before = there;
  const PrintedLink right_pose = TakeRight(link, kPoseMask), right_body = TakeRight(link, kBodyMask);
  const auto offer = [&](const LinkEdit& edit, SiteMask mask, const std::string& values) {
    if (*budget_ <= 0 || (wrong & mask) == 0) return;
    --*budget_;
    there = Carry(before, edit.undo);
    pair_.MeasureOther(link);
    std::vector<Site> right;
    bool holds = true;
    for (const SiteKind kind : kNodeKinds) {
      if ((mask & MaskOf(kind)) == 0) continue;
      const bool is_right = pair_.CompareNode(kind, link) <= 1.0;
      if (is_right && IsWrong(link, kind)) right.push_back({kind, link});
      holds = holds && is_right;
    }
    if (holds && !right.empty()) {
      EditTrial trial{edit.fault, edit.bits + (values.empty() ? kOfSecond : 0.0), mask, values};
      Kind& kind = trial.fault.kind == Kind::kFrame ? trial.fault.rotation : trial.fault.kind;
      trial.fault.in_second = kind != Kind::kRadians && kind != Kind::kLinkAxes;
      // A loss in this file is named, not a surplus in the other one.
      if (kind == Kind::kRadians) kind = Kind::kDegrees;
      if (kind == Kind::kLinkAxes) trial.fault = MakeLostAxes(*before.inertial, false);
      std::vector<LinkPatch> patches;
      if (!trial.fault.in_second) {
        trial.bits = edit.bits;
        patches.push_back({link, (mask & kPoseMask) != 0 ? right_pose : right_body});
      }
      Add(trial, link, std::move(right), std::move(patches));
    }
    there = before;
  };
  if ((wrong & kPoseMask) != 0 && node.chain.size() == 1 && pair_.IsPlaced(link)) {
    for (const LinkEdit& edit : ListOriginEdits(before.origin)) {
      // A fault that either file may have is one of the first.
      if (edit.fault.of != SiteKind::kRotation || edit.fault.kind >= Kind::kMirror ||
          edit.fault.kind == Kind::kTransposed || edit.fault.kind == Kind::kAngleSign ||
          edit.fault.kind == Kind::kAngleDegrees)
        continue;
      const bool of_quaternion =
          edit.fault.kind == Kind::kScalarFirst || edit.fault.kind == Kind::kScalarLast;
      if (!of_quaternion || before.origin.form == RotationForm::kQuaternion)
        offer(edit, MaskOf(SiteKind::kRotation), "");
    }
  }
  if (before.inertial && node.parts.size() == 1) {
    for (const LinkEdit& edit : ListInertialEdits(before)) {
      const bool is_compiled = edit.fault.kind == Kind::kCompiled;
      const bool whole = edit.fault.whole;
      offer(edit, whole ? (is_compiled ? wrong & kBodyMask : kBodyMask) : MaskOf(edit.fault.of),
            is_compiled ? before.compiled->description : "");
    }
  }
  pair_.MeasureOther(link);
}

}  // namespace dexcheck
