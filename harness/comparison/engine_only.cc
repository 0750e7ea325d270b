#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <string>

#include "harness/base/worst.h"
#include "harness/comparison/engine_extras.h"
#include "harness/descriptions/constant_table.h"
#include "harness/engine/engine.h"
#include "harness/engine/exact_collision.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Hard fingers and wheels (20): a normal force and friction along the surface.
constexpr int kHardContact = 3;

std::string List(const mjtNum* values, int count) {
  return fmt::format("{:.17g}", fmt::join(values, values + count, " "));
}

class EngineOnly {
 public:
  EngineOnly(const Adapter& adapter, ConstantChecks* result)
      : adapter_(adapter), engine_(adapter.engine()), result_(result) {}

  void Run() {
    FindJoints();
    Expect("fluid", "robot", 0.0, engine_.opt.density);
    Expect("fluid", "robot", 0.0, engine_.opt.viscosity);
    FindParts(EnginePart::kTendon, mjOBJ_TENDON, "tendon", engine_.ntendon);
    FindParts(EnginePart::kConstraint, mjOBJ_EQUALITY, "constraint", engine_.neq);
    FindMotors();
    FindNewerForces();
    FindFlags();
    ComparePairs();
    if (!adapter_.wheels().empty()) CompareFloor();
    NoteContactsByType();
    NoteSettings();
  }

 private:
  /// A number that must be `neutral`.
  void Expect(const std::string& check, const std::string& where, double neutral, double engine,
              double tolerance = 0.0, const Location& at = {}) {
    CheckRecord* const record = result_->Define(check);
    double error = std::abs(engine - neutral);
    if (error <= tolerance) error = 0.0;
    // How large a force may be that should not be there is nothing that a relative tolerance says.
    if (tolerance == 0.0 && error > 0.0) error /= Worst(std::abs(engine), std::abs(neutral));
    if (!(record->CompareError(error, neutral, engine, at, -1) <= kConstantRounding))
      result_->findings.push_back({check, where, neutral, engine, at, 0, true});
  }

  void Note(const std::string& kind, std::string text) { result_->notes.push_back({kind, std::move(text)}); }

  [[nodiscard]] std::string Name(mjtObj type, const char* kind, int id) const {
    return std::string(kind) + " " + NameOf(engine_, type, id);
  }
  [[nodiscard]] std::string GeomName(int geom) const { return Name(mjOBJ_GEOM, "geom", geom); }

  /// Joints that carry the base or the object: nothing holds or drives them. And springs, dry friction and
  /// limits where the analytic model has none.
  void FindJoints() {
    struct OwnedJoint {
      int id;
      JointRole role;
      Location at;
    };
    std::vector<OwnedJoint> joints;
    for (const int joint : adapter_.base_joints())
      joints.push_back({joint, kFreeJoint, {Location::Kind::kLink, -1, -1}});
    for (int k = 0; k < static_cast<int>(adapter_.wheels().size()); ++k)
      joints.push_back(
          {adapter_.wheels()[static_cast<size_t>(k)].joint, kWheelJoint, {Location::Kind::kWheel, k, -1}});
    for (int i = 0; i < adapter_.model().num_joints(); ++i)
      joints.push_back(
          {adapter_.joint_ids()[static_cast<size_t>(i)], kRobotJoint, {Location::Kind::kJoint, i, -1}});
    const int object = adapter_.object_body();
    for (int k = 0; object >= 0 && k < engine_.body_jntnum[object]; ++k)
      joints.push_back({engine_.body_jntadr[object] + k, kFreeJoint, {Location::Kind::kObject, -1, -1}});
    for (const Constant& constant : ListConstants()) {
      if (constant.part != EnginePart::kJoint || !constant.neutral) continue;
      for (const OwnedJoint& joint : joints) {
        if ((constant.roles & joint.role) != 0) FindJoint(constant, joint.id, joint.at);
      }
    }
  }

  void FindJoint(const Constant& constant, int joint, const Location& at) {
    if (constant.applies != nullptr && !constant.applies(engine_, joint)) return;
    std::string where = Describe(at, adapter_.model(), adapter_.model().num_base_velocities());
    const bool carries_base = at.kind == Location::Kind::kLink;
    if (carries_base)
      where = (engine_.jnt_type[joint] == mjJNT_FREE ? "free joint of " : "joints of ") + where;
    std::vector<ConstantFinding>& findings = result_->findings;
    for (const double number : ReadConstant(constant, engine_, joint)) {
      const auto said = static_cast<std::ptrdiff_t>(findings.size());
      Expect(constant.check, where, *constant.neutral, number, 0.0, at);
      // A constant that all six coordinates of a free joint share is said once.
      if (carries_base &&
          std::any_of(findings.begin(), findings.begin() + said, [&](const ConstantFinding& other) {
            return other.check == constant.check && other.where == where && other.engine == number;
          }))
        findings.resize(static_cast<size_t>(said));
    }
  }

  /// Parts of which each constant must have its neutral value.
  void FindParts(EnginePart part, mjtObj type, const char* kind, EngineSize count) {
    for (int i = 0; i < count; ++i) {
      for (const Constant& constant : ListConstants()) {
        if (constant.part != part || !constant.neutral) continue;
        Expect(constant.check, Name(type, kind, i), *constant.neutral,
               ReadConstant(constant, engine_, i).front());
      }
    }
  }

  /// A motor is a torque on its joint, and its control is that torque: its gear is 1.
  void FindMotors() {
    for (int i = 0; i < engine_.nu; ++i) {
      const std::string where = Name(mjOBJ_ACTUATOR, "actuator", i);
      for (const MotorProperty& property : ReadMotor(engine_, i))
        Expect(property.check, where, property.plain, property.value);
      if (engine_.actuator_ctrllimited[i] != 0)
        Note("motor_limit",
             fmt::format("{}: control from {}", where, List(engine_.actuator_ctrlrange + 2 * i, 2)));
      if (engine_.actuator_forcelimited[i] != 0)
        Note("motor_limit",
             fmt::format("{}: force from {}", where, List(engine_.actuator_forcerange + 2 * i, 2)));
    }
  }

  /// Finds forces and inertias that later releases of the engine add to the mechanism.
  void FindNewerForces() {
    for (const NewerForce& force : kNewerForces) {
      const mjtNum* const values = engine_.*force.values;
      for (int i = 0; i < CountElements(engine_, force.type) * force.columns; ++i) {
        const std::string element = NameOf(engine_, force.type, i / force.columns);
        Expect(force.check, element + ": " + force.name, 0.0, values[i]);
      }
    }
    for (const NewerPart& part : kNewerParts)
      Expect("newer_part", part.name, 0.0, static_cast<double>(engine_.*part.count));
  }

  void FindFlags() {
    // Sensors measure only; so do the energy, the comparison with the inverse dynamics and sensors' noise.
    constexpr int kHarmlessToDisable = mjDSBL_SENSOR;
    constexpr int kHarmlessToEnable = mjENBL_ENERGY | mjENBL_FWDINV | kSensorNoiseFlag;
    const auto find = [&](const char* check, std::span<const char* const> names, int flags, int harmless) {
      for (size_t i = 0; i < names.size(); ++i) {
        const int flag = 1 << i;
        if ((flag & harmless) == 0) Expect(check, names[i], 0.0, (flags & flag) != 0 ? 1.0 : 0.0);
      }
      const int unknown = flags & ~((1 << names.size()) - 1);
      Expect(check, "unknown flag", 0.0, unknown);
    };
    find("disable_flag", {mjDISABLESTRING, mjNDISABLE}, engine_.opt.disableflags, kHarmlessToDisable);
    find("enable_flag", {mjENABLESTRING, mjNENABLE}, engine_.opt.enableflags, kHarmlessToEnable);
  }

  [[nodiscard]] bool IsObject(int geom) const {
    return adapter_.object_body() >= 0 && engine_.geom_bodyid[geom] == adapter_.object_body();
  }
  [[nodiscard]] bool IsWorld(int geom) const { return engine_.body_weldid[engine_.geom_bodyid[geom]] == 0; }
  [[nodiscard]] bool IsWheel(int geom) const {
    return std::ranges::any_of(adapter_.wheels(), [&](const EngineWheel& wheel) {
      return engine_.geom_bodyid[geom] == engine_.jnt_bodyid[wheel.joint];
    });
  }
  [[nodiscard]] bool IsFingertip(int geom) const {
    const auto& tips = adapter_.model().fingertips();
    return std::ranges::any_of(tips, [&](int frame) {
      return engine_.site_bodyid[adapter_.frame_sites()[static_cast<size_t>(frame)]] ==
             engine_.geom_bodyid[geom];
    });
  }

  /// Returns whether a floating robot may stand on a shape: the model has a frame on its body.
  [[nodiscard]] bool IsFoot(int geom) const {
    const std::vector<int>& sites = adapter_.frame_sites();
    return adapter_.model().base().type == BaseType::kFloating && std::ranges::any_of(sites, [&](int site) {
             return site >= 0 && engine_.site_bodyid[site] == engine_.geom_bodyid[geom];
           });
  }

  [[nodiscard]] std::string DescribeGeom(int geom) const {
    return fmt::format("{} (type {}, size {}, pos {}, quat {})", GeomName(geom), engine_.geom_type[geom],
                       List(engine_.geom_size + 3 * geom, 3), List(engine_.geom_pos + 3 * geom, 3),
                       List(engine_.geom_quat + 4 * geom, 4));
  }

  /// Explicit contact pairs: nothing acts at a distance, fingers and wheels are hard, and all else of the
  /// robot but feet that touches the world slides without friction.
  void ComparePairs() {
    std::set<int> meshes;
    for (int pair = 0; pair < engine_.npair; ++pair) {
      const std::string where = Name(mjOBJ_PAIR, "pair", pair);
      const int geoms[2] = {engine_.pair_geom1[pair], engine_.pair_geom2[pair]};
      const mjtNum* const friction = engine_.pair_friction + 5 * pair;
      const int dim = engine_.pair_dim[pair];
      Expect("contact_margin", where, 0.0, engine_.pair_margin[pair]);
      Expect("contact_margin", where, 0.0, engine_.pair_gap[pair]);
      for (int k = 0; k < 2; ++k) {
        const int own = geoms[k];
        const int other = geoms[1 - k];
        if (engine_.geom_type[own] == mjGEOM_MESH || engine_.geom_type[own] == mjGEOM_HFIELD)
          meshes.insert(own);
        const bool hard = (IsFingertip(own) && IsObject(other)) || (IsWheel(own) && IsWorld(other));
        if (hard) Expect("contact_dimension", where, kHardContact, dim);
        const bool has_friction = IsWorld(other) && !IsWorld(own) && !IsObject(own) && !IsWheel(own) &&
                                  !IsFingertip(own) && !IsFoot(own);
        if (has_friction)
          Expect("contact_rubbing", where, 0.0, dim > 1 ? Worst(friction[0], friction[1]) : 0.0);
      }
      Note("contact_pair",
           fmt::format("{}: {} and {}: dimension {}, friction {}, margin {:.17g}, gap {:.17g}", where,
                       DescribeGeom(geoms[0]), DescribeGeom(geoms[1]), dim, List(friction, 5),
                       engine_.pair_margin[pair], engine_.pair_gap[pair]));
    }
    for (const int geom : meshes) NoteMesh(geom);
  }

  /// The engine collides a mesh as its convex hull.
  void NoteMesh(int geom) {
    const int id = engine_.geom_dataid[geom];
    double sum = 0.0;
    if (engine_.geom_type[geom] == mjGEOM_MESH) {
      const float* const first = engine_.mesh_vert + 3 * engine_.mesh_vertadr[id];
      for (int k = 0; k < 3 * engine_.mesh_vertnum[id]; ++k) sum += std::abs(static_cast<double>(first[k]));
    } else {
      const float* const first = engine_.hfield_data + engine_.hfield_adr[id];
      for (int k = 0; k < engine_.hfield_nrow[id] * engine_.hfield_ncol[id]; ++k)
        sum += std::abs(static_cast<double>(first[k]));
      for (int k = 0; k < 4; ++k) sum += engine_.hfield_size[4 * id + k];
    }
    Note("mesh_contacts",
         fmt::format("{}: touches with its mesh's hull or height field{}; its coordinates add up to {:.17g}",
                     GeomName(geom), IsTorus(geom) ? ", spheres and boxes with the exact torus" : "", sum));
  }

  [[nodiscard]] bool IsTorus(int geom) const {
    double ring_radius = 0.0;
    double tube_radius = 0.0;
    return GetTorusRadii(engine_, geom, &ring_radius, &tube_radius);
  }

  /// The wheels are round about the axle and stand on a level floor.
  void CompareFloor() {
    const MjDataPtr data = MakeDataWithoutContacts(engine_);
    mj_kinematics(&engine_, data.get());
    const auto place = [&](int geom) {
      return Vector3d(Eigen::Map<const Vector3d>(data->geom_xpos + 3 * geom));
    };
    const auto axis = [&](int geom) {
      return Vector3d(Eigen::Map<const RowMatrix3d>(data->geom_xmat + 9 * geom).col(2));
    };
    for (const EngineWheel& wheel : adapter_.wheels()) {
      const Vector3d center = adapter_.model().base().X_B0 * wheel.center;
      const double tolerance = kConstantRounding * Worst(1.0, center.norm());
      for (int geom = 0; geom < engine_.ngeom; ++geom) {
        if (engine_.geom_bodyid[geom] != engine_.jnt_bodyid[wheel.joint] || !Touches(geom)) continue;
        Expect("wheel_geom_place", GeomName(geom), 0.0, (place(geom) - center).norm(), tolerance);
        if (engine_.geom_type[geom] != mjGEOM_SPHERE)
          Expect("wheel_geom_place", GeomName(geom), 1.0, std::abs(axis(geom).dot(wheel.axis)), tolerance);
        for (const int floor : FindFloors(geom)) {
          Expect("floor_pose", GeomName(floor), 1.0, axis(floor).z(), tolerance);
          Expect("floor_pose", GeomName(floor), 0.0, axis(floor).head<2>().norm(), tolerance);
          Expect("floor_pose", GeomName(floor), center.z() - wheel.radius, place(floor).z(), tolerance);
        }
      }
    }
  }

  /// Whether a geom takes part in contacts as the option "collision" has it.
  [[nodiscard]] bool Touches(int geom) const {
    bool touches = false;
    for (int pair = 0; pair < engine_.npair; ++pair)
      touches |= engine_.pair_geom1[pair] == geom || engine_.pair_geom2[pair] == geom;
    const bool by_type = engine_.geom_contype[geom] != 0 || engine_.geom_conaffinity[geom] != 0;
    return (touches && CollidesByPair(engine_)) || (by_type && CollidesByType(engine_));
  }

  /// Planes that a geom has a contact pair with.
  [[nodiscard]] std::set<int> FindFloors(int geom) const {
    std::set<int> floors;
    for (int pair = 0; pair < engine_.npair; ++pair) {
      const int geoms[2] = {engine_.pair_geom1[pair], engine_.pair_geom2[pair]};
      for (int k = 0; k < 2; ++k) {
        if (geoms[k] == geom && engine_.geom_type[geoms[1 - k]] == mjGEOM_PLANE) floors.insert(geoms[1 - k]);
      }
    }
    return floors;
  }

  void NoteContactsByType() {
    if (!CollidesByType(engine_)) return;
    Note("contacts_by_type",
         fmt::format("option collision {}: geoms touch by contype and conaffinity, but {} pairs of bodies",
                     GetCollisionOption(engine_), engine_.nexclude));
    for (int geom = 0; geom < engine_.ngeom; ++geom) {
      if (engine_.geom_contype[geom] == 0 && engine_.geom_conaffinity[geom] == 0) continue;
      Note("contacts_by_type",
           fmt::format("{}: contype {}, conaffinity {}, condim {}, priority {}, friction {}, margin {:.17g}, "
                       "gap {:.17g}, solmix {:.17g}, solref {}, solimp {}",
                       DescribeGeom(geom), engine_.geom_contype[geom], engine_.geom_conaffinity[geom],
                       engine_.geom_condim[geom], engine_.geom_priority[geom],
                       List(engine_.geom_friction + 3 * geom, 3), engine_.geom_margin[geom],
                       engine_.geom_gap[geom], engine_.geom_solmix[geom],
                       List(engine_.geom_solref + mjNREF * geom, mjNREF),
                       List(engine_.geom_solimp + mjNIMP * geom, mjNIMP)));
    }
    for (int i = 0; i < engine_.nexclude; ++i) {
      const auto [body1, body2] = ReadSignature(engine_.exclude_signature[i]);
      Note("contacts_by_type", fmt::format("excluded: {} and {}", NameOf(engine_, mjOBJ_BODY, body1),
                                           NameOf(engine_, mjOBJ_BODY, body2)));
    }
  }

  void NoteSettings() {
    const mjOption& option = engine_.opt;
    Note("overridden",
         fmt::format("a run sets the time step ({:.17g} s here), impratio ({:.17g}), noslip iterations ({}) "
                     "and the stiffness of all contact pairs; joint damping acts as an explicit force",
                     option.timestep, option.impratio, option.noslip_iterations));
    Note("solver",
         fmt::format(
             "integrator {}, cone {}, jacobian {}, solver {}, iterations {}, tolerance {:.17g}, noslip "
             "tolerance {:.17g}, mpr iterations {}, mpr tolerance {:.17g}, mean inertia {:.17g}",
             option.integrator, option.cone, option.jacobian, option.solver, option.iterations,
             option.tolerance, option.noslip_tolerance, GetColliderIterations(option),
             GetColliderTolerance(option), engine_.stat.meaninertia));
  }

  const Adapter& adapter_;
  const mjModel& engine_;
  ConstantChecks* result_;
};

}  // namespace

void FindEngineOnly(const Adapter& adapter, ConstantChecks* result) { EngineOnly(adapter, result).Run(); }

}  // namespace dexcheck
