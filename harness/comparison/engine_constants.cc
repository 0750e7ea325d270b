#include "harness/comparison/engine_constants.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "harness/base/worst.h"
#include "harness/descriptions/constant_table.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/engine/engine.h"
#include "harness/engine/exact_collision.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/robot_tree.h"

namespace dexcheck {
namespace {

constexpr double kSamePlace = 1e-9;  // m; two decimal numbers for one point
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

/// Reads an engine's model, joints in the order of the analytic one.
StatedConstants ReadStated(const Adapter& adapter) {
  const mjModel& m = adapter.engine();
  StatedConstants stated;
  stated.gravity = MapVector(m.opt.gravity);
  for (const std::vector<int>& bodies : adapter.welded_bodies()) {
    double& mass = stated.masses.emplace_back(0.0);
    for (const int body : bodies) mass += m.body_mass[body];
  }
  for (int i = 0; i < adapter.model().num_joints(); ++i) {
    StatedConstants::OfJoint& one = stated.joints.emplace_back();
    const int id = adapter.joint_ids()[static_cast<size_t>(i)];
    const int count = CountVelocities(adapter.model().joint(i).type);
    for (const DescribedConstant& constant : ListDescribedConstants()) {
      const mjtNum* const first = m.*constant.engine + m.jnt_dofadr[id];
      // All have one number in an MJCF.
      one.numbers.emplace_back(
          *std::find_if(first, first + count - 1, [&](double x) { return x != *first; }));
    }
    // Without a limit the range of the other side only says where to draw states.
    if (m.jnt_limited[id] != 0) one.range = {m.jnt_range[2 * id], m.jnt_range[2 * id + 1]};
    one.coupling = FindEngineCoupling(m, id);
    if (one.coupling) one.coupling->leader = IndexOf(adapter.joint_ids(), one.coupling->leader);
  }
  return stated;
}

/// Wheels, fingertips and the object of a model and of the engine's.
class PlantComparison : public ConstantComparison {
 public:
  PlantComparison(const Adapter& adapter, ConstantChecks* result)
      : ConstantComparison(adapter.model(), result), adapter_(adapter), engine_(adapter.engine()) {}

  void Run() {
    if (!adapter_.wheels().empty()) CompareWheels();
    CompareFingertips();
    if (model_.object()) CompareObject(*model_.object());
  }

 private:
  void CompareWheels() {
    const Base& base = model_.base();
    const auto each = [&](const char* check, const auto& compare) {
      for (size_t k = 0; k < 2; ++k) {
        const EngineWheel& wheel = adapter_.wheels()[k];
        compare(wheel, k == 0 ? -1.0 : 1.0, [&, k](double model, double engine, double scale = 0.0) {
          Compare(check, {Location::Kind::kWheel, static_cast<int>(k), -1}, model, engine, scale);
        });
      }
    };
    using Wheel = const EngineWheel&;
    each("wheel_radius", [&](Wheel w, double, auto&& compare) { compare(base.wheel_radius, w.radius); });
    each("wheel_distance", [&](Wheel w, double side, auto&& compare) {
      compare(base.wheel_distance, 2.0 * side * w.center.y());
    });
    each("axle_position", [&](Wheel w, double, auto&& compare) {
      compare(0.0, w.center.x(), base.wheel_radius);
      compare(0.0, w.center.z(), base.wheel_radius);
    });
    each("wheel_axis", [&](Wheel w, double, auto&& compare) {
      for (int k = 0; k < 3; ++k) compare(k == 1 ? 1.0 : 0.0, w.axis[k], 1.0);
    });
    each("wheel_mass", [&](Wheel w, double, auto&& compare) {
      compare(base.wheel.mass, engine_.body_mass[engine_.jnt_bodyid[w.joint]]);
    });
    each("wheel_spin_inertia", [&](Wheel w, double, auto&& compare) {
      compare(base.wheel.spin_inertia, CalcSpinInertia(engine_, w));
    });
    each("wheel_damping",
         [&](Wheel w, double, auto&& compare) { compare(base.wheel.damping, engine_.dof_damping[w.dof]); });
    each("wheel_armature",
         [&](Wheel w, double, auto&& compare) { compare(base.wheel.armature, engine_.dof_armature[w.dof]); });
  }

  /// The fingertip's sphere if it is at the frame's site; otherwise -1.
  [[nodiscard]] int FindTipGeom(int frame) const {
    return FindTipSphere(engine_, adapter_.frame_sites()[static_cast<size_t>(frame)], kSamePlace);
  }

  /// A capsule one of whose ends is there, as feet may have them; -1 without one.
  [[nodiscard]] int FindTipCapsule(int frame) const {
    const int site = adapter_.frame_sites()[static_cast<size_t>(frame)];
    if (site < 0) return -1;
    for (int geom = 0; geom < engine_.ngeom; ++geom) {
      if (engine_.geom_bodyid[geom] != engine_.site_bodyid[site] || engine_.geom_type[geom] != mjGEOM_CAPSULE)
        continue;
      const Pose X = ReadPose(engine_.geom_pos + 3 * geom, engine_.geom_quat + 4 * geom);
      const Vector3d apart = X.inverse() * MapVector(engine_.site_pos + 3 * site);
      const Vector3d end(0.0, 0.0, engine_.geom_size[3 * geom + 1]);
      if (std::min((apart - end).norm(), (apart + end).norm()) < kSamePlace) return geom;
    }
    return -1;
  }

  void CompareFingertips() {
    for (const int frame : model_.fingertips()) {
      const Location where{Location::Kind::kFrame, frame, -1};
      int geom = FindTipGeom(frame);
      if (geom < 0 && model_.base().type == BaseType::kFloating) geom = FindTipCapsule(frame);
      const double radius = geom < 0 ? kMissing : engine_.geom_size[3 * geom];
      Compare("fingertip_radius", where, *model_.frame(frame).sphere_radius, radius);
    }
  }

  void CompareObject(const ObjectModel& object) {
    const Location where{Location::Kind::kObject, -1, -1};
    const int body = adapter_.object_body();
    Compare("object_mass", where, object.body.mass, engine_.body_mass[body]);
    for (int k = 0; k < 3; ++k) {
      Compare("object_com", where, object.body.com[k], engine_.body_ipos[3 * body + k], 1.0);
    }
    const Matrix3d inertia = ReadEngineBody(engine_, body).inertia;
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
    const Pose X = ReadPose(engine_.geom_pos + 3 * found, engine_.geom_quat + 4 * found);
    Compare("object_shape", where, 1.0, std::abs(X(2, 2)));  // the axis, or a box's z
    if (type == mjGEOM_BOX || type == mjGEOM_ELLIPSOID)
      Compare("object_shape", where, 1.0, std::abs(X(0, 0)));
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
        friction = Worst(engine_.geom_friction[3 * tip], engine_.geom_friction[3 * geom]);
      }
    }
    Compare("contact_friction", where, object.friction, friction);
  }

  [[nodiscard]] bool IsObject(int geom) const { return engine_.geom_bodyid[geom] == adapter_.object_body(); }

  const Adapter& adapter_;
  const mjModel& engine_;
};

}  // namespace

ConstantChecks CheckConstants(const Adapter& adapter, const EngineParts& parts, const FirstFile& first) {
  ConstantChecks result;
  StatedConstants a =
      first.robot != nullptr ? ReadStated(*first.robot, first.robot->spec) : ReadStated(adapter.model());
  StatedConstants b = ReadStated(adapter);
  a.LeaveOut(first.ignore);
  b.LeaveOut(first.ignore);
  b.file = first.second_file;
  MechanismComparison mechanism(adapter.model(), std::move(a), std::move(b), &result);
  mechanism.CompareShared();
  PlantComparison(adapter, &result).Run();
  CompareParts(first.parts, parts.parts, &result);
  result.notes = parts.notes;
  if (!first.is_file) return result;
  mechanism.AddOneSided();
  mechanism.CompareCouplings(/*by_engine=*/true);
  return result;
}

ConstantChecks CheckConstants(const Adapter& adapter) {
  return CheckConstants(adapter, ListEngineParts(adapter), {});
}

}  // namespace dexcheck
