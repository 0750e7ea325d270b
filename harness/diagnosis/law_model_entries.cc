// Faults of the numbers that a law of joints computes its terms of the model by.

#include <memory>
#include <utility>

#include "controller/dynamics/torque_regressor.h"
#include "controller/model/rigid_body.h"
#include "harness/diagnosis/law_entry_list.h"
#include "harness/diagnosis/parameters.h"

namespace dexcheck {
namespace {

using BodyVector = TorqueRegressor::BodyVector;

/// The terms that go by the wrong model: all, or one that is computed by itself.
struct WrongTerms {
  const char* name;
  bool mass, coriolis, gravity;
};
constexpr WrongTerms kWrongTerms[] = {{"law's model", true, true, true},
                                      {"law's gravity", false, false, true},
                                      {"law's M_bar'", true, false, false},
                                      {"law's Coriolis forces", false, true, false}};

/// Moves a regressor so that its torques are these terms of the law.
void Move(const WrongTerms& terms, const LawAtStep& at, TorqueRegressor* regressor) {
  const LawStep& now = at.inputs.now;
  const VectorXd rest = VectorXd::Zero(now.xi.size());
  BaseMotion base;
  if (!terms.gravity) base.a = regressor->model().gravity();
  regressor->SetMotion(now.q, terms.coriolis ? now.xi : rest, terms.mass ? at.demand() : rest, base);
}

Matrix3d CalcTurn(const Vector3d& turn) {
  return turn.norm() == 0.0 ? Matrix3d::Identity()
                            : Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
}

// Faults of a joint's place: sizes are a vector in the axes of the row's start, or of frame i.

void MovePlace(int joint, const VectorXd& by, RobotSpec* spec) {
  spec->joints[static_cast<size_t>(joint)].X_PB.pretranslate(by.head<3>());
}
void Turn(int joint, const VectorXd& by, RobotSpec* spec) {
  spec->joints[static_cast<size_t>(joint)].X_PB.rotate(CalcTurn(by.head<3>()));
}
/// Turns the axis alone: the link stands where it did with the joint at zero.
void TurnAxis(int joint, const VectorXd& by, RobotSpec* spec) {
  Joint& one = spec->joints[static_cast<size_t>(joint)];
  Pose tilt = Pose::Identity();
  tilt.linear() = CalcTurn({by[0], by[1], 0.0});
  one.X_PB = one.X_PB * CalcMdhTransform(one.mdh.alpha, one.mdh.a, one.mdh.q, one.mdh.d) * tilt;
  one.mdh = {};
  one.body = ExpressIn(one.body, tilt.inverse(Eigen::Isometry));
  for (Joint& child : spec->joints)
    if (child.parent == joint) child.X_PB = tilt.inverse(Eigen::Isometry) * child.X_PB;
}

struct PlaceKind {
  const char* fault;
  const char* unit;
  void (*change)(int joint, const VectorXd& by, RobotSpec* spec);
  int sizes, turns;  // numbers, and of these such as may be quarters of a turn
  double plausible;
};
constexpr double kMostTurned = 1.01 * kPi;  // about each axis, rad
constexpr PlaceKind kPlaceKinds[] = {{"place off by", "m", MovePlace, 3, 0, 10.0},
                                     {"turned by", "rad", Turn, 3, 3, kMostTurned},
                                     {"axis turned by", "rad", TurnAxis, 2, 2, kMostTurned}};

/// A model of which something is changed by sizes that the search tries one after another.
class ChangedModel {
 public:
  using Change = std::function<void(const VectorXd& sizes, RobotSpec* spec)>;
  ChangedModel(const RobotModel& model, Change change)
      : right_(model), model_(model), change_(std::move(change)) {}

  VectorXd CalcChange(const WrongTerms& terms, const LawAtStep& at, const VectorXd& sizes) {
    if (!wrong_ || sizes != sizes_) {
      RobotSpec spec = model_.spec();
      change_(sizes, &spec);
      wrong_.reset();
      changed_ = TryModel(spec);
      sizes_ = sizes;
      if (changed_) wrong_.emplace(*changed_);
    }
    VectorXd torques = VectorXd::Zero(at.force.size()), right = torques;
    if (!wrong_) return torques;
    for (const auto& [regressor, to] : {std::pair{&right_, &right}, std::pair{&*wrong_, &torques}}) {
      Move(terms, at, regressor);
      regressor->CalcTorques(*to);
    }
    return torques - right;
  }

 private:
  TorqueRegressor right_;
  const RobotModel& model_;
  Change change_;
  VectorXd sizes_;
  std::optional<RobotModel> changed_;
  std::optional<TorqueRegressor> wrong_;
};

}  // namespace

void LawEntryList::AddModelFaults() {
  if (model_.base().type != BaseType::kFixed || model_.num_positions() != n_) return;
  const auto regressor = std::make_shared<TorqueRegressor>(model_);
  for (const WrongTerms& terms : kWrongTerms) {
    // Other laws have no Coriolis forces, or not at the measured velocity.
    if (terms.coriolis && !law_.demands_acceleration()) continue;
    const std::string of = std::string(" of the ") + terms.name;
    for (int link = 0; link < model_.num_joints(); ++link)
      AddInertialFaults("link " + model_.joint(link).link + of, link, [=](const LawAtStep& at) {
        Move(terms, at, regressor.get());
        MatrixXd own(at.force.size(), TorqueRegressor::kBody);
        regressor->CalcBodyColumns(link, own);
        return own;
      });
    for (int joint = 0; joint < model_.num_joints(); ++joint) {
      for (const PlaceKind& kind : kPlaceKinds) {
        LawEntry& entry = Add(kind.fault, nullptr);
        entry.place = "joint " + model_.joint(joint).name + of;
        entry.unit = kind.unit;
        entry.is_vector = true;
        entry.plausible = kind.plausible;
        entry.starts.emplace_back(VectorXd::Zero(kind.sizes));
        for (int axis = 0; axis < (terms.gravity ? kind.turns : 0); ++axis)
          for (const double quarters : {1.0, -1.0, 2.0})
            entry.starts.emplace_back(0.5 * kPi * quarters * VectorXd::Unit(kind.sizes, axis));
        const auto changed = std::make_shared<ChangedModel>(
            model_, [kind, joint](const VectorXd& by, RobotSpec* spec) { kind.change(joint, by, spec); });
        entry.change = [terms, changed](const LawAtStep& at, const VectorXd& sizes) {
          return changed->CalcChange(terms, at, sizes);
        };
      }
    }
  }
  AddGravityVector();
  AddArmatureFaults();
  AddJointOrder();
}

void LawEntryList::AddGravityVector() {
  const auto regressor = std::make_shared<TorqueRegressor>(model_);
  LawEntry& gravity = Add("gravity vector off by", [regressor](const LawAtStep& at) -> MatrixXd {
    Move(kWrongTerms[0], at, regressor.get());
    MatrixXd columns(at.force.size(), 3);
    regressor->CalcGravityColumns(columns);
    return columns;
  });
  gravity.place = kWrongTerms[0].name;
  gravity.unit = "m/s^2";
  gravity.is_vector = true;
}

void LawEntryList::AddInertialFaults(const std::string& place, int link, const Columns& columns) {
  const MassProperties body = model_.joint(link).body;
  const auto add = [&](const char* fault, const char* unit) -> LawEntry& {
    LawEntry& entry = Add(fault, nullptr);
    entry.place = place;
    entry.unit = unit;
    constexpr double kHeavy = 100.0;  // kg, and kg m^2
    entry.plausible = kHeavy;
    return entry;
  };
  MassProperties heavier = body;
  heavier.mass += 1.0;
  const BodyVector right = TorqueRegressor::Pack(body), one = TorqueRegressor::Pack(heavier) - right;
  LawEntry& mass = add("mass", "kg");
  mass.nominal = body.mass;
  mass.force = [columns, one](const LawAtStep& at) -> MatrixXd { return columns(at) * one; };
  LawEntry& center = add("centre of mass off by", "m");
  center.is_vector = true;
  center.starts = {VectorXd::Zero(3)};
  center.change = [columns, body, right](const LawAtStep& at, const VectorXd& by) {
    MassProperties moved = body;
    moved.com += by.head<3>();
    const BodyVector change = TorqueRegressor::Pack(moved) - right;
    return VectorXd(columns(at) * change);
  };
  LawEntry& inertia = add("inertia off by", "kg m^2");
  inertia.is_vector = true;
  inertia.force = [columns](const LawAtStep& at) -> MatrixXd { return columns(at).rightCols<6>(); };
  add("inertial (ten numbers)", "").force = columns;
}

void LawEntryList::AddArmatureFaults() {
  Add("armatures", [](const LawAtStep& at) -> MatrixXd {
    return at.demand().asDiagonal().toDenseMatrix();
  }).place = "law's model";
  for (int joint = 0; joint < model_.num_joints(); ++joint) {
    LawEntry& armature = Add("armature", [joint](const LawAtStep& at) -> MatrixXd {
      return at.demand()[joint] * VectorXd::Unit(at.force.size(), joint);
    });
    armature.place = "joint " + model_.joint(joint).name + " of the law's model";
    armature.unit = "kg m^2";
    armature.nominal = model_.joint(joint).armature;
  }
  LawEntry& same =
      Add("armature of all joints, more by", [](const LawAtStep& at) -> MatrixXd { return at.demand(); });
  same.place = "law's model";
  same.unit = "kg m^2";
}

void LawEntryList::AddJointOrder() {
  const auto regressor = std::make_shared<TorqueRegressor>(model_);
  for (const auto& [i, j] : ListPairs()) {
    LawEntry& entry = Add("joints " + NameEntry(model_, i) + " and " + NameEntry(model_, j) + " exchanged",
                          [regressor, i = i, j = j](const LawAtStep& at) -> MatrixXd {
                            VectorXd q = at.inputs.now.q, xi = at.inputs.now.xi, demand = at.demand();
                            VectorXd right(q.size()), wrong(q.size());
                            regressor->SetMotion(q, xi, demand);
                            regressor->CalcTorques(right);
                            for (VectorXd* const vector : {&q, &xi, &demand})
                              std::swap((*vector)[i], (*vector)[j]);
                            regressor->SetMotion(q, xi, demand);
                            regressor->CalcTorques(wrong);
                            std::swap(wrong[i], wrong[j]);
                            return wrong - right;
                          });
    entry.place = "law's model";
    entry.is_whole = true;
    entry.is_variant = true;
  }
}

}  // namespace dexcheck
