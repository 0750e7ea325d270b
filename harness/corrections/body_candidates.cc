#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "controller/model/rigid_body.h"
#include "harness/corrections/body_part.h"
#include "harness/corrections/origin_fixes.h"

namespace dexcheck {
namespace {

/// A body without some of its parts, as far as it is one.
std::optional<BodyNumbers> Subtract(const BodyNumbers& whole, const BodyNumbers& rest) {
  constexpr double kLeastMass = 1e-9;
  BodyNumbers part;
  part.mass = whole.mass - rest.mass;
  if (part.mass <= kLeastMass) return std::nullopt;
  part.com = (whole.mass * whole.com - rest.mass * rest.com) / part.mass;
  part.inertia = whole.inertia - rest.inertia - CalcPointInertia(rest.mass, rest.com - whole.com) -
                 CalcPointInertia(part.mass, part.com - whole.com);
  return part;
}

BodyNumbers Express(const BodyNumbers& body, const Pose& X) {
  return {body.mass, X * body.com, X.linear() * body.inertia * X.linear().transpose()};
}

}  // namespace

void CandidateSearch::SearchBody(int link) {
  const Node& node = pair_.node(link);
  const RightNode& right = pair_.right(link);
  const int j = pair_.Partner(link);
  FileFault fault{CorrectionKind::kMissing, SiteKind::kMass};
  fault.whole = true;
  std::vector<Site> sites;
  for (const SiteKind kind : {SiteKind::kMass, SiteKind::kCom, SiteKind::kInertia}) {
    if (IsWrong(link, kind)) sites.push_back({kind, link});
  }
  if (node.parts.empty() || (pair_.given(link).body.mass == 0.0 && right.body.mass > 0.0)) {
    LinkPatch patch{link, pair_.a().link(link)};
    PrintedInertial& made = patch.right.inertial.emplace();
    made.mass.value = right.body.mass;
    made.origin.t = right.body.com;
    made.I = ToEntries(right.body.inertia);
    Add(fault, link, sites, 3.0, {std::move(patch)},
        fmt::format("mass {:.6g} would be right", right.body.mass));
    if (node.parts.empty()) return;
  }
  if (pair_.node_b(j).parts.empty()) {
    LinkPatch patch{link, pair_.a().link(link)};
    patch.right.inertial.reset();
    fault.in_second = true;
    Add(fault, link, sites, 3.0, {std::move(patch)}, "");
    return;
  }
  SearchLostParts(link);
  SearchLoad(link);
  for (const int k : node.parts) {
    Part part;
    part.node = link;
    part.link = k;
    part.is_fused = node.parts.size() > 1 || k != link;
    part.extra = part.is_fused ? std::log2(static_cast<double>(node.parts.size())) + 1.0 : 0.0;
    part.given = *pair_.a().link(k).inertial;
    part.open = pair_.given(link).body_tolerance;
    AddChange(BodyNumbers{}, right.body_tolerance, &part.open);
    part.right = right.body;
    if (part.is_fused) {
      Node rest = node;
      std::erase(rest.parts, k);
      const std::optional<BodyNumbers> alone = Subtract(right.body, CalcNodeBody(pair_.a(), rest));
      if (!alone) continue;
      part.right = Express(*alone, CalcPartPose(pair_.a(), node, k).inverse());
      part.open.com *= right.body.mass / alone->mass;
      part.open.com.setConstant(part.open.com.maxCoeff());
      part.open.inertia.setConstant(part.open.inertia.maxCoeff());
    }
    const Matrix3d R = part.CalcAxes();
    const Matrix3d I = R * ToTensor(part.given.I) * R.transpose();
    part.mass_wrong = std::abs(part.given.mass.value - part.right.mass) > part.open.mass;
    part.com_wrong =
        ((part.given.origin.t - part.right.com).cwiseAbs().array() > part.open.com.array()).any();
    part.inertia_wrong = ((I - part.right.inertia).cwiseAbs().array() > part.open.inertia.array()).any();
    if (k == link && node.parent >= 0) {
      part.origins.push_back(pair_.given(link).X);
      if (right.is_placed && !right.X.isApprox(part.origins[0], 1e-6)) part.origins.push_back(right.X);
    } else if (k != link) {
      part.origins.push_back(pair_.a().link(k).origin.CalcPose());
    }
    if (part.mass_wrong) SearchMass(part);
    if (part.com_wrong) SearchCom(part);
    if (part.inertia_wrong) SearchInertia(part);
    if (part.com_wrong + part.inertia_wrong > 0) SearchWhole(part);
    if (part.is_fused && k == link) {
      EditTrial number{{CorrectionKind::kNumber, SiteKind::kMass}, 90.0, kBodyMask};
      number.fault.whole = true;
      number.values = fmt::format(
          "mass {:.6g}, {:.6g} would be right; centre of mass ({:.6g} {:.6g} {:.6g}), ({:.6g} {:.6g} {:.6g}) "
          "would be right",
          part.given.mass.value, part.right.mass, part.given.origin.t.x(), part.given.origin.t.y(),
          part.given.origin.t.z(), part.right.com.x(), part.right.com.y(), part.right.com.z());
      Try(number, k, [&](const PrintedLink&, PrintedLink* after) {
        after->inertial->mass.value = part.right.mass;
        after->inertial->origin.t = part.right.com;
        after->inertial->I = ToEntries(R.transpose() * part.right.inertia * R);
      });
    }
  }
  if (node.parts.size() > 1) SearchAllParts(link);
}

/// A body that is missing here, as a load is.
void CandidateSearch::SearchLoad(int link) {
  constexpr double kBits =
      60.0;  // of ten numbers; a mass and a centre that are wrong by themselves make no such body
  const BodyNumbers& given = pair_.given(link).body;
  const std::optional<BodyNumbers> load = Subtract(pair_.right(link).body, given);
  const BodyNumbers& open = pair_.given(link).body_tolerance;
  if (!load || !IsWrong(link, SiteKind::kCom) || load->mass < 10.0 * open.mass) return;
  if (!FindPhysicalInconsistency({load->mass, load->com, 0.5 * (load->inertia + load->inertia.transpose())})
           .empty())
    return;
  FileFault fault{CorrectionKind::kPartMissing, SiteKind::kMass};
  fault.whole = true;
  const Vector3d& c = load->com;
  AddBody(fault, link, kBits,
          fmt::format("of {:.6g} kg at ({:.6g} {:.6g} {:.6g})", load->mass, c[0], c[1], c[2]));
}

void CandidateSearch::AddBody(const FileFault& fault, int link, double bits, std::string values) {
  std::vector<Site> sites;
  for (const SiteKind kind : {SiteKind::kMass, SiteKind::kCom, SiteKind::kInertia}) {
    if (IsWrong(link, kind)) sites.push_back({kind, link});
  }
  Add(fault, link, std::move(sites), bits, {}, std::move(values));
}

/// Parts that only the second file has, without which it is what this file has.
void CandidateSearch::SearchLostParts(int link) {
  const Node& theirs = pair_.node_b(pair_.Partner(link));
  const GivenNode& given = pair_.given(link);
  const Node& ours = pair_.node(link);
  const auto add = [&](int part, bool is_second, bool matches) {
    if (!matches) return;
    FileFault fault{CorrectionKind::kPartMissing, SiteKind::kMass};
    fault.whole = true;
    fault.in_second = is_second;
    AddBody(fault, link, 3.0, is_second ? pair_.a().link(part).name : pair_.b().link(part).name);
  };
  const auto is_right = [&](const BodyNumbers& body) {
    for (const SiteKind kind : {SiteKind::kMass, SiteKind::kCom, SiteKind::kInertia}) {
      if (!(pair_.CompareNode(kind, link, given.X, given.pose, body, given.body_tolerance) <= 1.0))
        return false;
    }
    return true;
  };
  for (const int part : theirs.parts) {
    if (part == theirs.link || theirs.parts.size() < 2) continue;
    Node rest = theirs;
    std::erase(rest.parts, part);
    // What the second file has without the part, against this file.
    const BodyNumbers body = Express(CalcNodeBody(pair_.b(), rest), pair_.X_ab(link));
    const BodyNumbers& right = pair_.right(link).body;
    const BodyNumbers moved{right.mass + given.body.mass - body.mass, right.com + given.body.com - body.com,
                            right.inertia + given.body.inertia - body.inertia};
    add(part, false, is_right(moved));
  }
  for (const int part : ours.parts) {
    if (part == ours.link || ours.parts.size() < 2) continue;
    Node rest = ours;
    std::erase(rest.parts, part);
    add(part, true, is_right(CalcNodeBody(pair_.a(), rest)));
  }
}

void CandidateSearch::SearchMass(const Part& part) {
  const SiteMask mask = part.Mask(MaskOf(SiteKind::kMass));
  const std::span<const UnitFault> units = ListUnits(SiteKind::kMass);
  for (size_t k = 0; k < units.size(); ++k) {
    Try({{CorrectionKind::kUnit, SiteKind::kMass, static_cast<int>(k)}, part.extra, mask}, part.link,
        [&](const PrintedLink& before, PrintedLink* after) {
          after->inertial->mass.value = before.inertial->mass.value * units[k].factor;
        });
  }
  Try({{CorrectionKind::kNumber, SiteKind::kMass},
       part.extra + CountBits(part.right.mass, part.open.mass),
       mask,
       Demand::kAll,
       fmt::format("{:.6g}, {:.6g} would be right", part.given.mass.value, part.right.mass)},
      part.link,
      [&](const PrintedLink&, PrintedLink* after) { after->inertial->mass.value = part.right.mass; });
}

void CandidateSearch::SearchCom(const Part& part) {
  const SiteMask mask = part.Mask(MaskOf(SiteKind::kCom));
  const Vector3d& given = part.given.origin.t;
  const Vector3d& right = part.right.com;
  const auto trial = [&](CorrectionKind kind, int component, double bits) {
    return EditTrial{{kind, SiteKind::kCom, component}, part.extra + bits, mask};
  };
  for (const OriginFix& fix : ListVectorFixes(SiteKind::kCom, given)) {
    Try(trial(fix.kind, fix.component, fix.bits), part.link,
        [&](const PrintedLink& before, PrintedLink* after) {
          after->inertial->origin.t = FixVector(fix, SiteKind::kCom, before.inertial->origin.t);
        });
  }
  const Vector3d open = part.open.com;
  EditTrial number =
      trial(CorrectionKind::kNumber, 0, CountEntries(3, given.data(), right.data(), open.data()));
  number.values = DescribeEntries(kAxisNames, given.data(), right.data(), open.data());
  const auto take = [&](const PrintedLink&, PrintedLink* after) { after->inertial->origin.t = right; };
  Try(number, part.link, take);
  if (given.isZero()) {
    EditTrial missing = number;
    missing.fault.kind = CorrectionKind::kMissing;
    missing.bits = part.extra + 3.0;
    Try(missing, part.link, take);
  }
  const auto move = [&](CorrectionKind kind, double bits, const Pose& X) {
    Try(trial(kind, 0, bits), part.link, [&](const PrintedLink& before, PrintedLink* after) {
      after->inertial->origin.t = X * before.inertial->origin.t;
    });
  };
  for (const Pose& X : part.origins) {
    Pose turn = Pose::Identity();
    turn.linear() = X.linear();
    Pose shift = Pose::Identity();
    shift.translation() = X.translation();
    move(CorrectionKind::kInParent, 1.0, X.inverse());
    if (!turn.linear().isIdentity(1e-9)) {
      move(CorrectionKind::kAlongParent, 1.0, turn.inverse());
      move(CorrectionKind::kToParent, 1.0, X);
      move(CorrectionKind::kAlongToParent, 1.0, turn);
    }
    move(CorrectionKind::kPlaceAdded, 1.0, shift.inverse());
    move(CorrectionKind::kPlaceTaken, 1.0, shift);
  }
  for (const int child : pair_.links()) {
    if (pair_.node(child).parent == part.node) move(CorrectionKind::kInChild, 2.0, pair_.given(child).X);
  }
  Pose axes = Pose::Identity();
  axes.linear() = part.CalcAxes();
  if (axes.linear().isIdentity(1e-9)) return;
  move(CorrectionKind::kInertialAxes, 2.0, axes);
  move(CorrectionKind::kToInertialAxes, 2.0, axes.inverse());
}

/// What puts the centre of mass and the inertia right at once.
void CandidateSearch::SearchWhole(const Part& part) {
  const SiteMask mask = part.Mask(MaskOf(SiteKind::kCom) | MaskOf(SiteKind::kInertia));
  const auto trial = [&](CorrectionKind kind, int component, double bits) {
    EditTrial made{{kind, SiteKind::kCom, component}, part.extra + bits, mask};
    made.fault.whole = true;
    return made;
  };
  const auto move = [&](const EditTrial& made, const Matrix3d& M, const Vector3d& t) {
    Try(made, part.link, [&](const PrintedLink& before, PrintedLink* after) {
      PrintedInertial& inertial = *after->inertial;
      const Matrix3d R = before.inertial->origin.CalcRotation();
      const Matrix3d I = M * R * ToTensor(before.inertial->I) * R.transpose() * M.transpose();
      inertial.origin.t = M * before.inertial->origin.t + t;
      inertial.I = ToEntries(R.transpose() * I * R);
    });
  };
  for (int k = 0; k < 3; ++k)
    move(trial(CorrectionKind::kMirror, k, part.inertia_wrong ? 0.0 : 2.0), MakeMirror(k), Vector3d::Zero());
  if (!part.inertia_wrong || !part.com_wrong) return;
  for (const Pose& X : part.origins) {
    const Pose inverse = X.inverse();
    move(trial(CorrectionKind::kInParent, 0, 1.0), inverse.linear(), inverse.translation());
    move(trial(CorrectionKind::kAlongParent, 0, 1.0), inverse.linear(), Vector3d::Zero());
  }
}

/// One convention of all parts of a body.
void CandidateSearch::SearchAllParts(int link) {
  const Node& node = pair_.node(link);
  const auto offer = [&](const FileFault& fault, const auto& edit) {
    std::vector<LinkPatch> patches;
    for (const int part : node.parts) {
      patches.push_back({part, pair_.a().link(part)});
      edit(&*patches.back().right.inertial);
    }
    TryPatches({fault, 0.0, kBodyMask}, link, std::move(patches));
  };
  for (int k = 0; k < 3; ++k)
    offer({CorrectionKind::kSignOf, SiteKind::kCom, k},
          [&](PrintedInertial* body) { body->origin.t[k] *= -1.0; });
  offer({CorrectionKind::kSign, SiteKind::kCom}, [](PrintedInertial* body) { body->origin.t *= -1.0; });
  const auto scale = [&](SiteKind kind, const auto& change) {
    const std::span<const UnitFault> units = ListUnits(kind);
    for (size_t k = 0; k < units.size(); ++k) {
      const double f = units[k].factor;
      offer({CorrectionKind::kUnit, kind, static_cast<int>(k)},
            [&](PrintedInertial* body) { change(f, body); });
    }
  };
  scale(SiteKind::kCom, [](double f, PrintedInertial* body) {
    body->origin.t *= f;
    body->origin.half_t *= std::abs(f);
  });
  scale(SiteKind::kMass, [](double f, PrintedInertial* body) {
    body->mass.value *= f;
    body->mass.half *= std::abs(f);
  });
  scale(SiteKind::kInertia, [](double f, PrintedInertial* body) {
    body->I *= f;
    body->half_I *= std::abs(f);
  });
  offer({CorrectionKind::kProductSigns, SiteKind::kInertia},
        [](PrintedInertial* body) { body->I.tail<3>() *= -1.0; });
  const auto shift = [](double sign, PrintedInertial* body) {
    const Matrix3d R = body->origin.CalcRotation();
    body->I += sign * ToEntries(R.transpose() * CalcPointInertia(body->mass.value, body->origin.t) * R);
  };
  offer({CorrectionKind::kAboutOrigin, SiteKind::kInertia},
        [&](PrintedInertial* body) { shift(-1.0, body); });
  offer({CorrectionKind::kMovedTwice, SiteKind::kInertia}, [&](PrintedInertial* body) { shift(1.0, body); });
}

}  // namespace dexcheck
