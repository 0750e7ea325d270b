#include "harness/corrections/edits.h"

#include <algorithm>
#include <cmath>

#include "controller/model/rigid_body.h"

namespace dexcheck {
namespace {

using Kind = CorrectionKind;
constexpr double kDegree = kPi / 180.0;
constexpr int kNumPermutations = 5;

Matrix3d MakeMirror(int axis) {
  Matrix3d mirror = Matrix3d::Identity();
  mirror(axis, axis) = -1.0;
  return mirror;
}

Matrix3d TurnMoving(const Vector3d& angles) {
  return TurnAbout(0, angles[0]) * TurnAbout(1, angles[1]) * TurnAbout(2, angles[2]);
}

/// An edit of an origin by itself, which may be a link's or an inertial's.
struct OriginEdit {
  Kind kind;
  int component;
  double bits;
  std::function<void(PrintedOrigin*)> undo;
};

/// Edits of a vector that is about any point.
template <typename Offer>
void ListVectorEdits(SiteKind kind, const Vector3d& given, const Offer& offer) {
  offer(Kind::kSign, 0, Matrix3d(-Matrix3d::Identity()));
  for (int k = 0; k < 3; ++k) {
    if (given[k] != 0.0) offer(Kind::kSignOf, k, MakeMirror(k));
  }
  for (int k = 0; k < kNumPermutations; ++k) offer(Kind::kPermutation, k, MakePermutation(kPermutations[k]));
  if (kind == SiteKind::kAxis) return;
  const std::span<const UnitFault> units = ListUnits(kind);
  for (size_t k = 0; k < units.size(); ++k)
    offer(Kind::kUnit, static_cast<int>(k), Matrix3d(units[k].factor * Matrix3d::Identity()));
}

std::vector<OriginEdit> ListTurns(const PrintedOrigin& origin) {
  std::vector<OriginEdit> edits;
  const Matrix3d given = origin.CalcRotation();
  if ((given - Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-12) return edits;
  // An edit of the angles, of one of them, or of the rotation.
  const auto angles = [&](Kind kind, double bits, int component, const Matrix3d& M) {
    edits.push_back({kind, component, bits, [M](PrintedOrigin* o) { o->r.head<3>() = M * o->r.head<3>(); }});
  };
  const auto turn = [&](Kind kind, double bits, int component, const auto& calc) {
    edits.push_back(
        {kind, component, bits, [calc](PrintedOrigin* o) { o->SetRotation(calc(o->CalcRotation())); }});
  };
  const bool has_angles = origin.form == RotationForm::kRollPitchYaw;
  const Matrix3d one = Matrix3d::Identity();
  if (has_angles || origin.form == RotationForm::kEuler) {
    angles(Kind::kDegrees, 0.0, 0, kDegree * one);
    angles(Kind::kRadians, 0.0, 0, one / kDegree);
    const bool several = (origin.r.head<3>().array().abs() > 1e-9).count() > 1;
    angles(Kind::kSign, 0.0, 0, -one);
    for (int k = 0; k < 3 && several; ++k) {
      angles(Kind::kAngleSign, 0.0, k, MakeMirror(k));
      Matrix3d degrees = one;
      degrees(k, k) = kDegree;
      angles(Kind::kAngleDegrees, 1.0, k, degrees);
    }
  }
  if (has_angles) {
    angles(Kind::kAnglesReversed, 0.0, 0, MakePermutation(kPermutations[1]));
    for (const int k : {0, 2, 3, 4}) angles(Kind::kAnglesPermuted, 1.0, k, MakePermutation(kPermutations[k]));
  }
  for (int k = 0; k < static_cast<int>(std::size(kSequences)) && origin.form == RotationForm::kEuler; ++k) {
    edits.push_back({Kind::kEulerSequence, k, 1.0,
                     [k](PrintedOrigin* o) { std::copy_n(kSequences[k], 3, o->sequence.begin()); }});
  }
  // A convention of angles beside a quaternion, and of quaternions beside angles, takes a detour.
  constexpr double kDetour = 2.0;
  const bool has_quaternion = origin.form == RotationForm::kQuaternion;
  const double of_angles = has_quaternion ? kDetour : 0.0;
  edits.push_back({Kind::kMovingAxes, 0, of_angles, [](PrintedOrigin* o) {
                     const bool is_printed = o->form == RotationForm::kRollPitchYaw;
                     const Vector3d rpy =
                         is_printed ? Vector3d(o->r.head<3>()) : SolveRollPitchYaw(o->CalcRotation())[0];
                     o->SetRotation(TurnMoving(rpy));
                   }});
  turn(Kind::kFixedAxes, of_angles, 0,
       [](const Matrix3d& R) { return TurnRollPitchYaw(-SolveRollPitchYaw(R.transpose())[0]); });
  turn(Kind::kTransposed, 0.0, 0, [](const Matrix3d& R) { return Matrix3d(R.transpose()); });
  for (const bool first : {true, false}) {
    edits.push_back({first ? Kind::kScalarFirst : Kind::kScalarLast, 0, has_quaternion ? 0.0 : kDetour,
                     [first](PrintedOrigin* o) {
                       const bool is_printed = o->form == RotationForm::kQuaternion;
                       const Vector4d q = is_printed ? o->r : ToQuaternion(o->CalcRotation());
                       o->SetRotation(TurnQuaternion(first ? Vector4d(q[3], q[0], q[1], q[2])
                                                           : Vector4d(q[1], q[2], q[3], q[0])));
                     }});
  }
  for (int k = 0; k < 3; ++k) {
    turn(Kind::kMirror, 0.0, k, [M = MakeMirror(k)](const Matrix3d& R) { return Matrix3d(M * R * M); });
  }
  for (int k = 0; k < 9; ++k) {
    constexpr double kQuarters[] = {-1.0, 2.0, 1.0};
    const Matrix3d back = TurnAbout(k / 3, -kQuarters[k % 3] * kPi / 2.0);
    turn(Kind::kTurnOwn, 3.0, k, [back](const Matrix3d& R) { return Matrix3d(R * back); });
    turn(Kind::kTurnParent, 3.5, k, [back](const Matrix3d& R) { return Matrix3d(back * R); });
  }
  return edits;
}

/// Lists conventions of a row of modified Denavit-Hartenberg parameters: of its two angles, and of each
/// number.
std::vector<LinkEdit> ListRowEdits(const PrintedOrigin& origin) {
  std::vector<LinkEdit> edits;
  for (const bool twice : {false, true}) {
    edits.push_back({{twice ? Kind::kRadians : Kind::kDegrees, SiteKind::kRotation},
                     0.0,
                     [f = twice ? 1.0 / kDegree : kDegree](PrintedLink* link) { link->origin.r *= f; }});
  }
  const auto number = [](PrintedOrigin* o, int k) {
    return k % 2 == 0 ? &o->r[k / 2] : &o->t[k == 1 ? 0 : 2];
  };
  PrintedOrigin row = origin;
  for (int k = 0; k < 4; ++k) {
    if (*number(&row, k) == 0.0) continue;
    const auto scale = [&](Kind kind, int component, double bits, double factor) {
      edits.push_back({{.kind = kind, .of = SiteKind::kPosition, .component = component, .whole = true},
                       bits,
                       [=](PrintedLink* link) { *number(&link->origin, k) *= factor; }});
    };
    scale(Kind::kSignOf, k, 0.0, -1.0);
    if (k % 2 != 0) scale(Kind::kUnit, 0, 1.0, 1e-3);
    // The only angle of a row is its rotation.
    const double bits = row.r[0] != 0.0 && row.r[1] != 0.0 ? 1.0 : 4.5;
    if (k % 2 == 0) scale(Kind::kDegrees, 0, bits, kDegree);
    if (k % 2 == 0) scale(Kind::kRadians, 0, bits, 1.0 / kDegree);
  }
  return edits;
}

Pose MakeTurn(const Matrix3d& R) {
  Pose X = Pose::Identity();
  X.linear() = R;
  return X;
}

/// Collects the edits of one inertial.
class InertialEdits {
 public:
  InertialEdits(const PrintedLink& link, const EditFrames& frames)
      : given_(*link.inertial), frames_(frames), R_(given_.origin.CalcRotation()) {
    if (link.compiled)
      Add({.kind = Kind::kCompiled, .of = SiteKind::kMass, .whole = true}, 0.0,
          [stated = link.compiled->stated](Body* body) { *body = stated; });
  }

  std::vector<LinkEdit> Run() {
    ListMasses();
    ListCentres();
    ListFrames();
    ListTensors();
    ListEntries();
    return std::move(edits_);
  }

 private:
  using Body = PrintedInertial;

  template <typename Change>
  void Add(const FileFault& fault, double bits, const Change& change) {
    edits_.push_back({fault, bits, [change](PrintedLink* link) { change(&*link->inertial); }});
  }

  void ListMasses() {
    const std::span<const UnitFault> units = ListUnits(SiteKind::kMass);
    for (size_t k = 0; k < units.size(); ++k) {
      Add({Kind::kUnit, SiteKind::kMass, static_cast<int>(k)}, 0.0,
          [f = units[k].factor](Body* body) { body->mass.value *= f; });
    }
  }

  void ListCentres() {
    ListVectorEdits(SiteKind::kCom, given_.origin.t, [&](Kind kind, int component, const Matrix3d& M) {
      Add({kind, SiteKind::kCom, component}, 0.0,
          [M](Body* body) { body->origin.t = (M * body->origin.t).eval(); });
    });
    const auto move = [&](Kind kind, double bits, const Pose& X) {
      Add({kind, SiteKind::kCom}, bits, [X](Body* body) { body->origin.t = X * body->origin.t; });
    };
    for (const Pose& X : frames_.X_PL) {
      move(Kind::kInParent, 1.0, X.inverse());
      move(Kind::kToParent, 1.0, X);
      if (X.linear().isIdentity(1e-9)) continue;
      const Pose shift(Eigen::Translation3d(X.translation()));
      move(Kind::kAlongParent, 1.0, MakeTurn(X.linear().transpose()));
      move(Kind::kAlongToParent, 1.0, MakeTurn(X.linear()));
      move(Kind::kPlaceAdded, 1.0, shift.inverse());
      move(Kind::kPlaceTaken, 1.0, shift);
    }
    for (const Pose& X_LC : frames_.X_LC) move(Kind::kInChild, 2.0, X_LC);
    if (R_.isIdentity(1e-9)) return;
    for (const bool to : {false, true}) {
      Add({to ? Kind::kToInertialAxes : Kind::kInertialAxes, SiteKind::kCom}, 2.0, [to](Body* body) {
        const Matrix3d R = body->origin.CalcRotation();
        body->origin.t = ((to ? Matrix3d(R.transpose()) : R) * body->origin.t).eval();
      });
    }
  }

  /// The centre of mass and the inertia at once.
  void ListFrames() {
    const auto move = [&](Kind kind, int component, double bits, const Pose& X) {
      Add({.kind = kind, .of = SiteKind::kCom, .component = component, .whole = true}, bits, [X](Body* body) {
        const Matrix3d R = body->origin.CalcRotation();
        const Matrix3d Q = R.transpose() * X.linear() * R;
        body->I = ToEntries(Q * ToTensor(body->I) * Q.transpose());
        body->origin.t = X * body->origin.t;
      });
    };
    for (int k = 0; k < 3; ++k) move(Kind::kMirror, k, 0.0, MakeTurn(MakeMirror(k)));
    for (const Pose& X : frames_.X_PL) {
      move(Kind::kInParent, 0, 1.0, X.inverse());
      move(Kind::kAlongParent, 0, 1.0, MakeTurn(X.linear().transpose()));
    }
  }

  /// An edit of the tensor along the link's axes.
  template <typename Calc>
  void AddTensor(Kind kind, int component, double bits, const Calc& calc) {
    Add({kind, SiteKind::kInertia, component}, bits, [calc](Body* body) {
      const Matrix3d R = body->origin.CalcRotation();
      const Matrix3d I = R * ToTensor(body->I) * R.transpose();
      body->I = ToEntries(R.transpose() * calc(*body, I) * R);
    });
  }

  void ListTensors() {
    // The mass and centre as given, and as right.
    for (const bool as_right : {false, true}) {
      if (as_right && !frames_.right) continue;
      const auto shift = [&](Kind kind, double bits, double sign, const Pose& X) {
        const std::pair<double, Vector3d> right = frames_.right.value_or(std::pair(0.0, Vector3d::Zero()));
        AddTensor(kind, 0, bits, [=](const Body& body, const Matrix3d& I) {
          const double mass = as_right ? right.first : body.mass.value;
          const Matrix3d moved = CalcPointInertia(mass, X * (as_right ? right.second : body.origin.t));
          return Matrix3d(I + sign * (X.linear().transpose() * moved * X.linear()));
        });
      };
      shift(Kind::kAboutOrigin, 0.0, -1.0, Pose::Identity());
      // Numbers that a body can have are more often right, and the other file's about the origin.
      constexpr double kPossible = 6.0;
      const bool is_possible = FindPhysicalInconsistency({given_.mass.value, given_.origin.t,
                                                          R_ * ToTensor(given_.I) * R_.transpose()})
                                   .empty();
      shift(Kind::kMovedTwice, is_possible ? kPossible : 0.0, 1.0, Pose::Identity());
      for (const Pose& X : frames_.X_PL) shift(Kind::kAboutParent, 1.0, -1.0, X);
    }
    const auto turn = [&](Kind kind, int component, double bits, const Matrix3d& M) {
      AddTensor(kind, component, bits,
                [M](const Body&, const Matrix3d& I) { return Matrix3d(M * I * M.transpose()); });
    };
    for (const Pose& X : frames_.X_PL) {
      if (X.linear().isIdentity(1e-9)) continue;
      turn(Kind::kAlongParent, 0, 0.0, X.linear().transpose());
      turn(Kind::kAlongToParent, 0, 1.0, X.linear());
    }
    for (int k = 0; k < 3; ++k) turn(Kind::kMirror, k, 1.0, MakeMirror(k));
    if (R_.isIdentity(1e-9)) return;
    AddTensor(Kind::kLinkAxes, 0, 0.0, [](const Body& body, const Matrix3d&) { return ToTensor(body.I); });
    AddTensor(Kind::kAboutOriginAxes, 0, 1.0, [](const Body& body, const Matrix3d& I) {
      const Matrix3d R = body.origin.CalcRotation();
      const Matrix3d offset = CalcPointInertia(body.mass.value, R.transpose() * body.origin.t);
      return Matrix3d(I - R * offset * R.transpose());
    });
    for (const OriginEdit& edit : ListTurns(given_.origin)) {
      if (edit.kind == Kind::kTurnParent || edit.kind == Kind::kMirror) continue;
      Add({Kind::kFrame, SiteKind::kInertia, edit.component, edit.kind}, edit.bits + 1.0,
          [undo = edit.undo](Body* body) { undo(&body->origin); });
    }
  }

  /// Edits of the six numbers as printed.
  void ListEntries() {
    const auto entries = [&](Kind kind, int component, double bits, const auto& calc) {
      Add({kind, SiteKind::kInertia, component}, bits, [calc](Body* body) { body->I = calc(body->I); });
    };
    const auto scale = [&](Kind kind, int component, double bits, const Vector6d& factors) {
      entries(kind, component, bits, [factors](const Vector6d& I) { return I.cwiseProduct(factors).eval(); });
    };
    Vector6d signs = Vector6d::Ones();
    signs.tail<3>().setConstant(-1.0);
    scale(Kind::kProductSigns, 0, 0.0, signs);
    for (int k = 0; k < 3; ++k) {
      signs.setOnes();
      signs[3 + k] = -1.0;
      scale(Kind::kProductSign, k, 1.0, signs);
    }
    for (int k = 0; k < kNumPermutations; ++k) {
      const Matrix3d P = MakePermutation(kPermutations[k]);
      entries(Kind::kPermutation, k, 0.0,
              [P](const Vector6d& I) { return ToEntries(P * ToTensor(I) * P.transpose()); });
      entries(Kind::kMoments, k, 1.0, [P](Vector6d I) {
        I.head<3>() = (P * I.head<3>()).eval();
        return I;
      });
      for (const bool inverse : {false, true}) {
        entries(inverse ? Kind::kSixOrderInverse : Kind::kSixOrder, k, 1.0, [k, inverse](const Vector6d& I) {
          Vector6d ordered;
          for (int i = 0; i < 6; ++i) {
            const int to = kSixOrders[k][i];
            ordered[inverse ? to : i] = I[inverse ? i : to];
          }
          return ordered;
        });
      }
    }
    const std::span<const UnitFault> units = ListUnits(SiteKind::kInertia);
    for (size_t k = 0; k < units.size(); ++k)
      scale(Kind::kUnit, static_cast<int>(k), 0.0, Vector6d::Constant(units[k].factor));
    if (frames_.right && given_.mass.value > 0.0)
      scale(Kind::kWithMass, 0, 0.0, Vector6d::Constant(frames_.right->first / given_.mass.value));
  }

  const PrintedInertial& given_;
  const EditFrames& frames_;
  Matrix3d R_;
  std::vector<LinkEdit> edits_;
};

}  // namespace

Matrix3d MakePermutation(const int (&p)[3]) {
  Matrix3d P = Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) P(p[k], k) = 1.0;
  return P;
}

std::vector<LinkEdit> ListRotationEdits(const PrintedOrigin& origin) {
  std::vector<LinkEdit> edits;
  for (const OriginEdit& edit : ListTurns(origin)) {
    edits.push_back({{edit.kind, SiteKind::kRotation, edit.component},
                     edit.bits,
                     [undo = edit.undo](PrintedLink* link) { undo(&link->origin); }});
  }
  return edits;
}

std::vector<LinkEdit> ListOriginEdits(const PrintedOrigin& origin, const EditFrames& frames) {
  if (origin.form == RotationForm::kMdh) return ListRowEdits(origin);
  std::vector<LinkEdit> edits = ListRotationEdits(origin);
  const auto add = [&](Kind kind, int component, double bits, bool whole, const auto& change) {
    edits.push_back({{.kind = kind, .of = SiteKind::kPosition, .component = component, .whole = whole},
                     bits,
                     [change](PrintedLink* link) { change(&link->origin); }});
  };
  const auto turn = [&](Kind kind, int component, double bits, const Matrix3d& M) {
    add(kind, component, bits, false, [M](PrintedOrigin* o) { o->t = (M * o->t).eval(); });
  };
  ListVectorEdits(SiteKind::kPosition, origin.t,
                  [&](Kind kind, int component, const Matrix3d& M) { turn(kind, component, 0.0, M); });
  for (const Pose& X : frames.X_PL) {
    const Matrix3d R = X.linear();
    if (R.isIdentity(1e-9)) continue;
    turn(Kind::kAlongLink, 0, 1.0, R);
    turn(Kind::kAlongToParent, 0, 1.0, R.transpose());
    turn(Kind::kInverse, 0, 2.0, -R.transpose());
  }
  add(Kind::kInverse, 0, 0.0, true, [](PrintedOrigin* o) {
    const Pose X = o->CalcPose().inverse();
    o->SetRotation(X.linear());
    o->t = X.translation();
  });
  for (int k = 0; k < 3; ++k) {
    add(Kind::kMirror, k, 0.0, true, [M = MakeMirror(k)](PrintedOrigin* o) {
      o->SetRotation(M * o->CalcRotation() * M);
      o->t = (M * o->t).eval();
    });
  }
  return edits;
}

std::vector<LinkEdit> ListInertialEdits(const PrintedLink& link, const EditFrames& frames) {
  return InertialEdits(link, frames).Run();
}

std::vector<std::pair<FileFault, Vector3d>> ListAxisEdits(const Vector3d& axis) {
  std::vector<std::pair<FileFault, Vector3d>> edits;
  ListVectorEdits(SiteKind::kAxis, axis, [&](Kind kind, int component, const Matrix3d& M) {
    if (kind != Kind::kSignOf)
      edits.emplace_back(FileFault{kind, SiteKind::kAxis, component}, Vector3d(M * axis));
  });
  return edits;
}

PrintedLink Carry(const PrintedLink& link, const LinkUndo& undo) {
  const auto list = [](PrintedLink* of) {
    std::vector<LinkNumber> numbers = ListNumbers(&of->origin);
    if (!of->inertial) return numbers;
    Append(ListNumbers(&*of->inertial), &numbers);
    return numbers;
  };
  PrintedLink before = link;
  PrintedLink after = link;
  undo(&after);
  const std::vector<LinkNumber> carried = list(&after);
  std::vector<double> halves(carried.size(), 0.0);
  MoveHalves(list(&before), [&] {
    PrintedLink moved = before;
    undo(&moved);
    const std::vector<LinkNumber> there = list(&moved);
    // Numbers of one rotation may be others altogether: its angle bounds them.
    const auto turn = [](const PrintedOrigin& a, const PrintedOrigin& b) {
      return CalcAngle(a.CalcRotation().transpose() * b.CalcRotation());
    };
    const double angles[] = {
        turn(after.origin, moved.origin),
        after.inertial && moved.inertial ? turn(after.inertial->origin, moved.inertial->origin) : 0.0};
    for (size_t k = 0; k < std::min(there.size(), carried.size()); ++k) {
      const double apart = std::abs(*there[k].value - *carried[k].value);
      const bool turns = k % 7 >= 3 && k < 14;
      halves[k] += turns ? std::min(apart, angles[k / 7]) : apart;
    }
  });
  // A number that depends on none of before has the digits that the edit gave it.
  for (size_t k = 0; k < carried.size(); ++k) {
    if (halves[k] > 0.0) *carried[k].half = halves[k];
  }
  return after;
}

}  // namespace dexcheck
