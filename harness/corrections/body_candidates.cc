#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "controller/model/rigid_body.h"
#include "harness/corrections/candidate_search.h"

namespace dexcheck {
namespace {

using Kind = CorrectionKind;

FileFault MakeWhole(Kind kind, bool in_second = false) {
  return {.kind = kind, .of = SiteKind::kMass, .in_second = in_second, .whole = true};
}

/// Conventions by the link's own origin.
std::vector<LinkEdit> ListOwnEdits(const PrintedLink& link) {
  return ListInertialEdits(link, {{link.origin.CalcPose()}});
}

/// Angles of roll, pitch or yaw of an inertial frame under which its inertia is right, by Gauss-Newton from
/// the best of a grid.
std::vector<double> SolveOneAngle(const PrintedOrigin& origin, int angle, const Matrix3d& I,
                                  const Matrix3d& right, const Matrix3d& open) {
  constexpr int kGrid = 24;
  constexpr int kSteps = 8;
  constexpr double kStep = 1e-6;
  const auto measure = [&](double value) -> Vector6d {
    Vector3d angles = origin.r.head<3>();
    angles[angle] = value;
    const Matrix3d R = TurnRollPitchYaw(angles);
    return ToEntries(R * I * R.transpose() - right);
  };
  std::array<std::pair<double, double>, kGrid> starts;
  for (int k = 0; k < kGrid; ++k) {
    const double value = origin.r[angle] + 2.0 * kPi * k / kGrid;
    starts[static_cast<size_t>(k)] = {measure(value).lpNorm<1>(), value};
  }
  std::ranges::sort(starts);
  std::vector<double> solved;
  for (size_t k = 0; k < 3 && solved.empty(); ++k) {
    double value = starts[k].second;
    for (int step = 0; step < kSteps; ++step) {
      const Vector6d slope = (measure(value + kStep) - measure(value - kStep)) / (2.0 * kStep);
      if (slope.squaredNorm() == 0.0) break;
      value -= slope.dot(measure(value)) / slope.squaredNorm();
    }
    if ((measure(value).cwiseAbs().array() <= ToEntries(open).array() + 1e-9 * right.trace()).all())
      solved.push_back(std::remainder(value, 2.0 * kPi));
  }
  return solved;
}

}  // namespace

struct CandidateSearch::Part {
  int node;  ///< The link that carries the body,
  int link;  ///< and that whose inertial it is.
  bool is_fused;
  double extra;  ///< Bits of which of several.
  PrintedInertial given;
  MassProperties right;  ///< What it would have to be alone, in its link's frame.
  MassProperties open;   ///< Tolerances that the digits of both files give them.
  SiteMask wrong = 0;
  EditFrames frames;

  [[nodiscard]] bool IsWrong(SiteKind kind) const { return (wrong & MaskOf(kind)) != 0; }
  /// A trial that must put right all of the body, if it is one of several parts.
  [[nodiscard]] EditTrial Make(const FileFault& fault, double bits, std::string values = "") const {
    SiteMask kinds = MaskOf(fault.of);
    if (fault.whole) kinds = fault.kind == Kind::kCompiled ? kBodyMask : kBodyMask & ~MaskOf(SiteKind::kMass);
    return {fault, extra + bits, is_fused ? kBodyMask : kinds, std::move(values)};
  }
  /// Whether an edit may put right what is wrong of it.
  [[nodiscard]] bool Concerns(const FileFault& fault) const {
    if (fault.kind == Kind::kCompiled) return wrong != 0;
    if (!fault.whole) return IsWrong(fault.of);
    return IsWrong(SiteKind::kCom) && IsWrong(SiteKind::kInertia);
  }
};

std::optional<CandidateSearch::Part> CandidateSearch::MakePart(int link, int k) const {
  const Node& node = pair_.node(link);
  const RightNode& right = pair_.right(link);
  Part part;
  part.node = link;
  part.link = k;
  part.is_fused = node.parts.size() > 1 || k != link;
  part.extra = part.is_fused ? std::log2(static_cast<double>(node.parts.size())) + 1.0 : 0.0;
  part.given = *pair_.a().link(k).inertial;
  part.open = pair_.given(link).body_tolerance;
  AddChange(MassProperties{}, right.body_tolerance, &part.open);
  part.right = right.body;
  if (part.is_fused) {
    Node rest = node;
    std::erase(rest.parts, k);
    const std::optional<MassProperties> alone = Subtract(right.body, CalcNodeBody(pair_.a(), rest));
    if (!alone) return std::nullopt;
    part.right = ExpressIn(*alone, CalcPartPose(pair_.a(), node, k).inverse());
    part.open.com *= right.body.mass / alone->mass;
    part.open.com.setConstant(part.open.com.maxCoeff());
    part.open.inertia.setConstant(part.open.inertia.maxCoeff());
  }
  const Matrix3d R = part.given.origin.CalcRotation();
  const Matrix3d I = R * ToTensor(part.given.I) * R.transpose();
  const auto add = [&](bool is_wrong, SiteKind kind) { part.wrong |= is_wrong ? MaskOf(kind) : 0; };
  add(std::abs(part.given.mass.value - part.right.mass) > part.open.mass, SiteKind::kMass);
  add(((part.given.origin.t - part.right.com).cwiseAbs().array() > part.open.com.array()).any(),
      SiteKind::kCom);
  add(((I - part.right.inertia).cwiseAbs().array() > part.open.inertia.array()).any(), SiteKind::kInertia);
  if (k == link && pair_.Carrier(link) >= 0) {
    part.frames.X_PL.push_back(pair_.given(link).X);
    if (right.is_placed && !right.X.isApprox(part.frames.X_PL[0], 1e-6)) part.frames.X_PL.push_back(right.X);
  } else if (k != link) {
    part.frames.X_PL.push_back(pair_.a().link(k).origin.CalcPose());
  }
  for (const int child : pair_.links()) {
    if (pair_.node(child).parent == link) part.frames.X_LC.push_back(pair_.given(child).X);
  }
  if (part.IsWrong(SiteKind::kMass) || part.IsWrong(SiteKind::kCom))
    part.frames.right = {part.right.mass, part.right.com};
  return part;
}

void CandidateSearch::SearchBody(int link) {
  const size_t begin = found_.size();
  const Node& node = pair_.node(link);
  const RightNode& right = pair_.right(link);
  const auto offer = [&](const FileFault& fault, std::string values, const LinkUndo& undo) {
    LinkPatch patch{link, pair_.a().link(link)};
    undo(&patch.right);
    Add({fault, 3.0, kBodyMask, std::move(values)}, link, ListBodySites(link), {std::move(patch)});
  };
  if (node.parts.empty() || (pair_.given(link).body.mass == 0.0 && right.body.mass > 0.0)) {
    offer(MakeWhole(Kind::kMissing), fmt::format("mass {:.6g} kg in the other file", right.body.mass),
          GiveBody(right.body));
    if (node.parts.empty()) return;
  }
  const Node& theirs = pair_.node_b(pair_.Partner(link));
  if (theirs.parts.empty()) {
    offer(MakeWhole(Kind::kMissing, true), "", [](PrintedLink* made) { made->inertial.reset(); });
    return;
  }
  const auto is_from_shapes = [](const PrintedRobot& robot, const Node& of) {
    return std::ranges::any_of(of.parts, [&](int part) { return robot.link(part).is_from_shapes; });
  };
  constexpr const char* kFromShapes = "MuJoCo computed it from the shapes";
  const bool is_made = is_from_shapes(pair_.a(), node), is_made_b = is_from_shapes(pair_.b(), theirs);
  if (is_made && is_made_b) {
    const MassProperties& given = pair_.given(link).body;
    constexpr double kSame = 1e-6;
    const double factor = right.body.mass > 0.0 ? given.mass / right.body.mass : 0.0;
    const bool is_in_proportion = (given.com - right.body.com).norm() <= kSame &&
                                  given.inertia.isApprox(factor * right.body.inertia, kSame);
    std::string values = "inertia of the same mass and centre";
    if (is_in_proportion) {
      values = fmt::format("all of it {:.6g} times the other file's", factor);
    } else if (std::abs(factor - 1.0) > kSame) {
      values = "mass " + DescribeRight(given.mass, right.body.mass, " kg");
    } else if ((given.com - right.body.com).norm() > kSame) {
      values = "centre of mass " + DescribeRight(given.com, right.body.com, " m");
    }
    offer(MakeWhole(Kind::kShapes), std::move(values), GiveBody(right.body));
  } else if (is_made) {
    offer(MakeWhole(Kind::kMissing), kFromShapes, GiveBody(right.body));
  } else if (is_made_b) {
    offer(MakeWhole(Kind::kMissing, true), kFromShapes, GiveBody(right.body));
  }
  SearchLostParts(link);
  SearchLoad(link);
  for (const int k : node.parts) {
    if (const std::optional<Part> part = MakePart(link, k)) SearchPart(*part);
  }
  if (node.parts.size() > 1) {
    SearchAllParts(link);
    SearchTwoParts(link, begin);
  }
}

void CandidateSearch::SearchPart(const Part& part) {
  const PrintedLink& link = pair_.a().link(part.link);
  for (const LinkEdit& edit : ListInertialEdits(link, part.frames)) {
    if (!part.Concerns(edit.fault)) continue;
    EditTrial trial = part.Make(edit.fault, edit.bits);
    if (edit.fault.kind == Kind::kCompiled) trial.values = link.compiled->description;
    if (edit.fault.kind == Kind::kLinkAxes) trial.fault = MakeLostAxes(part.given, true);
    Try(trial, part.link, edit.undo);
  }
  const Vector3d& given = part.given.origin.t;
  const MassProperties right = part.right;
  if (part.IsWrong(SiteKind::kMass)) {
    EditTrial number = part.Make({Kind::kNumber, SiteKind::kMass}, CountBits(right.mass, part.open.mass),
                                 DescribeRight(part.given.mass.value, right.mass, " kg"));
    const auto take = [m = PrintedScalar{right.mass, part.open.mass}](PrintedLink* made) {
      made->inertial->mass = m;
    };
    Try(number, part.link, take);
    if (part.IsWrong(SiteKind::kInertia) && part.given.mass.value > 0.0) {  // a solid of another density
      constexpr double kOfBoth = 8.0;  // two units, of mass and inertia, are as likely
      number.bits += kOfBoth;
      number.kinds |= MaskOf(SiteKind::kInertia);
      number.values += ", with the inertia in proportion";
      Try(number, part.link, [take, f = right.mass / part.given.mass.value](PrintedLink* made) {
        take(made);
        made->inertial->I *= f;
      });
    }
  }
  if (part.IsWrong(SiteKind::kCom)) {
    const auto [bits, values] = CompareEntries(kAxisNames, given, right.com, part.open.com, " m");
    const auto take = [c = right.com, open = part.open.com](PrintedLink* made) {
      made->inertial->origin.t = c;
      made->inertial->origin.half_t = open;
    };
    Try(part.Make({Kind::kNumber, SiteKind::kCom}, bits, values), part.link, take);
    if (given.isZero()) Try(part.Make({Kind::kMissing, SiteKind::kCom}, 3.0, values), part.link, take);
  }
  if (part.IsWrong(SiteKind::kInertia)) SearchInertiaNumbers(part);
  if (!part.is_fused || part.link != part.node) return;
  constexpr double kTenNumbers = 90.0;
  EditTrial number = part.Make(
      MakeWhole(Kind::kNumber), kTenNumbers - part.extra,
      fmt::format("mass {}; centre of mass {}", DescribeRight(part.given.mass.value, right.mass, " kg"),
                  DescribeRight(given, right.com, " m")));
  Try(number, part.link, GiveBody(right));
}

void CandidateSearch::SearchInertiaNumbers(const Part& part) {
  const Matrix3d R = part.given.origin.CalcRotation();
  const Matrix3d I = ToTensor(part.given.I);
  const Matrix3d right = R.transpose() * part.right.inertia * R;
  const Vector6d given6 = part.given.I;
  const Vector6d right6 = ToEntries(right);
  const Vector6d open =
      ToEntries(R.isIdentity(1e-9) ? part.open.inertia
                                   : Matrix3d(R.transpose().cwiseAbs() * part.open.inertia * R.cwiseAbs()));
  const auto [bits_of_six, values] = CompareEntries(kInertiaNames, given6, right6, open, " kg m^2");
  const auto offer = [&](Kind kind, double bits, const std::string& shown, int component = 0,
                         bool in_second = false) {
    EditTrial trial = part.Make({kind, SiteKind::kInertia, component}, bits, shown);
    trial.fault.in_second = in_second;
    Try(trial, part.link, [right6, open](PrintedLink* made) {
      made->inertial->I = right6;
      made->inertial->half_I = open;
    });
  };
  offer(Kind::kNumber, bits_of_six, values);
  const auto solve = [](const Matrix3d& tensor) -> Vector3d {
    return Eigen::SelfAdjointEigenSolver<Matrix3d>(tensor).eigenvalues();
  };
  const bool same_moments = ((solve(I) - solve(right)).cwiseAbs().array() <= open.maxCoeff()).all();
  const auto is_same = [](const auto& x, const auto& y, const auto& within) {
    return ((x - y).cwiseAbs().array() <= within.array()).all();
  };
  const bool same_diagonal = is_same(given6.head<3>(), right6.head<3>(), open.head<3>());
  if (same_diagonal && is_same(right6.tail<3>(), Vector3d::Zero(), open.tail<3>()))
    offer(Kind::kNoProducts, 3.0, "", 0, true);
  if (given6.tail<3>().isZero()) {
    if (same_diagonal) offer(Kind::kNoProducts, 3.0, values);
    if (same_moments) offer(Kind::kNoAxes, 5.0, "");
  } else if (same_moments && R.isIdentity(1e-12)) {
    // Both files print six equal numbers and one turns their frame: the rotation was lost, or made up.
    const PrintedLink& other = pair_.b().link(pair_.Partner(part.node));
    const bool same_numbers =
        other.inertial && (other.inertial->I - given6).cwiseAbs().maxCoeff() <= open.maxCoeff();
    offer(Kind::kNoAxes, same_numbers ? 0.0 : 13.0, "", 1);
  }
  if (part.given.origin.form != RotationForm::kRollPitchYaw) return;
  for (int k = 0; k < 3; ++k) {
    for (const double angle : SolveOneAngle(part.given.origin, k, I, part.right.inertia, part.open.inertia)) {
      constexpr double kHalf = 1e-4;
      Try(part.Make({Kind::kFrame, SiteKind::kInertia, k},
                    1.0 + CountBits(std::abs(angle) > kHalf ? angle : 0.0, kHalf),
                    fmt::format("{} of the inertial frame {}", kAngleNames[k],
                                DescribeRight(part.given.origin.r[k], angle, " rad"))),
          part.link, [k, angle](PrintedLink* made) { made->inertial->origin.r[k] = angle; });
    }
  }
}

/// One convention of all parts of a body.
void CandidateSearch::SearchAllParts(int link) {
  std::vector<LinkEdits> lists;
  for (const int part : pair_.node(link).parts) lists.push_back({part, ListOwnEdits(pair_.a().link(part))});
  TryTogether(lists, link, kBodyMask, true);
}

/// A convention of one part, and a convention or a number of another part or of the same, where nothing
/// simpler explains the body. @param begin the first candidate of this body.
void CandidateSearch::SearchTwoParts(int link, size_t begin) {
  constexpr size_t kMostParts = 6;
  constexpr double kSimple = 30.0;
  const Node& node = pair_.node(link);
  const size_t wrong = ListBodySites(link).size();
  for (size_t k = begin; k < found_.size(); ++k) {
    if (found_[k].sites.size() == wrong && found_[k].bits < kSimple) return;
  }
  if (node.parts.size() > kMostParts) return;
  PrintedRobot& robot = *pair_.mutable_a();
  for (const int first : node.parts) {
    const PrintedLink before = robot.link(first);
    for (const LinkEdit& edit : ListOwnEdits(before)) {
      robot.link(first) = Carry(before, edit.undo);
      for (const int second : node.parts) {
        const std::optional<Part> part = MakePart(link, second);
        // With one kind of number wrong it is explained by fewer than ten.
        if (!part || part->wrong == 0 || (part->wrong & (part->wrong - 1)) != 0) continue;
        size_t k = found_.size();
        SearchPart(*part);
        const auto is_same = [&](const CorrectionCandidate& c) {
          return first == second && (c.fault.of == edit.fault.of || c.fault.whole || edit.fault.whole);
        };
        found_.erase(std::remove_if(found_.begin() + static_cast<std::ptrdiff_t>(k), found_.end(), is_same),
                     found_.end());
        for (; k < found_.size(); ++k) {
          found_[k].beside = {edit.fault, {first}, edit.bits + part->extra};
          if (first != second) found_[k].patches.push_back({first, robot.link(first)});
        }
      }
      robot.link(first) = before;
    }
  }
}

/// A body that is missing here, as a load is.
void CandidateSearch::SearchLoad(int link) {
  // The ten numbers: a mass and a centre that are wrong by themselves make no such body.
  constexpr double kBits = 60.0;
  const MassProperties& given = pair_.given(link).body;
  const std::optional<MassProperties> load = Subtract(pair_.right(link).body, given);
  const MassProperties& open = pair_.given(link).body_tolerance;
  if (!load || !IsWrong(link, SiteKind::kCom) || load->mass < 10.0 * open.mass) return;
  if (!FindPhysicalInconsistency({load->mass, load->com, 0.5 * (load->inertia + load->inertia.transpose())})
           .empty())
    return;
  Add({MakeWhole(Kind::kPartMissing), kBits, kBodyMask,
       fmt::format("of {:.6g} kg at ({})", load->mass, ShowVector(load->com))},
      link, ListBodySites(link));
}

/// Parts that one file alone has, without which it is what the other file has.
void CandidateSearch::SearchLostParts(int link) {
  const Node& theirs = pair_.node_b(pair_.Partner(link));
  const Node& ours = pair_.node(link);
  const GivenNode& given = pair_.given(link);
  const auto add = [&](const PrintedRobot& robot, int part, bool is_second, const MassProperties& body) {
    const GivenNode without = {given.X, given.pose, body, given.body_tolerance};
    for (const SiteKind kind : kBodyKinds) {
      if (!(pair_.CompareNode(kind, link, without) <= 1.0)) return;
    }
    Add({MakeWhole(Kind::kPartMissing, is_second), 3.0, kBodyMask, robot.link(part).name}, link,
        ListBodySites(link));
  };
  for (const int part : theirs.parts) {
    if (part == theirs.link || theirs.parts.size() < 2) continue;
    Node rest = theirs;
    std::erase(rest.parts, part);
    // The second file's body without the part, against this file's.
    const MassProperties body = ExpressIn(CalcNodeBody(pair_.b(), rest), pair_.X_ab(link));
    const MassProperties& right = pair_.right(link).body;
    add(pair_.b(), part, false,
        {right.mass + given.body.mass - body.mass, right.com + given.body.com - body.com,
         right.inertia + given.body.inertia - body.inertia});
  }
  for (const int part : ours.parts) {
    if (part == ours.link || ours.parts.size() < 2) continue;
    Node rest = ours;
    std::erase(rest.parts, part);
    add(pair_.a(), part, true, CalcNodeBody(pair_.a(), rest));
  }
}

}  // namespace dexcheck
