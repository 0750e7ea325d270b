#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "controller/model/rigid_body.h"
#include "harness/corrections/body_part.h"
#include "harness/corrections/origin_fixes.h"

namespace dexcheck {
namespace {

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

void CandidateSearch::SearchInertia(const Part& part) {
  SearchInertiaConventions(part);
  SearchInertiaNumbers(part);
}

void CandidateSearch::SearchInertiaConventions(const Part& part) {
  const SiteMask mask = part.Mask(MaskOf(SiteKind::kInertia));
  const auto trial = [&](CorrectionKind kind, int component, double bits) {
    return EditTrial{{kind, SiteKind::kInertia, component}, part.extra + bits, mask};
  };
  // An edit of the tensor along the link's axes.
  const auto change = [&](const EditTrial& made, const auto& calc) {
    return Try(made, part.link, [&](const PrintedLink& before, PrintedLink* after) {
      const PrintedInertial& body = *before.inertial;
      const Matrix3d R = body.origin.CalcRotation();
      after->inertial->I =
          ToEntries(R.transpose() * calc(body, R, Matrix3d(R * ToTensor(body.I) * R.transpose())) * R);
    });
  };
  const auto entries = [&](const EditTrial& made, const auto& calc) {
    Try(made, part.link, [&](const PrintedLink& before, PrintedLink* after) {
      after->inertial->I = calc(before.inertial->I);
    });
  };
  using Body = PrintedInertial;
  // The centre and mass as given, and as right: faults of one link must not hide each other.
  for (const bool as_right : {false, true}) {
    if (as_right && !part.com_wrong && !part.mass_wrong) continue;
    const auto point = [&](const Body& body, const Pose& X) {
      const Vector3d c = as_right ? part.right.com : body.origin.t;
      return CalcPointInertia(as_right ? part.right.mass : body.mass.value, X * c);
    };
    const Pose none = Pose::Identity();
    change(trial(CorrectionKind::kAboutOrigin, 0, 0.0),
           [&](const Body& body, const Matrix3d&, const Matrix3d& I) {
             return Matrix3d(I - point(body, none));
           });
    change(trial(CorrectionKind::kMovedTwice, 0, 0.0),
           [&](const Body& body, const Matrix3d&, const Matrix3d& I) {
             return Matrix3d(I + point(body, none));
           });
    for (const Pose& X : part.origins) {
      change(trial(CorrectionKind::kAboutParent, 0, 1.0),
             [&](const Body& body, const Matrix3d&, const Matrix3d& I) {
               return Matrix3d(I - X.linear().transpose() * point(body, X) * X.linear());
             });
    }
  }
  for (const Pose& X : part.origins) {
    const Matrix3d R_PL = X.linear();
    if (R_PL.isIdentity(1e-9)) continue;
    change(trial(CorrectionKind::kAlongParent, 0, 0.0), [&](const Body&, const Matrix3d&, const Matrix3d& I) {
      return Matrix3d(R_PL.transpose() * I * R_PL);
    });
    change(trial(CorrectionKind::kAlongToParent, 0, 1.0),
           [&](const Body&, const Matrix3d&, const Matrix3d& I) {
             return Matrix3d(R_PL * I * R_PL.transpose());
           });
  }
  entries(trial(CorrectionKind::kProductSigns, 0, 0.0), [](Vector6d I) {
    I.tail<3>() *= -1.0;
    return I;
  });
  for (int k = 0; k < 3; ++k) {
    entries(trial(CorrectionKind::kProductSign, k, 1.0), [k](Vector6d I) {
      I[3 + k] *= -1.0;
      return I;
    });
    change(trial(CorrectionKind::kMirror, k, 1.0), [k](const Body&, const Matrix3d&, const Matrix3d& I) {
      return Matrix3d(MakeMirror(k) * I * MakeMirror(k));
    });
  }
  for (int k = 0; k < 5; ++k) {
    const Matrix3d P = MakePermutation(kPermutations[k]);
    entries(trial(CorrectionKind::kPermutation, k, 0.0),
            [&](const Vector6d& I) { return ToEntries(P * ToTensor(I) * P.transpose()); });
    entries(trial(CorrectionKind::kMoments, k, 1.0), [&](Vector6d I) {
      I.head<3>() = (P * I.head<3>()).eval();
      return I;
    });
    entries(trial(CorrectionKind::kSixOrder, k, 1.0), [&](const Vector6d& I) {
      Vector6d ordered;
      for (int i = 0; i < 6; ++i) ordered[i] = I[kSixOrders[k][i]];
      return ordered;
    });
    entries(trial(CorrectionKind::kSixOrderInverse, k, 1.0), [&](const Vector6d& I) {
      Vector6d ordered;
      for (int i = 0; i < 6; ++i) ordered[kSixOrders[k][i]] = I[i];
      return ordered;
    });
  }
  const std::span<const UnitFault> units = ListUnits(SiteKind::kInertia);
  for (size_t k = 0; k < units.size(); ++k)
    entries(trial(CorrectionKind::kUnit, static_cast<int>(k), 0.0),
            [&](const Vector6d& I) { return Vector6d(units[k].factor * I); });
  if (part.given.mass.value > 0.0 && part.mass_wrong)
    entries(trial(CorrectionKind::kWithMass, 0, 0.0),
            [&](const Vector6d& I) { return Vector6d(part.right.mass / part.given.mass.value * I); });
  if (part.CalcAxes().isIdentity(1e-9)) return;
  change(trial(CorrectionKind::kLinkAxes, 0, 0.0),
         [](const Body& body, const Matrix3d&, const Matrix3d&) { return ToTensor(body.I); });
  change(trial(CorrectionKind::kAboutOriginAxes, 0, 1.0),
         [](const Body& body, const Matrix3d& R, const Matrix3d&) {
           return Matrix3d(
               R * (ToTensor(body.I) - CalcPointInertia(body.mass.value, R.transpose() * body.origin.t)) *
               R.transpose());
         });
  for (const OriginFix& fix : ListRotationFixes(part.given.origin)) {
    if (fix.kind == CorrectionKind::kTurnParent || fix.kind == CorrectionKind::kMirror) continue;
    EditTrial made = trial(CorrectionKind::kFrame, fix.component, fix.bits + 1.0);
    made.fault.rotation = fix.kind;
    Try(made, part.link, [&](const PrintedLink& before, PrintedLink* after) {
      FixRotation(fix, before.inertial->origin, &after->inertial->origin);
    });
  }
}

void CandidateSearch::SearchInertiaNumbers(const Part& part) {
  const SiteMask mask = part.Mask(MaskOf(SiteKind::kInertia));
  const Matrix3d R = part.CalcAxes();
  const Matrix3d I = ToTensor(part.given.I);
  const Matrix3d right = R.transpose() * part.right.inertia * R;
  const Vector6d given6 = part.given.I;
  const Vector6d right6 = ToEntries(right);
  const Vector6d open =
      ToEntries(R.isIdentity(1e-9) ? part.open.inertia
                                   : Matrix3d(R.transpose().cwiseAbs() * part.open.inertia * R.cwiseAbs()));
  const auto trial = [&](CorrectionKind kind, double bits) {
    return EditTrial{{kind, SiteKind::kInertia}, part.extra + bits, mask};
  };
  const auto take = [&](const PrintedLink&, PrintedLink* after) { after->inertial->I = right6; };
  EditTrial number =
      trial(CorrectionKind::kNumber, CountEntries(6, given6.data(), right6.data(), open.data()));
  number.values = DescribeEntries(kInertiaNames, given6.data(), right6.data(), open.data());
  Try(number, part.link, take);
  const Vector3d principal = Eigen::SelfAdjointEigenSolver<Matrix3d>(right).eigenvalues();
  const auto is_near = [&](const Vector3d& moments, const Vector3d& others) {
    return ((moments - others).cwiseAbs().array() <= open.maxCoeff()).all();
  };
  if (given6.tail<3>().isZero()) {
    if (((given6 - right6).head<3>().cwiseAbs().array() <= open.head<3>().array()).all()) {
      EditTrial lost = trial(CorrectionKind::kNoProducts, 3.0);
      lost.values = number.values;
      Try(lost, part.link, take);
    }
    Vector3d moments = given6.head<3>();
    std::ranges::sort(moments);
    if (R.isIdentity(1e-12) && is_near(moments, principal))
      Try(trial(CorrectionKind::kNoAxes, 5.0), part.link, take);
  } else if (R.isIdentity(1e-12) &&
             is_near(Eigen::SelfAdjointEigenSolver<Matrix3d>(I).eigenvalues(), principal)) {
    // The same six numbers, of which one file turns the frame: it was lost, or made up.
    const PrintedLink& other = pair_.b().link(pair_.Partner(part.node));
    const bool same_numbers =
        other.inertial && (other.inertial->I - given6).cwiseAbs().maxCoeff() <= open.maxCoeff();
    Try(trial(CorrectionKind::kNoAxes, same_numbers ? 0.0 : 13.0), part.link, take);
  }
  if (part.given.origin.form != RotationForm::kRollPitchYaw) return;
  for (int k = 0; k < 3; ++k) {
    for (const double angle : SolveOneAngle(part.given.origin, k, I, part.right.inertia, part.open.inertia)) {
      constexpr double kHalf = 1e-4;
      EditTrial one =
          trial(CorrectionKind::kFrame, 1.0 + CountBits(std::abs(angle) > kHalf ? angle : 0.0, kHalf));
      one.fault.component = k;
      one.values = fmt::format("{} of the inertial frame {:.6g}, {:.6g} would be right", kAngleNames[k],
                               part.given.origin.r[k], angle);
      Try(one, part.link,
          [&](const PrintedLink&, PrintedLink* after) { after->inertial->origin.r[k] = angle; });
    }
  }
}

}  // namespace dexcheck
