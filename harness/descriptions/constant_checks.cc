#include "harness/descriptions/constant_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "harness/descriptions/engine_only.h"
#include "harness/engine/engine.h"
#include "harness/engine/exact_collision.h"
#include "harness/engine/wheel_inertia.h"

namespace dexcheck {
namespace {

// Both sides read decimal numbers and form at most short sums and products of them.
constexpr double kRounding = 64.0 * std::numeric_limits<double>::epsilon();

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

Vector3d MapVector(const mjtNum* v) { return {v[0], v[1], v[2]}; }

class ConstantComparison {
 public:
  explicit ConstantComparison(const Adapter& adapter)
      : adapter_(adapter), model_(adapter.model()), engine_(adapter.engine()) {}

  ConstantChecks Run() {
    CompareGravity();
    CompareLinks();
    CompareJoints();
    if (!adapter_.wheels().empty()) CompareWheels();
    CompareFingertips();
    if (model_.object()) CompareObject(*model_.object());
    CompareOtherJoints();
    FindEngineOnly(adapter_, &result_);
    return std::move(result_);
  }

 private:
  /// Compares relative to the larger of the two, or to `scale` where zero is a proper value.
  void Compare(const std::string& check, const Location& where, double model, double engine,
               double scale = 0.0) {
    CheckRecord* const record = result_.Define(check);
    entry_ = check == last_check_ && where == last_location_ ? entry_ + 1 : 0;
    last_check_ = check;
    last_location_ = where;
    const double size = std::max({std::abs(model), std::abs(engine), scale});
    const double error = record->Compare(model, engine, size > 0.0 ? size : 1.0, where, -1);
    if (error > kRounding) {
      result_.findings.push_back(
          {check, Describe(where, model_, model_.num_base_velocities()), model, engine, where, entry_});
    }
  }

  static Location AtLink(int link) { return {Location::Kind::kLink, link, -1}; }
  static Location AtJoint(int joint) { return {Location::Kind::kJoint, joint, -1}; }

  void CompareGravity() {
    for (int k = 0; k < 3; ++k) {
      Compare("gravity_vector", {}, model_.gravity()[k], engine_.opt.gravity[k], model_.gravity().norm());
    }
  }

  void CompareLinks() {
    for (int link = -1; link < model_.num_joints(); ++link) {
      if (link < 0 && model_.base().type == BaseType::kFixed) continue;
      const MassProperties& body =
          link < 0 ? model_.base_with_wheels() : model_.joints()[static_cast<size_t>(link)].body;
      double mass = 0.0;
      for (const int b : adapter_.welded_bodies()[static_cast<size_t>(link + 1)])
        mass += engine_.body_mass[b];
      Compare("link_mass", AtLink(link), body.mass, mass);
    }
  }

  void CompareJoints() {
    const std::vector<int>& dofs = adapter_.joint_dofs();
    for (int i = 0; i < model_.num_dofs(); ++i) {
      const int joint = model_.joint_of_dof(i);
      Compare("joint_damping", AtJoint(joint), model_.joints()[static_cast<size_t>(joint)].damping,
              engine_.dof_damping[dofs[static_cast<size_t>(i)]]);
    }
    for (int i = 0; i < model_.num_dofs(); ++i) {
      const int joint = model_.joint_of_dof(i);
      Compare("joint_armature", AtJoint(joint), model_.joints()[static_cast<size_t>(joint)].armature,
              engine_.dof_armature[dofs[static_cast<size_t>(i)]]);
    }
    for (int i = 0; i < model_.num_joints(); ++i) {
      const int id = adapter_.joint_ids()[static_cast<size_t>(i)];
      if (!engine_.jnt_limited[id]) continue;  // then the parameter file's range is only where to sample
      Compare("joint_range", AtJoint(i), model_.joints()[static_cast<size_t>(i)].lower,
              engine_.jnt_range[2 * id]);
      Compare("joint_range", AtJoint(i), model_.joints()[static_cast<size_t>(i)].upper,
              engine_.jnt_range[2 * id + 1]);
    }
  }

  void CompareWheels() {
    const Base& base = model_.base();
    const auto each = [&](const auto& compare) {
      for (size_t k = 0; k < 2; ++k) {
        compare(adapter_.wheels()[k], Location{Location::Kind::kWheel, static_cast<int>(k), -1},
                k == 0 ? -1.0 : 1.0);
      }
    };
    each([&](const EngineWheel& wheel, const Location& where, double) {
      Compare("wheel_radius", where, base.wheel_radius, wheel.radius);
    });
    each([&](const EngineWheel& wheel, const Location& where, double side) {
      Compare("wheel_distance", where, base.wheel_distance, 2.0 * side * wheel.center.y());
    });
    each([&](const EngineWheel& wheel, const Location& where, double) {
      Compare("axle_position", where, 0.0, wheel.center.x(), base.wheel_radius);
      Compare("axle_position", where, 0.0, wheel.center.z(), base.wheel_radius);
    });
    each([&](const EngineWheel& wheel, const Location& where, double) {
      for (int k = 0; k < 3; ++k) Compare("wheel_axis", where, k == 1 ? 1.0 : 0.0, wheel.axis[k], 1.0);
    });
    each([&](const EngineWheel& wheel, const Location& where, double) {
      Compare("wheel_mass", where, base.wheel.mass, engine_.body_mass[engine_.jnt_bodyid[wheel.joint]]);
    });
    each([&](const EngineWheel& wheel, const Location& where, double) {
      Compare("wheel_spin_inertia", where, base.wheel.spin_inertia, CalcWheelInertia(engine_, wheel).spin);
    });
    each([&](const EngineWheel& wheel, const Location& where, double) {
      Compare("wheel_damping", where, base.wheel.damping, engine_.dof_damping[wheel.dof]);
    });
    each([&](const EngineWheel& wheel, const Location& where, double) {
      Compare("wheel_armature", where, base.wheel.armature, engine_.dof_armature[wheel.dof]);
    });
  }

  /// The fingertip's sphere if it is at the frame's site; otherwise -1.
  [[nodiscard]] int FindTipGeom(int frame) const {
    constexpr double kSamePlace = 1e-9;  // m; two decimal numbers for one point
    const int geom = adapter_.FindTipGeom(frame);
    if (geom < 0) return -1;
    const int site = adapter_.frame_sites()[static_cast<size_t>(frame)];
    const Vector3d apart = MapVector(engine_.geom_pos + 3 * geom) - MapVector(engine_.site_pos + 3 * site);
    return apart.norm() < kSamePlace ? geom : -1;
  }

  void CompareFingertips() {
    for (const int frame : model_.fingertips()) {
      const Location where{Location::Kind::kFrame, frame, -1};
      const int geom = FindTipGeom(frame);
      const double radius = geom < 0 ? kMissing : engine_.geom_size[3 * geom];
      Compare("fingertip_radius", where, *model_.frames()[static_cast<size_t>(frame)].sphere_radius, radius);
    }
  }

  void CompareObject(const ObjectModel& object) {
    const Location where{Location::Kind::kObject, -1, -1};
    const int body = adapter_.object_body();
    Compare("object_mass", where, object.body.mass, engine_.body_mass[body]);
    for (int k = 0; k < 3; ++k) {
      Compare("object_com", where, object.body.com[k], engine_.body_ipos[3 * body + k], 1.0);
    }
    mjtNum R[9];
    mju_quat2Mat(R, engine_.body_iquat + 4 * body);
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> axes(R);
    const Matrix3d inertia =
        axes * MapVector(engine_.body_inertia + 3 * body).asDiagonal() * axes.transpose();
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col) {
        Compare("object_inertia", where, object.body.inertia(row, col), inertia(row, col),
                object.body.inertia.trace());
      }
    }
    CompareSimpleShape(object.shape, body);
    if (const SolidTorus* torus = std::get_if<SolidTorus>(&object.shape)) {
      double ring_radius = kMissing;
      double tube_radius = kMissing;
      for (int geom = 0; geom < engine_.ngeom; ++geom) {
        if (engine_.geom_bodyid[geom] == body) GetTorusRadii(engine_, geom, &ring_radius, &tube_radius);
      }
      Compare("object_shape", where, torus->ring_radius, ring_radius);
      Compare("object_shape", where, torus->tube_radius, tube_radius);
    }
    for (const int frame : model_.fingertips()) CompareFriction(object, frame);
  }

  /// Size and place of the object's geom of that type, the one that can touch when there are several. (A
  /// torus is a marked mesh.)
  void CompareSimpleShape(const Shape& shape, int body) {
    int type = mjGEOM_NONE;
    std::vector<double> sizes;  // as the MJCF writes them
    if (const auto* sphere = std::get_if<SolidSphere>(&shape)) {
      type = mjGEOM_SPHERE;
      sizes = {sphere->radius};
    } else if (const auto* cylinder = std::get_if<SolidCylinder>(&shape)) {
      type = mjGEOM_CYLINDER;
      sizes = {cylinder->radius, 0.5 * cylinder->length};
    } else if (const auto* capsule = std::get_if<SolidCapsule>(&shape)) {
      type = mjGEOM_CAPSULE;
      sizes = {capsule->radius, 0.5 * capsule->length};
    } else if (const auto* box = std::get_if<SolidBox>(&shape)) {
      type = mjGEOM_BOX;
      sizes = {0.5 * box->size.x(), 0.5 * box->size.y(), 0.5 * box->size.z()};
    } else if (const auto* ellipsoid = std::get_if<SolidEllipsoid>(&shape)) {
      type = mjGEOM_ELLIPSOID;
      sizes = {ellipsoid->semi_axes.x(), ellipsoid->semi_axes.y(), ellipsoid->semi_axes.z()};
    } else {
      return;
    }
    int found = -1;
    for (int geom = 0; geom < engine_.ngeom; ++geom) {
      if (engine_.geom_bodyid[geom] != body || engine_.geom_type[geom] != type) continue;
      if (found < 0 || (CanTouch(engine_, geom) && !CanTouch(engine_, found))) found = geom;
    }
    const Location where{Location::Kind::kObject, -1, -1};
    for (size_t k = 0; k < sizes.size(); ++k)
      Compare("object_shape", where, sizes[k],
              found < 0 ? kMissing : engine_.geom_size[3 * found + static_cast<int>(k)]);
    if (found < 0) return;
    for (int k = 0; k < 3; ++k)
      Compare("object_shape", where, 0.0, engine_.geom_pos[3 * found + k], sizes[0]);
    if (type == mjGEOM_SPHERE) return;
    mjtNum R[9];
    mju_quat2Mat(R, engine_.geom_quat + 4 * found);
    Compare("object_shape", where, 1.0, std::abs(R[8]));  // the axis, or a box's z
    if (type == mjGEOM_BOX || type == mjGEOM_ELLIPSOID) Compare("object_shape", where, 1.0, std::abs(R[0]));
  }

  /// Sliding friction of the explicit contact pairs between a fingertip and the object. Without a pair the
  /// two touch by their contype and conaffinity, or not at all.
  void CompareFriction(const ObjectModel& object, int frame) {
    const Location where{Location::Kind::kFrame, frame, -1};
    const int tip = FindTipGeom(frame);
    if (tip < 0) return;  // a finding of its own
    bool touches = false;
    for (int pair = 0; pair < engine_.npair; ++pair) {
      const int geom1 = engine_.pair_geom1[pair];
      const int geom2 = engine_.pair_geom2[pair];
      if (!(geom1 == tip && IsObject(geom2)) && !(geom2 == tip && IsObject(geom1))) continue;
      touches = true;
      for (int k = 0; k < 2; ++k) {
        Compare("contact_friction", where, object.friction, engine_.pair_friction[5 * pair + k]);
      }
    }
    if (touches) return;
    // The engine takes the larger friction of two geoms of one priority.
    double friction = kMissing;
    for (int geom = 0; geom < engine_.ngeom; ++geom) {
      const bool by_type = (engine_.geom_contype[tip] & engine_.geom_conaffinity[geom]) != 0 ||
                           (engine_.geom_contype[geom] & engine_.geom_conaffinity[tip]) != 0;
      if (IsObject(geom) && by_type) {
        friction = std::max(engine_.geom_friction[3 * tip], engine_.geom_friction[3 * geom]);
      }
    }
    Compare("contact_friction", where, object.friction, friction);
  }

  [[nodiscard]] bool IsObject(int geom) const { return engine_.geom_bodyid[geom] == adapter_.object_body(); }

  /// Joints that carry the base or the object: nothing holds or drives them. And springs, dry friction and
  /// stops where the analytic model has none.
  void CompareOtherJoints() {
    const size_t first_finding = result_.findings.size();
    std::vector<std::pair<int, Location>> joints;
    for (const int joint : adapter_.base_joints()) joints.emplace_back(joint, AtLink(-1));
    const size_t own = joints.size();
    for (size_t k = 0; k < adapter_.wheels().size(); ++k) {
      joints.emplace_back(adapter_.wheels()[k].joint,
                          Location{Location::Kind::kWheel, static_cast<int>(k), -1});
    }
    const size_t limitless = joints.size();
    for (int i = 0; i < model_.num_joints(); ++i) {
      joints.emplace_back(adapter_.joint_ids()[static_cast<size_t>(i)], AtJoint(i));
    }
    const size_t robots = joints.size();
    if (adapter_.object_body() >= 0) {
      const int first = engine_.body_jntadr[adapter_.object_body()];
      for (int k = 0; k < engine_.body_jntnum[adapter_.object_body()]; ++k)
        joints.emplace_back(first + k, Location{Location::Kind::kObject, -1, -1});
    }
    const auto each_dof = [&](int joint, const auto& compare) {
      constexpr int kDofs[] = {6, 3, 1, 1};  // of a free joint, a ball, a slide, a hinge
      const int first = engine_.jnt_dofadr[joint];
      for (int dof = first; dof < first + kDofs[engine_.jnt_type[joint]]; ++dof) compare(dof);
    };
    for (size_t i = 0; i < joints.size(); ++i) {
      const auto& [joint, where] = joints[i];
      if (i < own || i >= robots) {
        each_dof(joint, [&, at = where](int dof) {
          Compare("joint_damping", at, 0.0, engine_.dof_damping[dof]);
          Compare("joint_armature", at, 0.0, engine_.dof_armature[dof]);
        });
      }
      if (i < limitless || i >= robots)
        Compare("joint_limited", where, 0.0, engine_.jnt_limited[joint] != 0 ? 1.0 : 0.0);
    }
    for (const auto& [joint, where] : joints)
      Compare("joint_spring", where, 0.0, engine_.jnt_stiffness[joint]);
    for (const auto& [joint, where] : joints) {
      const bool is_of_tree = where.kind == Location::Kind::kJoint;
      const double own = is_of_tree ? model_.joints()[static_cast<size_t>(where.first)].dry_friction : 0.0;
      each_dof(joint, [&, at = where](int dof) {
        Compare("joint_dry_friction", at, own, engine_.dof_frictionloss[dof]);
      });
    }
    for (const auto& [joint, where] : joints) {
      if (engine_.jnt_limited[joint] != 0)
        Compare("joint_stop_margin", where, 0.0, engine_.jnt_margin[joint]);
    }
    Compare("fluid", {}, 0.0, engine_.opt.density);
    Compare("fluid", {}, 0.0, engine_.opt.viscosity);
    NameBaseJoints(first_finding);
    for (size_t i = first_finding; i < result_.findings.size(); ++i) {
      ConstantFinding& finding = result_.findings[i];
      finding.engine_only =
          finding.check != "joint_dry_friction" || finding.location.kind != Location::Kind::kJoint;
    }
  }

  /// Says of findings at the base that they are about the joints that carry it, and says once what the six
  /// coordinates of a free joint have in common.
  void NameBaseJoints(size_t first_finding) {
    if (adapter_.base_joints().empty()) return;
    const int type = engine_.jnt_type[adapter_.base_joints().front()];
    const std::string joint = type == mjJNT_FREE ? "free joint of " : "joints of ";
    std::vector<ConstantFinding> findings;
    findings.swap(result_.findings);
    for (size_t i = 0; i < findings.size(); ++i) {
      ConstantFinding& finding = findings[i];
      const bool is_of_base = i >= first_finding && finding.location == AtLink(-1);
      if (is_of_base) finding.where = joint + finding.where;
      const auto is_same = [&](const ConstantFinding& other) {
        return other.check == finding.check && other.where == finding.where && other.engine == finding.engine;
      };
      if (is_of_base && std::any_of(result_.findings.begin(), result_.findings.end(), is_same)) continue;
      result_.findings.push_back(finding);
    }
  }

  const Adapter& adapter_;
  const RobotModel& model_;
  const mjModel& engine_;
  ConstantChecks result_;
  std::string last_check_;
  Location last_location_;
  int entry_ = 0;
};

}  // namespace

CheckRecord* ConstantChecks::Define(const std::string& check) {
  auto record =
      std::find_if(records.begin(), records.end(), [&](const CheckRecord& one) { return one.name == check; });
  if (record == records.end()) {
    record = records.insert(record, CheckRecord{});
    record->name = check;
    record->bound = kRounding;
  }
  return &*record;
}

void ConstantChecks::Add(ConstantFinding finding) {
  const double size = std::max(std::abs(finding.model), std::abs(finding.engine));
  Define(finding.check)
      ->Compare(finding.model, finding.engine, size > 0.0 ? size : 1.0, finding.location, -1);
  findings.push_back(std::move(finding));
}

ConstantChecks CheckConstants(const Adapter& adapter) { return ConstantComparison(adapter).Run(); }

void JudgeByTolerance(double tolerance, std::vector<CheckRecord>* records) {
  for (CheckRecord& record : *records) {
    record.bound = std::max(record.bound, tolerance);
    record.failed = !(record.worst <= record.bound);
    // Where the narrower bound was left first says nothing now.
    if (record.failed) record.first_failure = record.where;
  }
}

void JudgeByTolerance(double tolerance, ConstantChecks* constants) {
  JudgeByTolerance(tolerance, &constants->records);
  std::erase_if(constants->findings, [&](const ConstantFinding& finding) {
    const double size = std::max(std::abs(finding.model), std::abs(finding.engine));
    const bool is_within = std::abs(finding.model - finding.engine) <= tolerance * size;
    const bool check_holds = std::any_of(
        constants->records.begin(), constants->records.end(),
        [&](const CheckRecord& record) { return record.name == finding.check && !record.failed; });
    return is_within || check_holds;
  });
}

}  // namespace dexcheck
